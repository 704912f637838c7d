import { nearestHit } from "../../show/scripts/pick.js";
import * as THREE from "../../show/scripts/three.js";
import { fill } from "./fabric.js";
import { DOT_FRAGMENT, DOT_VERTEX } from "./light.js";

/** Faces that are left out, and the others; crossings that are fastened by hand, by the rule, and the others. */
const LEFT_OUT = [0.8, 0.1, 0.1], FACE = [0.3, 0.5, 0.8];
const BY_HAND = [0.85, 0.2, 0.05], BY_RULE = [0.05, 0.05, 0.05], CROSSING = [0.55, 0.68, 0.8];
/** Dots are so many pixels wide, and the one that keys are at. */
const DOT_PX = 11, HERE = [0, 0.45, 0.95];

/** The faces of the mesh, to be left out. */
export class Faces extends THREE.Mesh {
  #numbers = new Int32Array();

  constructor() {
    super(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({
      vertexColors: true, transparent: true, opacity: 0.35, side: THREE.DoubleSide, depthWrite: false,
    }));
    this.frustumCulled = this.visible = false;
  }

  /**
   * Show faces, those that are left out in red; none without them.
   *
   * @param {Record<string, any> | null} arrays
   * @param {Set<number>} left
   * @param {number} here The one that keys are at.
   */
  show(arrays, left, here) {
    this.visible = Boolean(arrays && arrays.face);
    if (!arrays || !this.visible) return;
    this.#numbers = arrays.face;
    const tint = new Float32Array(arrays.face_position.length);
    for (let k = 0; k < tint.length; k += 3) {
      const face = arrays.face[Math.floor(k / 9)];
      tint.set(face === here ? HERE : left.has(face) ? LEFT_OUT : FACE, k);
    }
    fill(this.geometry, "position", arrays.face_position, 3);
    fill(this.geometry, "color", tint, 3);
  }

  /** @param {THREE.Ray} ray */
  touch(ray) {
    const hit = nearestHit(ray, this.geometry.attributes.position.array, null);
    return hit && { point: hit.point, face: this.#numbers[hit.triangle] };
  }
}

/** The crossings, to be fastened. */
export class Dots extends THREE.Points {
  constructor() {
    super(new THREE.BufferGeometry(), new THREE.ShaderMaterial({
      uniforms: { reach: { value: 0 }, size: { value: DOT_PX } }, vertexShader: DOT_VERTEX, fragmentShader: DOT_FRAGMENT,
    }));
    this.frustumCulled = this.visible = false;
  }

  /**
   * Show crossings by their numbers.
   *
   * @param {Float32Array} places
   * @param {number[]} byRule
   * @param {number[]} byHand
   * @param {number} here The one that keys are at.
   */
  show(places, byRule, byHand, here) {
    const rule = new Set(byRule), hand = new Set(byHand), tint = new Float32Array(places.length);
    for (let k = 0; k < places.length / 3; k++)
      tint.set(k === here ? HERE : hand.has(k) ? BY_HAND : rule.has(k) ? BY_RULE : CROSSING, 3 * k);
    fill(this.geometry, "position", places, 3);
    fill(this.geometry, "color", tint, 3);
  }

  /**
   * How far before their strands they stand, and how many pixels of the canvas are one of the screen.
   *
   * @param {number} reach
   * @param {number} ratio
   */
  fit(reach, ratio) {
    const { uniforms } = /** @type {THREE.ShaderMaterial} */ (this.material);
    uniforms.reach.value = reach;
    uniforms.size.value = DOT_PX * ratio;
  }
}
