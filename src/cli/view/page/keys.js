// Keys of the picture, and the dialog that lists them.

/** Keys as they are listed, what they do, and the actions by the key's name. */
const KEYS = [
  [["←", "→", "↑", "↓"], "Orbit", {
    ArrowLeft: a => a.turn(-1, 0), ArrowRight: a => a.turn(1, 0), ArrowUp: a => a.turn(0, 1), ArrowDown: a => a.turn(0, -1),
  }],
  [["Shift", "←", "→", "↑", "↓"], "Pan", {
    "Shift+ArrowLeft": a => a.pan(-1, 0), "Shift+ArrowRight": a => a.pan(1, 0),
    "Shift+ArrowUp": a => a.pan(0, -1), "Shift+ArrowDown": a => a.pan(0, 1),
  }],
  [["+", "−"], "Zoom", { "+": a => a.zoom(1), "=": a => a.zoom(1), "-": a => a.zoom(-1), "_": a => a.zoom(-1) }],
  [["1", "2"], "Front, back", { 1: a => a.standard("front"), 2: a => a.standard("back") }],
  [["3", "4"], "Right, left", { 3: a => a.standard("right"), 4: a => a.standard("left") }],
  [["7", "8"], "Top, bottom", { 7: a => a.standard("top"), 8: a => a.standard("bottom") }],
  [["5"], "Isometric direction", { 5: a => a.standard("isometric") }],
  [["0"], "Frame all", { 0: a => a.frameAll() }],
  [["F"], "Frame the selected object, or all", { f: a => a.frameSelected() }],
  [["C"], "Next camera of the file", { c: a => a.nextCamera() }],
  [["O"], "Perspective or orthographic", { o: a => a.toggleProjection() }],
  [["H"], "Hide or show the selected object", { h: a => a.toggleSelected() }],
  [["Page ↑", "Page ↓"], "Previous or next scene of the folder", { PageUp: a => a.openOther(-1), PageDown: a => a.openOther(1) }],
  [["Esc"], "Select nothing", { Escape: a => a.select(null) }],
  [["Space"], "Play or pause", { " ": a => a.togglePlay() }],
  [["?"], "Show these keys", { "?": a => a.showKeys() }],
];
const POINTERS = [
  ["Drag", "Orbit"],
  ["Right drag, Shift + drag, two fingers", "Pan"],
  ["Wheel, pinch", "Zoom to the pointer"],
  ["Click", "Select an object"],
  ["Double click", "Orbit around this point"],
];

const ACTIONS = Object.assign({}, ...KEYS.map(([, , actions]) => actions));

/** Calls `actions` for the keys that are pressed while the element has the focus. */
export function listenToKeys(element, actions) {
  element.addEventListener("keydown", event => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const action = ACTIONS[event.shiftKey && key.startsWith("Arrow") ? `Shift+${key}` : key];
    if (!action) return;
    event.preventDefault();
    action(actions);
  });
}

function row(keys, text) {
  const tr = document.createElement("tr");
  const cell = tr.insertCell();
  for (const key of keys) {
    const kbd = document.createElement("kbd");
    kbd.textContent = key;
    cell.append(kbd, " ");
  }
  tr.insertCell().textContent = text;
  return tr;
}

/** Fills the two tables of the dialog. */
export function fillKeysDialog(dialog) {
  const [keys, pointers] = dialog.querySelectorAll("tbody");
  keys.append(...KEYS.map(([names, text]) => row(names, text)));
  pointers.append(...POINTERS.map(([name, text]) => {
    const tr = document.createElement("tr");
    tr.insertCell().textContent = name;
    tr.insertCell().textContent = text;
    return tr;
  }));
}
