import * as THREE from "./three.js";
import { casterAt, placeOf } from "./pick.js";

/** From where the object is seen, going round it: front, front right, and so on. */
const SIDES = ["front", "front right", "right", "back right", "back", "back left", "left", "front left"];
/** A press of a key or a button turns by so much, and comes nearer by so much. */
const TURN = Math.PI / 12, NEARER = 1.25;
/** All that is drawn, the table too, is so near to the middle, in radii of the object. */
const TABLE_REACH = 1.6;
/** How long the camera takes from one view to another. */
const FLIGHT_MS = 350;
const DEGREE = Math.PI / 180;

/** The direction of an azimuth and an elevation. @param {number} turn @param {number} rise */
export function wayOf(turn, rise) {
  return new THREE.Vector3(Math.cos(rise) * Math.cos(turn), Math.cos(rise) * Math.sin(turn), Math.sin(rise));
}

/**
 * What a camera asks of others.
 *
 * @typedef {object} Company
 * @property {() => boolean} calm Whether it should turn at once.
 * @property {() => void} changed It has moved.
 * @property {(words: string) => void} rest Where it came to rest, in words.
 * @property {(x: number, y: number) => void} tapped
 * @property {(x: number, y: number) => THREE.Vector3 | null} touched The point of the object that is
 *   seen at a place of the canvas.
 */

/**
 * A camera that goes around an object, of which z stays up.
 *
 * Until somebody comes nearer or moves aside, all the points are kept in view.
 */
