import { by, escaped } from "../../show/scripts/html.js";
import { thumb } from "./thumbs.js";

/** @typedef {Record<string, any>} Control As the server describes it. */

/** @param {Control} control */
const fieldName = ({ option, label }) => `${option}-${label}`.replace(/[^\w-]/g, "_");

/** @param {string} name @returns {any} All fields of a control. */
const fieldsOf = (name) => by("controls").querySelectorAll(`[data-field="${name}"]`);

/** @param {Control} control */
function fieldOf({ kind, group, label, choices, asides, unit, ...rest }) {
  const name = `data-field="${fieldName({ label, ...rest })}" aria-label="${escaped(`${group}: ${label}`)}"`;
  if (kind === "choice") {
    // Browsers that show nothing but text in a list leave the drawings out.
    const options = choices.map(([value, text], k) => {
      const [colour, price] = asides[k] ?? [];
      const aside = price ? ` <small>${escaped(price)}</small>` : "";
      return `<option value="${escaped(value)}">${thumb(rest.option, value, colour)}${escaped(text)}${aside}</option>`;
    });
    return `<select ${name}><button><selectedcontent></selectedcontent></button>${options.join("")}</select>`;
  }
  if (kind === "text") return `<input type="text" ${name} spellcheck="false">`;
  const number = `<input type="number" ${name}>${unit ? `<small>${unit}</small>` : ""}`;
  return `<span class="both">${number}</span><input type="range" ${name}>`;
}

/** A field with its name, and what it is for behind a button. @param {Control} one @param {string} head */
function rowOf(one, head) {
  const field = `<span>${escaped(one.label)}</span>${fieldOf(one)}`, id = `help-${fieldName(one)}`;
  const help = one.help ? `<button type="button" class="ask" aria-expanded="false" aria-controls="${id}"
    aria-label="About ${escaped(one.label)}">?</button><p class="help" id="${id}" hidden>${escaped(one.help)}</p>` : "";
  return `${head}<div class="control"><label class="${one.kind}">${field}</label>${help}</div>`;
}

/** The controls of the page, as the server wants them for what is seen. */
export class Controls {
  #structure = "";

  /**
   * @param {(control: Control, said: string | null, keep: boolean) => void} change What a field says.
   * @param {(text: string) => void} refuse What a field says that makes no sense.
   */
  constructor(change, refuse) {
    this.change = change;
    this.refuse = refuse;
    const form = by("controls");
    form.addEventListener("input", ({ target }) => target.type === "range" && this.#taken(target, false));
    form.addEventListener("change", ({ target }) => this.#taken(target, true));
    form.addEventListener("submit", (event) => event.preventDefault());
    form.addEventListener("click", ({ target }) => {
      const ask = target.closest(".ask"), help = ask && by(ask.getAttribute("aria-controls"));
      if (!help) return;
      help.hidden = !help.hidden;
      ask.setAttribute("aria-expanded", String(!help.hidden));
    });
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
    by("controls").innerHTML = list.map((one, k) =>
      rowOf(one, one.group === list[k - 1]?.group ? "" : `<h2>${one.group}</h2>`)).join("");
    if (focused) fieldsOf(focused)[0]?.focus();
  }

  #set(field, control) {
    const { kind, least, most, step, value } = control;
    field.control = control;
    if (field.type === "range") [field.min, field.max, field.step] = [least, most, step];
    // A number that is typed may go on beyond the slider.
    else if (kind === "range") field.step = "any";
    // What is being dragged or typed stays as it is.
    if (document.activeElement !== field || kind === "choice") field.value = value;
  }

  /** Take what a field says, or say why not; what is on its way is not kept. */
  #taken(field, keep) {
    const { control, value } = field;
    if (!control) return;
    if (control.kind === "range" && !(Number(value) > 0)) {
      this.refuse(`${control.label}: ${value === "" ? "nothing" : value} is no number above 0; it stays ${control.value}.`);
      field.value = control.value;
      return;
    }
    const text = control.kind === "range" ? String(Number(value)) : value;
    const said = text === "" ? null : control.template.replace("{}", () => text);
    if (!keep && said === null) return;
    for (const other of fieldsOf(field.dataset.field)) if (other !== field) other.value = value;
    this.change(control, said, keep);
  }
}
