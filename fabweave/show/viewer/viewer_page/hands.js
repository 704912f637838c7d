/** @typedef {ReturnType<typeof makeClock>} Clock */

/**
 * How long steps take a maker, from quick to slow, by the job's own estimate.
 *
 * The page holds seconds of each step half way between, and the hours of the whole job, from which
 * the span about that is taken.
 *
 * @param {{ seconds: number[], hours: number[] }} hands
 */
export function makeClock({ seconds, hours }) {
  const middle = Math.sqrt(hours[0] * hours[1]) || 1;
  const span = (/** @type {number} */ some) => timeText(hours.map((end) => (some * end) / middle));
  const sum = (/** @type {number[]} */ some) => some.reduce((all, one) => all + one, 0);
  return {
    seconds,
    /** How long a step takes, in words. */
    step: (/** @type {number} */ number) => span(seconds[number - 1]),
    /** How long all steps take. */
    all: () => span(sum(seconds)),
    /** How long the steps take that are not done. */
    left: (/** @type {Set<number>} */ done) => span(sum(seconds.filter((_, k) => !done.has(k + 1)))),
  };
}

/**
 * A range of seconds as people say it, as the other files of the job do.
 *
 * @param {number[]} range
 */
function timeText([low, high]) {
  if (high < 0.5) return "none";
  const unit = high > 3 * 3600 ? 3600 : 60, digits = high / unit < 10 ? 1 : 0;
  return `${(low / unit).toFixed(digits)} to ${(high / unit).toFixed(digits)} ${unit === 60 ? "min" : "h"}`;
}
