// What gestures, keys and buttons do to the view.

import * as cameras from "./camera.js";

/** Degrees of a drag over the height of the picture. */
const DRAG_DEGREES = 180;
const KEY_DEGREES = 5;
const KEY_PAN = 0.05;
const KEY_ZOOM = 1.15;

export class Actions {
  #state;
  #picture;
  #connection;
  #scene;
  #playback;
  /** The orbit where a drag began. */
  #start = null;
  /** The view that the scene came with. */
  #first = null;
  /** Opens the scene some steps further in the list. */
  openOther = () => {};

  constructor({ state, picture, playback }) {
    this.#state = state;
    this.#picture = picture;
    this.#playback = playback;
  }

  set connection(connection) {
    this.#connection = connection;
  }

  /** Takes a scene; `isFirst` if its start is the one that `reset` returns to. */
  load(scene, isFirst) {
    this.#scene = scene;
    if (isFirst) this.#first = scene.start;
  }

  get #sphere() {
    return cameras.sphereOf(this.#scene?.bounds);
  }

  /** Returns the orbit of the view, or one that sees the same as the file's camera. */
  get orbit() {
    const { camera } = this.#state.view;
    if (camera.kind === "orbit") return camera;
    const shown = this.#picture.camera;
    return shown ? cameras.orbitOf(shown, this.#sphere) : cameras.defaultOrbit(this.#sphere, this.#picture.aspect);
  }

  #move(orbit, moving) {
    this.#state.change({ camera: cameras.rounded(orbit, this.#sphere.radius) }, moving);
  }

  // Gestures

  begin() {
    if (!this.#state.view) return;
    this.#start = this.orbit;
    this.#state.hold();
  }

  end() {
    this.#start = null;
    this.#state.release();
  }

  orbitBy(dx, dy) {
    if (!this.#start) return;
    const degrees = DRAG_DEGREES / this.#picture.height;
    this.#move(cameras.turn(this.#start, -dx * degrees, dy * degrees), true);
  }

  panBy(dx, dy) {
    if (!this.#start) return;
    const height = this.#picture.height;
    this.#move(cameras.pan(this.#start, dx / height, dy / height), true);
  }

  pinch(factor, x, y, dx, dy) {
    if (!this.#start) return;
    const { height } = this.#picture;
    const zoomed = cameras.zoom(this.#start, factor, ...this.#picture.fromCentre(x, y), this.#sphere.radius);
    this.#move(cameras.pan(zoomed, dx / height, dy / height), true);
  }

  zoomAt(factor, x, y) {
    if (!this.#state.view) return;
    this.#move(cameras.zoom(this.orbit, factor, ...this.#picture.fromCentre(x, y), this.#sphere.radius), true);
    // A drag goes on from here.
    if (this.#start) this.#start = this.orbit;
  }

  click(x, y) {
    const pixel = this.#picture.pixelAt(x, y);
    if (!pixel) this.select(null);
    else this.#connection.pick(...pixel, ({ object }) => this.select(object ?? null));
  }

  recentre(x, y) {
    const pixel = this.#picture.pixelAt(x, y);
    if (!pixel) return;
    this.#connection.pick(...pixel, ({ point }) => {
      if (point) this.#move({ ...this.orbit, target: point }, false);
    });
  }

  // Keys and buttons

  turn(right, up) {
    if (this.#state.view) this.#move(cameras.turn(this.orbit, right * KEY_DEGREES, up * KEY_DEGREES), true);
  }

  pan(right, down) {
    if (this.#state.view) this.#move(cameras.pan(this.orbit, -right * KEY_PAN, -down * KEY_PAN), true);
  }

  zoom(steps) {
    if (this.#state.view) this.#move(cameras.zoom(this.orbit, KEY_ZOOM ** steps, 0, 0, this.#sphere.radius), true);
  }

  standard(name) {
    if (!this.#state.view) return;
    const [azimuth, elevation] = cameras.STANDARD_VIEWS[name];
    this.#move({ ...this.orbit, azimuth, elevation }, false);
  }

  #frame(sphere) {
    this.#move(cameras.frame(this.orbit, sphere, this.#picture.aspect), false);
  }

  frameAll() {
    if (this.#state.view) this.#frame(this.#sphere);
  }

  frameSelected() {
    const bounds = this.#scene?.objects[this.#state.selected]?.bounds;
    if (bounds) this.#frame(cameras.sphereOf(bounds));
    else this.frameAll();
  }

  reset() {
    if (this.#first) this.#state.change({ camera: this.#first.camera });
  }

  fileCamera(index) {
    this.#state.change({ camera: { kind: "file", index } });
  }

  leaveFileCamera() {
    if (this.#state.view) this.#move(this.orbit, false);
  }

  nextCamera() {
    const count = this.#scene?.cameras.length;
    if (!count) return;
    const { camera } = this.#state.view;
    this.fileCamera(camera.kind === "file" ? (camera.index + 1) % count : 0);
  }

  projection(projection) {
    if (this.#state.view) this.#move(cameras.withProjection(this.orbit, projection), false);
  }

  toggleProjection() {
    if (this.#state.view) this.projection(this.orbit.projection === "perspective" ? "orthographic" : "perspective");
  }

  yfov(degrees) {
    if (this.#state.view) this.#move(cameras.withYfov(this.orbit, degrees), true);
  }

  select(index) {
    this.#state.select(index);
  }

  hide(index, isHidden) {
    const { hidden } = this.#state.view;
    if (isHidden) {
      this.#setHidden(new Set([...hidden, index]));
      return;
    }
    // Objects of one name are hidden together.
    const { objects } = this.#scene;
    this.#setHidden(new Set(hidden.filter(i => i !== index && objects[i]?.name !== objects[index].name)));
  }

  hideAll(indices) {
    this.#setHidden(new Set([...this.#state.view.hidden, ...indices]));
  }

  showAll(indices) {
    const shown = new Set(indices);
    this.#setHidden(new Set(this.#state.view.hidden.filter(i => !shown.has(i))));
  }

  showOnlySelected() {
    const { selected } = this.#state;
    if (selected === null) return;
    this.#setHidden(new Set([...this.#scene.objects.keys()].filter(i => i !== selected)));
  }

  toggleSelected() {
    const { selected, view } = this.#state;
    if (selected !== null) this.hide(selected, !view.hidden.includes(selected));
  }

  #setHidden(hidden) {
    this.#state.change({ hidden: [...hidden].sort((a, b) => a - b) });
  }

  animate(value) {
    this.#playback.stop();
    this.#state.change({ animation: value === "" ? null : Number(value), time: 0 });
  }

  seek(time) {
    this.#playback.stop();
    this.#state.change({ time: Number(time.toFixed(3)) }, true);
  }

  togglePlay() {
    this.#playback.toggle(this.#scene?.animations[this.#state.view?.animation]?.seconds ?? 0);
  }

  showKeys() {
    document.getElementById("keys").showModal();
  }

  resize(size) {
    this.#picture.fixedSize = size;
    this.#picture.layOut();
    this.#state.change({});
  }
}
