import { escaped } from "../../scripts/html.js";

/** A bunch is called by so many of its threads; the others are counted. */
const MOST_LABELS = 6;

/** @typedef {Record<string, any>} Values What the page holds is checked where it is made. */

/** What the page holds, with an index to it. */
export class Plan {
  /** The colour of each piece, flat. @type {string[]} */
  colour = [];

  /** @param {string} text */
  constructor(text) {
    /** @type {Values} */
    this.data = JSON.parse(text);
    this.plan = this.data.plan;
    const { pieces, joints, steps, threads, sheets, crossings, weave, cut } = this.plan;
    /** @type {Values[]} */
    this.pieces = pieces;
    /** @type {Values[]} */
    this.steps = steps;
    /** @type {Values[]} */
    this.sheets = sheets;
    /** @type {Values[]} */
    this.threads = threads;
    this.pieceAt = byKey(pieces, "id");
    this.sheetAt = byKey(sheets, "sheet");
    /** @type {Map<number, any>} */
    this.jointOf = new Map(joints.map((joint) => [joint.id, joint]));
    /** @type {Map<number, any>} */
    this.crossingOf = new Map(crossings.map((crossing) => [crossing.id, crossing]));
    this.jointsAt = groupedBy(joints, (joint) => joint.crossing);
    this.threadAt = byKey(threads, "id");
    // The step of each piece, counted from 0.
    this.stepOf = new Int32Array(pieces.length).fill(-1);
    this.steps.forEach((step, index) => this.piecesOf(step).forEach((piece) => (this.stepOf[piece] = index)));
    this.bunches = groupedBy(this.threads, (thread) => thread.bunch);
    this.warp = new Set(weave.warp);
    // Where pieces bear their kinds, those are what a person finds on them.
    this.byKind = cut.labels === "kinds";
    // What lies on the sheets besides, and is woven nowhere.
    this.spares = (this.plan.spares || []).map((spare) => ({ ...this.piece(spare.of), ...spare }));
  }

  /** A piece by its label. @param {string} id */
  piece(id) {
    return this.pieces[this.pieceAt.get(id)];
  }

  /**
   * The numbers of the pieces of a step; rings are none.
   *
   * @param {Values} step
   * @returns {number[]}
   */
  piecesOf(step) {
    return step.pieces.map((id) => this.pieceAt.get(id));
  }

  /**
   * What the stations of a piece are called: in the step that places it, what it meets then has
   * numbers from its start, as in the manual, and the others have none; else all count from 0.
   *
   * @param {number} number
   * @param {Values | null} step
   * @returns {string[]}
   */
  stationNames(number, step) {
    const piece = this.pieces[number];
    if (!step?.pieces.includes(piece.id)) return piece.stations.map((_, k) => String(k));
    let count = 0;
    return piece.stations.map(({ crossing, over }) =>
      (over ? step.over : step.under).includes(crossing) ? String(++count) : "");
  }

  /**
   * The numbers of the pieces that those of a step lie over and run under, and that its words name.
   *
   * @param {Values} step
   * @returns {Set<number>}
   */
  metIn(step) {
    const stations = step.pieces.flatMap((id) => this.piece(id).stations);
    const met = stations.filter(({ crossing, over }) => (over ? step.over : step.under).includes(crossing));
    const named = (step.text.match(/[A-Za-z]+\d+/g) || []).filter((id) => this.pieceAt.has(id));
    return new Set([...met.map(({ partner }) => partner), ...named].map((id) => this.pieceAt.get(id)));
  }

  /** @param {Values} piece */
  thread(piece) {
    return this.threads[this.threadAt.get(piece.thread)];
  }

  /**
   * Name the bunch of a thread for people: with two, warp and weft; of more, by its threads.
   *
   * @param {Values} thread
   */
  bunchName(thread) {
    if (this.warp.size) return this.warp.has(thread.id) ? "warp" : "weft";
    if (this.bunches.size === 2) return thread.bunch === 0 ? "warp" : "weft";
    return this.bunches.size === 1 ? "" : few(this.#labels(thread));
  }

  /** The threads of the same bunch. @param {Values} thread @returns {string[]} */
  #labels(thread) {
    return (this.bunches.get(thread.bunch) || []).map(({ label }) => label);
  }

