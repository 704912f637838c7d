/** From where the object is seen, going round it: front, front right, and so on. */
const SIDES = ["front", "front right", "right", "back right", "back", "back left", "left", "front left"];
/** A press of a key or a button turns by so much, and comes nearer by so much. */
const TURN = Math.PI / 12, NEARER = 1.25;
/** All that is drawn, the table too, is so near to the middle, in radii of the object. */
const TABLE_REACH = 1.6;

/** A camera that goes around an object: drag, pinch, wheel, keys; z stays up.
 *
 * Until somebody comes nearer or moves aside, all the points are kept in view. `tell` says what the
 * camera asks of others: changed(), tapped(x, y), touched(x, y): the point of the object that is
 * seen there, calm(): whether it should turn at once, and rest(words): where it came to rest. */
function makeCamera(canvas, ball, points, firstDeg, tell) {
  const wide = new THREE.PerspectiveCamera(32, 1, 1, 1000), parallel = new THREE.OrthographicCamera(-1, 1, 1, -1);
  const pointers = new Map();
  let lens = wide, turn, rise, far, target, whole = true, flight = 0, moved = 0, fingers = 0, aspect = 1;
  // How far pieces are moved apart; and the place that is held while one zooms.
  let spread = 0, grip = null;
  const slope = Math.tan(((wide.fov / 2) * Math.PI) / 180);
  for (const each of [wide, parallel]) each.up.set(0, 0, 1);

  function towards() {
    return new THREE.Vector3(Math.cos(rise) * Math.cos(turn), Math.cos(rise) * Math.sin(turn), Math.sin(rise));
  }

  /** The distance from which everything is in view. */
  function fitting() {
    const eye = towards(), right = new THREE.Vector3(-Math.sin(turn), Math.cos(turn), 0), up = eye.clone().cross(right);
    const deep = lens === wide ? 1 : 0;
    return 1.06 * (1 + 0.85 * spread) * points.reduce((most, point) => {
      const at = point.clone().sub(target);
      return Math.max(most, deep * at.dot(eye) + Math.max(Math.abs(at.dot(right)) / aspect, Math.abs(at.dot(up))) / slope);
    }, 0);
  }

  /** Look from where the object is seen first; done at once, as an address may ask for another view. */
  function aim() {
    [turn, rise] = firstDeg.map((angle) => (angle * Math.PI) / 180);
    whole = true;
    target = ball.center.clone();
  }
  aim();

  function home() {
    aim();
    place();
  }

  function place() {
    cancelAnimationFrame(flight);
    settle();
  }

  function settle() {
    rise = Math.max(-1.55, Math.min(1.55, rise));
    far = whole ? fitting() : bounded(far);
    const reach = TABLE_REACH * ball.radius * (1 + spread);
    // Without perspective it does not matter how far the eye is: it stands before everything.
    const stand = lens === wide ? far : Math.max(far, 2 * reach + target.distanceTo(ball.center));
    lens.position.copy(target).addScaledVector(towards(), stand);
    lens.lookAt(target);
    const away = lens.position.clone().sub(ball.center).dot(towards());
    lens.near = Math.max(ball.radius * 0.002, away - reach);
    lens.far = Math.max(away + reach, 2 * lens.near);
    if (lens === wide) lens.aspect = aspect;
    else [lens.left, lens.right, lens.top, lens.bottom] = [-aspect, aspect, 1, -1].map((edge) => edge * far * slope);
    lens.updateProjectionMatrix();
    lens.updateMatrixWorld();
    tell.changed();
  }

  function bounded(distance) {
    return Math.max(ball.radius * 0.02, Math.min(ball.radius * 30, distance));
  }

  /** Change the view little by little, or at once where motion is not wanted. */
  function fly(change) {
    const begun = performance.now(), lasts = tell.calm() ? 0 : 350;
    cancelAnimationFrame(flight);
    (function frame() {
      const done = lasts ? Math.min(1, (performance.now() - begun) / lasts) : 1;
      change(done * done * (3 - 2 * done));
      settle();
      if (done < 1) flight = requestAnimationFrame(frame);
    })();
  }

  /** Turn, by the shorter way, until a direction from a point of the object looks at the eye. */
  function face(direction, point) {
    const up = Math.max(-1.2, Math.min(1.2, Math.asin(Math.max(-1, Math.min(1, direction.z)))));
    turnTowards(Math.atan2(direction.y, direction.x), up, point);
  }

  /** See the object from an azimuth and an elevation. */
  function look(viewDeg, point) {
    const [goal, up] = viewDeg.map((angle) => (angle * Math.PI) / 180);
    turnTowards(goal, up, point);
  }

  /** Turn by the shorter way; say from where it is seen, if it was seen from elsewhere. */
  function turnTowards(goal, up, point) {
    const away = Math.atan2(Math.sin(goal - turn), Math.cos(goal - turn)), before = spoken();
    const from = [turn, rise, target.clone()], to = whole ? ball.center : point;
    fly((part) => {
      turn = from[0] + away * part;
      rise = from[1] + (up - from[1]) * part;
      target.copy(from[2]).lerp(to, part);
      if (part === 1 && spoken() !== before) tell.rest(spoken());
    });
  }

  /** Look from a direction at all there is, for as long as it takes to see something. */
  function glimpse(direction, see) {
    const kept = [turn, rise, whole, target];
    [turn, rise, whole, target] = [Math.atan2(direction.y, direction.x), Math.asin(direction.z), true, ball.center.clone()];
    settle();
    const seen = see();
    [turn, rise, whole, target] = kept;
    settle();
    return seen;
  }

  /** Turn around another point from now on, which comes to the middle. */
  function pivot(point) {
    const from = target.clone();
    whole = false;
    fly((part) => target.copy(from).lerp(point, part));
  }

  /** The point under a place of the canvas: on the object, or else as far away as the pivot. */
  function under(x, y) {
    const on = tell.touched(x, y);
    if (on) return on;
    const flat = new THREE.Vector3((2 * x) / canvas.clientWidth - 1, 1 - (2 * y) / canvas.clientHeight, 0);
    const [near, beyond] = [-1, 1].map((depth) => flat.clone().setZ(depth).unproject(lens));
    const way = beyond.sub(near).normalize(), eye = towards();
    return near.addScaledVector(way, target.clone().sub(near).dot(eye) / way.dot(eye));
  }

  /** Come nearer by a factor so that what is under a place of the canvas stays there. */
  function zoomAt(x, y, factor) {
    const now = performance.now();
    if (!grip || now - grip.at > 600 || Math.hypot(x - grip.x, y - grip.y) > 3) grip = { x, y, point: under(x, y) };
    grip.at = now;
    zoomAbout(grip.point, factor);
  }

  /** Shrink the way from the eye to a point: whatever else the ray to it meets stays in line, too. */
  function zoomAbout(point, factor) {
    const next = bounded(far / factor);
    whole = false;
    target.sub(point).multiplyScalar(next / far).add(point);
    far = next;
    place();
  }

  /** Move aside by so many pixels, at the depth of the pivot or at another. */
  function pan(dx, dy, depth = far) {
    const mm = (2 * depth * slope) / canvas.clientHeight;
    const [right, up] = [0, 1].map((column) => new THREE.Vector3().setFromMatrixColumn(lens.matrixWorld, column));
    whole = false;
    target.addScaledVector(right, -dx * mm).addScaledVector(up, dy * mm);
  }

  /** Bring a point of the object to a place of the canvas. */
  function hold(point, x, y) {
    const at = point.clone().project(lens), depth = lens === wide ? lens.position.clone().sub(point).dot(towards()) : far;
    pan(x - ((at.x + 1) / 2) * canvas.clientWidth, y - ((1 - at.y) / 2) * canvas.clientHeight, depth);
    place();
  }

  /** Do what a key or a button asks: left, right, up, down, in, out, home. */
  function move(what) {
    if (what === "home") home();
    else if (what === "in" || what === "out") zoomAbout(target.clone(), what === "in" ? NEARER : 1 / NEARER);
    else {
      turn += TURN * ((what === "right") - (what === "left"));
      rise += TURN * ((what === "up") - (what === "down"));
      place();
    }
    tell.rest(spoken());
  }

  /** Say from where the object is seen. */
  function spoken() {
    const deg = [turn, rise].map((angle) => (angle * 180) / Math.PI), high = (Math.abs(deg[1]) > 42 ? "well " : "") + (deg[1] > 0 ? "above" : "below");
    const side = SIDES[(((Math.floor((deg[0] + 90) / 45 + 0.5) % 8) + 8) % 8)];
    const near = far && !whole ? fitting() / far : 1;
    const zoomed = Math.abs(near - 1) > 0.1 ? `, ${near.toFixed(1)} times as large` : "";
    if (Math.abs(deg[1]) > 60) return `Seen from straight ${deg[1] > 0 ? "above" : "below"}${zoomed}.`;
    return `Seen from the ${side}${Math.abs(deg[1]) < 8 ? "" : ` and ${high}`}${zoomed}.`;
  }

  function fingersApart() {
    const [a, b] = [...pointers.values()];
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, far: Math.hypot(a.x - b.x, a.y - b.y) };
  }

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    if (pointers.size === 0) [moved, fingers] = [0, 0];
    pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    fingers = Math.max(fingers, pointers.size);
    grip = null;
  });

  canvas.addEventListener("pointermove", (event) => {
    const last = pointers.get(event.pointerId);
    if (!last) return;
    const before = pointers.size === 2 ? fingersApart() : null;
    const dx = event.offsetX - last.x, dy = event.offsetY - last.y;
    moved += Math.abs(dx) + Math.abs(dy);
    pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    if (moved <= 6 && !before) return; // a tap that trembles turns nothing
    if (before) {
      const after = fingersApart();
      grip = grip || { point: under(before.x, before.y) };
      zoomAbout(grip.point, after.far / Math.max(before.far, 1));
      hold(grip.point, after.x, after.y);
      return;
    }
    if (pointers.size === 1 && (event.buttons & 2 || event.shiftKey)) {
      pan(dx, dy);
    } else if (pointers.size === 1) {
      const speed = 5 / Math.min(canvas.clientWidth, canvas.clientHeight);
      turn -= dx * speed;
      rise += dy * speed;
    }
    place();
  });

  function lifted(event) {
    if (!pointers.delete(event.pointerId)) return;
    grip = null;
    const tapped = event.type === "pointerup" && moved <= 6 && fingers === 1 && event.button === 0;
    if (tapped) tell.tapped(event.offsetX, event.offsetY);
    else tell.rest(spoken());
  }
  canvas.addEventListener("pointerup", lifted);
  canvas.addEventListener("pointercancel", lifted);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoomAt(event.offsetX, event.offsetY, Math.exp(-event.deltaY * (event.deltaMode ? 0.04 : 0.0012)));
  }, { passive: false });
  canvas.addEventListener("dblclick", (event) => pivot(tell.touched(event.offsetX, event.offsetY) || ball.center.clone()));
  const keys = { ArrowLeft: "left", ArrowRight: "right", ArrowUp: "up", ArrowDown: "down", "+": "in", "=": "in", "-": "out", 0: "home" };
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
    event.preventDefault();
    move(keys[event.key]);
  });

  return {
    home, face, look, glimpse, move,
    get lens() { return lens; },
    towards,
    /** Keep lines parallel, or show what is nearer larger. */
    straighten(on) {
      lens = on ? parallel : wide;
      place();
    },
    /** The object has changed: show all of it, if all of it was shown. */
    refit() {
      if (whole) target.copy(ball.center);
      settle();
    },
    /** Pieces are moved apart by so much of their way from the middle. */
    spread(by) {
      spread = by;
      place();
    },
    resize(width, height) {
      aspect = width / height;
      settle();
    },
  };
}
