import { wayOf } from "../../show/scripts/camera.js";
import { nearestHit } from "../../show/scripts/pick.js";
import * as THREE from "../../show/scripts/three.js";
import {
  DEPTH_FRAGMENT, DEPTH_VERTEX, FABRIC_FRAGMENT, FABRIC_VERTEX, FLOOR_FRAGMENT, FLOOR_VERTEX,
} from "./light.js";

/** Shadow maps are so many pixels wide, where the browser has a graphics card and where it has none. */
const SHADOW = 2048, SHADOW_SLOW = 1024;
/** Strands are drawn so much of their usual distance above and below one another, as a share of their width. */
const LIFT = 0.07;
/** So thick they are drawn at least, and at most, so that strands that cross do not touch. */
const THINNEST = 0.03, THICKEST = 0.13;
/** The key light comes over the left shoulder of who sees the object first: so far aside and above, radians. */
const ASIDE = 0.85, ABOVE = 0.85;
/** three.js calls it FrontSide: what looks away is not drawn. @type {0} */
const FRONT = 0;
/** How far the floor reaches, in radii of the object. */
const FLOOR = 2.4;

/** @typedef {{ center: THREE.Vector3, radius: number }} Ball */
/** @typedef {Record<string, any>} Arrays */

/**
 * Put an array into a geometry, in the room of the one before where it fits.
 *
 * @param {THREE.BufferGeometry} geometry
 * @param {string} name
 * @param {Float32Array | Int8Array | Uint8Array} array
 * @param {number} size
 */
export function fill(geometry, name, array, size, normalized = false) {
  const old = geometry.attributes[name];
  if (old && old.array.length === array.length && old.array.constructor === array.constructor) {
    old.array.set(array);
    old.needsUpdate = true;
  } else geometry.setAttribute(name, new THREE.BufferAttribute(array, size, normalized));
}

/** Three numbers for each rung, for both of its ends. @param {Float32Array} rungs */
function twice(rungs) {
  const both = new Float32Array(2 * rungs.length);
  for (let k = 0; k < rungs.length; k += 3) {
    both.set(rungs.subarray(k, k + 3), 2 * k);
    both.set(rungs.subarray(k, k + 3), 2 * k + 3);
  }
  return both;
}

/** What corners of faces have, for those of backs too. @template {Float32Array | Int8Array | Uint8Array} A @param {A} array */
function layered(array) {
  const all = /** @type {A} */ (new /** @type {any} */ (array).constructor(2 * array.length));
  all.set(array);
  all.set(array, array.length);
  return all;
}

/**
 * Triangles of faces, of backs, whose corners come after all of the faces, and of what is cut between
 * them: along the rails, which join ends of one kind, and across rungs that a strip begins or ends with.
 * All look outwards.
 *
 * @param {Uint32Array} index
 * @param {number} count
 */
function solid(index, count) {
  /** @type {number[]} */
  const walls = [], ends = new Int8Array(count >> 1), backs = index.map((_, k) => index[k + 2 - 2 * (k % 3)] + count);
  const raise = (/** @type {number} */ a, /** @type {number} */ b) =>
    walls.push(a + count, b + count, b, a + count, b, a);
  for (let k = 0; k < index.length; k++) {
    const a = index[k], b = index[k % 3 < 2 ? k + 1 : k - 2];
    if (((a ^ b) & 1) === 0) raise(a, b);
    // Between two triangles it goes to and fro.
    else if (a >> 1 === b >> 1) ends[a >> 1] += b - a;
  }
  ends.forEach((way, rung) => way && raise(2 * rung + Number(way < 0), 2 * rung + Number(way > 0)));
  const all = new Uint32Array(2 * index.length + walls.length);
  all.set(index);
  all.set(backs, index.length);
  all.set(walls, 2 * index.length);
  return all;
}

/**
 * When each corner is there while strands run in one after the other; all at once where none are known.
 *
 * @param {Uint32Array | undefined} thread Where each begins among the rungs.
 * @param {number} count
 */
function runs(thread, count) {
  const found = new Float32Array(count), all = (thread?.length ?? 1) - 1;
  if (!thread) return found;
  for (let k = 0; k < all; k++) {
    const from = thread[k], rungs = thread[k + 1] - from;
    // Each takes a third of the time.
    for (let r = 0; r < rungs; r++) found.fill((2 * k) / (3 * all) + r / (3 * rungs), 2 * (from + r), 2 * (from + r) + 2);
  }
  return found;
}

