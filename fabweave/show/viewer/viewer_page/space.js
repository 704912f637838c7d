/** Software draws this many triangles in a frame that is short enough for motion. */
const MOST_MOVED = 120000;
/** Pixels of a still picture for each of the screen, along both, where nothing else smooths edges. */
const FINE = 2;
/** The cut that nothing lies beyond. */
const UNCUT = 1e9;
/** A piece is seen well enough if so much of it is. */
const SEEN = 0.45;
/** Views are compared in pictures of this size, for no longer than this. */
const GLIMPSE = [150, 110], GLIMPSES_MS = 500;
/** How far an object sways, as a share of its radius, and milliseconds for a radian. */
const SWING = 0.08, SWING_MS = 700;
/** The radius of the table by that of the object; so many squares go from its middle to its edge. */
const TABLE = 1.1, SQUARES = 5;
/** While the table is seen, the finished object is a veil as dense as this at least. */
const GHOST = 0.125;
/** When nothing has changed for so long, labels are placed and edges are smoothed. */
const REST_MS = 160;

/** Whether this browser draws in software, where smooth edges take longer than all the rest. */
function drawsInSoftware() {
  const brush = document.createElement("canvas").getContext("webgl");
  const told = brush && brush.getExtension("WEBGL_debug_renderer_info");
  return Boolean(told) && /swiftshader|llvmpipe|softpipe|software|basic render/i.test(brush.getParameter(told.UNMASKED_RENDERER_WEBGL));
}

/** What draws; null where the browser has no WebGL 2. */
function makeRenderer(canvas, slow) {
  const quiet = console.error;
  try {
    console.error = () => {}; // three.js reports a missing WebGL as an error, and then throws it
    // Colours are what screens show, and our shaders reckon with them as they are.
    THREE.ColorManagement.enabled = false;
    const renderer = new THREE.WebGLRenderer({ canvas, antialias: !slow, preserveDrawingBuffer: true });
    renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    return renderer;
  } catch (error) {
    return null;
  } finally {
    console.error = quiet;
  }
}

/** The lines of a round table that the finished object stands on: its edge, and those of its squares. */
function makeTable(corners) {
  const box = new THREE.Box3().setFromArray(corners), middle = box.getCenter(new THREE.Vector3()).setZ(box.min.z), ends = [];
  let radius = 0;
  for (let k = 0; k < corners.length; k += 3) radius = Math.max(radius, TABLE * Math.hypot(corners[k] - middle.x, corners[k + 1] - middle.y));
  const line = (...places) => places.forEach(([x, y]) => ends.push(radius * x, radius * y, 0));
  for (let k = 1 - SQUARES; k < SQUARES; k++) {
    const at = k / SQUARES, half = Math.sqrt(1 - at * at);
    line([at, -half], [at, half], [-half, at], [half, at]);
  }
  const rim = (k) => [Math.cos((k * Math.PI) / 60), Math.sin((k * Math.PI) / 60)];
  for (let k = 0; k < 120; k++) line(rim(k), rim(k + 1));
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(ends), 3));
  const table = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: 0x999999 }));
  table.position.copy(middle);
  return table;
}

