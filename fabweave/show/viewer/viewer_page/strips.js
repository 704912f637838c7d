import * as THREE from "../../scripts/three.js";

/** @typedef {import("./plan.js").Plan} Plan */
/** @typedef {{ point: THREE.Vector3, normal: THREE.Vector3 }} Spot A place for a label. */
/** @typedef {ReturnType<typeof readStrips>} Strips */
/** @typedef {{ step_mm: number, steps: string } | null | undefined} Motion */

/**
 * Build every piece's strip: corners, normals, and what the shaders want to know.
 *
 * @param {Plan} plan
 */
export function readStrips(plan) {
  const { space } = plan.data, fromRight = bytes(space.from_right), rungs = fromRight.length;
  const position = cornersOf(space, rungs), ball = ballOf(position);
  const made = {
    position, normal: new Float32Array(rungs * 6), piece: new Float32Array(rungs * 2),
    across: new Float32Array(rungs * 2), along: new Float32Array(rungs * 2), dip: new Float32Array(rungs * 2),
    tint: new Float32Array(rungs * 6), away: new Float32Array(rungs * 6),
    going: motionOf(space.let_go, rungs), sway: motionOf(space.sway, rungs),
  };
  /** @type {number[]} */
  const firsts = [], counts = space.counts;
  counts.reduce((first, count) => {
    firsts.push(first);
    return first + count;
  }, 0);
  const laid = plan.pieces.map((piece, number) => {
    const first = firsts[number], count = counts[number], panels = space.panels[number];
    const middles = layRungs(made, number, first, count);
    made.dip.set(heights(piece, panels, made.along, first, count), 2 * first);
    // Of several materials each thread has its own thickness.
    const layer = Array.isArray(space.layer_mm) ? space.layer_mm[piece.thread] : space.layer_mm;
    // The two layers of a lap lie on one another, not in one another.
    if (piece.joints[0] !== null) lift(made, first + panels[0], layer / 2);
    if (piece.joints[1] !== null) lift(made, first + panels[panels.length - 1], -layer / 2);
    // Pieces are moved apart by the way from the middle of all to their own.
    const centre = middles.reduce((sum, point) => sum.add(point), new THREE.Vector3());
    centre.divideScalar(count).sub(ball.center);
    for (let corner = 2 * first; corner < 2 * (first + count); corner++) centre.toArray(made.away, 3 * corner);
    const quads = quadsOf(fromRight, first, count);
    return { centre, quads, spots: spotsOf(middles, panels, made.normal, first) };
  });
  return {
    made, ball, firsts, counts, placed: position.slice(),
    spots: laid.map(({ spots }) => spots), centres: laid.map(({ centre }) => centre),
    ...inOrder(plan, laid.map(({ quads }) => quads)),
  };
}

/**
 * The ends of all rungs, right and left.
 *
 * @param {import("./plan.js").Values} space
 * @param {number} rungs
 */
function cornersOf({ rungs: packed, origin_mm, step_mm }, rungs) {
  const raw = new DataView(bytes(packed).buffer);
  return new Float32Array(rungs * 6).map((_, k) => origin_mm[k % 3] + step_mm * raw.getUint16(2 * k, true));
}

/**
 * Say of the rungs of a piece which way they look, and how far along they are; return their middles.
 *
 * @param {Record<"position" | "normal" | "piece" | "across" | "along", Float32Array>} made
 * @param {number} number
 * @param {number} first
 * @param {number} count
 */
function layRungs(made, number, first, count) {
  const right = new THREE.Vector3(), left = new THREE.Vector3(), way = new THREE.Vector3();
  const middles = Array.from({ length: count }, (_, k) => {
    right.fromArray(made.position, 6 * (first + k));
    return left.fromArray(made.position, 6 * (first + k) + 3).add(right).multiplyScalar(0.5).clone();
  });
  let run = 0;
  middles.forEach((middle, k) => {
    const rung = first + k;
    if (k) run += middle.distanceTo(middles[k - 1]);
    way.subVectors(middles[Math.min(k + 1, count - 1)], middles[Math.max(k - 1, 0)]);
    right.fromArray(made.position, 6 * rung);
    left.fromArray(made.position, 6 * rung + 3).sub(right).cross(way).negate().normalize();
    for (const end of [0, 1]) {
      left.toArray(made.normal, 6 * rung + 3 * end);
      made.piece[2 * rung + end] = number;
      made.across[2 * rung + end] = end;
      made.along[2 * rung + end] = run;
    }
  });
  return middles;
}

