import { escaped } from "../../scripts/html.js";

/** @typedef {import("./plan.js").Plan} Plan */
/** @typedef {import("./plan.js").Values} Values */

/** Join points to the data of a path, y turned to point up. @param {number[][]} points */
function pathOf(points) {
  return `M${points.map(([x, y]) => `${x.toFixed(2)} ${(-y).toFixed(2)}`).join("L")}Z`;
}

/** A sign for over or under that needs no colour. @param {boolean} over */
export function sideSign(over) {
  const ring = over ? '<circle r="6.5" class="over"/>' : '<circle r="5.5" class="under"/>';
  return `<svg class="sign" viewBox="-8 -8 16 16" aria-hidden="true">${ring}</svg>`;
}

/**
 * What a station is at a step: made now, not there before a later one, or neither.
 *
 * @param {Plan} plan
 * @param {Values | null} step
 * @param {Values} station
 */
function stationTime(plan, step, { crossing, partner }) {
  if (!step) return "";
  if ([step.crossings, step.over, step.under].some((crossings) => crossings.includes(crossing))) return " now";
  return plan.stepOf[plan.pieceAt.get(partner)] >= step.step ? " later" : "";
}

/**
 * How a flat piece lies in its drawing, in which lettering has one size on the screen: that which
 * gives each station its room.
 *
 * @param {Values} piece
 */
function frameOf({ outline, stations }) {
  const [xs, ys] = [0, 1].map((axis) => outline.map((point) => point[axis]));
  const [left, right, low, high] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  const wide = Math.max(330, 37 * stations.length), unit = (right - left) / (wide - 24);
  const pad = 12 * unit, box = [left - pad, -high - 26 * unit, right - left + 2 * pad, high - low + 54 * unit];
  return { left, right, low, high, wide, unit, box };
}

/**
 * Draw a flat piece with its stations, the partner at each, its joints and its direction; those of
 * a step stand out.
 *
 * @param {Plan} plan
 * @param {number} number
 * @param {number} chosen
 * @param {Values | null} step
 */
export function pieceDrawing(plan, number, chosen, step) {
  const piece = plan.pieces[number], frame = frameOf(piece), { left, right, high, wide, unit } = frame;
  const holes = piece.stations.filter((station) => station.hole_mm !== null)
    .map(({ x, y, hole_mm }) => `<circle class="hole" cx="${x}" cy="${-y}" r="${hole_mm / 2}"/>`);
  const line = piece.stations.map(({ x, y }) => `${x} ${-y}`).join("L");
  const called = plan.stationNames(number, step);
  const dots = piece.stations.map((station, k) => {
    const time = stationTime(plan, step, station) + (k === chosen ? " chosen" : "");
    return stationDot(station, k, called[k], time, unit);
  });
  const names = piece.stations.map((station) => partnerName(plan, station, stationTime(plan, step, station), frame));
  const ends = [0, 1].map((end) => jointName(plan, piece, end, frame));
  const way = `<text class="way" x="${(left + right) / 2}" y="${-high - 7 * unit}" font-size="${12 * unit}">${
    escaped(plan.bears(number))} &#9654;</text>`;
  return `<div class="scroll"><svg class="piece" viewBox="${frame.box.join(" ")}" role="img"
    style="width:clamp(${0.85 * wide}px, 100%, ${wide}px)" aria-label="Piece ${escaped(plan.named(number))}, flat">
    <path class="outline" style="fill:${plan.colour[number]}" d="${pathOf(piece.outline)}"/>${holes.join("")}
    <path class="line" d="M${line}" stroke-width="${1.5 * unit}" stroke-dasharray="${4 * unit} ${3 * unit}"/>${
    dots.join("")}${names.join("")}${ends.join("")}${way}</svg></div>`;
}

/** @param {Values} station @param {number} k @param {string} name @param {string} time @param {number} unit */
function stationDot({ x, y, over }, k, name, time, unit) {
  const r = 10 * unit;
  return `<g class="station ${over ? "over" : "under"}${time}" data-station="${k}" transform="translate(${x} ${-y})">
    <circle class="reach" r="${2 * r}"/><circle class="halo" r="${1.5 * r}"/>
    <circle class="dot" r="${r}" stroke-width="${2 * unit}"/>
    <text font-size="${11 * unit}" dy="${3.9 * unit}">${name}</text></g>`;
}

