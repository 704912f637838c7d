/** While a smaller share of all pieces is in place, the table is seen, and what is to come, as in the manual. */
const EARLY = 0.25;
/** While steps play, each is shown for so long. */
const PLAY_MS = 2600;

/** Tie the parts together: what is chosen in one of them is shown in all. */
(function () {
  const by = (id) => document.getElementById(id);
  const plan = readPlan(by("data").textContent), clock = makeClock(plan);
  const memory = makeMemory(plan.data.job), kept = memory.read();
  const last = plan.steps.length, schemes = Object.keys(colourSchemes(plan));
  const state = {
    stepwise: kept.stepwise === true,
    step: Math.max(1, Math.min(last, Number(kept.step) || 1)),
    piece: -1, station: -1, sheet: 0, zoom: 1, labels: false, follow: true, later: 0, table: true,
    scheme: schemes.includes(kept.scheme) ? kept.scheme : "job",
    // What is shown alone: its name, and its pieces.
    only: null,
    done: new Set(Array.isArray(kept.done) ? kept.done.filter((step) => step >= 1 && step <= last) : []),
  };
  const space = makeSpace(by("object"), by("labels"), plan, {
    chosen: (piece) => choose(piece),
    seen: (words) => (by("spoken").textContent = words),
  });
  const panels = makePanels(by, plan, clock, state), finding = makeFinding(by, plan, take);
  let colouring, playing = 0;

  /** The piece that the panels show: the chosen one, or the first of this step; -1 for none. */
  function subject() {
    if (state.piece >= 0 || !state.stepwise) return state.piece;
    return plan.pieceAt.get(plan.steps[state.step - 1].pieces[0]) ?? -1;
  }

  /** Keep what was done, and say in the address what is shown. */
  function remember() {
    memory.write({ stepwise: state.stepwise, step: state.step, scheme: state.scheme, done: [...state.done].sort((a, b) => a - b) });
    const parts = [state.stepwise ? `step=${state.step}` : "", state.piece < 0 ? "" : `piece=${plan.pieces[state.piece].id}`].filter(Boolean);
    const address = `#${parts.join("&")}`;
    if (location.hash === address || (!parts.length && !location.hash)) return;
    try {
      history.replaceState(null, "", address);
    } catch (error) {
      // Some browsers refuse that for files; the page works without.
    }
  }

  /** Show what the address names; what it does not name stays as it was. */
  function readAddress() {
    const asked = new URLSearchParams(location.hash.slice(1)), step = Number(asked.get("step"));
    const piece = plan.pieceAt.get(asked.get("piece"));
    if (Number.isInteger(step) && step >= 1 && step <= last) goTo(step);
    else if (asked.has("piece")) state.stepwise = false;
    if (piece !== undefined) choose(piece, -1, true);
  }

  /** While few pieces are in place, the object stands on the table, and what is to come is a ghost. */
  const early = () => state.table && state.stepwise && plan.stepOf.filter((step) => step < state.step - 1).length < EARLY * plan.pieces.length;

  /** How each piece is shown: step by step, or the whole object with one piece brought out. */
  function codes() {
    const veiled = state.later || early();
    return plan.pieces.map((_, piece) => {
      if (piece === state.piece && (!state.stepwise || plan.stepOf[piece] < state.step)) return CHOSEN;
      if (state.only && !state.only.pieces.has(piece)) return HIDDEN;
      if (!state.stepwise) return state.piece < 0 ? PLAIN : FADED;
      const away = state.step - 1 - plan.stepOf[piece];
      return away < 0 ? (veiled ? LATER : HIDDEN) : away > 0 ? FADED : FRESH;
    });
  }

  function labels(how) {
    const order = plan.pieces.map((_, index) => ({ piece: index, text: plan.bears(index), code: how[index] }));
    const out = (code) => code === FRESH || code === CHOSEN;
    const wanted = order.filter(({ code }) => out(code) || ((state.labels || state.only) && code !== HIDDEN && code !== LATER));
    return wanted.sort((a, b) => b.code - a.code).map((label) => ({ ...label, strong: out(label.code) }));
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
    by("play").setAttribute("aria-pressed", playing > 0);
    by("play").textContent = playing ? "Pause" : "Play";
    if (space) space.stand(early(), state.table && state.stepwise && state.step < plan.data.former.until);
    if (space) space.show(how, labels(how), state.station < 0 ? null : [subject(), state.station]);
    showStep();
    panels.showPiece(subject());
    panels.showSheet(how);
    panels.showSteps();
  }

  function showStep() {
    by("slider").value = state.step;
    by("step-number").textContent = `${state.step} / ${last}`;
    by("done").checked = state.done.has(state.step);
    document.body.classList.toggle("stepwise", state.stepwise);
    by("back").disabled = state.stepwise && state.step === 1;
    by("forward").disabled = state.stepwise && state.step === last;
    by("left").textContent = panels.leftText();
    if (by("step-text").dataset.step === String(state.step)) return;
    by("step-text").dataset.step = state.step;
    by("step-text").innerHTML = stepCard(plan, clock, state.step);
    by("step-text").scrollTop = 0;
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
    play(false);
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
    if (members) isolate({ members, ...more });
    else if (step !== undefined) goTo(step);
    else {
      if (by("panel-steps").hidden === false) openTab("piece");
      choose(piece, station, true);
    }
  }

  /** Show a step; those who ask for it see its pieces come. */
  function goTo(step) {
    const { stepwise, step: before } = state;
    state.stepwise = true;
    state.only = null;
    state.step = Math.max(1, Math.min(last, step));
    state.piece = state.station = -1;
    const pieces = plan.steps[state.step - 1].pieces.map((id) => plan.pieceAt.get(id)), [piece] = pieces;
    if (piece !== undefined) state.sheet = plan.sheetAt.get(plan.pieces[piece].sheet);
    remember();
    update();
    follow();
    if (!stepwise || state.step === before + 1) show();
  }

  /** See this step from where the manual shows it; a step that it does not show, from where it is seen. */
  function follow() {
    const view = plan.data.views_deg[state.step - 1], piece = plan.pieceAt.get(plan.steps[state.step - 1].pieces[0]);
    if (!space || !state.follow || !state.stepwise || piece === undefined) return;
    if (view) space.follow(piece, view);
    else space.face(piece, -1);
  }

  /** Let the pieces of this step come to their places. */
  function show() {
    const step = plan.steps[state.step - 1];
    if (space && state.stepwise) space.fly(step, step.pieces.map((id) => plan.pieceAt.get(id)));
  }

  /** Go from step to step, or stop. */
  function play(on) {
    clearInterval(playing);
    playing = 0;
    if (!on) return;
    playing = setInterval(() => {
      goTo(state.step + 1);
      if (state.step === last) play(false), update();
    }, PLAY_MS);
    goTo(state.step < last ? state.step : 1);
    show();
  }

  /** Go to a step as somebody asks: what plays, stops. */
  function visit(step) {
    play(false);
    goTo(step);
  }

  const next = (by) => visit(state.stepwise ? state.step + by : state.step);

  function setDone(step, done) {
    if (done === state.done.has(step)) return;
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

  /** Colour everything by what somebody chose. */
  function paint(scheme) {
    state.scheme = scheme;
    colouring = colourBy(plan, scheme);
    plan.colour = colouring.flat;
    by("colours").value = scheme;
    by("legend").innerHTML = legendOf(plan, colouring);
    if (space) space.colour(colouring.runs);
  }

  // Whatever is tapped says by its data what it stands for.
  document.addEventListener("click", (event) => {
    const hit = event.target.closest("[data-found], [data-piece], [data-station], [data-sheet], [data-turn], [data-zoom], [data-group], [data-move], button[data-step]");
    if (!event.target.closest("#search")) finding.close();
    if (!event.target.closest("#view")) by("view").open = false;
    if (!hit || hit === document.body) return;
    const { piece, at, station, sheet, turn, zoom, step, group, move } = hit.dataset;
    if (hit.dataset.found !== undefined) finding.choose(Number(hit.dataset.found));
    else if (piece !== undefined) {
      finding.close();
      choose(plan.pieceAt.get(piece), Number(at ?? -1), true);
    } else if (station !== undefined) mark(Number(station));
    else if (sheet !== undefined) openTab("sheet");
    else if (step !== undefined) visit(Number(step));
    else if (move !== undefined) space && space.move(move);
    else if (group !== undefined) isolate(colouring.groups[Number(group)]);
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
  by("slider").addEventListener("input", () => visit(Number(by("slider").value)));
  by("back").addEventListener("click", () => next(-1));
  by("forward").addEventListener("click", () => next(1));
  by("play").addEventListener("click", () => {
    play(!playing);
    update();
  });
  by("done").addEventListener("change", () => setDone(state.step, by("done").checked));
  by("mode-whole").addEventListener("click", () => {
    play(false);
    state.stepwise = false;
    remember();
    showAll();
  });
  by("only").addEventListener("click", showAll);
  by("mode-steps").addEventListener("click", () => visit(state.step));
  for (const [id, name] of [["show-labels", "labels"], ["follow", "follow"]])
    by(id).addEventListener("click", () => {
      state[name] = !state[name];
      update();
      if (name === "follow") follow();
    });
  by("colours").addEventListener("change", () => {
    paint(by("colours").value);
    remember();
    update();
  });
  by("help").addEventListener("click", () => by("keys").showModal());
  for (const tab of ["piece", "sheet", "steps"]) by(`tab-${tab}`).addEventListener("click", () => openTab(tab));
  if (space) {
    by("explode").addEventListener("input", () => space.spread(Number(by("explode").value)));
    by("cut").addEventListener("input", () => space.cut(Number(by("cut").value)));
    const ghost = () => {
      state.later = Number(by("later").value);
      space.ghost(Number(by("there").value), state.later);
      update();
    };
    for (const id of ["there", "later"]) by(id).addEventListener("input", ghost);
    const known = Boolean(plan.data.space.let_go), letGo = () => {
      by("let-go").querySelector("output").textContent = `\u00d7${by("gone").value}`;
      space.letGo(Number(by("gone").value));
    };
    for (const id of ["let-go", "swaying"]) by(id).hidden = !known;
    by("gone").addEventListener("input", letGo);
    by("sway").addEventListener("change", () => space.sway(by("sway").checked));
    by("table").addEventListener("change", () => {
      state.table = by("table").checked;
      update();
    });
    by("parallel").addEventListener("change", () => space.straighten(by("parallel").checked));
    by("home").addEventListener("click", () => {
      for (const id of ["explode", "cut", "there", "later", "gone"]) by(id).value = by(id).defaultValue;
      by("sway").checked = false;
      space.sway(false);
      letGo();
      ghost();
      space.spread(0);
      space.cut(0);
      space.move("home");
    });
  }
  const keys = {
    ArrowRight: () => next(1), ArrowLeft: () => next(-1), PageDown: () => next(1), PageUp: () => next(-1),
    Home: () => visit(1), End: () => visit(last),
    d: () => setDone(state.step, !state.done.has(state.step)),
    p: () => by("play").click(), a: show, l: () => by("show-labels").click(),
    "/": () => by("query").focus(), "?": () => by("keys").showModal(),
  };
  document.addEventListener("keydown", (event) => {
    if (by("keys").open || event.defaultPrevented) return;
    if (event.key === "Escape") {
      finding.close();
      by("view").open = false;
      state.only = null;
      choose(-1);
    } else if (event.target.matches("input[type=search], input[type=range], select") || event.ctrlKey || event.metaKey || event.altKey) return;
    else if (event.key === "Enter" && event.target.matches("[role=link]")) choose(plan.pieceAt.get(event.target.dataset.piece), -1, true);
    else if (keys[event.key]) {
      event.preventDefault();
      keys[event.key]();
    }
  });

  // On paper a canvas is blank: a picture stands for it, and is there before paper is laid out.
  window.addEventListener("beforeprint", () => {
    panels.showSheet(codes(), true);
    if (space) by("picture").src = space.picture(2000);
  });
  window.addEventListener("afterprint", () => by("picture").removeAttribute("src"));
  window.addEventListener("hashchange", readAddress);
  by("slider").max = last;
  for (const option of by("colours").options) option.hidden = !schemes.includes(option.value);
  by("facts").textContent = `${plan.pieces.length} pieces, ${plan.spares.length ? `${plan.spares.length} spare${plan.spares.length === 1 ? "" : "s"}, ` : ""}${plan.plan.joints.length} joints, ${plan.sheets.length} ${plan.sheets[0].roll_mm ? "roll" : "sheet"}${plan.sheets.length === 1 ? "" : "s"}`;
  if (space) {
    const dark = matchMedia("(prefers-color-scheme: dark)"), paper = () => space.paper(getComputedStyle(by("space")).getPropertyValue("--paper").trim());
    dark.addEventListener("change", paper);
    paper();
  } else {
    document.body.classList.add("flat");
    by("no-space").hidden = false;
    by("no-space").textContent = "This browser cannot show 3-D (WebGL 2 is off or missing); pieces, sheets and steps work without it.";
  }
  paint(state.scheme);
  update();
  readAddress();
  // For those who test the page or build on it.
  window.fabweave = {
    plan, state, clock, codes,
    get lens() { return space && space.lens; },
    draw: () => space && space.draw(),
    pick: (x, y) => (space ? space.pick(x, y) : -1),
  };
})();
