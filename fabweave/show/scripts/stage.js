import * as THREE from "./three.js";

/** Pixels of a still picture for each of the screen, along both, where nothing else smooths edges. */
export const FINE = 2;

/** Whether this browser draws in software, where smooth edges take longer than all the rest. */
function drawsInSoftware() {
  const brush = document.createElement("canvas").getContext("webgl");
  const known = brush && brush.getExtension("WEBGL_debug_renderer_info");
  if (!brush || !known) return false;
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(brush.getParameter(known.UNMASKED_RENDERER_WEBGL));
}

/**
 * What draws; null where the browser has no WebGL 2.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {boolean} slow
 */
function makeRenderer(canvas, slow) {
  const quiet = console.error;
  try {
    console.error = () => {}; // three.js reports a missing WebGL as an error, and then throws it
    // Colours are what screens show, and our shaders reckon with them as they are.
    THREE.ColorManagement.enabled = false;
    const renderer = new THREE.WebGLRenderer({ canvas, antialias: !slow, preserveDrawingBuffer: true });
    renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    return renderer;
  } catch {
    return null;
  } finally {
    console.error = quiet;
  }
}

/**
 * What a stage shows.
 *
 * @typedef {{ draw(): void, resized(width: number, height: number): void }} Play
 */

/** A canvas that is drawn anew when something has changed, once for each picture of the screen. */
export class Stage {
  #waiting = 0;
  /** @type {ResizeObserver | null} */
  #sizes = null;
  /** @type {Play | null} */
  #play = null;

  /** Set up a canvas; null where the browser has no WebGL 2. @param {HTMLCanvasElement} canvas */
  static on(canvas) {
    const slow = drawsInSoftware(), renderer = makeRenderer(canvas, slow);
    return renderer && new Stage(canvas, renderer, slow);
  }

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {THREE.WebGLRenderer} renderer
   * @param {boolean} slow
   */
  constructor(canvas, renderer, slow) {
    this.canvas = canvas;
    this.renderer = renderer;
    this.slow = slow;
  }

  /**
   * Begin to draw, at any size that the canvas gets.
   *
   * @param {Play} play
   * @param {number} coarse Pixels for each of the screen where software draws.
   */
  begin(play, coarse) {
    const { canvas, renderer, slow } = this;
    this.#play = play;
    this.#sizes = new ResizeObserver(() => {
      const { clientWidth: width, clientHeight: height } = canvas;
      if (!width || !height) return;
      renderer.setPixelRatio(slow ? coarse : Math.min(devicePixelRatio || 1, 2));
      renderer.setSize(width, height, false);
      play.resized(width, height);
    });
    this.#sizes.observe(canvas);
  }

  /** Draw with the next picture of the screen. */
  request() {
    this.#waiting ||= requestAnimationFrame(() => this.drawNow());
  }

  /** Draw at once. */
  drawNow() {
    cancelAnimationFrame(this.#waiting);
    this.#waiting = 0;
    this.#play?.draw();
  }

  /**
   * Set the pixels for each of the screen; tell whether that changes them.
   *
   * @param {number} ratio
   */
  sharpen(ratio) {
    if (this.renderer.getPixelRatio() === ratio) return false;
    this.renderer.setPixelRatio(ratio);
    return true;
  }

  /**
   * A copy of what is seen, as wide as so many pixels.
   *
   * @param {number} wide
   */
  copy(wide) {
    const sheet = document.createElement("canvas");
    [sheet.width, sheet.height] = [wide, Math.round((wide * this.canvas.height) / this.canvas.width)];
    sheet.getContext("2d")?.drawImage(this.canvas, 0, 0, sheet.width, sheet.height);
    return sheet;
  }

  /** Give back what the browser holds for it. */
  dispose() {
    cancelAnimationFrame(this.#waiting);
    this.#sizes?.disconnect();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }
}

/** Whether this person wants nothing to move. */
export const stillWanted = () => matchMedia("(prefers-reduced-motion: reduce)").matches;
