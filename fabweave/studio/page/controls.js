import { by, escaped } from "../../show/scripts/html.js";

/** @typedef {Record<string, any>} Control As the server describes it. */

/** @param {Control} control */
const fieldName = ({ option, label }) => `${option}-${label}`.replace(/[^\w-]/g, "_");

/** @param {string} name @returns {any} All fields of a control. */
const fieldsOf = (name) => by("controls").querySelectorAll(`[data-field="${name}"]`);

/** @param {Control} control */
function fieldOf({ kind, group, label, choices, unit, ...rest }) {
  const name = `data-field="${fieldName({ label, ...rest })}" aria-label="${escaped(`${group}: ${label}`)}"`;
  if (kind === "choice") {
    const options = choices.map(([value, text]) => `<option value="${escaped(value)}">${escaped(text)}</option>`);
    return `<select ${name}>${options.join("")}</select>`;
  }
  if (kind === "text") return `<input type="text" ${name} spellcheck="false">`;
  const number = `<input type="number" ${name}>${unit ? `<small>${unit}</small>` : ""}`;
  return `<span class="both">${number}</span><input type="range" ${name}>`;
}

/** The controls of the page, as the server wants them for what is seen. */
export class Controls {
  #structure = "";

  /**
   * @param {(control: Control, said: string | null, keep: boolean) => void} change What a field says.
   */
  constructor(change) {
    this.change = change;
    const form = by("controls");
    form.addEventListener("input", ({ target }) => target.type === "range" && this.#taken(target, false));
    form.addEventListener("change", ({ target }) => this.#taken(target, true));
    form.addEventListener("submit", (event) => event.preventDefault());
  }

  /** @param {Control[]} list */
  draw(list) {
    // These change without the fields being others.
    const structure = JSON.stringify(list.map(({ value, least, most, template, ...kept }) => kept));
    if (structure !== this.#structure) this.#build(list);
    this.#structure = structure;
    for (const control of list) for (const field of fieldsOf(fieldName(control))) this.#set(field, control);
  }

  /** @param {Control[]} list */
  #build(list) {
    const focused = /** @type {HTMLElement | null} */ (document.activeElement)?.dataset.field;
    by("controls").innerHTML = list.map((one, k) => {
      const head = one.group === list[k - 1]?.group ? "" : `<h2>${one.group}</h2>`;
      const field = `<span>${escaped(one.label)}</span>${fieldOf(one)}`;
      return `${head}<label class="${one.kind}" title="${escaped(one.help)}">${field}</label>`;
    }).join("");
    if (focused) fieldsOf(focused)[0]?.focus();
  }

  #set(field, control) {
    const { kind, least, most, step, value } = control;
    field.control = control;
    if (kind === "range") {
      [field.min, field.max] = [least, most];
      field.step = field.type === "number" ? "any" : step;
    }
    // What is being dragged or typed stays as it is.
    if (document.activeElement !== field || kind === "choice") field.value = value;
  }

  /** Take what a field says, if that makes sense; what is on its way is not kept. */
  #taken(field, keep) {
    const { control, value } = field;
    if (!control || (control.kind === "range" && (value === "" || !field.checkValidity()))) return;
    const text = control.kind === "range" ? String(Number(value)) : value;
    const said = text === "" ? null : control.template.replace("{}", () => text);
    if (!keep && said === null) return;
    for (const other of fieldsOf(field.dataset.field)) if (other !== field) other.value = value;
    this.change(control, said, keep);
  }
}
