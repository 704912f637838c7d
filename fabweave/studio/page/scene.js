import { Camera } from "../../show/scripts/camera.js";
import { Gestures } from "../../show/scripts/gestures.js";
import { casterAt, placeOf } from "../../show/scripts/pick.js";
import { FINE, Stage, stillWanted } from "../../show/scripts/stage.js";
import { usualWidth } from "../../show/scripts/strands.js";
import * as THREE from "../../show/scripts/three.js";
import { Fabric } from "./fabric.js";
import { Dots, Faces } from "./marks.js";
import { Arrow, ROOM } from "./up.js";

/** Where software draws, shadows and fine pixels come when nothing has moved for so long. */
const STILL_MS = 450;
/** Pixels of the moving picture for each of the screen, along both, where software draws. */
const COARSE = 0.6;
/** From where an object is seen until more is known of it: azimuth and elevation. */
const VIEW_DEG = [-60, 24];
/** Strands run in for so long when an object opens. */
const RUN_MS = 2200;

/**
 * What a tap meets.
 *
 * @typedef {object} Hit
 * @property {THREE.Vector3} [point]
 * @property {number} [piece]
 * @property {number} [crossing] The nearest one.
 * @property {number} [face]
 * @property {number} [rung]
 */

/** The object in space: drawn anew whenever something tells how it is. */
export class Scene {
  #scene = new THREE.Scene();
  #ball = { center: new THREE.Vector3(), radius: 1 };
  // What is kept in view: points of the object, and room for the arrow where that is seen.
  /** @type {THREE.Vector3[]} */
  #outer = [];
  /** @type {THREE.Vector3[]} */
  #points = [];
  #faces = new Faces();
  #dots = new Dots();
  #shadows = true;
  #still = false;
  #rest = 0;
  #running = 0;
  // What is shown, of which others are told.
  /** @type {[Record<string, any>, boolean] | null} */
  #now = null;
  #widthMm = 0;
  /** How thick strips are. */
  thickMm = 0;
  /** @type {Uint8Array | null} */
  #heat = null;
  /** What the dots and faces are, and the one that keys are at. */
  #marks = { left: new Set(), fastened: [], asked: [], here: -1 };
  /** @type {number[]} */
  #times = [];

  /**
   * Show a canvas; null where the browser has no WebGL 2.
   *
   * @param {HTMLCanvasElement} canvas
   * @param {{ tapped(hit: Hit | null): void, arrowAt(x: number, y: number): void }} company
   */
  static on(canvas, company) {
    const stage = Stage.on(canvas);
    return stage && new Scene(stage, company);
  }

