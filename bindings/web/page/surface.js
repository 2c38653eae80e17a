// Surface: converts the boundary surface that boundary() in shmformat.d.ts returns to arrays for
// the graphics card. Coordinates and values in a file may be any numbers. Points with coordinates
// that are not finite are not drawn, and values that are not finite are shown as missing.

/** Returns the frame of the mesh, which defines frame coordinates: the middle of the bounding box
 *  of all finite points is 0, and the largest side of the box is -1..1. */
export function frameOf(points) {
  const least = [Infinity, Infinity, Infinity];
  const most = [-Infinity, -Infinity, -Infinity];
  for (let v = 0; v < points.length; v += 3) {
    if (!Number.isFinite(points[v]) || !Number.isFinite(points[v + 1])
        || !Number.isFinite(points[v + 2])) continue;
    for (let i = 0; i < 3; ++i) {
      if (points[v + i] < least[i]) least[i] = points[v + i];
      if (points[v + i] > most[i]) most[i] = points[v + i];
    }
  }
  const isEmpty = least[0] > most[0];
  if (isEmpty) return { middle: [0, 0, 0], half: 1, least: [0, 0, 0], most: [0, 0, 0], isEmpty };
  // The numbers are halved before they are added or subtracted; otherwise the result could be
  // infinite for very large numbers.
  const middle = least.map((from, i) => from / 2 + most[i] / 2);
  const half = Math.max(...least.map((from, i) => most[i] / 2 - from / 2));
  return { middle, half: half > 0 ? half : 1, least, most, isEmpty };
}

/** Converts a coordinate on one axis to a frame coordinate, limited to -2..2. Without the limit, a
 *  mesh whose size is close to the smallest floating-point numbers could leave this range, because
 *  halving such numbers is inexact. */
export function inFrame(frame, axis, coordinate) {
  return Math.min(Math.max((coordinate - frame.middle[axis]) / frame.half, -2), 2);
}

/** Returns the bounding box of the mesh in frame coordinates, for camera.js. */
export function boxOf(frame) {
  return { least: frame.least.map((coordinate, i) => inFrame(frame, i, coordinate)),
    most: frame.most.map((coordinate, i) => inFrame(frame, i, coordinate)) };
}

/** Returns 4 numbers per vertex: its three frame coordinates, and 1. If a coordinate of the vertex
 *  is not finite, all 4 numbers are 0. */
export function placesOf(frame, points) {
  const count = points.length / 3;
  const places = new Float32Array(4 * count);
  for (let v = 0; v < count; ++v) {
    if (!Number.isFinite(points[3 * v]) || !Number.isFinite(points[3 * v + 1])
        || !Number.isFinite(points[3 * v + 2])) continue;
    for (let i = 0; i < 3; ++i) places[4 * v + i] = inFrame(frame, i, points[3 * v + i]);
    places[4 * v + 3] = 1;
  }
  return places;
}

// cornersOf() returns two numbers per corner of a triangle. The second number contains the index of
// the face in its lower 29 bits. The upper 3 bits mark the sides of the triangle that are edges of
// the polygon. Side i of a triangle leads from its corner i to the next corner.
const EDGE = 29;
export const MOST_FACES = 2 ** EDGE;

/** Returns the corner at which the triangle fan of a polygon begins: the corner with the smallest
 *  x, then y, then z. This choice makes the picture independent of the order of the corners. */
function fanCorner(points, connectivity, from, end) {
  let best = from;
  for (let i = from + 1; i < end; ++i) {
    for (let axis = 0; axis < 3; ++axis) {
      const difference = points[3 * connectivity[i] + axis] - points[3 * connectivity[best] + axis];
      if (difference < 0) best = i;
      if (difference !== 0) break;
    }
  }
  return best;
}

/** Finds the edges inside of sides of cells of higher order. Such a side consists of several faces
 *  with the same cell and side, which follow each other. Returns a Uint8Array with a number for each
 *  corner of `connectivity`: 1 if the edge from it to the next corner is inside of a side. Returns
 *  null if no edge is. */
export function innerEdges({ connectivity, offsets, faceCount, cellNumbers, sides }) {
  let inner = null;
  if (!cellNumbers || !sides) return inner; // vertices are shown instead of faces
  const begin = (f) => Number(offsets[f]);
  const isSame = (a, b) => cellNumbers[a] === cellNumbers[b] && sides[a] === sides[b];
  for (let first = 0, end = 0; first < faceCount; first = end) {
    for (end = first + 1; end < faceCount && isSame(first, end);) ++end;
    if (end === first + 1) continue;
    const met = new Map(); // ends of an edge -> corner at which it begins
    for (let f = first; f < end; ++f) {
      for (let i = begin(f); i < begin(f + 1); ++i) {
        const [a, b] = [connectivity[i], connectivity[i + 1 < begin(f + 1) ? i + 1 : begin(f)]];
        const key = a < b ? `${a} ${b}` : `${b} ${a}`;
        if (!met.has(key)) {
          met.set(key, i);
          continue;
        }
        inner ??= new Uint8Array(connectivity.length);
        inner[i] = inner[met.get(key)] = 1;
      }
    }
  }
  return inner;
}

/** Returns lists of triangles, lines and points, with two numbers per corner: the index of its
 *  vertex, and the index of its face combined with the edge bits (see EDGE). A triangle has three
 *  corners, a line has two, a point has one. Faces with a vertex whose coordinates are not finite
 *  are omitted. `offsets` may be a Uint32Array or a BigUint64Array. */
