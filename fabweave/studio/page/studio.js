/** After so long without a change, pieces, sheets and steps are made; an answer is late after so long. */
const REST = 500, LATE_MS = 900;
/** After so long more, sheets are nested as they will be. */
const FINER = 2500;
/** So many states can be undone, and so many variants are kept. */
const MOST_STATES = 200, MOST_KEPT = 24;
/** What another model has no use for. */
const OF_THE_MODEL = ["leave_out", "rim", "remesh", "refine", "up", "hang", "load", "bodies", "twists", "layout", "pin"];

/** Tie the page together: a state is a mesh and options, as a job.toml has them. */
(async function () {
  const by = (id) => document.getElementById(id), base = location.pathname;
  const memory = (name, value) => {
    try {
      if (value === undefined) return JSON.parse(sessionStorage.getItem(base + name));
      sessionStorage.setItem(base + name, JSON.stringify(value));
    } catch (error) { /* A full or forbidden store: the page works without. */ }
    return null;
  };
  const given = await (await fetch("state")).json();
  const states = memory("states") || [{ mesh: given.mesh, options: given.options }];
  let at = Math.min(memory("at") ?? 0, states.length - 1), state = states[at], shelf = memory("shelf") || [];
  let socket, number = 0, retry = 0, tool = "choose", yarns = false, chosen = -1;
  // What was seen last: the header, its arrays, triangles by their digest; and what is planned.
  let seen = null, arrays = {}, have = "", plan = {};
  const flight = { look: 0, plan: 0, make: 0, designs: 0 };
  let since = 0, dirty = false, resting = 0, late = 0, finer = 0;
  const scene = makeScene(by("object"), { tapped, arrowAt });
  by("no-space").hidden = Boolean(scene);
  const upArrow = scene && makeUpArrow(scene, by("arrow"), {
    turn: () => seen.turn, leaning: (text) => hint(`Up: ${text}`),
    chosen: (up) => change({ mesh: state.mesh, options: { ...state.options, up } }),
    usual: () => state.options.up && change({ mesh: state.mesh, options: { ...state.options, up: null } }),
  });

  // ---- what is asked, and what is answered

  function connect() {
    socket = new WebSocket(`ws://${location.host}${base}live`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      retry = 0;
      flight.look = flight.plan = 0;
      hint("");
      look();
    };
    socket.onmessage = ({ data }) => answered(data);
    socket.onclose = () => {
      hint("The studio does not answer. Is it still running? The page tries again.", true);
      setTimeout(connect, Math.min(8000, 500 * 2 ** retry++));
    };
  }

  function ask(to, more = {}) {
    if (!socket || socket.readyState !== WebSocket.OPEN) return;
    number += 1;
    if (!more.stop) flight[to] = number;
    socket.send(JSON.stringify({ n: number, to, ...state, ...more }));
  }

  /** Ask how the object looks; while an answer is under way, as soon as that is there, or late. */
  function look() {
    clearTimeout(late);
    const waits = flight.look && performance.now() - since < LATE_MS;
    dirty = Boolean(waits);
    if (waits) {
      late = setTimeout(look, LATE_MS);
      return;
    }
    since = performance.now();
    ask("look", { have: yarns ? "" : have, yarns, faces: tool === "leave" });
  }

  function answered(data) {
    const [head, found] = data instanceof ArrayBuffer ? unpacked(data) : [JSON.parse(data), null];
    const { to, n } = head;
    // Of plans only the latest counts; of looks, all that come are newer than what is seen.
    if (to === "plan" && n !== flight.plan) return;
    if (head.progress) progress(to, head.progress);
    else if (head.error) failed(to, head.error);
    else if (to === "look" && found) looked(head, found);
    else if (to === "plan") planned(head, found);
    else if (to === "make" && head.made) made(head);
    else if (head.design) keep(head.design);
    if (head.done || head.stopped) ended(to, n, head.stopped);
  }

  function ended(to, n, stopped) {
    if (n !== flight[to]) return;
    flight[to] = 0;
    if (to === "look" && dirty) look();
    else if (to === "look") rest();
    if (to === "plan" && !stopped && plan.steps && plan.effort === "quick" && state.options.effort !== "quick") finer = setTimeout(() => ask("plan", { finer: true }), FINER);
    if (to === "make") by("job-stop").hidden = true;
    if (to === "designs") drawShelf();
    if (!flight.look && !flight.plan && !flight.designs) by("busy").hidden = true;
  }

  /** When nothing changes for a while, find out what it comes to. */
  function rest() {
    clearTimeout(resting);
    resting = setTimeout(() => {
      resting = 0;
      ask("plan", { yarns });
    }, REST);
  }

  function progress(to, { what, done, total }) {
    const bar = to === "make" ? by("job-progress") : by("busy").querySelector("progress");
    if (total > 1) [bar.max, bar.value] = [total, done];
    else bar.removeAttribute("value");
    if (to === "make") by("job-text").textContent = what;
    else {
      by("busy").hidden = false;
      by("busy").querySelector("span").textContent = what;
    }
  }

  function failed(to, text) {
    if (to === "make") {
      by("job-text").textContent = text;
      by("job-progress").hidden = true;
      return;
    }
    hint(text, true);
    if (to === "look") by("outcome").classList.add("stale");
    if (to === "plan" && !plan.figures) by("verdict").querySelector("span").textContent = text.split("\n")[0];
  }

  function hint(text, wrong = false) {
    by("hint").textContent = text;
    by("hint").classList.toggle("wrong", wrong);
  }

  // ---- what is shown

  function looked(head, found) {
    seen = head;
    arrays = found;
    if (found.index) have = yarns ? "" : head.shape;
    hint(head.better ? "This is a first answer. A better one is being searched for." : TOOLS[tool]);
    if (scene) {
      scene.show(found, yarns ? 0 : usualWidthOf(found.position));
      scene.choose(-1);
      upArrow.reset();
    }
    by("title").textContent = document.title = head.title;
    by("toml").href = URL.createObjectURL(new Blob([head.toml], { type: "application/toml" }));
    drawControls(head.controls);
    notes(head.notes);
    overlays();
    document.body.dataset.seen = head.n;
  }

  function overlays() {
    if (!scene) return;
    scene.showFaces(tool === "leave" ? arrays : null, new Set(listed(state.options.leave_out)));
    scene.showDots(tool === "fasten", plan.fastened || [], fastenedByHand());
  }

  function planned(head, found) {
    if (head.figures) {
      plan = head;
      outcome(head);
      by("flat").classList.remove("stale");
      drawStrips(by("panel-strips"), head.pieces, Math.max(300, by("flat").clientWidth - 24));
      for (const name of ["sheets", "steps"]) by(`panel-${name}`).innerHTML = "<p>Coming …</p>";
    } else if (found && scene) {
      arrays = { ...arrays, ...found };
      if (found.index) have = head.shape;
      scene.show(found, usualWidthOf(found.position));
      overlays();
    } else if (head.sheets) {
      Object.assign(plan, head);
      drawSheets(by("panel-sheets"), plan.pieces, head.sheets, head.placed, Math.max(110, by("flat").clientHeight - 36), new Set(pins().map((pin) => pin.split("@")[0])), head.effort === "quick" ? "nested quickly" : `nested by effort ${head.effort}`);
    } else if (head.steps) {
      plan.steps = head.steps;
      by("panel-steps").innerHTML = `<ol>${head.steps.map(({ pieces, text }) => `<li><button type="button" data-id="${escaped(pieces[0] || "")}">${escaped(text)}</button></li>`).join("")}</ol>`;
    }
    choose(chosen);
  }

  const span = (range, digits = 1) => (range ? range.map((value) => value.toFixed(digits)).join(" to ") : "not known");

  function outcome({ verdict, figures, hours, widths }) {
    by("outcome").classList.remove("stale");
    by("verdict").dataset.level = verdict.level;
    by("verdict").querySelector("b").textContent = verdict.level[0].toUpperCase() + verdict.level.slice(1);
    by("verdict").querySelector("span").textContent = verdict.reasons.length ? "" : "as it is.";
    by("reasons").innerHTML = verdict.reasons.slice(0, 5).map(({ text, cure }) => `<p>${escaped(text)}<small>${escaped(cure)}</small></p>`).join("");
    const rows = [
      ["Pieces", `${figures.pieces} of ${figures.kinds} kinds`], ["Crossings", figures.crossings], ["Threads", figures.threads],
      ["Sheets", `${figures.sheets}, ${(100 * figures.use).toFixed(0)} % used`], ["Assembly", hours || "not known"],
      ["Cutting", figures.cutting_h ? `${span(figures.cutting_h.map((h) => 60 * h), 0)} min` : "not known"],
      ["Price", figures.price ? `${span(figures.price, 0)} EUR` : "not known"],
      ["Form", figures.collapses ? "collapses" : figures.form_mm == null ? "not known" : `settles ${figures.form_mm.toFixed(1)} mm`],
      ...(figures.likeness_mm == null ? [] : [["Off the model", `${figures.likeness_mm.toFixed(1)} mm at most`]]),
      ...(figures.broken ? [["Broken twill", `${figures.broken} conditions`]] : []),
      ["Longest piece", `${figures.longest_mm.toFixed(0)} mm`],
    ];
    by("figures").innerHTML = rows.map(([name, value]) => `<dt>${name}</dt><dd>${escaped(value)}</dd>`).join("");
    drawWidths(by("widths"), widths);
  }

  function notes(texts) {
    by("notes").innerHTML = texts.slice(0, 6).map((text) => `<p>${escaped(text.split(". ")[0])}</p>`).join("");
  }

  /** Bring out a piece in space, on its sheet and in words; -1 for none. */
  function choose(piece) {
    chosen = plan.pieces && piece >= 0 && piece < plan.pieces.length ? piece : -1;
    if (scene) scene.choose(chosen);
    for (const shape of document.querySelectorAll("#flat .piece")) shape.classList.toggle("chosen", Number(shape.dataset.piece) === chosen);
    const shape = document.querySelector("#flat [role=tabpanel]:not([hidden]) .piece.chosen");
    if (shape) shape.scrollIntoView({ block: "nearest" });
    const own = chosen < 0 ? null : plan.pieces[chosen], place = own && plan.placed && plan.placed.find(([origin]) => origin === chosen);
    const step = own && plan.steps ? plan.steps.findIndex(({ pieces }) => pieces.includes(own.id)) : -1;
    by("chosen").textContent = own ? `${own.id}, kind ${own.kind}${place ? `, sheet ${place[1] + 1}` : ""}${step < 0 ? "" : `, step ${step + 1}`}` : "";
  }

  // ---- controls

  let structure = "";
  const fieldName = ({ option, label }) => `${option}-${label}`.replace(/[^\w-]/g, "_");

  function drawControls(list) {
    const now = JSON.stringify(list.map(({ value, least, most, template, ...rest }) => rest));
    if (now !== structure) {
      structure = now;
      const focused = document.activeElement && document.activeElement.dataset.field;
      let group = "";
      by("controls").innerHTML = list.map((one) => {
        const head = one.group === group ? "" : `<h2>${one.group}</h2>`;
        group = one.group;
        return `${head}<label class="${one.kind}" title="${escaped(one.help)}"><span>${escaped(one.label)}</span>${fieldOf(one)}</label>`;
      }).join("");
      const again = focused && by("controls").querySelector(`[data-field="${focused}"]`);
      if (again) again.focus();
    }
    list.forEach((one) => {
      for (const field of by("controls").querySelectorAll(`[data-field="${fieldName(one)}"]`)) {
        field.control = one;
        if (one.kind === "range") [field.min, field.max, field.step] = [one.least, one.most, field.type === "number" ? "any" : one.step];
        // What is being dragged or typed stays as it is.
        if (document.activeElement !== field || one.kind === "choice") field.value = one.value;
      }
    });
  }

  function fieldOf(one) {
    const name = `data-field="${fieldName(one)}" aria-label="${escaped(`${one.group}: ${one.label}`)}"`;
    if (one.kind === "choice") return `<select ${name}>${one.choices.map(([value, text]) => `<option value="${escaped(value)}">${escaped(text)}</option>`).join("")}</select>`;
    if (one.kind === "text") return `<input type="text" ${name} spellcheck="false">`;
    return `<span class="both"><input type="number" ${name}>${one.unit ? `<small>${one.unit}</small>` : ""}</span><input type="range" ${name}>`;
  }

  /** Change the state; it can be undone once the change is kept. */
  function change(next, keep = true) {
    state = { mesh: next.mesh, options: Object.fromEntries(Object.entries(next.options).filter(([, value]) => value !== null && value !== "")) };
    if (keep) {
      states.splice(at + 1, states.length, state);
      if (states.length > MOST_STATES) states.shift();
      at = states.length - 1;
      remember();
    }
    clearTimeout(resting);
    clearTimeout(finer);
    if (flight.plan) ask("plan", { stop: true });
    flight.plan = 0;
    for (const id of ["outcome", "flat"]) by(id).classList.add("stale");
    look();
  }

  function remember() {
    memory("states", states);
    memory("at", at);
    by("undo").disabled = at === 0;
    by("redo").disabled = at === states.length - 1;
  }

  function go(steps) {
    const to = at + steps;
    if (to < 0 || to >= states.length) return;
    at = to;
    remember();
    change(states[at], false);
  }

  function taken(field, keep) {
    const { option, template, value, kind } = field.control;
    const text = field.value === "" ? null : kind === "range" ? String(Number(field.value)) : field.value;
    if (kind === "range" && (text === null || !field.checkValidity())) return;
    const said = text === null ? null : template.replace("{}", () => text);
    if (!keep && said === null) return;
    for (const other of by("controls").querySelectorAll(`[data-field="${field.dataset.field}"]`)) if (other !== field) other.value = field.value;
    if (option === "mesh") {
      const model = kind === "choice", options = model ? Object.fromEntries(Object.entries(state.options).filter(([name]) => !OF_THE_MODEL.includes(name))) : state.options;
      change({ mesh: said, options }, keep);
    } else change({ mesh: state.mesh, options: { ...state.options, [option]: option === "sheet" && said ? [said] : said } }, keep);
  }
  by("controls").addEventListener("input", ({ target }) => target.type === "range" && target.control && taken(target, false));
  by("controls").addEventListener("change", ({ target }) => target.control && taken(target, true));
  by("controls").addEventListener("submit", (event) => event.preventDefault());

  // ---- by hand

  const TOOLS = { choose: "", leave: "Tap faces to leave them out; red ones are left out.", fasten: "Tap crossings to fasten them. Black: fastened by the rule; red: by hand.", up: "Drag the arrow to what is to point up; it stops at the axes of the file. Tap it twice to have it as read." };
  const listed = (text) => String(text || "").split(",").filter((part) => /^\d+$/.test(part)).map(Number);
  /** Crossings that are fastened by number, after the rule. */
  const fastenedByHand = () => listed(state.options.fasten);

  function toggled(numbers, one) {
    return (numbers.includes(one) ? numbers.filter((other) => other !== one) : [...numbers, one]).sort((a, b) => a - b);
  }

  /** The arrow is drawn, and its tip is seen there. */
  function arrowAt(x, y) {
    by("arrow").hidden = false;
    by("arrow").style.transform = `translate(${x}px, ${y}px)`;
  }

  function tapped(hit) {
    if (!hit) return choose(-1);
    if (tool === "choose" || tool === "up") return choose(hit.piece);
    if (tool === "leave" && hit.face !== undefined) {
      const words = String(state.options.leave_out || "").split(",").filter((part) => part && !/^\d+$/.test(part));
      const numbers = toggled(listed(state.options.leave_out), hit.face);
      change({ mesh: state.mesh, options: { ...state.options, leave_out: [...words, ...numbers].join(",") || null } });
    } else if (tool === "fasten" && hit.crossing !== undefined) {
      const rule = String(state.options.fasten || "").split(",").filter((part) => part && !/^\d+$/.test(part)).join(",") || "form";
      const numbers = toggled(fastenedByHand(), hit.crossing);
      change({ mesh: state.mesh, options: { ...state.options, fasten: numbers.length ? `${rule},${numbers.join(",")}` : rule === "form" ? null : rule } });
    }
    return undefined;
  }

  const pins = () => String(state.options.pin || "").split("/").filter(Boolean);

  /** Pin a piece where it was dragged to, or let it go again. */
  function pin(id, place) {
    const others = pins().filter((one) => one.split("@")[0] !== id), own = place ? [`${id}@${place[1] + 1}:${place.slice(2).map((value) => +value.toFixed(2)).join(",")}`] : [];
    change({ mesh: state.mesh, options: { ...state.options, pin: [...others, ...own].join("/") || null } });
  }
  dragPieces(by("panel-sheets"), () => plan, (place) => pin(plan.pieces[place[0]].id, place));
  by("panel-sheets").addEventListener("dblclick", ({ target }) => target.closest(".pinned") && pin(plan.pieces[Number(target.dataset.piece)].id, null));

  for (const button of document.querySelectorAll("[data-tool]"))
    button.addEventListener("click", () => {
      tool = button.dataset.tool;
      for (const other of document.querySelectorAll("[data-tool]")) other.setAttribute("aria-pressed", other === button);
      hint(TOOLS[tool]);
      by("arrow").hidden = true;
      if (scene) scene.showArrow(tool === "up");
      if (tool === "leave" && !arrays.face) look();
      else overlays();
    });
  for (const [id, act] of [["yarns", (on) => { yarns = on; have = ""; look(); }], ["shadows", (on) => scene && scene.shadows(on)]])
    by(id).addEventListener("click", () => {
      const on = by(id).getAttribute("aria-pressed") !== "true";
      by(id).setAttribute("aria-pressed", on);
      act(on);
    });
  const dark = (on) => {
    document.documentElement.classList.toggle("dark", on);
    by("theme").textContent = on ? "Light" : "Dark";
    if (scene) scene.draw();
  };
  dark(matchMedia("(prefers-color-scheme: dark)").matches);
  by("theme").addEventListener("click", () => dark(!document.documentElement.classList.contains("dark")));

  // ---- flat, shelf

  function openTab(name) {
    for (const tab of ["strips", "sheets", "steps", "shelf"]) {
      by(`tab-${tab}`).setAttribute("aria-selected", tab === name);
      by(`panel-${tab}`).hidden = tab !== name;
    }
    choose(chosen);
  }
  for (const tab of ["strips", "sheets", "steps", "shelf"]) by(`tab-${tab}`).addEventListener("click", () => openTab(tab));
  by("flat").addEventListener("click", ({ target }) => {
    if (target.closest("#try")) {
      ask("designs");
      drawShelf();
    }
    const shape = target.closest(".piece"), step = target.closest("[data-id]"), kept = target.closest("[data-kept]"), gone = target.closest("[data-gone]");
    if (shape) choose(Number(shape.dataset.piece));
    else if (step && plan.pieces) choose(plan.pieces.findIndex(({ id }) => id === step.dataset.id));
    else if (gone) {
      shelf.splice(Number(gone.dataset.gone), 1);
      drawShelf();
    } else if (kept) change(shelf[Number(kept.dataset.kept)].state);
  });

  function drawShelf() {
    memory("shelf", shelf);
    by("tab-shelf").textContent = shelf.length ? `Shelf (${shelf.length})` : "Shelf";
    by("panel-shelf").innerHTML = shelf.length ? `<div class="row">${shelf.map(({ name, picture, words }, k) => `
      <figure><button type="button" class="link" data-kept="${k}" aria-label="Go back to ${escaped(name)}">${picture ? `<img alt="" src="${picture}">` : ""}
      <figcaption><b>${escaped(name)}</b><br>${escaped(words)}</figcaption></button><button type="button" data-gone="${k}" aria-label="Take ${escaped(name)} off the shelf">×</button></figure>`).join("")}</div>`
      : "<p>Keep puts this variant here, with its picture and figures, to compare it with others and to go back to it.</p>";
    by("panel-shelf").insertAdjacentHTML("afterbegin", `<p><button type="button" id="try"${flight.designs ? " disabled" : ""} title="Other meshes, patterns and widths of this model">Try designs</button></p>`);
  }

  function keep(variant) {
    shelf.unshift(variant);
    shelf.length = Math.min(shelf.length, MOST_KEPT);
    drawShelf();
  }
  by("keep").addEventListener("click", () => {
    const { figures, hours, verdict } = plan, stale = by("outcome").classList.contains("stale");
    const words = figures && !stale ? `${verdict.level}; ${figures.pieces} pieces of ${figures.kinds} kinds, ${figures.sheets} sheets, ${hours || "hours not known"}, ${figures.median_mm.toFixed(1)} mm wide${figures.collapses ? ", collapses" : figures.form_mm == null ? "" : `, settles ${figures.form_mm.toFixed(1)} mm`}` : "not planned yet";
    keep({ name: seen ? seen.title : state.mesh, state, words, picture: scene ? scene.picture(360) : "" });
    openTab("shelf");
  });

  // ---- files, commands, the job

  by("undo").addEventListener("click", () => go(-1));
  by("redo").addEventListener("click", () => go(1));
  document.addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.target.matches("input[type=text], input[type=number]")) return;
    const key = event.key.toLowerCase();
    if (key !== "z" && key !== "y") return;
    event.preventDefault();
    go(key === "y" || event.shiftKey ? 1 : -1);
  });
  by("stop").addEventListener("click", () => {
    for (const to of ["look", "plan", "designs"]) if (flight[to]) ask(to, { stop: true });
  });
  by("copy").addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(seen.command);
      hint(`Copied: ${seen.command}`);
    } catch (error) {
      hint(seen.command);
    }
  });

  async function take(file) {
    hint(`Reading ${file.name} …`);
    try {
      const answer = await (await fetch(`take?name=${encodeURIComponent(file.name)}`, { method: "POST", body: file })).json();
      if (answer.error) hint(answer.error, true);
      else change({ mesh: answer.mesh, options: answer.options });
    } catch (error) {
      hint("The studio did not take the file. Is it still running?", true);
    }
  }
  by("open").addEventListener("change", () => {
    if (by("open").files[0]) take(by("open").files[0]);
    by("open").value = "";
  });
  document.addEventListener("dragover", (event) => {
    event.preventDefault();
    document.body.classList.add("drop");
  });
  document.addEventListener("dragleave", (event) => event.relatedTarget || document.body.classList.remove("drop"));
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    document.body.classList.remove("drop");
    if (event.dataTransfer.files[0]) take(event.dataTransfer.files[0]);
  });

  by("make").addEventListener("click", () => {
    by("job-title").textContent = "Making the job";
    by("job-text").textContent = "";
    by("job-frame").hidden = by("job-open").hidden = true;
    by("job-stop").hidden = by("job-progress").hidden = false;
    by("job-progress").removeAttribute("value");
    by("job").showModal();
    ask("make");
  });
  by("job-stop").addEventListener("click", () => {
    ask("make", { stop: true });
    by("job-text").textContent = "Stopped; nothing was written.";
    by("job-progress").hidden = true;
  });
  by("job-close").addEventListener("click", () => by("job").close());

  function made({ made: folder, chosen: why, verdict }) {
    by("job-title").textContent = `${given.folder}/jobs/${folder}`;
    by("job-text").textContent = why || verdict;
    by("job-progress").hidden = true;
    by("job-frame").src = by("job-open").href = `jobs/${folder}/index.html`;
    by("job-frame").hidden = by("job-open").hidden = false;
  }

  by("end").addEventListener("click", async () => {
    socket.onclose = null;
    await fetch("end", { method: "POST" });
    document.body.innerHTML = "<main><p style='padding:2rem'>The studio has ended. This page can be closed.</p></main>";
  });

  window.studio = { get fps() { return scene ? scene.fps : 0; }, get state() { return state; }, get seen() { return seen; }, get plan() { return plan; }, get settled() { return Boolean(plan.steps && !flight.look && (!flight.plan || plan.sheets) && !dirty && !resting && !by("outcome").classList.contains("stale")); } };
  remember();
  drawShelf();
  connect();
})();
