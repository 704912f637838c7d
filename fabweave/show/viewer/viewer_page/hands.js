/** @typedef {ReturnType<typeof makeClock>} Clock */

/**
 * How long steps take a maker, by the job's own estimate.
 *
 * The page holds seconds of each step half way between, and the hours of the whole job: those of the
 * next of its kind, and of the first, which is what all and the rest are told by.
 *
 * @param {{ seconds: number[], hours: number[] }} hands
 */
export function makeClock({ seconds, hours }) {
  const middle = Math.sqrt(hours[0] * hours[1]) || 1;
  const first = (/** @type {number} */ some) => timeText((some * hours[1]) / middle);
  const sum = (/** @type {number[]} */ some) => some.reduce((all, one) => all + one, 0);
  return {
    seconds,
    /** How long a step takes, in words. */
    step: (/** @type {number} */ number) => timeText(seconds[number - 1]),
    /** How long all steps take at first. */
    all: () => first(sum(seconds)),
    /** How long the steps take that are not done. */
    left: (/** @type {Set<number>} */ done) => first(sum(seconds.filter((_, k) => !done.has(k + 1)))),
  };
}

/**
 * Seconds as people say them, as the other files of the job do.
 *
 * @param {number} seconds
 */
function timeText(seconds) {
  if (seconds < 0.5) return "none";
  const unit = seconds > 3 * 3600 ? 3600 : 60, digits = seconds / unit < 10 ? 1 : 0;
  return `${(seconds / unit).toFixed(digits)} ${unit === 60 ? "min" : "h"}`;
}
