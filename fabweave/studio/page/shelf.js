import { by, escaped } from "../../show/scripts/html.js";

const NONE_KEPT = `<p>“Keep this” puts a variant here, with its picture and figures, to compare it and to go back
  to it.</p>`;

/** Draw the variants that are kept. @param {import("./session.js").Variant[]} kept */
export function drawKept(kept) {
  by("tab-kept").textContent = kept.length ? `Kept (${kept.length})` : "Kept";
  by("panel-kept").innerHTML = kept.length ? `<div class="row">${kept.map(figure).join("")}</div>` : NONE_KEPT;
}

/** @param {import("./session.js").Variant} variant @param {number} number */
function figure({ name, picture, words }, number) {
  const seen = picture ? `<img alt="" src="${picture}">` : "", back = `Go back to ${escaped(name)}`;
  return `<figure><button type="button" class="link" data-kept="${number}" aria-label="${back}">${seen}
    <span class="caption"><b>${escaped(name)}</b><br>${escaped(words)}</span></button>
    <button type="button" data-gone="${number}" aria-label="Take ${escaped(name)} away">×</button></figure>`;
}
