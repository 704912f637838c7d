/** A longer time between two ticks is a pause that nobody said, milliseconds. */
const LONGEST_GAP_MS = 15 * 60 * 1000;
/** Steps that are ticked so soon after another are ticked with it. */
const TOGETHER_MS = 3000;

/** Keep how long steps take whoever does them.
 *
 * A step takes what passed since the tick before, without pauses. The first tick starts the clock,
 * if nobody did; its step is not timed, and neither is one after too long a gap, nor what is ticked
 * along with these. */
function makeLog(plan, kept) {
  const { timed_s: estimates, calibration } = plan.data.hands;
  const rows = Array.isArray(kept.times) ? kept.times : [];
  const fits = (row) => Array.isArray(row) && estimates[row[0] - 1] !== undefined && Number.isFinite(row[1]);
  // When each was done, and what it took in milliseconds; null where that is not known.
  const times = new Map(rows.filter(fits).map(([step, at, ms]) => [step, { at, ms: Number.isFinite(ms) && ms >= 0 ? ms : null }]));
  const watch = { running: false, since: 0, spent: 0, last: 0, ...(kept.watch && typeof kept.watch === "object" ? kept.watch : {}) };
  const timed = () => [...times].filter(([, { ms }]) => ms !== null).sort(([a], [b]) => a - b);

  /** What has passed since the last tick, without pauses; null where nobody knows. */
  function lap(now) {
    const gap = watch.running ? now - watch.since : 0;
    return watch.spent === null || !(gap >= 0 && gap <= LONGEST_GAP_MS) ? null : watch.spent + gap;
  }

  function tick(step) {
    const now = Date.now(), ms = lap(now), before = times.get(watch.last);
    const never = !watch.since, along = before && before.ms === null && ms < TOGETHER_MS;
    times.set(step, { at: now, ms: never || along || (!watch.running && !ms) ? null : ms });
    Object.assign(watch, { running: watch.running || never, since: now, spent: 0, last: step });
  }

  /** Take a tick back: if it was the last one, its time goes on. */
  function untick(step) {
    const { ms } = times.get(step) || { ms: null };
    if (step === watch.last) Object.assign(watch, { spent: ms === null ? null : watch.spent + ms, last: 0 });
    times.delete(step);
  }

  function toggle() {
    const now = Date.now();
    Object.assign(watch, { running: !watch.running, spent: lap(now), since: now });
  }

  /** What is exported, which --calibrate takes. */
  const record = () => ({
    schema: "fabweave.log/1", job: plan.data.job, title: plan.data.title,
    steps: timed().map(([step, { at, ms }]) => ({
      step, done_at: new Date(at).toISOString(), seconds: ms / 1000, estimate_s: estimates[step - 1] / calibration,
    })),
  });

  /** Say what is timed, and how that compares. */
  function words() {
    const steps = record().steps, sum = (key) => steps.reduce((all, one) => all + one[key], 0);
    if (!steps.length) return watch.since ? "No step is timed yet." : "The first tick starts the clock.";
    const ratio = sum("seconds") / sum("estimate_s") / calibration, minutes = (sum("seconds") / 60).toFixed(0);
    return `${steps.length} step${steps.length === 1 ? "" : "s"} in ${minutes} min, ${ratio.toFixed(2)} times the estimate.`;
  }

  return {
    tick, untick, toggle, record, words,
    get running() { return watch.running; },
    get begun() { return watch.since > 0; },
    kept: () => ({ times: [...times].map(([step, { at, ms }]) => [step, at, ms]), watch }),
  };
}

/** Let the browser save something as a file. */
function save(name, value) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([`${JSON.stringify(value, null, 1)}\n`], { type: "application/json" }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}
