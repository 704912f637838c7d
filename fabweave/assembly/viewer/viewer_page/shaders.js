/** How a strip is shown. */
const HIDDEN = 0, PLAIN = 1, FADED = 2, FRESH = 3, CHOSEN = 4;

const STRIP_VERTEX = `
attribute float piece, across, along, dip;
attribute vec3 tint, away;
uniform sampler2D states;
uniform vec2 size;
uniform float spread;
varying vec4 vState;
varying vec3 vNormal, vTint, vPlace;
varying float vAcross, vAlong, vDip, vPiece;
void main() {
  vState = texture2D(states, (vec2(mod(piece, size.x), floor(piece / size.x)) + 0.5) / size);
  vNormal = normalMatrix * normal;
  vTint = tint;
  vAcross = across; vAlong = along; vDip = dip; vPiece = piece;
  vPlace = position + spread * away;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(vPlace, 1.0);
  if (vState.a < 0.1) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}`;

// What is on the near side of the cut is away, but for pieces that are brought out.
const CUT = `
uniform vec4 cut;
varying vec4 vState;
varying vec3 vPlace;
void cutAway() {
  if (vState.a < 0.5 && dot(vPlace, cut.xyz) > cut.w) discard;
}`;

// Where a strip dives under another it is darker, as in the shade of the one above; from behind,
// the other way round.
const STRIP_FRAGMENT = `${CUT}
uniform vec3 paper;
uniform float pitch;
varying vec3 vNormal, vTint;
varying float vAcross, vAlong, vDip;
void main() {
  cutAway();
  float code = floor(vState.a * 5.1 + 0.5);
  float side = gl_FrontFacing ? 1.0 : -1.0;
  float lit = max(dot(normalize(vNormal) * side, normalize(vec3(-0.35, 0.5, 0.8))), 0.0);
  float below = max(0.0, -side * vDip);
  vec3 colour = vTint * (0.58 + 0.45 * lit) * (1.0 - (code > 2.5 ? 0.2 : 0.5) * below * below);
  if (side < 0.0) colour = mix(colour, vec3(dot(colour, vec3(0.3, 0.6, 0.1))), 0.35) * 0.8;
  float middle = abs(vAcross - 0.5) * 2.0;
  if (code == 2.0) colour = mix(paper, colour, 0.32);
  if (code == 4.0) {
    // Chevrons point along the thread.
    float wave = fract(vAlong / pitch + middle * 0.3);
    colour = mix(colour, vec3(1.0), 0.85 * (1.0 - smoothstep(0.30, 0.34, wave)) * smoothstep(0.0, 0.04, wave));
  }
  float rim = code > 2.5 ? 0.16 : 0.08, soft = max(fwidth(middle), 1e-4);
  float line = smoothstep(1.0 - rim - 0.5 * soft, 1.0 - rim + 0.5 * soft, middle) * clamp(rim / soft, 0.0, 1.0);
  colour = mix(colour, code > 2.5 ? vec3(0.04) : colour * 0.45, line);
  gl_FragColor = vec4(colour, 1.0);
}`;

const NUMBER_FRAGMENT = `${CUT}
varying float vPiece;
void main() {
  cutAway();
  float n = floor(vPiece + 0.5) + 1.0;
  gl_FragColor = vec4(mod(n, 256.0), mod(floor(n / 256.0), 256.0), floor(n / 65536.0), 255.0) / 255.0;
}`;
