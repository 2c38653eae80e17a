// Camera: a parallel projection of the mesh. The coordinates are frame coordinates (surface.js):
// the middle of the mesh is 0, and the largest side of its bounding box is -1..1; z is up. A camera
// is immutable, so functions that change a camera return a new camera.

/** Default direction of view: the viewer looks from the right, the front, and above. */
export const USUAL_VIEW = [1, -2, 1];

/** Limits of the zoom factor. At a factor of 1, the mesh fits the picture. */
const MOST_ZOOM = 1e5;
const LEAST_ZOOM = 0.05;

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0]];

/** Returns a camera that looks at the middle of the mesh. `view` is the direction from the middle
 *  to the viewer, and must not be 0. A camera shows the point `target` at a height of `lift` above
 *  the middle of the picture; the unit of `lift` is half the smaller side of the picture. */
export function cameraFrom(view) {
  const across = Math.hypot(view[0], view[1]);
  const high = Math.atan2(view[2], across);
  // If the camera looks from straight above or below, y is up.
  const round = across < 1e-3 * Math.abs(view[2]) ? -Math.PI / 2 : Math.atan2(view[1], view[0]);
  return { round, high, zoom: 1, scale: 1, lift: 0, target: [0, 0, 0] };
}

/** Returns three orthogonal unit vectors: to the right, up, and towards the viewer. */
export function axesOf({ round, high }) {
  const view = [Math.cos(high) * Math.cos(round), Math.cos(high) * Math.sin(round),
    Math.sin(high)];
  const right = [-Math.sin(round), Math.cos(round), 0];
  return { right, up: cross(view, right), view };
}

/** Returns the camera rotated by two angles in radians: `round` around the vertical axis, and
 *  `high` upwards. The camera cannot rotate beyond the views from straight above and straight
 *  below. */
export function turned(camera, round, high) {
  const most = Math.PI / 2;
  return { ...camera,
    round: (camera.round + round) % (2 * Math.PI),
    high: Math.min(Math.max(camera.high + high, -most), most) };
}

/** Returns the camera moved to the right and up, in units of half the smaller side of the
 *  picture. */
export function moved(camera, across, upwards) {
  const { right, up } = axesOf(camera);
  const size = 1 / (camera.scale * camera.zoom);
  const most = 10; // limits the movement, so that the user does not lose sight of the mesh
  return { ...camera,
    target: camera.target.map((coordinate, i) =>
      Math.min(Math.max(coordinate - size * (across * right[i] + upwards * up[i]), -most), most)) };
}

/** Returns the camera zoomed by the factor `times`. The point of the picture at (across, upwards),
 *  in the units of moved(), does not move. */
export function zoomed(camera, times, across = 0, upwards = 0) {
  const zoom = Math.min(Math.max(camera.zoom * times, LEAST_ZOOM), MOST_ZOOM);
  const real = zoom / camera.zoom;
  const high = upwards - camera.lift;
  const near = moved(camera, across / real * (1 - real), high / real * (1 - real));
  return { ...near, zoom };
}

/** Returns the camera that fits a box into the picture. The box is {least, most}, in frame
 *  coordinates (surface.js). `aspect`: width of the picture divided by its height. `below`:
 *  fraction of the picture's height that stays free at the bottom. */
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

/** Returns the matrix that converts frame coordinates (surface.js) to WebGL's clip coordinates, in
 *  column-major order. */
export function matrixOf(camera, aspect) {
  const { right, up, view } = axesOf(camera);
  const size = camera.scale * camera.zoom;
  const [wide, tall] = aspect >= 1 ? [aspect, 1] : [1, 1 / aspect];
  const rows = [right.map((part) => part * size / wide), up.map((part) => part * size / tall),
    // The factor 1/4 keeps the depth of all points in -1..1: inFrame() limits coordinates to -2..2,
    // so that the distance from the middle is at most 2 sqrt(3).
    view.map((part) => -part / 4)];
  const shift = rows.map((row) => -dot(row, camera.target));
  shift[1] += camera.lift / tall;
  // The depth of a point does not depend on the target, so that the whole mesh stays in the depth
  // range.
  shift[2] = 0;
  return new Float32Array([0, 1, 2].flatMap((c) => [rows[0][c], rows[1][c], rows[2][c], 0])
    .concat(shift, 1));
}

/** Direction of view for each number key: 1 to 6 show the sides of the mesh, 7 selects the default
 *  view. */
export const SIDES = { 1: [1, 0, 0], 2: [-1, 0, 0], 3: [0, 1, 0], 4: [0, -1, 0], 5: [0, 0, 1],
  6: [0, 0, -1], 7: USUAL_VIEW };
