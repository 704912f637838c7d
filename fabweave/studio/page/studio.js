import { by, escaped, turnUp } from "../../show/scripts/html.js";
import { Controls } from "./controls.js";
import { History } from "./history.js";
import { Making } from "./making.js";
import { unpacked } from "./message.js";
import { cleaned, forAnotherModel, numbersIn, pin, pinned, toggleFace, toggleFastener } from "./options.js";
import { shortly, showNotes, showOutcome } from "./outcome.js";
import { Scene } from "./scene.js";
import { dragPieces, drawSheets, drawStrips } from "./sheets.js";
import { Shelf } from "./shelf.js";
import { UpHandle } from "./up.js";
import { Wishes } from "./wishes.js";

const TABS = ["strips", "sheets", "steps", "shelf"];
/** What a tap does, and how that is told. @type {Record<string, string>} */
const TOOLS = {
  choose: "",
  leave: "Tap faces to leave them out; red ones are left out.",
  fasten: "Tap crossings to fasten them. Black: fastened by the rule; red: by hand.",
  up: "Drag the arrow to what is to point up; it stops at the axes of the file. Tap it twice to have it as read.",
};
/** A picture on the shelf is so many pixels wide. */
const SHELF_PX = 360;

/** @typedef {import("./options.js").State} State */
/** @typedef {import("./options.js").Options} Options */
/** @typedef {Record<string, any>} Values */

/** Say what is to be known now. @param {string} text */
function hint(text, wrong = false) {
  by("hint").textContent = text;
  by("hint").classList.toggle("wrong", wrong);
}

/** The page: it shows one state, as far as the server has worked it out. */
class Studio {
  tool = "choose";
  yarns = false;
  #chosen = -1;
  // What was seen last: the header, its arrays, triangles by their digest; and what is planned.
  /** @type {Values | null} */
  seen = null;
  /** @type {Values} */
  #arrays = {};
  #have = "";
  /** @type {Values} */
  plan = {};

  /** @param {string} base @param {State & { folder: string }} given */
  constructor(base, given) {
    this.history = new History(base, { mesh: given.mesh, options: given.options });
    this.shelf = new Shelf(base);
    this.state = this.history.now;
    this.wishes = new Wishes(`ws://${location.host}${base}live`, {
      state: () => this.state, view: () => this.#view(), yarns: () => this.yarns, rough: () => this.#rough(),
      reached: () => hint(""),
      lost: () => hint("The studio does not answer. Is it still running? The page tries again.", true),
      told: (data) => this.#told(data), ended: (to) => this.#ended(to),
    });
    this.making = new Making(given.folder, this.wishes);
    this.controls = new Controls((control, said, keep) => this.#controlled(control, said, keep));
    this.scene = Scene.on(by("object"), { tapped: (hit) => this.#tapped(hit), arrowAt: (x, y) => this.#arrowAt(x, y) });
    this.up = this.scene && new UpHandle(this.scene, by("arrow"), {
      turn: () => this.seen?.turn, leaning: (text) => hint(`Up: ${text}`), chosen: (up) => this.set({ up }),
      usual: () => this.state.options.up && this.set({ up: null }),
    });
    by("no-space").hidden = Boolean(this.scene);
  }

  // ---- what is asked, and what is answered

  #view() {
    const { yarns, tool } = this;
    return { have: yarns ? "" : this.#have, yarns, faces: tool === "leave" };
  }

  #rough() {
    return this.plan.steps && this.plan.effort === "quick" && this.state.options.effort !== "quick";
  }

  /** @param {string | ArrayBuffer} data */
  #told(data) {
    const [head, found] = data instanceof ArrayBuffer ? unpacked(data) : [JSON.parse(data), null], { to, n } = head;
    if (!this.wishes.wanted(to, n)) return;
    if (head.progress) this.#progress(to, head.progress);
    else if (head.error) this.#failed(to, head.error);
    else if (to === "look" && found) this.#looked(head, found);
    else if (head.choice) this.#chose(head.choice);
    else if (to === "plan") this.#planned(head, found);
    else if (to === "make" && head.made) this.making.made(head);
    else if (head.design) this.#keep(head.design);
    if (head.done || head.stopped) this.wishes.ended(to, n, head.stopped);
  }

  /** @param {import("./wishes.js").To} to */
  #ended(to) {
    if (to === "make") this.making.ended();
    if (to === "designs") this.drawShelf();
    if (!this.wishes.waits("look", "plan", "designs")) by("busy").hidden = true;
  }

