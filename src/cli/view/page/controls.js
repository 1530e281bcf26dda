// The controls of the panel: shows the state in them, and changes the state by them.

const $ = id => document.getElementById(id);

/** Texts of choices, by their values; others are shown as they are. */
const NAMES = {
  lights: { "": "Default", file: "From the file", headlight: "Headlight", "three-point": "Three-point", none: "None" },
  hdri: { none: "None", studio: "Studio", sky: "Sky" },
  view_transform: { "": "Automatic", auto: "Automatic", standard: "Standard", agx: "AgX", filmic: "Filmic", "pbr-neutral": "PBR Neutral", raw: "Raw" },
  background: { "": "Default", transparent: "Transparent", hdri: "Environment", color: "Colour" },
};
const SAMPLES = [1, 4, 16, 64, 256];
const AO_RAYS = [4, 8, 16, 32, 64, 128];
const DEFAULT_AO = 16;
const COLOR = "color";

/** Fills a select with [value, text] pairs and keeps a value that is not among them. */
function fill(select, pairs, value) {
  const key = String(value);
  const all = pairs.some(([v]) => String(v) === key) ? pairs : [...pairs, [value, String(value)]];
  const wanted = JSON.stringify(all);
  // Options that are filled again would close an open select.
  if (select.dataset.filled !== wanted) {
    select.dataset.filled = wanted;
    select.replaceChildren(...all.map(([v, text]) => new Option(text, String(v))));
  }
  select.value = key;
}

const named = (kind, values, value) => {
  const all = values ?? [];
  return [...all, ...(all.includes(value) ? [] : [value])].map(text => [text, NAMES[kind][text] ?? text]);
};
const signed = (x, digits) => (x < 0 ? "−" : "+") + Math.abs(x).toFixed(digits);
const isHexColor = text => /^#[0-9a-f]{6}$/i.test(text);

export class Controls {
  #state;
  #actions;

  /** `actions` are those of the keys, and resize(size or null). */
  constructor(state, actions) {
    this.#state = state;
    this.#actions = actions;
    this.#listenToCamera();
    this.#listenToChoices();
    this.#listenToSliders();
    this.#listenToSize();
  }

