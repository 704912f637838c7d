import { Camera, wayOf } from "../../scripts/camera.js";
import { Gestures } from "../../scripts/gestures.js";
import { casterAt, placeOf } from "../../scripts/pick.js";
import { FINE, stillWanted } from "../../scripts/stage.js";
import * as THREE from "../../scripts/three.js";
import { flyIn } from "./flight.js";
import { HIDDEN, LATER } from "./shaders.js";
import { Former, makeTable } from "./surroundings.js";
import { placeTags, ringPoint, seenSpots, writeTags } from "./tags.js";
import { joined, UNCUT, Woven } from "./woven.js";

/** Software draws this many triangles in a frame that is short enough for motion. */
const MOST_MOVED = 120000;
/** A piece is seen well enough if so much of it is. */
const SEEN = 0.45;
/** Views are compared in pictures of this size, for no longer than this. */
const GLIMPSE = [150, 110], GLIMPSES_MS = 500;
/** The azimuths of these views. */
const TURNS = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => (k * Math.PI) / 4);
/** How far an object sways, as a share of its radius, and milliseconds for a radian. */
const SWING = 0.08, SWING_MS = 700;
/** While the table is seen, the finished object is a veil as dense as this at least. */
const GHOST = 0.125;
/** When nothing has changed for so long, labels are placed and edges are smoothed. */
const REST_MS = 160;

/** @typedef {import("./tags.js").Label} Label */
/** @typedef {import("./plan.js").Values} Values */

/** The woven object in space. */
export class Space {
  #scene = new THREE.Scene();
  #rest = 0;
  #swaying = 0;
  #fine = false;
  // The triangles that must be drawn over what is seen; null: all.
  /** @type {import("./woven.js").Range | null} */
  #fresh = null;
  // What ends the flight of pieces to their places.
  /** @type {(() => void) | null} */
  #landing = null;
  // Labels that are asked for, and those that have a place; and the station that is ringed.
  /** @type {Label[]} */
  #wanted = [];
  /** @type {ReturnType<typeof placeTags>} */
  #anchors = [];
  /** @type {[number, THREE.Vector3] | null} */
  #mark = null;
  // The piece that is to be seen, and how much of it is enough.
  #sought = -1;
  #enough = SEEN;
  // Whether the table is to be seen, the former, and how dense is asked for what is to come.
  #standing = false;
  #formed = false;
  #veil = 0;

  /**
   * @param {import("../../scripts/stage.js").Stage} stage
   * @param {HTMLCanvasElement} over
   * @param {import("./plan.js").Plan} plan
   * @param {{ chosen(piece: number): void, seen(words: string): void }} company
   */
  constructor(stage, over, plan, company) {
    this.stage = stage;
    this.over = over;
    this.plan = plan;
    this.woven = new Woven(plan);
    const { spots, ball, made } = this.woven.strips;
    this.table = makeTable(made.position);
    this.former = new Former(plan.data.former.plates);
    this.#scene.add(this.woven.mesh, this.table, this.former);
    // A few hundred points stand for all where the whole must be kept in view.
    const every = Math.ceil(spots.length / 400);
    const outer = spots.filter((_, k) => k % every === 0).flatMap((places) => places.map(({ point }) => point));
    this.camera = new Camera(stage.canvas, ball, outer, plan.data.view_deg, {
      calm: () => this.#calm(), changed: () => this.#drawAll(), rest: (words) => company.seen(words),
      touched: (x, y) => this.#touch(x, y)?.point || null, tapped: (x, y) => company.chosen(this.pick(x, y)),
    });
    new Gestures(this.camera);
    stage.begin({ draw: () => this.#frame(), resized: (width, height) => this.camera.resize(width, height) }, 1);
  }

  /** Whether things should be in their places at once. */
  #calm() {
    return stillWanted() || (this.stage.slow && this.woven.seen()[1] > 3 * MOST_MOVED);
  }

  #drawAll() {
    this.#fresh = null;
    this.stage.request();
  }

