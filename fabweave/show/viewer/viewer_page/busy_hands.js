/** A finger that goes so far across, in pixels, turns to another step. */
const SWIPE_PX = 50;

/** What helps hands that hold strips: a swipe turns to another step, the screen stays on, steps are read aloud. */
export class BusyHands {
  /** @type {Promise<unknown> | undefined} */
  #awake;

  /**
   * @param {HTMLElement} card Where steps are told, and are swiped.
   * @param {(steps: number) => void} turn
   */
  constructor(card, turn) {
    let from = NaN;
    card.addEventListener("pointerdown", ({ clientX, pointerType }) => (from = pointerType === "mouse" ? NaN : clientX));
    card.addEventListener("pointerup", ({ clientX }) => {
      if (Math.abs(clientX - from) > SWIPE_PX) turn(clientX < from ? 1 : -1);
      from = NaN;
    });
    document.addEventListener("visibilitychange", () => {
      if (document.visibilityState === "visible" && this.#awake) this.#wake();
    });
  }

  /** Keep the screen on from now on, where the browser can. */
  stayAwake() {
    if (!this.#awake) this.#wake();
  }

  #wake() {
    // Where it is refused, as when the battery is low, the page works without.
    this.#awake = navigator.wakeLock?.request("screen").catch(() => undefined);
  }

  /** Say words aloud, in place of what is being said; nothing ends that. @param {string} words */
  say(words) {
    if (typeof speechSynthesis === "undefined") return;
    speechSynthesis.cancel();
    if (words) speechSynthesis.speak(new SpeechSynthesisUtterance(words));
  }
}
