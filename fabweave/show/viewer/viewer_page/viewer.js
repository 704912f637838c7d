import { by, memory, turnUp } from "../../scripts/html.js";
import { Stage } from "../../scripts/stage.js";
import { BusyHands } from "./busy_hands.js";
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
export const TABS = ["piece", "sheet", "steps"];

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

/** What is chosen in one part of the page is shown in all. */
export class Viewer {
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
    this.hands = new BusyHands(by("step-text"), (steps) => this.next(steps));
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
   * What is written over the object: on what is brought out and on what a step says that it meets,
   * and on all if that is asked for.
   *
   * @param {number[]} how
   */
  #labels(how) {
    const all = this.state.labels || this.state.only, out = (code) => code === FRESH || code === CHOSEN;
    const { stepwise, step } = this.state, met = stepwise ? this.plan.metIn(this.plan.steps[step - 1]) : new Set();
    const order = how.map((code, piece) => ({ piece, code, text: this.plan.bears(piece), strong: out(code) }));
    const shown = (/** @type {typeof order[0]} */ { piece, code }) =>
      (all || met.has(piece)) && code !== HIDDEN && code !== LATER;
    return order.filter((one) => one.strong || shown(one))
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
    this.sayStep();
  }

  /** Say a step aloud, if that is asked for. */
  sayStep() {
    const { step, pieces, text } = this.step;
    this.hands.say(this.state.stepwise && by("read").checked ? `Step ${step}. ${pieces.join(" ")}. ${text}` : "");
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
    this.hands.stayAwake();
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