/** Strands, in light and shadow, and the floor that they stand on. */
export class Fabric {
  #geometry = new THREE.BufferGeometry();
  #lamp = new THREE.OrthographicCamera();
  #shade = new THREE.Scene();
  #target;
  #shadowed = false;
  #crossings = new Float32Array();
  // The triangles that were given, of the faces alone; and half of how thick they are drawn.
  #index = new Uint32Array();
  #half = 0;

  /** @param {boolean} slow Whether software draws. */
  constructor(slow) {
    this.#target = new THREE.WebGLRenderTarget(...(slow ? [SHADOW_SLOW, SHADOW_SLOW] : [SHADOW, SHADOW]));
    const shared = {
      toLight: { value: new THREE.Matrix4() }, depths: { value: this.#target.texture }, shadowing: { value: 1 },
      texel: { value: 1 / this.#target.width }, lift: { value: 0 }, form: { value: 0 }, shown: { value: 1 },
      thick: { value: 0 },
    };
    this.uniforms = {
      ...shared, chosen: { value: -2 }, eye: { value: new THREE.Vector3() }, key: { value: new THREE.Vector3(0, 0, 1) }, plain: { value: 0 },
      heating: { value: 0 }, grain: { value: 1 },
    };
    this.ground = { ...shared, middle: { value: new THREE.Vector3() }, reach: { value: 1 } };
    const side = THREE.DoubleSide;
    this.cloth = new THREE.ShaderMaterial({
      uniforms: this.uniforms, vertexShader: FABRIC_VERTEX, fragmentShader: FABRIC_FRAGMENT, side,
    });
    this.depth = new THREE.ShaderMaterial({
      uniforms: shared, vertexShader: DEPTH_VERTEX, fragmentShader: DEPTH_FRAGMENT, side,
    });
    this.floor = new THREE.Mesh(new THREE.CircleGeometry(1, 64), new THREE.ShaderMaterial({
      uniforms: this.ground, vertexShader: FLOOR_VERTEX, fragmentShader: FLOOR_FRAGMENT, transparent: true,
      depthWrite: false,
    }));
    this.mesh = new THREE.Mesh(this.#geometry, this.cloth);
    this.mesh.frustumCulled = false;
  }

  /** Whether there is anything to be seen. */
  get there() {
    return Boolean(this.#geometry.index) && this.mesh.visible;
  }

  /** The middles of crossings, three numbers each. */
  get crossings() {
    return this.#crossings;
  }

  /**
   * Show an object; triangles that are not sent are as they were.
   *
   * @param {Arrays} arrays
   * @param {number} widthMm
   * @param {number} thickMm
   * @param {Ball} ball
   * @param {number} low Where the floor is.
   */
  show({ position, shade, colour, index, owner, crossing, thread, moves }, widthMm, thickMm, ball, low) {
    const strips = Boolean(thread), one = position.length / 3, count = strips ? 2 * one : one;
    const geometry = this.#geometry, all = strips ? layered : (/** @type {any} */ array) => array;
    if (geometry.attributes.position?.count !== count)
      for (const name of Object.keys(geometry.attributes)) geometry.deleteAttribute(name);
    this.mesh.visible = true;
    this.#crossings = crossing ?? new Float32Array();
    const each = (/** @type {(corner: number) => number} */ value) => Float32Array.from({ length: count }, (_, k) => value(k));
    fill(geometry, "position", all(position), 3);
    fill(geometry, "shade", all(shade), 4, true);
    fill(geometry, "colour", all(colour), 3, true);
    fill(geometry, "layer", each((k) => (k < one ? 1 : -1)), 1);
    fill(geometry, "owner", each((k) => (owner ? owner[(k % one) >> 1] : -9)), 1);
    fill(geometry, "side", each((k) => (strips ? k & 1 : 0.5)), 1);
    fill(geometry, "move", moves ? all(twice(moves)) : new Float32Array(3 * count), 3);
    fill(geometry, "run", all(runs(thread, one)), 1);
    fill(geometry, "heat", new Float32Array(count), 1);
    this.uniforms.heating.value = 0;
    // Fibres are some tenth of a strip apart, or some hundredth of what is no strip.
    this.uniforms.grain.value = strips && widthMm > 0 ? 14 / widthMm : 120 / ball.radius;
    if (index && index !== this.#index) {
      this.#index = index;
      geometry.setIndex(new THREE.BufferAttribute(strips ? solid(index, one) : index, 1));
    }
    this.#half = strips ? Math.min(Math.max(thickMm, THINNEST * widthMm), THICKEST * widthMm) / 2 : 0;
    this.uniforms.lift.value = LIFT * widthMm;
    this.floor.position.copy(ball.center).setZ(low);
    this.floor.scale.setScalar(FLOOR * ball.radius);
    this.ground.middle.value.copy(this.floor.position);
    this.ground.reach.value = FLOOR * ball.radius;
    this.#shadowed = false;
  }

  /**
   * Colour each rung by its trouble, 0 to 255; as the material is without any.
   *
   * @param {Uint8Array | null} heat
   */
  warm(heat) {
    this.uniforms.heating.value = Number(Boolean(heat));
    const count = this.#geometry.attributes.position?.count ?? 0;
    if (heat && 4 * heat.length === count)
      fill(this.#geometry, "heat", layered(Float32Array.from({ length: count / 2 }, (_, k) => heat[k >> 1] / 255)), 1);
  }

  /** Let light come as suits a view, azimuth and elevation. @param {number[]} viewDeg */
  lightFor([azimuth]) {
    this.uniforms.key.value.copy(wayOf((azimuth * Math.PI) / 180 - ASIDE, ABOVE));
    this.#shadowed = false;
  }

  /** Let it go so far; shadows follow. @param {number} form */
  let(form) {
    this.uniforms.form.value = form;
    this.#shadowed = false;
  }

  /** Show strands as far as they have run in, 0 to 1. @param {number} shown */
  run(shown) {
    this.uniforms.shown.value = shown;
    this.#shadowed = false;
  }

  /**
   * Make it ready to be drawn: with shadows, or in plain light.
   *
   * @param {THREE.WebGLRenderer} renderer
   * @param {Ball} ball
   * @param {import("../../show/scripts/camera.js").Camera} camera
   * @param {boolean} shadows
   * @param {boolean} plain
   */
  light(renderer, ball, camera, shadows, plain) {
    this.uniforms.shadowing.value = Number(shadows);
    this.uniforms.plain.value = Number(plain);
    // Thickness is not seen in coarse pixels.
    this.uniforms.thick.value = plain ? 0 : this.#half;
    this.uniforms.eye.value.copy(camera.lens.position);
    this.floor.visible = shadows && camera.towards().z > -0.05;
    this.#geometry.setDrawRange(0, this.#index.length);
    if (shadows && !this.#shadowed) this.#castShadows(renderer, ball);
    if (!plain) this.#geometry.setDrawRange(0, Infinity);
    this.cloth.side = this.uniforms.thick.value ? FRONT : THREE.DoubleSide;
  }

  /**
   * Draw how far the key light reaches.
   *
   * @param {THREE.WebGLRenderer} renderer
   * @param {Ball} ball
   */
  #castShadows(renderer, { center, radius }) {
    const span = 1.05 * radius, lamp = this.#lamp, scene = this.mesh.parent;
    Object.assign(lamp, { left: -span, right: span, top: span, bottom: -span, near: 0.5 * span, far: 4.5 * span });
    lamp.position.copy(center).addScaledVector(this.uniforms.key.value, 2 * span);
    lamp.up.set(0, 0, 1);
    lamp.lookAt(center);
    lamp.updateProjectionMatrix();
    lamp.updateMatrixWorld();
    this.uniforms.toLight.value.multiplyMatrices(lamp.projectionMatrix, lamp.matrixWorldInverse);
    this.mesh.material = this.depth;
    this.#shade.add(this.mesh);
    renderer.setRenderTarget(this.#target);
    renderer.setClearColor(0xffffff, 1);
    renderer.clear();
    renderer.render(this.#shade, lamp);
    renderer.setRenderTarget(null);
    this.mesh.material = this.cloth;
    scene?.add(this.mesh);
    this.#shadowed = true;
  }

  /**
   * The point that a ray meets first, its piece, and the crossing that is nearest to it.
   *
   * @param {THREE.Ray} ray
   */
  touch(ray) {
    const { attributes } = this.#geometry, index = this.#index;
    const hit = index.length ? nearestHit(ray, attributes.position.array, index) : null;
    if (!hit) return null;
    const from = new THREE.Vector3();
    let crossing = -1, least = Infinity;
    for (let k = 0; k < this.#crossings.length; k += 3) {
      const far = hit.point.distanceToSquared(from.fromArray(this.#crossings, k));
      if (far < least) [least, crossing] = [far, k / 3];
    }
    const corner = index[3 * hit.triangle];
    return { point: hit.point, piece: attributes.owner.array[corner], crossing, rung: corner >> 1 };
  }
}
