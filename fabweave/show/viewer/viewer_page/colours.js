/** Colours that eight groups have, told apart by the colour-blind (Okabe and Ito, two made lighter). */
const SAFE = ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442", "#8a8a8a"];
/** From the first step to the last: dark blue, green, yellow, of rising lightness. */
const RAMP = ["#3b2a7a", "#2c6a9b", "#1f9a8a", "#6cc24a", "#f2e147"];
/** A legend names no more groups; the others are counted. */
const MOST_NAMED = 40;

/** The colour of a group: safe ones first, then hues far from one another, by turns dark and light. */
function groupColour(number, count) {
  if (count <= SAFE.length) return SAFE[number];
  const hue = (number * 137.508) % 360, light = [0.5, 0.66, 0.38][number % 3];
  const part = (k) => {
    const at = (k + hue / 30) % 12, reach = 0.62 * Math.min(light, 1 - light);
    return Math.round(255 * (light - reach * Math.max(-1, Math.min(at - 3, 9 - at, 1)))).toString(16).padStart(2, "0");
  };
  return `#${part(0)}${part(8)}${part(4)}`;
}

/** A colour between the ends of the ramp, from 0 to 1. */
function rampColour(share) {
  const at = Math.max(0, Math.min(0.9999, share)) * (RAMP.length - 1), low = Math.floor(at);
  const [from, to] = [rgbOf(RAMP[low]), rgbOf(RAMP[low + 1])];
  return `#${from.map((part, k) => Math.round(part + (to[k] - part) * (at - low)).toString(16).padStart(2, "0")).join("")}`;
}

/** Red, green and blue of a colour such as #0072b2. */
function rgbOf(colour) {
  const rgb = parseInt(colour.slice(1), 16);
  return [rgb >> 16, (rgb >> 8) & 255, rgb & 255];
}

/** What pieces can be coloured by: for each scheme, the group of a piece in words. */
function colourSchemes(plan) {
  const sheetOf = (piece) => plan.sheets[plan.sheetAt.get(piece.sheet)];
  return {
    job: null,
    thread: (piece) => plan.thread(piece).label,
    direction: (piece) => plan.bunchName(plan.thread(piece)) || "all",
    sheet: (piece) => `sheet ${piece.sheet}`,
    step: (piece, index) => plan.stepOf[index] + 1,
    material: (piece) => sheetOf(piece).material,
    kind: (piece) => `kind ${piece.kind}`,
    ...(plan.data.space.let_go ? { form: () => "" } : {}),
  };
}

/** Colour all pieces by a scheme.
 *
 * Returns for each piece its colours along it, each with the number of rungs that have it, the one
 * that it has flat, and the groups: name, colour and members; null where a ramp says it all, between
 * its two ends. */
function colourBy(plan, scheme) {
  const groupOf = colourSchemes(plan)[scheme], counts = plan.data.space.counts;
  if (!groupOf) return jobColours(plan);
  if (scheme === "form") return formColours(plan);
  if (scheme === "step") {
    const flat = plan.pieces.map((_, index) => rampColour(plan.stepOf[index] / Math.max(plan.steps.length - 1, 1)));
    return { runs: flat.map((colour, index) => [[colour, counts[index]]]), flat, groups: null, ends: ["step 1", `step ${plan.steps.length}`] };
  }
  const members = groupedBy(plan.pieces.map((_, index) => index), (index) => groupOf(plan.pieces[index], index));
  // Threads stand in the order of their labels already: AA comes after Z.
  const names = [...members.keys()];
  if (scheme !== "thread") names.sort((a, b) => a.localeCompare(b, "en", { numeric: true }));
  const groups = names.map((name, number) => ({ name, colour: groupColour(number, names.length), members: members.get(name) }));
  const flat = [];
  for (const group of groups) for (const index of group.members) flat[index] = group.colour;
  return { runs: flat.map((colour, index) => [[colour, counts[index]]]), flat, groups };
}

/** The job's own colours; groups where each has a colour of its own. */
function jobColours(plan) {
  const runs = plan.data.colours, groups = new Map(), groupOf = new Map();
  // Flat, a piece has the colour that most of it has.
  const flat = runs.map((own) => own.reduce((most, run) => (run[1] > most[1] ? run : most))[0]);
  let told = true;
  plan.pieces.forEach((piece, index) => {
    const name = plan.bunchName(plan.thread(piece));
    if (name && !groups.has(name)) groups.set(name, { name, colour: flat[index], members: [] });
    if (name) groups.get(name).members.push(index);
    for (const [colour] of runs[index]) {
      told = told && (groupOf.get(colour) ?? name) === name;
      groupOf.set(colour, name);
    }
  });
  return { runs, flat, groups: !told || groups.size > 6 ? [] : [...groups.values()] };
}

/** How far each place goes when the object is let go: to the farthest of all. */
function formColours(plan) {
  const { let_go: going, counts } = plan.data.space, rungs = counts.reduce((sum, count) => sum + count, 0);
  const away = goneMm(motionOf(going, rungs)), most = Math.max(...away, 1e-9), runs = [], flat = [];
  let first = 0;
  for (const count of counts) {
    const own = Array.from(away.subarray(first, first + count));
    runs.push(own.map((mm) => [rampColour(mm / most), 1]));
    flat.push(rampColour(own.reduce((sum, mm) => sum + mm, 0) / count / most));
    first += count;
  }
  return { runs, flat, groups: null, ends: ["0 mm", `${most < 10 ? most.toFixed(1) : Math.round(most)} mm`] };
}

/** What a legend shows: a swatch and a name for each group, which shows it alone. */
function legendOf(plan, { groups, ends }) {
  if (!groups)
    return `<li>${ends[0]}</li><li class="ramp" style="background:linear-gradient(to right, ${RAMP.join(", ")})"></li><li>${ends[1]}</li>`;
  const rows = groups.slice(0, MOST_NAMED).map(({ name, colour }, k) => `<li><button type="button" data-group="${k}" title="Show alone">
    <span class="swatch" style="background:${colour}"></span>${escaped(name)}</button></li>`);
  if (groups.length > MOST_NAMED) rows.push(`<li>and ${groups.length - MOST_NAMED} more</li>`);
  return rows.join("");
}
