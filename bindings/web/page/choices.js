// Choices: lists the options that a mesh offers to the user, and converts the user's choices to
// arguments of calls to the npm package.

/** Returns the arrays that can be shown as colours (arrays with field data), as a list of {name,
 *  location, components, steps, parts}. `parts` contains indices of arrays in the file: cell arrays
 *  on different blocks form one entry if they have the same name, number of components and
 *  steps. */
export function colourings(arrays) {
  const found = new Map();
  for (const array of arrays) {
    if (array.role !== "" || !["point", "cell"].includes(array.location)) continue;
    const key = array.location === "cell" && array.blocks !== null
      ? JSON.stringify([array.name, array.components, array.steps]) : `one ${array.index}`;
    const known = found.get(key);
    if (known === undefined) {
      const { name, location, components, steps } = array;
      found.set(key, { name, location, components, steps, parts: [array.index] });
    } else {
      known.parts.push(array.index);
    }
  }
  return [...found.values()];
}

/** Returns the index, in the ascending list `steps`, of the latest step that is not after `step`; 0
 *  if there is none. */
export function nearStep(steps, step) {
  let place = 0;
  while (place + 1 < steps.length && steps[place + 1] <= step) ++place;
  return place;
}

/**
 * Returns the cells to show as a Selection (see shmformat.d.ts), or undefined for all cells.
 *
 * hidden: a Set of the indices of hidden blocks. segment: an element of segments(), or null. clip:
 * null, or {axis, from, sign}; only cells with a vertex at sign * coordinate <= sign * from are
 * shown.
 */
export function selection({ hidden, segment, clip }, blockCount) {
  const select = {};
  if (segment !== null) select.cells = [segment.firstCell, segment.firstCell + segment.cells];
  if (hidden.size > 0) {
    select.blocks = Array.from({ length: blockCount }, (_, i) => i)
      .filter((i) => !hidden.has(i));
  }
  if (clip !== null) {
    // The numbers of a box must be finite. MAX_VALUE replaces infinity.
    const box = [...Array(3).fill(-Number.MAX_VALUE), ...Array(3).fill(Number.MAX_VALUE)];
    box[clip.axis + (clip.sign > 0 ? 3 : 0)] = clip.from;
    select.box = box;
  }
  return Object.keys(select).length === 0 ? undefined : select;
}

/** Returns the parameters in the address of the page: ?url= (address of a file on a server) and
 *  segment= (number of a segment). */
export function wantedOf(search, base) {
  const parameters = new URLSearchParams(search);
  const given = parameters.get("url");
  const digits = parameters.get("segment");
  const segment = digits !== null && /^\d{1,9}$/.test(digits) ? Number(digits) : null;
  if (given === null) return { url: null, segment };
  let url;
  try {
    url = new URL(given, base);
  } catch {
    throw new Error(`${given}: is not a valid address`);
  }
  if (url.protocol !== "http:" && url.protocol !== "https:") {
    throw new Error(`${url.href}: only http and https addresses are fetched`);
  }
  return { url: url.href, segment };
}