  /**
   * @param {Stage} stage
   * @param {{ tapped(hit: Hit | null): void, arrowAt(x: number, y: number): void }} company
   */
  constructor(stage, company) {
    this.stage = stage;
    this.company = company;
    this.fabric = new Fabric(stage.slow);
    this.fabric.lightFor(VIEW_DEG);
    this.arrow = new Arrow();
    this.#scene.add(this.fabric.floor, this.fabric.mesh, this.#faces, this.#dots, this.arrow);
    this.camera = new Camera(stage.canvas, this.#ball, this.#outer, VIEW_DEG, {
      calm: stillWanted, changed: () => this.#move(), rest: () => {},
      touched: (x, y) => this.#touch(x, y)?.point ?? null, tapped: (x, y) => company.tapped(this.#touch(x, y)),
    });
    new Gestures(this.camera);
    stage.begin({ draw: () => this.#draw(), resized: (width, height) => this.camera.resize(width, height) }, COARSE);
  }

  draw() {
    this.stage.request();
  }

  #draw() {
    const { renderer, slow } = this.stage, { lens } = this.camera, look = getComputedStyle(document.body);
    const paper = look.getPropertyValue("--paper").trim() || "#eee", moving = slow && !this.#still;
    if (this.fabric.there) this.fabric.light(renderer, this.#ball, this.camera, this.#shadows && !moving, moving);
    // What is shown of nothing is paper.
    renderer.setClearColor(paper, 1);
    if (!this.fabric.there) return renderer.clear();
    this.#dots.fit(0.6 * this.#widthMm, renderer.getPixelRatio());
    this.arrow.ink.color.set(look.getPropertyValue("--soft").trim() || "#666");
    renderer.render(this.#scene, lens);
    const { x, y } = placeOf(this.stage.canvas, lens, this.arrow.tip(this.#ball));
    if (this.arrow.visible) this.company.arrowAt(x, y);
    this.#times.push(performance.now());
    if (this.#times.length > 60) this.#times.shift();
  }

  /** Where software draws: coarse pixels without shadows now, and all of it at rest. */
  #move() {
    if (this.stage.slow) {
      this.#still = false;
      this.stage.sharpen(COARSE);
      clearTimeout(this.#rest);
      this.#rest = setTimeout(() => {
        this.#still = true;
        this.stage.sharpen(FINE);
        this.draw();
      }, STILL_MS);
    }
    this.draw();
  }

  /** Show an object, of ribbons or of yarns. @param {Record<string, any>} arrays */
  show(arrays, yarns = false) {
    const { position } = arrays, ball = this.#ball, before = ball.radius, box = new THREE.Box3().setFromArray(position);
    box.getCenter(ball.center);
    ball.radius = Math.max(box.getSize(new THREE.Vector3()).length() / 2, 1e-9);
    // A few hundred points stand for all.
    const every = 3 * Math.ceil(position.length / 3 / 400);
    this.#points = Array.from({ length: Math.ceil(position.length / every) }, (_, k) =>
      new THREE.Vector3().fromArray(position, every * k));
    this.#now = [arrays, yarns];
    this.#widthMm = arrays.thread ? usualWidth(position) : 0.03 * ball.radius;
    this.fabric.show(arrays, arrays.thread ? this.#widthMm : 0, this.thickMm, ball, box.min.z);
    this.#makeRoom();
    if (before !== ball.radius) this.camera.refit();
    else this.#move();
  }

  /** Let the arrow begin in the middle of the object; while it is shown, there is room for it. */
  #makeRoom() {
    const { center, radius } = this.#ball, top = center.clone().setZ(center.z + ROOM * radius);
    this.arrow.position.copy(center);
    this.arrow.scale.setScalar(radius);
    this.#outer.splice(0, Infinity, ...this.#points, ...(this.arrow.visible ? [top] : []));
  }

  /** See an object that opens from where its pictures show it. @param {number[]} viewDeg */
  seeFrom(viewDeg) {
    this.camera.firstDeg = viewDeg;
    this.fabric.lightFor(viewDeg);
    this.camera.home();
  }

  /** Let strands run in, one after the other, unless nothing is to move. */
  runIn() {
    cancelAnimationFrame(this.#running);
    if (stillWanted()) return this.fabric.run(1);
    const begun = performance.now(), step = () => {
      const shown = Math.min((performance.now() - begun) / RUN_MS, 1);
      this.fabric.run(shown);
      this.#move();
      if (shown < 1) this.#running = requestAnimationFrame(step);
    };
    return step();
  }

  /** Colour strands by a trouble; as the material is for none. @param {Uint8Array | null} heat */
  warm(heat) {
    this.#heat = heat;
    this.fabric.warm(heat);
    this.draw();
  }

  /** Let the object go so far, in parts of how far it goes. @param {number} form */
  letGo(form) {
    this.fabric.let(form);
    this.#move();
  }

  /**
   * Show the faces of the mesh, those that are left out in red; none without them.
   *
   * @param {Record<string, any> | null} arrays
   * @param {Set<number>} left
   */
  showFaces(arrays, left) {
    this.#marks.left = left;
    this.#faces.show(arrays, left, this.#marks.here);
    this.draw();
  }

  /**
   * Show crossings: those with a fastener dark, those that were asked for in red.
   *
   * @param {boolean} on
   * @param {number[]} fastened
   * @param {number[]} asked
   */
  showDots(on, fastened, asked) {
    Object.assign(this.#marks, { fastened, asked });
    this.#dots.visible = on && this.fabric.crossings.length > 0;
    if (this.#dots.visible) this.#dots.show(this.fabric.crossings, fastened, asked, this.#marks.here);
    this.draw();
  }

  /**
   * Go from face to face or from crossing to crossing by keys, as marks are shown; the number of the
   * one that is there, or -1.
   *
   * @param {number} steps
   */
  step(steps) {
    const { visible } = this.#faces, marks = this.#marks, arrays = this.#now?.[0] ?? {};
    const all = visible ? 1 + Math.max(-1, ...new Set(arrays.face)) : this.fabric.crossings.length / 3;
    marks.here = all ? (Math.max(marks.here, steps < 0 ? 0 : -1) + steps + all) % all : -1;
    if (visible) this.#faces.show(arrays, marks.left, marks.here);
    else this.#dots.show(this.fabric.crossings, marks.fastened, marks.asked, marks.here);
    this.draw();
    return marks.here;
  }

  /** @param {boolean} on */
  showArrow(on) {
    this.arrow.visible = on;
    this.#makeRoom();
    this.camera.refit();
  }

  /** Point the arrow there. @param {THREE.Vector3} way */
  pointArrow(way) {
    this.arrow.point(way);
    this.#move();
  }

  /**
   * The way from the middle to what is under a place of the window, at the arrow's length: of two
   * the one nearer to a way.
   *
   * @param {number} x
   * @param {number} y
   * @param {THREE.Vector3} last
   */
  wayAt(x, y, last) {
    const { canvas } = this.stage, box = canvas.getBoundingClientRect();
    return this.arrow.wayOf(casterAt(canvas, this.camera.lens, x - box.x, y - box.y).ray, this.#ball, last);
  }

  /**
   * A way that leans to the right, and away, as it is seen from here.
   *
   * @param {THREE.Vector3} way
   * @param {number} right
   * @param {number} away
   */
  leaned(way, right, away) {
    const across = new THREE.Vector3().setFromMatrixColumn(this.camera.lens.matrixWorld, 0);
    return way.clone().applyAxisAngle(this.camera.towards(), -right).applyAxisAngle(across, -away);
  }

  /**
   * What is under a place of the canvas.
   *
   * @param {number} x
   * @param {number} y
   * @returns {Hit | null}
   */
  #touch(x, y) {
    const { ray } = casterAt(this.stage.canvas, this.camera.lens, x, y);
    return this.#faces.visible ? this.#faces.touch(ray) : this.fabric.touch(ray);
  }

  /** @param {number} piece */
  choose(piece) {
    this.fabric.uniforms.chosen.value = piece < 0 ? -2 : piece;
    this.draw();
  }

  /** @param {boolean} on */
  shadows(on) {
    this.#shadows = on;
    this.draw();
  }

  /** Frames a second, of the last ones. */
  get fps() {
    const times = this.#times, count = times.length - 1;
    return count > 0 ? (1000 * count) / (times[count] - times[0]) : 0;
  }

  /**
   * A picture of what is seen, or of another object in its place.
   *
   * @param {number} wide
   * @param {Record<string, any> | null} [other]
   */
  picture(wide, other = null, type = "image/jpeg") {
    const now = this.#now, { form, shown } = this.fabric.uniforms, before = [form.value, shown.value];
    if (other) {
      this.show(other);
      form.value = 0;
    }
    shown.value = 1;
    this.#still = true;
    this.stage.sharpen(FINE);
    this.stage.drawNow();
    const url = this.stage.copy(wide).toDataURL(type, 0.82);
    if (other && now) this.show(...now);
    else if (other) this.fabric.mesh.visible = false;
    this.fabric.warm(this.#heat);
    [form.value, shown.value] = before;
    this.#move();
    return url;
  }

  dispose() {
    cancelAnimationFrame(this.#running);
    clearTimeout(this.#rest);
    this.stage.dispose();
  }
}
