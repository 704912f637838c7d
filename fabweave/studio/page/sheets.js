// Flat drawings: strips side by side, and sheets with the pieces where they lie.

import { escaped } from "../../show/scripts/html.js";

/** A piece that is held turns by so many degrees, and moves once a finger has moved by so many pixels. */
const TURN_DEG = 15, TREMBLE = 5;

/** @typedef {Record<string, any>} Values */
/** @typedef {number[]} Place A piece, its sheet, x and y in mm, and its turn in degrees. */

/** The path of a piece's outline and holes. @param {Values} piece */
function piecePath({ outline, holes }) {
  const round = ([x, y, d]) => {
    const r = d / 2;
    return `M${x - r} ${y}a${r} ${r} 0 1 0 ${d} 0a${r} ${r} 0 1 0 ${-d} 0Z`;
  };
  return `M${outline.map((point) => point.join(" ")).join("L")}Z${holes.map(round).join("")}`;
}

/** @param {Values} piece @param {number} number @param {string} transform */
function pieceShape(piece, number, transform, more = "") {
  const { id, kind, colour } = piece, title = `<title>${escaped(id)}, kind ${kind}</title>`;
  // Keys go from one to the next; the first takes the focus.
  return `<path class="piece ${more}" data-piece="${number}" tabindex="${number ? -1 : 0}" role="button"
    aria-label="${escaped(id)}" fill="${colour}" fill-rule="evenodd" pathLength="1"
    transform="${transform}" d="${piecePath(piece)}">${title}</path>`;
}

/** The least and the most of each coordinate. @param {number[][]} outline */
function boxOf(outline) {
  return [0, 1].map((axis) => {
    const values = outline.map((point) => point[axis]);
    return [Math.min(...values), Math.max(...values)];
  });
}

/**
 * Strips in rows, as wide as there is room.
 *
 * @param {HTMLElement} panel
 * @param {Values[]} pieces
 * @param {number} wide
 */
export function drawStrips(panel, pieces, wide) {
  const boxes = pieces.map(({ outline }) => boxOf(outline));
  const longest = Math.max(...boxes.map(([[low, high]]) => high - low));
  // So large that the longest fills a third of the panel.
  const across = 3.1 * longest, gap = 0.012 * across;
  let x = gap, y = gap, row = 0;
  const drawn = pieces.map((piece, number) => {
    const [[left, right], [low, high]] = boxes[number];
    if (x + right - left > across - gap) [x, y, row] = [gap, y + row + gap, 0];
    const way = `translate(${(x - left).toFixed(2)} ${(y + high).toFixed(2)}) scale(1 -1)`;
    x += right - left + gap;
    row = Math.max(row, high - low);
    return pieceShape(piece, number, way);
  });
  const high = y + row + gap;
  panel.innerHTML = `<svg role="group" aria-label="${pieces.length} strips, flat" width="${wide}"
    height="${(wide * high) / across}" viewBox="0 0 ${across} ${high}">${drawn.join("")}</svg>`;
}

/**
 * How a piece lies on a sheet, as its drawing has it.
 *
 * @param {Values} sheet
 * @param {Place} place
 */
const lying = (sheet, [, , x, y, turn]) => `translate(${x} ${sheet.height - y}) scale(1 -1) rotate(${turn})`;

/**
 * Sheets beside one another, each with its pieces.
 *
 * @param {HTMLElement} panel
 * @param {Values} plan
 * @param {number} high
 * @param {Set<string>} pinned The pieces that are pinned.
 * @param {string} how How they were nested.
 * @param {boolean} falling Whether pieces are seen to come.
 */
export function drawSheets(panel, { pieces, sheets, placed }, high, pinned, how, falling = false) {
  const figures = sheets.map((sheet, number) => {
    const { width, height } = sheet, on = placed.filter(([, at]) => at === number);
    const shapes = on.map((place, nth) => {
      const piece = pieces[place[0]], more = pinned.has(piece.id) ? "pinned" : "";
      return `<g style="--nth: ${nth / on.length}">${pieceShape(piece, place[0], lying(sheet, place), more)}</g>`;
    });
    const size = `height="${high}" width="${(high * width) / height}" viewBox="0 0 ${width} ${height}"`;
    const words = `${width.toFixed(0)} × ${height.toFixed(0)} mm, ${on.length} pieces, ${how}`;
    const name = `Sheet ${number + 1}`;
    return `<figure><svg role="group" class="${falling ? "falling" : ""}" style="--fall: ${0.4 * height}" data-sheet="${number}"
      aria-label="${name}" ${size}>${shapes.join("")}</svg>
      <figcaption>${name}: ${words}</figcaption></figure>`;
  });
  panel.innerHTML = `<p class="sheetbar"><button type="button" data-zoom="-1" aria-label="Smaller sheets">−</button>
    <button type="button" data-zoom="1" aria-label="Larger sheets">+</button>
    <button type="button" id="cut-play">Play the cut</button>
    <input type="range" id="cut-time" min="0" max="1" step="0.001" value="1" aria-label="Time of the cut">
    <output id="cut-said"></output></p><div class="sheets">${figures.join("")}</div>`;
}

