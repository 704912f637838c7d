import { by, escaped } from "../../scripts/html.js";
import { finder, letterHeight, middleOnSheet, pieceDrawing, sheetDrawing, sideSign, stationTable } from "./flat.js";
import { FRESH } from "./shaders.js";

/** @typedef {import("./plan.js").Plan} Plan */
/** @typedef {import("./plan.js").Values} Values */
/** @typedef {import("./hands.js").Clock} Clock */

/**
 * What to do at a step: its pieces, its text, what is fastened for good, and how long it takes.
 *
 * @param {Plan} plan
 * @param {Clock} clock
 * @param {number} number
 */
export function stepCard(plan, clock, number) {
  const step = plan.steps[number - 1], { step: leaving, until, told } = plan.data.former;
  const chips = step.pieces.map((id) => {
    return `<button type="button" class="chip" data-piece="${escaped(id)}">${escaped(plan.takenFor(id))}</button>`;
  });
  const ring = (step.ring || []).map((id) => `<span class="chip">${escaped(id)}</span>`);
  const places = plan.fastenings(step).map((crossing) => fastened(plan, crossing));
  const fasten = `<p class="fasten"><b>Fasten for good,</b> all layers are there: ${places.join("; ")}.</p>`;
  const out = leaving === number ? `<p>${escaped(told)}</p>` : "";
  const words = `${[...chips, ...ring].join(" ")} ${plan.linked(step.text)}`;
  const card = `<p>${words} <small class="hint">${clock.step(number)}</small></p>${places.length ? fasten : ""}`;
  return until === number ? out + card : card + out;
}

/** What a fastener holds. @param {Plan} plan @param {Values} crossing */
function fastened(plan, { id, over, under, count, hang }) {
  const [joint] = plan.jointsAt.get(id) || [];
  const side = ({ piece }) => {
    const ids = joint?.pieces.includes(piece) ? [...new Set(joint.pieces)] : [piece];
    return ids.map((one) => plan.link(one)).join(" and ");
  };
  const more = [joint ? ` (joint #${joint.id})` : "", count > 1 ? `, ${count} fasteners` : ""].join("");
  return `${side(over)} over ${side(under)}${more}${hang ? ", which carries a cord or a foot" : ""}`;
}

/** The panel of a piece, drawn when what it shows has changed. */
export class PiecePanel {
  #shown = "";

  /** @param {Plan} plan */
  constructor(plan) {
    this.plan = plan;
  }

  /**
   * @param {number} chosen
   * @param {import("./viewer.js").State} state
   */
  show(chosen, state) {
    const step = state.stepwise ? this.plan.steps[state.step - 1] : null;
    const key = `${chosen}:${state.station}:${step && step.step}:${state.scheme}`, panel = by("panel-piece");
    if (this.#shown === key) return;
    this.#shown = key;
    panel.innerHTML = chosen < 0 ? this.#hardest() : this.#piece(chosen, state.station, step);
    panel.querySelector("tr.chosen")?.scrollIntoView({ block: "nearest" });
  }

  /** What is said before a piece is chosen, with links to the hardest places. */
  #hardest() {
    const places = this.plan.data.worst.map(({ piece, crossing, text }) => {
      const at = this.plan.piece(piece).stations.findIndex((station) => station.crossing === crossing);
      return `<li>${this.plan.link(piece, at)} at crossing ${crossing} ${escaped(text)}</li>`;
    });
    const list = places.length ? `<h2>Hardest places</h2><ol id="worst">${places.join("")}</ol>` : "";
    return `<p class="hint">Choose a piece: tap it on the object or on its sheet, or search for its label.</p>${list}`;
  }

  /**
   * @param {number} number
   * @param {number} station
   * @param {Values | null} step
   */
  #piece(number, station, step) {
    const { plan } = this, piece = plan.pieces[number], thread = plan.thread(piece), at = plan.stepOf[number] + 1;
    const size = [0, 1].map((axis) => {
      const values = piece.outline.map((point) => point[axis]);
      return (Math.max(...values) - Math.min(...values)).toFixed(0);
    });
    const swatch = `<span class="swatch" style="background:${plan.colour[number]}"></span>`;
    const signs = step ? " Ringed: made at this step. Grey: not before a later one." : "";
    return `<h2>${swatch}${escaped(plan.named(number))}</h2>
      <p>Piece ${thread.pieces.indexOf(piece.id) + 1} of ${thread.pieces.length} of thread ${escaped(thread.label)}${
        plan.bunchWords(thread)}, ${size.join(" × ")} mm.
        <button type="button" class="link" data-sheet="${plan.sheetAt.get(piece.sheet)}">Sheet ${piece.sheet}</button>,
        <button type="button" class="link" data-step="${at}">step ${at}</button>.</p>
      ${pieceDrawing(plan, number, station, step)}
      <p class="hint">${sideSign(true)} over ${sideSign(false)} under, outer face up, &#9654; along the thread.${
        signs} Millimetres from the first crossing.</p>
      ${stationTable(plan, number, station, step)}`;
  }
}

/** The panel of a sheet, drawn when somebody sees it. */
export class SheetPanel {
  #shown = "";
  #zoom = 0;
  #sought = "";

  /** @param {Plan} plan */
  constructor(plan) {
    this.plan = plan;
  }

