// The commands that make the picture, with buttons that copy them.

/** Milliseconds in which a browser lets a click copy. */
const PATIENCE = 4000;

/** Copies the text of a field; returns false if the browser refuses. */
async function copy(field) {
  try {
    await navigator.clipboard.writeText(field.value);
    return true;
  } catch {
    // Without the permission, or without a secure context: copies the selection.
    field.select();
    return document.execCommand("copy");
  }
}

/** A field with a command, and the button that copies it. */
export class CommandField {
  #field;
  #feedback;
  #arrived = [];

  constructor({ field, button, feedback }) {
    this.#field = field;
    this.#feedback = feedback;
    button.addEventListener("click", () => this.#copy(button));
    field.addEventListener("focus", () => field.select());
  }

  /** Notes that the view has changed: the command is that of an older one. */
  expire() {
    this.#field.ariaBusy = "true";
    this.#feedback.textContent = "";
  }

  /** Takes the command of the view. */
  set command(text) {
    this.#field.value = text;
    this.#field.ariaBusy = "false";
    for (const resolve of this.#arrived.splice(0)) resolve();
  }

  async #copy(button) {
    if (this.#field.ariaBusy === "true") {
      await new Promise(resolve => {
        this.#arrived.push(resolve);
        setTimeout(resolve, PATIENCE);
      });
    }
    if (this.#field.ariaBusy === "true") {
      this.#say("There is no command for this view yet");
      return;
    }
    const isCopied = await copy(this.#field);
    button.focus();
    this.#say(isCopied ? "Copied" : "Not copied: press Ctrl+C in the field");
  }

  #say(text) {
    // An empty region first, so that the same words are announced again.
    this.#feedback.textContent = "";
    setTimeout(() => { this.#feedback.textContent = text; }, 50);
  }
}

/** Saves the bytes of the picture as a file. */
export function savePicture({ header, blob }, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = `${name}.${header.mime === "image/jpeg" ? "jpg" : "png"}`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
