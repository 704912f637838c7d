/**
 * What lights strands without shadows: from above, darker where one dives under another, as in the
 * shade of the one above; from behind greyer, and dark where from the front it is light.
 */
export const PLAIN_LIGHT = `
vec3 plainLight(vec3 own, vec3 normal, vec3 key, float side, float dip, float depth) {
  float lit = max(dot(normalize(normal) * side, key), 0.0), below = max(0.0, -side * dip);
  vec3 colour = own * (0.58 + 0.45 * lit) * (1.0 - depth * below * below);
  return side > 0.0 ? colour : mix(colour, vec3(dot(colour, vec3(0.3, 0.6, 0.1))), 0.35) * 0.8;
}`;

/**
 * How wide strands are, in the median of some of their rungs.
 *
 * @param {Float32Array} corners Two for each rung.
 */
export function usualWidth(corners) {
  const widths = Array.from({ length: 64 }, (_, k) => {
    const [ax, ay, az, bx, by, bz] = corners.subarray(6 * Math.floor(((k + 0.5) / 64) * (corners.length / 6)));
    return Math.hypot(ax - bx, ay - by, az - bz);
  }).sort((a, b) => a - b);
  return widths[32] || 0;
}
