/** Pointer and wheel on a picture: drag to move, wheel or pinch to magnify, click to select. */

/** How far a pointer may stray in a click [px]. */
const CLICK_PX = 5;

/** @param on {pan(right, down), magnify(factor, x, y), click(x, y)}, all in pixels of the picture. */
export function listen(canvas, on) {
  const pointers = new Map();
  let strayed = 0;
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 30 : 1;
    on.magnify(Math.exp(-0.0016 * lines * event.deltaY), event.offsetX, event.offsetY);
  }, { passive: false });
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, event);
    strayed = pointers.size > 1 ? Infinity : 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const old = spread([...pointers.values()]);
    pointers.set(event.pointerId, event);
    const now = spread([...pointers.values()]);
    strayed += Math.hypot(event.offsetX - before.offsetX, event.offsetY - before.offsetY);
    if (strayed <= CLICK_PX) return;
    on.pan(now.x - old.x, now.y - old.y);
    if (old.width > 0) on.magnify(now.width / old.width, now.x, now.y);
  });
  canvas.addEventListener("pointerup", (event) => {
    if (pointers.delete(event.pointerId) && strayed <= CLICK_PX) on.click(event.offsetX, event.offsetY);
  });
  canvas.addEventListener("pointercancel", (event) => pointers.delete(event.pointerId));
}

/** Middle of the pointers and how far they are apart, 0 for one. */
function spread(pointers) {
  const x = pointers.reduce((sum, pointer) => sum + pointer.offsetX, 0) / pointers.length;
  const y = pointers.reduce((sum, pointer) => sum + pointer.offsetY, 0) / pointers.length;
  return { x, y, width: 2 * Math.hypot(pointers[0].offsetX - x, pointers[0].offsetY - y) };
}
