// Camera: from where one looks at a mesh, by parallel rays. Coordinates are those of a Frame: from
// the middle of the mesh, -1..1 along its largest side; z is up. Cameras are not changed: each
// function gives another one.

/** From which one looks where nobody says it: from the right, from before, and from above. */
export const USUAL_VIEW = [1, -2, 1];

/** Most and least that one may come near: times that the fitted mesh is enlarged. */
const MOST_ZOOM = 1e5;
const LEAST_ZOOM = 0.05;

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0]];

/** The camera that looks from the direction `view`, which is not 0, at the middle of the frame.
 *  `lift`: how far above the middle of the picture the target is, in halves of its smaller side. */
export function cameraFrom(view) {
  const across = Math.hypot(view[0], view[1]);
  const high = Math.atan2(view[2], across);
  // From above and from below y is up.
  const round = across < 1e-3 * Math.abs(view[2]) ? -Math.PI / 2 : Math.atan2(view[1], view[0]);
  return { round, high, zoom: 1, scale: 1, lift: 0, target: [0, 0, 0] };
}

/** Of length 1 and at right angles: to the right, up, and to who looks. */
export function axesOf({ round, high }) {
  const view = [Math.cos(high) * Math.cos(round), Math.cos(high) * Math.sin(round),
    Math.sin(high)];
  const right = [-Math.sin(round), Math.cos(round), 0];
  return { right, up: cross(view, right), view };
}

/** Turned by angles: round the mesh, and up, no further than straight above and below. */
export function turned(camera, round, high) {
  const most = Math.PI / 2;
  return { ...camera,
    round: (camera.round + round) % (2 * Math.PI),
    high: Math.min(Math.max(camera.high + high, -most), most) };
}

/** Moved by so much of half the smaller side of the picture: to the right, and up. */
export function moved(camera, across, upwards) {
  const { right, up } = axesOf(camera);
  const size = 1 / (camera.scale * camera.zoom);
  const most = 10; // further off nothing is found again
  return { ...camera,
    target: camera.target.map((at, i) =>
      Math.min(Math.max(at - size * (across * right[i] + upwards * up[i]), -most), most)) };
}

/** Enlarged; what is at (across, upwards) of the picture, as moved() has it, stays there. */
export function zoomed(camera, times, across = 0, upwards = 0) {
  const zoom = Math.min(Math.max(camera.zoom * times, LEAST_ZOOM), MOST_ZOOM);
  const real = zoom / camera.zoom;
  const high = upwards - camera.lift;
  const near = moved(camera, across / real * (1 - real), high / real * (1 - real));
  return { ...near, zoom };
}

/** Fitted: a box {least, most} of the frame's coordinates as large as the picture lets it be.
 *  `aspect`: width by height; `below`: which share of the height, from its lower side, is for
 *  something else. */
export function fitted(camera, { least, most }, aspect, below = 0) {
  const { right, up } = axesOf(camera);
  const half = most.map((to, i) => (to - least[i]) / 2);
  const reach = (axis) => Math.max(half.reduce((sum, side, i) => sum + side * Math.abs(axis[i]), 0),
    1e-9);
  const [wide, tall] = aspect >= 1 ? [aspect, 1] : [1, 1 / aspect];
  const scale = 0.92 * Math.min(wide / reach(right), tall * (1 - below) / reach(up));
  return { ...camera, zoom: 1, scale: Math.min(scale, 1e6), lift: tall * below,
    target: most.map((to, i) => (to + least[i]) / 2) };
}

/** What takes coordinates of the frame to those of WebGL, column by column. */
export function matrixOf(camera, aspect) {
  const { right, up, view } = axesOf(camera);
  const size = camera.scale * camera.zoom;
  const [wide, tall] = aspect >= 1 ? [aspect, 1] : [1, 1 / aspect];
  const rows = [right.map((part) => part * size / wide), up.map((part) => part * size / tall),
    view.map((part) => -part / 4)]; // no mesh is deeper: 2 sqrt(3), and what clamps let through
  const at = rows.map((row) => -dot(row, camera.target));
  at[1] += camera.lift / tall;
  // Depth does not follow the target: what is there stays between before and behind.
  at[2] = 0;
  return new Float32Array([0, 1, 2].flatMap((c) => [rows[0][c], rows[1][c], rows[2][c], 0])
    .concat(at, 1));
}

/** Directions of keys: from each side of the mesh. */
export const SIDES = { 1: [1, 0, 0], 2: [-1, 0, 0], 3: [0, 1, 0], 4: [0, -1, 0], 5: [0, 0, 1],
  6: [0, 0, -1], 7: USUAL_VIEW };
