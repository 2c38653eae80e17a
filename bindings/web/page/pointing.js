// Controls the camera by mouse, touch and keys. takePointers() calls its argument `change` for each
// movement, with a function that converts the old camera to the new camera. Its argument `element`
// is the HTML element of the picture.
import { moved, turned, zoomed } from "./camera.js";

// rotation in radians when the pointer moves by half the smaller side of the picture
const TURN = 2.5;
const KEY_TURN = Math.PI / 24;
const KEY_MOVE = 0.1;
const KEY_ZOOM = 1.25;

export function takePointers(element, change) {
  const pointers = new Map(); // pressed pointers, by id: {x, y}
  const size = () => Math.max(Math.min(element.clientWidth, element.clientHeight) / 2, 1);
  /** Converts a point to coordinates relative to the middle of the picture; the unit is half its
   *  smaller side. */
  const placeOf = (x, y) => {
    const box = element.getBoundingClientRect();
    return [(x - box.left - box.width / 2) / size(), (box.top + box.height / 2 - y) / size()];
  };
  const middle = () => {
    const all = [...pointers.values()];
    const mean = (key) => all.reduce((sum, one) => sum + one[key], 0) / all.length;
    return { x: mean("x"), y: mean("y") };
  };
  const spread = () => {
    const [a, b] = [...pointers.values()];
    return Math.max(Math.hypot(a.x - b.x, a.y - b.y), 1);
  };

  element.addEventListener("pointerdown", (event) => {
    element.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
    element.addEventListener(end, (event) => pointers.delete(event.pointerId));
  }
  element.addEventListener("pointermove", (event) => {
    if (!pointers.has(event.pointerId)) return;
    const before = { ...middle(), spread: pointers.size === 2 ? spread() : 0 };
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const now = middle();
    const across = (now.x - before.x) / size();
    const upwards = (before.y - now.y) / size();
    if (pointers.size === 1) {
      const isMove = event.shiftKey || (event.buttons & 6) !== 0; // right or middle button
      change((camera) => (isMove ? moved(camera, across, upwards)
        : turned(camera, -TURN * across, -TURN * upwards)));
    } else if (pointers.size === 2) {
      const times = spread() / before.spread;
      const [x, y] = placeOf(now.x, now.y);
      change((camera) => zoomed(moved(camera, across, upwards), times, x, y));
    }
  });
  element.addEventListener("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : event.deltaMode === 2 ? 400 : 1;
    const times = Math.exp(Math.min(Math.max(-event.deltaY * lines, -400), 400) / 500);
    const [x, y] = placeOf(event.clientX, event.clientY);
    change((camera) => zoomed(camera, times, x, y));
  }, { passive: false });
  element.addEventListener("contextmenu", (event) => event.preventDefault());
}

/** Returns the effect of a key on the camera: a function that converts the old camera to the new
 *  camera, or null if the key has no effect. */
export function cameraKey({ key, shiftKey }) {
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  if (Object.hasOwn(arrows, key)) {
    const [x, y] = arrows[key];
    return shiftKey ? (camera) => moved(camera, KEY_MOVE * x, KEY_MOVE * y)
      : (camera) => turned(camera, -KEY_TURN * x, -KEY_TURN * y);
  }
  if (key === "+" || key === "=") return (camera) => zoomed(camera, KEY_ZOOM);
  if (key === "-" || key === "_") return (camera) => zoomed(camera, 1 / KEY_ZOOM);
  return null;
}