/**
 * A place that keeps a piece on its sheet, off the border.
 *
 * @param {Place} place
 * @param {number[][]} outline
 * @param {Values} sheet
 */
export function kept([piece, number, x, y, turn], outline, { width, height, margin }) {
  const angle = (turn * Math.PI) / 180, [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  const [across, up] = boxOf(outline.map(([a, b]) => [cos * a - sin * b, sin * a + cos * b]));
  const within = (/** @type {number} */ at, /** @type {number[]} */ [low, high], /** @type {number} */ size) =>
    Math.max(margin - low, Math.min(at, size - margin - high));
  return [piece, number, within(x, across, width), within(y, up, height), turn];
}

/** A piece that is held. */
class Held {
  moved = false;

  /**
   * @param {Element} shape
   * @param {Values} sheet
   * @param {Place} place
   * @param {PointerEvent} event
   * @param {number[][]} outline
   */
  constructor(shape, sheet, place, { clientX, clientY }, outline) {
    this.shape = shape;
    this.sheet = sheet;
    this.from = place;
    this.place = place;
    this.outline = outline;
    this.pressed = [clientX, clientY];
    this.scale = sheet.width / (shape.closest("svg")?.clientWidth || 1);
  }

  /** @param {PointerEvent} event */
  drag({ clientX, clientY }) {
    const [x, y] = [clientX - this.pressed[0], clientY - this.pressed[1]];
    this.moved ||= Math.hypot(x, y) > TREMBLE;
    if (!this.moved) return;
    const [piece, sheet, right, up] = this.from;
    this.#lie([piece, sheet, right + this.scale * x, up - this.scale * y, this.place[4]]);
  }

  turn() {
    this.moved = true;
    this.#lie([...this.place.slice(0, 4), (this.place[4] + TURN_DEG) % 360]);
  }

  /** @param {Place} place */
  #lie(place) {
    this.place = kept(place, this.outline, this.sheet);
    this.shape.setAttribute("transform", lying(this.sheet, this.place));
  }
}

/**
 * Let pieces be dragged on their sheets; while one is held, R turns it.
 *
 * @param {HTMLElement} panel
 * @param {() => Values} plan
 * @param {(place: Place) => void} drop Is given where one is let go.
 */
export function dragPieces(panel, plan, drop) {
  /** @type {Held | null} */
  let held = null;
  panel.addEventListener("pointerdown", (event) => {
    const shape = event.target instanceof Element && event.target.closest(".piece"), { sheets, pieces, placed = [] } = plan();
    if (!(shape instanceof SVGElement) || event.button) return;
    const sheet = Number(shape.closest("svg")?.dataset.sheet), piece = Number(shape.dataset.piece);
    const place = placed.find(([number, at]) => number === piece && at === sheet);
    if (!place) return;
    held = new Held(shape, sheets[sheet], place, event, pieces[piece].outline);
    shape.setPointerCapture(event.pointerId);
  });
  panel.addEventListener("pointermove", (event) => held?.drag(event));
  panel.addEventListener("pointerup", () => {
    if (held?.moved) drop(held.place);
    held = null;
  });
  panel.addEventListener("pointercancel", () => (held = null));
  document.addEventListener("keydown", ({ key }) => key.toLowerCase() === "r" && held?.turn());
}

/** Keys move a piece of a sheet by so many millimetres. */
const STEP_MM = 5;
/** @type {Record<string, number[]>} */
const MOVES = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/**
 * Where a key takes a piece that has the focus on a sheet: pinned where it lies, moved, or turned;
 * null lets it go, and undefined is no such key.
 *
 * @param {KeyboardEvent} event
 * @param {Place} place
 * @returns {Place | null | undefined}
 */
export function pinnedByKey({ key, shiftKey }, place) {
  const [piece, sheet, x, y, turn] = place, move = MOVES[key];
  if (key === "Delete" || key === "Backspace") return null;
  if (key.toLowerCase() === "p") return place;
  if (key.toLowerCase() === "r") return [piece, sheet, x, y, (turn + TURN_DEG) % 360];
  return shiftKey && move ? [piece, sheet, x + STEP_MM * move[0], y + STEP_MM * move[1], turn] : undefined;
}

/** How often ribbons are how wide. @param {HTMLElement} panel @param {Values} widths */
export function drawWidths(panel, { from, to, count }) {
  const most = Math.max(...count), bars = count.map((n, k) => {
    const high = n / most;
    return `<rect x="${k + 0.08}" width=".84" y="${(1 - high).toFixed(4)}" height="${high.toFixed(4)}"/>`;
  });
  panel.innerHTML = `<svg role="img" aria-label="From ${from} to ${to} mm" viewBox="0 0 ${count.length} 1"
    preserveAspectRatio="none">${bars.join("")}</svg>
    <p><span>${from.toFixed(1)} mm</span><span>${to.toFixed(1)} mm</span></p>`;
}
