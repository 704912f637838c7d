import { by } from "../../show/scripts/html.js";

/** The cut is played in so many milliseconds, whatever it takes. */
const PLAY_MS = 9000;

/** How long an outline is, and the rims of its holes. @param {Record<string, any>} piece */
function length({ outline, holes }) {
  const around = outline.reduce((/** @type {number} */ sum, /** @type {number[]} */ [x, y], /** @type {number} */ k) => {
    const [a, b] = outline[(k + 1) % outline.length];
    return sum + Math.hypot(a - x, b - y);
  }, 0);
  return holes.reduce((/** @type {number} */ sum, /** @type {number[]} */ [, , d]) => sum + Math.PI * d, around);
}

/** The cut of all sheets, played: pieces one after the other, with the time that it takes. */
export class Cut {
  #running = 0;

  /**
   * @param {() => Record<string, any>} plan
   */
  constructor(plan) {
    this.plan = plan;
    const panel = by("panel-sheets");
    panel.addEventListener("click", ({ target }) => target.id === "cut-play" && this.#toggle());
    panel.addEventListener("input", ({ target }) => {
      if (target.id !== "cut-time") return;
      this.stop();
      this.#show(Number(target.value));
    });
  }

  #toggle() {
    if (this.#running) return this.stop();
    const begun = performance.now(), from = Number(by("cut-time").value) % 1;
    by("cut-play").textContent = "Pause";
    const step = () => {
      const at = from + (performance.now() - begun) / PLAY_MS;
      this.#show(Math.min(at, 1));
      if (at < 1 && by("cut-time")) this.#running = requestAnimationFrame(step);
      else this.stop();
    };
    this.#running = requestAnimationFrame(step);
    return undefined;
  }

  stop() {
    cancelAnimationFrame(this.#running);
    this.#running = 0;
    if (by("cut-play")) by("cut-play").textContent = "Play the cut";
  }

  /** Show what is cut after a share of the time. @param {number} share */
  #show(share) {
    const panel = by("panel-sheets"), { pieces, figures } = this.plan();
    const shapes = [...panel.querySelectorAll(".piece")];
    const lengths = shapes.map((shape) => length(pieces[Number(shape.dataset.piece)]));
    const all = lengths.reduce((sum, one) => sum + one, 0) || 1;
    let done = 0;
    for (const svg of panel.querySelectorAll("svg")) svg.classList.toggle("cutting", share < 1);
    shapes.forEach((shape, k) => {
      const begun = done / all, ended = (done + lengths[k]) / all;
      done += lengths[k];
      shape.classList.toggle("cut", ended <= share);
      const burning = begun <= share && share < ended;
      shape.classList.toggle("burning", burning);
      shape.style.strokeDasharray = burning ? `${(share - begun) / (ended - begun)} 1` : "";
    });
    by("cut-time").value = share;
    const minutes = figures.cutting_h?.map((/** @type {number} */ h) => (60 * h * share).toFixed(0));
    by("cut-said").textContent = minutes ? `after ${minutes.join(" to ")} min` : `${(100 * share).toFixed(0)} %`;
  }
}
