// The commands that make the picture, with buttons that copy them.

/** Copies a text; returns false if the browser refuses. */
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

/** Connects the button of a field with a live region. */
export function connectCopyButton(button, field, feedback) {
  button.addEventListener("click", async () => {
    const isCopied = await copy(field);
    button.focus();
    // An empty region first, so that the same words are announced again.
    feedback.textContent = "";
    setTimeout(() => {
      feedback.textContent = isCopied ? "Copied" : "Not copied: press Ctrl+C in the field";
    }, 50);
  });
  field.addEventListener("focus", () => field.select());
}

/** Saves the bytes of the picture as a file. */
export function savePicture({ header, blob }, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = `${name}.${header.mime === "image/jpeg" ? "jpg" : "png"}`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
