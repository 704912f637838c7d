import { isShortcut } from "../../scripts/gestures.js";
import { by, memory, turnUp } from "../../scripts/html.js";
import { Stage } from "../../scripts/stage.js";
import { colourBy, colourSchemes, legendOf } from "./colours.js";
import { Finding } from "./finding.js";
import { makeClock } from "./hands.js";
import { PiecePanel, SheetPanel, stepCard, StepsPanel } from "./panels.js";
import { Plan } from "./plan.js";
import { CHOSEN, FADED, FRESH, HIDDEN, LATER, PLAIN } from "./shaders.js";
import { Space } from "./space.js";

/** While a smaller share of all pieces is in place, the table is seen, and what is to come, as in the manual. */
const EARLY = 0.25;
/** While steps play, each is shown for so long. */
const PLAY_MS = 2600;
/** A picture on paper is so many pixels wide. */
const PRINT_PX = 2000;
const TABS = ["piece", "sheet", "steps"];
/** What can be set on what is seen of the object, and its reset. */
const SLIDERS = ["explode", "cut", "there", "later", "gone"];

/** @typedef {import("./plan.js").Values} Values */

/**
 * What is shown.
 *
 * @typedef {object} State
 * @property {boolean} stepwise
 * @property {number} step
 * @property {number} piece The chosen one; -1 for none.
 * @property {number} station
 * @property {number} sheet
 * @property {number} zoom
 * @property {boolean} labels
 * @property {boolean} follow
 * @property {number} later How dense what is to come is asked for.
 * @property {boolean} table
 * @property {string} scheme
 * @property {{ name: string, pieces: Set<number> } | null} only What is shown alone.
 * @property {Set<number>} done
 */

/** The page: what is chosen in one of its parts is shown in all. */
class Page {
  #playing = 0;
  /** @type {import("./colours.js").Colouring} */
  colouring = { runs: [], flat: [] };

  constructor() {
    const plan = this.plan = new Plan(by("data").textContent);
    this.memory = memory(() => localStorage, `fabweave:${plan.data.job}`);
    this.last = plan.steps.length;
    this.schemes = Object.keys(colourSchemes(plan));
    this.state = this.#firstState();
    this.clock = makeClock(plan.data.hands);
    this.panels = { piece: new PiecePanel(plan), sheet: new SheetPanel(plan), steps: new StepsPanel(plan, this.clock) };
    this.finding = new Finding(plan, (hit) => this.take(hit));
    const stage = Stage.on(by("object"));
    this.space = stage && new Space(stage, by("labels"), plan, {
      chosen: (piece) => this.choose(piece), seen: (words) => (by("spoken").textContent = words),
    });
  }

