// Strands in the light of a studio: a key light that casts shadows, a bright sky, and what they mirror.

import { STRAND_LIGHT } from "../../show/scripts/strands.js";

// Where a place of a strand is: let go as far as is shown, apart from the one that it crosses, and on
// its face or its back.
const PLACE = `
attribute vec4 shade;
attribute vec3 move;
attribute float run, layer;
uniform float lift, form, thick;
vec3 placed() { return position + form * move + (lift * shade.w + thick * layer) * shade.xyz; }`;

export const FABRIC_VERTEX = `${PLACE}
attribute vec3 colour;
attribute float owner, heat, side;
uniform float chosen;
uniform mat4 toLight;
varying vec3 vNormal, vColour, vPlace;
varying vec4 vLight;
varying float vDip, vChosen, vHeat, vSide, vRun, vLayer;
void main() {
  vec3 place = placed();
  vNormal = shade.xyz; vColour = colour; vDip = shade.w; vPlace = place; vLayer = layer;
  vHeat = heat; vSide = side; vRun = run;
  vChosen = abs(owner - chosen) < 0.5 ? 1.0 : 0.0;
  vLight = toLight * vec4(place, 1.0);
  gl_Position = projectionMatrix * viewMatrix * vec4(place, 1.0);
}`;

const UNPACK = `
uniform sampler2D depths;
uniform float shadowing, texel;
varying vec4 vLight;
float far(vec2 at) {
  return dot(texture2D(depths, at), vec4(1.0, 1.0 / 255.0, 1.0 / 65025.0, 1.0 / 16581375.0));
}
float lit(float bias) {
  if (shadowing < 0.5) return 1.0;
  vec3 at = vLight.xyz / vLight.w * 0.5 + 0.5;
  float near = at.z - bias, sum = 0.0;
  for (int i = -1; i < 2; i++) for (int j = -1; j < 2; j++)
    sum += step(near, far(at.xy + texel * vec2(float(i), float(j))));
  return sum / 9.0;
}`;

// The face side has a sheen; the back is dull and paler, as most sheets are.
export const FABRIC_FRAGMENT = `${UNPACK}${STRAND_LIGHT}
uniform vec3 eye, key;
uniform float plain, heating, shown, grain;
varying vec3 vNormal, vColour, vPlace;
varying float vDip, vChosen, vHeat, vSide, vRun, vLayer;
// Calm where all is at ease, yellow where a rule is just kept, red where it is far from kept.
vec3 heated() {
  vec3 calm = vec3(0.80, 0.81, 0.80), warm = vec3(0.97, 0.76, 0.16), hot = vec3(0.83, 0.10, 0.12);
  return vHeat < 0.38 ? mix(calm, warm, smoothstep(0.0, 0.38, vHeat)) : mix(warm, hot, smoothstep(0.38, 0.8, vHeat));
}
// Fibres of the material, as fine as they are seen from here.
float fibres(vec3 at) {
  vec3 cell = floor(at), f = smoothstep(0.0, 1.0, fract(at));
  float sum = 0.0;
  for (int k = 0; k < 8; k++) {
    vec3 corner = vec3(float(k & 1), float((k >> 1) & 1), float(k >> 2));
    float value = fract(sin(dot(cell + corner, vec3(12.99, 78.23, 37.72))) * 43758.55);
    vec3 near = mix(1.0 - f, f, corner);
    sum += value * near.x * near.y * near.z;
  }
  return sum;
}
// A room that is bright above, with two windows.
vec3 room(vec3 way) {
  vec3 sky = mix(vec3(0.34, 0.33, 0.31), vec3(0.97, 0.98, 1.0), smoothstep(-0.6, 0.9, way.z));
  float window = smoothstep(0.80, 0.93, dot(way, normalize(vec3(-0.5, -0.7, 0.6))))
    + 0.7 * smoothstep(0.84, 0.95, dot(way, normalize(vec3(0.8, 0.3, 0.45))));
  return sky + 1.6 * window;
}
void main() {
  if (vRun > shown) discard;
  float side = gl_FrontFacing == vLayer > 0.0 ? 1.0 : -1.0;
  vec3 paint = heating > 0.5 ? heated() : vColour;
  // A line along the rails, and beside it the light that they catch.
  float far = min(vSide, 1.0 - vSide), pixel = max(fwidth(vSide), 1e-4);
  float edge = 1.0 - smoothstep(0.6, 1.9, far / pixel), catching = smoothstep(0.05, 0.0, abs(far - 0.05));
  edge *= smoothstep(0.30, 0.12, pixel);
  if (plain > 0.5) {
    // While things move and software draws.
    vec3 quick = plainLight(paint, vNormal, vec3(0.0, 0.0, 1.0), key, side, vDip, 0.6) * (1.0 - 0.38 * edge);
    gl_FragColor = vec4(vChosen > 0.5 ? mix(quick, vec3(0.84, 0.37, 0.0), 0.62) : quick, 1.0);
    return;
  }
  vec3 n = normalize(vNormal) * side, v = normalize(eye - vPlace);
  vec3 own = pow(paint, vec3(2.2));
  own *= 1.0 + 0.16 * (fibres(vPlace * vec3(grain, grain, 0.35 * grain)) - 0.5);
  if (abs(vLayer) < 0.995) {
    // Where it is cut one sees its thickness, as dark as what a laser or a knife leaves.
    n = normalize(cross(dFdx(vPlace), dFdy(vPlace)));
    own *= 0.55;
    side = 1.0; edge = catching = 0.0;
  } else if (side < 0.0) own = behind(own);
  float direct = max(dot(n, key), 0.0), open = contact(side * vDip, 0.6);
  float shadow = direct > 0.0 ? lit(0.0035 + 0.004 * (1.0 - direct)) : 1.0;
  vec3 light = skyLight(n.z) * open + KEY_LIGHT * direct * mix(0.1, 1.0, shadow) * mix(0.6, 1.0, open);
  float rim = pow(1.0 - max(dot(n, v), 0.0), 5.0);
  float gloss = (side > 0.0 ? 0.035 + 0.30 * rim : 0.01 + 0.08 * rim) * open;
  vec3 seen = own * light + gloss * room(reflect(-v, n)) * mix(0.3, 1.0, shadow);
  seen = pow(seen, vec3(1.0 / 2.2)) * (1.0 - 0.42 * edge) + 0.035 * catching * (1.0 - edge);
  if (vChosen > 0.5) seen = mix(seen, vec3(0.84, 0.37, 0.0), 0.62);
  gl_FragColor = vec4(seen, 1.0);
}`;

