// The page of `blinn view`: connects the picture, the panel and the renderer.

import { Actions } from "./actions.js";
import { fileOf, fragmentOf, viewOf } from "./address.js";
import { cameraOf, completed, sphereOf } from "./camera.js";
import { CommandField, savePicture } from "./commands.js";
import { Connection } from "./connection.js";
import { Controls } from "./controls.js";
import { listenToGestures } from "./gestures.js";
import { fillKeysDialog, listenToKeys } from "./keys.js";
import { ObjectList } from "./objects.js";
import { Picture } from "./picture.js";
import { Playback } from "./playback.js";
import { State, carryOver } from "./state.js";
import { Status } from "./status.js";

const $ = id => document.getElementById(id);

const stage = $("stage");
const state = new State();
const status = new Status({ status: $("status"), error: $("error"), progress: $("progress"), notice: $("notice") });
const picture = new Picture(stage, $("picture"), $("outline"));
const playback = new Playback(state, isPlaying => { controls.isPlaying = isPlaying; });
const actions = new Actions({ state, picture, playback });
const controls = new Controls(state, actions);
const objects = new ObjectList({
  list: $("objects"), search: $("search"), count: $("object-count"), showFound: $("show-found"), hideFound: $("hide-found"),
}, actions);

const commands = Object.fromEntries(["render", "turntable"].map(kind => [kind, new CommandField({
  field: $(`${kind}-command`), button: $(`copy-${kind}`), feedback: $(`${kind}-copied`),
})]));

/** The scene as the renderer describes it. */
let scene = null;
/** Index of the scene that was asked for last. */
let fileIndex = 0;
/** The fragment to apply to the next scene; null for none. */
let wanted = location.hash;
/** True after the connection was lost: the next scene gets the view of the page. */
let isReconnected = false;

/** Patterns of the command hide objects of the same name, too, and those below. */
let implied = { by: null, all: [] };

function showObjects() {
  const { hidden } = state.view;
  objects.update(hidden === implied.by ? implied.all : hidden, state.selected);
}

function send() {
  if (!state.view) return;
  connection.send({ moving: state.moving, size: picture.size, pixel_ratio: picture.pixelRatio, view: state.view });
}

function describeScene() {
  const name = scene.file.split("/").pop();
  document.title = `${name} – blinn view`;
  $("file").textContent = name;
  $("file").title = scene.file;
  const count = (n, one, many) => `${n.toLocaleString("en")} ${n === 1 ? one : many}`;
  $("facts").textContent =
    `${count(scene.triangles, "triangle", "triangles")}, ${count(scene.objects.length, "object", "objects")}`;
  stage.setAttribute("aria-label", `Picture of ${name}`);
  showWarnings(scene.warnings);
}

function showWarnings(texts) {
  const warnings = [...new Set(texts)];
  $("warning-count").textContent = warnings.length;
  $("warnings").replaceChildren(...warnings.map(text => {
    const item = document.createElement("li");
    item.textContent = text;
    return item;
  }));
  $("no-warnings").hidden = warnings.length > 0;
}

/** Shows the view of a fragment. */
function applyAddress(fragment) {
  const { view, size } = viewOf(fragment, scene);
  controls.size = size;
  state.change(view);
}

/** Writes the view into the address. */
function writeAddress() {
  if (!scene || state.moving) return;
  const fragment = fragmentOf(state.view, scene, picture.fixedSize);
  if (fragment === location.hash.slice(1)) return;
  // Browsers limit how often an address changes.
  try { history.replaceState(null, "", fragment ? `#${fragment}` : location.pathname); } catch {}
}

function openFile(index) {
  const count = scene?.files.names.length ?? 0;
  if (index < 0 || index >= count) return;
  fileIndex = index;
  showFiles();
  connection.openFile(index);
}

function showFiles() {
  const count = scene.files.names.length;
  $("files").hidden = count < 2;
  $("file-number").textContent = `${fileIndex + 1} of ${count}`;
  $("previous-file").disabled = fileIndex === 0;
  $("next-file").disabled = fileIndex + 1 >= count;
}

