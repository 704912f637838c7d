import { STRAND_LIGHT } from "../../scripts/strands.js";

/** How a strip is shown: as a number from 0 to 5. */
export const HIDDEN = 0;
export const PLAIN = 1;
export const FADED = 2;
export const FRESH = 3;
export const CHOSEN = 4;
export const LATER = 5;
/** What is in place is as strong as this until somebody chooses otherwise. */
export const THERE = 0.5;

export const STRIP_VERTEX = `
attribute float piece, across, along, dip;
attribute vec3 tint, away, going, sway;
uniform sampler2D states;
uniform vec2 size;
uniform float spread, gone, swing;
varying vec4 vState;
varying vec3 vNormal, vTint, vPlace;
varying float vAcross, vAlong, vDip, vPiece;
void main() {
  vState = texture2D(states, (vec2(mod(piece, size.x), floor(piece / size.x)) + 0.5) / size);
  vNormal = normalMatrix * normal;
  vTint = tint;
  vAcross = across; vAlong = along; vDip = dip; vPiece = piece;
  vPlace = position + spread * away + gone * going + swing * sway;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(vPlace, 1.0);
  if (vState.a < 0.1) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}`;

// What is on the near side of the cut is away, but for pieces that are brought out.
const CUT = `
uniform vec4 cut;
varying vec4 vState;
varying vec3 vPlace;
void cutAway() {
  if ((vState.a < 0.5 || vState.a > 0.9) && dot(vPlace, cut.xyz) > cut.w) discard;
}`;

// Where a strip lies over another, a gap as pale as the paper runs along both of its rails, a share
// of its half width. From behind it is the other way round.
export const STRIP_FRAGMENT = `${CUT}${STRAND_LIGHT}
#define HALO 0.12
uniform vec3 paper;
uniform float pitch, there, later;
varying vec3 vNormal, vTint;
varying float vAcross, vAlong, vDip;
// Of sixteen pixels side by side each has another number, from 0 to 15 sixteenths.
float sieve(vec2 at) {
  vec2 fine = mod(floor(at), 2.0), coarse = mod(floor(at / 2.0), 2.0);
  return mod(2.0 * fine.x + 3.0 * fine.y, 4.0) / 4.0 + mod(2.0 * coarse.x + 3.0 * coarse.y, 4.0) / 16.0;
}
void main() {
  cutAway();
  float code = floor(vState.a * 5.1 + 0.5);
  // What is to come is a veil: the more pixels, the denser.
  if (code == 5.0 && sieve(gl_FragCoord.xy) >= later) discard;
  bool brought = code == 3.0 || code == 4.0;
  float side = gl_FrontFacing ? 1.0 : -1.0;
  vec3 colour = plainLight(vTint, vNormal, viewMatrix[2].xyz, normalize(vec3(-0.35, 0.5, 0.8)), side, vDip, brought ? 0.3 : 0.6);
  float middle = abs(vAcross - 0.5) * 2.0, edge = 1.0 - HALO * smoothstep(0.0, 0.8, side * vDip);
  // Towards a grey between the paper and the middle: a pale strip would be lost in the paper itself.
  if (code == 2.0) colour = mix(mix(paper, vec3(0.5), 0.3), colour, there);
  if (code == 4.0) {
    // Chevrons point along the thread.
    float wave = fract(vAlong / pitch + middle * 0.3);
    colour = mix(colour, vec3(1.0), 0.85 * (1.0 - smoothstep(0.30, 0.34, wave)) * smoothstep(0.0, 0.04, wave));
  }
  float rim = brought ? 0.16 : 0.08, soft = max(fwidth(middle), 1e-4);
  float line = smoothstep(edge - rim - 0.5 * soft, edge - rim + 0.5 * soft, middle) * clamp(rim / soft, 0.0, 1.0);
  colour = mix(colour, brought ? vec3(0.04) : colour * 0.45, line);
  if (edge < 1.0) colour = mix(colour, paper, smoothstep(edge - 0.5 * soft, edge + 0.5 * soft, middle));
  gl_FragColor = vec4(colour, 1.0);
}`;

export const NUMBER_FRAGMENT = `${CUT}
varying float vPiece;
void main() {
  cutAway();
  if (vState.a > 0.9) discard;
  float n = floor(vPiece + 0.5) + 1.0;
  gl_FragColor = vec4(mod(n, 256.0), mod(floor(n / 256.0), 256.0), floor(n / 65536.0), 255.0) / 255.0;
}`;
