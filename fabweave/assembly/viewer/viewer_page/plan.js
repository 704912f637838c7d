"use strict";

/** Read what the page holds, and index it. */
function readPlan(text) {
  const data = JSON.parse(text);
  const { pieces, joints, steps, threads, sheets } = data.plan;
  const pieceAt = new Map(pieces.map((piece, index) => [piece.id, index]));
  const threadOf = new Map(threads.map((thread, index) => [thread.id, index]));
  const jointOf = new Map(joints.map((joint) => [joint.id, joint]));
  const sheetAt = new Map(sheets.map((sheet, index) => [sheet.sheet, index]));
  const stepOf = new Int32Array(pieces.length).fill(-1);
  steps.forEach((step, index) => step.pieces.forEach((id) => (stepOf[pieceAt.get(id)] = index)));
  // Flat, a piece has the colour that most of it has.
  const colour = data.colours.map((runs) => runs.reduce((most, run) => (run[1] > most[1] ? run : most))[0]);

  /** Name the bunch of a thread: with two, warp and weft. */
  const bunches = new Set(threads.map((thread) => thread.bunch));
  const warp = new Set(data.plan.weave.warp || []);
  const woven = warp.size > 0;
  function bunchName(thread) {
    if (woven) return warp.has(thread.id) ? "warp" : "weft";
    if (bunches.size === 2) return thread.bunch === 0 ? "warp" : "weft";
    return bunches.size === 1 ? "" : `bunch ${thread.bunch + 1}`;
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

  /** Find pieces by a label: A3, a whole thread A, or the joint #12; the exact ones first. */
  function search(query, most) {
    const wanted = query.trim().toUpperCase().replace(/\s+/g, "");
    if (!wanted) return [];
    if (wanted.startsWith("#")) {
      const joint = jointOf.get(Number(wanted.slice(1)));
      if (!joint || wanted.length < 2) return [];
      return [...new Set(joint.pieces)].map((id) => ({ piece: pieceAt.get(id), why: `joint #${joint.id}` }));
    }
    const exact = pieceAt.has(wanted) ? [pieceAt.get(wanted)] : [];
    const thread = threads.find(({ label }) => label.toUpperCase() === wanted);
    const ofThread = thread ? thread.pieces.map((id) => pieceAt.get(id)) : [];
    const begun = pieces.flatMap(({ id }, index) => (id.toUpperCase().startsWith(wanted) ? [index] : []));
    return [...new Set([...exact, ...ofThread, ...begun])].slice(0, most).map((piece) => ({
      piece,
      why: `thread ${threads[threadOf.get(pieces[piece].thread)].label}, sheet ${pieces[piece].sheet}`,
    }));
  }

  return {
    data, plan: data.plan, pieces, steps, sheets, threads, pieceAt, stepOf, colour, jointOf, sheetAt,
    thread: (piece) => threads[threadOf.get(piece.thread)],
    bunchName, distances, mate, search,
  };
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
