/** Shadow maps are so many pixels wide, where the browser has a graphics card and where it has none. */
const SHADOW = 2048, SHADOW_SLOW = 1024;
/** Where software draws, shadows and fine pixels come when nothing has moved for so long. */
const STILL_MS = 450;
/** Pixels of the moving picture for each of the screen, along both, where software draws. */
const COARSE = 0.6;
/** Strands are drawn so much of their usual distance above and below one another, as a share of their width. */
const LIFT = 0.07;
/** The arrow that points up, in radii of the object: from its middle to the tip, its head, how thick both are, and what is kept in view. */
const ARROW = { tip: 1.14, head: 0.13, thick: 0.008, wide: 0.035, room: 1.3 };

/** The object in space: drawn anew whenever something tells how it is. */
function makeScene(canvas, tell) {
  const slow = drawsInSoftware(), renderer = makeRenderer(canvas, slow);
  if (!renderer) return null;
  const ball = { center: new THREE.Vector3(), radius: 1 }, outer = [];
  const key = new THREE.Vector3(-0.45, -0.55, 0.75).normalize();
  const target = new THREE.WebGLRenderTarget(...Array(2).fill(slow ? SHADOW_SLOW : SHADOW));
  const shared = { toLight: { value: new THREE.Matrix4() }, depths: { value: target.texture }, shadowing: { value: 1 }, texel: { value: 1 / target.width }, lift: { value: 0 } };
  const uniforms = { ...shared, chosen: { value: -2 }, eye: { value: new THREE.Vector3() }, key: { value: key }, plain: { value: 0 } };
  const geometry = new THREE.BufferGeometry();
  const fabric = new THREE.ShaderMaterial({ uniforms, vertexShader: FABRIC_VERTEX, fragmentShader: FABRIC_FRAGMENT, side: THREE.DoubleSide });
  const depth = new THREE.ShaderMaterial({ uniforms: shared, vertexShader: DEPTH_VERTEX, fragmentShader: DEPTH_FRAGMENT, side: THREE.DoubleSide });
  const mesh = new THREE.Mesh(geometry, fabric);
  mesh.frustumCulled = false;
  const ground = { ...shared, middle: { value: new THREE.Vector3() }, reach: { value: 1 } };
  const floor = new THREE.Mesh(new THREE.CircleGeometry(1, 64), new THREE.ShaderMaterial({ uniforms: ground, vertexShader: FLOOR_VERTEX, fragmentShader: FLOOR_FRAGMENT, transparent: true, depthWrite: false }));
  const faces = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.35, side: THREE.DoubleSide, depthWrite: false }));
  const dots = new THREE.Points(new THREE.BufferGeometry(), new THREE.PointsMaterial({ size: 9, sizeAttenuation: false, vertexColors: true, depthTest: true }));
  faces.frustumCulled = dots.frustumCulled = false;
  faces.visible = dots.visible = false;
  const ink = new THREE.MeshBasicMaterial(), part = (geometry, from) => new THREE.Mesh(geometry.translate(0, from, 0), ink);
  const arrow = new THREE.Group().add(
    part(new THREE.CylinderGeometry(ARROW.thick, ARROW.thick, ARROW.tip - ARROW.head, 16), (ARROW.tip - ARROW.head) / 2),
    part(new THREE.ConeGeometry(ARROW.wide, ARROW.head, 24), ARROW.tip - ARROW.head / 2),
  );
  arrow.visible = false;
  const scene = new THREE.Scene().add(floor, mesh, faces, dots, arrow), shade = new THREE.Scene();
  const lamp = new THREE.OrthographicCamera();
  let drawn = 0, shadowed = false, shadowing = true, still = false, times = [], held = {}, rest = 0;
  const camera = makeCamera(canvas, ball, outer, [-60, 24], {
    calm: () => matchMedia("(prefers-reduced-motion: reduce)").matches,
    changed: move, touched: (x, y) => (touch(x, y) || {}).point || null, rest: () => {},
    tapped: (x, y) => tell.tapped(touch(x, y), x, y),
  });

  function draw() {
    if (!drawn) drawn = requestAnimationFrame(drawNow);
  }

  function drawNow() {
    drawn = 0;
    if (!geometry.index) return renderer.clear();
    shared.shadowing.value = shadowing && (!slow || still) ? 1 : 0;
    uniforms.plain.value = slow && !still ? 1 : 0;
    if (shared.shadowing.value && !shadowed) castShadows();
    uniforms.eye.value.copy(camera.lens.position);
    floor.visible = shared.shadowing.value && camera.towards().z > -0.05;
    const look = getComputedStyle(document.body);
    renderer.setClearColor(look.getPropertyValue("--paper").trim() || "#eee", 1);
    ink.color.set(look.getPropertyValue("--soft").trim() || "#666");
    renderer.render(scene, camera.lens);
    if (arrow.visible) tell.arrowAt(...seenAt(tip()));
    times.push(performance.now());
    if (times.length > 60) times.shift();
  }

  function sharpen(ratio) {
    if (renderer.getPixelRatio() !== ratio) renderer.setPixelRatio(ratio);
  }

  /** Where software draws: coarse pixels without shadows now, and all of it at rest. */
  function move() {
    if (slow) {
      still = false;
      sharpen(COARSE);
      clearTimeout(rest);
      rest = setTimeout(() => {
        still = true;
        sharpen(FINE);
        draw();
      }, STILL_MS);
    }
    draw();
  }

  /** Draw how far the key light reaches. */
  function castShadows() {
    const span = 1.05 * ball.radius, place = ball.center.clone().addScaledVector(key, 2 * span);
    Object.assign(lamp, { left: -span, right: span, top: span, bottom: -span, near: 0.5 * span, far: 4.5 * span });
    lamp.position.copy(place);
    lamp.up.set(0, 0, 1);
    lamp.lookAt(ball.center);
    lamp.updateProjectionMatrix();
    lamp.updateMatrixWorld();
    shared.toLight.value.multiplyMatrices(lamp.projectionMatrix, lamp.matrixWorldInverse);
    mesh.material = depth;
    shade.add(mesh);
    renderer.setRenderTarget(target);
    renderer.setClearColor(0xffffff, 1);
    renderer.clear();
    renderer.render(shade, lamp);
    renderer.setRenderTarget(null);
    mesh.material = fabric;
    scene.add(mesh);
    shadowed = true;
  }

  function attribute(name, array, size, normalized = false) {
    const old = geometry.attributes[name];
    if (old && old.array.length === array.length && old.array.constructor === array.constructor) {
      old.array.set(array);
      old.needsUpdate = true;
    } else geometry.setAttribute(name, new THREE.BufferAttribute(array, size, normalized));
  }

  /** Show an object: arrays as they come; triangles that are not sent are as they were. */
  function show(arrays, widthMm) {
    const { position, shade: looks, colour, index, owner } = arrays, count = position.length / 3;
    if (held.count !== count) for (const name of Object.keys(geometry.attributes)) geometry.deleteAttribute(name);
    held = { count, crossing: arrays.crossing };
    attribute("position", position, 3);
    attribute("shade", looks, 4, true);
    attribute("colour", colour, 3, true);
    if (owner) attribute("owner", Float32Array.from({ length: count }, (_, k) => owner[k >> 1]), 1);
    else attribute("owner", new Float32Array(count).fill(-9), 1);
    if (index && geometry.index && geometry.index.array.length === index.length) {
      geometry.index.array.set(index);
      geometry.index.needsUpdate = true;
    } else if (index) geometry.setIndex(new THREE.BufferAttribute(index, 1));
    const box = new THREE.Box3().setFromArray(position), grown = ball.radius;
    box.getCenter(ball.center);
    let most = 1e-9;
    outer.length = 0;
    for (let k = 0, every = 3 * Math.ceil(count / 400); k < position.length; k += every) {
      outer.push(new THREE.Vector3().fromArray(position, k));
      most = Math.max(most, outer[outer.length - 1].distanceTo(ball.center));
    }
    ball.radius = Math.max(most, box.getSize(new THREE.Vector3()).length() / 2);
    held.outer = outer.length;
    standArrow();
    shared.lift.value = LIFT * (widthMm || 0);
    floor.position.copy(ball.center).setZ(box.min.z);
    floor.scale.setScalar(2.4 * ball.radius);
    ground.middle.value.copy(floor.position);
    ground.reach.value = 2.4 * ball.radius;
    shadowed = false;
    if (grown !== ball.radius) camera.refit();
    else move();
  }

  /** Show the faces of the mesh, those that are left out in red; none without them. */
  function showFaces(arrays, left) {
    faces.visible = Boolean(arrays && arrays.face);
    if (!faces.visible) return draw();
    held.face = arrays.face;
    const at = arrays.face_position, tint = new Float32Array(at.length);
    for (let k = 0; k < arrays.face.length; k++) tint.set(Array(3).fill(left.has(arrays.face[k]) ? [0.8, 0.1, 0.1] : [0.3, 0.5, 0.8]).flat(), 9 * k);
    faces.geometry.setAttribute("position", new THREE.BufferAttribute(at, 3));
    faces.geometry.setAttribute("color", new THREE.BufferAttribute(tint, 3));
    draw();
  }

  /** Show crossings: those with a fastener dark, those that were asked for in red. */
  function showDots(on, fastened, asked) {
    dots.visible = on && Boolean(held.crossing);
    if (dots.visible) {
      const there = new Set(fastened), own = new Set(asked), count = held.crossing.length / 3, tint = new Float32Array(3 * count);
      for (let k = 0; k < count; k++) tint.set(own.has(k) ? [0.85, 0.2, 0.05] : there.has(k) ? [0.05, 0.05, 0.05] : [0.75, 0.75, 0.75], 3 * k);
      dots.geometry.setAttribute("position", new THREE.BufferAttribute(held.crossing, 3));
      dots.geometry.setAttribute("color", new THREE.BufferAttribute(tint, 3));
    }
    draw();
  }

  /** Let the arrow begin in the middle of the object; while it is shown, there is room for it. */
  function standArrow() {
    arrow.position.copy(ball.center);
    arrow.scale.setScalar(ball.radius);
    outer.length = held.outer || 0;
    if (arrow.visible) outer.push(ball.center.clone().setZ(ball.center.z + ARROW.room * ball.radius));
  }

  function tip() {
    return new THREE.Vector3(0, ARROW.tip, 0).applyQuaternion(arrow.quaternion).multiplyScalar(ball.radius).add(ball.center);
  }

  /** Where on the canvas a point is seen. */
  function seenAt(point) {
    const { x, y } = point.clone().project(camera.lens);
    return [((x + 1) / 2) * canvas.clientWidth, ((1 - y) / 2) * canvas.clientHeight];
  }

  /** The way from the middle to what is under a place of the window, at the arrow's length: of two the one nearer to a way. */
  function wayAt(x, y, last) {
    const box = canvas.getBoundingClientRect(), caster = new THREE.Raycaster(), reach = ARROW.tip * ball.radius;
    caster.setFromCamera(new THREE.Vector2((2 * (x - box.x)) / box.width - 1, 1 - (2 * (y - box.y)) / box.height), camera.lens);
    const beside = caster.ray.closestPointToPoint(ball.center, new THREE.Vector3()).sub(ball.center), depth = reach * reach - beside.lengthSq();
    const ways = [-1, 1].map((side) => beside.clone().addScaledVector(caster.ray.direction, side * Math.sqrt(Math.max(0, depth))).normalize());
    return ways[1].dot(last) > ways[0].dot(last) ? ways[1] : ways[0];
  }

  /** What is under a place of the canvas: the point, the piece, the nearest crossing, the face. */
  function touch(x, y) {
    const caster = new THREE.Raycaster();
    caster.setFromCamera(new THREE.Vector2((2 * x) / canvas.clientWidth - 1, 1 - (2 * y) / canvas.clientHeight), camera.lens);
    if (faces.visible) {
      const hit = nearestHit(caster.ray, faces.geometry.attributes.position.array, null);
      return hit && { point: hit.point, face: held.face[hit.triangle] };
    }
    const hit = geometry.index && nearestHit(caster.ray, geometry.attributes.position.array, geometry.index.array);
    if (!hit) return null;
    let best = -1, least = Infinity;
    for (let k = 0; k < held.crossing.length; k += 3) {
      const far = hit.point.distanceToSquared(new THREE.Vector3().fromArray(held.crossing, k));
      if (far < least) [least, best] = [far, k / 3];
    }
    return { point: hit.point, piece: geometry.attributes.owner.array[geometry.index.array[3 * hit.triangle]], crossing: best };
  }

  function resize() {
    if (!canvas.clientWidth || !canvas.clientHeight) return;
    renderer.setPixelRatio(slow ? COARSE : Math.min(devicePixelRatio || 1, 2));
    renderer.setSize(canvas.clientWidth, canvas.clientHeight, false);
    camera.resize(canvas.clientWidth, canvas.clientHeight);
  }
  new ResizeObserver(resize).observe(canvas);

  return {
    show, showFaces, showDots, draw, wayAt,
    showArrow(on) {
      arrow.visible = on;
      standArrow();
      camera.refit();
    },
    pointArrow(way) {
      arrow.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), way);
      move();
    },
    /** A way that leans to the right, and away, as it is seen from here. */
    leaned(way, right, away) {
      const across = new THREE.Vector3().setFromMatrixColumn(camera.lens.matrixWorld, 0);
      return way.clone().applyAxisAngle(camera.towards(), -right).applyAxisAngle(across, -away);
    },
    choose(piece) {
      uniforms.chosen.value = piece < 0 ? -2 : piece;
      draw();
    },
    shadows(on) {
      shadowing = on;
      draw();
    },
    /** Frames a second, of the last ones. */
    get fps() { return times.length > 1 ? (1000 * (times.length - 1)) / (times[times.length - 1] - times[0]) : 0; },
    /** A small picture of what is seen. */
    picture(wide) {
      drawNow();
      const sheet = document.createElement("canvas");
      [sheet.width, sheet.height] = [wide, Math.round((wide * canvas.height) / canvas.width)];
      sheet.getContext("2d").drawImage(canvas, 0, 0, sheet.width, sheet.height);
      return sheet.toDataURL("image/jpeg", 0.8);
    },
  };
}