  /** Draw everything at once, not with the next picture of the screen, and in fine pixels. */
  draw() {
    [this.#fresh, this.#fine] = [null, true];
    this.stage.drawNow();
    this.#fine = false;
  }

  /** Draw what is not drawn yet; while things move, and software draws, pixels are coarse. */
  #frame() {
    const { slow } = this.stage;
    if (slow && (this.#fine || !this.#fresh) && this.stage.sharpen(this.#fine ? FINE : 1)) this.#fresh = null;
    this.#paint();
    this.#write(this.over);
    clearTimeout(this.#rest);
    this.#rest = setTimeout(() => this.#settle(), REST_MS);
  }

  #paint() {
    const { renderer } = this.stage, fresh = this.#fresh;
    renderer.autoClear = !fresh;
    this.woven.reach(fresh || this.woven.seen());
    // Where only what changed is drawn, the table stands there already; from below it would hide the object.
    this.table.visible = this.#standing && !fresh && this.camera.towards().z > 0;
    this.former.visible = this.#formed && !fresh;
    renderer.render(this.#scene, this.camera.lens);
    renderer.autoClear = true;
    this.#fresh = [0, 0];
  }

  /** Once nothing moves: smooth edges, labels where their pieces are seen, and a hidden piece turned up. */
  #settle() {
    if (this.#landing) return;
    if (this.stage.slow && this.stage.sharpen(FINE)) {
      this.#fresh = null;
      this.#paint();
    }
    const share = this.#placeLabels(), sought = this.#sought;
    this.#write(this.over);
    this.#sought = -1;
    if (sought >= 0 && share(sought) < this.#enough) this.#turnToSee(sought);
  }

  /**
   * Turn to where most of a piece is seen, of as many views as there is time for, the nearest
   * first.
   *
   * @param {number} piece
   */
  #turnToSee(piece) {
    const at = this.camera.towards(), until = performance.now() + GLIMPSES_MS, [width, height] = GLIMPSE;
    const views = [-0.9, -0.3, 0.3, 0.9].flatMap((rise) => TURNS.map((turn) => wayOf(turn, rise)));
    views.sort((a, b) => b.dot(at) - a.dot(at)).unshift(at);
    /** @type {number[]} */
    const seen = [];
    for (const view of views) {
      if (performance.now() > until) break;
      seen.push(this.camera.glimpse(view, () => {
        const owner = this.#numbered(width, height);
        let pixels = 0;
        for (let k = 0; k < width * height; k++) pixels += Number(owner(k) === piece);
        return pixels;
      }));
    }
    // Of views that are nearly as good the nearest one is taken: it turns least.
    const best = views[seen.findIndex((pixels) => pixels >= 0.8 * Math.max(...seen))];
    if (best !== at) this.camera.face(best, this.woven.moved(piece, this.#spot(piece).point));
  }

  /** A station of a piece, or its middle one. @param {number} piece */
  #spot(piece, station = -1) {
    return this.woven.strips.spots[piece][station < 0 ? this.plan.pieces[piece].stations.length >> 1 : station];
  }

  /**
   * Draw the numbers of the pieces instead of their colours; return what reads them, bottom row
   * first.
   *
   * @param {number} width
   * @param {number} height
   */
  #numbered(width, height) {
    const { renderer } = this.stage, { woven, former, table } = this, pixels = new Uint8Array(4 * width * height);
    const target = new THREE.WebGLRenderTarget(width, height);
    woven.number(true);
    woven.reach(woven.seen());
    table.visible = false;
    // A former hides what is behind it, and has no number.
    former.visible = this.#formed;
    former.show(false);
    renderer.setRenderTarget(target);
    renderer.setClearColor(0x000000, 0);
    renderer.clear();
    renderer.render(this.#scene, this.camera.lens);
    renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
    renderer.setRenderTarget(null);
    renderer.setClearColor(woven.uniforms.paper.value, 1);
    woven.number(false);
    former.show(true);
    target.dispose();
    return (/** @type {number} */ k) => pixels[4 * k] + 256 * pixels[4 * k + 1] + 65536 * pixels[4 * k + 2] - 1;
  }

  /**
   * The piece that is seen at a place of the canvas, and the point of it; null for none.
   *
   * @param {number} x
   * @param {number} y
   */
  #touch(x, y) {
    const caster = casterAt(this.stage.canvas, this.camera.lens, x, y), hit = this.woven.touch(caster.ray);
    const [board] = this.#formed ? caster.intersectObjects(this.former.boards, false) : [];
    return hit && board && board.distance < hit.point.distanceTo(caster.ray.origin) ? null : hit;
  }

  /**
   * The piece that is seen at a place of the canvas; -1 for none.
   *
   * @param {number} x
   * @param {number} y
   */
  pick(x, y) {
    return this.#touch(x, y)?.piece ?? -1;
  }

  /** @type {import("./tags.js").OnScreen} */
  #onScreen = (piece, point) => placeOf(this.stage.canvas, this.camera.lens, this.woven.moved(piece, point));

  /** Find for every label a place where its piece is seen; return what says how much of a piece is. */
  #placeLabels() {
    const { clientWidth, clientHeight } = this.stage.canvas, { spots } = this.woven.strips;
    const width = Math.max(2, clientWidth >> 1), height = Math.max(2, clientHeight >> 1);
    const owner = this.#wanted.length || this.#sought >= 0 ? this.#numbered(width, height) : () => -1;
    const seen = (/** @type {number} */ x, /** @type {number} */ y) => {
      const [column, row] = [Math.floor(x / 2), height - 1 - Math.floor(y / 2)];
      return column >= 0 && column < width && row >= 0 && row < height ? owner(row * width + column) : -1;
    };
    this.#anchors = placeTags(this.#wanted, spots, seen, this.#onScreen);
    return (/** @type {number} */ piece) =>
      seenSpots(piece, spots, seen, this.#onScreen).length / spots[piece].length;
  }

  /**
   * Write what stands over the picture: labels, and a ring about the marked station.
   *
   * @param {HTMLCanvasElement} sheet
   */
  #write(sheet, scale = window.devicePixelRatio || 1) {
    const brush = /** @type {CanvasRenderingContext2D} */ (sheet.getContext("2d")), { canvas } = this.stage;
    if (sheet === this.over) {
      sheet.width = Math.round(canvas.clientWidth * scale);
      sheet.height = Math.round(canvas.clientHeight * scale);
    }
    brush.scale(scale, scale);
    writeTags(brush, this.#anchors, this.#onScreen);
    if (this.#mark) ringPoint(brush, this.#onScreen(...this.#mark));
  }

  /**
   * Show pieces: one code for each; labels in order of weight; a station ringed.
   *
   * @param {number[]} codes
   * @param {Label[]} labels
   * @param {[number, number] | null} station
   */
  show(codes, labels, station) {
    const changed = this.woven.show(codes), kept = new Set(labels.map(({ piece }) => piece));
    this.#wanted = labels;
    this.#anchors = this.#anchors.filter(({ piece }) => kept.has(piece));
    this.#mark = station && [station[0], this.#spot(...station).point];
    // Nothing moved: it is enough to draw what looks another way, unless something goes away.
    if (changed.some((piece) => codes[piece] === HIDDEN || codes[piece] === LATER)) this.#fresh = null;
    else if (this.#fresh && changed.length) this.#fresh = joined(this.#fresh, this.woven.rangeOf(changed));
    this.stage.request();
  }

  /** @param {string | number | THREE.Color} colour */
  paper(colour) {
    const { paper } = this.woven.uniforms;
    paper.value.set(colour);
    this.stage.renderer.setClearColor(paper.value, 1);
    this.#drawAll();
  }

  /**
   * Turn a piece to the eye if it looks away or, once that is known, if it is hidden.
   *
   * @param {number} piece
   * @param {number} station
   */
  face(piece, station) {
    const { normal, point } = this.#spot(piece, station);
    [this.#sought, this.#enough] = [piece, SEEN];
    if (this.camera.towards().dot(normal) < 0.3) this.camera.face(normal, this.woven.moved(piece, point));
  }

  /**
   * See a piece from an azimuth and an elevation, or from elsewhere if nothing of it shows there.
   *
   * @param {number} piece
   * @param {number[]} viewDeg
   */
  follow(piece, viewDeg) {
    [this.#sought, this.#enough] = [piece, 1e-9];
    this.camera.look(viewDeg, this.#spot(piece).point.clone());
  }

  /**
   * Show what is in place as strong as this, and what is to come; both from 0 to 1.
   *
   * @param {number} there
   * @param {number} later
   */
  ghost(there, later) {
    const { uniforms } = this.woven;
    [uniforms.there.value, this.#veil] = [there, later];
    uniforms.later.value = this.#standing ? Math.max(later, GHOST) : later;
    this.#drawAll();
  }

  /**
   * Show the table with what is to come as a ghost, and the former, or not.
   *
   * @param {boolean} on
   * @param {boolean} inside
   */
  stand(on, inside) {
    if (on === this.#standing && inside === this.#formed) return;
    [this.#standing, this.#formed] = [on, inside];
    this.ghost(this.woven.uniforms.there.value, this.#veil);
  }

  /** Colour pieces. @param {import("./colours.js").Colouring["runs"]} runs */
  colour(runs) {
    this.woven.colour(runs);
    this.#drawAll();
  }

  /** Move pieces apart by so much of their way from the middle. @param {number} by */
  spread(by) {
    this.woven.uniforms.spread.value = by;
    this.camera.spread(by);
  }

  /**
   * Cut off a share of the object, from the side that is seen when the cut begins.
   *
   * @param {number} share
   */
  cut(share) {
    const { cut, spread } = this.woven.uniforms, { ball } = this.woven.strips, { value } = cut;
    if (share && value.w === UNCUT) [value.x, value.y, value.z] = this.camera.towards().toArray();
    const reach = ball.radius * (1 + spread.value), normal = new THREE.Vector3(value.x, value.y, value.z);
    value.w = share ? ball.center.dot(normal) + reach * (1 - 2 * share) : UNCUT;
    this.#drawAll();
  }

  /** Show the object let go: so many times as far as it goes. @param {number} times */
  letGo(times) {
    this.woven.uniforms.gone.value = times;
    this.#drawAll();
  }

  /** Let it move as it does most easily, slowly, or stand still. @param {boolean} on */
  sway(on) {
    const begun = performance.now(), { swing } = this.woven.uniforms, { ball } = this.woven.strips;
    cancelAnimationFrame(this.#swaying);
    const move = (/** @type {number} */ now) => {
      swing.value = on ? SWING * ball.radius * Math.sin((now - begun) / SWING_MS) : 0;
      this.#drawAll();
      if (on) this.#swaying = requestAnimationFrame(move);
    };
    move(begun);
  }

  /**
   * Let the pieces of a step fly to their places, unless motion is not wanted.
   *
   * @param {Values} step
   * @param {number[]} pieces
   */
  fly(step, pieces) {
    if (this.#landing) this.#landing();
    if (this.#calm() || !pieces.length) return;
    const { strips, geometry } = this.woven;
    this.#landing = flyIn(strips, this.plan, step, pieces, (moving) => {
      geometry.attributes.position.needsUpdate = true;
      if (!moving) this.#landing = null;
      this.#drawAll();
    });
  }

  /**
   * A picture of what is seen, on white, as wide as so many pixels; drawn before it returns.
   *
   * @param {number} wide
   */
  picture(wide) {
    const { stage } = this, { canvas, renderer } = stage, kept = renderer.getPixelRatio();
    if (!canvas.clientWidth) return "";
    const ratio = Math.max(1, wide / canvas.clientWidth), paper = this.woven.uniforms.paper.value.clone();
    this.paper(0xffffff);
    renderer.setPixelRatio(ratio);
    this.#paint();
    const sheet = stage.copy(canvas.width);
    this.#placeLabels();
    this.#write(sheet, ratio);
    renderer.setPixelRatio(kept);
    this.paper(paper);
    return sheet.toDataURL("image/png");
  }
}
