import { memory } from "../../show/scripts/html.js";

/** So many states can be undone. */
const MOST_STATES = 200;

/** @typedef {import("./options.js").State} State */

/** The states that a page has been in, which can be undone and done again. */
export class History {
  /** @type {State[]} */
  #states;
  #at;

  /** @param {string} base Under which the browser keeps them. @param {State} first */
  constructor(base, first) {
    const [states, at] = ["states", "at"].map((name) => memory(() => sessionStorage, base + name));
    this.#states = states.read() || [first];
    this.#at = Math.min(at.read() ?? 0, this.#states.length - 1);
    this.keep = () => {
      states.write(this.#states);
      at.write(this.#at);
    };
  }

  /** @returns {State} */
  get now() {
    return this.#states[this.#at];
  }

  /** @param {State} state */
  add(state) {
    this.#states.splice(this.#at + 1, Infinity, state);
    if (this.#states.length > MOST_STATES) this.#states.shift();
    this.#at = this.#states.length - 1;
    this.keep();
  }

  /** Whether there is a state so many steps on. @param {number} steps */
  has(steps) {
    return this.#at + steps in this.#states;
  }

  /** @param {number} steps */
  go(steps) {
    this.#at += steps;
    this.keep();
  }
}
