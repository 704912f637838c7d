/** What to do at a step: its pieces, its text, what is fastened for good, and how long it takes. */
function stepCard(plan, clock, number) {
  const step = plan.steps[number - 1];
  const chips = step.pieces.map((id) => `<button type="button" class="chip" data-piece="${escaped(id)}">${escaped(plan.takenFor(id))}</button>`);
  const ring = (step.ring || []).map((id) => `<span class="chip">${escaped(id)}</span>`);
  const places = plan.fastenings(step).map((crossing) => {
    const joint = (plan.jointsAt.get(crossing.id) || [])[0];
    const side = ({ piece }) => (joint && joint.pieces.includes(piece) ? [...new Set(joint.pieces)] : [piece]).map(plan.link).join(" and ");
    return `${side(crossing.over)} over ${side(crossing.under)}${joint ? ` (joint #${joint.id})` : ""}${crossing.count > 1 ? `, ${crossing.count} fasteners` : ""}${crossing.hang ? ", which carries a cord or a foot" : ""}`;
  });
  const { step: leaving, until, told } = plan.data.former, out = leaving === number ? `<p>${escaped(told)}</p>` : "";
  return `${until === number ? out : ""}<p>${[...chips, ...ring].join(" ")} ${plan.linked(step.text)} <small class="hint">${clock.step(number)}</small></p>${
    places.length ? `<p class="fasten"><b>Fasten for good,</b> all layers are there: ${places.join("; ")}.</p>` : ""}${until === number ? "" : out}`;
}

/** The panels at the side: a piece, a sheet, the list of steps. Each is drawn when it is seen. */
function makePanels(by, plan, clock, state) {
  const last = plan.steps.length;
  const shown = { piece: null, sheet: null, done: new Set(), here: 0 };

  function showPiece(chosen) {
    const step = state.stepwise ? plan.steps[state.step - 1] : null;
    const key = `${chosen}:${state.station}:${step && step.step}:${state.scheme}`;
    if (shown.piece === key) return;
    shown.piece = key;
    const panel = by("panel-piece");
    if (chosen < 0) {
      const places = plan.worst.map(({ piece, crossing, text }) => {
        const at = plan.pieces[plan.pieceAt.get(piece)].stations.findIndex((station) => station.crossing === crossing);
        return `<li>${plan.link(piece, at)} at crossing ${crossing} ${escaped(text)}</li>`;
      });
      panel.innerHTML = `<p class="hint">Choose a piece: tap it on the object or on its sheet, or search for its label.</p>${
        places.length ? `<h3>Hardest places</h3><ol id="worst">${places.join("")}</ol>` : ""}`;
      return;
    }
    const piece = plan.pieces[chosen], thread = plan.thread(piece);
    const size = [0, 1].map((k) => piece.outline.map((point) => point[k])).map((values) => Math.max(...values) - Math.min(...values));
    panel.innerHTML = `<h2><span class="swatch" style="background:${plan.colour[chosen]}"></span>${escaped(plan.named(chosen))}</h2>
      <p>Piece ${thread.pieces.indexOf(piece.id) + 1} of ${thread.pieces.length} of thread ${escaped(thread.label)}${
        plan.bunchWords(thread)}, ${size[0].toFixed(0)} × ${size[1].toFixed(0)} mm.
        <button type="button" class="link" data-sheet="${plan.sheetAt.get(piece.sheet)}">Sheet ${piece.sheet}</button>,
        <button type="button" class="link" data-step="${plan.stepOf[chosen] + 1}">step ${plan.stepOf[chosen] + 1}</button>.</p>
      ${pieceDrawing(plan, chosen, state.station, step)}
      <p class="hint">${sideSign(true)} over ${sideSign(false)} under, outer face up, &#9654; along the thread.${
        step ? " Ringed: made at this step. Grey: not before a later one." : ""} Millimetres from station 0.</p>
      ${stationTable(plan, chosen, state.station, step)}`;
    const row = panel.querySelector("tr.chosen");
    if (row) row.scrollIntoView({ block: "nearest" });
  }

  /** Show the sheet that is turned up, if anybody sees it. */
  function showSheet(how, printing = false) {
    const panel = by("panel-sheet"), sheet = plan.sheets[state.sheet];
    if (panel.hidden && !printing) return;
    if (shown.sheet !== `${state.sheet} ${state.scheme}`) {
      shown.sheet = `${state.sheet} ${state.scheme}`;
      panel.innerHTML = `<p class="turner"><button type="button" data-turn="-1" aria-label="Previous sheet">&#9664;</button>
        <span>Sheet ${sheet.sheet} of ${plan.sheets.length}<br><small>${sheet.width_mm} × ${sheet.height_mm} mm${
          sheet.stock ? `, ${escaped(sheet.stock)}` : ""}</small></span>
        <button type="button" data-turn="1" aria-label="Next sheet">&#9654;</button>
        <button type="button" data-zoom="0.5" aria-label="Zoom out">&minus;</button>
        <button type="button" data-zoom="2" aria-label="Zoom in">+</button></p><div id="sheet-box">${sheetDrawing(plan, state.sheet)}</div>
        <p class="hint" id="sheet-hint"></p>`;
    }
    const box = by("sheet-box"), drawing = box.firstChild;
    if (shown.zoom !== state.zoom || !drawing.style.width) drawing.style.width = `${100 * state.zoom}%`;
    shown.zoom = state.zoom;
    const letter = (letterHeight(plan, sheet) * drawing.clientWidth) / sheet.width_mm;
    drawing.classList.toggle("dense", letter < 7);
    const names = ["later", "", state.stepwise ? "laid" : "", "fresh", "chosen", "later"];
    for (const group of panel.querySelectorAll("g[data-piece]"))
      group.setAttribute("class", group.dataset.piece === document.body.dataset.piece ? "chosen" : names[how[plan.pieceAt.get(group.dataset.piece)]]);
    const sought = plan.pieces.filter((piece, index) => piece.sheet === sheet.sheet && (index === state.piece || how[index] === FRESH));
    by("finder").innerHTML = finder(plan, sheet, sought, state.zoom);
    const key = `${state.zoom} ${sought.map((piece) => piece.id)}`;
    if (sought.length && state.zoom > 1 && !panel.hidden && shown.sought !== key) {
      const scale = drawing.clientWidth / sheet.width_mm, [x, y] = middleOnSheet(sought[0], sheet);
      box.scrollTo(x * scale - box.clientWidth / 2, (sheet.height_mm - y) * scale - box.clientHeight / 2);
    }
    shown.sought = key;
    by("sheet-hint").textContent = [
      sheet.mirrored ? "The pieces lie on their outer faces: their inner faces are engraved." : "",
      sheet.defects.length ? "Hatched: defects." : "",
      sheet.rest ? `Dashed: ${sheet.rest.name}, to be kept.` : "",
      state.stepwise ? "Ringed: this step. Grey: in place. White: still to come." : "",
    ].filter(Boolean).join(" ");
  }

  /** Show the list of steps, if anybody sees it: of thousands only what has changed is touched. */
  function showSteps() {
    const panel = by("panel-steps");
    if (panel.hidden) return;
    if (!panel.firstChild) {
      panel.innerHTML = `<p id="progress"></p><progress max="${last}" aria-labelledby="progress"></progress><ol>${plan.steps.map((step, k) => `
        <li data-step="${k + 1}"><label><input type="checkbox" aria-label="Step ${k + 1} done"></label>
        <button type="button" data-step="${k + 1}"><b>${k + 1}</b> ${escaped(plan.told(step.text))}</button></li>`).join("")}</ol>`;
    }
    by("progress").textContent = `${state.done.size} of ${last} steps done. ${leftText()} Sorting is counted.`;
    panel.querySelector("progress").value = state.done.size;
    const rows = panel.querySelector("ol").children;
    for (const step of [...shown.done, ...state.done])
      if (shown.done.has(step) !== state.done.has(step)) rows[step - 1].querySelector("input").checked = state.done.has(step);
    shown.done = new Set(state.done);
    const here = state.stepwise ? state.step : 0;
    if (shown.here) rows[shown.here - 1].classList.remove("here");
    if (here) {
      rows[here - 1].classList.add("here");
      if (shown.here !== here) rows[here - 1].scrollIntoView({ block: "nearest" });
    }
    shown.here = here;
  }

  /** How long all steps take that are not done. */
  function leftText() {
    if (state.done.size === last) return "All is done.";
    return `${clock.left(state.done)} left of ${clock.all()}.`;
  }

  return { showPiece, showSheet, showSteps, leftText };
}
