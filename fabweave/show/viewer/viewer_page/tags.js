/** @typedef {import("./strips.js").Spot} Spot */
/** @typedef {{ x: number, y: number }} Place */
/** @typedef {{ piece: number, text: string, strong: boolean }} Label */
/** @typedef {(x: number, y: number) => number} Seen The piece at a place of the canvas. */
/** @typedef {(piece: number, point: Spot["point"]) => Place} OnScreen */

/**
 * Those places of a piece that are seen, with where they are on the canvas.
 *
 * @param {number} piece
 * @param {Spot[][]} spots
 * @param {Seen} seen
 * @param {OnScreen} onScreen
 */
export function seenSpots(piece, spots, seen, onScreen) {
  const places = spots[piece].map((spot) => ({ spot, ...onScreen(piece, spot.point) }));
  return places.filter(({ x, y }) => seen(x, y) === piece);
}

/**
 * Find for every label a place where its piece is seen.
 *
 * @param {Label[]} wanted
 * @param {Spot[][]} spots
 * @param {Seen} seen
 * @param {OnScreen} onScreen
 */
export function placeTags(wanted, spots, seen, onScreen) {
  return wanted.flatMap((label) => {
    const free = seenSpots(label.piece, spots, seen, onScreen);
    if (!free.length) return [];
    const middle = free.reduce((sum, { x, y }) => [sum[0] + x / free.length, sum[1] + y / free.length], [0, 0]);
    const off = (/** @type {Place} */ { x, y }) => Math.hypot(x - middle[0], y - middle[1]);
    const best = free.reduce((least, one) => (off(one) < off(least) ? one : least));
    return [{ ...label, point: best.spot.point }];
  });
}

/**
 * Write labels, the first ones first, none over another.
 *
 * @param {CanvasRenderingContext2D} brush
 * @param {ReturnType<typeof placeTags>} anchors
 * @param {OnScreen} onScreen
 */
export function writeTags(brush, anchors, onScreen) {
  /** @type {(Place & { half: number, tall: number })[]} */
  const taken = [];
  for (const { piece, text, strong, point } of anchors) {
    const { x, y } = onScreen(piece, point);
    brush.font = `${strong ? "bold 15px" : "12px"} system-ui, sans-serif`;
    const half = brush.measureText(text).width / 2 + 4, tall = strong ? 11 : 8;
    const near = (/** @type {typeof taken[0]} */ other) =>
      Math.abs(other.x - x) < other.half + half && Math.abs(other.y - y) < other.tall + tall;
    if (taken.some(near)) continue;
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
}

/** Ring a point. @param {CanvasRenderingContext2D} brush @param {Place} place */
export function ringPoint(brush, { x, y }) {
  for (const [line, ink] of /** @type {[number, string][]} */ ([[6, "#fff"], [3, "#111"]])) {
    brush.lineWidth = line;
    brush.strokeStyle = ink;
    brush.beginPath();
    brush.arc(x, y, 13, 0, 2 * Math.PI);
    brush.stroke();
  }
}