export const DEPTH_VERTEX = `${PLACE}
uniform mat4 toLight;
varying float vFar, vRun;
void main() {
  gl_Position = toLight * vec4(placed(), 1.0);
  vFar = gl_Position.z / gl_Position.w * 0.5 + 0.5;
  vRun = run;
}`;

export const DEPTH_FRAGMENT = `
uniform float shown;
varying float vFar, vRun;
void main() {
  if (vRun > shown) discard;
  vec4 parts = fract(vFar * vec4(1.0, 255.0, 65025.0, 16581375.0));
  gl_FragColor = parts - parts.yzww * vec4(1.0 / 255.0, 1.0 / 255.0, 1.0 / 255.0, 0.0);
}`;

// Dots stand before what they are on, as near to the eye as a strand is wide.
export const DOT_VERTEX = `
uniform float reach, size;
attribute vec3 color;
varying vec3 vInk;
void main() {
  vec3 place = position + reach * normalize(cameraPosition - position);
  vInk = color;
  gl_Position = projectionMatrix * viewMatrix * vec4(place, 1.0);
  gl_PointSize = size;
}`;

export const DOT_FRAGMENT = `
varying vec3 vInk;
void main() {
  float far = 2.0 * length(gl_PointCoord - 0.5);
  if (far > 1.0) discard;
  gl_FragColor = vec4(mix(vInk, vec3(1.0), smoothstep(0.60, 0.72, far)), 1.0);
}`;

export const FLOOR_VERTEX = `
uniform mat4 toLight;
varying vec4 vLight;
varying vec3 vPlace;
void main() {
  vPlace = (modelMatrix * vec4(position, 1.0)).xyz;
  vLight = toLight * vec4(vPlace, 1.0);
  gl_Position = projectionMatrix * viewMatrix * vec4(vPlace, 1.0);
}`;

// The floor is the paper, darker where light does not reach, softly, as the light is a window; it fades
// to all sides.
export const FLOOR_FRAGMENT = `${UNPACK}
#define TAPS 14
uniform vec3 middle;
uniform float reach;
varying vec3 vPlace;
void main() {
  vec3 at = vLight.xyz / vLight.w * 0.5 + 0.5;
  float fade = 1.0 - smoothstep(0.55, 1.0, distance(vPlace, middle) / reach), sum = 0.0;
  if (fade <= 0.0 || shadowing < 0.5 || at != clamp(at, 0.0, 1.0)) discard;
  // Neighbours look at other places each, which together are a disc: a spiral by the golden angle.
  float turn = 6.2832 * fract(52.98 * fract(dot(gl_FragCoord.xy, vec2(0.0671, 0.00584))));
  vec2 aside = 0.011 * vec2(cos(turn), sin(turn));
  for (int k = 0; k < TAPS; k++) {
    sum += step(at.z - 0.002, far(at.xy + sqrt((float(k) + 0.5) / float(TAPS)) * aside));
    aside *= mat2(-0.73737, 0.67549, -0.67549, -0.73737);
  }
  gl_FragColor = vec4(0.05, 0.04, 0.03, 0.34 * fade * (1.0 - sum / float(TAPS)));
}`;