/**
 * The piece that a station crosses, as a link to it.
 *
 * @param {Plan} plan
 * @param {Values} station
 * @param {string} time
 * @param {ReturnType<typeof frameOf>} frame
 */
function partnerName(plan, { x, partner }, time, { low, unit }) {
  return `<g class="partner${time}" role="link" tabindex="0" data-piece="${escaped(partner)}">
    <rect x="${x - 17 * unit}" y="${-low - 2 * unit}" width="${34 * unit}" height="${30 * unit}"/>
    <text x="${x}" y="${-low + 15 * unit}" font-size="${11 * unit}">${
      escaped(plan.bears(plan.pieceAt.get(partner)))}</text></g>`;
}

/**
 * The joint at an end of a piece, with its mate as a link; nothing at an open end.
 *
 * @param {Plan} plan
 * @param {Values} piece
 * @param {number} end
 * @param {ReturnType<typeof frameOf>} frame
 */
function jointName(plan, piece, end, { left, right, high, unit }) {
  const joint = piece.joints[end];
  if (joint === null) return "";
  const mate = plan.mate(piece, joint), name = `#${joint} \u2192 ${plan.nameOf(mate)}`;
  const wide = 8 * unit * name.length, x = end ? right : left;
  return `<g role="link" tabindex="0" data-piece="${escaped(mate)}">
    <rect x="${end ? x - wide : x}" y="${-high - 26 * unit}" width="${wide}" height="${30 * unit}"/>
    <text class="joint" x="${x}" y="${-high - 7 * unit}" font-size="${12 * unit}"
    text-anchor="${end ? "end" : "start"}">${escaped(name)}</text></g>`;
}

/**
 * List a piece's stations: how far along, over or under which piece, joint and mate.
 *
 * @param {Plan} plan
 * @param {number} number
 * @param {number} chosen
 * @param {Values | null} step
 */
export function stationTable(plan, number, chosen, step) {
  const piece = plan.pieces[number], far = plan.distances(piece), called = plan.stationNames(number, step);
  const rows = piece.stations.map((station, k) => {
    const { over, partner, joint, hole_mm } = station;
    const mate = joint === null ? "" : `#${joint} ${plan.link(plan.mate(piece, joint))}`;
    const time = stationTime(plan, step, station) + (k === chosen ? " chosen" : "");
    return `<tr data-station="${k}" class="${time}"><td>${called[k]}</td><td>${far[k].toFixed(1)}</td>
      <td>${sideSign(over)}${over ? "over" : "under"}</td><td>${plan.link(partner)}</td>
      <td>${mate}</td><td>${hole_mm ?? ""}</td></tr>`;
  });
  const heads = ["No.", "mm", "passes", "piece", "joint", "hole"].map((head) => `<th>${head}</th>`);
  return `<div class="scroll"><table><thead><tr>${heads.join("")}</tr></thead>
    <tbody>${rows.join("")}</tbody></table></div>`;
}

/**
 * The motion of a piece from its own coordinates to its place on the sheet, which may be mirrored.
 *
 * @param {Values} piece
 * @param {Values} sheet
 */
function placing(piece, sheet) {
  const { rotation_deg, x_mm, y_mm } = piece.placement, angle = (rotation_deg * Math.PI) / 180;
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return (/** @type {number[]} */ [x, y]) => {
    const right = c * x - s * y + x_mm;
    return [sheet.mirrored ? sheet.width_mm - right : right, s * x + c * y + y_mm];
  };
}

/** Where the middle of a piece is on its sheet. @param {Values} piece @param {Values} sheet */
export function middleOnSheet(piece, sheet) {
  const { x, y } = piece.stations[piece.stations.length >> 1];
  return placing(piece, sheet)([x, y]);
}

/**
 * The height of letters on a sheet, by the room that a piece has.
 *
 * @param {Plan} plan
 * @param {Values} sheet
 */
export function letterHeight(plan, sheet) {
  const count = [...plan.pieces, ...plan.spares].filter((piece) => piece.sheet === sheet.sheet).length;
  return Math.min(sheet.width_mm / 46, Math.sqrt((sheet.width_mm * sheet.height_mm) / Math.max(count, 1)) / 5);
}

