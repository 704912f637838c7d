/** Join points to the data of a path, y turned to point up. */
function pathOf(points) {
  return `M${points.map(([x, y]) => `${x.toFixed(2)} ${(-y).toFixed(2)}`).join("L")}Z`;
}

/** A sign for over or under that needs no colour. */
function sideSign(over) {
  return `<svg class="sign" viewBox="-8 -8 16 16" aria-hidden="true">${
    over ? '<circle r="6.5" class="over"/>' : '<circle r="5.5" class="under"/>'}</svg>`;
}

/** What a station is at a step: made now, not there before a later one, or neither. */
function stationTime(plan, step, station) {
  if (!step) return "";
  if (step.crossings.includes(station.crossing) || step.over.includes(station.crossing) || step.under.includes(station.crossing)) return " now";
  return plan.stepOf[plan.pieceAt.get(station.partner)] >= step.step ? " later" : "";
}

/** Draw a flat piece with its stations, the partner at each, its joints and its direction; those of a step stand out. */
function pieceDrawing(plan, index, chosen, step) {
  const piece = plan.pieces[index], stations = piece.stations;
  const xs = piece.outline.map(([x]) => x), ys = piece.outline.map(([, y]) => y);
  const [left, right, low, high] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  // Lettering has one size on the screen: that which gives each station its room.
  const shownWide = Math.max(330, 37 * stations.length);
  const unit = (right - left) / (shownWide - 24);
  const r = 10 * unit, pad = 12 * unit;
  const holes = stations.filter((station) => station.hole_mm !== null)
    .map((station) => `<circle class="hole" cx="${station.x}" cy="${-station.y}" r="${station.hole_mm / 2}"/>`);
  const line = stations.map(({ x, y }) => `${x} ${-y}`).join("L");
  const dots = stations.map((station, k) => `
    <g class="station${station.over ? " over" : " under"}${stationTime(plan, step, station)}${k === chosen ? " chosen" : ""}" data-station="${k}"
       transform="translate(${station.x} ${-station.y})">
      <circle class="reach" r="${2 * r}"/><circle class="halo" r="${1.5 * r}"/><circle class="dot" r="${r}" stroke-width="${2 * unit}"/>
      <text font-size="${11 * unit}" dy="${3.9 * unit}">${k}</text></g>`);
  const names = stations.map((station) => `<g class="partner${stationTime(plan, step, station)}" role="link" tabindex="0" data-piece="${escaped(station.partner)}">
    <rect x="${station.x - 17 * unit}" y="${-low - 2 * unit}" width="${34 * unit}" height="${30 * unit}"/>
    <text x="${station.x}" y="${-low + 15 * unit}" font-size="${11 * unit}">${escaped(plan.bears(plan.pieceAt.get(station.partner)))}</text></g>`);
  const ends = [[0, left], [1, right]].flatMap(([end, x]) => {
    if (piece.joints[end] === null) return [];
    const mate = plan.mate(piece, piece.joints[end]), name = `#${piece.joints[end]} \u2192 ${plan.nameOf(mate)}`, wide = 8 * unit * name.length;
    return [`<g role="link" tabindex="0" data-piece="${escaped(mate)}"><rect x="${end ? x - wide : x}" y="${-high - 26 * unit}" width="${wide}" height="${30 * unit}"/>
      <text class="joint" x="${x}" y="${-high - 7 * unit}" font-size="${12 * unit}" text-anchor="${end ? "end" : "start"}">${escaped(name)}</text></g>`];
  });
  const way = `<text class="way" x="${(left + right) / 2}" y="${-high - 7 * unit}" font-size="${12 * unit}">${
    escaped(plan.bears(index))} &#9654;</text>`;
  const box = [left - pad, -high - 26 * unit, right - left + 2 * pad, high - low + 54 * unit];
  return `<div class="scroll"><svg class="piece" viewBox="${box.join(" ")}" style="width:clamp(${0.85 * shownWide}px, 100%, ${shownWide}px)" role="img"
    aria-label="Piece ${escaped(plan.named(index))}, flat"><path class="outline" style="fill:${plan.colour[index]}"
    d="${pathOf(piece.outline)}"/>${holes.join("")}<path class="line" d="M${line}" stroke-width="${1.5 * unit}"
    stroke-dasharray="${4 * unit} ${3 * unit}"/>${dots.join("")}${names.join("")}${ends.join("")}${way}</svg></div>`;
}