export function cornersOf(surface, places) {
  const { points, connectivity, offsets, faceCount } = surface;
  const inner = innerEdges(surface);
  if (faceCount > MOST_FACES) throw new RangeError(`${faceCount} faces are more than can be drawn`);
  const begin = (f) => Number(offsets[f]);
  const isSomewhere = (f) => {
    for (let i = begin(f); i < begin(f + 1); ++i) {
      if (places[4 * connectivity[i] + 3] === 0) return false;
    }
    return true;
  };
  const counts = { triangles: 0, lines: 0, points: 0 };
  for (let f = 0; f < faceCount; ++f) {
    const corners = begin(f + 1) - begin(f);
    if (corners >= 3) counts.triangles += corners - 2;
    else if (corners === 2) ++counts.lines;
    else if (corners === 1) ++counts.points;
  }
  const drawn = { triangles: new Uint32Array(6 * counts.triangles),
    lines: new Uint32Array(4 * counts.lines), points: new Uint32Array(2 * counts.points),
    faces: 0 };
  const ends = { triangles: 0, lines: 0, points: 0 };
  const put = (kind, corner, face) => {
    drawn[kind][ends[kind]++] = connectivity[corner];
    drawn[kind][ends[kind]++] = face;
  };
  for (let f = 0; f < faceCount; ++f) {
    const [from, end] = [begin(f), begin(f + 1)];
    const corners = end - from;
    if (corners === 0 || !isSomewhere(f)) continue;
    ++drawn.faces;
    if (corners === 1) {
      put("points", from, f);
    } else if (corners === 2) {
      put("lines", from, f);
      put("lines", from + 1, f);
    } else {
      const first = fanCorner(points, connectivity, from, end);
      for (let i = 1; i + 1 < corners; ++i) {
        const isEdge = (k) => inner === null || inner[from + ((first - from + k) % corners)] === 0;
        const edges = (i === 1 && isEdge(0) ? 1 : 0) | (isEdge(i) ? 2 : 0)
          | (i + 2 === corners && isEdge(i + 1) ? 4 : 0);
        const face = (f | (edges << EDGE)) >>> 0;
        put("triangles", first, face);
        put("triangles", from + ((first - from + i) % corners), face);
        put("triangles", from + ((first - from + i + 1) % corners), face);
      }
    }
  }
  for (const kind of Object.keys(ends)) drawn[kind] = drawn[kind].subarray(0, ends[kind]);
  return drawn;
}

/** Returns the length of a vector without overflow or underflow. */
function lengthOf(values, from, components) {
  let most = 0;
  for (let c = 0; c < components; ++c) {
    const part = Math.abs(Number(values[from + c]));
    if (!Number.isFinite(part)) return NaN;
    if (part > most) most = part;
  }
  if (most === 0) return 0;
  let sum = 0;
  for (let c = 0; c < components; ++c) sum += (Number(values[from + c]) / most) ** 2;
  return most * Math.sqrt(sum);
}

/** Returns one number for each element of an array: the component with the index `component`, or
 *  the length of the vector if `component` is null. */
export function numbersOf(values, components, component) {
  const count = Math.floor(values.length / components);
  const numbers = new Float64Array(count);
  for (let i = 0; i < count; ++i) {
    if (components === 1) numbers[i] = Number(values[i]);
    else if (component !== null) numbers[i] = Number(values[i * components + component]);
    else numbers[i] = lengthOf(values, i * components, components);
  }
  return numbers;
}

/** Combines the parts of a cell array: arrays that have the same name and cover different blocks.
 *  Returns one number per face. `blocks` contains the block index of each face. The member `blocks`
 *  of a part is null if the part covers all blocks. */
export function joined(parts, blocks) {
  const numbers = new Float64Array(blocks.length).fill(NaN);
  for (const part of [...parts].reverse()) {
    const covered = part.blocks === null ? null : new Set(part.blocks);
    for (let f = 0; f < blocks.length; ++f) {
      if (covered === null || covered.has(blocks[f])) numbers[f] = part.numbers[f];
    }
  }
  return numbers;
}

/** Returns {least, greatest}, the range of all finite numbers, or null if no number is finite. */
export function rangeOf(numbers) {
  let least = Infinity;
  let greatest = -Infinity;
  for (const number of numbers) {
    if (!Number.isFinite(number)) continue;
    if (number < least) least = number;
    if (number > greatest) greatest = number;
  }
  return least <= greatest ? { least, greatest } : null;
}

/** Scales a number of the range to 0..1: the least number becomes 0, the greatest number becomes 1.
 *  If both are equal, the result is 0.5. Returns NaN for numbers that are not finite. */
export function shareOf(number, range) {
  if (range === null || !Number.isFinite(number)) return NaN;
  const whole = range.greatest - range.least;
  if (Number.isFinite(whole)) return whole === 0 ? 0.5 : (number - range.least) / whole;
  return (number / 2 - range.least / 2) / (range.greatest / 2 - range.least / 2);
}

/** Scales all numbers to 0..1 for the graphics card. Numbers that are not finite become -1, because
 *  some cards do not support NaN. */
export function sharesOf(numbers, range) {
  const shares = new Float32Array(numbers.length);
  for (let i = 0; i < numbers.length; ++i) {
    const share = shareOf(numbers[i], range);
    shares[i] = Number.isNaN(share) ? -1 : Math.min(Math.max(share, 0), 1);
  }
  return shares;
}

/** Returns the direction from which a flat mesh is seen from the front, or null if the mesh is not
 *  flat. */
export function viewOfPlane(frame) {
  const sides = frame.most.map((to, i) => to / 2 - frame.least[i] / 2);
  const flat = sides.findIndex((side) => side <= 1e-6 * frame.half);
  if (frame.isEmpty || flat < 0) return null;
  return [[1, 0, 0], [0, -1, 0], [0, 0, 1]][sides[2] <= 1e-6 * frame.half ? 2 : flat];
}
