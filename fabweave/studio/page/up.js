/** The arrow goes to an axis of the file that is so near, and a key leans it by so much. */
const NEAR = Math.cos(Math.PI / 30), LEAN = Math.PI / 18;

/** The arrow that points up: where it is dragged to, or leant to by keys, is what shall point up.
 *
 * `tell` says what others know of it: turn(): the rotation from the file to what is seen,
 * leaning(text): it is on its way, chosen(text): it was let go, usual(): it was tapped twice. */
function makeUpArrow(scene, handle, tell) {
  const up = new THREE.Vector3(0, 0, 1);
  let way = up, from = null, leant = false;

  /** Point there, or to an axis of the file near by. */
  function point(to) {
    const axes = [0, 1, 2].map((axis) => new THREE.Vector3(...tell.turn().map((row) => row[axis])));
    way = axes.flatMap((axis) => [axis, axis.clone().negate()]).find((axis) => axis.dot(to) > NEAR) || to;
    scene.pointArrow(way);
    tell.leaning(text());
  }

  /** What it points to in the file's own coordinates, as the option has it. */
  function text() {
    const own = [0, 1, 2].map((axis) => tell.turn().reduce((sum, row, k) => sum + row[axis] * way.getComponent(k), 0));
    const most = Math.max(...own.map(Math.abs)), rounded = own.map((value) => Number((value / most).toFixed(3)));
    const axis = rounded.findIndex(Boolean);
    return rounded.filter(Boolean).length > 1 ? rounded.join(",") : `${rounded[axis] < 0 ? "-" : ""}${"xyz"[axis]}`;
  }

  function reset() {
    if (from || leant) return;
    way = up;
    scene.pointArrow(way);
  }

  function letGo() {
    [from, leant] = [null, false];
    if (way.dot(up) > 1 - 1e-9) reset();
    else tell.chosen(text());
  }

  handle.addEventListener("pointerdown", (event) => {
    if (event.button) return;
    handle.setPointerCapture(event.pointerId);
    from = { x: event.clientX, y: event.clientY, moved: false };
  });
  handle.addEventListener("pointermove", (event) => {
    if (!from) return;
    from.moved = from.moved || Math.hypot(event.clientX - from.x, event.clientY - from.y) > 3;
    if (from.moved) point(scene.wayAt(event.clientX, event.clientY, way));
  });
  handle.addEventListener("pointerup", () => from && (from.moved ? letGo() : (from = null)));
  handle.addEventListener("pointercancel", () => {
    from = null;
    reset();
  });
  handle.addEventListener("dblclick", () => tell.usual());
  const keys = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  handle.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
    event.preventDefault();
    leant = true;
    point(scene.leaned(way, ...keys[event.key].map((share) => share * LEAN)));
  });
  for (const name of ["keyup", "blur"]) handle.addEventListener(name, () => leant && letGo());

  return { reset };
}
