import { by, escaped } from "../../show/scripts/html.js";
import { drawWidths } from "./sheets.js";

/** So many reasons and notes are told. */
const MOST_REASONS = 5, MOST_NOTES = 6;
/** What the object can be coloured by. @type {Record<string, string>} */
const TROUBLE = {
  width: "Widths", bend: "Bends", twist: "Twist", crease: "Creases", layers: "Layers", clearance: "Clearance",
  hole: "Holes", form: "Form",
};

/** @typedef {Record<string, any>} Values */

/** @param {number[] | null} range */
function span(range, digits = 1) {
  return range ? range.map((value) => value.toFixed(digits)).join(" to ") : "not known";
}

/** What becomes of the form. @param {Values} plan */
function formText({ figures: { collapses, form_mm }, drawn_mm }) {
  if (collapses) return "collapses";
  if (form_mm == null) return "not known";
  return drawn_mm == null ? `settles ${form_mm.toFixed(1)} mm` : `${form_mm.toFixed(1)} mm off, settled`;
}

/** The figures of a plan, by their names. @param {Values} plan */
function rowsOf(plan) {
  const { figures, hours, drawn_mm } = plan, cutting = figures.cutting_h?.map((h) => 60 * h);
  return [
    ["Pieces", `${figures.pieces} of ${figures.kinds} kinds`], ["Crossings", figures.crossings],
    ["Threads", figures.threads], ["Sheets", `${figures.sheets}, ${(100 * figures.use).toFixed(0)} % used`],
    ["Assembly", hours || "not known"], ["Cutting", cutting ? `${span(cutting, 0)} min` : "not known"],
    ["Price", figures.price ? `${span(figures.price, 0)} EUR` : "not known"], ["Form", formText(plan)],
    ...(drawn_mm == null ? [] : [["If cut as drawn", `settles ${drawn_mm.toFixed(1)} mm`]]),
    ...(figures.likeness_mm == null ? [] : [["Off the model", `${figures.likeness_mm.toFixed(1)} mm at most`]]),
    ...(figures.broken ? [["Broken twill", `${figures.broken} conditions`]] : []),
    ["Longest piece", `${figures.longest_mm.toFixed(0)} mm`],
  ];
}

/** Buttons for cures. @param {Values[] | undefined} fixes */
export function curesOf(fixes) {
  return (fixes || []).map(({ text, options }) =>
    `<button type="button" data-fix="${escaped(JSON.stringify(options))}">Fix: ${escaped(text)}</button>`).join("");
}

/** Show what it comes to. @param {Values} plan */
export function showOutcome(plan) {
  const { level, reasons } = plan.verdict, verdict = by("verdict");
  by("outcome").classList.remove("stale");
  verdict.dataset.level = level;
  verdict.querySelector("b").textContent = level[0].toUpperCase() + level.slice(1);
  verdict.querySelector("span").textContent = reasons.length ? "" : "as it is.";
  by("reasons").innerHTML = reasons.slice(0, MOST_REASONS).map(({ text, cure, fixes }) =>
    `<p>${escaped(text)}<small>${escaped(cure)}</small><span class="cures">${curesOf(fixes)}</span></p>`).join("");
  const { grade } = plan.figures, lost = plan.lost.map(({ points, text }) =>
    `<li>${escaped(text)} <span>−${points.toFixed(1)}</span></li>`);
  by("grade").innerHTML = grade == null ? "" : `<p><b>${grade.toFixed(1)}</b> of 10
    <meter min="0" max="10" low="4" high="7" optimum="10" value="${grade}" aria-label="Grade"></meter></p>
    <ul aria-label="What takes points">${lost.join("")}</ul>`;
  by("figures").innerHTML = rowsOf(plan).map(([name, value]) => `<dt>${name}</dt><dd>${escaped(value)}</dd>`).join("");
  drawWidths(by("widths"), plan.widths);
}

/** Buttons that colour the object by a trouble. @param {Record<string, number>} counts @param {string} now */
export function showTrouble(counts, now) {
  by("trouble").innerHTML = Object.entries(TROUBLE).filter(([rule]) => rule in counts).map(([rule, name]) => {
    const count = counts[rule], broken = count ? ` class="broken"` : "";
    return `<button type="button" data-trouble="${rule}" aria-pressed="${rule === now}"${broken}>${name}${
      count ? ` ${count}` : ""}</button>`;
  }).join("");
}

/** @param {string[]} texts */
export function showNotes(texts) {
  by("notes").innerHTML = texts.slice(0, MOST_NOTES).map((text) => `<p>${escaped(text)}</p>`).join("");
}

const mean = (/** @type {number[] | null} */ range) => (range ? (range[0] + range[1]) / 2 : null);

/** What each figure is called where it changes, how it is got, and its digits. */
const CHANGES = /** @type {const} */ ([
  ["grade", (/** @type {Values} */ f) => f.grade, 1, ["in grade", "in grade"]],
  ["pieces", (/** @type {Values} */ f) => f.pieces, 0, ["piece", "pieces"]],
  ["hours", (/** @type {Values} */ f) => mean(f.hours), 1, ["h", "h"]],
  ["sheets", (/** @type {Values} */ f) => f.sheets, 0, ["sheet", "sheets"]],
  ["price", (/** @type {Values} */ f) => mean(f.price), 0, ["EUR", "EUR"]],
]);

/**
 * What a change came to, such as "−12 pieces, +1.0 h, settles 2.0 mm less".
 *
 * @param {Values} before
 * @param {Values} now
 */
export function changes(before, now) {
  const parts = CHANGES.flatMap(([, of, digits, [one, many]]) => {
    const was = of(before), is = of(now);
    if (was == null || is == null) return [];
    const more = Number((is - was).toFixed(digits)), size = Math.abs(more).toFixed(digits);
    return more ? [`${more < 0 ? "−" : "+"}${size} ${Math.abs(more) === 1 ? one : many}`] : [];
  });
  const settles = (now.form_mm ?? NaN) - (before.form_mm ?? NaN);
  if (Math.abs(settles) >= 0.05) parts.push(`settles ${Math.abs(settles).toFixed(1)} mm ${settles < 0 ? "less" : "more"}`);
  return parts.join(", ");
}

/** A plan in a few words. @param {Values} plan */
export function shortly(plan) {
  const { figures, hours, verdict } = plan;
  const form = figures.collapses || figures.form_mm != null ? `, ${formText(plan)}` : "";
  const grade = figures.grade == null ? "" : `grade ${figures.grade.toFixed(1)}, `;
  const made = `${figures.pieces} pieces of ${figures.kinds} kinds, ${figures.sheets} sheets`;
  return `${grade}${verdict.level}; ${made}, ${hours || "hours not known"}, ${figures.median_mm.toFixed(1)} mm wide${form}`;
}
