/**
 * What lights strands: the sky from above and what the ground throws back from below, a key light, and
 * the shade of the strand above where one dives under another, darkest where they touch; from behind
 * greyer, and dark where from the front it is light. Light is linear, but in plain light, where
 * colours are taken as they are and its root is theirs.
 */
export const STRAND_LIGHT = `
#define KEY_LIGHT vec3(0.55, 0.52, 0.48)
vec3 skyLight(float rise) {
  return mix(vec3(0.31, 0.28, 0.25), vec3(0.56, 0.58, 0.62), smoothstep(-1.0, 1.0, rise));
}
float contact(float over, float depth) {
  float near = max(0.5 - 0.5 * over, 0.0);
  return 1.0 - depth * near * near * near;
}
vec3 behind(vec3 own) { return mix(own, vec3(dot(own, vec3(0.3, 0.6, 0.1))), 0.2) * 0.85; }
vec3 plainLight(vec3 own, vec3 normal, vec3 up, vec3 key, float side, float dip, float depth) {
  vec3 n = normalize(normal) * side, light = skyLight(dot(n, up)) + KEY_LIGHT * max(dot(n, key), 0.0);
  return (side > 0.0 ? own : behind(own)) * sqrt(light * contact(side * dip, depth));
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