  /**
   * Show the sheet that is turned up.
   *
   * @param {number[]} how
   * @param {import("./viewer.js").State} state
   */
  show(how, state, printing = false) {
    const { plan } = this, panel = by("panel-sheet"), sheet = plan.sheets[state.sheet];
    if (panel.hidden && !printing) return;
    const key = `${state.sheet} ${state.scheme}`;
    if (this.#shown !== key) panel.innerHTML = this.#drawing(state.sheet);
    this.#shown = key;
    const drawing = by("sheet-box").firstChild;
    if (this.#zoom !== state.zoom || !drawing.style.width) drawing.style.width = `${100 * state.zoom}%`;
    this.#zoom = state.zoom;
    const letter = (letterHeight(plan, sheet) * drawing.clientWidth) / sheet.width_mm;
    drawing.classList.toggle("dense", letter < 7);
    const names = ["later", "", state.stepwise ? "laid" : "", "fresh", "chosen", "later"];
    for (const group of panel.querySelectorAll("g[data-piece]")) {
      const { piece } = group.dataset, chosen = piece === document.body.dataset.piece;
      group.setAttribute("class", chosen ? "chosen" : names[how[plan.pieceAt.get(piece)]]);
    }
    this.#seek(sheet, how, state, panel.hidden);
    by("sheet-hint").textContent = [
      sheet.mirrored ? "The pieces lie on their outer faces: their inner faces are engraved." : "",
      sheet.defects.length ? "Hatched: defects." : "",
      sheet.rest ? `Dashed: ${sheet.rest.name}, to be kept.` : "",
      state.stepwise ? "Ringed: this step. Grey: in place. White: still to come." : "",
    ].filter(Boolean).join(" ");
  }

  /** @param {number} number */
  #drawing(number) {
    const { sheet, width_mm, height_mm, stock } = this.plan.sheets[number];
    return `<p class="turner"><button type="button" data-turn="-1" aria-label="Previous sheet">&#9664;</button>
      <span>Sheet ${sheet} of ${this.plan.sheets.length}<br><small>${width_mm} × ${height_mm} mm${
        stock ? `, ${escaped(stock)}` : ""}</small></span>
      <button type="button" data-turn="1" aria-label="Next sheet">&#9654;</button>
      <button type="button" data-zoom="0.5" aria-label="Zoom out">&minus;</button>
      <button type="button" data-zoom="2" aria-label="Zoom in">+</button></p>
      <div id="sheet-box">${sheetDrawing(this.plan, number)}</div><p class="hint" id="sheet-hint"></p>`;
  }

  /**
   * Ring the pieces that are looked for, and bring the first of them into view.
   *
   * @param {Values} sheet
   * @param {number[]} how
   * @param {import("./viewer.js").State} state
   * @param {boolean} unseen
   */
  #seek(sheet, how, { piece: chosen, zoom }, unseen) {
    const box = by("sheet-box"), wanted = (number) => number === chosen || how[number] === FRESH;
    const sought = this.plan.pieces.filter((piece, number) => piece.sheet === sheet.sheet && wanted(number));
    by("finder").innerHTML = finder(this.plan, sheet, sought, zoom);
    const key = `${zoom} ${sought.map((piece) => piece.id)}`;
    if (sought.length && zoom > 1 && !unseen && this.#sought !== key) {
      const scale = box.firstChild.clientWidth / sheet.width_mm, [x, y] = middleOnSheet(sought[0], sheet);
      box.scrollTo(x * scale - box.clientWidth / 2, (sheet.height_mm - y) * scale - box.clientHeight / 2);
    }
    this.#sought = key;
  }
}

/** The list of steps, drawn when somebody sees it: of thousands only what has changed is touched. */
export class StepsPanel {
  /** @type {Set<number>} */
  #done = new Set();
  #here = 0;

  /** @param {Plan} plan @param {Clock} clock */
  constructor(plan, clock) {
    this.plan = plan;
    this.clock = clock;
  }

  /** @param {import("./viewer.js").State} state */
  show({ done, stepwise, step }) {
    const panel = by("panel-steps"), here = stepwise ? step : 0;
    if (panel.hidden) return;
    if (!panel.firstChild) panel.innerHTML = this.#list();
    const all = `${done.size} of ${this.plan.steps.length} steps done.`;
    by("progress").textContent = `${all} ${this.left(done)} Sorting is counted.`;
    panel.querySelector("progress").value = done.size;
    const rows = panel.querySelector("ol").children;
    for (const one of new Set([...this.#done, ...done])) rows[one - 1].querySelector("input").checked = done.has(one);
    this.#done = new Set(done);
    rows[this.#here - 1]?.classList.remove("here");
    rows[here - 1]?.classList.add("here");
    if (here && this.#here !== here) rows[here - 1].scrollIntoView({ block: "nearest" });
    this.#here = here;
  }

  #list() {
    const rows = this.plan.steps.map((step, k) => `<li data-step="${k + 1}">
      <label><input type="checkbox" aria-label="Step ${k + 1} done"></label>
      <button type="button" data-step="${k + 1}"><b>${k + 1}</b> ${escaped(this.plan.told([...step.pieces, step.text].join(": ")))}</button></li>`);
    return `<p id="progress"></p><progress max="${rows.length}" aria-labelledby="progress"></progress>
      <ol>${rows.join("")}</ol>`;
  }

  /** How long all steps take that are not done. @param {Set<number>} done */
  left(done) {
    if (done.size === this.plan.steps.length) return "All is done.";
    return `${this.clock.left(done)} left of ${this.clock.all()}.`;
  }
}
