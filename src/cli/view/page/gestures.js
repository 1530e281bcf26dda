// Pointer gestures on the picture: drags, pinches, the wheel, clicks and double clicks.
//
// Positions and distances are in pixels of the page. Drags count from where they began.

/** A pointer that moves less is a click, in pixels. */
const CLICK_DISTANCE = 4;
const WHEEL_SPEED = 0.0015;
const PINCH_WHEEL_SPEED = 0.01;
/** Pixels of a line and of a page of the wheel. */
const WHEEL_UNITS = [1, 16, 400];

/**
 * Calls `actions` for gestures on an element: begin(), orbit(dx, dy), pan(dx, dy), pinch(factor, x, y, dx, dy), end(),
 * zoom(factor, x, y), click(x, y) and recentre(x, y).
 */
export function listenToGestures(element, actions) {
  const pointers = new Map();
  let drag = null;

  const middle = () => {
    const all = [...pointers.values()];
    const x = all.reduce((sum, p) => sum + p.x, 0) / all.length;
    const y = all.reduce((sum, p) => sum + p.y, 0) / all.length;
    const spread = all.length > 1 ? Math.hypot(all[0].x - all[1].x, all[0].y - all[1].y) : 0;
    return { x, y, spread };
  };

  const begin = (kind, isClick) => {
    drag = { kind, from: middle(), isClick };
    actions.begin();
  };

  element.addEventListener("pointerdown", event => {
    if (event.pointerType === "mouse" && pointers.size) return;
    element.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (pointers.size > 2) return;
    const pans = event.button !== 0 || event.shiftKey;
    begin(pointers.size === 2 ? "pinch" : pans ? "pan" : "orbit", pointers.size === 1 && event.button === 0);
  });

  element.addEventListener("pointermove", event => {
    const pointer = pointers.get(event.pointerId);
    if (!pointer || !drag) return;
    pointer.x = event.clientX;
    pointer.y = event.clientY;
    const at = middle();
    const [dx, dy] = [at.x - drag.from.x, at.y - drag.from.y];
    if (drag.isClick && Math.hypot(dx, dy) < CLICK_DISTANCE) return;
    drag.isClick = false;
    if (drag.kind === "pinch") {
      if (drag.from.spread > 0 && at.spread > 0) {
        actions.pinch(at.spread / drag.from.spread, drag.from.x, drag.from.y, dx, dy);
      }
    } else {
      actions[drag.kind](dx, dy);
    }
  });

  const release = event => {
    if (!pointers.delete(event.pointerId) || !drag) return;
    const { isClick, from } = drag;
    if (pointers.size === 1) {
      // The finger that stays goes on.
      begin("orbit", false);
      return;
    }
    if (pointers.size) return;
    drag = null;
    actions.end();
    if (isClick && event.type === "pointerup" && !event.shiftKey) actions.click(from.x, from.y);
  };
  element.addEventListener("pointerup", release);
  element.addEventListener("pointercancel", release);

  element.addEventListener("dblclick", event => actions.recentre(event.clientX, event.clientY));
  element.addEventListener("contextmenu", event => event.preventDefault());
  // The middle button would scroll.
  element.addEventListener("mousedown", event => { if (event.button === 1) event.preventDefault(); });
  element.addEventListener("wheel", event => {
    event.preventDefault();
    const speed = event.ctrlKey ? PINCH_WHEEL_SPEED : WHEEL_SPEED;
    const delta = event.deltaY * WHEEL_UNITS[event.deltaMode];
    actions.zoom(Math.exp(-Math.max(-200, Math.min(200, delta)) * speed), event.clientX, event.clientY);
  }, { passive: false });
}
