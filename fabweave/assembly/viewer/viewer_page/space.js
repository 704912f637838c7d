/** How a strip is shown. */
const HIDDEN = 0, PLAIN = 1, FADED = 2, FRESH = 3, CHOSEN = 4;

const STRIP_VERTEX = `
attribute float piece, across, along, dip;
attribute vec3 tint;
uniform sampler2D states;
uniform vec2 size;
varying vec4 vState;
varying vec3 vNormal, vTint;
varying float vAcross, vAlong, vDip, vPiece;
void main() {
  vState = texture2D(states, (vec2(mod(piece, size.x), floor(piece / size.x)) + 0.5) / size);
  vNormal = normalMatrix * normal;
  vTint = tint;
  vAcross = across; vAlong = along; vDip = dip; vPiece = piece;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  if (vState.a < 0.1) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}`;

// Where a strip dives under another it is darker, as in the shade of the one above; from behind,
// the other way round.
const STRIP_FRAGMENT = `
uniform vec3 paper;
uniform float pitch;
varying vec4 vState;
varying vec3 vNormal, vTint;
varying float vAcross, vAlong, vDip;
void main() {
  float code = floor(vState.a * 5.1 + 0.5);
  float side = gl_FrontFacing ? 1.0 : -1.0;
  float lit = max(dot(normalize(vNormal) * side, normalize(vec3(-0.35, 0.5, 0.8))), 0.0);
  float below = max(0.0, -side * vDip);
  vec3 colour = vTint * (0.58 + 0.45 * lit) * (1.0 - (code > 2.5 ? 0.2 : 0.5) * below * below);
  if (side < 0.0) colour = mix(colour, vec3(dot(colour, vec3(0.3, 0.6, 0.1))), 0.35) * 0.8;
  float middle = abs(vAcross - 0.5) * 2.0;
  if (code == 2.0) colour = mix(paper, colour, 0.32);
  if (code == 4.0) {
    // Chevrons point along the thread.
    float wave = fract(vAlong / pitch + middle * 0.3);
    colour = mix(colour, vec3(1.0), 0.85 * (1.0 - smoothstep(0.30, 0.34, wave)) * smoothstep(0.0, 0.04, wave));
  }
  float rim = code > 2.5 ? 0.16 : 0.08, soft = max(fwidth(middle), 1e-4);
  float line = smoothstep(1.0 - rim - 0.5 * soft, 1.0 - rim + 0.5 * soft, middle) * clamp(rim / soft, 0.0, 1.0);
  colour = mix(colour, code > 2.5 ? vec3(0.04) : colour * 0.45, line);
  gl_FragColor = vec4(colour, 1.0);
}`;

const NUMBER_FRAGMENT = `
varying float vPiece;
void main() {
  float n = floor(vPiece + 0.5) + 1.0;
  gl_FragColor = vec4(mod(n, 256.0), mod(floor(n / 256.0), 256.0), floor(n / 65536.0), 255.0) / 255.0;
}`;

/** Red, green and blue of a colour such as #0072b2. */
function rgbOf(colour) {
  const rgb = parseInt(colour.slice(1), 16);
  return [rgb >> 16, (rgb >> 8) & 255, rgb & 255];
}