  /** What is remembered of the last visit, as far as it makes sense. @returns {State} */
  #firstState() {
    const kept = this.memory.read() ?? {}, ticked = Array.isArray(kept.done) ? kept.done : [];
    return {
      stepwise: kept.stepwise === true,
      step: Math.max(1, Math.min(this.last, Number(kept.step) || 1)),
      piece: -1, station: -1, sheet: 0, zoom: 1, labels: false, follow: true, later: 0, table: true,
      scheme: this.schemes.includes(kept.scheme) ? kept.scheme : "job",
      only: null,
      done: new Set(ticked.filter((step) => step >= 1 && step <= this.last)),
    };
  }

  /** The step that is shown. */
  get step() {
    return this.plan.steps[this.state.step - 1];
  }

  /** The piece that the panels show: the chosen one, or the first of this step; -1 for none. */
  get subject() {
    const { piece, stepwise } = this.state;
    return piece >= 0 || !stepwise ? piece : this.plan.piecesOf(this.step)[0] ?? -1;
  }

  /** Keep what was done, and say in the address what is shown. */
  remember() {
    const { stepwise, step, scheme, done, piece } = this.state;
    this.memory.write({ stepwise, step, scheme, done: [...done].sort((a, b) => a - b) });
    const parts = [stepwise ? `step=${step}` : "", piece < 0 ? "" : `piece=${this.plan.pieces[piece].id}`];
    const address = `#${parts.filter(Boolean).join("&")}`;
    if (location.hash === address || (address === "#" && !location.hash)) return;
    try {
      history.replaceState(null, "", address);
    } catch {
      // Some browsers refuse that for files; the page works without.
    }
  }

  /** Show what the address names; what it does not name stays as it was. */
  readAddress() {
    const asked = new URLSearchParams(location.hash.slice(1)), step = Number(asked.get("step"));
    const piece = this.plan.pieceAt.get(asked.get("piece"));
    if (Number.isInteger(step) && step >= 1 && step <= this.last) this.goTo(step);
    else if (asked.has("piece")) this.state.stepwise = false;
    if (piece !== undefined) this.choose(piece, -1, true);
  }

  /** While few pieces are in place, the object stands on the table, and what is to come is a ghost. */
  #early() {
    const { table, stepwise, step } = this.state, { stepOf, pieces } = this.plan;
    return table && stepwise && stepOf.filter((own) => own < step - 1).length < EARLY * pieces.length;
  }

  /** How each piece is shown: step by step, or the whole object with one piece brought out. */
  codes() {
    const veiled = this.state.later || this.#early(), { stepwise, step, piece, only } = this.state;
    return Array.from(this.plan.stepOf, (own, number) => {
      const away = step - 1 - own;
      if (number === piece && (!stepwise || away >= 0)) return CHOSEN;
      if (only && !only.pieces.has(number)) return HIDDEN;
      if (!stepwise) return piece < 0 ? PLAIN : FADED;
      if (away < 0) return veiled ? LATER : HIDDEN;
      return away > 0 ? FADED : FRESH;
    });
  }

  /**
   * What is written over the object: on what is brought out, and on all if that is asked for.
   *
   * @param {number[]} how
   */
  #labels(how) {
    const all = this.state.labels || this.state.only, out = (code) => code === FRESH || code === CHOSEN;
    const order = how.map((code, piece) => ({ piece, code, text: this.plan.bears(piece), strong: out(code) }));
    return order.filter(({ code, strong }) => strong || (all && code !== HIDDEN && code !== LATER))
      .sort((a, b) => b.code - a.code);
  }

  /** Show everything as it is now. */
  update() {
    const how = this.codes(), { state, plan, space, subject } = this, { only } = state;
    document.body.dataset.step = state.stepwise ? String(state.step) : "";
    document.body.dataset.piece = state.piece < 0 ? "" : plan.pieces[state.piece].id;
    const pressed = {
      "mode-whole": !state.stepwise && !only, "mode-steps": state.stepwise,
      "show-labels": state.labels, follow: state.follow, play: this.#playing > 0,
    };
    for (const [id, on] of Object.entries(pressed)) by(id).setAttribute("aria-pressed", on);
    by("play").textContent = this.#playing ? "Pause" : "Play";
    by("only").hidden = !only;
    by("only").textContent = only ? `${only.name} \u00d7` : "";
    if (space) {
      space.stand(this.#early(), state.table && state.stepwise && state.step < plan.data.former.until);
      space.show(how, this.#labels(how), state.station < 0 ? null : [subject, state.station]);
    }
    this.#showStep();
    this.panels.piece.show(subject, state);
    this.panels.sheet.show(how, state);
    this.panels.steps.show(state);
  }

  #showStep() {
    const { step, stepwise, done } = this.state, card = by("step-text");
    by("slider").value = step;
    by("step-number").textContent = `${step} / ${this.last}`;
    by("done").checked = done.has(step);
    document.body.classList.toggle("stepwise", stepwise);
    by("back").disabled = stepwise && step === 1;
    by("forward").disabled = stepwise && step === this.last;
    by("left").textContent = this.panels.steps.left(done);
    if (card.dataset.step === String(step)) return;
    card.dataset.step = step;
    card.innerHTML = stepCard(this.plan, this.clock, step);
    card.scrollTop = 0;
  }

  /** Bring out a piece, and one of its stations; -1 for none. @param {number} piece */
  choose(piece, station = -1, look = false) {
    const { state, plan } = this;
    [state.piece, state.station] = [piece, station];
    if (piece >= 0) {
      if (state.only && !state.only.pieces.has(piece)) state.only = null;
      state.sheet = plan.sheetAt.get(plan.pieces[piece].sheet);
      // A piece that is laid later is shown where it is laid.
      if (state.stepwise && plan.stepOf[piece] >= state.step) state.step = plan.stepOf[piece] + 1;
      if (!by("panel-steps").hidden) turnUp(TABS, "piece");
    }
    this.remember();
    this.update();
    if (look && state.follow && piece >= 0) this.space?.face(piece, station);
  }

  /** Point out a station of the piece that the panels show. @param {number} station */
  mark(station) {
    const { state } = this;
    state.station = state.station === station ? -1 : station;
    this.update();
    if (state.follow && state.station >= 0) this.space?.face(this.subject, station);
  }

  /**
   * Show some pieces alone, such as those of a thread; of a sheet, with where they lie on it.
   *
   * @param {Values} group
   */
  isolate({ name, members, sheet }) {
    const { state, plan } = this;
    this.play(false);
    Object.assign(state, { only: { name, pieces: new Set(members) }, stepwise: false, piece: -1, station: -1 });
    state.sheet = sheet ?? plan.sheetAt.get(plan.pieces[members[0]].sheet);
    if (sheet !== undefined) turnUp(TABS, "sheet");
    this.remember();
    this.update();
  }

  showAll() {
    this.state.only = null;
    this.update();
  }

  /** Go to what was found. @param {Values} hit */
  take({ piece, station = -1, members, step, ...more }) {
    if (members) this.isolate({ members, ...more });
    else if (step !== undefined) this.goTo(step);
    else this.choose(piece, station, true);
  }

  /** Show a step; those who ask for it see its pieces come. @param {number} step */
  goTo(step) {
    const { state, plan } = this, { stepwise, step: before } = state;
    const to = Math.max(1, Math.min(this.last, step));
    Object.assign(state, { stepwise: true, only: null, step: to, piece: -1, station: -1 });
    const [piece] = plan.piecesOf(this.step);
    if (piece !== undefined) state.sheet = plan.sheetAt.get(plan.pieces[piece].sheet);
    this.remember();
    this.update();
    this.follow();
    if (!stepwise || to === before + 1) this.show();
  }

  /** See this step from where the manual shows it; a step that it does not show, from where it is seen. */
  follow() {
    const view = this.plan.data.views_deg[this.state.step - 1], [piece] = this.plan.piecesOf(this.step);
    if (!this.state.follow || !this.state.stepwise || piece === undefined) return;
    if (view) this.space?.follow(piece, view);
    else this.space?.face(piece, -1);
  }

  /** Let the pieces of this step come to their places. */
  show() {
    if (this.state.stepwise) this.space?.fly(this.step, this.plan.piecesOf(this.step));
  }

  /** Go from step to step, or stop. @param {boolean} on */
  play(on) {
    clearInterval(this.#playing);
    this.#playing = 0;
    if (!on) return;
    this.#playing = setInterval(() => {
      this.goTo(this.state.step + 1);
      if (this.state.step < this.last) return;
      this.play(false);
      this.update();
    }, PLAY_MS);
    this.goTo(this.state.step < this.last ? this.state.step : 1);
    this.show();
  }

  /** Play, or pause. */
  playOrPause() {
    this.play(!this.#playing);
    this.update();
  }

  /** Go to a step as somebody asks: what plays, stops. @param {number} step */
  visit(step) {
    this.play(false);
    this.goTo(step);
  }

  /**
   * Go on by so many steps; from the whole object, to the step that was shown last.
   *
   * @param {number} steps
   */
  next(steps) {
    this.visit(this.state.stepwise ? this.state.step + steps : this.state.step);
  }

  /** Show the whole object. */
  whole() {
    this.play(false);
    this.state.stepwise = false;
    this.remember();
    this.showAll();
  }

  /** @param {number} step @param {boolean} done */
  setDone(step, done) {
    if (done === this.state.done.has(step)) return;
    if (done) this.state.done.add(step);
    else this.state.done.delete(step);
    this.remember();
    this.update();
  }

  /** @param {string} name */
  openTab(name) {
    turnUp(TABS, name);
    this.update();
  }

  /** Turn over so many sheets. @param {number} sheets */
  turnSheet(sheets) {
    const count = this.plan.sheets.length;
    this.state.sheet = (this.state.sheet + sheets + count) % count;
    this.update();
  }

  /** @param {number} factor */
  zoomSheet(factor) {
    this.state.zoom = Math.max(1, Math.min(16, this.state.zoom * factor));
    this.update();
  }

  /** Colour everything by what somebody chose. @param {string} scheme */
  paint(scheme) {
    this.state.scheme = scheme;
    this.colouring = colourBy(this.plan, scheme);
    this.plan.colour = this.colouring.flat;
    by("colours").value = scheme;
    by("legend").innerHTML = legendOf(this.colouring);
    this.space?.colour(this.colouring.runs);
  }

  /** Nothing is chosen, and all is shown. */
  clear() {
    this.finding.close();
    by("view").open = false;
    this.state.only = null;
    this.choose(-1);
  }
}

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

