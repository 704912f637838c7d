import { memory } from "../../show/scripts/html.js";

/** So many states can be undone, and so many variants are kept. */
const MOST_STATES = 200, MOST_KEPT = 24;
const LETTERS = "abcdefghijkmnpqrstuvwxyz23456789";

/** @typedef {import("./options.js").State} State */
/** @typedef {{ name: string, state: State, words: string, picture: string }} Variant */

const newName = () =>
  Array.from(crypto.getRandomValues(new Uint8Array(12)), (byte) => LETTERS[byte % LETTERS.length]).join("");

/** What a page did: states that can be undone, and variants that are kept. The server has it in a file. */
export class Session {
  /** @type {State[]} */
  states = [];
  at = -1;
  /** @type {Variant[]} */
  kept = [];
  #shown = { title: "", picture: "", words: "" };
  #saving = false;
  #unsaved = false;

  /** @param {string} [name] The name of one that goes on. */
  constructor(name) {
    this.name = name ?? newName();
  }

  /** The one that the address names, if the server has it. */
  static async named() {
    const name = location.hash.slice(1);
    if (!/^[a-z0-9]{8,32}$/.test(name)) return null;
    const found = await fetch(`session/${name}`).then((answer) => (answer.ok ? answer.json() : null), () => null);
    if (!found?.states?.length) return null;
    const session = new Session(name);
    session.states = found.states;
    session.at = Math.min(Math.max(found.at, 0), found.states.length - 1);
    session.kept = found.kept ?? [];
    return session;
  }

  /** @returns {State} */
  get now() {
    return this.states[this.at];
  }

  /** @param {State} state */
  add(state) {
    this.states.splice(this.at + 1, Infinity, state);
    if (this.states.length > MOST_STATES) this.states.shift();
    this.at = this.states.length - 1;
    this.save();
  }

  /** What is said more of the state that it is at. @param {State} state */
  replace(state) {
    this.states[this.at] = state;
    this.save();
  }

  /** Whether there is a state so many steps on. @param {number} steps */
  has(steps) {
    return this.at + steps in this.states;
  }

  /** @param {number} steps */
  go(steps) {
    this.at += steps;
    this.save();
  }

  /** @param {Variant} variant */
  keep(variant) {
    this.kept = [variant, ...this.kept].slice(0, MOST_KEPT);
    this.save();
  }

  /** @param {number} number */
  drop(number) {
    this.kept.splice(number, 1);
    this.save();
  }

  /** What the list of recent work shows of it. @param {{ title: string, picture: string, words: string }} shown */
  show(shown) {
    this.#shown = shown;
    this.save();
  }

  /** Let the server write it, once for what comes while it writes. */
  async save() {
    this.#unsaved = true;
    if (this.#saving || !this.states.length) return;
    this.#saving = true;
    history.replaceState(null, "", `#${this.name}`);
    while (this.#unsaved) {
      this.#unsaved = false;
      const { states, at, kept } = this, body = JSON.stringify({ ...this.#shown, states, at, kept });
      await fetch(`session/${this.name}`, { method: "POST", body }).catch(() => {});
    }
    this.#saving = false;
  }
}

/** What a browser remembers of how the page is to look. */
export const taste = memory(() => localStorage, "fabweave-studio");