  /** @param {string} to @param {{ what: string, done: number, total: number }} progress */
  #progress(to, { what, done, total }) {
    const make = to === "make", bar = make ? by("job-progress") : by("busy").querySelector("progress");
    if (total > 1) [bar.max, bar.value] = [total, done];
    else bar.removeAttribute("value");
    (make ? by("job-text") : by("busy").querySelector("span")).textContent = what;
    if (!make) by("busy").hidden = false;
  }

  /** @param {string} to @param {string} text */
  #failed(to, text) {
    if (to === "make") return this.making.failed(text);
    hint(text, true);
    if (to === "look") by("outcome").classList.add("stale");
    if (to === "plan" && !this.plan.figures) by("verdict").querySelector("span").textContent = text.split("\n")[0];
    return undefined;
  }

  // ---- what is shown

  /** @param {Values} head @param {Values} found */
  #looked(head, found) {
    this.seen = head;
    this.#arrays = found;
    if (found.index) this.#have = this.yarns ? "" : head.shape;
    hint(head.better ? "This is a first answer. A better one is being searched for." : TOOLS[this.tool]);
    this.scene?.show(found, this.yarns);
    this.scene?.choose(-1);
    this.up?.reset();
    by("title").textContent = document.title = head.title;
    by("toml").href = URL.createObjectURL(new Blob([head.toml], { type: "application/toml" }));
    this.controls.draw(head.controls);
    showNotes(head.notes);
    this.#mark();
    document.body.dataset.seen = head.n;
  }

  /** Show the faces or the crossings that the tool is for. */
  #mark() {
    const { tool, plan, state: { options } } = this;
    this.scene?.showFaces(tool === "leave" ? this.#arrays : null, new Set(numbersIn(options.leave_out)));
    this.scene?.showDots(tool === "fasten", plan.fastened || [], numbersIn(options.fasten));
  }

  /** @param {Values} head @param {Values | null} found */
  #planned(head, found) {
    const flat = by("flat");
    if (head.figures) {
      this.plan = head;
      showOutcome(head);
      flat.classList.remove("stale");
      drawStrips(by("panel-strips"), head.pieces, Math.max(300, flat.clientWidth - 24));
      for (const name of ["sheets", "steps"]) by(`panel-${name}`).innerHTML = "<p>Coming …</p>";
    } else if (found && this.scene) {
      this.#arrays = { ...this.#arrays, ...found };
      if (found.index) this.#have = head.shape;
      this.scene.show(found);
      this.#mark();
    } else if (head.sheets) {
      Object.assign(this.plan, head);
      const how = head.effort === "quick" ? "nested quickly" : `nested by effort ${head.effort}`;
      drawSheets(by("panel-sheets"), this.plan, Math.max(110, flat.clientHeight - 36), pinned(this.state.options), how);
    } else if (head.steps) {
      this.plan.steps = head.steps;
      const rows = head.steps.map(({ pieces, text }) =>
        `<li><button type="button" data-id="${escaped(pieces[0] || "")}">${escaped(text)}</button></li>`);
      by("panel-steps").innerHTML = `<ol>${rows.join("")}</ol>`;
    }
    this.choose(this.#chosen);
  }

  /** Bring out a piece in space, on its sheet and in words; -1 for none. @param {number} piece */
  choose(piece) {
    const { pieces = [], placed = [], steps = [] } = this.plan, own = pieces[piece];
    this.#chosen = own ? piece : -1;
    this.scene?.choose(this.#chosen);
    for (const shape of by("flat").querySelectorAll(".piece"))
      shape.classList.toggle("chosen", Number(shape.dataset.piece) === this.#chosen);
    by("flat").querySelector("[role=tabpanel]:not([hidden]) .piece.chosen")?.scrollIntoView({ block: "nearest" });
    const place = placed.find(([number]) => number === piece);
    const step = own ? steps.findIndex((one) => one.pieces.includes(own.id)) : -1;
    const where = [place && `sheet ${place[1] + 1}`, step < 0 ? "" : `step ${step + 1}`];
    by("chosen").textContent = own ? [own.id, `kind ${own.kind}`, ...where].filter(Boolean).join(", ") : "";
  }

  /** Choose a piece by its name. @param {string} name */
  chooseNamed(name) {
    if (this.plan.pieces) this.choose(this.plan.pieces.findIndex(({ id }) => id === name));
  }

  // ---- changes

  /** Change the state; it can be undone once the change is kept. @param {State} next */
  change(next, keep = true) {
    this.state = cleaned(next);
    if (keep) this.history.add(this.state);
    this.#drawHistory();
    for (const id of ["outcome", "flat"]) by(id).classList.add("stale");
    this.wishes.changed();
  }

  /** Change some options. @param {Options} options */
  set(options, keep = true) {
    const { mesh, options: before } = this.state;
    this.change({ mesh, options: { ...before, ...options } }, keep);
  }

  /** Go on with the mesh on which make would weave the model. @param {{ options: Options, why: string }} choice */
  #chose({ options, why }) {
    this.set(options);
    hint(why);
  }

  /** Undo or do again so many changes. @param {number} steps */
  go(steps) {
    if (!this.history.has(steps)) return;
    this.history.go(steps);
    this.change(this.history.now, false);
  }

  #drawHistory() {
    by("undo").disabled = !this.history.has(-1);
    by("redo").disabled = !this.history.has(1);
  }

  /** @param {Values} control @param {string | null} said @param {boolean} keep */
  #controlled({ option, kind }, said, keep) {
    const { options } = this.state;
    if (option !== "mesh") this.set({ [option]: option === "sheet" && said ? [said] : said }, keep);
    else this.change({ mesh: said ?? "", options: kind === "choice" ? forAnotherModel(options) : options }, keep);
  }

  // ---- by hand

  /** @param {import("./scene.js").Hit | null} hit */
  #tapped(hit) {
    const { tool, state: { options } } = this;
    if (!hit) this.choose(-1);
    else if (tool === "choose" || tool === "up") this.choose(hit.piece ?? -1);
    else if (tool === "leave" && hit.face !== undefined) this.set(toggleFace(options, hit.face));
    else if (tool === "fasten" && hit.crossing !== undefined) this.set(toggleFastener(options, hit.crossing));
  }

  /** The arrow is drawn, and its tip is seen there. @param {number} x @param {number} y */
  #arrowAt(x, y) {
    by("arrow").hidden = false;
    by("arrow").style.transform = `translate(${x}px, ${y}px)`;
  }

  /**
   * Pin a piece where it was dragged to, or let it go again.
   *
   * @param {number} piece
   * @param {number[] | null} place
   */
  pin(piece, place) {
    this.set(pin(this.state.options, this.plan.pieces[piece].id, place));
  }

  /** @param {string} tool */
  take(tool) {
    this.tool = tool;
    for (const other of document.querySelectorAll("[data-tool]"))
      other.setAttribute("aria-pressed", String(other.getAttribute("data-tool") === tool));
    hint(TOOLS[tool]);
    by("arrow").hidden = true;
    this.scene?.showArrow(tool === "up");
    if (tool === "leave" && !this.#arrays.face) this.wishes.look();
    else this.#mark();
  }

  /** Show yarns instead of ribbons. @param {boolean} on */
  showYarns(on) {
    this.yarns = on;
    this.#have = "";
    this.wishes.look();
  }

  /** @param {boolean} on */
  darken(on) {
    document.documentElement.classList.toggle("dark", on);
    by("theme").textContent = on ? "Light" : "Dark";
    this.scene?.draw();
  }

  // ---- flat, shelf

  /** @param {string} name */
  openTab(name) {
    turnUp(TABS, name);
    this.choose(this.#chosen);
  }

  drawShelf() {
    this.shelf.draw(this.wishes.waits("designs"));
  }

  /** @param {import("./shelf.js").Variant} variant */
  #keep(variant) {
    this.shelf.keep(variant);
    this.drawShelf();
  }

  /** Let the server put designs of its own on the shelf. */
  tryDesigns() {
    this.wishes.ask("designs");
    this.drawShelf();
  }

  /** Take a variant off the shelf. @param {number} number */
  drop(number) {
    this.shelf.drop(number);
    this.drawShelf();
  }

  /** Put what is seen on the shelf. */
  keep() {
    const planned = this.plan.figures && !by("outcome").classList.contains("stale");
    const name = this.seen ? this.seen.title : this.state.mesh, picture = this.scene?.picture(SHELF_PX) ?? "";
    this.#keep({ name, state: this.state, words: planned ? shortly(this.plan) : "not planned yet", picture });
    this.openTab("shelf");
  }

  /** Read a file that was given. @param {File} file */
  async read(file) {
    hint(`Reading ${file.name} …`);
    try {
      const sent = await fetch(`take?name=${encodeURIComponent(file.name)}`, { method: "POST", body: file });
      const answer = await sent.json();
      if (answer.error) hint(answer.error, true);
      else this.change(answer);
    } catch {
      hint("The studio did not take the file. Is it still running?", true);
    }
  }

  async copyCommand() {
    const { command } = this.seen ?? {};
    try {
      await navigator.clipboard.writeText(command);
      hint(`Copied: ${command}`);
    } catch {
      hint(command);
    }
  }

  async end() {
    this.wishes.end();
    await fetch("end", { method: "POST" });
    document.body.innerHTML =
      "<main><p style='padding:2rem'>The studio has ended. This page can be closed.</p></main>";
  }

  /** Whether all is there that was asked for last. */
  get settled() {
    const { plan, wishes } = this, planned = plan.steps && (plan.sheets || !wishes.waits("plan"));
    return Boolean(planned && wishes.settled && !by("outcome").classList.contains("stale"));
  }

  /** Frames a second. */
  get fps() {
    return this.scene?.fps ?? 0;
  }

  begin() {
    this.#drawHistory();
    this.history.keep();
    this.drawShelf();
    this.wishes.connect();
  }
}

