import { escaped } from "../../scripts/html.js";
import { groupedBy } from "./plan.js";
import { goneMm, motionOf } from "./strips.js";

/** Colours that eight groups have, told apart by the colour-blind (Okabe and Ito, two made lighter). */
const SAFE = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442", "#8a8a8a"];
/** From the first step to the last: dark blue, green, yellow, of rising lightness. */
const RAMP = ["#3b2a7a", "#2c6a9b", "#1f9a8a", "#6cc24a", "#f2e147"];
/** A legend names no more groups; the others are counted. */
const MOST_NAMED = 40;

/** @typedef {import("./plan.js").Plan} Plan */
/** @typedef {{ name: string, colour: string, members: number[] }} Group */

/**
 * How pieces are coloured.
 *
 * @typedef {object} Colouring
 * @property {[string, number][][]} runs For each piece its colours along it, each with the number of
 *   rungs that have it.
 * @property {string[]} flat The colour that each piece has flat.
 * @property {Group[]} [groups] Absent where a ramp says it all, between its two ends.
 * @property {string[]} [ends]
 */

/** Two digits for a part of a colour. @param {number} part */
const byteText = (part) => Math.round(part).toString(16).padStart(2, "0");

/**
 * The colour of a group: safe ones first, then hues far from one another, by turns dark and light.
 *
 * @param {number} number
 * @param {number} count
 */
function groupColour(number, count) {
  if (count <= SAFE.length) return SAFE[number];
  const hue = (number * 137.508) % 360, light = [0.5, 0.66, 0.38][number % 3];
  const part = (/** @type {number} */ k) => {
    const at = (k + hue / 30) % 12, reach = 0.62 * Math.min(light, 1 - light);
    return byteText(255 * (light - reach * Math.max(-1, Math.min(at - 3, 9 - at, 1))));
  };
  return `#${part(0)}${part(8)}${part(4)}`;
}

/** A colour between the ends of the ramp, from 0 to 1. @param {number} share */
function rampColour(share) {
  const at = Math.max(0, Math.min(0.9999, share)) * (RAMP.length - 1), low = Math.floor(at);
  const [from, to] = [rgbOf(RAMP[low]), rgbOf(RAMP[low + 1])];
  return `#${from.map((part, k) => byteText(part + (to[k] - part) * (at - low))).join("")}`;
}

/** Red, green and blue of a colour such as #0072b2. @param {string} colour */
function rgbOf(colour) {
  const rgb = parseInt(colour.slice(1), 16);
  return [rgb >> 16, (rgb >> 8) & 255, rgb & 255];
}

/**
 * What pieces can be coloured by: for each scheme, the group of a piece in words; null for another.
 *
 * @param {Plan} plan
 * @returns {Record<string, null | ((piece: any) => string)>}
 */
export function colourSchemes(plan) {
  return {
    job: null,
    thread: (piece) => plan.thread(piece).label,
    direction: (piece) => plan.bunchName(plan.thread(piece)) || "all",
    sheet: (piece) => `sheet ${piece.sheet}`,
    step: null,
    material: (piece) => plan.sheets[plan.sheetAt.get(piece.sheet)].material,
    kind: (piece) => `kind ${piece.kind}`,
    ...(plan.data.space.let_go ? { form: null } : {}),
  };
}

/** Colour all pieces by a scheme. @param {Plan} plan @param {string} scheme @returns {Colouring} */
export function colourBy(plan, scheme) {
  const groupOf = colourSchemes(plan)[scheme];
  if (scheme === "form") return formColours(plan);
  if (scheme === "step") return stepColours(plan);
  if (!groupOf) return jobColours(plan);
  const members = groupedBy([...plan.pieces.keys()], (index) => groupOf(plan.pieces[index]));
  // Threads stand in the order of their labels already: AA comes after Z.
  const names = [...members.keys()];
  if (scheme !== "thread") names.sort((a, b) => a.localeCompare(b, "en", { numeric: true }));
  const groups = names.map((name, number) => {
    return { name, colour: groupColour(number, names.length), members: members.get(name) || [] };
  });
  /** @type {string[]} */
  const flat = [];
  for (const group of groups) for (const index of group.members) flat[index] = group.colour;
  return { ...plain(plan, flat), groups };
}

