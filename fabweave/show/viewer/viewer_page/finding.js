/** The search field and what it finds; `take` is told what is chosen. */
function makeFinding(by, plan, take) {
  let found = [];

  /** Open the list of what is found, or close it. */
  function find(open) {
    const hits = open ? plan.search(by("query").value, 40) : [];
    const box = by("found");
    const none = open && !hits.length && by("query").value.trim();
    box.hidden = !hits.length && !none;
    by("query").setAttribute("aria-expanded", !box.hidden);
    box.innerHTML = none ? "<p>Nothing is called so. Try A3, thread A, #12, crossing 12, kind 3, sheet 2 or step 7.</p>" : hits.map(({ piece, name, why }, k) => {
      const text = piece === undefined ? `<strong>${escaped(name)}</strong>` : `<b>${escaped(plan.named(piece))}</b>`;
      const own = piece === undefined ? "" : ` data-piece="${escaped(plan.pieces[piece].id)}"`;
      return `<button type="button" role="option" data-found="${k}"${own}>${text} <small>${escaped(why)}</small></button>`;
    }).join("");
    found = hits;
    return hits;
  }

  by("search").addEventListener("submit", (event) => {
    event.preventDefault();
    const hits = find(true);
    if (hits.length) choose(0);
  });
  by("query").addEventListener("input", () => find(true));

  function choose(number) {
    const hit = found[number];
    find(false);
    take(hit);
  }
  return { choose, close: () => find(false) };
}
