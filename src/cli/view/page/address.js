// The view in the address of the page, so that a reload, a bookmark or another person opens the same picture.
//
// The fragment has what differs from the start of the scene, under the names of the flags of `blinn render`. Browsers do
// not send fragments to servers.

/** Fields of a view by their names in the address; each has a function that reads and checks the text. */
const FIELDS = {
  variant: ["variant", (text, scene) => (scene.variants.includes(text) ? text : undefined)],
  animation: ["animation", (text, scene) => (text === "none" ? null : index(text, scene.animations.length))],
  time: ["time", finite],
  lights: ["lights", word],
  exposure: ["exposure", text => (text === "auto" ? text : finite(text))],
  view: ["view_transform", word],
  hdri: ["hdri", text => (text === "none" ? null : word(text))],
  "hdri-rotate": ["hdri_rotate", finite],
  background: ["background", word],
  ground: ["ground", text => text === "on"],
  ao: ["ao", text => integer(text, 0, 4096)],
  samples: ["samples", text => integer(text, 1, 65536)],
};
const LONGEST_WORD = 300;
const LARGEST_SIDE = 8192;

function finite(text) {
  return text !== "" && Number.isFinite(Number(text)) ? Number(text) : undefined;
}

function integer(text, low, high) {
  const value = finite(text);
  return Number.isInteger(value) && value >= low && value <= high ? value : undefined;
}

function index(text, count) {
  return integer(text, 0, count - 1);
}

function word(text) {
  return text.length <= LONGEST_WORD ? text : undefined;
}

function numbers(text, count) {
  const all = (text ?? "").split(",").map(finite);
  return all.length === count && !all.includes(undefined) ? all : undefined;
}

/** Returns [0, 1, 2, 7] as "0-2,7". */
function rangesOf(indices) {
  const ranges = [];
  for (const i of indices) {
    const last = ranges.at(-1);
    if (last && last[1] === i - 1) last[1] = i;
    else ranges.push([i, i]);
  }
  return ranges.map(([from, to]) => (from === to ? `${from}` : `${from}-${to}`)).join(",");
}

function indicesOf(text, count) {
  const found = new Set();
  for (const range of text.split(",")) {
    const [from, to = from] = range.split("-").map(end => index(end, count));
    if (from === undefined || to === undefined) continue;
    for (let i = from; i <= to; i++) found.add(i);
  }
  return [...found].sort((a, b) => a - b);
}

function cameraWords(camera) {
  if (camera.kind === "file") return [["camera", camera.index]];
  const { azimuth, elevation, distance, target, yfov, projection, height } = camera;
  const isFlat = projection === "orthographic";
  return [
    ["orbit", [azimuth, elevation, distance].join(",")],
    ["look-at", target.join(",")],
    ["yfov", yfov],
    ...(isFlat ? [["projection", projection], ["view-height", height]] : []),
  ];
}

function cameraOf(words, scene) {
  if (words.has("camera")) {
    const camera = index(words.get("camera"), scene.cameras.length);
    return camera === undefined ? undefined : { kind: "file", index: camera };
  }
  const orbit = numbers(words.get("orbit"), 3);
  const target = numbers(words.get("look-at"), 3);
  const yfov = finite(words.get("yfov") ?? "");
  if (!orbit || !target || !(orbit[2] > 0) || Math.abs(orbit[1]) > 90 || !(yfov > 0 && yfov < 180)) return undefined;
  const [azimuth, elevation, distance] = orbit;
  const projection = words.get("projection") === "orthographic" ? "orthographic" : "perspective";
  const given = finite(words.get("view-height") ?? "");
  const height = given > 0 ? given : 2 * distance * Math.tan((yfov * Math.PI) / 360);
  return { kind: "orbit", target, azimuth, elevation, distance, yfov, projection, height };
}

const encode = text => encodeURIComponent(text).replaceAll("%2C", ",").replaceAll("%2F", "/");
const isEqual = (a, b) => JSON.stringify(a) === JSON.stringify(b);

/** Returns the fragment of a view, without "#". `size` is [width, height], or null for that of the window. */
export function fragmentOf(view, scene, size) {
  const { start, files } = scene;
  const words = files.names.length > 1 ? [["file", scene.file]] : [];
  if (!isEqual(view.camera, start.camera)) words.push(...cameraWords(view.camera));
  if (view.hidden.length) words.push(["hide", rangesOf(view.hidden)]);
  for (const [name, [field]] of Object.entries(FIELDS)) {
    const value = view[field] ?? null;
    if (isEqual(value, start[field] ?? null)) continue;
    words.push([name, value === null ? "none" : typeof value === "boolean" ? (value ? "on" : "off") : value]);
  }
  if (size) words.push(["size", size.join("x")]);
  return words.map(([name, value]) => `${name}=${encode(value)}`).join("&");
}

/** Returns the index of the scene that a fragment names; undefined if it names none of the list. */
export function fileOf(fragment, scene) {
  const name = new URLSearchParams(fragment.replace(/^#/, "")).get("file");
  const found = scene.files.names.indexOf(name);
  return found < 0 ? undefined : found;
}

/** Returns {view, size} of a fragment. What it does not name, or what does not suit the scene, is that of the start. */
export function viewOf(fragment, scene) {
  const words = new URLSearchParams(fragment.replace(/^#/, ""));
  const view = { ...scene.start };
  for (const [name, [field, read]] of Object.entries(FIELDS)) {
    const value = words.has(name) ? read(words.get(name), scene) : undefined;
    if (value !== undefined) view[field] = value;
  }
  view.camera = cameraOf(words, scene) ?? view.camera;
  view.hidden = words.has("hide") ? indicesOf(words.get("hide"), scene.objects.length) : [];
  const size = (words.get("size") ?? "").split("x").map(side => integer(side, 16, LARGEST_SIDE));
  return { view, size: size.length === 2 && !size.includes(undefined) ? size : null };
}