/**
 * Pieces that have one colour each.
 *
 * @param {Plan} plan
 * @param {string[]} flat
 * @returns {Colouring}
 */
function plain(plan, flat) {
  return { runs: flat.map((colour, index) => [[colour, plan.data.space.counts[index]]]), flat };
}

/** From the first step to the last. @param {Plan} plan @returns {Colouring} */
function stepColours(plan) {
  const last = plan.steps.length, flat = Array.from(plan.stepOf, (step) => rampColour(step / Math.max(last - 1, 1)));
  return { ...plain(plan, flat), ends: ["step 1", `step ${last}`] };
}

/**
 * The job's own colours; groups where each has a colour of its own.
 *
 * @param {Plan} plan
 * @returns {Colouring}
 */
function jobColours(plan) {
  /** @type {Colouring["runs"]} */
  const runs = plan.data.colours;
  /** @type {Map<string, Group>} */
  const groups = new Map(), groupOf = new Map();
  // Flat, a piece has the colour that most of it has.
  const flat = runs.map((own) => own.reduce((most, run) => (run[1] > most[1] ? run : most))[0]);
  let told = true;
  plan.pieces.forEach((piece, index) => {
    const name = plan.bunchName(plan.thread(piece));
    const group = groups.get(name) || { name, colour: flat[index], members: [] };
    if (name) groups.set(name, group);
    group.members.push(index);
    for (const [colour] of runs[index]) {
      told = told && (groupOf.get(colour) ?? name) === name;
      groupOf.set(colour, name);
    }
  });
  return { runs, flat, groups: !told || groups.size > 6 ? [] : [...groups.values()] };
}

/**
 * How far each place goes when the object is let go: to the farthest of all.
 *
 * @param {Plan} plan
 * @returns {Colouring}
 */
function formColours(plan) {
  const { let_go: going, counts } = plan.data.space, rungs = counts.reduce((sum, count) => sum + count, 0);
  const away = goneMm(motionOf(going, rungs)), most = away.reduce((far, mm) => Math.max(far, mm), 1e-9);
  /** @type {Colouring["runs"]} */
  const runs = [], flat = [];
  let first = 0;
  for (const count of counts) {
    const own = Array.from(away.subarray(first, first + count));
    runs.push(own.map((mm) => [rampColour(mm / most), 1]));
    flat.push(rampColour(own.reduce((sum, mm) => sum + mm, 0) / count / most));
    first += count;
  }
  return { runs, flat, ends: ["0 mm", `${most < 10 ? most.toFixed(1) : Math.round(most)} mm`] };
}

/**
 * What a legend shows: a swatch and a name for each group, which shows it alone.
 *
 * @param {Colouring} colouring
 */
export function legendOf({ groups, ends = [] }) {
  const ramp = `<li class="ramp" style="background:linear-gradient(to right, ${RAMP.join(", ")})"></li>`;
  if (!groups) return `<li>${ends[0]}</li>${ramp}<li>${ends[1]}</li>`;
  const rows = groups.slice(0, MOST_NAMED).map(({ name, colour }, k) => `
    <li><button type="button" data-group="${k}" title="Show alone">
    <span class="swatch" style="background:${colour}"></span>${escaped(name)}</button></li>`);
  if (groups.length > MOST_NAMED) rows.push(`<li>and ${groups.length - MOST_NAMED} more</li>`);
  return rows.join("");
}

/**
 * Give every strip its colours along it.
 *
 * @param {import("./strips.js").Strips} strips
 * @param {Colouring["runs"]} runs
 */
export function tintStrips({ made, firsts }, runs) {
  runs.forEach((own, piece) => {
    let at = 6 * firsts[piece];
    for (const [colour, count] of own) {
      const rgb = rgbOf(colour).map((part) => part / 255);
      for (const end = at + 6 * count; at < end; at += 3) made.tint.set(rgb, at);
    }
  });
}
