// What the page says about itself: progress, lost connections and errors, in live regions.

/** Lost connections in a row after which the program is probably gone. */
const GONE_AFTER = 4;
const LOOPBACK_NAMES = ["localhost", "127.0.0.1", "[::1]"];

const seconds = milliseconds =>
  milliseconds < 1000 ? `${Math.round(milliseconds)} ms` : `${(milliseconds / 1000).toFixed(1)} s`;

export class Status {
  #status;
  #error;
  #progress;
  #notice;
  /** The error of a scene that could not be loaded again. Pictures show the one before. */
  #sceneError = "";
  #isLost = false;
  /** True after the first connection. */
  #wasConnected = false;

  constructor({ status, error, progress, notice }) {
    this.#status = status;
    this.#error = error;
    this.#progress = progress;
    this.#notice = notice;
  }

  /** Sets the text if it is another, since live regions announce every change. */
  #say(text) {
    if (this.#status.textContent !== text) this.#status.textContent = text;
  }

  connected() {
    this.#isLost = false;
    this.#wasConnected = true;
    this.#notice.hidden = true;
    this.#say("Loading…");
  }

  lost(attempts) {
    this.#isLost = true;
    this.#progress.hidden = true;
    const { hostname } = location;
    const isForwarded = !LOOPBACK_NAMES.includes(hostname);
    const text = attempts < GONE_AFTER
      ? "Connection lost. Trying again…"
      : isForwarded && !this.#wasConnected
      ? `The connection is refused. If a proxy shows this page, start blinn view with --allow-host ${hostname}.`
      : "The program does not answer. If it was ended, start blinn view again and open its new address.";
    this.#say(text);
    this.#notice.textContent = text;
    this.#notice.hidden = false;
  }

  /** Follows a change of the view. */
  changed() {
    if (!this.#isLost) this.#say("Rendering…");
  }

  frame(header, { moving, view }) {
    this.#showError(this.#sceneError);
    this.#progress.hidden = header.final || moving;
    this.#progress.max = view.samples;
    this.#progress.value = header.samples;
    if (header.final) {
      const size = `${header.width} × ${header.height}`;
      const samples = header.samples === 1 ? "1 sample" : `${header.samples} samples`;
      this.#say(`${size}, ${samples}, ${seconds(header.milliseconds)}`);
    } else if (!moving) {
      this.#say(`Rendering ${header.samples} of ${view.samples} samples`);
    }
  }

  /** Takes a status of the renderer. */
  message({ state, text }) {
    if (state === "loading" || state === "reloading") this.#say(text || "Loading…");
  }

  fail({ text, scene }) {
    if (scene) this.#sceneError = text;
    this.#progress.hidden = true;
    this.#showError(text);
    this.#say("");
  }

  /** Follows a scene without errors. */
  sceneLoaded() {
    this.#sceneError = "";
    this.#showError("");
  }

  #showError(text) {
    this.#error.hidden = text === "";
    // Live regions announce every change.
    if (this.#error.textContent !== text) this.#error.textContent = text;
  }
}
