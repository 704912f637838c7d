/** Flat drawings: strips side by side, and sheets with the pieces where they lie. */

/** The path of a piece's outline and holes. */
function piecePath({ outline, holes }) {
  const round = ([x, y, d]) => `M${x - d / 2} ${y}a${d / 2} ${d / 2} 0 1 0 ${d} 0a${d / 2} ${d / 2} 0 1 0 ${-d} 0Z`;
  return `M${outline.map((point) => point.join(" ")).join("L")}Z${holes.map(round).join("")}`;
}

function pieceShape(piece, number, transform, more = "") {
  return `<path class="piece ${more}" data-piece="${number}" tabindex="-1" fill="${piece.colour}" fill-rule="evenodd" transform="${transform}" d="${piecePath(piece)}"><title>${escaped(piece.id)}, kind ${piece.kind}</title></path>`;
}

/** Strips in rows, as wide as there is room. */
function drawStrips(panel, pieces, wide) {
  const boxes = pieces.map(({ outline }) => [0, 1].map((axis) => outline.map((point) => point[axis])).map((values) => [Math.min(...values), Math.max(...values)]));
  const longest = Math.max(...boxes.map(([[low, high]]) => high - low));
  // So large that the longest fills a third of the panel.
  const across = 3.1 * longest, gap = 0.012 * across;
  let x = gap, y = gap, row = 0;
  const drawn = pieces.map((piece, number) => {
    const [[left, right], [low, high]] = boxes[number];
    if (x + right - left > across - gap) [x, y, row] = [gap, y + row + gap, 0];
    const shape = pieceShape(piece, number, `translate(${(x - left).toFixed(2)} ${(y + high).toFixed(2)}) scale(1 -1)`);
    x += right - left + gap;
    row = Math.max(row, high - low);
    return shape;
  });
  const high = y + row + gap;
  panel.innerHTML = `<svg role="img" aria-label="${pieces.length} strips, flat" width="${wide}" height="${(wide * high) / across}" viewBox="0 0 ${across} ${high}">${drawn.join("")}</svg>`;
}

const lying = (sheet, [, , x, y, turn]) => `translate(${x} ${sheet.height - y}) scale(1 -1) rotate(${turn})`;

/** Sheets beside one another, each with its pieces; those that are pinned are told by their ids. */
function drawSheets(panel, pieces, sheets, placed, high, pinned, how) {
  panel.innerHTML = `<div class="sheets">${sheets.map((sheet, number) => {
    const on = placed.filter(([, at]) => at === number);
    const shapes = on.map((place) => pieceShape(pieces[place[0]], place[0], lying(sheet, place), pinned.has(pieces[place[0]].id) ? "pinned" : ""));
    return `<figure><svg role="img" data-sheet="${number}" aria-label="Sheet ${number + 1}" height="${high}" width="${(high * sheet.width) / sheet.height}" viewBox="0 0 ${sheet.width} ${sheet.height}">${shapes.join("")}</svg>
      <figcaption>Sheet ${number + 1}: ${sheet.width.toFixed(0)} × ${sheet.height.toFixed(0)} mm, ${on.length} pieces, ${how}</figcaption></figure>`;
  }).join("")}</div>`;
}

/** Let pieces be dragged on their sheets; while one is held, R turns it. Tells where it is let go. */
function dragPieces(panel, plan, drop) {
  let held = null;
  const move = (event) => {
    if (!held) return;
    const [x, y] = [held.scale * (event.clientX - held.from[0]), held.scale * (event.clientY - held.from[1])];
    held.moved = held.moved || Math.hypot(event.clientX - held.from[0], event.clientY - held.from[1]) > 5;
    if (!held.moved) return;
    held.now = [held.place[0], held.place[1], held.place[2] + x, held.place[3] - y, held.now[4]];
    held.shape.setAttribute("transform", lying(held.sheet, held.now));
  };
  panel.addEventListener("pointerdown", (event) => {
    const shape = event.target.closest(".piece"), { sheets, placed } = plan();
    if (!shape || !placed || event.button) return;
    const drawing = shape.closest("svg"), number = Number(drawing.dataset.sheet), place = placed.find(([piece, at]) => piece === Number(shape.dataset.piece) && at === number);
    if (!place) return;
    held = { shape, place, now: place, sheet: sheets[number], scale: sheets[number].width / drawing.clientWidth, from: [event.clientX, event.clientY], moved: false };
    shape.setPointerCapture(event.pointerId);
  });
  panel.addEventListener("pointermove", move);
  panel.addEventListener("pointerup", () => {
    if (held && held.moved) drop(held.now);
    held = null;
  });
  panel.addEventListener("pointercancel", () => (held = null));
  document.addEventListener("keydown", (event) => {
    if (!held || event.key.toLowerCase() !== "r") return;
    held.now = [...held.now.slice(0, 4), (held.now[4] + 15) % 360];
    held.moved = true;
    held.shape.setAttribute("transform", lying(held.sheet, held.now));
  });
}

/** How often ribbons are how wide. */
function drawWidths(panel, { from, to, count }) {
  const most = Math.max(...count), bars = count.map((n, k) => `<rect x="${k + 0.08}" width=".84" y="${(1 - n / most).toFixed(4)}" height="${(n / most).toFixed(4)}"/>`);
  panel.innerHTML = `<svg role="img" aria-label="From ${from} to ${to} mm" viewBox="0 0 ${count.length} 1" preserveAspectRatio="none">${bars.join("")}</svg><p><span>${from.toFixed(1)} mm</span><span>${to.toFixed(1)} mm</span></p>`;
}