/** Give the buttons of the page their work. @param {Studio} studio */
function connect(studio) {
  const click = (id, act) => by(id).addEventListener("click", act);
  const toggle = (id, act) => click(id, () => {
    const on = by(id).getAttribute("aria-pressed") !== "true";
    by(id).setAttribute("aria-pressed", on);
    act(on);
  });
  for (const button of document.querySelectorAll("[data-tool]"))
    button.addEventListener("click", () => studio.take(button.getAttribute("data-tool") || ""));
  toggle("yarns", (on) => studio.showYarns(on));
  toggle("shadows", (on) => studio.scene?.shadows(on));
  click("theme", () => studio.darken(!document.documentElement.classList.contains("dark")));
  for (const tab of TABS) click(`tab-${tab}`, () => studio.openTab(tab));
  click("keep", () => studio.keep());
  click("undo", () => studio.go(-1));
  click("redo", () => studio.go(1));
  click("stop", () => studio.wishes.stop("look", "plan", "designs"));
  click("copy", () => studio.copyCommand());
  click("end", () => studio.end());
  click("flat", ({ target }) => {
    const { id, dataset } = target.closest(".piece, #try, [data-id], [data-kept], [data-gone]") ?? {};
    if (!dataset) return;
    if (id === "try") studio.tryDesigns();
    else if (dataset.piece) studio.choose(Number(dataset.piece));
    else if (dataset.id !== undefined) studio.chooseNamed(dataset.id);
    else if (dataset.kept) studio.change(studio.shelf.variant(Number(dataset.kept)).state);
    else studio.drop(Number(dataset.gone));
  });
  dragPieces(by("panel-sheets"), () => studio.plan, (place) => studio.pin(place[0], place));
  by("panel-sheets").addEventListener("dblclick", ({ target }) => {
    const shape = target.closest(".pinned");
    if (shape) studio.pin(Number(shape.dataset.piece), null);
  });
}

/** Let the page hear keys, and take files. @param {Studio} studio */
function listen(studio) {
  document.addEventListener("keydown", (event) => {
    const { target, ctrlKey, metaKey, shiftKey } = event, key = event.key.toLowerCase();
    if (!(ctrlKey || metaKey) || (key !== "z" && key !== "y")) return;
    if (target instanceof Element && target.matches("input[type=text], input[type=number]")) return;
    event.preventDefault();
    studio.go(key === "y" || shiftKey ? 1 : -1);
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

const given = await (await fetch("state")).json(), studio = new Studio(location.pathname, given);
connect(studio);
listen(studio);
studio.darken(matchMedia("(prefers-color-scheme: dark)").matches);
// For those who test the page or build on it.
Object.assign(window, { studio });
studio.begin();
