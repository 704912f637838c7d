import { by, escaped, memory } from "../../show/scripts/html.js";

/** So many variants are kept. */
const MOST_KEPT = 24;
const NONE_KEPT = `<p>Keep puts this variant here, with its picture and figures, to compare it with others and to go
  back to it.</p>`;

/**
 * @typedef {{ name: string, state: import("./options.js").State, words: string, picture: string }} Variant
 */

/** Variants that are kept, to compare them and to go back to them. */
export class Shelf {
  #memory;
  /** @type {Variant[]} */
  #kept;

  /** @param {string} base Under which the browser keeps them. */
  constructor(base) {
    this.#memory = memory(() => sessionStorage, `${base}shelf`);
    this.#kept = this.#memory.read() || [];
  }

  /** @param {number} number */
  variant(number) {
    return this.#kept[number];
  }

  /** @param {Variant} variant */
  keep(variant) {
    this.#kept = [variant, ...this.#kept].slice(0, MOST_KEPT);
  }

  /** @param {number} number */
  drop(number) {
    this.#kept.splice(number, 1);
  }

  /** @param {boolean} trying Whether designs are being tried. */
  draw(trying) {
    const kept = this.#kept;
    this.#memory.write(kept);
    by("tab-shelf").textContent = kept.length ? `Shelf (${kept.length})` : "Shelf";
    const shown = kept.length ? `<div class="row">${kept.map(figure).join("")}</div>` : NONE_KEPT;
    by("panel-shelf").innerHTML = `<p><button type="button" id="try"${trying ? " disabled" : ""}
      title="Other meshes, patterns and widths of this model">Try designs</button></p>${shown}`;
  }
}

/** @param {Variant} variant @param {number} number */
function figure({ name, picture, words }, number) {
  const seen = picture ? `<img alt="" src="${picture}">` : "", back = `Go back to ${escaped(name)}`;
  return `<figure><button type="button" class="link" data-kept="${number}" aria-label="${back}">${seen}
    <figcaption><b>${escaped(name)}</b><br>${escaped(words)}</figcaption></button>
    <button type="button" data-gone="${number}" aria-label="Take ${escaped(name)} off the shelf">×</button></figure>`;
}
