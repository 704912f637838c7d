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
  return `<path class="piece ${more}" data-piece="${number}" tabindex="-1" fill="${colour}" fill-rule="evenodd"
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
  panel.innerHTML = `<svg role="img" aria-label="${pieces.length} strips, flat" width="${wide}"
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
 */
export function drawSheets(panel, { pieces, sheets, placed }, high, pinned, how) {
  const figures = sheets.map((sheet, number) => {
    const { width, height } = sheet, on = placed.filter(([, at]) => at === number);
    const shapes = on.map((place) => {
      const piece = pieces[place[0]];
      return pieceShape(piece, place[0], lying(sheet, place), pinned.has(piece.id) ? "pinned" : "");
    });
    const size = `height="${high}" width="${(high * width) / height}" viewBox="0 0 ${width} ${height}"`;
    const words = `${width.toFixed(0)} × ${height.toFixed(0)} mm, ${on.length} pieces, ${how}`;
    const name = `Sheet ${number + 1}`;
    return `<figure><svg role="img" data-sheet="${number}" aria-label="${name}" ${size}>${shapes.join("")}</svg>
      <figcaption>${name}: ${words}</figcaption></figure>`;
  });
  panel.innerHTML = `<div class="sheets">${figures.join("")}</div>`;
}

/** A piece that is held. */
class Held {
  moved = false;

  /**
   * @param {Element} shape
   * @param {Values} sheet
   * @param {Place} place
   * @param {PointerEvent} event
   */
  constructor(shape, sheet, place, { clientX, clientY }) {
    this.shape = shape;
    this.sheet = sheet;
    this.from = place;
    this.place = place;
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
    this.place = place;
    this.shape.setAttribute("transform", lying(this.sheet, place));
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
    const shape = event.target instanceof Element && event.target.closest(".piece"), { sheets, placed = [] } = plan();
    if (!(shape instanceof SVGElement) || event.button) return;
    const sheet = Number(shape.closest("svg")?.dataset.sheet), piece = Number(shape.dataset.piece);
    const place = placed.find(([number, at]) => number === piece && at === sheet);
    if (!place) return;
    held = new Held(shape, sheets[sheet], place, event);
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
