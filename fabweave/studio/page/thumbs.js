// Small drawings of what can be chosen: how a pattern goes over and under, what holds a joint, a sheet.

import { escaped } from "../../show/scripts/html.js";

/** A drawing is so wide and high, in its own units. */
const WIDE = 30, HIGH = 20;
/** @param {string} inside */
const drawing = (inside) => `<svg viewBox="0 0 ${WIDE} ${HIGH}" aria-hidden="true">${inside}</svg>`;
/** @param {number} x @param {number} y @param {number} wide @param {number} high */
const box = (x, y, wide, high, kind = "") => `<rect class="${kind}" x="${x}" y="${y}" width="${wide}" height="${high}"/>`;

/** Columns over rows: over so many, under so many, each row so many places on. */
function biaxial(over, under, on) {
  const side = 5, inside = [];
  for (let row = 0; row < HIGH / side; row++) inside.push(box(0, side * row + 0.5, WIDE, side - 1));
  for (let row = 0; row < HIGH / side; row++) for (let column = 0; column < WIDE / side; column++) {
    const at = column + on * row, turn = over + under;
    if (((at % turn) + turn) % turn < over) inside.push(box(side * column + 0.5, side * row, side - 1, side, "dark"));
  }
  return drawing(inside.join(""));
}

/** Strands in three directions, so thick. @param {number} thick */
function triaxial(thick) {
  const inside = [];
  for (const [turn, kind] of [[0, ""], [60, "dark"], [120, "half"]])
    for (let k = -3; k < 4; k++)
      inside.push(`<g transform="translate(15 10) rotate(${turn})">${box(-22, 9 * k + 4.5 - thick / 2, 44, thick, String(kind))}</g>`);
  return drawing(inside.join(""));
}

/** @type {Record<string, () => string>} */
const PATTERNS = {
  plain: () => biaxial(1, 1, 1), twill: () => biaxial(2, 2, 1), "satin:5/2": () => biaxial(1, 4, 2),
  triaxial: () => triaxial(7), kagome: () => triaxial(3),
};

/** The pattern of a name, of a twill a/b with its step, too; "" of others. @param {string} name */
function patternOf(name) {
  const [, over, under, on] = /^(\d)\/(\d)(?:\/(-?\d))?$/.exec(name) ?? [];
  return over ? biaxial(Number(over), Number(under), Number(on ?? 1)) : (PATTERNS[name]?.() ?? "");
}

const LAP = box(0, 7, 20, 6) + box(11, 6, 19, 8, "dark");
const hole = (/** @type {number} */ x) => `<circle class="hole" cx="${x}" cy="10" r="1.6"/>`;
/** @type {Record<string, string>} */
const JOINTS = {
  rivet: LAP + hole(15.5), "rivet:2": LAP + hole(13.2) + hole(17.8),
  glue: `${LAP}<path class="line" d="M13 8l5 4m0-4l-5 4"/>`,
  tuck: box(0, 7, 26, 6) + box(4, 6, 26, 8, "dark") + [5, 13, 21].map((x) => box(x, 2, 4, 16, "half")).join(""),
  dovetail: `${box(0, 6, 30, 8)}<path class="dark" d="M30 6V14H14V12L19 13.5V6.5L14 8V6Z"/>`,
  slot: `${box(0, 6, 16, 8)}<path class="dark" d="M30 6V14H17V12H9V8H17V6Z"/><path class="line" d="M13 6.5V13.5"/>`,
  none: box(0, 6, 14.6, 8) + box(15.4, 6, 14.6, 8, "dark") + box(11, 5, 8, 10, "tape"),
};

/**
 * The drawing of a value of an option; "" where there is none.
 *
 * @param {string} option
 * @param {string} value
 * @param {string} [colour] Of a material.
 */
export function thumb(option, value, colour) {
  if (option === "pattern") return patternOf(value);
  if (option === "joint") return JOINTS[value] ? drawing(JOINTS[value]) : "";
  return colour ? drawing(`<rect class="sheet" x="1" y="1" width="28" height="18" rx="2" fill="${escaped(colour)}"/>`) : "";
}