  /**
   * Say to which bunch a thread belongs, where there are several; else nothing.
   *
   * @param {Values} thread
   */
  bunchWords(thread) {
    const name = this.bunchName(thread), others = this.#labels(thread).filter((label) => label !== thread.label);
    if (this.warp.size || this.bunches.size <= 2) return name && ` (${name})`;
    return others.length ? ` (it crosses none of ${few(others)})` : "";
  }

  /**
   * The distance of every station of a piece from its first one, in millimetres.
   *
   * @param {Values} piece
   */
  distances({ stations }) {
    let run = 0;
    return stations.map((station, k) => {
      const before = stations[k - 1];
      if (before) run += Math.hypot(station.x - before.x, station.y - before.y);
      return station.distance_mm ?? run;
    });
  }

  /**
   * The label of the piece at the other side of a joint.
   *
   * @param {Values} piece
   * @param {number} joint
   */
  mate(piece, joint) {
    const { pieces: [ends, begins] } = this.jointOf.get(joint);
    return ends === piece.id ? begins : ends;
  }

  /** What a piece bears. @param {number} number */
  bears(number) {
    const { kind, id } = this.pieces[number];
    return this.byKind ? `K${kind}` : id;
  }

  /** @param {number} number */
  named(number) {
    const { kind, id } = this.pieces[number];
    return this.byKind ? `K${kind} (${id})` : id;
  }

  /** @param {string} id */
  nameOf(id) {
    return this.named(this.pieceAt.get(id));
  }

  /** @param {Values} spare */
  spareName(spare) {
    return this.byKind ? `K${spare.kind}` : spare.id;
  }

  /**
   * What is to be taken for a place: one of its kind, perhaps with its arrow against the thread.
   *
   * @param {string} id
   */
  takenFor(id) {
    return this.nameOf(id) + (this.byKind && this.piece(id).turned ? ", arrow back" : "");
  }

  /** A piece's name as a link to it, and to one of its stations. @param {string} id */
  link(id, station = -1) {
    const to = `data-piece="${escaped(id)}" data-at="${station}"`;
    return `<button type="button" class="link" ${to}>${escaped(this.nameOf(id))}</button>`;
  }

  /**
   * A text with something else for each name of a piece, and for all the rest.
   *
   * @param {string} text
   * @param {(id: string) => string} name
   * @param {(part: string) => string} rest
   */
  #retold(text, name, rest) {
    const parts = text.split(/([A-Za-z]+\d+)/);
    return parts.map((part, k) => (k % 2 && this.pieceAt.has(part) ? name(part) : rest(part))).join("");
  }

  /**
   * A text in which pieces are links; a name stays with the comma or the point after it.
   *
   * @param {string} text
   */
  linked(text) {
    const linked = this.#retold(text, (id) => this.link(id), escaped);
    return linked.replace(/(<button[^>]*>[^<]*<\/button>)([,.;:)]+)/g, '<span class="tied">$1$2</span>');
  }

  /** A text in which pieces are called by what they bear. @param {string} text */
  told(text) {
    return this.#retold(text, (id) => this.nameOf(id), (part) => part);
  }

  /**
   * Where fasteners are set for good at a step: the crossing, its pieces, and how many there.
   *
   * @param {Values} step
   */
  fastenings(step) {
    const crossings = step.fasten.map((id) => this.crossingOf.get(id));
    return crossings.filter(({ fastened }) => fastened).map((crossing) => {
      const joints = this.jointsAt.get(crossing.id) || [];
      return { ...crossing, count: Math.max(joints.reduce((sum, { holes }) => sum + holes.length, 0), 1) };
    });
  }
}

/** Some labels, and how many more there are. @param {string[]} labels */
function few(labels) {
  const rest = labels.length - MOST_LABELS;
  return labels.slice(0, MOST_LABELS).join(", ") + (rest > 0 ? ` and ${rest} more` : "");
}

/**
 * The place of each value in a list by one of its entries.
 *
 * @param {Values[]} values
 * @param {string} key
 * @returns {Map<any, any>}
 */
function byKey(values, key) {
  return new Map(values.map((value, index) => [value[key], index]));
}

/**
 * Values in lists by what a key says of them, in the order in which they come.
 *
 * @template V, K
 * @param {V[]} values
 * @param {(value: V) => K} keyOf
 */
export function groupedBy(values, keyOf) {
  /** @type {Map<K, V[]>} */
  const lists = new Map();
  for (const value of values) {
    const list = lists.get(keyOf(value));
    if (list) list.push(value);
    else lists.set(keyOf(value), [value]);
  }
  return lists;
}
