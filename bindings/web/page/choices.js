// Choices: the options that a mesh offers, and the requests to the package for the options that the
// user chooses.

/** Returns the arrays of field data, which can be shown as colours, as [{label, name, location,
 *  components, steps, parts}]. parts: indices of the arrays in the file. Cell arrays on different
 *  blocks with the same name, components and steps form one entry. */
export function colourings(arrays) {
  const found = new Map();
  for (const array of arrays) {
    if (array.role !== "") continue;
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

/** Returns the index, in `steps`, of the last step that is not later than `step`. */
export function nearStep(steps, step) {
  let place = 0;
  while (place + 1 < steps.length && steps[place + 1] <= step) ++place;
  return place;
}

/**
 * Returns the selection of the cells to show, as the package expects it; undefined: all cells.
 *
 * hidden: a Set of block indices. segment: an element of segments(), or null. clip: {axis, from,
 * sign} or null; shows cells with a vertex at sign * coordinate <= sign * from.
 */
export function selection({ hidden, segment, clip }, blockCount) {
  const select = {};
  if (segment !== null) select.cells = [segment.firstCell, segment.firstCell + segment.cells];
  if (hidden.size > 0) {
    select.blocks = Array.from({ length: blockCount }, (_, i) => i)
      .filter((i) => !hidden.has(i));
  }
  if (clip !== null) {
    // Boxes must be finite; no mesh needs coordinates this large.
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
