/** Flat drawings: strips side by side, and sheets with the pieces where they lie. */

const escapedText = (text) => String(text).replace(/[&<>"]/g, (sign) => `&#${sign.charCodeAt(0)};`);

/** The path of a piece's outline and holes. */
function piecePath({ outline, holes }) {
  const round = ([x, y, d]) => `M${x - d / 2} ${y}a${d / 2} ${d / 2} 0 1 0 ${d} 0a${d / 2} ${d / 2} 0 1 0 ${-d} 0Z`;
  return `M${outline.map((point) => point.join(" ")).join("L")}Z${holes.map(round).join("")}`;
}

function pieceShape(piece, number, transform) {
  return `<path class="piece" data-piece="${number}" tabindex="-1" fill="${piece.colour}" fill-rule="evenodd" transform="${transform}" d="${piecePath(piece)}"><title>${escapedText(piece.id)}, kind ${piece.kind}</title></path>`;
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

/** Sheets beside one another, each with its pieces. */
function drawSheets(panel, pieces, sheets, placed, high) {
  panel.innerHTML = `<div class="sheets">${sheets.map((sheet, number) => {
    const on = placed.filter(([, at]) => at === number);
    const shapes = on.map(([piece, , x, y, turn]) => pieceShape(pieces[piece], piece, `translate(${x} ${sheet.height - y}) scale(1 -1) rotate(${turn})`));
    return `<figure><svg role="img" aria-label="Sheet ${number + 1}" height="${high}" width="${(high * sheet.width) / sheet.height}" viewBox="0 0 ${sheet.width} ${sheet.height}">${shapes.join("")}</svg>
      <figcaption>Sheet ${number + 1}: ${sheet.width.toFixed(0)} × ${sheet.height.toFixed(0)} mm, ${on.length} pieces</figcaption></figure>`;
  }).join("")}</div>`;
}

/** How often ribbons are how wide. */
function drawWidths(panel, { from, to, count }) {
  const most = Math.max(...count), bars = count.map((n, k) => `<rect x="${k + 0.08}" width=".84" y="${(1 - n / most).toFixed(4)}" height="${(n / most).toFixed(4)}"/>`);
  panel.innerHTML = `<svg role="img" aria-label="From ${from} to ${to} mm" viewBox="0 0 ${count.length} 1" preserveAspectRatio="none">${bars.join("")}</svg><p><span>${from.toFixed(1)} mm</span><span>${to.toFixed(1)} mm</span></p>`;
}
