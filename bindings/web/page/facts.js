// Builds HTML tables of a file's contents. Text from a file is always inserted as text, never as
// markup.
import { bytesText, countText, nameText, plural, valueText } from "./numbers.js";

// maximum number of rows of a table; if there are more, an extra row contains the number of omitted
// rows
const MOST_ROWS = 500;

/** Returns a new HTML element that contains text or other elements. */
export function element(tag, ...inside) {
  const made = document.createElement(tag);
  made.append(...inside);
  return made;
}

/** Returns an HTML table. heads: the heading of each column. rows: lists with a string or a number
 *  for each column. Columns of numbers are right-aligned. Columns with an empty heading, except the
 *  first column, are also right-aligned. */
function table(caption, heads, rows) {
  const isRight = (i) => (heads[i] === "" ? i > 0 : typeof rows[0]?.[i] === "number");
  const cell = (tag) => (inside, i) => {
    const made = element(tag, typeof inside === "number" ? countText(inside) : inside);
    made.className = isRight(i) ? "number" : heads[i] === "name" ? "name" : "";
    return made;
  };
  const body = rows.slice(0, MOST_ROWS).map((row) => element("tr", ...row.map(cell("td"))));
  if (rows.length > MOST_ROWS) {
    const rest = element("td", `and ${countText(rows.length - MOST_ROWS)} more`);
    rest.colSpan = heads.length;
    body.push(element("tr", rest));
  }
  const head = heads.map((word, i) => {
    const made = cell("th")(word, i);
    made.scope = "col";
    return made;
  });
  return element("table", element("caption", caption), element("thead", element("tr", ...head)),
    element("tbody", ...body));
}

function stepsText(array, times) {
  if (array.steps === null) return "";
  const count = countText(array.steps.length);
  return array.steps.length === times.length ? count : `${count} of ${countText(times.length)}`;
}

/** Returns tables with the properties, the blocks and the arrays of a mesh. */
export function factsOf(mesh) {
  const rows = [["vertices", mesh.vertexCount], ["cells", mesh.cellCount],
    ["of which hexahedra", mesh.hexahedronCount], ["bytes", mesh.fileBytes],
    ["segments", mesh.segmentCount], ["coordinates", mesh.coordinateError > 0
      ? `${mesh.coordinateType}, within ${valueText(mesh.coordinateError)}`
      : `${mesh.coordinateType}, lossless`], ["order", mesh.order]];
  if (mesh.sourceFormat !== "") rows.push(["from", nameText(mesh.sourceFormat)]);
  if (mesh.cellCount > 0) {
    rows.push(["bytes per cell", valueText(mesh.fileBytes / mesh.cellCount)]);
  }
  if (mesh.times.length > 0) {
    rows.push(["time steps", mesh.times.length], ["times",
      `${valueText(mesh.times[0])} to ${valueText(mesh.times[mesh.times.length - 1])}`]);
  }
  const parts = [table("The mesh", ["", ""], rows),
    table("Blocks", ["id", "name", "shape", "cells"], mesh.blocks.map((block) =>
      [String(block.id), nameText(block.name), block.shape, block.cells]))];
  if (mesh.arrays.length > 0) {
    parts.push(table("Arrays", ["name", "of", "type", "steps"], mesh.arrays.map((array) => [
      nameText(array.role === "" ? array.name : `${array.name} (${array.role})`), array.location,
      (array.components === 1 ? array.type : `${array.components} ${array.type}`)
        + (array.error > 0 ? `, within ${valueText(array.error)}` : ""),
      stepsText(array, mesh.times)])));
  }
  return parts;
}

/** Returns a table of the sets of a mesh, as sets() in shmformat.d.ts returns them, or a sentence
 *  if there are none. */
export function setsOf(sets) {
  if (sets.length === 0) return [element("p", "No sets.")];
  return [table(plural(sets.length, "set", "sets"), ["kind", "id", "name", "members"],
    sets.map(({ kind, id, name, numbers }) => [kind, String(id), nameText(name), numbers.length]))];
}

/** Returns a table of the segments of a mesh, as segments() in shmformat.d.ts returns them. */
export function segmentsOf(segments) {
  return [table(plural(segments.length, "segment", "segments"), ["", "cells", "vertices", "bytes"],
    segments.map(({ cells, vertices, bytes }, i) =>
      [String(i), cells, vertices, bytesText(bytes)]))];
}
