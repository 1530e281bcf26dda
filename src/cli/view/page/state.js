// The state of the page: the view that the renderer shows, and the selected object.

/** Milliseconds without a change after which the picture is refined. */
const SETTLE = 150;

export class State extends EventTarget {
  /** The view as the protocol has it; null until the first scene. */
  view = null;
  selected = null;
  #moving = false;
  #timer = 0;
  #isHeld = false;

  /** True while changes follow one another: the renderer then makes coarse pictures. */
  get moving() {
    return this.#moving;
  }

  /** Replaces fields of the view. `moving` says that more changes will follow at once. */
  change(patch, moving = false) {
    if (!this.view) return;
    this.view = { ...this.view, ...patch };
    if (moving) this.#moves();
    this.#emit("view");
  }

  /** Keeps the picture coarse until `release`, as during a drag. */
  hold() {
    this.#isHeld = true;
  }

  release() {
    this.#isHeld = false;
    if (this.#moving) this.#moves();
  }

  select(index) {
    if (index === this.selected) return;
    this.selected = index;
    this.#emit("selection");
  }

  #moves() {
    this.#moving = true;
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => {
      if (this.#isHeld) return;
      this.#moving = false;
      this.#emit("view");
    }, SETTLE);
  }

  #emit(type) {
    this.dispatchEvent(new Event(type));
  }
}

/** Carries the view over to another list of objects, by name. */
export function carryOver(view, oldScene, scene) {
  const hiddenNames = new Set(view.hidden.map(i => oldScene.objects[i]?.name));
  const hidden = [...scene.objects.keys()].filter(i => hiddenNames.has(scene.objects[i].name));
  const { camera, animation, variant } = view;
  const isLost = camera.kind === "file" && camera.index >= scene.cameras.length;
  return {
    ...view,
    hidden,
    camera: isLost ? scene.view.camera : camera,
    animation: animation !== null && animation >= scene.animations.length ? null : animation,
    variant: scene.variants.includes(variant) ? variant : null,
  };
}
