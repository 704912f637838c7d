/** Tie the parts together: what is chosen in one of them is shown in all. */
(function () {
  const by = (id) => document.getElementById(id);
  const plan = readPlan(by("data").textContent);
  const memory = makeMemory(plan.data.job), kept = memory.read();
  const last = plan.steps.length;
  const state = {
    stepwise: kept.stepwise === true,
    step: Math.max(1, Math.min(last, Number(kept.step) || 1)),
    piece: -1, station: -1, sheet: 0, zoom: 1, labels: false, follow: true,
    // What is shown alone: its name, and its pieces.
    only: null,
    done: new Set(Array.isArray(kept.done) ? kept.done.filter((step) => step >= 1 && step <= last) : []),
  };
  const space = makeSpace(by("object"), by("labels"), plan, { chosen: (piece) => choose(piece) });
  const shown = { piece: null, sheet: null };

  /** The piece that the panels show: the chosen one, or the first of this step; -1 for none. */
  function subject() {
    if (state.piece >= 0 || !state.stepwise) return state.piece;
    return plan.pieceAt.get(plan.steps[state.step - 1].pieces[0]) ?? -1;
  }

  function remember() {
    memory.write({ stepwise: state.stepwise, step: state.step, done: [...state.done].sort((a, b) => a - b) });
  }

  /** How each piece is shown: step by step, or the whole object with one piece brought out. */
  function codes() {
    return plan.pieces.map((_, piece) => {
      if (piece === state.piece && (!state.stepwise || plan.stepOf[piece] < state.step)) return CHOSEN;
      if (state.only && !state.only.pieces.has(piece)) return HIDDEN;
      if (!state.stepwise) return state.piece < 0 ? PLAIN : FADED;
      const away = state.step - 1 - plan.stepOf[piece];
      return away < 0 ? HIDDEN : away > 0 ? FADED : FRESH;
    });
  }

  function labels(how) {
    const order = plan.pieces.map((piece, index) => ({ piece: index, text: piece.id, code: how[index] }));
    const wanted = order.filter(({ code }) => code >= FRESH || ((state.labels || state.only) && code !== HIDDEN));
    return wanted.sort((a, b) => b.code - a.code).map((label) => ({ ...label, strong: label.code >= FRESH }));
  }

  function update() {
    const how = codes();
    document.body.dataset.step = state.stepwise ? state.step : "";
    document.body.dataset.piece = state.piece < 0 ? "" : plan.pieces[state.piece].id;
    by("mode-whole").setAttribute("aria-pressed", !state.stepwise && !state.only);
    by("only").hidden = !state.only;
    by("only").textContent = state.only ? `${state.only.name} \u00d7` : "";
    by("mode-steps").setAttribute("aria-pressed", state.stepwise);
    by("show-labels").setAttribute("aria-pressed", state.labels);
    by("follow").setAttribute("aria-pressed", state.follow);
    if (space) space.show(how, labels(how), state.station < 0 ? null : [subject(), state.station]);
    showStep();
    showPiece();
    showSheet(how);
    showSteps();
  }

  function showStep() {
    const step = plan.steps[state.step - 1];
    by("slider").value = state.step;
    by("step-number").textContent = `${state.step} / ${last}`;
    by("done").checked = state.done.has(state.step);
    document.body.classList.toggle("stepwise", state.stepwise);
    by("back").disabled = state.stepwise && state.step === 1;
    by("forward").disabled = state.stepwise && state.step === last;
    by("step-text").innerHTML = `${chips(step.pieces)} <span>${escaped(step.text)}</span>`;
  }

  function chips(ids) {
    return ids.map((id) => `<button type="button" class="chip" data-piece="${escaped(id)}">${escaped(plan.taken(plan.pieces[plan.pieceAt.get(id)]))}</button>`).join(" ");
  }

  function showPiece() {
    const chosen = subject(), key = `${chosen}:${state.station}`;
    if (shown.piece === key) return;
    shown.piece = key;
    const panel = by("panel-piece");
    if (chosen < 0) {
      panel.innerHTML = `<p class="hint">Choose a piece: tap it on the object or on its sheet, or search for its label.</p>`;
      return;
    }
    const piece = plan.pieces[chosen], thread = plan.thread(piece), bunch = plan.bunchName(thread);
    const size = [0, 1].map((k) => piece.outline.map((point) => point[k])).map((values) => Math.max(...values) - Math.min(...values));
    panel.innerHTML = `<h2><span class="swatch" style="background:${plan.colour[chosen]}"></span>${escaped(plan.taken(piece))}</h2>
      <p>Piece ${thread.pieces.indexOf(piece.id) + 1} of ${thread.pieces.length} of thread ${escaped(thread.label)}${
        bunch && ` (${bunch})`}, ${size[0].toFixed(0)} × ${size[1].toFixed(0)} mm.
        <button type="button" class="link" data-sheet="${plan.sheetAt.get(piece.sheet)}">Sheet ${piece.sheet}</button>,
        <button type="button" class="link" data-step="${plan.stepOf[chosen] + 1}">step ${plan.stepOf[chosen] + 1}</button>.</p>
      ${pieceDrawing(plan, chosen, state.station)}
      <p class="hint">${sideSign(true)} over ${sideSign(false)} under, outer face up, &#9654; along the thread. Millimetres from station 0.</p>
      ${stationTable(plan, chosen, state.station)}`;
    const row = panel.querySelector("tr.chosen");
    if (row) row.scrollIntoView({ block: "nearest" });
  }

  /** Show the sheet that is turned up, if anybody sees it. */
  function showSheet(how, printing = false) {
    const panel = by("panel-sheet"), sheet = plan.sheets[state.sheet];
    if (panel.hidden && !printing) return;
    if (shown.sheet !== state.sheet) {
      shown.sheet = state.sheet;
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
    const names = ["later", "", state.stepwise ? "laid" : "", "fresh", "chosen"];
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
      state.stepwise ? "Ringed: this step. Pale: in place. White: still to come." : "",
    ].filter(Boolean).join(" ");
  }

  function showSteps() {
    const panel = by("panel-steps");
    if (!panel.firstChild) {
      panel.innerHTML = `<p id="progress"></p><progress max="${last}"></progress><ol>${plan.steps.map((step, k) => `
        <li data-step="${k + 1}"><label><input type="checkbox" aria-label="Step ${k + 1} done"></label>
        <button type="button" data-step="${k + 1}"><b>${k + 1}</b> ${escaped(step.text)}</button></li>`).join("")}</ol>`;
    }
    by("progress").textContent = `${state.done.size} of ${last} steps done`;
    panel.querySelector("progress").value = state.done.size;
    for (const item of panel.querySelectorAll("li")) {
      const step = Number(item.dataset.step), here = state.stepwise && step === state.step;
      const box = item.querySelector("input");
      if (box.checked !== state.done.has(step)) box.checked = state.done.has(step);
      if (item.classList.contains("here") !== here) item.classList.toggle("here", here);
      if (here && !panel.hidden) item.scrollIntoView({ block: "nearest" });
    }
  }

  function choose(piece, station = -1, look = false) {
    state.piece = piece;
    state.station = station;
    if (piece >= 0) {
      if (state.only && !state.only.pieces.has(piece)) state.only = null;
      state.sheet = plan.sheetAt.get(plan.pieces[piece].sheet);
      // A piece that is laid later is shown where it is laid.
      if (state.stepwise && plan.stepOf[piece] >= state.step) state.step = plan.stepOf[piece] + 1;
      if (by("panel-steps").hidden === false) openTab("piece");
    }
    remember();
    update();
    if (space && look && state.follow && piece >= 0) space.face(piece, station);
  }

  /** Point out a station of the piece that the panels show. */
  function mark(station) {
    state.station = state.station === station ? -1 : station;
    update();
    if (space && state.follow && state.station >= 0) space.face(subject(), station);
  }

  /** Show some pieces alone, such as those of a thread; of a sheet, with where they lie on it. */
  function isolate({ name, members, sheet }) {
    state.only = { name, pieces: new Set(members) };
    state.stepwise = false;
    state.piece = state.station = -1;
    state.sheet = sheet ?? plan.sheetAt.get(plan.pieces[members[0]].sheet);
    remember();
    if (sheet === undefined) update();
    else openTab("sheet");
  }

  function showAll() {
    state.only = null;
    update();
  }

  /** Go to what was found. */
  function take({ piece, station = -1, members, step, ...more }) {
    find(false);
    if (members) isolate({ members, ...more });
    else if (step !== undefined) goTo(step);
    else {
      if (by("panel-steps").hidden === false) openTab("piece");
      choose(piece, station, true);
    }
  }

  function goTo(step) {
    state.stepwise = true;
    state.only = null;
    state.step = Math.max(1, Math.min(last, step));
    state.piece = state.station = -1;
    const piece = plan.pieceAt.get(plan.steps[state.step - 1].pieces[0]);
    if (piece !== undefined) state.sheet = plan.sheetAt.get(plan.pieces[piece].sheet);
    remember();
    update();
    if (space && state.follow && piece !== undefined) space.face(piece, -1);
  }

  function setDone(step, done) {
    if (done) state.done.add(step);
    else state.done.delete(step);
    remember();
    update();
  }

  function openTab(name) {
    for (const tab of ["piece", "sheet", "steps"]) {
      by(`tab-${tab}`).setAttribute("aria-selected", tab === name);
      by(`panel-${tab}`).hidden = tab !== name;
    }
    update();
  }

  let found = [];

  function find(open) {
    const hits = open ? plan.search(by("query").value, 40) : [];
    const box = by("found");
    const none = open && !hits.length && by("query").value.trim();
    box.hidden = !hits.length && !none;
    by("query").setAttribute("aria-expanded", !box.hidden);
    box.innerHTML = none ? "<p>Nothing is called so. Try A3, thread A, #12, crossing 12, kind 3, sheet 2 or step 7.</p>" : hits.map(({ piece, name, why }, k) => {
      const text = piece === undefined ? `<strong>${escaped(name)}</strong>` : `<b>${escaped(plan.pieces[piece].id)}</b>`;
      const own = piece === undefined ? "" : ` data-piece="${escaped(plan.pieces[piece].id)}"`;
      return `<button type="button" role="option" data-found="${k}"${own}>${text} <small>${escaped(why)}</small></button>`;
    }).join("");
    found = hits;
    return hits;
  }

  // Whatever is tapped says by its data what it stands for.
  document.addEventListener("click", (event) => {
    const hit = event.target.closest("[data-found], [data-piece], [data-station], [data-sheet], [data-turn], [data-zoom], button[data-step]");
    if (!event.target.closest("#search")) find(false);
    if (!hit || hit === document.body) return;
    const { piece, station, sheet, turn, zoom, step } = hit.dataset;
    if (hit.dataset.found !== undefined) take(found[Number(hit.dataset.found)]);
    else if (piece !== undefined) {
      find(false);
      choose(plan.pieceAt.get(piece), -1, true);
    } else if (station !== undefined) mark(Number(station));
    else if (sheet !== undefined) openTab("sheet");
    else if (step !== undefined) goTo(Number(step));
    else if (zoom !== undefined) {
      state.zoom = Math.max(1, Math.min(16, state.zoom * Number(zoom)));
      update();
    } else {
      state.sheet = (state.sheet + Number(turn) + plan.sheets.length) % plan.sheets.length;
      update();
    }
  });
  by("panel-steps").addEventListener("change", (event) => {
    setDone(Number(event.target.closest("li").dataset.step), event.target.checked);
  });
  by("search").addEventListener("submit", (event) => {
    event.preventDefault();
    const hits = find(true);
    if (hits.length) take(hits[0]);
  });
  by("query").addEventListener("input", () => find(true));
  by("slider").addEventListener("input", () => goTo(Number(by("slider").value)));
  by("back").addEventListener("click", () => goTo(state.stepwise ? state.step - 1 : state.step));
  by("forward").addEventListener("click", () => goTo(state.stepwise ? state.step + 1 : state.step));
  by("done").addEventListener("change", () => setDone(state.step, by("done").checked));
  by("mode-whole").addEventListener("click", () => {
    state.stepwise = false;
    remember();
    showAll();
  });
  by("only").addEventListener("click", showAll);
  by("mode-steps").addEventListener("click", () => goTo(state.step));
  for (const [id, name] of [["show-labels", "labels"], ["follow", "follow"]])
    by(id).addEventListener("click", () => {
      state[name] = !state[name];
      update();
    });
  by("home").addEventListener("click", () => space && space.home());
  for (const tab of ["piece", "sheet", "steps"]) by(`tab-${tab}`).addEventListener("click", () => openTab(tab));
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape") {
      find(false);
      state.only = null;
      choose(-1);
    } else if (event.target.matches("input[type=search], input[type=range]") || event.ctrlKey || event.metaKey || event.altKey) return;
    else if (event.key === "ArrowRight") goTo(state.stepwise ? state.step + 1 : state.step);
    else if (event.key === "ArrowLeft") goTo(state.stepwise ? state.step - 1 : state.step);
    else if (event.key === "Home") goTo(1);
    else if (event.key === "End") goTo(last);
    else if (event.key === "d") setDone(state.step, !state.done.has(state.step));
    else if (event.key === "/") {
      event.preventDefault();
      by("query").focus();
    }
  });

  window.addEventListener("beforeprint", () => showSheet(codes(), true));
  by("slider").max = last;
  by("facts").textContent = `${plan.pieces.length} pieces, ${plan.spares.length ? `${plan.spares.length} spare${plan.spares.length === 1 ? "" : "s"}, ` : ""}${plan.plan.joints.length} joints, ${plan.sheets.length} sheet${plan.sheets.length === 1 ? "" : "s"}`;
  // Bunches are named by their colours where no colour is that of two.
  const bunches = new Map(), bunchOf = new Map();
  let told = true;
  plan.pieces.forEach((piece, index) => {
    const name = plan.bunchName(plan.thread(piece));
    if (name && !bunches.has(name)) bunches.set(name, plan.colour[index]);
    for (const [colour] of plan.data.colours[index]) {
      told = told && (bunchOf.get(colour) ?? name) === name;
      bunchOf.set(colour, name);
    }
  });
  // Groups have numbers for names, and say once what they are.
  const grouped = bunches.size > 2 ? "<li>Colour groups</li>" : "";
  by("legend").innerHTML = !told || bunches.size > 6 ? "" : grouped + [...bunches].map(([name, colour]) =>
    `<li><span class="swatch" style="background:${colour}"></span>${name.replace("colour group ", "")}</li>`).join("");
  by("legend").hidden = !by("legend").firstChild;
  if (space) {
    const dark = matchMedia("(prefers-color-scheme: dark)"), paper = () => space.paper(getComputedStyle(by("space")).getPropertyValue("--paper").trim());
    dark.addEventListener("change", paper);
    window.addEventListener("beforeprint", () => space.draw());
    paper();
  } else {
    document.body.classList.add("flat");
    by("no-space").hidden = false;
    by("no-space").textContent = typeof THREE === "undefined"
      ? "This page was made without its 3-D library: it shows pieces, sheets and steps, but not the object."
      : "This browser cannot show 3-D (WebGL is off or missing); pieces, sheets and steps work without it.";
  }
  update();
  // For those who test the page or build on it.
  window.fabweave = { plan, state, lens: space && space.lens, draw: () => space && space.draw(), codes };
})();
