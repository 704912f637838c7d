import { by } from "../../show/scripts/html.js";
import { taste } from "./session.js";
import { dragPieces, kept, pinnedByKey } from "./sheets.js";

/** @typedef {any} Studio The page. */

const click = (id, act) => by(id).addEventListener("click", act);

const toggle = (id, act) => click(id, () => {
  const on = by(id).getAttribute("aria-pressed") !== "true";
  by(id).setAttribute("aria-pressed", on);
  act(on);
});

/** Buttons of the header, the tools and dialogs. @param {Studio} studio */
function connectButtons(studio) {
  for (const button of document.querySelectorAll("[data-tool]"))
    button.addEventListener("click", () => studio.hold(button.getAttribute("data-tool") || ""));
  toggle("yarns", (on) => studio.showYarns(on));
  toggle("shadows", (on) => studio.scene?.shadows(on));
  toggle("stage", (on) => studio.stage(on));
  click("theme", () => {
    const dark = !document.documentElement.classList.contains("dark");
    taste.write({ dark });
    studio.darken(dark);
  });
  by("radius").addEventListener("input", () => studio.wishes.look());
  by("form").addEventListener("input", () => studio.letGo(Number(by("form").value)));
  click("keep", () => studio.keep());
  click("undo", () => studio.go(-1));
  click("redo", () => studio.go(1));
  click("home", () => (location.hash = "home"));
  window.addEventListener("hashchange", () => location.hash.slice(1) !== studio.session.name && location.reload());
  click("stop", () => studio.wishes.stop("look", "plan", "choose"));
  click("copy", () => studio.copyCommand());
  click("share", () => studio.share());
  click("end", () => studio.askEnd());
  click("end-now", () => studio.end());
  for (const button of document.querySelectorAll("[data-close]"))
    button.addEventListener("click", () => button.closest("dialog")?.close());
}

/** What is tapped below the object and beside it. @param {Studio} studio */
function connectPanels(studio) {
  const act = ({ id, dataset }) => {
    if (id === "try") studio.tryDesigns();
    else if (id === "own-mesh") studio.set({ remesh: "none" });
    else if (dataset.card) studio.take(Number(dataset.card));
    else if (dataset.zoom) studio.zoom(Number(dataset.zoom));
    else if (dataset.piece) studio.choose(Number(dataset.piece));
    else if (dataset.id !== undefined) studio.chooseNamed(dataset.id);
    else if (dataset.kept) studio.change(studio.session.kept[Number(dataset.kept)].state);
    else if (dataset.gone) studio.drop(Number(dataset.gone));
  };
  click("flat", ({ target }) => {
    const found = target.closest(
      ".piece, #try, #own-mesh, [data-id], [data-kept], [data-gone], [data-card], [data-zoom]");
    if (found) act(found);
  });
  const cure = ({ target }) => {
    const { fix, trouble } = target.closest("[data-fix], [data-trouble]")?.dataset ?? {};
    if (fix) studio.set(JSON.parse(fix));
    if (trouble) studio.colour(target.closest("[aria-pressed=true]") ? "" : trouble);
    if (target.id === "take-back") studio.go(-1);
    if (target.id === "go-on") studio.goOnWorking();
  };
  click("outcome", cure);
  click("message", cure);
}

/** Pieces on sheets and strips, by hand and by keys. @param {Studio} studio */
function connectPieces(studio) {
  const panel = by("panel-sheets");
  dragPieces(panel, () => studio.plan, (place) => studio.pin(place[0], place));
  panel.addEventListener("dblclick", ({ target }) => {
    const shape = target.closest(".pinned");
    if (shape) studio.pin(Number(shape.dataset.piece), null);
  });
  by("flat").addEventListener("keydown", (event) => {
    const shape = event.target.closest?.(".piece");
    if (!shape || event.ctrlKey || event.metaKey || event.altKey) return;
    const number = Number(shape.dataset.piece), { plan } = studio, sheet = shape.closest("[data-sheet]")?.dataset.sheet;
    const steps = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key] ?? 0;
    if (event.key === "Enter" || event.key === " ") studio.choose(number);
    else if (steps && !event.shiftKey) {
      const all = [...shape.closest("[role=tabpanel]").querySelectorAll(".piece")];
      const next = all[(all.indexOf(shape) + steps + all.length) % all.length];
      next.focus();
      studio.choose(Number(next.dataset.piece));
    } else if (sheet !== undefined) {
      const place = pinnedByKey(event, plan.placed.find(([piece]) => piece === number));
      if (place === undefined) return;
      studio.pin(number, place && kept(place, plan.pieces[number].outline, plan.sheets[Number(sheet)]));
    } else return;
    event.preventDefault();
  });
}

/** Arrow keys go from tab to tab, as people of tabs expect. @param {Studio} studio */
function connectTabs(studio) {
  const tabs = [...by("tabs").querySelectorAll("[role=tab]")], names = tabs.map(({ id }) => id.replace("tab-", ""));
  tabs.forEach((tab, k) => tab.addEventListener("click", () => studio.openTab(names[k])));
  by("tabs").addEventListener("keydown", ({ key, target }) => {
    const at = tabs.indexOf(target), steps = { ArrowRight: 1, ArrowLeft: -1 }[key] ?? 0;
    const next = key === "Home" ? 0 : key === "End" ? tabs.length - 1 : at + steps;
    if (at < 0 || next === at) return;
    const to = (next + tabs.length) % tabs.length;
    studio.openTab(names[to]);
    tabs[to].focus();
  });
}

/** Give the buttons of the page their work. @param {Studio} studio */
export function connect(studio) {
  connectButtons(studio);
  connectPanels(studio);
  connectPieces(studio);
  connectTabs(studio);
}

/** Let the page hear keys, and take files. @param {Studio} studio */
export function listen(studio) {
  document.addEventListener("keydown", (event) => {
    const { target, ctrlKey, metaKey, shiftKey } = event, key = event.key.toLowerCase();
    if (!(ctrlKey || metaKey) || (key !== "z" && key !== "y")) return;
    if (target instanceof Element && target.matches("input[type=text], input[type=number]")) return;
    event.preventDefault();
    studio.go(key === "y" || shiftKey ? 1 : -1);
  });
  by("object").addEventListener("keydown", (event) => {
    const key = event.key === " " ? "enter" : event.key.toLowerCase();
    if (event.ctrlKey || event.metaKey || event.altKey || !["n", "p", "enter"].includes(key)) return;
    event.preventDefault();
    studio.key(key);
  });
  by("open").addEventListener("change", () => {
    const [file] = by("open").files;
    if (file) studio.read(file);
    by("open").value = "";
  });
  const over = (on) => document.body.classList.toggle("drop", on);
  document.addEventListener("dragover", (event) => {
    event.preventDefault();
    over(true);
  });
  document.addEventListener("dragleave", (event) => event.relatedTarget || over(false));
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    over(false);
    const file = event.dataTransfer?.files[0];
    if (file) studio.read(file);
  });
}
