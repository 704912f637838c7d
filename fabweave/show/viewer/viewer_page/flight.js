import * as THREE from "../../scripts/three.js";

/** How long a piece flies to its place, in milliseconds. */
const FLIGHT_MS = 900;

/** @typedef {import("./strips.js").Strips} Strips */
/** @typedef {import("./plan.js").Plan} Plan */
/** @typedef {import("./plan.js").Values} Values */

/**
 * How a piece comes to its place at a step: the end that slides under leads, or it is laid on.
 *
 * @param {Plan} plan
 * @param {Values} step
 * @param {number} piece
 */
export function wayIn(plan, step, piece) {
  const { stations } = plan.pieces[piece], under = new Set(step.under), below = [0, 0];
  for (const [k, station] of stations.entries())
    if (!station.over && under.has(station.crossing)) below[k < stations.length / 2 ? 0 : 1]++;
  if (below[0] + below[1] === 0) return 0;
  return below[0] > below[1] ? 1 : -1;
}

/**
 * Move a strip along its own course, which goes straight on beyond its ends, and off its place.
 *
 * Where it slides under others it so passes below them as it will lie.
 *
 * @param {Strips} strips
 * @param {number} piece
 * @param {number} along
 * @param {number[]} off
 */
export function shiftStrip({ made, placed, firsts, counts }, piece, along, off) {
  const first = firsts[piece], count = counts[piece], runs = made.along, corners = made.position;
  const length = runs[2 * (first + count - 1)];
  let at = 0;
  for (let k = 0; k < count; k++) {
    const run = runs[2 * (first + k)] + along, inside = Math.max(0, Math.min(length, run));
    while (at < count - 2 && runs[2 * (first + at + 1)] < inside) at++;
    while (at > 0 && runs[2 * (first + at)] > inside) at--;
    const from = 6 * (first + at), gap = runs[2 * (first + at + 1)] - runs[2 * (first + at)];
    const share = gap > 0 ? (inside - runs[2 * (first + at)]) / gap : 0;
    const beyond = gap > 0 ? (run - inside) / gap : 0;
    for (let axis = 0; axis < 3; axis++) {
      // Beyond an end both rails go on in the direction of the middle.
      const here = from + axis, next = here + 6;
      const way = (placed[next] + placed[next + 3] - placed[here] - placed[here + 3]) / 2;
      for (const side of [axis, axis + 3]) {
        const low = placed[from + side], high = placed[from + 6 + side];
        corners[6 * (first + k) + side] = low + (high - low) * share + beyond * way + off[axis];
      }
    }
  }
}

/** Put a strip where it belongs. @param {Strips} strips @param {number} piece */
export function landStrip({ made, placed, firsts, counts }, piece) {
  const from = 6 * firsts[piece], to = from + 6 * counts[piece];
  made.position.set(placed.subarray(from, to), from);
}

/**
 * Let the pieces of a step fly in; return what ends it at once.
 *
 * @param {Strips} strips
 * @param {Plan} plan
 * @param {Values} step
 * @param {number[]} pieces
 * @param {(moving: boolean) => void} draw Shows what has moved.
 */
export function flyIn(strips, plan, step, pieces, draw) {
  const { spots, made, firsts, counts, ball } = strips, begun = performance.now();
  const ways = pieces.map((piece) => {
    const length = made.along[2 * (firsts[piece] + counts[piece] - 1)], sign = wayIn(plan, step, piece);
    const normal = spots[piece].reduce((sum, spot) => sum.add(spot.normal), new THREE.Vector3()).normalize();
    const off = normal.multiplyScalar(sign ? 0 : 0.35 * ball.radius);
    return { piece, along: sign * Math.min(length, ball.radius), off };
  });
  let waiting = 0;
  function end() {
    if (!waiting) return;
    cancelAnimationFrame(waiting);
    waiting = 0;
    for (const piece of pieces) landStrip(strips, piece);
    draw(false);
  }
  function frame() {
    const done = Math.min(1, (performance.now() - begun) / FLIGHT_MS), left = (1 - done) ** 2;
    for (const { piece, along, off } of ways)
      shiftStrip(strips, piece, along * left, off.clone().multiplyScalar(left).toArray());
    waiting = requestAnimationFrame(done < 1 ? frame : end);
    draw(true);
  }
  frame();
  return end;
}
