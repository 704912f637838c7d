// What is done by hand to a state's options; null takes an option away.

/** @typedef {Record<string, any>} Options */
/**
 * @typedef {{ mesh: string, options: Options }} State A mesh and options, as a job.toml has them.
 */

/** What another model has no use for. */
const OF_THE_MODEL = [
  "leave_out", "rim", "remesh", "refine", "up", "hang", "load", "bodies", "twists", "layout", "pin",
];

const isNumber = (/** @type {string} */ part) => /^\d+$/.test(part);
const partsOf = (/** @type {unknown} */ text) => String(text || "").split(",").filter(Boolean);
/** The numbers in a list, and its words. @param {unknown} text */
export const numbersIn = (text) => partsOf(text).filter(isNumber).map(Number);
const wordsIn = (/** @type {unknown} */ text) => partsOf(text).filter((part) => !isNumber(part));

/** A state without options that say nothing. @param {State} state @returns {State} */
export function cleaned({ mesh, options }) {
  const said = Object.entries(options).filter(([, value]) => value !== null && value !== "");
  return { mesh, options: Object.fromEntries(said) };
}

/** What stays of options when another model comes. @param {Options} options */
export function forAnotherModel(options) {
  return Object.fromEntries(Object.entries(options).filter(([name]) => !OF_THE_MODEL.includes(name)));
}

/** @param {number[]} numbers @param {number} one */
function toggled(numbers, one) {
  const others = numbers.filter((other) => other !== one);
  return (others.length < numbers.length ? others : [...numbers, one]).sort((a, b) => a - b);
}

/**
 * Leave a face out, or have it back.
 *
 * @param {Options} options
 * @param {number} face
 * @returns {Options}
 */
export function toggleFace(options, face) {
  const numbers = toggled(numbersIn(options.leave_out), face);
  return { ...options, leave_out: [...wordsIn(options.leave_out), ...numbers].join(",") || null };
}

/**
 * Set a fastener at a crossing after the rule, or take it off.
 *
 * @param {Options} options
 * @param {number} crossing
 * @returns {Options}
 */
export function toggleFastener(options, crossing) {
  const rule = wordsIn(options.fasten).join(",") || "form", numbers = toggled(numbersIn(options.fasten), crossing);
  const ruled = rule === "form" ? null : rule;
  return { ...options, fasten: numbers.length ? `${rule},${numbers.join(",")}` : ruled };
}

const pinsIn = (/** @type {Options} */ options) => String(options.pin || "").split("/").filter(Boolean);
const pieceOf = (/** @type {string} */ one) => one.split("@")[0];
/** The pieces that are pinned. @param {Options} options */
export const pinned = (options) => new Set(pinsIn(options).map(pieceOf));

/**
 * Pin a piece where it was dragged to, or let it go again.
 *
 * @param {Options} options
 * @param {string} id
 * @param {number[] | null} place
 */
export function pin(options, id, place) {
  const pins = pinsIn(options).filter((one) => pieceOf(one) !== id);
  if (place) {
    const [, sheet, ...motion] = place;
    pins.push(`${id}@${sheet + 1}:${motion.map((value) => Number(value.toFixed(2))).join(",")}`);
  }
  return { ...options, pin: pins.join("/") || null };
}