/** List a piece's stations: how far along, over or under which piece, joint and mate. */
function stationTable(plan, index, chosen, step) {
  const piece = plan.pieces[index], far = plan.distances(piece);
  const rows = piece.stations.map((station, k) => `
    <tr data-station="${k}" class="${stationTime(plan, step, station)}${k === chosen ? " chosen" : ""}"><td>${k}</td><td>${far[k].toFixed(1)}</td>
      <td>${sideSign(station.over)}${station.over ? "over" : "under"}</td>
      <td>${plan.link(station.partner)}</td>
      <td>${station.joint === null ? "" : `#${station.joint} ${plan.link(plan.mate(piece, station.joint))}`}</td>
      <td>${station.hole_mm === null ? "" : station.hole_mm}</td></tr>`);
  return `<div class="scroll"><table><thead><tr><th>No.</th><th>mm</th><th>passes</th><th>piece</th><th>joint</th><th>hole</th></tr></thead>
    <tbody>${rows.join("")}</tbody></table></div>`;
}

/** The motion of a piece from its own coordinates to its place on the sheet, which may be mirrored. */
function placing(piece, sheet) {
  const { rotation_deg, x_mm, y_mm } = piece.placement, angle = (rotation_deg * Math.PI) / 180;
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return ([x, y]) => {
    const right = c * x - s * y + x_mm;
    return [sheet.mirrored ? sheet.width_mm - right : right, s * x + c * y + y_mm];
  };
}

/** Where the middle of a piece is on its sheet. */
function middleOnSheet(piece, sheet) {
  const { x, y } = piece.stations[piece.stations.length >> 1];
  return placing(piece, sheet)([x, y]);
}

/** The height of letters on a sheet, by the room that a piece has. */
function letterHeight(plan, sheet) {
  const count = [...plan.pieces, ...plan.spares].filter((piece) => piece.sheet === sheet.sheet).length;
  return Math.min(sheet.width_mm / 46, Math.sqrt((sheet.width_mm * sheet.height_mm) / Math.max(count, 1)) / 5);
}

/** Draw what a sheet is like: its edge, its margin, its defects, and what is kept of it. */
function stockDrawing(plan, sheet) {
  const edge = pathOf(sheet.outline), margin = plan.plan.layout.margin_mm;
  // A line twice as wide as the margin, cut off at the edge, shows the margin.
  return `<defs><clipPath id="stock"><path d="${edge}"/></clipPath>
    <pattern id="hatch" width="4" height="4" patternUnits="userSpaceOnUse" patternTransform="rotate(-45)"><path d="M0 0H4"/></pattern></defs>
    <path class="stock" d="${edge}"/><path class="margin" d="${edge}" clip-path="url(#stock)" stroke-width="${2 * margin}"/>${
    sheet.defects.map((ring) => `<path class="defect" d="${pathOf(ring)}"/>`).join("")}${
    sheet.rest ? `<path class="rest" d="${pathOf(sheet.rest.outline)}"><title>${escaped(sheet.rest.name)}</title></path>` : ""}`;
}

/** Draw a sheet with its pieces; classes say which is chosen, new, or laid before. */
function sheetDrawing(plan, number) {
  const sheet = plan.sheets[number], [wide, high] = [sheet.width_mm, sheet.height_mm];
  const size = letterHeight(plan, sheet);
  const drawn = plan.pieces.flatMap((piece, index) => {
    if (piece.sheet !== sheet.sheet) return [];
    const place = placing(piece, sheet), [x, y] = middleOnSheet(piece, sheet);
    return [`<g data-piece="${escaped(piece.id)}"><path style="fill:${plan.colour[index]}" d="${
      pathOf(piece.outline.map(place))}"/><text x="${x.toFixed(1)}" y="${(-y).toFixed(1)}" font-size="${
      size.toFixed(1)}" dy="${(0.35 * size).toFixed(1)}" stroke-width="${(0.2 * size).toFixed(1)}">${escaped(plan.bears(index))}</text></g>`];
  });
  const spares = plan.spares.filter((spare) => spare.sheet === sheet.sheet).map((spare) => {
    const place = placing(spare, sheet), [x, y] = middleOnSheet(spare, sheet);
    return `<g class="spare"><title>A spare of the kind of ${escaped(spare.of)}</title><path d="${pathOf(spare.outline.map(place))}"/><text x="${
      x.toFixed(1)}" y="${(-y).toFixed(1)}" font-size="${size.toFixed(1)}" dy="${(0.35 * size).toFixed(1)}" stroke-width="${
      (0.2 * size).toFixed(1)}">${escaped(plan.spareName(spare))}</text></g>`;
  });
  return `<svg class="sheet" viewBox="${-wide * 0.005} ${-high - wide * 0.005} ${wide * 1.01} ${high + wide * 0.01}"
    stroke-width="${wide / 700}" role="img" aria-label="${escaped(sheet.name)}">${stockDrawing(plan, sheet)}${
    drawn.join("")}${spares.join("")}<g id="finder"></g></svg>`;
}

/** Ring pieces on a sheet, and name them in letters that can be read at any size. */
function finder(plan, sheet, pieces, zoom) {
  const size = sheet.width_mm / 22 / zoom;
  return pieces.map((piece) => {
    const [x, y] = middleOnSheet(piece, sheet), above = y + 2.6 * size < sheet.height_mm ? 1 : -1;
    const name = plan.nameOf(piece.id), half = Math.max(size, 0.31 * size * name.length);
    return `<circle cx="${x}" cy="${-y}" r="${size}" stroke-width="${0.12 * size}"/>
      <text x="${Math.max(half, Math.min(sheet.width_mm - half, x))}" y="${-y - above * 1.6 * size + 0.35 * size}" font-size="${size}"
      stroke-width="${0.25 * size}">${escaped(name)}</text>`;
  }).join("");
}
