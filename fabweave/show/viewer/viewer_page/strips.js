/** Build every piece's strip: corners, normals, and what the shaders want to know. */
function readStrips(space, plan) {
  const packed = bytes(space.rungs), fromRight = bytes(space.from_right);
  const raw = new DataView(packed.buffer);
  const rungs = fromRight.length, corners = new Float32Array(rungs * 6);
  for (let k = 0; k < corners.length; k++) corners[k] = space.origin_mm[k % 3] + space.step_mm * raw.getUint16(2 * k, true);
  const made = {
    position: corners, normal: new Float32Array(rungs * 6), piece: new Float32Array(rungs * 2),
    across: new Float32Array(rungs * 2), along: new Float32Array(rungs * 2), dip: new Float32Array(rungs * 2),
    tint: new Float32Array(rungs * 6), away: new Float32Array(rungs * 6),
    going: motionOf(space.let_go, rungs), sway: motionOf(space.sway, rungs),
  };
  const ball = ballOf(corners), quads = [], spots = [], firsts = [], centres = [];
  const right = new THREE.Vector3(), left = new THREE.Vector3(), way = new THREE.Vector3();
  const middle = (rung) => {
    right.fromArray(corners, 6 * rung);
    return left.fromArray(corners, 6 * rung + 3).add(right).multiplyScalar(0.5).clone();
  };
  let first = 0;
  space.counts.forEach((count, number) => {
    const piece = plan.pieces[number], panels = space.panels[number], last = first + count - 1;
    const middles = Array.from({ length: count }, (_, k) => middle(first + k)), triangles = [];
    firsts.push(first);
    quads.push(triangles);
    let run = 0;
    for (let k = 0; k < count; k++) {
      const rung = first + k;
      if (k) run += middles[k].distanceTo(middles[k - 1]);
      way.subVectors(middles[Math.min(k + 1, count - 1)], middles[Math.max(k - 1, 0)]);
      right.fromArray(corners, 6 * rung);
      const normal = left.fromArray(corners, 6 * rung + 3).sub(right).cross(way).negate().normalize();
      for (const end of [0, 1]) {
        normal.toArray(made.normal, 6 * rung + 3 * end);
        made.piece[2 * rung + end] = number;
        made.across[2 * rung + end] = end;
        made.along[2 * rung + end] = run;
      }
      if (rung === last) break;
      const [a, b, c, d] = [2 * rung, 2 * rung + 2, 2 * rung + 3, 2 * rung + 1];
      triangles.push(...(fromRight[rung] ? [a, c, d, a, b, c] : [a, b, d, b, c, d]));
    }
    made.dip.set(heights(piece, panels, made.along, first, count), 2 * first);
    // The two layers of a lap lie on one another, not in one another.
    const lift = (at, by) => {
      for (const rung of [first + at, first + at + 1])
        for (let k = 6 * rung; k < 6 * rung + 6; k++) corners[k] += by * made.normal[k];
    };
    // Of several materials each thread has its own thickness.
    const layer = Array.isArray(space.layer_mm) ? space.layer_mm[piece.thread] : space.layer_mm;
    if (piece.joints[0] !== null) lift(panels[0], layer / 2);
    if (piece.joints[1] !== null) lift(panels[panels.length - 1], -layer / 2);
    // Pieces are moved apart by the way from the middle of all to their own.
    const centre = middles.reduce((sum, point) => sum.add(point), new THREE.Vector3()).divideScalar(count).sub(ball.center);
    centres.push(centre);
    for (let corner = 2 * first; corner <= 2 * last + 1; corner++) centre.toArray(made.away, 3 * corner);
    // Where a label may stand, and which way the strip looks there: on panels, then between them.
    const places = panels.concat(panels.slice(1).map((next, k) => (panels[k] + next) >> 1));
    spots.push(places.map((at) => ({
      point: middles[at].clone().lerp(middles[Math.min(at + 1, count - 1)], 0.5),
      normal: new THREE.Vector3().fromArray(made.normal, 6 * (first + at)),
    })));
    first += count;
  });
  return { made, ball, spots, firsts, centres, counts: space.counts, placed: corners.slice(), ...inOrder(plan, quads) };
}

/** What is packed in base 64. */
const bytes = (text) => Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));

/** How the ends of all rungs move, millimetres; nowhere, where that is not known. */
function motionOf(motion, rungs) {
  const steps = new Float32Array(rungs * 6);
  if (!motion) return steps;
  const raw = new DataView(bytes(motion.steps).buffer);
  return steps.map((_, k) => motion.step_mm * raw.getInt16(2 * k, true));
}

/** How far each rung goes when the object is let go, millimetres. */
function goneMm(going) {
  const right = new THREE.Vector3(), left = new THREE.Vector3();
  return Float32Array.from({ length: going.length / 6 }, (_, k) =>
    right.fromArray(going, 6 * k).add(left.fromArray(going, 6 * k + 3)).length() / 2);
}

/** The ball around all corners, about the middle of their box. */
function ballOf(corners) {
  const box = new THREE.Box3().setFromArray(corners), center = box.getCenter(new THREE.Vector3());
  const point = new THREE.Vector3();
  let far = 1e-9;
  for (let k = 0; k < corners.length; k += 3) far = Math.max(far, point.fromArray(corners, k).distanceToSquared(center));
  return { center, radius: Math.sqrt(far) };
}

/** How far a strip is over (1) or under (-1), from panel to panel: two numbers for each rung. */
function heights(piece, panels, along, first, count) {
  const height = new Float32Array(count);
  panels.forEach((at, k) => {
    const here = piece.stations[k].over ? 1 : -1;
    height[at] = height[at + 1] = here;
    const next = panels[k + 1];
    if (next === undefined) return;
    const there = piece.stations[k + 1].over ? 1 : -1, start = along[2 * (first + at + 1)];
    const length = along[2 * (first + next)] - start;
    for (let j = at + 2; j < next; j++) height[j] = here + ((there - here) * (along[2 * (first + j)] - start)) / length;
  });
  return Float32Array.from({ length: 2 * count }, (_, k) => height[k >> 1]);
}

/** Triangles in the order in which pieces come: what is there at a step is the first so many. */
function inOrder(plan, quads) {
  const order = plan.pieces.map((_, piece) => piece).sort((a, b) => plan.stepOf[a] - plan.stepOf[b]);
  const index = order.flatMap((piece) => quads[piece]), range = [];
  order.reduce((start, piece) => {
    range[piece] = [start, start + quads[piece].length];
    return range[piece][1];
  }, 0);
  return { index, range };
}

/** Give every strip its colours along it, each with the number of rungs that have it. */
function tintStrips({ made, firsts }, runs) {
  runs.forEach((own, piece) => {
    let at = 6 * firsts[piece];
    for (const [colour, count] of own) {
      const rgb = rgbOf(colour).map((part) => part / 255);
      for (const end = at + 6 * count; at < end; at += 3) made.tint.set(rgb, at);
    }
  });
}

/** How wide strips are, in the median of some. */
function usualWidth(corners) {
  const widths = Array.from({ length: 64 }, (_, k) => {
    const at = 6 * Math.floor(((k + 0.5) / 64) * (corners.length / 6));
    return new THREE.Vector3().fromArray(corners, at).distanceTo(new THREE.Vector3().fromArray(corners, at + 3));
  }).sort((a, b) => a - b);
  return widths[32];
}
