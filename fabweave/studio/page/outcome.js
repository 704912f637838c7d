import { by, escaped } from "../../show/scripts/html.js";
import { drawWidths } from "./sheets.js";

/** So many reasons and notes are told. */
const MOST_REASONS = 5, MOST_NOTES = 6;

/** @typedef {Record<string, any>} Values */

/** @param {number[] | null} range */
function span(range, digits = 1) {
  return range ? range.map((value) => value.toFixed(digits)).join(" to ") : "not known";
}

/** What becomes of the form. @param {Values} figures */
function formText({ collapses, form_mm }) {
  if (collapses) return "collapses";
  return form_mm == null ? "not known" : `settles ${form_mm.toFixed(1)} mm`;
}

/** The figures of a plan, by their names. @param {Values} plan */
function rowsOf({ figures, hours }) {
  const cutting = figures.cutting_h?.map((h) => 60 * h);
  return [
    ["Pieces", `${figures.pieces} of ${figures.kinds} kinds`], ["Crossings", figures.crossings],
    ["Threads", figures.threads], ["Sheets", `${figures.sheets}, ${(100 * figures.use).toFixed(0)} % used`],
    ["Assembly", hours || "not known"], ["Cutting", cutting ? `${span(cutting, 0)} min` : "not known"],
    ["Price", figures.price ? `${span(figures.price, 0)} EUR` : "not known"], ["Form", formText(figures)],
    ...(figures.likeness_mm == null ? [] : [["Off the model", `${figures.likeness_mm.toFixed(1)} mm at most`]]),
    ...(figures.broken ? [["Broken twill", `${figures.broken} conditions`]] : []),
    ["Longest piece", `${figures.longest_mm.toFixed(0)} mm`],
  ];
}

/** Show what it comes to. @param {Values} plan */
export function showOutcome(plan) {
  const { level, reasons } = plan.verdict, verdict = by("verdict");
  by("outcome").classList.remove("stale");
  verdict.dataset.level = level;
  verdict.querySelector("b").textContent = level[0].toUpperCase() + level.slice(1);
  verdict.querySelector("span").textContent = reasons.length ? "" : "as it is.";
  by("reasons").innerHTML = reasons.slice(0, MOST_REASONS)
    .map(({ text, cure }) => `<p>${escaped(text)}<small>${escaped(cure)}</small></p>`).join("");
  by("figures").innerHTML = rowsOf(plan).map(([name, value]) => `<dt>${name}</dt><dd>${escaped(value)}</dd>`).join("");
  drawWidths(by("widths"), plan.widths);
}

/** @param {string[]} texts */
export function showNotes(texts) {
  by("notes").innerHTML = texts.slice(0, MOST_NOTES).map((text) => `<p>${escaped(text)}</p>`).join("");
}

/** A plan in a few words. @param {Values} plan */
export function shortly({ figures, hours, verdict }) {
  const form = figures.collapses || figures.form_mm != null ? `, ${formText(figures)}` : "";
  const made = `${figures.pieces} pieces of ${figures.kinds} kinds, ${figures.sheets} sheets`;
  return `${verdict.level}; ${made}, ${hours || "hours not known"}, ${figures.median_mm.toFixed(1)} mm wide${form}`;
}
