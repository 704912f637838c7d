import { by, escaped } from "../../show/scripts/html.js";

/**
 * What a new page offers: a place to drop a model on, examples, and recent work.
 *
 * @typedef {{ open(state: import("./options.js").State): void, goOn(name: string): void, read(file: File): void }} Company
 */
export class Start {
  /** @type {{ name: string, state: import("./options.js").State, picture: string }[]} */
  #examples = [];

  /** @param {Company} company */
  constructor(company) {
    by("start-open").addEventListener("change", () => {
      const [file] = by("start-open").files;
      if (file) company.read(file);
      by("start-open").value = "";
    });
    by("start").addEventListener("click", ({ target }) => {
      const { example, session, forget } = target.closest("[data-example], [data-session], [data-forget]")?.dataset ?? {};
      if (example) company.open(this.#examples[Number(example)].state);
      if (session) company.goOn(session);
      if (forget) fetch(`session/${forget}`, { method: "DELETE" }).then(() => this.#drawRecent());
    });
  }

  get open() {
    return !by("start").hidden;
  }

  /** @param {boolean} on */
  show(on) {
    by("start").hidden = !on;
    document.body.classList.toggle("starting", on);
    if (on) this.#drawRecent();
  }

  /** @param {{ name: string, state: import("./options.js").State, picture: string }} example */
  add(example) {
    this.#examples.push(example);
    by("examples").innerHTML = this.#examples.map(({ name, picture }, number) => `<button type="button"
      data-example="${number}">${picture ? `<img alt="" src="${picture}">` : ""}<b>${escaped(name)}</b></button>`).join("");
  }

  async #drawRecent() {
    const found = await fetch("sessions").then((answer) => answer.json(), () => []);
    by("recent-head").hidden = !found.length;
    by("recent").innerHTML = found.map(({ name, title, words, when, picture }) => `<figure>
      <button type="button" data-session="${name}">${/^data:image\//.test(picture) ? `<img alt="" src="${escaped(picture)}">` : ""}
      <b>${escaped(title || "Untitled")}</b><small>${escaped(words)}<br>${escaped(when)}</small></button>
      <button type="button" class="away" data-forget="${name}" aria-label="Forget ${escaped(title)}">×</button></figure>`).join("");
  }
}
