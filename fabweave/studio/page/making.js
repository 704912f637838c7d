import { by } from "../../show/scripts/html.js";

/** The dialog in which a job is made, and then opens. */
export class Making {
  /** The folder of the job that was made last. */
  last = "";

  /** @param {string} folder @param {import("./wishes.js").Wishes} wishes */
  constructor(folder, wishes) {
    this.folder = folder;
    by("make").addEventListener("click", () => {
      this.#begin();
      wishes.ask("make");
    });
    by("job-stop").addEventListener("click", () => {
      wishes.stop("make");
      this.failed("Stopped; nothing was written.");
    });
    by("job-close").addEventListener("click", () => by("job").close());
  }

  #begin() {
    by("job-title").textContent = "Making the job";
    by("job-text").textContent = "";
    by("job-frame").hidden = by("job-open").hidden = true;
    by("job-stop").hidden = by("job-progress").hidden = false;
    by("job-progress").removeAttribute("value");
    by("job").showModal();
  }

  /** @param {string} text */
  failed(text) {
    by("job-text").textContent = text;
    by("job-progress").hidden = true;
  }

  /** Nothing can be stopped any more. */
  ended() {
    by("job-stop").hidden = true;
  }

  /** @param {{ made: string, chosen?: string, verdict: string }} head */
  made({ made, chosen, verdict }) {
    this.last = made;
    by("job-title").textContent = `${this.folder}/jobs/${made}`;
    this.failed(chosen || verdict);
    by("job-frame").src = by("job-open").href = `jobs/${made}/index.html`;
    by("job-frame").hidden = by("job-open").hidden = false;
  }

  /** Files of the job that was made last, to be passed on, as HTML. */
  get links() {
    const link = (/** @type {string} */ file, /** @type {string} */ name) =>
      `<a class="button" download="${this.last}-${file}" href="jobs/${this.last}/${file}">${name}</a>`;
    return this.last ? `${link("assembly.html", "Page")} turns, steps through the assembly, and needs nothing else<br>
      ${link("model.glb", "GLB")} the woven object for other 3-D programs`
      : "Make the job first, for one page that turns and steps through the assembly, and a GLB.";
  }
}
