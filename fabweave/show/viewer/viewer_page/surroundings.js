import * as THREE from "../../scripts/three.js";

/** The radius of the table by that of the object; so many squares go from its middle to its edge. */
const TABLE = 1.1, SQUARES = 5;

/**
 * The lines of a round table that the finished object stands on: its edge, and those of its squares.
 *
 * @param {Float32Array} corners
 */
export function makeTable(corners) {
  const box = new THREE.Box3().setFromArray(corners), middle = box.getCenter(new THREE.Vector3()).setZ(box.min.z);
  let radius = 0;
  for (let k = 0; k < corners.length; k += 3)
    radius = Math.max(radius, TABLE * Math.hypot(corners[k] - middle.x, corners[k + 1] - middle.y));
  /** @type {number[][]} */
  const ends = [];
  for (let k = 1 - SQUARES; k < SQUARES; k++) {
    const at = k / SQUARES, half = Math.sqrt(1 - at * at);
    ends.push([at, -half], [at, half], [-half, at], [half, at]);
  }
  const rim = (/** @type {number} */ k) => [Math.cos((k * Math.PI) / 60), Math.sin((k * Math.PI) / 60)];
  for (let k = 0; k < 120; k++) ends.push(rim(k), rim(k + 1));
  const geometry = new THREE.BufferGeometry();
  const places = new Float32Array(ends.flatMap(([x, y]) => [radius * x, radius * y, 0]));
  geometry.setAttribute("position", new THREE.BufferAttribute(places, 3));
  const table = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: 0x999999 }));
  table.position.copy(middle);
  return table;
}

/** The plates of a former, thin as paper: outlines with holes, each in its plane. */
export class Former extends THREE.Group {
  #board = new THREE.MeshBasicMaterial({
    color: 0xf6f0e4, side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
  });
  #edge = new THREE.LineBasicMaterial({ color: 0xb5a68c });

  /**
   * @param {{ origin: [number, number, number], axes: number[][], rings: number[][][] }[]} plates
   */
  constructor(plates) {
    super();
    this.boards = plates.map(({ origin, axes, rings }) => {
      const [right, up] = axes.map((axis) => new THREE.Vector3().fromArray(axis)), plate = new THREE.Group();
      const paths = rings.map((ring) => ring.map(([x, y]) => new THREE.Vector2(x, y)));
      const shape = new THREE.Shape(paths[0]);
      shape.holes = paths.slice(1).map((path) => new THREE.Path(path));
      const board = new THREE.Mesh(new THREE.ShapeGeometry(shape), this.#board);
      const lines = paths.map((path) => new THREE.LineLoop(new THREE.BufferGeometry().setFromPoints(path), this.#edge));
      const away = new THREE.Vector3().crossVectors(right, up);
      plate.add(board, ...lines).applyMatrix4(new THREE.Matrix4().makeBasis(right, up, away).setPosition(...origin));
      this.add(plate);
      return board;
    });
  }

  /** Let it be seen, or hide what is behind it only. @param {boolean} seen */
  show(seen) {
    this.#board.colorWrite = this.#edge.colorWrite = seen;
  }
}