function receiveScene(message) {
  const old = scene;
  scene = message;
  for (const view of [scene.view, scene.start]) {
    view.camera = completed(view.camera, sphereOf(scene.bounds), picture.aspect);
  }
  const isSame = old?.file === scene.file;
  actions.load(scene, !isSame);
  fileIndex = scene.files.index;
  showFiles();
  status.sceneLoaded();
  if (!isSame) state.view = scene.view;
  else if (isReconnected) state.view = carryOver(state.view, old, scene);
  // After a reload the renderer has the view, but the camera may have moved since.
  else state.view = { ...scene.view, camera: carryOver(state.view, old, scene).camera };
  isReconnected = false;
  const name = old?.objects[state.selected]?.name;
  const found = name === undefined ? -1 : scene.objects.findIndex(object => object.name === name);
  state.select(found < 0 ? null : found);
  markSelected();
  describeScene();
  objects.objects = scene.objects;
  controls.showScene(scene);
  const fragment = wanted;
  wanted = null;
  const other = fragment === null ? undefined : fileOf(fragment, scene);
  if (other !== undefined && other !== fileIndex) {
    wanted = fragment;
    openFile(other);
  } else if (fragment) {
    applyAddress(fragment);
  } else {
    state.change({});
  }
}

function markSelected() {
  picture.mark(scene.objects[state.selected]?.bounds ?? null);
}

const connection = new Connection(new URL("socket", location.href.replace(/^http/, "ws")), {
  // The scene comes first; the view is sent when it has.
  opened: () => status.connected(),
  lost(attempts) {
    isReconnected = Boolean(scene);
    status.lost(attempts);
  },
  scene: receiveScene,
  frame(header, blob) {
    picture.show(header, blob, header.camera ?? orbitCamera());
    if (Number.isFinite(header.exposure)) controls.metered = header.exposure;
    status.frame(header, state);
  },
  command(message) {
    commands.render.command = message.render;
    commands.turntable.command = message.turntable ?? "";
    implied = { by: state.view.hidden, all: message.hidden ?? state.view.hidden };
    showObjects();
    showWarnings([...scene.warnings, ...(message.warnings ?? [])]);
    $("turntable-field").hidden = !message.turntable;
  },
  status: message => status.message(message),
  error(message) {
    if (message.scene) wanted = null;
    status.fail(message);
  },
});

/** Returns the camera of the view, for a renderer that does not tell that of the frame. */
function orbitCamera() {
  const { camera } = state.view;
  return camera.kind === "orbit" ? cameraOf(camera, picture.aspect) : null;
}

actions.connection = connection;
actions.openOther = step => openFile(fileIndex + step);

state.addEventListener("view", () => {
  controls.show(scene, state.view);
  showObjects();
  status.changed();
  for (const command of Object.values(commands)) command.expire();
  writeAddress();
  send();
});
state.addEventListener("selection", () => {
  markSelected();
  showObjects();
  $("only-selected").disabled = state.selected === null;
});

listenToGestures(stage, {
  begin() {
    stage.classList.add("dragging");
    actions.begin();
  },
  end() {
    stage.classList.remove("dragging");
    actions.end();
  },
  orbit: (dx, dy) => actions.orbitBy(dx, dy),
  pan: (dx, dy) => actions.panBy(dx, dy),
  pinch: (factor, x, y, dx, dy) => actions.pinch(factor, x, y, dx, dy),
  zoom: (factor, x, y) => actions.zoomAt(factor, x, y),
  click: (x, y) => actions.click(x, y),
  recentre: (x, y) => actions.recentre(x, y),
});
listenToKeys(stage, actions);

$("only-selected").addEventListener("click", () => actions.showOnlySelected());
$("save-picture").addEventListener("click", () => {
  if (picture.shown) savePicture(picture.shown, scene.file.split("/").pop().replace(/\.[^.]*$/, ""));
});
fillKeysDialog($("keys"));
$("show-keys").addEventListener("click", () => actions.showKeys());

$("previous-file").addEventListener("click", () => openFile(fileIndex - 1));
$("next-file").addEventListener("click", () => openFile(fileIndex + 1));
// An address that a person pasted, or went back to.
addEventListener("hashchange", () => {
  if (!scene) return;
  const other = fileOf(location.hash, scene);
  if (other !== undefined && other !== fileIndex) {
    wanted = location.hash;
    openFile(other);
  } else {
    applyAddress(location.hash);
  }
});

new ResizeObserver(() => {
  picture.layOut();
  // Sizes follow one another while the window is dragged.
  state.change({}, Boolean(picture.shown) && !picture.fixedSize);
}).observe(stage);
stage.focus({ preventScroll: true });

// For the browser's console and for tests.
export { connection, picture, scene, state };