/**
 * Draw what a sheet is like: its edge, its margin, its defects, and what is kept of it.
 *
 * @param {Plan} plan
 * @param {Values} sheet
 */
function stockDrawing(plan, { outline, defects, rest }) {
  const edge = pathOf(outline), margin = plan.plan.layout.margin_mm;
  const bad = defects.map((ring) => `<path class="defect" d="${pathOf(ring)}"/>`);
  const kept = rest ? `<path class="rest" d="${pathOf(rest.outline)}"><title>${escaped(rest.name)}</title></path>` : "";
  // A line twice as wide as the margin, cut off at the edge, shows the margin.
  return `<defs><clipPath id="stock"><path d="${edge}"/></clipPath>
    <pattern id="hatch" width="4" height="4" patternUnits="userSpaceOnUse" patternTransform="rotate(-45)">
    <path d="M0 0H4"/></pattern></defs><path class="stock" d="${edge}"/>
    <path class="margin" d="${edge}" clip-path="url(#stock)" stroke-width="${2 * margin}"/>${bad.join("")}${kept}`;
}

/**
 * Draw a piece where it lies on its sheet, with its name.
 *
 * @param {Values} piece
 * @param {Values} sheet
 * @param {string} name
 * @param {number} size
 */
function lyingPiece(piece, sheet, name, size, style = "") {
  const [x, y] = middleOnSheet(piece, sheet);
  return `<path${style} d="${pathOf(piece.outline.map(placing(piece, sheet)))}"/>
    <text x="${x.toFixed(1)}" y="${(-y).toFixed(1)}" font-size="${size.toFixed(1)}" dy="${(0.35 * size).toFixed(1)}"
    stroke-width="${(0.2 * size).toFixed(1)}">${escaped(name)}</text>`;
}

/**
 * Draw a sheet with its pieces; classes say which is chosen, new, or laid before.
 *
 * @param {Plan} plan
 * @param {number} number
 */
export function sheetDrawing(plan, number) {
  const sheet = plan.sheets[number], { width_mm: wide, height_mm: high } = sheet, size = letterHeight(plan, sheet);
  const drawn = plan.pieces.flatMap((piece, index) => {
    if (piece.sheet !== sheet.sheet) return [];
    const shape = lyingPiece(piece, sheet, plan.bears(index), size, ` style="fill:${plan.colour[index]}"`);
    return [`<g data-piece="${escaped(piece.id)}">${shape}</g>`];
  });
  const spares = plan.spares.filter((spare) => spare.sheet === sheet.sheet).map((spare) => {
    const shape = lyingPiece(spare, sheet, plan.spareName(spare), size);
    return `<g class="spare"><title>A spare of the kind of ${escaped(spare.of)}</title>${shape}</g>`;
  });
  return `<svg class="sheet" viewBox="${-wide * 0.005} ${-high - wide * 0.005} ${wide * 1.01} ${high + wide * 0.01}"
    stroke-width="${wide / 700}" role="img" aria-label="${escaped(sheet.name)}">${stockDrawing(plan, sheet)}${
    drawn.join("")}${spares.join("")}<g id="finder"></g></svg>`;
}

/**
 * Ring pieces on a sheet, and name them in letters that can be read at any size.
 *
 * @param {Plan} plan
 * @param {Values} sheet
 * @param {Values[]} pieces
 * @param {number} zoom
 */
export function finder(plan, sheet, pieces, zoom) {
  const size = sheet.width_mm / 22 / zoom;
  return pieces.map((piece) => {
    const [x, y] = middleOnSheet(piece, sheet), above = y + 2.6 * size < sheet.height_mm ? 1 : -1;
    const name = plan.nameOf(piece.id), half = Math.max(size, 0.31 * size * name.length);
    const beside = Math.max(half, Math.min(sheet.width_mm - half, x));
    return `<circle cx="${x}" cy="${-y}" r="${size}" stroke-width="${0.12 * size}"/>
      <text x="${beside}" y="${-y - above * 1.6 * size + 0.35 * size}" font-size="${size}"
      stroke-width="${0.25 * size}">${escaped(name)}</text>`;
  }).join("");
}
