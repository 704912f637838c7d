/** A camera that goes around an object: drag, pinch, wheel; z stays up.
 *
 * Where drawing is slow, it turns at once.
 * Until somebody comes nearer or moves aside, all the points are kept in view. */
function makeCamera(canvas, ball, points, firstDeg, tell) {
  const lens = new THREE.PerspectiveCamera(32, 1, 1, 1000);
  lens.up.set(0, 0, 1);
  const pointers = new Map();
  let turn, rise, far, target, whole = true, flight = 0, moved = 0, fingers = 0;
  const slope = Math.tan(((lens.fov / 2) * Math.PI) / 180);

  function towards() {
    return new THREE.Vector3(Math.cos(rise) * Math.cos(turn), Math.cos(rise) * Math.sin(turn), Math.sin(rise));
  }

  /** The distance from which everything is in view. */
  function fitting() {
    const eye = towards(), right = new THREE.Vector3(-Math.sin(turn), Math.cos(turn), 0), up = eye.clone().cross(right);
    return 1.06 * points.reduce((most, point) => {
      const at = point.clone().sub(target);
      return Math.max(most, at.dot(eye) + Math.max(Math.abs(at.dot(right)) / lens.aspect, Math.abs(at.dot(up))) / slope);
    }, 0);
  }

  function home() {
    [turn, rise] = firstDeg.map((angle) => (angle * Math.PI) / 180);
    whole = true;
    target = ball.center.clone();
    place();
  }

  function place() {
    cancelAnimationFrame(flight);
    settle();
  }

  function settle() {
    rise = Math.max(-1.55, Math.min(1.55, rise));
    far = whole ? fitting() : Math.max(ball.radius * 0.1, Math.min(ball.radius * 30, far));
    lens.position.copy(target).addScaledVector(towards(), far);
    lens.lookAt(target);
    const away = lens.position.distanceTo(ball.center);
    lens.near = Math.max(ball.radius * 0.01, away - ball.radius * 1.1);
    lens.far = away + ball.radius * 1.1;
    lens.updateProjectionMatrix();
    lens.updateMatrixWorld();
    tell.changed();
  }

  /** Turn, by the shorter way, until a direction from the object points at the eye. */
  function face(direction) {
    const goal = Math.atan2(direction.y, direction.x);
    const away = Math.atan2(Math.sin(goal - turn), Math.cos(goal - turn));
    const up = Math.max(-1.2, Math.min(1.2, Math.asin(Math.max(-1, Math.min(1, direction.z)))));
    const from = [turn, rise, target.clone()], begun = performance.now();
    const lasts = tell.slow || matchMedia("(prefers-reduced-motion: reduce)").matches ? 0 : 350;
    cancelAnimationFrame(flight);
    (function fly() {
      const done = lasts ? Math.min(1, (performance.now() - begun) / lasts) : 1;
      const eased = done * done * (3 - 2 * done);
      turn = from[0] + away * eased;
      rise = from[1] + (up - from[1]) * eased;
      target.copy(from[2]).lerp(ball.center, eased);
      settle();
      if (done < 1) flight = requestAnimationFrame(fly);
    })();
  }

  function pan(dx, dy) {
    const mm = (2 * far * slope) / canvas.clientHeight;
    const [right, up] = [0, 1].map((column) => new THREE.Vector3().setFromMatrixColumn(lens.matrixWorld, column));
    whole = false;
    target.addScaledVector(right, -dx * mm).addScaledVector(up, dy * mm);
  }

  function spread() {
    const [a, b] = [...pointers.values()];
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, far: Math.hypot(a.x - b.x, a.y - b.y) };
  }

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    if (pointers.size === 0) [moved, fingers] = [0, 0];
    pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    fingers = Math.max(fingers, pointers.size);
  });

  canvas.addEventListener("pointermove", (event) => {
    const last = pointers.get(event.pointerId);
    if (!last) return;
    const before = pointers.size === 2 ? spread() : null;
    const dx = event.offsetX - last.x, dy = event.offsetY - last.y;
    moved += Math.abs(dx) + Math.abs(dy);
    pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    if (before) {
      const after = spread();
      far *= before.far / Math.max(after.far, 1);
      pan(after.x - before.x, after.y - before.y);
    } else if (pointers.size === 1 && (event.buttons & 2 || event.shiftKey)) {
      pan(dx, dy);
    } else if (pointers.size === 1) {
      const speed = 5 / Math.min(canvas.clientWidth, canvas.clientHeight);
      turn -= dx * speed;
      rise += dy * speed;
    }
    // A tap that trembles turns nothing.
    if (moved > 6) place();
  });

  function lifted(event) {
    if (!pointers.delete(event.pointerId)) return;
    const tapped = event.type === "pointerup" && moved <= 6 && fingers === 1 && event.button === 0;
    if (tapped) tell.tapped(event.offsetX, event.offsetY);
  }
  canvas.addEventListener("pointerup", lifted);
  canvas.addEventListener("pointercancel", lifted);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    whole = false;
    far *= Math.exp(event.deltaY * (event.deltaMode ? 0.04 : 0.0012));
    place();
  }, { passive: false });

  return {
    lens, home, face,
    resize(width, height) {
      lens.aspect = width / height;
      if (target) settle();
      else home();
    },
  };
}