/** What keys do. @type {Record<string, (page: Page) => void>} */
const KEYS = {
  ArrowRight: (page) => page.next(1), ArrowLeft: (page) => page.next(-1),
  PageDown: (page) => page.next(1), PageUp: (page) => page.next(-1),
  Home: (page) => page.visit(1), End: (page) => page.visit(page.last),
  d: (page) => page.setDone(page.state.step, !page.state.done.has(page.state.step)),
  p: (page) => page.playOrPause(), a: (page) => page.show(), l: () => by("show-labels").click(),
  "/": () => by("query").focus(), "?": () => by("keys").showModal(),
};

/** Let the page hear taps, and what is typed. @param {Page} page */
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

/** Give the buttons of steps, tabs and colours their work. @param {Page} page */
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

/** Give the sliders and boxes of the view their work. @param {Page} page @param {Space} space */
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

/** How much of everything the job has. @param {Plan} plan */
function facts({ pieces, spares, plan: { joints }, sheets }) {
  const some = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;
  return [
    `${pieces.length} pieces`, ...(spares.length ? [some(spares.length, "spare")] : []), `${joints.length} joints`,
    some(sheets.length, sheets[0].roll_mm ? "roll" : "sheet"),
  ].join(", ");
}

const page = new Page(), { plan, space, state, clock } = page;
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