/**
 * The triangles of a piece, two from each rung to the next.
 *
 * @param {Uint8Array} fromRight
 * @param {number} first
 * @param {number} count
 */
function quadsOf(fromRight, first, count) {
  return Array.from({ length: count - 1 }, (_, k) => {
    const a = 2 * (first + k), b = a + 2, c = a + 3, d = a + 1;
    return fromRight[first + k] ? [a, c, d, a, b, c] : [a, b, d, b, c, d];
  }).flat();
}

/**
 * Move the panel that begins at a rung outwards.
 *
 * @param {Record<"position" | "normal", Float32Array>} made
 * @param {number} rung
 * @param {number} by
 */
function lift({ position, normal }, rung, by) {
  for (let k = 6 * rung; k < 6 * rung + 12; k++) position[k] += by * normal[k];
}

/**
 * Where a label may stand, and which way the strip looks there: on panels, then between them.
 *
 * @param {THREE.Vector3[]} middles
 * @param {number[]} panels
 * @param {Float32Array} normals
 * @param {number} first
 * @returns {Spot[]}
 */
function spotsOf(middles, panels, normals, first) {
  const places = panels.concat(panels.slice(1).map((next, k) => (panels[k] + next) >> 1));
  return places.map((at) => ({
    point: middles[at].clone().lerp(middles[Math.min(at + 1, middles.length - 1)], 0.5),
    normal: new THREE.Vector3().fromArray(normals, 6 * (first + at)),
  }));
}

/** What is packed in base 64. @param {string} text */
const bytes = (text) => Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));

/**
 * How the ends of all rungs move, millimetres; nowhere, where that is not known.
 *
 * @param {Motion} motion
 * @param {number} rungs
 */
export function motionOf(motion, rungs) {
  const steps = new Float32Array(rungs * 6);
  if (!motion) return steps;
  const raw = new DataView(bytes(motion.steps).buffer);
  return steps.map((_, k) => motion.step_mm * raw.getInt16(2 * k, true));
}

/** How far each rung goes when the object is let go, millimetres. @param {Float32Array} going */
export function goneMm(going) {
  const right = new THREE.Vector3(), left = new THREE.Vector3();
  return Float32Array.from({ length: going.length / 6 }, (_, k) =>
    right.fromArray(going, 6 * k).add(left.fromArray(going, 6 * k + 3)).length() / 2);
}

/** The ball around all corners, about the middle of their box. @param {Float32Array} corners */
function ballOf(corners) {
  const box = new THREE.Box3().setFromArray(corners), center = box.getCenter(new THREE.Vector3());
  const point = new THREE.Vector3();
  let far = 1e-9;
  for (let k = 0; k < corners.length; k += 3)
    far = Math.max(far, point.fromArray(corners, k).distanceToSquared(center));
  return { center, radius: Math.sqrt(far) };
}

/**
 * How far a strip is over (1) or under (-1), from panel to panel: two numbers for each rung.
 *
 * @param {import("./plan.js").Values} piece
 * @param {number[]} panels
 * @param {Float32Array} along
 * @param {number} first
 * @param {number} count
 */
function heights(piece, panels, along, first, count) {
  const height = new Float32Array(count);
  panels.forEach((at, k) => {
    const here = piece.stations[k].over ? 1 : -1;
    height[at] = height[at + 1] = here;
    const next = panels[k + 1];
    if (next === undefined) return;
    const there = piece.stations[k + 1].over ? 1 : -1, start = along[2 * (first + at + 1)];
    const rise = (there - here) / (along[2 * (first + next)] - start);
    for (let j = at + 2; j < next; j++) height[j] = here + rise * (along[2 * (first + j)] - start);
  });
  return Float32Array.from({ length: 2 * count }, (_, k) => height[k >> 1]);
}

/**
 * Triangles in the order in which pieces come: what is there at a step is the first so many.
 *
 * @param {Plan} plan
 * @param {number[][]} quads
 */
function inOrder(plan, quads) {
  const order = [...plan.pieces.keys()].sort((a, b) => plan.stepOf[a] - plan.stepOf[b]);
  const index = order.flatMap((piece) => quads[piece]);
  /** @type {[number, number][]} */
  const range = [];
  order.reduce((start, piece) => {
    range[piece] = [start, start + quads[piece].length];
    return range[piece][1];
  }, 0);
  return { index, range };
}
