/** How long steps take in practised hands, by the job's own estimate, and what that is for a maker.
 *
 * Fasteners are set where the last layer comes, other joints where their pieces meet; so all steps
 * together take what the estimate says of the whole. */
function makeClock(plan) {
  const { actions, practised_h: practised, hours } = plan.data.hands;
  const each = (name) => actions.find(({ action }) => action === name)?.each_s ?? 0;
  const setting = actions.filter(({ action }) => action.startsWith("fasten "));
  const fasten = setting.reduce((sum, one) => sum + one.count * one.each_s, 0) / Math.max(1, setting.reduce((sum, one) => sum + one.count, 0));
  const piece = each("sort") + each("find") + each("take"), align = each("align");
  const seconds = plan.steps.map((step) => {
    const fasteners = plan.fastenings(step).reduce((sum, { count }) => sum + count, 0);
    const held = step.joints.map((id) => each(plan.jointOf.get(id).kind)).filter(Boolean);
    return piece * step.pieces.length + each("over") * step.over.length + each("under") * step.under.length
      + (fasten + align) * fasteners + held.reduce((sum, one) => sum + one + align, 0);
  });
  const whole = Math.max(practised * 3600, 1);
  // A maker's pace, from quick to slow.
  const span = (some) => hours.map((most) => (some * most * 3600) / whole);
  return {
    seconds,
    /** How long a step takes, in words. */
    step: (number) => timeText(span(seconds[number - 1])),
    /** How long everything takes. */
    all: () => timeText(span(whole)),
    /** How long the steps take that are not done. */
    left: (done) => timeText(span(seconds.reduce((sum, one, k) => (done.has(k + 1) ? sum : sum + one), 0))),
  };
}

/** A range of seconds as people say it, as the other files of the job do. */
function timeText([low, high]) {
  if (high < 0.5) return "none";
  const unit = high > 3 * 3600 ? 3600 : 60, digits = high / unit < 10 ? 1 : 0;
  return `${(low / unit).toFixed(digits)} to ${(high / unit).toFixed(digits)} ${unit === 60 ? "min" : "h"}`;
}
