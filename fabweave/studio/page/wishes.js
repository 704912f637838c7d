/** After so long without a change, pieces, sheets and steps are made; an answer is late after so long. */
const REST_MS = 500, LATE_MS = 900;
/** After so long more, sheets are nested as they will be. */
const FINER_MS = 2500;
/** A server that is gone is called again after so long, and then less and less often. */
const AGAIN_MS = 500, SELDOM_MS = 8000;

/** @typedef {"look" | "plan" | "make" | "choose"} To Who is asked. */

/**
 * What wishes need to know, and whom they tell.
 *
 * @typedef {object} Company
 * @property {() => object} state What all wishes are about.
 * @property {() => object} view What is wished to be seen of it.
 * @property {() => boolean} begun Whether there is anything to be seen.
 * @property {() => boolean} raw Whether a mesh is to be chosen first.
 * @property {() => boolean} yarns
 * @property {() => boolean} rough Whether sheets could be nested better.
 * @property {() => void} reached The server is there.
 * @property {() => void} lost The server is gone.
 * @property {(data: string | ArrayBuffer) => void} told
 * @property {(to: To, stopped: boolean) => void} ended
 */

/** What is asked of the server, and when. */
export class Wishes {
  /** @type {WebSocket | null} */
  #socket = null;
  #number = 0;
  #retry = 0;
  /** The numbers of the wishes under way; 0 for none. @type {Record<To, number>} */
  #flight = { look: 0, plan: 0, make: 0, choose: 0 };
  #since = 0;
  #dirty = false;
  // Timers: for a late answer, for rest, and for finer sheets.
  #late = 0;
  #resting = 0;
  #finer = 0;

  /** @param {string} address @param {Company} company */
  constructor(address, company) {
    this.address = address;
    this.company = company;
  }

  connect() {
    const socket = new WebSocket(this.address);
    this.#socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.#retry = this.#flight.look = this.#flight.plan = this.#flight.choose = 0;
      this.company.reached();
      if (this.company.begun()) this.look();
      else this.ask("choose", { examples: true });
    };
    socket.onmessage = ({ data }) => this.company.told(data);
    socket.onclose = () => {
      this.company.lost();
      setTimeout(() => this.connect(), Math.min(SELDOM_MS, AGAIN_MS * 2 ** this.#retry++));
    };
  }

  /** Call no more. */
  end() {
    if (this.#socket) this.#socket.onclose = null;
  }

  /** @param {To} to */
  ask(to, more = {}) {
    if (this.#send(to, more)) this.#flight[to] = this.#number;
  }

  /** Stop what is done for a wish, if any is under way. @param {To[]} all */
  stop(...all) {
    clearTimeout(this.#resting);
    this.#resting = 0;
    for (const to of all) if (this.#flight[to]) this.#send(to, { stop: true });
  }

  /** @param {To} to @param {object} more */
  #send(to, more) {
    if (this.#socket?.readyState !== WebSocket.OPEN) return false;
    this.#number += 1;
    this.#socket.send(JSON.stringify({ n: this.#number, to, ...this.company.state(), ...more }));
    return true;
  }

  /** Ask how the object looks; while an answer is under way, as soon as that is there, or late. */
  look() {
    clearTimeout(this.#late);
    this.#dirty = Boolean(this.#flight.look) && performance.now() - this.#since < LATE_MS;
    if (this.#dirty) this.#late = setTimeout(() => this.look(), LATE_MS);
    else {
      this.#since = performance.now();
      this.ask("look", this.company.view());
    }
  }

  /** The state has changed: what was planned counts no more. */
  changed() {
    clearTimeout(this.#finer);
    this.stop("plan", "choose");
    this.#flight.plan = this.#flight.choose = 0;
    this.look();
  }

  /**
   * Whether an answer is still wanted: only the latest counts; of looks, all that come are newer
   * than what is seen.
   *
   * @param {To} to
   * @param {number} number
   */
  wanted(to, number) {
    return to === "look" || to === "make" || number === this.#flight[to];
  }

  /**
   * A wish is done, or was stopped.
   *
   * @param {To} to
   * @param {number} number
   * @param {boolean} stopped
   */
  ended(to, number, stopped) {
    if (number !== this.#flight[to]) return;
    this.#flight[to] = 0;
    if (to === "look" && this.#dirty) this.look();
    else if (to === "look" && !stopped) this.#rest();
    else if (to === "plan" && !stopped && this.company.rough())
      this.#finer = setTimeout(() => this.ask("plan", { finer: true }), FINER_MS);
    this.company.ended(to, stopped);
  }

  /** A mesh is chosen at once; what it comes to is found out when nothing changes for a while. */
  #rest() {
    clearTimeout(this.#resting);
    if (this.company.raw()) this.ask("choose");
    else this.#resting = setTimeout(() => this.plan(), REST_MS);
  }

  /** Find out what it comes to. */
  plan() {
    this.#resting = 0;
    this.ask("plan", { yarns: this.company.yarns() });
  }

  /** Whether something is under way. @param {To[]} all */
  waits(...all) {
    return all.some((to) => this.#flight[to] > 0);
  }

  /** Whether what is seen is what was asked for last, and planned. */
  get settled() {
    return !this.#dirty && !this.#resting && !this.#flight.look && !this.#flight.choose;
  }
}
