import { isShortcut } from "../../show/scripts/gestures.js";
import * as THREE from "../../show/scripts/three.js";

/** Radii of the object: from its middle to the tip, the head, how thick both are, and what is kept in view. */
const TIP = 1.14, HEAD = 0.13, THICK = 0.008, WIDE = 0.035;
export const ROOM = 1.3;
/** The arrow goes to an axis of the file that is so near, and a key leans it by so much. */
const NEAR = Math.cos(Math.PI / 30), LEAN = Math.PI / 18;
/** A finger that moves by so many pixels drags. */
const TREMBLE = 3;
const UP = new THREE.Vector3(0, 0, 1), ALONG = new THREE.Vector3(0, 1, 0);
/** How keys lean it: to the right, and away. @type {Record<string, number[]>} */
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** The arrow that points up, in space. */
export class Arrow extends THREE.Group {
  ink = new THREE.MeshBasicMaterial();

  constructor() {
    super();
    const stick = new THREE.CylinderGeometry(THICK, THICK, TIP - HEAD, 16).translate(0, (TIP - HEAD) / 2, 0);
    const head = new THREE.ConeGeometry(WIDE, HEAD, 24).translate(0, TIP - HEAD / 2, 0);
    this.add(...[stick, head].map((geometry) => new THREE.Mesh(geometry, this.ink)));
    this.visible = false;
  }

  /** @param {THREE.Vector3} way */
  point(way) {
    this.quaternion.setFromUnitVectors(ALONG, way);
  }

  /** Where its tip is. @param {import("./fabric.js").Ball} ball */
  tip({ center, radius }) {
    return ALONG.clone().applyQuaternion(this.quaternion).multiplyScalar(TIP * radius).add(center);
  }

  /**
   * The way of its tip on a ray, or as near to it as can be: of two the one nearer to a way.
   *
   * @param {THREE.Ray} ray
   * @param {import("./fabric.js").Ball} ball
   * @param {THREE.Vector3} last
   */
  wayOf(ray, { center, radius }, last) {
    const beside = ray.closestPointToPoint(center, new THREE.Vector3()).sub(center);
    const depth = Math.sqrt(Math.max(0, (TIP * radius) ** 2 - beside.lengthSq()));
    const [before, behind] = [-depth, depth].map((far) => {
      return beside.clone().addScaledVector(ray.direction, far).normalize();
    });
    return behind.dot(last) > before.dot(last) ? behind : before;
  }
}

/**
 * What others know of the arrow.
 *
 * @typedef {object} UpCompany
 * @property {() => number[][]} turn The rotation from the file to what is seen.
 * @property {(text: string) => void} leaning It is on its way.
 * @property {(text: string) => void} chosen It was let go.
 * @property {() => void} usual It was tapped twice.
 */

/** The hand on that arrow: where it is dragged to, or leant to by keys, is what shall point up. */
export class UpHandle {
  #way = UP;
  /** @type {{ x: number, y: number, moved: boolean } | null} */
  #from = null;
  #leant = false;

  /**
   * @param {import("./scene.js").Scene} scene
   * @param {HTMLElement} handle
   * @param {UpCompany} company
   */
  constructor(scene, handle, company) {
    this.scene = scene;
    this.company = company;
    handle.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      handle.setPointerCapture(event.pointerId);
      this.#from = { x: event.clientX, y: event.clientY, moved: false };
    });
    handle.addEventListener("pointermove", (event) => this.#drag(event));
    handle.addEventListener("pointerup", () => {
      if (this.#from?.moved) this.#letGo();
      else this.#from = null;
    });
    handle.addEventListener("pointercancel", () => {
      this.#from = null;
      this.reset();
    });
    handle.addEventListener("dblclick", () => company.usual());
    handle.addEventListener("keydown", (event) => {
      if (isShortcut(event) || !KEYS[event.key]) return;
      event.preventDefault();
      const [right, away] = KEYS[event.key];
      this.#leant = true;
      this.#point(scene.leaned(this.#way, right * LEAN, away * LEAN));
    });
    for (const name of ["keyup", "blur"]) handle.addEventListener(name, () => this.#leant && this.#letGo());
  }

  /** @param {PointerEvent} event */
  #drag({ clientX: x, clientY: y }) {
    if (!this.#from) return;
    this.#from.moved ||= Math.hypot(x - this.#from.x, y - this.#from.y) > TREMBLE;
    if (this.#from.moved) this.#point(this.scene.wayAt(x, y, this.#way));
  }

  /** Point there, or to an axis of the file near by. @param {THREE.Vector3} to */
  #point(to) {
    const turn = this.company.turn();
    const axes = [0, 1, 2].map((axis) => new THREE.Vector3().fromArray(turn.map((row) => row[axis])));
    this.#way = axes.flatMap((axis) => [axis, axis.clone().negate()]).find((axis) => axis.dot(to) > NEAR) || to;
    this.scene.pointArrow(this.#way);
    this.company.leaning(this.#text());
  }

  /** What it points to in the file's own coordinates, as the option has it. */
  #text() {
    const way = this.#way.toArray(), turn = this.company.turn();
    const own = [0, 1, 2].map((axis) => turn.reduce((sum, row, k) => sum + row[axis] * way[k], 0));
    const most = Math.max(...own.map(Math.abs)), rounded = own.map((value) => Number((value / most).toFixed(3)));
    const axis = rounded.findIndex(Boolean);
    return rounded.filter(Boolean).length > 1 ? rounded.join(",") : `${rounded[axis] < 0 ? "-" : ""}${"xyz"[axis]}`;
  }

  /** Point up again, unless it is being turned. */
  reset() {
    if (this.#from || this.#leant) return;
    this.#way = UP;
    this.scene.pointArrow(UP);
  }

  #letGo() {
    this.#from = null;
    this.#leant = false;
    if (this.#way.dot(UP) > 1 - 1e-9) this.reset();
    else this.company.chosen(this.#text());
  }
}
