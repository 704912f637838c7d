import { isShortcut } from "../../scripts/gestures.js";
import { by } from "../../scripts/html.js";
import { TABS, Viewer } from "./viewer.js";

/** A picture on paper is so many pixels wide. */
const PRINT_PX = 2000;
/** What can be set on what is seen of the object, and its reset. */
const SLIDERS = ["explode", "cut", "there", "later", "gone"];

/** What is tapped says by its data what it stands for: what each of them does, the first that it has. */
const TAPS = {
  found: (page, { found }) => page.finding.choose(Number(found)),
  piece(page, { piece, at = "-1" }) {
    page.finding.close();
    page.choose(page.plan.pieceAt.get(piece), Number(at), true);
  },
  station: (page, { station }) => page.mark(Number(station)),
  sheet: (page) => page.openTab("sheet"),
  step: (page, { step }) => page.visit(Number(step)),
  move: (page, { move }) => page.space?.camera.move(move),
  group: (page, { group }) => page.isolate((page.colouring.groups || [])[Number(group)]),
  zoom: (page, { zoom }) => page.zoomSheet(Number(zoom)),
  turn: (page, { turn }) => page.turnSheet(Number(turn)),
};
const TAPPED = Object.keys(TAPS).map((name) => (name === "step" ? "button[data-step]" : `[data-${name}]`)).join(", ");

/** What keys do. @type {Record<string, (page: Viewer) => void>} */
const KEYS = {
  ArrowRight: (page) => page.next(1), ArrowLeft: (page) => page.next(-1),
  PageDown: (page) => page.next(1), PageUp: (page) => page.next(-1),
  Home: (page) => page.visit(1), End: (page) => page.visit(page.last),
  d: (page) => page.setDone(page.state.step, !page.state.done.has(page.state.step)),
  r: () => by("read").click(), p: (page) => page.playOrPause(), a: (page) => page.show(), l: () => by("show-labels").click(),
  "/": () => by("query").focus(), "?": () => by("keys").showModal(),
};

/** Let the page hear taps, and what is typed. @param {Viewer} page */
function listen(page) {
  document.addEventListener("click", ({ target }) => {
    if (!(target instanceof Element)) return;
    const hit = target.closest(TAPPED);
    if (!target.closest("#search")) page.finding.close();
    if (!target.closest("#view")) by("view").open = false;
    if (!hit || hit === document.body) return;
    const { dataset } = /** @type {HTMLElement} */ (hit);
    TAPS[Object.keys(TAPS).find((name) => dataset[name] !== undefined)](page, dataset);
  });
  document.addEventListener("keydown", (event) => {
    const { target, key } = event;
    if (by("keys").open || event.defaultPrevented || !(target instanceof Element)) return;
    if (key === "Escape") page.clear();
    else if (target.matches("input[type=search], input[type=range], select") || isShortcut(event)) return;
    else if (key === "Enter" && target.matches("[role=link]"))
      page.choose(page.plan.pieceAt.get(target.getAttribute("data-piece")), -1, true);
    else if (KEYS[key]) {
      event.preventDefault();
      KEYS[key](page);
    }
  });
  // On paper a canvas is blank: a picture stands for it, and is there before paper is laid out.
  window.addEventListener("beforeprint", () => {
    page.panels.sheet.show(page.codes(), page.state, true);
    if (page.space) by("picture").src = page.space.picture(PRINT_PX);
  });
  window.addEventListener("afterprint", () => by("picture").removeAttribute("src"));
  window.addEventListener("hashchange", () => page.readAddress());
}

/** Give the buttons of steps, tabs and colours their work. @param {Viewer} page */
function connect(page) {
  const { state } = page, on = (id, what, act) => by(id).addEventListener(what, act);
  on("panel-steps", "change", ({ target }) => page.setDone(Number(target.closest("li").dataset.step), target.checked));
  on("slider", "input", () => page.visit(Number(by("slider").value)));
  on("back", "click", () => page.next(-1));
  on("forward", "click", () => page.next(1));
  on("play", "click", () => page.playOrPause());
  on("done", "change", () => page.setDone(state.step, by("done").checked));
  on("mode-whole", "click", () => page.whole());
  on("mode-steps", "click", () => page.visit(state.step));
  on("read", "change", () => page.sayStep());
  on("only", "click", () => page.showAll());
  on("show-labels", "click", () => {
    state.labels = !state.labels;
    page.update();
  });
  on("follow", "click", () => {
    state.follow = !state.follow;
    page.update();
    page.follow();
  });
  on("colours", "change", () => {
    page.paint(by("colours").value);
    page.remember();
    page.update();
  });
  on("help", "click", () => by("keys").showModal());
  for (const tab of TABS) on(`tab-${tab}`, "click", () => page.openTab(tab));
}

/**
 * Give the sliders and boxes of the view their work.
 *
 * @param {Viewer} page
 * @param {import("./space.js").Space} space
 */
function connectView(page, space) {
  const { state, plan } = page, valueOf = (id) => Number(by(id).value);
  const ghost = () => {
    state.later = valueOf("later");
    space.ghost(valueOf("there"), state.later);
    page.update();
  };
  /** @type {Record<string, () => void>} */
  const slid = {
    explode: () => space.spread(valueOf("explode")), cut: () => space.cut(valueOf("cut")), there: ghost, later: ghost,
    gone() {
      by("let-go").querySelector("output").textContent = `\u00d7${by("gone").value}`;
      space.letGo(valueOf("gone"));
    },
  };
  for (const id of SLIDERS) by(id).addEventListener("input", slid[id]);
  for (const id of ["let-go", "swaying"]) by(id).hidden = !plan.data.space.let_go;
  by("sway").addEventListener("change", () => space.sway(by("sway").checked));
  by("table").addEventListener("change", () => {
    state.table = by("table").checked;
    page.update();
  });
  by("parallel").addEventListener("change", () => space.camera.straighten(by("parallel").checked));
  by("home").addEventListener("click", () => {
    by("sway").checked = false;
    space.sway(false);
    for (const id of SLIDERS) {
      by(id).value = by(id).defaultValue;
      slid[id]();
    }
    space.camera.move("home");
  });
  const paper = () => space.paper(getComputedStyle(by("space")).getPropertyValue("--paper").trim());
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paper);
  paper();
}

/** How much of everything the job has. @param {import("./plan.js").Plan} plan */
function facts({ pieces, spares, plan: { joints }, sheets }) {
  const some = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;
  return [
    `${pieces.length} pieces`, ...(spares.length ? [some(spares.length, "spare")] : []), `${joints.length} joints`,
    some(sheets.length, sheets[0].roll_mm ? "roll" : "sheet"),
  ].join(", ");
}

const page = new Viewer(), { plan, space, state, clock } = page;
listen(page);
connect(page);
by("slider").max = page.last;
for (const option of by("colours").options) option.hidden = !page.schemes.includes(option.value);
by("facts").textContent = facts(plan);
if (space) connectView(page, space);
else {
  document.body.classList.add("flat");
  by("no-space").hidden = false;
  by("no-space").textContent =
    "This browser cannot show 3-D (WebGL 2 is off or missing); pieces, sheets and steps work without it.";
}
page.paint(state.scheme);
page.update();
page.readAddress();
// For those who test the page or build on it.
Object.assign(window, { fabweave: {
  plan, state, clock, codes: () => page.codes(),
  get lens() {
    return space && space.camera.lens;
  },
  draw: () => space && space.draw(),
  pick: (x, y) => (space ? space.pick(x, y) : -1),
} });
