/** A bunch is called by so many of its threads; the others are counted. */
const MOST_LABELS = 6;

/** Read what the page holds, and index it. */
function readPlan(text) {
  const data = JSON.parse(text);
  const { pieces, joints, steps, threads, sheets } = data.plan;
  const pieceAt = new Map(pieces.map((piece, index) => [piece.id, index]));
  const threadOf = new Map(threads.map((thread, index) => [thread.id, index]));
  const jointOf = new Map(joints.map((joint) => [joint.id, joint]));
  const crossingOf = new Map(data.plan.crossings.map((crossing) => [crossing.id, crossing]));
  const jointsAt = groupedBy(joints, (joint) => joint.crossing);
  const sheetAt = new Map(sheets.map((sheet, index) => [sheet.sheet, index]));
  const stepOf = new Int32Array(pieces.length).fill(-1);
  steps.forEach((step, index) => step.pieces.forEach((id) => (stepOf[pieceAt.get(id)] = index)));

  /** Name the bunch of a thread for people: with two, warp and weft; of more, by its threads. */
  const bunches = new Set(threads.map((thread) => thread.bunch)), bunchOf = new Map();
  for (const thread of threads) bunchOf.set(thread.bunch, [...(bunchOf.get(thread.bunch) || []), thread.label]);
  const warp = new Set(data.plan.weave.warp || []);
  const woven = warp.size > 0;
  function bunchName(thread) {
    if (woven) return warp.has(thread.id) ? "warp" : "weft";
    if (bunches.size === 2) return thread.bunch === 0 ? "warp" : "weft";
    return bunches.size === 1 ? "" : few(bunchOf.get(thread.bunch));
  }

  /** Some labels, and how many more there are. */
  function few(labels) {
    const rest = labels.length - MOST_LABELS;
    return labels.slice(0, MOST_LABELS).join(", ") + (rest > 0 ? ` and ${rest} more` : "");
  }

  /** Say to which bunch a thread belongs, where there are several; else nothing. */
  function bunchWords(thread) {
    const others = bunchOf.get(thread.bunch).filter((label) => label !== thread.label);
    if (woven || bunches.size <= 2) return bunchName(thread) && ` (${bunchName(thread)})`;
    return others.length ? ` (it crosses none of ${few(others)})` : "";
  }

  /** The distance of every station of a piece from its first one, in millimetres. */
  function distances(piece) {
    let run = 0;
    return piece.stations.map((station, k) => {
      const before = piece.stations[k - 1];
      if (before) run += Math.hypot(station.x - before.x, station.y - before.y);
      return station.distance_mm === undefined ? run : station.distance_mm;
    });
  }

  /** The label of the piece at the other side of a joint. */
  function mate(piece, jointId) {
    const [ends, begins] = jointOf.get(jointId).pieces;
    return ends === piece.id ? begins : ends;
  }

  // Where pieces bear their kinds, those are what a person finds on them.
  const byKind = data.plan.cut.labels === "kinds";
  const bears = (piece) => (byKind ? `K${pieces[piece].kind}` : pieces[piece].id);
  const named = (piece) => (byKind ? `K${pieces[piece].kind} (${pieces[piece].id})` : pieces[piece].id);
  const nameOf = (id) => named(pieceAt.get(id));
  // What lies on the sheets besides, and is woven nowhere.
  const spares = (data.plan.spares || []).map((spare) => ({ ...pieces[pieceAt.get(spare.of)], ...spare }));
  const spareName = (spare) => (byKind ? `K${spare.kind}` : spare.id);
  /** What is to be taken for a place: one of its kind, perhaps with its arrow against the thread. */
  const takenFor = (id) => nameOf(id) + (byKind && pieces[pieceAt.get(id)].turned ? ", arrow back" : "");

  /** A piece's name as a link to it, and to one of its stations. */
  const link = (id, station = -1) => `<button type="button" class="link" data-piece="${escaped(id)}" data-at="${station}">${escaped(nameOf(id))}</button>`;

  /** A text with something else for each name of a piece, and for all the rest. */
  const retold = (text, name, rest) => text.split(/([A-Za-z]+\d+)/).map((part, k) => (k % 2 && pieceAt.has(part) ? name(part) : rest(part))).join("");
  // A name stays with the comma or the point after it.
  const linked = (text) => retold(text, link, escaped).replace(/(<button[^>]*>[^<]*<\/button>)([,.;:)]+)/g, '<span class="tied">$1$2</span>');
  const told = (text) => retold(text, nameOf, (part) => part);

  /** Where fasteners are set for good at a step: the crossing, its pieces, and how many there. */
  function fastenings(step) {
    return step.fasten.map((id) => crossingOf.get(id)).filter((crossing) => crossing.fastened).map((crossing) => {
      const holes = (jointsAt.get(crossing.id) || []).reduce((sum, joint) => sum + joint.holes.length, 0);
      return { ...crossing, count: Math.max(holes, 1) };
    });
  }

  /** Those pieces of which something is true. */
  const piecesWhere = (holds) => pieces.flatMap((piece, index) => (holds(piece) ? [index] : []));

  const where = (piece) => `thread ${threads[threadOf.get(pieces[piece].thread)].label}, sheet ${pieces[piece].sheet}`;

  /** A group of pieces that can be shown alone, and then its pieces one by one; nothing for none. */
  function group(name, members, sheet) {
    if (!members.length) return [];
    const why = `${members.length} piece${members.length === 1 ? "" : "s"}, shown alone`;
    return [{ name, members, sheet, why }, ...members.map((piece) => ({ piece, why: where(piece) }))];
  }

  /** What is found by a word and a number, such as step 7; nothing where there is no such thing. */
  const numbered = {
    JOINT: (number) => {
      const joint = jointOf.get(number);
      return joint ? [...new Set(joint.pieces)].map((id) => ({ piece: pieceAt.get(id), why: `joint #${number}` })) : [];
    },
    CROSSING: (number) => {
      const crossing = crossingOf.get(number);
      return !crossing ? [] : ["over", "under"].map((way) => ({
        piece: pieceAt.get(crossing[way].piece), station: crossing[way].station,
        why: `${way} at crossing ${number}, station ${crossing[way].station}`,
      }));
    },
    KIND: (number) => group(`Kind ${number}`, piecesWhere(({ kind }) => kind === number)),
    SHEET: (number) => group(`Sheet ${number}`, piecesWhere(({ sheet }) => sheet === number), sheetAt.get(number)),
    STEP: (number) => (steps[number - 1] ? [{ name: `Step ${number}`, step: number, why: [...steps[number - 1].pieces.map(nameOf), ...(steps[number - 1].ring || [])].join(", ") }] : []),
  };

  /**
   * Find what a query names: the piece A3, the thread A, the joint #12, a kind (kind 3, K3), a
   * sheet (sheet 2, sheet_02), a step (step 7), a crossing (crossing 12); the exact ones first.
   */
  function search(query, most) {
    const wanted = query.toUpperCase().replace(/\s+/g, "");
    const [, word, number] = /^(JOINT|CROSSING|KIND|SHEET|STEP)[_#]*(\d+)$/.exec(wanted) || [];
    if (word) return numbered[word](Number(number)).slice(0, most);
    if (/^#\d+$/.test(wanted)) {
      const joint = numbered.JOINT(Number(wanted.slice(1)));
      return joint.length ? joint : numbered.CROSSING(Number(wanted.slice(1)));
    }
    const label = wanted.replace(/^(PIECE|THREAD)(?=.)/, "");
    if (!label) return [];
    const exact = piecesWhere(({ id }) => id.toUpperCase() === label).map((piece) => ({ piece, why: where(piece) }));
    const kind = /^K(\d+)$/.exec(label), ofKind = kind ? numbered.KIND(Number(kind[1])) : [];
    const thread = threads.find((one) => one.label.toUpperCase() === label);
    const ofThread = thread ? group(`Thread ${thread.label}`, thread.pieces.map((id) => pieceAt.get(id))) : [];
    const begun = piecesWhere(({ id }) => id.toUpperCase().startsWith(label)).map((piece) => ({ piece, why: where(piece) }));
    // Where pieces bear their kinds, that is what K3 means.
    const first = byKind ? [...ofKind, ...exact] : [...exact, ...ofKind];
    const all = [...first, ...ofThread, ...begun], met = new Set();
    return all.filter(({ piece }) => piece === undefined || (!met.has(piece) && met.add(piece))).slice(0, most);
  }

  return {
    /** The colour of each piece, flat. */
    colour: [],
    data, plan: data.plan, pieces, steps, sheets, threads, pieceAt, stepOf, jointOf, jointsAt, sheetAt,
    thread: (piece) => threads[threadOf.get(piece.thread)],
    bunchName, bunchWords, distances, mate, search, bears, named, nameOf, spares, spareName, takenFor, worst: data.worst, link, linked, told, fastenings,
  };
}

/** Values in lists by what a key says of them, in the order in which they come. */
function groupedBy(values, keyOf) {
  const lists = new Map();
  for (const value of values) {
    const key = keyOf(value);
    if (lists.has(key)) lists.get(key).push(value);
    else lists.set(key, [value]);
  }
  return lists;
}

/** Keep what was done between visits, where the browser lets us. */
function makeMemory(job) {
  const key = `fabweave:${job}`;
  return {
    read() {
      try {
        const kept = JSON.parse(localStorage.getItem(key));
        return kept && typeof kept === "object" ? kept : {};
      } catch (error) {
        return {};
      }
    },
    write(value) {
      try {
        localStorage.setItem(key, JSON.stringify(value));
      } catch (error) {
        // Private windows and strict settings refuse; the page works without.
      }
    },
  };
}

/** Write text into HTML. */
function escaped(text) {
  return String(text).replace(/[&<>"']/g, (sign) => `&#${sign.charCodeAt(0)};`);
}