  #listenToCamera() {
    const actions = this.#actions;
    $("camera").addEventListener("change", event => {
      if (event.target.value === "free") actions.leaveFileCamera();
      else actions.fileCamera(Number(event.target.value));
    });
    for (const button of document.querySelectorAll("[data-standard]")) {
      button.addEventListener("click", () => actions.standard(button.dataset.standard));
    }
    $("frame-all").addEventListener("click", () => actions.frameAll());
    $("reset").addEventListener("click", () => actions.reset());
    for (const radio of document.getElementsByName("projection")) {
      radio.addEventListener("change", () => actions.projection(radio.value));
    }
    $("yfov").addEventListener("input", event => actions.yfov(Number(event.target.value)));
  }

  #listenToChoices() {
    const state = this.#state;
    const onChange = (id, patch) =>
      $(id).addEventListener("change", event => state.change(patch(event.target)));
    onChange("variant", select => ({ variant: select.value || null }));
    onChange("lights", select => ({ lights: select.value }));
    onChange("hdri", select => {
      if (select.value !== "none") return { hdri: select.value };
      // What no longer exists cannot be the background.
      return { hdri: null, ...(state.view.background === "hdri" ? { background: "" } : {}) };
    });
    onChange("view-transform", select => ({ view_transform: select.value }));
    onChange("samples", select => ({ samples: Number(select.value) }));
    onChange("ground", box => ({ ground: box.checked }));
    onChange("ao-on", box => ({ ao: box.checked ? DEFAULT_AO : 0 }));
    onChange("ao", select => ({ ao: Number(select.value) }));
    onChange("background", select => ({ background: select.value === COLOR ? $("background-color").value : select.value }));
    $("background-color").addEventListener("input", event => state.change({ background: event.target.value }, true));
    onChange("auto-exposure", box => ({ exposure: box.checked ? "auto" : this.#metered }));
    $("animation").addEventListener("change", event => this.#actions.animate(event.target.value));
  }

  #listenToSliders() {
    const slide = (id, patch) =>
      $(id).addEventListener("input", event => this.#state.change(patch(Number(event.target.value)), true));
    slide("hdri-rotate", hdri_rotate => ({ hdri_rotate }));
    slide("exposure", exposure => ({ exposure }));
    $("time").addEventListener("input", event => this.#actions.seek(Number(event.target.value)));
    $("play").addEventListener("click", () => this.#actions.togglePlay());
  }

  #listenToSize() {
    const resize = () => {
      const isFixed = document.querySelector("[name=size]:checked").value === "fixed";
      $("size-field").hidden = !isFixed;
      const fields = [$("width"), $("height")];
      if (isFixed && fields.some(field => !field.validity.valid || !field.value)) return;
      this.#actions.resize(isFixed ? fields.map(field => Number(field.value)) : null);
    };
    for (const radio of document.getElementsByName("size")) radio.addEventListener("change", resize);
    for (const id of ["width", "height"]) $(id).addEventListener("change", resize);
    $("size-field").hidden = true;
  }

  /** Shows and applies a fixed size, as [width, height]; null for that of the window. */
  set size(size) {
    document.querySelector(`[name=size][value=${size ? "fixed" : "window"}]`).checked = true;
    if (size) [$("width").value, $("height").value] = size;
    $("size-field").hidden = !size;
    this.#actions.resize(size);
  }

  /** The exposure of the last picture, for the slider. */
  #metered = 0;

  /** Takes the exposure that a picture was made with. */
  set metered(exposure) {
    this.#metered = Math.round(exposure * 10) / 10;
    if (this.#state.view?.exposure === "auto") this.#showExposure("auto");
  }

  /** Shows what a scene offers. */
  showScene(scene) {
    $("camera-field").hidden = !scene.cameras.length;
    $("variant-section").hidden = !scene.variants.length;
    $("time-section").hidden = !scene.animations.length;
    this.show(scene, this.#state.view);
  }

  /** Shows a view in all controls. */
  show(scene, view) {
    const { choices = {} } = scene;
    const cameras = scene.cameras.map(({ name }, i) => [i, name || `Camera ${i + 1}`]);
    fill($("camera"), [["free", "Free"], ...cameras], view.camera.kind === "file" ? view.camera.index : "free");
    this.#showLens(view.camera);
    fill($("variant"), [["", "Default"], ...scene.variants.map(name => [name, name])], view.variant ?? "");
    this.#showTime(scene, view);
    fill($("lights"), named("lights", choices.lights, view.lights), view.lights);
    fill($("hdri"), named("hdri", choices.hdri, view.hdri ?? "none"), view.hdri ?? "none");
    this.#showSlider("hdri-rotate", view.hdri_rotate, `${Math.round(view.hdri_rotate)}°`);
    $("rotation-field").hidden = !view.hdri;
    $("ao-on").checked = view.ao > 0;
    $("ao-field").hidden = !(view.ao > 0);
    fill($("ao"), AO_RAYS.map(n => [n, n]), view.ao > 0 ? view.ao : DEFAULT_AO);
    $("ground").checked = view.ground;
    $("auto-exposure").checked = view.exposure === "auto";
    this.#showExposure(view.exposure);
    fill($("view-transform"), named("view_transform", choices.view_transforms, view.view_transform), view.view_transform);
    const isColor = isHexColor(view.background);
    const background = isColor ? COLOR : view.background;
    const others = (choices.backgrounds ?? []).filter(text => text && !isHexColor(text));
    fill($("background"), named("background", ["", ...others, COLOR], background), background);
    $("color-field").hidden = !isColor;
    if (isColor) $("background-color").value = view.background;
    fill($("samples"), SAMPLES.map(n => [n, n]), view.samples);
  }

  #showSlider(id, value, text) {
    // A slider that is being dragged is not set.
    if (!$(id).matches(":active")) $(id).value = value;
    $(`${id}-text`).textContent = text;
    $(id).setAttribute("aria-valuetext", text);
  }

  #showExposure(exposure) {
    const isAuto = exposure === "auto";
    const value = isAuto ? this.#metered : exposure;
    $("exposure").disabled = isAuto;
    this.#showSlider("exposure", value, `${signed(value, 1)} EV`);
  }

  #showLens(camera) {
    const isFree = camera.kind === "orbit";
    for (const radio of document.getElementsByName("projection")) {
      radio.checked = isFree && radio.value === camera.projection;
    }
    $("yfov").disabled = !isFree || camera.projection !== "perspective";
    if (isFree) this.#showSlider("yfov", camera.yfov, `${Math.round(camera.yfov)}°`);
    else $("yfov-text").textContent = "of the file’s camera";
    $("camera-facts").hidden = !isFree;
    if (isFree) {
      const { azimuth, elevation, distance } = camera;
      const angle = degrees => `${degrees.toFixed(1).replace("-", "−")}°`;
      $("camera-facts").textContent =
        `Azimuth ${angle(azimuth)}, elevation ${angle(elevation)}, distance ${Number(distance.toPrecision(4))}`;
    }
  }

  #showTime(scene, view) {
    const animations = scene.animations.map(({ name }, i) => [i, name || `Animation ${i + 1}`]);
    fill($("animation"), [["", "Rest pose"], ...animations], view.animation ?? "");
    const seconds = scene.animations[view.animation]?.seconds ?? 0;
    $("time").max = seconds || 1;
    $("time").disabled = $("play").disabled = !(seconds > 0);
    this.#showSlider("time", view.time, `${view.time.toFixed(2)} of ${seconds.toFixed(2)} s`);
  }

  /** Shows whether the animation plays. */
  set isPlaying(isPlaying) {
    $("play").textContent = isPlaying ? "Pause" : "Play";
  }
}