/** Build every piece's strip: corners, normals, and what the shaders want to know. */
function readStrips(space, plan) {
  const bytes = (text) => Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));
  const packed = bytes(space.rungs), fromRight = bytes(space.from_right);
  const raw = new DataView(packed.buffer);
  const rungs = fromRight.length, corners = new Float32Array(rungs * 6);
  for (let k = 0; k < corners.length; k++) corners[k] = space.origin_mm[k % 3] + space.step_mm * raw.getUint16(2 * k, true);
  const made = {
    position: corners, normal: new Float32Array(rungs * 6), piece: new Float32Array(rungs * 2),
    across: new Float32Array(rungs * 2), along: new Float32Array(rungs * 2), dip: new Float32Array(rungs * 2),
    tint: new Float32Array(rungs * 6),
  };
  const quads = [], spots = [];
  const right = new THREE.Vector3(), left = new THREE.Vector3(), way = new THREE.Vector3();
  const middle = (rung) => {
    right.fromArray(corners, 6 * rung);
    return left.fromArray(corners, 6 * rung + 3).add(right).multiplyScalar(0.5).clone();
  };
  // Colours change where a strand lies below another.
  const tints = plan.data.colours.flat().flatMap(([colour, count]) => Array(2 * count).fill(rgbOf(colour)));
  made.tint.set(tints.flat().map((part) => part / 255));
  let first = 0;
  space.counts.forEach((count, number) => {
    const piece = plan.pieces[number], panels = space.panels[number], last = first + count - 1;
    const middles = Array.from({ length: count }, (_, k) => middle(first + k)), triangles = [];
    quads.push(triangles);
    let run = 0;
    for (let k = 0; k < count; k++) {
      const rung = first + k;
      if (k) run += middles[k].distanceTo(middles[k - 1]);
      way.subVectors(middles[Math.min(k + 1, count - 1)], middles[Math.max(k - 1, 0)]);
      right.fromArray(corners, 6 * rung);
      const normal = left.fromArray(corners, 6 * rung + 3).sub(right).cross(way).negate().normalize();
      for (const end of [0, 1]) {
        normal.toArray(made.normal, 6 * rung + 3 * end);
        made.piece[2 * rung + end] = number;
        made.across[2 * rung + end] = end;
        made.along[2 * rung + end] = run;
      }
      if (rung === last) break;
      const [a, b, c, d] = [2 * rung, 2 * rung + 2, 2 * rung + 3, 2 * rung + 1];
      triangles.push(...(fromRight[rung] ? [a, c, d, a, b, c] : [a, b, d, b, c, d]));
    }
    // How far the strip is over (1) or under (-1), from panel to panel.
    const height = new Float32Array(count);
    panels.forEach((at, k) => {
      const here = piece.stations[k].over ? 1 : -1;
      height[at] = height[at + 1] = here;
      const next = panels[k + 1];
      if (next === undefined) return;
      const there = piece.stations[k + 1].over ? 1 : -1, start = made.along[2 * (first + at + 1)];
      const length = made.along[2 * (first + next)] - start;
      for (let j = at + 2; j < next; j++) height[j] = here + ((there - here) * (made.along[2 * (first + j)] - start)) / length;
    });
    height.forEach((value, k) => made.dip.fill(value, 2 * (first + k), 2 * (first + k) + 2));
    // The two layers of a lap lie on one another, not in one another.
    const lift = (at, by) => {
      for (const rung of [first + at, first + at + 1])
        for (let k = 6 * rung; k < 6 * rung + 6; k++) corners[k] += by * made.normal[k];
    };
    // Of several materials each thread has its own thickness.
    const layer = Array.isArray(space.layer_mm) ? space.layer_mm[piece.thread] : space.layer_mm;
    if (piece.joints[0] !== null) lift(panels[0], layer / 2);
    if (piece.joints[1] !== null) lift(panels[panels.length - 1], -layer / 2);
    // Where a label may stand, and which way the strip looks there: on panels, then between them.
    const places = panels.concat(panels.slice(1).map((next, k) => (panels[k] + next) >> 1));
    spots.push(places.map((at) => ({
      point: middles[at].clone().lerp(middles[Math.min(at + 1, count - 1)], 0.5),
      normal: new THREE.Vector3().fromArray(made.normal, 6 * (first + at)),
    })));
    first += count;
  });
  // Triangles in the order in which pieces come: what is there at a step is the first so many.
  const order = plan.pieces.map((_, piece) => piece).sort((a, b) => plan.stepOf[a] - plan.stepOf[b]);
  const index = order.flatMap((piece) => quads[piece]), range = [];
  order.reduce((start, piece) => {
    range[piece] = [start, start + quads[piece].length];
    return range[piece][1];
  }, 0);
  return { made, index, range, spots };
}

/** Whether this browser draws in software, where smooth edges take longer than all the rest. */
function drawsInSoftware() {
  const brush = document.createElement("canvas").getContext("webgl");
  const told = brush && brush.getExtension("WEBGL_debug_renderer_info");
  return Boolean(told) && /swiftshader|llvmpipe|softpipe|software|basic render/i.test(brush.getParameter(told.UNMASKED_RENDERER_WEBGL));
}

