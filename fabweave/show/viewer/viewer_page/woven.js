import { nearestHit } from "../../scripts/pick.js";
import { usualWidth } from "../../scripts/strands.js";
import * as THREE from "../../scripts/three.js";
import { tintStrips } from "./colours.js";
import { FRESH, HIDDEN, LATER, NUMBER_FRAGMENT, STRIP_FRAGMENT, STRIP_VERTEX, THERE } from "./shaders.js";
import { readStrips } from "./strips.js";

/**
 * @typedef {[number, number]} Range Triangles that follow one another: from a corner to a corner.
 */

/** The cut that nothing lies beyond. */
export const UNCUT = 1e9;
/** A row of the table of states has so many. */
const ROW = 256;

/**
 * The range that reaches over two of them; an empty one is [0, 0].
 *
 * @param {Range} range
 * @param {Range} other
 * @returns {Range}
 */
export function joined(range, other) {
  return range[1] ? [Math.min(range[0], other[0]), Math.max(range[1], other[1])] : other;
}

/** All strips as one mesh, each of which can be shown in its own way. */
export class Woven {
  /** How each piece is shown. @type {number[]} */
  codes;
  #rows;
  #states;
  #shown;
  #numbers;

  /** @param {import("./plan.js").Plan} plan */
  constructor(plan) {
    this.strips = readStrips(plan);
    const { made, index } = this.strips, count = plan.pieces.length, high = Math.ceil(count / ROW);
    this.codes = plan.pieces.map(() => HIDDEN);
    this.geometry = new THREE.BufferGeometry();
    for (const [name, values] of Object.entries(made))
      this.geometry.setAttribute(name, new THREE.BufferAttribute(values, values.length / made.piece.length));
    this.geometry.setIndex(index);
    this.#rows = new Uint8Array(4 * ROW * high);
    this.#states = new THREE.DataTexture(this.#rows, ROW, high, THREE.RGBAFormat, THREE.UnsignedByteType);
    this.uniforms = {
      states: { value: this.#states }, size: { value: new THREE.Vector2(ROW, high) },
      paper: { value: new THREE.Color(0xffffff) }, there: { value: THERE }, later: { value: 0 },
      spread: { value: 0 }, gone: { value: 0 }, swing: { value: 0 }, cut: { value: new THREE.Vector4(0, 0, 1, UNCUT) },
      // Chevrons are about as long as a strip is wide.
      pitch: { value: 0.8 * usualWidth(made.position) },
    };
    const shader = (/** @type {string} */ fragmentShader) => new THREE.ShaderMaterial({
      uniforms: this.uniforms, vertexShader: STRIP_VERTEX, fragmentShader, side: THREE.DoubleSide,
    });
    [this.#shown, this.#numbers] = [shader(STRIP_FRAGMENT), shader(NUMBER_FRAGMENT)];
    this.mesh = new THREE.Mesh(this.geometry, this.#shown);
    this.mesh.frustumCulled = false;
  }

  /**
   * Show pieces, one code for each; return those that look another way now.
   *
   * @param {number[]} codes
   */
  show(codes) {
    codes.forEach((code, piece) => (this.#rows[4 * piece + 3] = 50 * code));
    this.#states.needsUpdate = true;
    const before = this.codes;
    this.codes = codes;
    return [...codes.keys()].filter((piece) => codes[piece] !== before[piece]);
  }

  /** Draw the numbers of pieces instead of their colours, or these again. @param {boolean} on */
  number(on) {
    this.mesh.material = on ? this.#numbers : this.#shown;
  }

  /** Let only a range of triangles be drawn. @param {Range} range */
  reach([start, end]) {
    this.geometry.setDrawRange(start, end - start);
  }

  /**
   * The range of triangles of some pieces, and of those that come between them.
   *
   * @param {number[]} pieces
   */
  rangeOf(pieces) {
    return pieces.reduce((all, piece) => joined(all, this.strips.range[piece]), /** @type {Range} */ ([0, 0]));
  }

  /** The range of triangles of all that is shown. @returns {Range} */
  seen() {
    return [0, this.rangeOf(this.codes.flatMap((code, piece) => (code === HIDDEN ? [] : [piece])))[1]];
  }

  /** Colour pieces. @param {import("./colours.js").Colouring["runs"]} runs */
  colour(runs) {
    tintStrips(this.strips, runs);
    this.geometry.attributes.tint.needsUpdate = true;
  }

  /**
   * Where a point of a piece is when pieces are moved apart.
   *
   * @param {number} piece
   * @param {THREE.Vector3} point
   */
  moved(piece, point) {
    return point.clone().addScaledVector(this.strips.centres[piece], this.uniforms.spread.value);
  }

  /** The piece that a ray meets first, and where. @param {THREE.Ray} ray */
  touch(ray) {
    const { made, index } = this.strips, { spread, gone, swing, cut } = this.uniforms;
    const shifts = [
      { away: made.away, share: spread.value }, { away: made.going, share: gone.value },
      { away: made.sway, share: swing.value },
    ].filter(({ share }) => share);
    const shift = new THREE.Vector3(), { x, y, z, w } = cut.value, normal = new THREE.Vector3(x, y, z);
    /** @type {import("../../scripts/pick.js").Place} */
    const place = (at, point) => {
      for (const { away, share } of shifts) point.addScaledVector(shift.fromArray(away, 3 * at), share);
    };
    /** @type {(at: number, point: THREE.Vector3) => boolean} */
    const there = (at, point) => {
      const code = this.codes[made.piece[at]];
      return code !== HIDDEN && code !== LATER && (code >= FRESH || point.dot(normal) <= w);
    };
    const shown = index.slice(...this.seen());
    const hit = nearestHit(ray, made.position, shown, shifts.length ? place : null, there);
    return hit && { point: hit.point, piece: made.piece[index[3 * hit.triangle]] };
  }
}