/** The plates of a former, thin as paper: outlines with holes, each in its plane. */
function makeFormer(plates) {
  const group = new THREE.Group();
  const board = new THREE.MeshBasicMaterial({ color: 0xf6f0e4, side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
  const edge = new THREE.LineBasicMaterial({ color: 0xb5a68c });
  group.userData = [board, edge];
  for (const { origin, axes, rings } of plates) {
    const [right, up] = axes.map((axis) => new THREE.Vector3(...axis)), paths = rings.map((ring) => ring.map(([x, y]) => new THREE.Vector2(x, y)));
    const shape = new THREE.Shape(paths[0]), plate = new THREE.Group();
    shape.holes = paths.slice(1).map((path) => new THREE.Path(path));
    plate.add(new THREE.Mesh(new THREE.ShapeGeometry(shape), board));
    for (const path of paths) plate.add(new THREE.LineLoop(new THREE.BufferGeometry().setFromPoints(path), edge));
    plate.applyMatrix4(new THREE.Matrix4().makeBasis(right, up, new THREE.Vector3().crossVectors(right, up)).setPosition(...origin));
    group.add(plate);
  }
  return group;
}

/** Show the woven object; null where the browser has no WebGL. */
function makeSpace(canvas, over, plan, tell) {
  const slow = drawsInSoftware(), renderer = makeRenderer(canvas, slow);
  if (!renderer) return null;
  const strips = readStrips(plan.data.space, plan), { made, index, range, spots, ball, centres } = strips;
  const geometry = new THREE.BufferGeometry();
  for (const [name, values] of Object.entries(made))
    geometry.setAttribute(name, new THREE.BufferAttribute(values, values.length / made.piece.length));
  geometry.setIndex(index);
  const rows = new Uint8Array(256 * Math.ceil(plan.pieces.length / 256) * 4);
  const states = new THREE.DataTexture(rows, 256, rows.length / 1024, THREE.RGBAFormat, THREE.UnsignedByteType);
  const uniforms = {
    states: { value: states }, size: { value: new THREE.Vector2(256, rows.length / 1024) },
    paper: { value: new THREE.Color(0xffffff) }, there: { value: THERE }, later: { value: 0 }, spread: { value: 0 }, gone: { value: 0 }, swing: { value: 0 }, cut: { value: new THREE.Vector4(0, 0, 1, UNCUT) },
    // Chevrons are about as long as a strip is wide.
    pitch: { value: 0.8 * usualWidth(made.position) },
  };
  const shader = (fragmentShader) => new THREE.ShaderMaterial({
    uniforms, vertexShader: STRIP_VERTEX, fragmentShader, side: THREE.DoubleSide,
  });
  const shown = shader(STRIP_FRAGMENT), numbers = shader(NUMBER_FRAGMENT);
  const mesh = new THREE.Mesh(geometry, shown);
  mesh.frustumCulled = false;
  const table = makeTable(made.position), former = makeFormer(plan.data.former.plates);
  const scene = new THREE.Scene().add(mesh, table, former);
  // Whether the table is to be seen, the former, and how dense is asked for what is to come.
  let standing = false, formed = false, veil = 0;

  // A few hundred points stand for all where the whole must be kept in view.
  const every = Math.ceil(spots.length / 400);
  const outer = spots.filter((_, k) => k % every === 0).flatMap((places) => places.map(({ point }) => point));

  let drawn = 0, rest = 0, swaying = 0, anchors = [], wanted = [], mark = null, landing = null;
  // The piece that is to be seen, and how much of it is enough.
  let sought = -1, enough = SEEN;
  // How pieces were shown last, and the triangles that must be drawn over what is seen; null: all.
  let before = plan.pieces.map(() => HIDDEN), fresh = null;
  const camera = makeCamera(canvas, ball, outer, plan.data.view_deg, {
    calm, changed: drawAll, touched, rest: (words) => tell.seen(words),
    tapped: (x, y) => tell.chosen(pick(x, y)),
  });

  /** Whether things should be in their places at once. */
  function calm() {
    return matchMedia("(prefers-reduced-motion: reduce)").matches || (slow && seen()[1] > 3 * MOST_MOVED);
  }

  function drawAll() {
    fresh = null;
    draw();
  }

  function draw() {
    if (!drawn) drawn = requestAnimationFrame(() => drawNow(false));
  }

  /** Draw what is not drawn yet; all of it in fine pixels where that is asked for. */
  function drawNow(fine) {
    cancelAnimationFrame(drawn);
    drawn = 0;
    // While things move, and software draws, pixels are coarse.
    if (slow && (fine || !fresh)) sharpen(fine ? FINE : 1);
    paint();
    fresh = [0, 0];
    write(over);
    clearTimeout(rest);
    rest = setTimeout(settle, REST_MS);
  }

  function sharpen(ratio) {
    if (renderer.getPixelRatio() === ratio) return;
    renderer.setPixelRatio(ratio);
    fresh = null;
  }

  function paint() {
    renderer.autoClear = !fresh;
    reach(fresh || seen());
    // Where only what changed is drawn, the table stands there already; from below it would hide the object.
    table.visible = standing && !fresh && camera.towards().z > 0;
    former.visible = formed && !fresh;
    renderer.render(scene, camera.lens);
    renderer.autoClear = true;
  }

  /** Once nothing moves: smooth edges, labels where their pieces are seen, and a hidden piece turned up. */
  function settle() {
    if (landing) return;
    if (slow && renderer.getPixelRatio() !== FINE) {
      sharpen(FINE);
      paint();
      fresh = [0, 0];
    }
    const share = place();
    write(over);
    const hidden = sought >= 0 && share(sought) < enough ? sought : -1;
    sought = -1;
    if (hidden >= 0) turnToSee(hidden);
  }

  /** Turn to where most of a piece is seen, of as many views as there is time for, the nearest first. */
  function turnToSee(piece) {
    const at = camera.towards(), views = [], until = performance.now() + GLIMPSES_MS;
    for (const rise of [-0.9, -0.3, 0.3, 0.9])
      for (let k = 0; k < 8; k++) views.push(new THREE.Vector3(Math.cos(rise) * Math.cos((k * Math.PI) / 4), Math.cos(rise) * Math.sin((k * Math.PI) / 4), Math.sin(rise)));
    views.sort((a, b) => b.dot(at) - a.dot(at)).unshift(at);
    const seen = [];
    for (const view of views) {
      if (performance.now() > until) break;
      seen.push(camera.glimpse(view, () => {
        const owner = numbered(...GLIMPSE);
        let pixels = 0;
        for (let k = 0; k < GLIMPSE[0] * GLIMPSE[1]; k++) pixels += owner(k) === piece;
        return pixels;
      }));
    }
    // Of views that are nearly as good the nearest one is taken: it turns least.
    const best = views[seen.findIndex((pixels) => pixels >= 0.8 * Math.max(...seen))];
    if (best !== at) camera.face(best, moved(piece, spots[piece][plan.pieces[piece].stations.length >> 1].point.clone()));
  }

  /** Let only a range of triangles be drawn. */
  function reach([start, end]) {
    geometry.setDrawRange(start, end - start);
  }

  /** The range of triangles of some pieces, and of those that come between them. */
  function rangeOf(pieces) {
    return pieces.reduce((all, piece) => joined(all, range[piece]), [0, 0]);
  }

  /** The range that reaches over two of them; an empty one is [0, 0]. */
  function joined(range, other) {
    return range[1] ? [Math.min(range[0], other[0]), Math.max(range[1], other[1])] : other;
  }

  /** The range of triangles of all that is shown. */
  function seen() {
    return [0, rangeOf(before.flatMap((code, piece) => (code === HIDDEN ? [] : [piece])))[1]];
  }

  /** Draw the numbers of the pieces instead of their colours, and return them, bottom row first. */
  function numbered(width, height, left, top, full) {
    const target = new THREE.WebGLRenderTarget(width, height);
    if (full) camera.lens.setViewOffset(full[0], full[1], left, top, width, height);
    mesh.material = numbers;
    table.visible = false;
    // A former hides what is behind it, and has no number.
    former.visible = formed;
    for (const material of former.userData) material.colorWrite = false;
    reach(seen());
    renderer.setRenderTarget(target);
    renderer.setClearColor(0x000000, 0);
    renderer.clear();
    renderer.render(scene, camera.lens);
    const pixels = new Uint8Array(4 * width * height);
    renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
    renderer.setRenderTarget(null);
    renderer.setClearColor(uniforms.paper.value, 1);
    mesh.material = shown;
    for (const material of former.userData) material.colorWrite = true;
    if (full) camera.lens.clearViewOffset();
    target.dispose();
    return (k) => pixels[4 * k] + 256 * pixels[4 * k + 1] + 65536 * pixels[4 * k + 2] - 1;
  }

  /** The piece that is seen at a point of the canvas; -1 for none. */
  function pick(x, y) {
    return numbered(1, 1, x, y, [canvas.clientWidth, canvas.clientHeight])(0);
  }

  /** The point of the object that is seen at a point of the canvas; null for none. */
  function touched(x, y) {
    const piece = pick(x, y);
    if (piece < 0) return null;
    const flat = new THREE.Vector3((2 * x) / canvas.clientWidth - 1, 1 - (2 * y) / canvas.clientHeight, -1);
    const origin = flat.clone().unproject(camera.lens), way = flat.setZ(1).unproject(camera.lens).sub(origin).normalize();
    const ray = new THREE.Ray(origin, way), hit = new THREE.Vector3(), { x: cx, y: cy, z: cz, w } = uniforms.cut.value;
    let best = null;
    for (let k = range[piece][0]; k < range[piece][1]; k += 3) {
      const corners = [0, 1, 2].map((corner) => moved(piece, new THREE.Vector3().fromArray(made.position, 3 * index[k + corner])));
      if (!ray.intersectTriangle(...corners, false, hit)) continue;
      if (before[piece] < FRESH && hit.dot(new THREE.Vector3(cx, cy, cz)) > w) continue;
      if (!best || hit.distanceToSquared(origin) < best.distanceToSquared(origin)) best = hit.clone();
    }
    return best;
  }

  /** Where a point of a piece is when pieces are moved apart. */
  function moved(piece, point) {
    return point.addScaledVector(centres[piece], uniforms.spread.value);
  }

  function onScreen(piece, point) {
    const seen = moved(piece, point.clone()).project(camera.lens);
    return { x: ((seen.x + 1) / 2) * canvas.clientWidth, y: ((1 - seen.y) / 2) * canvas.clientHeight };
  }

  /** Find for every label a place where its piece is seen; return what tells how much of a piece is. */
  function place() {
    const width = Math.max(2, canvas.clientWidth >> 1), height = Math.max(2, canvas.clientHeight >> 1);
    const at = wanted.length || sought >= 0 ? numbered(width, height) : null;
    const there = (x, y) => {
      const [column, row] = [Math.floor(x / 2), height - 1 - Math.floor(y / 2)];
      return column >= 0 && column < width && row >= 0 && row < height ? at(row * width + column) : -1;
    };
    anchors = placeTags(wanted, spots, there, onScreen);
    return (piece) => seenSpots(piece, spots, there, onScreen).length / spots[piece].length;
  }

  /** Write what stands over the picture: labels, and a ring about the marked station. */
  function write(sheet, scale = window.devicePixelRatio || 1) {
    const brush = sheet.getContext("2d");
    if (sheet === over) {
      over.width = Math.round(canvas.clientWidth * scale);
      over.height = Math.round(canvas.clientHeight * scale);
    }
    brush.scale(scale, scale);
    writeTags(brush, anchors, onScreen);
    if (mark) ringPoint(brush, onScreen(...mark));
  }

  function resize() {
    const { clientWidth: width, clientHeight: height } = canvas;
    if (!width || !height) return;
    renderer.setPixelRatio(slow ? 1 : Math.min(window.devicePixelRatio || 1, 2));
    renderer.setSize(width, height, false);
    camera.resize(width, height);
    drawAll();
  }
  new ResizeObserver(resize).observe(canvas);

  /** Turn a piece, or one station of it, to the eye unless it looks there nearly enough. */
  function turnTo(piece, station, enough) {
    const spot = spots[piece][station < 0 ? plan.pieces[piece].stations.length >> 1 : station];
    if (camera.towards().dot(spot.normal) < enough) camera.face(spot.normal, moved(piece, spot.point.clone()));
  }

  return {
    home: camera.home, move: camera.move, straighten: camera.straighten, pick,
    get lens() { return camera.lens; },
    /** Show pieces: one code for each; labels in order of weight; a station ringed. */
    show(codes, labels, station) {
      codes.forEach((code, piece) => {
        rows[4 * piece + 3] = 50 * code;
      });
      states.needsUpdate = true;
      wanted = labels;
      const kept = new Set(labels.map(({ piece }) => piece));
      anchors = anchors.filter(({ piece }) => kept.has(piece));
      mark = station ? [station[0], spots[station[0]][station[1]].point] : null;
      // Nothing moved: it is enough to draw what looks another way, unless something goes away.
      const changed = codes.flatMap((code, piece) => (code === before[piece] ? [] : [piece]));
      if (changed.some((piece) => codes[piece] === HIDDEN || codes[piece] === LATER)) fresh = null;
      else if (fresh && changed.length) fresh = joined(fresh, rangeOf(changed));
      before = codes;
      draw();
    },
    paper(colour) {
      uniforms.paper.value.set(colour);
      renderer.setClearColor(uniforms.paper.value, 1);
      drawAll();
    },
    /** Draw everything at once, not with the next picture of the screen. */
    draw() {
      fresh = null;
      drawNow(true);
    },
    /** Turn a piece to the eye if it looks away or, once that is known, if it is hidden. */
    face(piece, station) {
      [sought, enough] = [piece, SEEN];
      turnTo(piece, station, 0.3);
    },
    /** See a piece from an azimuth and an elevation, or from elsewhere if nothing of it shows there. */
    follow(piece, viewDeg) {
      [sought, enough] = [piece, 1e-9];
      camera.look(viewDeg, spots[piece][plan.pieces[piece].stations.length >> 1].point.clone());
    },
    /** Show what is in place as strong as this, and what is to come; both from 0 to 1. */
    ghost(there, later) {
      [uniforms.there.value, veil] = [there, later];
      uniforms.later.value = standing ? Math.max(veil, GHOST) : veil;
      drawAll();
    },
    /** Show the table with what is to come as a ghost, and the former, or not. */
    stand(on, inside) {
      if (on === standing && inside === formed) return;
      [standing, formed] = [on, inside];
      this.ghost(uniforms.there.value, veil);
    },
    /** Colour pieces: for each its colours, each with the number of rungs that have it. */
    colour(runs) {
      tintStrips(strips, runs);
      geometry.attributes.tint.needsUpdate = true;
      drawAll();
    },
    /** Move pieces apart by so much of their way from the middle. */
    spread(by) {
      uniforms.spread.value = by;
      camera.spread(by);
    },
    /** Cut off a share of the object, from the side that is seen when the cut begins. */
    cut(share) {
      const { value } = uniforms.cut;
      if (share && value.w === UNCUT) [value.x, value.y, value.z] = camera.towards().toArray();
      const reach = ball.radius * (1 + uniforms.spread.value), normal = new THREE.Vector3(value.x, value.y, value.z);
      value.w = share ? ball.center.dot(normal) + reach * (1 - 2 * share) : UNCUT;
      drawAll();
    },
    /** Show the object let go: so many times as far as it goes. */
    letGo(times) {
      uniforms.gone.value = times;
      drawAll();
    },
    /** Let it move as it does most easily, slowly, or stand still. */
    sway(on) {
      cancelAnimationFrame(swaying);
      const begun = performance.now();
      const swing = (now) => {
        uniforms.swing.value = on ? SWING * ball.radius * Math.sin((now - begun) / SWING_MS) : 0;
        drawAll();
        if (on) swaying = requestAnimationFrame(swing);
      };
      swing(begun);
    },
    /** Let the pieces of a step fly to their places, unless motion is not wanted. */
    fly(step, pieces) {
      if (landing) landing();
      if (calm() || !pieces.length) return;
      const attribute = geometry.attributes.position, corners = pieces.map((piece) => 6 * strips.firsts[piece]);
      const ends = pieces.map((piece) => 6 * (strips.firsts[piece] + strips.counts[piece]));
      const from = Math.min(...corners), count = Math.max(...ends) - from;
      landing = flyIn(strips, plan, step, pieces, (moving) => {
        attribute.updateRange = { offset: from, count };
        attribute.needsUpdate = true;
        if (!moving) landing = null;
        drawAll();
      });
    },
    /** A picture of what is seen, on white, as wide as so many pixels; drawn before it returns. */
    picture(wide) {
      if (!canvas.clientWidth) return "";
      const kept = [renderer.getPixelRatio(), uniforms.paper.value.getHex()], ratio = Math.max(1, wide / canvas.clientWidth);
      uniforms.paper.value.set(0xffffff);
      renderer.setClearColor(0xffffff, 1);
      renderer.setPixelRatio(ratio);
      fresh = null;
      paint();
      const sheet = document.createElement("canvas");
      [sheet.width, sheet.height] = [canvas.width, canvas.height];
      sheet.getContext("2d").drawImage(canvas, 0, 0);
      place();
      write(sheet, ratio);
      renderer.setPixelRatio(kept[0]);
      uniforms.paper.value.setHex(kept[1]);
      renderer.setClearColor(kept[1], 1);
      drawAll();
      return sheet.toDataURL("image/png");
    },
  };
}
