// The picture: the newest frame, fitted into the space beside the panel, and the box of the selected object.

import { edgesOf, projectSegment } from "./camera.js";

/** Pixels of the screen per pixel of the page that are rendered at most. */
const LARGEST_RATIO = 2;
/** Difference of aspect ratios, as a fraction, from which a frame is one of another size. */
const STALE_ASPECT = 0.05;
const SMALLEST_SIDE = 16;
const LARGEST_SIDE = 8192;

export class Picture {
  #stage;
  #canvas;
  #outline;
  #newest = 0;
  /** The last frame: {header, blob}. */
  shown = null;
  #box = null;
  #camera = null;
  /** Fixed width and height, or null for those of the window. */
  fixedSize = null;

  constructor(stage, canvas, outline) {
    this.#stage = stage;
    this.#canvas = canvas;
    this.#outline = outline;
  }

  get pixelRatio() {
    return Math.min(LARGEST_RATIO, window.devicePixelRatio || 1);
  }

  /** Returns the size of the final picture in pixels. */
  get size() {
    if (this.fixedSize) return this.fixedSize;
    const side = length => Math.min(LARGEST_SIDE, Math.max(SMALLEST_SIDE, Math.round(length * this.pixelRatio)));
    return [side(this.#stage.clientWidth), side(this.#stage.clientHeight)];
  }

  get aspect() {
    const [width, height] = this.size;
    return width / height;
  }

  /** Returns the rectangle of the picture on the page. */
  get #rect() {
    const [width, height] = this.size;
    const { left, top, width: w, height: h } = this.#stage.getBoundingClientRect();
    // Pixels of a picture of the window's size are pixels of the screen, but for rounding.
    if (!this.fixedSize) return { left, top, width: width / this.pixelRatio, height: height / this.pixelRatio };
    const factor = Math.min(w / width, h / height);
    const rect = { width: width * factor, height: height * factor };
    return { left: left + (w - rect.width) / 2, top: top + (h - rect.height) / 2, ...rect };
  }

  /** Height of the picture on the page, in pixels of the page. */
  get height() {
    return this.#rect.height;
  }

  /** Converts a position on the page to heights of the picture from its centre, to the right and down. */
  fromCentre(x, y) {
    const { left, top, width, height } = this.#rect;
    return [(x - left - width / 2) / height, (y - top - height / 2) / height];
  }

  /** Converts a position on the page to a pixel, or null beside the picture. */
  pixelAt(x, y) {
    const { left, top, width, height } = this.#rect;
    const [columns, rows] = this.size;
    const pixel = [Math.floor(((x - left) / width) * columns), Math.floor(((y - top) / height) * rows)];
    return pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] < columns && pixel[1] < rows ? pixel : null;
  }

  /** Places the canvas after a change of the size. */
  layOut() {
    const { width, height } = this.#rect;
    for (const { style } of [this.#canvas, this.#outline]) {
      style.width = `${width}px`;
      style.height = `${height}px`;
      style.placeSelf = this.fixedSize ? "center" : "start";
    }
    // A frame of the old size is not stretched. The sides of coarse frames are rounded.
    const { width: columns, height: rows } = this.#canvas;
    const isStale = Math.abs((columns * height) / (rows * width) - 1) > STALE_ASPECT;
    this.#canvas.style.objectFit = isStale ? "contain" : "fill";
    this.#canvas.style.imageRendering = columns > width * this.pixelRatio ? "auto" : "pixelated";
    this.#outline.style.visibility = isStale ? "hidden" : "visible";
  }

  /** Shows a frame, unless a newer one has been decoded before it. */
  async show(header, blob, camera) {
    const number = ++this.#newest;
    const decoded = await createImageBitmap(blob);
    if (number < this.#newest) {
      decoded.close();
      return;
    }
    if (this.#canvas.width !== decoded.width) this.#canvas.width = decoded.width;
    if (this.#canvas.height !== decoded.height) this.#canvas.height = decoded.height;
    const context = this.#canvas.getContext("2d");
    context.clearRect(0, 0, decoded.width, decoded.height);
    context.drawImage(decoded, 0, 0);
    decoded.close();
    this.shown = { header, blob };
    this.#camera = camera;
    this.layOut();
    this.#drawBox();
  }

  /** Returns the camera of the shown frame, or null. */
  get camera() {
    return this.#camera;
  }

  /** Marks an object by its bounds, or nothing if they are null. */
  mark(bounds) {
    this.#box = bounds;
    this.#drawBox();
  }

  #drawBox() {
    const lines = [];
    if (this.#box && this.#camera) {
      for (const [a, b] of edgesOf(this.#box)) {
        const ends = projectSegment(this.#camera, a, b);
        if (ends) lines.push("M" + ends.map(([x, y]) => `${(x * 1000).toFixed(1)} ${(y * 1000).toFixed(1)}`).join("L"));
      }
    }
    for (const path of this.#outline.querySelectorAll("path")) path.setAttribute("d", lines.join(""));
  }
}
