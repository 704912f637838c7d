import * as THREE from "./three.js";

/**
 * The ray from the eye through a place of the canvas.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {THREE.Camera} lens
 * @param {number} x
 * @param {number} y
 */
export function casterAt(canvas, lens, x, y) {
  const caster = new THREE.Raycaster();
  caster.setFromCamera(new THREE.Vector2((2 * x) / canvas.clientWidth - 1, 1 - (2 * y) / canvas.clientHeight), lens);
  return caster;
}

/**
 * Where on the canvas a point is seen.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {THREE.Camera} lens
 * @param {THREE.Vector3} point
 */
export function placeOf(canvas, lens, point) {
  const { x, y } = point.clone().project(lens);
  return { x: ((x + 1) / 2) * canvas.clientWidth, y: ((1 - y) / 2) * canvas.clientHeight };
}

/** @typedef {(at: number, point: THREE.Vector3) => void} Place Moves a corner to where it is seen. */

/**
 * The nearest triangle that a ray meets, and where.
 *
 * @param {THREE.Ray} ray
 * @param {ArrayLike<number>} points
 * @param {ArrayLike<number> | null} index
 * @param {Place | null} [place]
 * @param {(first: number, point: THREE.Vector3) => boolean} [there] Whether something is seen at a
 *   point of the triangle that a corner begins.
 */
export function nearestHit(ray, points, index, place, there) {
  const count = (index ? index.length : points.length / 3) / 3, hit = new THREE.Vector3();
  const [a, b, c] = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()], corners = [a, b, c];
  /** @type {{ point: THREE.Vector3, triangle: number } | null} */
  let best = null, least = Infinity;
  for (let k = 0; k < count; k++) {
    for (let corner = 0; corner < 3; corner++) {
      const at = index ? index[3 * k + corner] : 3 * k + corner;
      corners[corner].fromArray(points, 3 * at);
      if (place) place(at, corners[corner]);
    }
    if (!ray.intersectTriangle(a, b, c, false, hit)) continue;
    const far = hit.distanceToSquared(ray.origin);
    if (far >= least || (there && !there(index ? index[3 * k] : 3 * k, hit))) continue;
    [least, best] = [far, { point: hit.clone(), triangle: k }];
  }
  return best;
}
