/** Those places of a piece that are seen, with where they are on the canvas.
 *
 * `seen(x, y)` is the piece at a point of the canvas, `onScreen(piece, point)` where a point is. */
function seenSpots(piece, spots, seen, onScreen) {
  return spots[piece].map((spot) => ({ spot, ...onScreen(piece, spot.point) })).filter(({ x, y }) => seen(x, y) === piece);
}

/** Find for every label a place where its piece is seen. */
function placeTags(wanted, spots, seen, onScreen) {
  return wanted.flatMap((label) => {
    const free = seenSpots(label.piece, spots, seen, onScreen);
    if (!free.length) return [];
    const middle = free.reduce((sum, { x, y }) => [sum[0] + x / free.length, sum[1] + y / free.length], [0, 0]);
    const off = ({ x, y }) => Math.hypot(x - middle[0], y - middle[1]);
    const best = free.reduce((least, one) => (off(one) < off(least) ? one : least));
    return [{ ...label, point: best.spot.point }];
  });
}

/** Write labels, the first ones first, none over another. */
function writeTags(brush, anchors, onScreen) {
  const taken = [];
  for (const { piece, text, strong, point } of anchors) {
    const { x, y } = onScreen(piece, point);
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
}

/** Ring a point. */
function ringPoint(brush, { x, y }) {
  for (const [line, ink] of [[6, "#fff"], [3, "#111"]]) {
    brush.lineWidth = line;
    brush.strokeStyle = ink;
    brush.beginPath();
    brush.arc(x, y, 13, 0, 2 * Math.PI);
    brush.stroke();
  }
}
