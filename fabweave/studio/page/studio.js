import { by, escaped, turnUp } from "../../show/scripts/html.js";
import { CARD_PX, Cards } from "./cards.js";
import { Controls } from "./controls.js";
import { Cut } from "./cut.js";
import { connect, listen } from "./hands.js";
import { Making } from "./making.js";
import { unpacked } from "./message.js";
import { cleaned, forAnotherModel, numbersIn, pin, pinned, toggleFace, toggleFastener } from "./options.js";
import { changes, curesOf, shortly, showNotes, showOutcome, showTrouble } from "./outcome.js";
import { Scene } from "./scene.js";
import { Session, taste } from "./session.js";
import { drawSheets, drawStrips } from "./sheets.js";
import { drawKept } from "./shelf.js";
import { Start } from "./start.js";
import { UpHandle } from "./up.js";
import { Wishes } from "./wishes.js";

export const TABS = ["choices", "strips", "sheets", "steps", "kept"];
/** What a tap does, and how that is told. @type {Record<string, string>} */
const TOOLS = {
  choose: "Drag to turn, scroll or pinch to come nearer, tap a strand to see its piece.",
  leave: "Tap faces to leave them out; red ones are left out. Keys: N and P go on and back, Enter takes one.",
  fasten: "Tap crossings to fasten them. Black: fastened by the rule; red: by hand. Keys: N, P, Enter.",
  up: "Drag the arrow to what is to point up; it stops at the axes of the file. Tap it twice to have it as read.",
};
/** What is being done, in words. @type {Record<string, string>} */
const DOING = {
  mesh: "Reading the model", designs: "Trying meshes for it", likeness: "Measuring how like the model it is",
  ribbons: "Laying ribbons", weave: "Weaving", checks: "Checking the strips", pieces: "Cutting to pieces",
  nesting: "Laying pieces on sheets", form: "Letting it go", twill: "Searching a twill", widths: "Fitting widths",
  fairing: "Smoothing the mesh", voting: "Voting over and under", "straight strips": "Straightening strips",
};
/** Pictures of variants and of recent work are so many pixels wide. */
const KEPT_PX = 320;
/** What takes longer has a bar. */
const BUSY_MS = 350;
/** A picture that is passed on. */
const SHARED_PX = 2000;
/** How far it goes when it is let go is shown larger, so that the most is such a share of its size. */
const SEEN_MOVE = 0.05, MOST_TIMES = 10;
/** How much larger sheets become by a tap. */
const ZOOM = 1.5;

/** @typedef {import("./options.js").State} State */
/** @typedef {import("./options.js").Options} Options */
/** @typedef {Record<string, any>} Values */

/**
 * Say what is to be known now.
 *
 * @param {string} text
 * @param {Values[]} [fixes] What cures it.
 */
