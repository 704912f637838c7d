import { by, escaped } from "../../scripts/html.js";
import { search } from "./search.js";

/** So much of what is found is listed. */
const MOST_FOUND = 40;

/** @typedef {import("./plan.js").Values} Values */

/** The search field and what it finds; `take` is given what is chosen. */
export class Finding {
  /** @type {Values[]} */
  #found = [];

  /**
   * @param {import("./plan.js").Plan} plan
   * @param {(hit: Values) => void} take
   */
  constructor(plan, take) {
    this.plan = plan;
    this.take = take;
    by("search").addEventListener("submit", (event) => {
      event.preventDefault();
      this.#list(by("query").value);
      if (this.#found.length) this.choose(0);
    });
    by("query").addEventListener("input", () => this.#list(by("query").value));
  }

  /** Open the list of what is found, or close it where nothing is asked. @param {string} query */
  #list(query) {
    this.#found = search(this.plan, query).slice(0, MOST_FOUND);
    const none = !this.#found.length && query.trim(), box = by("found");
    box.hidden = !this.#found.length && !none;
    by("query").setAttribute("aria-expanded", !box.hidden);
    box.innerHTML = none
      ? "<p>Nothing is called so. Try A3, thread A, #12, crossing 12, kind 3, sheet 2 or step 7.</p>"
      : this.#found.map((hit, k) => this.#row(hit, k)).join("");
  }

  /** @param {Values} hit @param {number} number */
  #row({ piece, name, why }, number) {
    const group = piece === undefined, own = group ? "" : ` data-piece="${escaped(this.plan.pieces[piece].id)}"`;
    const text = group ? `<strong>${escaped(name)}</strong>` : `<b>${escaped(this.plan.named(piece))}</b>`;
    return `<button type="button" role="option" data-found="${number}"${own}>${text}
      <small>${escaped(why)}</small></button>`;
  }

  /** @param {number} number */
  choose(number) {
    const hit = this.#found[number];
    this.close();
    this.take(hit);
  }

  close() {
    this.#list("");
  }
}
