/** What keys ask of a camera. */
const KEYS = {
  ArrowLeft: "left", ArrowRight: "right", ArrowUp: "up", ArrowDown: "down",
  "+": "in", "=": "in", "-": "out", 0: "home",
};
/** A finger that trembles by so many pixels taps, and turns nothing. */
const TREMBLE = 6;
/** While the wheel turns on, what is held stays what it was: for so long, within so many pixels. */
const GRIP_MS = 600, GRIP = 3;

/** Whether a key is part of a shortcut of the browser. @param {KeyboardEvent} event */
export const isShortcut = (event) => event.ctrlKey || event.metaKey || event.altKey;

/** Hands on the canvas of a camera: drag, pinch, wheel and keys. */
export class Gestures {
  #camera;
  /** @type {Map<number, { x: number, y: number }>} */
  #pointers = new Map();
  #moved = 0;
  #fingers = 0;
  // The point of the object that is held while somebody zooms, and since when and where.
  /** @type {{ point: import("./three.js").Vector3, at: number, x: number, y: number } | null} */
  #grip = null;

  /** @param {import("./camera.js").Camera} camera */
  constructor(camera) {
    const { canvas } = camera;
    this.#camera = camera;
    canvas.addEventListener("pointerdown", (event) => this.#press(event));
    canvas.addEventListener("pointermove", (event) => this.#drag(event));
    for (const name of /** @type {const} */ (["pointerup", "pointercancel"]))
      canvas.addEventListener(name, (event) => this.#lift(event));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    canvas.addEventListener("dblclick", (event) => camera.pivot(event.offsetX, event.offsetY));
    canvas.addEventListener("keydown", (event) => {
      const asked = KEYS[/** @type {keyof typeof KEYS} */ (event.key)];
      if (isShortcut(event) || !asked) return;
      event.preventDefault();
      camera.move(asked);
    });
  }

  /** @param {PointerEvent} event */
  #press(event) {
    this.#camera.canvas.setPointerCapture(event.pointerId);
    if (this.#pointers.size === 0) [this.#moved, this.#fingers] = [0, 0];
    this.#pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    this.#fingers = Math.max(this.#fingers, this.#pointers.size);
    this.#grip = null;
  }

  /** @param {PointerEvent} event */
  #drag(event) {
    const last = this.#pointers.get(event.pointerId);
    if (!last) return;
    const before = this.#pointers.size === 2 ? this.#apart() : null;
    const dx = event.offsetX - last.x, dy = event.offsetY - last.y;
    this.#moved += Math.abs(dx) + Math.abs(dy);
    this.#pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    if (before) this.#pinch(before);
    else if (this.#moved <= TREMBLE || this.#pointers.size > 1) return;
    else if (event.buttons & 2 || event.shiftKey) this.#camera.pan(dx, dy);
    else this.#camera.drag(dx, dy);
  }

  /**
   * Come as much nearer as two fingers went apart.
   *
   * @param {{ x: number, y: number, far: number }} before
   */
  #pinch(before) {
    const after = this.#apart(), { x, y } = before;
    this.#grip ||= { x, y, at: 0, point: this.#camera.under(x, y) };
    this.#camera.zoom(this.#grip.point, after.far / Math.max(before.far, 1));
    this.#camera.hold(this.#grip.point, after.x, after.y);
  }

  /** The middle of two fingers, and how far they are apart. */
  #apart() {
    const [a, b] = [...this.#pointers.values()];
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, far: Math.hypot(a.x - b.x, a.y - b.y) };
  }

  /** @param {PointerEvent} event */
  #lift(event) {
    if (!this.#pointers.delete(event.pointerId)) return;
    this.#grip = null;
    const tapped = event.type === "pointerup" && this.#moved <= TREMBLE && this.#fingers === 1 && event.button === 0;
    if (tapped) this.#camera.company.tapped(event.offsetX, event.offsetY);
    else this.#camera.rested();
  }

  /** Come nearer so that what is under the pointer stays there. @param {WheelEvent} event */
  #wheel(event) {
    event.preventDefault();
    const now = performance.now(), { offsetX: x, offsetY: y } = event, grip = this.#grip;
    const held = grip && now - grip.at <= GRIP_MS && Math.hypot(x - grip.x, y - grip.y) <= GRIP;
    this.#grip = held ? { ...grip, at: now } : { x, y, at: now, point: this.#camera.under(x, y) };
    this.#camera.zoom(this.#grip.point, Math.exp(-event.deltaY * (event.deltaMode ? 0.04 : 0.0012)));
  }
}