export class Camera {
  #wide = new THREE.PerspectiveCamera(32, 1, 1, 1000);
  #parallel = new THREE.OrthographicCamera(-1, 1, 1, -1);
  #slope = Math.tan((this.#wide.fov / 2) * DEGREE);
  /** @type {THREE.PerspectiveCamera | THREE.OrthographicCamera} */
  lens = this.#wide;
  #turn = 0;
  #rise = 0;
  #far = 0;
  #target = new THREE.Vector3();
  #whole = true;
  #aspect = 1;
  #flight = 0;
  // How far pieces are moved apart.
  #spread = 0;

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{ center: THREE.Vector3, radius: number }} ball
   * @param {THREE.Vector3[]} points
   * @param {number[]} firstDeg
   * @param {Company} company
   */
  constructor(canvas, ball, points, firstDeg, company) {
    this.canvas = canvas;
    this.ball = ball;
    this.points = points;
    this.firstDeg = firstDeg;
    this.company = company;
    for (const each of [this.#wide, this.#parallel]) each.up.set(0, 0, 1);
    // At once, as an address may ask for another view.
    this.#aim();
  }

  /** Look from where the object is seen first. */
  #aim() {
    [this.#turn, this.#rise] = this.firstDeg.map((angle) => angle * DEGREE);
    this.#whole = true;
    this.#target = this.ball.center.clone();
  }

  home() {
    this.#aim();
    this.#place();
  }

  /** The direction from the object to the eye. */
  towards() {
    return wayOf(this.#turn, this.#rise);
  }

  /** The distance from which everything is in view. */
  #fitting() {
    const eye = this.towards(), right = new THREE.Vector3(-Math.sin(this.#turn), Math.cos(this.#turn), 0);
    const up = eye.clone().cross(right), deep = this.lens === this.#wide ? 1 : 0;
    const far = this.points.reduce((most, point) => {
      const at = point.clone().sub(this.#target);
      const aside = Math.max(Math.abs(at.dot(right)) / this.#aspect, Math.abs(at.dot(up)));
      return Math.max(most, deep * at.dot(eye) + aside / this.#slope);
    }, 0);
    return 1.06 * (1 + 0.85 * this.#spread) * far;
  }

  /** @param {number} distance */
  #bounded(distance) {
    return Math.max(this.ball.radius * 0.02, Math.min(this.ball.radius * 30, distance));
  }

  #place() {
    cancelAnimationFrame(this.#flight);
    this.#settle();
  }

  #settle() {
    const { lens, ball } = this;
    this.#rise = Math.max(-1.55, Math.min(1.55, this.#rise));
    this.#far = this.#whole ? this.#fitting() : this.#bounded(this.#far);
    const reach = TABLE_REACH * ball.radius * (1 + this.#spread), far = this.#far;
    // Without perspective it does not matter how far the eye is: it stands before everything.
    const stand = lens === this.#wide ? far : Math.max(far, 2 * reach + this.#target.distanceTo(ball.center));
    lens.position.copy(this.#target).addScaledVector(this.towards(), stand);
    lens.lookAt(this.#target);
    const away = lens.position.clone().sub(ball.center).dot(this.towards());
    lens.near = Math.max(ball.radius * 0.002, away - reach);
    lens.far = Math.max(away + reach, 2 * lens.near);
    const high = far * this.#slope, wide = this.#aspect * high;
    this.#wide.aspect = this.#aspect;
    Object.assign(this.#parallel, { left: -wide, right: wide, top: high, bottom: -high });
    lens.updateProjectionMatrix();
    lens.updateMatrixWorld();
    this.company.changed();
  }

  /**
   * Change the view little by little, or at once where motion is not wanted.
   *
   * @param {(part: number) => void} change
   */
  #fly(change) {
    const begun = performance.now(), lasts = this.company.calm() ? 0 : FLIGHT_MS;
    cancelAnimationFrame(this.#flight);
    const frame = () => {
      const done = lasts ? Math.min(1, (performance.now() - begun) / lasts) : 1;
      change(done * done * (3 - 2 * done));
      this.#settle();
      if (done < 1) this.#flight = requestAnimationFrame(frame);
    };
    frame();
  }

  /**
   * Turn until a direction from a point of the object looks at the eye.
   *
   * @param {THREE.Vector3} direction
   * @param {THREE.Vector3} point
   */
  face(direction, point) {
    const up = Math.max(-1.2, Math.min(1.2, Math.asin(Math.max(-1, Math.min(1, direction.z)))));
    this.#turnTo(Math.atan2(direction.y, direction.x), up, point);
  }

  /**
   * See the object from an azimuth and an elevation.
   *
   * @param {number[]} viewDeg
   * @param {THREE.Vector3} point
   */
  look([azimuth, elevation], point) {
    this.#turnTo(azimuth * DEGREE, elevation * DEGREE, point);
  }

  /**
   * Turn by the shorter way; say from where it is seen, if it was seen from elsewhere.
   *
   * @param {number} turn
   * @param {number} rise
   * @param {THREE.Vector3} point
   */
  #turnTo(turn, rise, point) {
    const [turned, risen, target, before] = [this.#turn, this.#rise, this.#target.clone(), this.#spoken()];
    const away = Math.atan2(Math.sin(turn - turned), Math.cos(turn - turned));
    const to = this.#whole ? this.ball.center : point;
    this.#fly((part) => {
      this.#turn = turned + away * part;
      this.#rise = risen + (rise - risen) * part;
      this.#target.copy(target).lerp(to, part);
      if (part === 1 && this.#spoken() !== before) this.company.rest(this.#spoken());
    });
  }

  /**
   * Look from a direction at all there is, for as long as it takes to see something.
   *
   * @template T
   * @param {THREE.Vector3} direction
   * @param {() => T} see
   */
  glimpse(direction, see) {
    const [turn, rise, whole, target] = [this.#turn, this.#rise, this.#whole, this.#target];
    [this.#turn, this.#rise] = [Math.atan2(direction.y, direction.x), Math.asin(direction.z)];
    [this.#whole, this.#target] = [true, this.ball.center.clone()];
    this.#settle();
    const seen = see();
    [this.#turn, this.#rise, this.#whole, this.#target] = [turn, rise, whole, target];
    this.#settle();
    return seen;
  }

  /**
   * Turn around what is under a place of the canvas from now on, which comes to the middle.
   *
   * @param {number} x
   * @param {number} y
   */
  pivot(x, y) {
    const point = this.company.touched(x, y) || this.ball.center.clone(), from = this.#target.clone();
    this.#whole = false;
    this.#fly((part) => this.#target.copy(from).lerp(point, part));
  }

  /**
   * The point under a place of the canvas: on the object, or else as far away as the pivot.
   *
   * @param {number} x
   * @param {number} y
   */
  under(x, y) {
    const on = this.company.touched(x, y);
    if (on) return on;
    const { origin, direction } = casterAt(this.canvas, this.lens, x, y).ray, eye = this.towards();
    const deep = this.#target.clone().sub(origin).dot(eye) / direction.dot(eye);
    return origin.clone().addScaledVector(direction, deep);
  }

  /**
   * Shrink the way from the eye to a point: whatever else the ray to it meets stays in line, too.
   *
   * @param {THREE.Vector3} point
   * @param {number} factor
   */
  zoom(point, factor) {
    const next = this.#bounded(this.#far / factor);
    this.#whole = false;
    this.#target.sub(point).multiplyScalar(next / this.#far).add(point);
    this.#far = next;
    this.#place();
  }

  /**
   * Move aside by so many pixels, at the depth of the pivot or at another.
   *
   * @param {number} dx
   * @param {number} dy
   */
  pan(dx, dy, depth = this.#far) {
    const mm = (2 * depth * this.#slope) / this.canvas.clientHeight, { matrixWorld } = this.lens;
    const [right, up] = [0, 1].map((column) => new THREE.Vector3().setFromMatrixColumn(matrixWorld, column));
    this.#whole = false;
    this.#target.addScaledVector(right, -dx * mm).addScaledVector(up, dy * mm);
    this.#place();
  }

  /**
   * Bring a point of the object to a place of the canvas.
   *
   * @param {THREE.Vector3} point
   * @param {number} x
   * @param {number} y
   */
  hold(point, x, y) {
    const at = placeOf(this.canvas, this.lens, point), { position } = this.lens;
    const depth = this.lens === this.#wide ? position.clone().sub(point).dot(this.towards()) : this.#far;
    this.pan(x - at.x, y - at.y, depth);
  }

  /**
   * Turn as a finger draws it along, by so many pixels.
   *
   * @param {number} dx
   * @param {number} dy
   */
  drag(dx, dy) {
    const speed = 5 / Math.min(this.canvas.clientWidth, this.canvas.clientHeight);
    this.#turn -= dx * speed;
    this.#rise += dy * speed;
    this.#place();
  }

  /**
   * Do what a key or a button asks: left, right, up, down, in, out, home.
   *
   * @param {string} what
   */
  move(what) {
    if (what === "home") this.home();
    else if (what === "in" || what === "out") this.zoom(this.#target.clone(), what === "in" ? NEARER : 1 / NEARER);
    else {
      this.#turn += TURN * (Number(what === "right") - Number(what === "left"));
      this.#rise += TURN * (Number(what === "up") - Number(what === "down"));
      this.#place();
    }
    this.rested();
  }

  /** Say from where the object is seen, as nothing moves any more. */
  rested() {
    this.company.rest(this.#spoken());
  }

  #spoken() {
    const [turn, rise] = [this.#turn / DEGREE, this.#rise / DEGREE];
    const near = this.#far && !this.#whole ? this.#fitting() / this.#far : 1;
    const zoomed = Math.abs(near - 1) > 0.1 ? `, ${near.toFixed(1)} times as large` : "";
    const side = SIDES[((Math.floor((turn + 90) / 45 + 0.5) % 8) + 8) % 8], end = rise > 0 ? "above" : "below";
    if (Math.abs(rise) > 60) return `Seen from straight ${end}${zoomed}.`;
    const high = Math.abs(rise) < 8 ? "" : ` and ${Math.abs(rise) > 42 ? "well " : ""}${end}`;
    return `Seen from the ${side}${high}${zoomed}.`;
  }

  /**
   * Keep lines parallel, or show what is nearer larger.
   *
   * @param {boolean} on
   */
  straighten(on) {
    this.lens = on ? this.#parallel : this.#wide;
    this.#place();
  }

  /** The object has changed: show all of it, if all of it was shown. */
  refit() {
    if (this.#whole) this.#target.copy(this.ball.center);
    this.#settle();
  }

  /**
   * Pieces are moved apart by so much of their way from the middle.
   *
   * @param {number} by
   */
  spread(by) {
    this.#spread = by;
    this.#place();
  }

  /**
   * @param {number} width
   * @param {number} height
   */
  resize(width, height) {
    this.#aspect = width / height;
    this.#settle();
  }
}
