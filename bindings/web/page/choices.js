// Choices: what there is to choose of a mesh, and what is asked of the package for what was chosen.

/** What can be shown by colours: arrays of data; those of cells that share a name, components and
 *  steps, each on blocks of its own, as one. [{label, name, location, components, steps, parts}],
 *  parts: the arrays by index. */
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

/** The place of the step of another array in the steps of this one: the last that is not later. */
export function nearStep(steps, step) {
  let place = 0;
  while (place + 1 < steps.length && steps[place + 1] <= step) ++place;
  return place;
}

/**
 * Which cells are shown, as the package takes it; undefined: all.
 * chosen: hidden, a Set of indices of blocks; segment, one of segments() or null; clip, {axis,
 * from, sign} or null: cells with a vertex where sign * coordinate <= sign * from.
 */
export function selection({ hidden, segment, clip }, blockCount) {
  const select = {};
  if (segment !== null) select.cells = [segment.firstCell, segment.firstCell + segment.cells];
  if (hidden.size > 0) {
    select.blocks = Array.from({ length: blockCount }, (_, i) => i)
      .filter((i) => !hidden.has(i));
  }
  if (clip !== null) {
    // Infinity is no coordinate; the largest number is none that a mesh needs.
    const box = [...Array(3).fill(-Number.MAX_VALUE), ...Array(3).fill(Number.MAX_VALUE)];
    box[clip.axis + (clip.sign > 0 ? 3 : 0)] = clip.from;
    select.box = box;
  }
  return Object.keys(select).length === 0 ? undefined : select;
}

/** What of the address the page goes by: ?url= of a file on a server, segment= of one. */
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
    throw new Error(`${given}: is no address`);
  }
  if (url.protocol !== "http:" && url.protocol !== "https:") {
    throw new Error(`${url.href}: only http and https addresses are fetched`);
  }
  return { url: url.href, segment };
}