/** The nearest triangle that a ray meets, and where. */
function nearestHit(ray, points, index) {
  const count = (index ? index.length : points.length / 3) / 3, hit = new THREE.Vector3();
  const corner = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()];
  let best = null, least = Infinity;
  for (let k = 0; k < count; k++) {
    for (let at = 0; at < 3; at++) corner[at].fromArray(points, 3 * (index ? index[3 * k + at] : 3 * k + at));
    if (!ray.intersectTriangle(...corner, false, hit)) continue;
    const far = hit.distanceToSquared(ray.origin);
    if (far < least) [least, best] = [far, { point: hit.clone(), triangle: k }];
  }
  return best;
}

/** The values and the arrays of a message. */
function unpacked(buffer) {
  const length = new DataView(buffer).getUint32(0, true), head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const types = { float32: Float32Array, int8: Int8Array, uint8: Uint8Array, uint32: Uint32Array }, found = {};
  const after = (bytes) => bytes + ((4 - (bytes % 4)) % 4);
  let place = 4 + after(length);
  for (const { name, type, length: count } of head.arrays) {
    found[name] = new types[type](buffer, place, count);
    place += after(found[name].byteLength);
  }
  return [head, found];
}

/** The usual width of strips, of some of their rungs. */
function usualWidthOf(position) {
  const widths = [];
  for (let k = 0; k + 5 < position.length; k += 6 * Math.ceil(position.length / 600)) widths.push(Math.hypot(position[k] - position[k + 3], position[k + 1] - position[k + 4], position[k + 2] - position[k + 5]));
  return widths.sort((a, b) => a - b)[widths.length >> 1] || 0;
}
