import { by, escaped } from "../../show/scripts/html.js";

/** What each card is beside the others. @type {Record<string, string>} */
const ROLES = { quicker: "Quick", usual: "Usual", finer: "Fine" };
const ORDER = ["quicker", "usual", "finer"];
/** How wide their pictures are. */
export const CARD_PX = 320;

/**
 * @typedef {object} Card A design that was tried.
 * @property {string} name
 * @property {import("./options.js").State} state
 * @property {Record<string, any>} figures
 * @property {string} hours
 * @property {string} level
 * @property {string} picture
 * @property {string} [role]
 */

const keyOf = (/** @type {import("./options.js").State} */ { mesh, options }) =>
  JSON.stringify([mesh, Object.entries(options).sort()]);

/** Designs of the model that were tried, to choose one of. */
export class Cards {
  /** @type {Map<string, Card>} */
  #cards = new Map();

  clear() {
    this.#cards.clear();
  }

  /** Take a design that was tried. @param {Card} card */
  add(card) {
    this.#cards.set(keyOf(card.state), card);
  }

  /** Say what some of them are beside the others. @param {Record<string, import("./options.js").State>} roles */
  name(roles) {
    for (const [role, state] of Object.entries(roles)) {
      const card = this.#cards.get(keyOf(state));
      if (card) card.role = role;
    }
  }

  get size() {
    return this.#cards.size;
  }

  /** Those with a part first, from quick to fine; then the others as they came. */
  get all() {
    const place = (/** @type {Card} */ { role }) => (ORDER.indexOf(role ?? "") + ORDER.length + 1) % (ORDER.length + 1);
    return [...this.#cards.values()].sort((a, b) => place(a) - place(b));
  }

  /**
   * @param {import("./options.js").State | null} now What is seen.
   * @param {boolean} trying Whether more are on their way.
   */
  draw(now, trying) {
    const own = now && !now.mesh.startsWith("shape:"), state = now && keyOf(now);
    const figures = this.all.map((card, number) => figure(card, number, keyOf(card.state) === state));
    const keep = own ? `<button type="button" id="own-mesh">The model’s own mesh</button>` : "";
    const more = trying ? "<span>Trying designs …</span>" : `<button type="button" id="try"
      title="Other meshes, patterns and widths of this model">Try more designs</button>`;
    by("panel-choices").innerHTML = `<div class="row">${figures.join("")}</div><p>${keep} ${more}</p>`;
    by("tab-choices").textContent = this.size ? `Choices (${this.size})` : "Choices";
  }
}

/** @param {Card} card @param {number} number @param {boolean} chosen */
function figure({ name, picture, figures, hours, level, role }, number, chosen) {
  const seen = picture ? `<img alt="" src="${picture}">` : "", title = role ? `${ROLES[role]}: ${name}` : name;
  const grade = figures.grade == null ? level : `grade ${figures.grade.toFixed(1)}, ${level}`;
  const words = `${figures.pieces} pieces, ${hours || "hours not known"}, ${grade}`;
  return `<figure><button type="button" class="link" data-card="${number}" aria-pressed="${chosen}">${seen}
    <span class="caption"><b>${escaped(title)}</b><br>${escaped(words)}</span></button></figure>`;
}
