/** @typedef {import("./plan.js").Values} Values */
/** @typedef {import("./plan.js").Plan} Plan */

/** @param {Plan} plan @param {number} number */
function whereIs(plan, number) {
  const { thread, sheet } = plan.pieces[number];
  return `thread ${plan.threads[plan.threadAt.get(thread)].label}, sheet ${sheet}`;
}

/**
 * Those pieces of which something is true.
 *
 * @param {Plan} plan
 * @param {(piece: Values) => boolean} holds
 */
const piecesWhere = (plan, holds) => plan.pieces.flatMap((piece, number) => (holds(piece) ? [number] : []));

/** Pieces, with where they are. @param {Plan} plan @param {number[]} members @returns {Values[]} */
const told = (plan, members) => members.map((piece) => ({ piece, why: whereIs(plan, piece) }));

/**
 * A group of pieces that can be shown alone, and then its pieces one by one; nothing for none.
 *
 * @param {Plan} plan
 * @param {string} name
 * @param {number[]} members
 * @param {number} [sheet]
 * @returns {Values[]}
 */
function group(plan, name, members, sheet) {
  if (!members.length) return [];
  const why = `${members.length} piece${members.length === 1 ? "" : "s"}, shown alone`;
  return [{ name, members, sheet, why }, ...told(plan, members)];
}

/**
 * What is found by a word and a number, such as step 7; nothing where there is no such thing.
 *
 * @type {Record<string, (plan: Plan, number: number) => Values[]>}
 */
const NUMBERED = {
  JOINT(plan, number) {
    const pieces = new Set(plan.jointOf.get(number)?.pieces);
    return [...pieces].map((id) => ({ piece: plan.pieceAt.get(id), why: `joint #${number}` }));
  },
  CROSSING(plan, number) {
    const crossing = plan.crossingOf.get(number);
    if (!crossing) return [];
    return ["over", "under"].map((way) => {
      const { piece, station } = crossing[way];
      return { piece: plan.pieceAt.get(piece), station, why: `${way} at crossing ${number}, station ${station}` };
    });
  },
  KIND: (plan, number) => group(plan, `Kind ${number}`, piecesWhere(plan, ({ kind }) => kind === number)),
  SHEET(plan, number) {
    const members = piecesWhere(plan, ({ sheet }) => sheet === number);
    return group(plan, `Sheet ${number}`, members, plan.sheetAt.get(number));
  },
  STEP(plan, number) {
    const step = plan.steps[number - 1];
    if (!step) return [];
    const names = [...step.pieces.map((id) => plan.nameOf(id)), ...(step.ring || [])];
    return [{ name: `Step ${number}`, step: number, why: names.join(", ") }];
  },
};

/**
 * What pieces and threads are called so; the exact ones first.
 *
 * @param {Plan} plan
 * @param {string} label
 */
function labelled(plan, label) {
  const is = (name) => name.toUpperCase() === label;
  const exact = told(plan, piecesWhere(plan, ({ id }) => is(id)));
  const [, kind] = /^K(\d+)$/.exec(label) || [], ofKind = kind ? NUMBERED.KIND(plan, Number(kind)) : [];
  const thread = plan.threads.find((one) => is(one.label));
  const own = thread && thread.pieces.map((id) => plan.pieceAt.get(id));
  const ofThread = thread ? group(plan, `Thread ${thread.label}`, own) : [];
  const begun = told(plan, piecesWhere(plan, ({ id }) => id.toUpperCase().startsWith(label)));
  // Where pieces bear their kinds, that is what K3 means.
  const first = plan.byKind ? [...ofKind, ...exact] : [...exact, ...ofKind], met = new Set();
  const all = [...first, ...ofThread, ...begun];
  return all.filter(({ piece }) => piece === undefined || (!met.has(piece) && met.add(piece)));
}

/**
 * Find what a query names: the piece A3, the thread A, the joint #12, a kind (kind 3, K3), a sheet
 * (sheet 2, sheet_02), a step (step 7), a crossing (crossing 12).
 *
 * @param {Plan} plan
 * @param {string} query
 */
export function search(plan, query) {
  const wanted = query.toUpperCase().replace(/\s+/g, "");
  const [, word, number] = /^(JOINT|CROSSING|KIND|SHEET|STEP)[_#]*(\d+)$/.exec(wanted) || [];
  if (word) return NUMBERED[word](plan, Number(number));
  if (/^#\d+$/.test(wanted)) {
    const joint = NUMBERED.JOINT(plan, Number(wanted.slice(1)));
    return joint.length ? joint : NUMBERED.CROSSING(plan, Number(wanted.slice(1)));
  }
  const label = wanted.replace(/^(PIECE|THREAD)(?=.)/, "");
  return label ? labelled(plan, label) : [];
}