/** Show the woven object; null where the browser has no WebGL. */
function makeSpace(canvas, over, plan, tell) {
  if (typeof THREE === "undefined") return null;
  let renderer;
  const slow = drawsInSoftware();
  const quiet = console.error;
  try {
    console.error = () => {}; // three.js reports a missing WebGL as an error, and then throws it
    renderer = new THREE.WebGLRenderer({ canvas, antialias: !slow, preserveDrawingBuffer: true });
  } catch (error) {
    return null;
  } finally {
    console.error = quiet;
  }
  const { made, index, range, spots } = readStrips(plan.data.space, plan);
  const geometry = new THREE.BufferGeometry();
  for (const [name, values] of Object.entries(made))
    geometry.setAttribute(name, new THREE.BufferAttribute(values, values.length / made.piece.length));
  geometry.setIndex(index);
  geometry.computeBoundingSphere();
  const wide = 256, high = Math.ceil(plan.pieces.length / wide);
  const table = new Uint8Array(wide * high * 4);
  const states = new THREE.DataTexture(table, wide, high, THREE.RGBAFormat, THREE.UnsignedByteType);
  const uniforms = {
    states: { value: states }, size: { value: new THREE.Vector2(wide, high) },
    paper: { value: new THREE.Color(0xffffff) }, pitch: { value: 1 },
  };
  const shader = (fragmentShader) => new THREE.ShaderMaterial({
    uniforms, vertexShader: STRIP_VERTEX, fragmentShader, side: THREE.DoubleSide, extensions: { derivatives: true },
  });
  const shown = shader(STRIP_FRAGMENT), numbers = shader(NUMBER_FRAGMENT);
  const mesh = new THREE.Mesh(geometry, shown);
  mesh.frustumCulled = false;
  const scene = new THREE.Scene().add(mesh);
  // Chevrons are about as long as a strip is wide.
  const widths = Array.from({ length: 64 }, (_, k) => {
    const at = 6 * Math.floor(((k + 0.5) / 64) * (made.position.length / 6));
    return new THREE.Vector3().fromArray(made.position, at).distanceTo(new THREE.Vector3().fromArray(made.position, at + 3));
  }).sort((a, b) => a - b);
  uniforms.pitch.value = 0.8 * widths[32];

  // A few hundred points stand for all where the whole must be kept in view.
  const every = Math.ceil(spots.length / 400);
  const outer = spots.filter((_, k) => k % every === 0).flatMap((places) => places.map(({ point }) => point));

  let drawn = 0, rest = 0, anchors = [], wanted = [], mark = null;
  // How pieces were shown last, and the triangles that must be drawn over what is seen; null: all.
  let before = plan.pieces.map(() => HIDDEN), fresh = null;
  const camera = makeCamera(canvas, geometry.boundingSphere, outer, plan.data.view_deg, {
    slow, changed: drawAll,
    tapped: (x, y) => tell.chosen(pick(x, y)),
  });

  function drawAll() {
    fresh = null;
    draw();
  }

  function draw() {
    if (!drawn) drawn = requestAnimationFrame(drawNow);
  }

  function drawNow() {
    cancelAnimationFrame(drawn);
    drawn = 0;
    renderer.autoClear = !fresh;
    reach(fresh || seen());
    renderer.render(scene, camera.lens);
    renderer.autoClear = true;
    fresh = [0, 0];
    write();
    clearTimeout(rest);
    rest = setTimeout(() => { place(); write(); }, 160);
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
    if (full) camera.lens.clearViewOffset();
    target.dispose();
    return (k) => pixels[4 * k] + 256 * pixels[4 * k + 1] + 65536 * pixels[4 * k + 2] - 1;
  }

  /** The piece that is seen at a point of the canvas; -1 for none. */
  function pick(x, y) {
    return numbered(1, 1, x, y, [canvas.clientWidth, canvas.clientHeight])(0);
  }

  function onScreen(point) {
    const seen = point.clone().project(camera.lens);
    return { x: ((seen.x + 1) / 2) * canvas.clientWidth, y: ((1 - seen.y) / 2) * canvas.clientHeight };
  }

  /** Find for every label a place where its piece is seen. */
  function place() {
    const width = Math.max(2, canvas.clientWidth >> 1), height = Math.max(2, canvas.clientHeight >> 1);
    const at = wanted.length ? numbered(width, height) : null;
    anchors = wanted.flatMap((label) => {
      const seen = spots[label.piece].map((spot) => ({ spot, ...onScreen(spot.point) })).filter(({ x, y }) => {
        const [column, row] = [Math.floor(x / 2), height - 1 - Math.floor(y / 2)];
        return column >= 0 && column < width && row >= 0 && row < height && at(row * width + column) === label.piece;
      });
      if (!seen.length) return [];
      const middle = seen.reduce((sum, { x, y }) => [sum[0] + x / seen.length, sum[1] + y / seen.length], [0, 0]);
      seen.sort((a, b) => Math.hypot(a.x - middle[0], a.y - middle[1]) - Math.hypot(b.x - middle[0], b.y - middle[1]));
      return [{ ...label, point: seen[0].spot.point }];
    });
  }

  /** Write labels, the first ones first, none over another; and ring the marked station. */
  function write() {
    const scale = window.devicePixelRatio || 1, brush = over.getContext("2d");
    over.width = Math.round(canvas.clientWidth * scale);
    over.height = Math.round(canvas.clientHeight * scale);
    brush.scale(scale, scale);
    const taken = [];
    for (const { text, strong, point } of anchors) {
      const { x, y } = onScreen(point);
      brush.font = `${strong ? "bold 15px" : "12px"} system-ui, sans-serif`;
      const half = brush.measureText(text).width / 2 + 4, tall = strong ? 11 : 8;
      if (taken.some((other) => Math.abs(other.x - x) < other.half + half && Math.abs(other.y - y) < other.tall + tall)) continue;
      taken.push({ x, y, half, tall });
      brush.fillStyle = strong ? "#111" : "rgba(255, 255, 255, 0.88)";
      brush.beginPath();
      brush.roundRect(x - half, y - tall, 2 * half, 2 * tall, 4);
      brush.fill();
      brush.fillStyle = strong ? "#fff" : "#111";
      brush.textAlign = "center";
      brush.textBaseline = "middle";
      brush.fillText(text, x, y + 0.5);
    }
    if (!mark) return;
    const { x, y } = onScreen(mark);
    for (const [line, ink] of [[6, "#fff"], [3, "#111"]]) {
      brush.lineWidth = line;
      brush.strokeStyle = ink;
      brush.beginPath();
      brush.arc(x, y, 13, 0, 2 * Math.PI);
      brush.stroke();
    }
  }

  function resize() {
    const { clientWidth: width, clientHeight: height } = canvas.parentElement;
    if (!width || !height) return;
    renderer.setPixelRatio(slow ? 1 : Math.min(window.devicePixelRatio || 1, 2));
    renderer.setSize(width, height, false);
    camera.resize(width, height);
    drawAll();
  }
  new ResizeObserver(resize).observe(canvas.parentElement);

  return {
    home: camera.home, lens: camera.lens,
    /** Show pieces: one code for each; labels in order of weight; a station ringed. */
    show(codes, labels, station) {
      codes.forEach((code, piece) => {
        table.set([0, 0, 0, 50 * code], 4 * piece);
      });
      states.needsUpdate = true;
      wanted = labels;
      anchors = anchors.filter((anchor) => labels.some((label) => label.piece === anchor.piece));
      mark = station ? spots[station[0]][station[1]].point : null;
      // Nothing moved: it is enough to draw what looks another way, unless something goes away.
      const changed = codes.flatMap((code, piece) => (code === before[piece] ? [] : [piece]));
      if (changed.some((piece) => codes[piece] === HIDDEN)) fresh = null;
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
      drawNow();
    },
    /** Turn a piece, or one station of it, to the eye unless it looks there already. */
    face(piece, station) {
      const spot = spots[piece][station < 0 ? plan.pieces[piece].stations.length >> 1 : station];
      const eye = camera.lens.position.clone().sub(spot.point).normalize();
      if (eye.dot(spot.normal) < 0.5) camera.face(spot.normal);
    },
  };
}