function hint(text, wrong = false, fixes = []) {
  by("hint").textContent = text;
  by("hint").classList.toggle("wrong", wrong);
  by("cures").innerHTML = curesOf(fixes);
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
  // What is shown of trouble, and how large sheets are; of which model the choices are.
  #trouble = "";
  #zoom = 1;
  #choicesOf = "";
  #busy = 0;
  cards = new Cards();

  /** @param {string} base @param {{ folder: string }} given @param {Session} session */
  constructor(base, given, session) {
    this.folder = given.folder;
    this.session = session;
    this.state = session.now ?? { mesh: "", options: {} };
    this.wishes = new Wishes(`ws://${location.host}${base}live`, {
      state: () => this.state, view: () => this.#view(), yarns: () => this.yarns, rough: () => this.#rough(),
      begun: () => Boolean(this.state.mesh), raw: () => Boolean(this.seen?.raw), reached: () => hint(""),
      lost: () => hint("The studio does not answer. Is it still running? The page tries again.", true),
      told: (data) => this.#told(data), ended: (to, stopped) => this.#ended(to, stopped),
    });
    this.start = new Start({
      open: (state) => this.open(state), goOn: (name) => this.goOn(name), read: (file) => this.read(file),
    });
    this.making = new Making(given.folder, this.wishes);
    this.cut = new Cut(() => this.plan);
    this.controls = new Controls((...said) => this.#controlled(...said), (text) => hint(text, true));
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
    return { have: yarns ? "" : this.#have, yarns, radius: Number(by("radius").value), faces: tool === "leave" };
  }

  #rough() {
    return this.plan.steps && this.plan.effort === "quick" && this.state.options.effort !== "quick";
  }

  /** @param {string | ArrayBuffer} data */
  #told(data) {
    const [head, found] = data instanceof ArrayBuffer ? unpacked(data) : [JSON.parse(data), null], { to, n } = head;
    if (!this.wishes.wanted(to, n)) return;
    if (head.progress) this.#progress(to, head.progress);
    else if (head.error) this.#failed(to, head);
    else if (head.glance && found) this.#glanced(head, found);
    else if (to === "look" && found) this.#looked(head, found);
    else if (head.card) this.#tried(head.card, found ?? {});
    else if (head.choice) this.#chose(head.choice);
    else if (to === "plan") this.#planned(head, found);
    else if (to === "make" && head.made) this.making.made(head);
    if (head.done || head.stopped) this.wishes.ended(to, n, head.stopped);
  }

  /** @param {import("./wishes.js").To} to @param {boolean} stopped */
  #ended(to, stopped) {
    if (to === "make") this.making.ended();
    if (to === "choose") this.drawCards();
    if (!this.wishes.waits("look", "plan", "choose")) {
      clearTimeout(this.#busy);
      this.#busy = 0;
      by("busy").hidden = true;
    }
    if (stopped && to !== "make" && !this.wishes.waits("look", "plan", "choose")) this.#rested();
  }

  /** What was stopped can go on; nothing stays pale without a word. */
  #rested() {
    by("waiting").hidden = true;
    hint(this.seen?.raw ? "Stopped. Take one of the choices, or go on." : "Stopped. What is pale is of an earlier state.");
    by("cures").innerHTML = `<button type="button" id="go-on">Go on</button>`;
  }

  goOnWorking() {
    hint("");
    if (this.seen?.raw) this.wishes.ask("choose");
    else if (this.seen) this.wishes.plan();
    else this.wishes.look();
  }

  /** @param {string} to @param {{ what: string, done: number, total: number }} progress */
  #progress(to, { what, done, total }) {
    const make = to === "make", bar = make ? by("job-progress") : by("busy").querySelector("progress");
    if (this.start.open && !make) return;
    if (total > 1) [bar.max, bar.value] = [total, done];
    else bar.removeAttribute("value");
    const words = `${DOING[what] ?? what[0].toUpperCase() + what.slice(1)} …`;
    (make ? by("job-text") : by("busy").querySelector("span")).textContent = words;
    // What is there in a moment needs no bar.
    if (!make) this.#busy ||= setTimeout(() => (by("busy").hidden = false), BUSY_MS);
    if (!this.seen) this.#wait(words);
  }

  /** Say that something is on its way, where nothing is to be seen yet. @param {string} text */
  #wait(text) {
    by("waiting").textContent = text;
    by("waiting").hidden = !text;
  }

  /** @param {string} to @param {Values} head */
  #failed(to, { error, fixes }) {
    if (to === "make") return this.making.failed(error);
    this.#wait("");
    if (to === "choose" && this.start.open) return undefined;
    hint(error, true, fixes);
    if (this.session.has(-1)) by("cures").innerHTML += `<button type="button" id="take-back">Undo</button>`;
    if (to === "look") by("outcome").classList.add("stale");
    if (to === "plan" && !this.plan.figures) by("verdict").querySelector("span").textContent = error.split("\n")[0];
    for (const name of ["sheets", "steps"])
      if (to === "plan" && !this.plan[name]) by(`panel-${name}`).innerHTML = `<p>None: ${escaped(error)}</p>`;
    return undefined;
  }

  // ---- what is shown

  /** @param {Values} head @param {Values} found */
  #looked(head, found) {
    const opened = this.seen?.title !== head.title, another = opened || this.seen?.raw !== head.raw;
    this.seen = head;
    this.#arrays = found;
    this.#have = this.yarns || head.raw ? "" : found.index ? head.shape : this.#have;
    hint(head.better ? "This is a first answer. A better one is being searched for." : this.#why || TOOLS[this.tool]);
    if (!head.better) this.#why = "";
    this.#wait("");
    this.#forgetTrouble();
    if (this.scene) this.scene.thickMm = this.#valueOf("thickness");
    this.scene?.show(found, this.yarns);
    if (opened) this.scene?.seeFrom(head.view);
    if (another && !head.raw && !this.yarns) this.scene?.runIn();
    this.scene?.choose(-1);
    this.up?.reset();
    by("title").textContent = document.title = head.title;
    by("toml").href = URL.createObjectURL(new Blob([head.toml], { type: "application/toml" }));
    this.controls.draw(head.controls);
    showNotes(head.notes);
    if (head.raw) this.#begun(head);
    this.#mark();
    document.body.dataset.seen = head.n;
  }

  /** A large model as its file has it, while it is checked. @param {Values} head @param {Values} found */
  #glanced(head, found) {
    this.#wait("");
    hint("The model as its file has it. It is being checked …");
    this.scene?.show(found);
    this.scene?.seeFrom(head.view);
    document.body.dataset.glance = "1";
  }

  /** A model is there, and its mesh is to be chosen. @param {Values} head */
  #begun(head) {
    hint(`${head.title} as it comes: ${head.faces} faces. A mesh that can be woven is being looked for; what is found is shown at once.`);
    if (this.#choicesOf !== this.state.mesh) this.cards.clear();
    this.#choicesOf = this.state.mesh;
    this.plan = {};
    for (const id of ["reasons", "grade", "change", "trouble", "figures", "widths"]) by(id).innerHTML = "";
    by("verdict").querySelector("b").textContent = "";
    by("verdict").querySelector("span").textContent = "Looking for what can be built …";
    for (const name of ["strips", "sheets", "steps"]) by(`panel-${name}`).innerHTML = "<p>They come with the mesh.</p>";
    this.openTab("choices");
    this.drawCards();
  }

  /** A design was tried. @param {any} card @param {Values} found */
  #tried(card, found) {
    const wide = this.scene ? this.scene.picture(CARD_PX, found) : "";
    if (card.figures) {
      this.cards.add({ ...card, picture: wide });
      this.drawCards();
      // The best so far takes the place of the grey model.
      if (card.leads && this.seen?.raw && this.scene) {
        this.scene.show(found);
        this.scene.runIn();
        hint(`Best so far: ${card.name}. Take it below, or wait for a better one.`);
      }
    } else this.start.add({ ...card, picture: wide });
  }

  /** Show the faces or the crossings that the tool is for. */
  #mark() {
    const { tool, plan, state: { options } } = this;
    this.scene?.showFaces(tool === "leave" ? this.#arrays : null, new Set(numbersIn(options.leave_out)));
    this.scene?.showDots(tool === "fasten", plan.fastened || [], numbersIn(options.fasten));
  }

  /** @param {Values} head @param {Values | null} found */
  #planned(head, found) {
    if (head.figures) this.#figured(head);
    else if (found && this.scene) {
      this.#arrays = { ...this.#arrays, ...found };
      if (found.index) this.#have = head.shape;
      this.scene.show({ ...found, index: found.index ?? this.#arrays.index });
      this.plan.trouble = head.trouble;
      this.#mark();
      this.colour(this.#trouble in head.trouble ? this.#trouble : "");
      this.#showForm();
    } else if (head.sheets) {
      this.plan = { ...this.plan, ...head };
      this.drawSheets(true);
    } else if (head.steps) {
      this.plan.steps = head.steps;
      const rows = head.steps.map(({ pieces, text }) =>
        `<li><button type="button" data-id="${escaped(pieces[0] || "")}">${escaped(text)}</button></li>`);
      by("panel-steps").innerHTML = `<ol>${rows.join("")}</ol>`;
      this.#note();
    }
    this.choose(this.#chosen);
  }

  /** @param {Values} head */
  #figured(head) {
    const { figures: before, of } = this.plan, { state } = this, flat = by("flat");
    this.plan = { ...head, of: state };
    const change = before && of.mesh.split("?")[0] === state.mesh.split("?")[0] && of !== state;
    by("change").textContent = change ? changes(before, head.figures) : "";
    showOutcome(head);
    flat.classList.remove("stale");
    drawStrips(by("panel-strips"), head.pieces, Math.max(300, flat.clientWidth - 24));
    for (const name of ["sheets", "steps"]) by(`panel-${name}`).innerHTML = "<p>Coming …</p>";
  }

  drawSheets(falling = false) {
    const { plan } = this, flat = by("flat");
    if (!plan.sheets) return;
    const how = plan.effort === "quick" ? "nested quickly" : `nested by effort ${plan.effort}`;
    const high = this.#zoom * Math.max(110, flat.clientHeight - 80);
    this.cut.stop();
    drawSheets(by("panel-sheets"), plan, high, pinned(this.state.options), how, falling);
  }

  /** Make sheets larger or smaller. @param {number} steps */
  zoom(steps) {
    this.#zoom = Math.min(Math.max(this.#zoom * ZOOM ** steps, 1), 12);
    this.drawSheets();
  }

  /** Give what is flat the room of the object, and back. @param {boolean} on */
  stage(on) {
    document.body.classList.toggle("stage", on);
    requestAnimationFrame(() => {
      this.drawSheets();
      if (this.plan.pieces) drawStrips(by("panel-strips"), this.plan.pieces, Math.max(300, by("flat").clientWidth - 24));
    });
  }

  /** Colour the object by a trouble; as the material is by none. @param {string} rule */
  colour(rule) {
    this.#trouble = rule;
    showTrouble(this.plan.trouble ?? {}, rule);
    this.scene?.warm(rule ? this.#arrays[`heat_${rule}`] : null);
    by("legend").hidden = !rule;
  }

  #forgetTrouble() {
    by("trouble").innerHTML = "";
    by("legend").hidden = by("form-row").hidden = true;
    this.scene?.warm(null);
    this.scene?.letGo(0);
  }

  /** What a control of lengths has; 0 without one. @param {string} option */
  #valueOf(option) {
    return Number(this.seen?.controls.find((/** @type {Values} */ one) => one.option === option)?.value ?? 0);
  }

  /** The slider from what is cut to what it is when it is let go. */
  #showForm() {
    const moves = this.#arrays.moves ?? [], made = this.plan.drawn_mm != null;
    let most = 0;
    for (let k = 0; k < moves.length; k += 3) most = Math.max(most, Math.hypot(moves[k], moves[k + 1], moves[k + 2]));
    const size = Math.max(this.#valueOf("size"), 1);
    this.times = most ? Math.min(Math.max(Math.round((SEEN_MOVE * size) / most), 1), MOST_TIMES) : 1;
    by("form-row").hidden = !most;
    by("form-row").querySelector("span").textContent =
      `${made ? "As cut" : "As drawn"} … let go${this.times > 1 ? `, shown ${this.times} times as far` : ""}`;
    by("form").value = made ? 1 : 0;
    this.letGo(made ? 1 : 0);
  }

  /** What is made to settle onto the model is cut as far before it. @param {number} share */
  letGo(share) {
    this.scene?.letGo((this.times ?? 1) * (share - (this.plan.drawn_mm != null ? 1 : 0)));
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
    if (next.mesh !== this.state.mesh) this.#have = "";
    this.state = cleaned(next);
    this.start.show(false);
    if (keep) this.session.add(this.state);
    this.#drawHistory();
    for (const id of ["outcome", "flat"]) by(id).classList.add("stale");
    if (!this.seen) this.#wait("Reading the model …");
    this.wishes.changed();
    this.drawCards();
  }

  /** Change some options. @param {Options} options */
  set(options, keep = true) {
    const { mesh, options: before } = this.state;
    this.change({ mesh, options: { ...before, ...options } }, keep);
  }

  /** Begin with another model, in a session of its own. @param {State} state */
  open(state) {
    if (this.session.states.length) this.session = new Session();
    this.seen = null;
    this.plan = {};
    if (this.scene) this.scene.fabric.mesh.visible = false;
    this.change(state);
    drawKept(this.session.kept);
  }

  /** Go on with a session. @param {string} name */
  goOn(name) {
    location.hash = name;
    location.reload();
  }

  /** Go on with the mesh on which make would weave the model. @param {Values} choice */
  #chose({ options, why, roles }) {
    this.cards.name(roles);
    const usual = this.cards.all.find(({ role }) => role === "usual");
    this.#why = usual ? `Taken: ${usual.name}, the best of what was tried. Choices has others.` : why;
    // Undo goes to what was before the model, not to a model that is to be chosen for again.
    this.state = cleaned({ mesh: this.state.mesh, options: { ...this.state.options, ...options } });
    this.session.replace(this.state);
    this.change(this.state, false);
  }

  // Why the mesh is what it is, to be told with the object.
  #why = "";

  /** Take a design that was tried. @param {number} number */
  take(number) {
    this.change(this.cards.all[number].state);
  }

  /** Undo or do again so many changes. @param {number} steps */
  go(steps) {
    if (!this.session.has(steps)) return;
    this.session.go(steps);
    this.change(this.session.now, false);
  }

  #drawHistory() {
    by("undo").disabled = !this.session.has(-1);
    by("redo").disabled = !this.session.has(1);
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

  /** Keys on the object: go to the next strip, face or crossing, or take the one that is there. @param {string} key */
  key(key) {
    const { tool, scene, plan: { pieces = [] } } = this, steps = key === "n" ? 1 : key === "p" ? -1 : 0;
    if (!scene) return;
    if (tool === "leave" || tool === "fasten") {
      const here = scene.step(steps);
      if (!steps) this.#tapped({ [tool === "leave" ? "face" : "crossing"]: here });
    } else if (steps && pieces.length) this.choose((Math.max(this.#chosen, steps < 0 ? 0 : -1) + steps + pieces.length) % pieces.length);
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
  hold(tool) {
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
    by("thick").hidden = !on;
    this.wishes.look();
  }

  /** @param {boolean} on */
  darken(on) {
    document.documentElement.classList.toggle("dark", on);
    by("theme").textContent = on ? "Light" : "Dark";
    this.scene?.draw();
  }

  // ---- flat, choices, what is kept

  /** @param {string} name */
  openTab(name) {
    turnUp(TABS, name);
    for (const tab of TABS) by(`tab-${tab}`).tabIndex = tab === name ? 0 : -1;
    this.choose(this.#chosen);
  }

  drawCards() {
    if (this.state.mesh) this.cards.draw(this.state, this.wishes.waits("choose"));
  }

  /** Let the server try more designs. */
  tryDesigns() {
    this.wishes.ask("choose", { more: true });
    this.drawCards();
  }

  /** Take a variant away. @param {number} number */
  drop(number) {
    this.session.drop(number);
    drawKept(this.session.kept);
  }

  /** Keep what is seen. */
  keep() {
    const planned = this.plan.figures && !by("outcome").classList.contains("stale");
    const name = this.seen ? this.seen.title : this.state.mesh, picture = this.scene?.picture(KEPT_PX) ?? "";
    this.session.keep({ name, state: this.state, words: planned ? shortly(this.plan) : "not planned yet", picture });
    drawKept(this.session.kept);
    this.openTab("kept");
  }

  /** Let the list of recent work show this. */
  #note() {
    const { figures } = this.plan, hours = this.plan.hours || "hours not known";
    const picture = this.scene?.picture(KEPT_PX) ?? "";
    this.session.show({ title: this.seen?.title ?? "", words: `${figures.pieces} pieces, ${hours}`, picture });
  }

  /** Read a file that was given. @param {File} file */
  async read(file) {
    hint(`Reading ${file.name} …`);
    try {
      const sent = await fetch(`take?name=${encodeURIComponent(file.name)}`, { method: "POST", body: file });
      const answer = await sent.json();
      if (answer.error) this.#refused(answer.error);
      else this.open(answer);
    } catch {
      this.#refused("The studio did not take the file. Is it still running?");
    }
  }

  /** @param {string} text */
  #refused(text) {
    hint(text, true);
    if (this.start.open) by("start-drop").querySelector("span").textContent = text;
  }

  async copyCommand() {
    const { command } = this.seen ?? {};
    by("sharing").close();
    try {
      await navigator.clipboard.writeText(command);
      hint(`Copied: ${command}`);
    } catch {
      hint(command);
    }
  }

  share() {
    const picture = this.scene?.picture(SHARED_PX, null, "image/png");
    if (picture) by("share-picture").href = picture;
    by("share-picture").parentElement.hidden = !picture;
    by("share-made").innerHTML = this.making.links;
    by("sharing").showModal();
  }

  askEnd() {
    const job = this.wishes.waits("make") ? " The job that is being made stops, and nothing of it is written." : "";
    by("ending-text").textContent = `Your work is in ${this.folder}; the studio lists it when you start it there again.${job}`;
    by("ending").showModal();
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
    drawKept(this.session.kept);
    this.openTab("strips");
    this.start.show(!this.state.mesh);
    if (this.state.mesh) this.#wait("Waiting for the studio …");
    this.drawCards();
    this.wishes.connect();
  }
}

const given = await (await fetch("state")).json(), named = await Session.named(), session = named ?? new Session();
if (!named && given.mesh && location.hash !== "#home") session.add({ mesh: given.mesh, options: given.options });
const studio = new Studio(location.pathname, given, session);
connect(studio);
listen(studio);
const dark = taste.read()?.dark ?? matchMedia("(prefers-color-scheme: dark)").matches;
studio.darken(dark);
// For those who test the page or build on it.
Object.assign(window, { studio });
studio.begin();
