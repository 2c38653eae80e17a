// Tests the modules that compute the page's content before it is drawn: cameras, colours, formatted
// numbers, surfaces, and the choices in its menus.
//
//     node page_modules_test.mjs
//
// Environment variables: SHM_PAGE is the folder with the modules of the page. SHM_COLOURS contains
// the colours of converters/picture as {blocks, values, none}.
import assert from "node:assert/strict";
import { pathToFileURL } from "node:url";
import test from "node:test";

const at = (name) => import(pathToFileURL(`${process.env.SHM_PAGE}/${name}.js`).href);
const camera = await at("camera");
const colours = await at("colours");
const numbers = await at("numbers");
const surface = await at("surface");
const choices = await at("choices");
const pointing = await at("pointing");

const near = (got, wanted, what) => wanted.forEach((number, i) =>
  assert.ok(Math.abs(got[i] - number) < 1e-6, `${what ?? "is"} ${[...got]}, not ${wanted}`));
/** Returns the position in the picture at which the camera shows a point. */
function seen(made, [x, y, z], aspect = 1) {
  const m = camera.matrixOf(made, aspect);
  return [0, 1, 2].map((row) => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);
}

test("a camera looks from the given direction, with the z axis pointing up", () => {
  const front = camera.axesOf(camera.cameraFrom([0, -3, 0]));
  near(front.right, [1, 0, 0]);
  near(front.up, [0, 0, 1]);
  near(front.view, [0, -1, 0]);
  const above = camera.axesOf(camera.cameraFrom([0, 0, 5]));
  near(above.right, [1, 0, 0]);
  near(above.up, [0, 1, 0]);
  const { right, up, view } = camera.axesOf(camera.cameraFrom(camera.USUAL_VIEW));
  near(view, [1, -2, 1].map((part) => part / Math.sqrt(6)));
  near([right, up].map((axis) => axis.reduce((sum, part, i) => sum + part * view[i], 0)), [0, 0]);
});

test("a box fits the picture, whichever side of the picture is larger", () => {
  const box = { least: [-1, -0.5, 0], most: [1, 0.5, 0.25] };
  for (const aspect of [0.4, 1, 2.5]) {
    for (const view of Object.values(camera.SIDES)) {
      const made = camera.fitted(camera.cameraFrom(view), box, aspect);
      let most = 0;
      for (let corner = 0; corner < 8; ++corner) {
        const point = [0, 1, 2].map((i) => (corner >> i & 1 ? box.most : box.least)[i]);
        const place = seen(made, point, aspect);
        assert.ok(Math.abs(place[2]) < 1);
        most = Math.max(most, Math.abs(place[0]), Math.abs(place[1]));
      }
      assert.ok(most > 0.919 && most < 0.921, `${view} at ${aspect}: ${most}`);
    }
  }
  // The mesh does not cover the space reserved at the bottom of the picture.
  const tall = { ...box, most: [1, 0.5, 9] };
  const lifted = camera.fitted(camera.cameraFrom([0, -1, 0]), tall, 2, .25);
  const [low, high] = [0, 9].map((z) => seen(lifted, [0, 0, z], 2)[1]);
  near([low, high], [.25 - .92 * .75, .25 + .92 * .75]);
  const place = seen(lifted, [1, 0, 3], 2);
  near(seen(camera.zoomed(lifted, 2, 2 * place[0], place[1]), [1, 0, 3], 2).slice(0, 2),
    place.slice(0, 2));
  // The camera does not magnify a mesh of size zero infinitely.
  const none = { least: [0, 0, 0], most: [0, 0, 0] };
  const point = camera.fitted(camera.cameraFrom([1, 1, 1]), none, 1);
  assert.ok(Number.isFinite(point.scale));
});

test("a nearer point has a smaller depth", () => {
  const made = camera.cameraFrom([0, -1, 0]);
  assert.ok(seen(made, [0, -1, 0])[2] < seen(made, [0, 1, 0])[2]);
});

test("the mesh follows the pointer when moved, and zooming keeps the point under the pointer fixed", () => {
  const made = camera.turned(camera.zoomed(camera.cameraFrom([1, -2, 1]), 3), 0.3, 0.2);
  const before = seen(made, [0.1, 0.2, 0.3], 2);
  const after = seen(camera.moved(made, 0.25, -0.125), [0.1, 0.2, 0.3], 2);
  near([after[0] - before[0], after[1] - before[1]], [0.25 / 2, -0.125]);
  const fixed = [before[0] * 2, before[1]];
  const enlarged = seen(camera.zoomed(made, 1.7, ...fixed), [0.1, 0.2, 0.3], 2);
  near(enlarged.slice(0, 2), before.slice(0, 2));
  assert.equal(camera.zoomed(made, 1e30).zoom, 1e5);
  assert.equal(camera.turned(made, 0, 100).high, Math.PI / 2);
  assert.ok(camera.moved(made, 1e30, -1e30).target.every((part) => Math.abs(part) <= 10));
});

test("keys rotate, move and enlarge", () => {
  const made = camera.cameraFrom([0, -1, 0]);
  assert.ok(pointing.cameraKey({ key: "ArrowRight" })(made).round < made.round);
  assert.ok(pointing.cameraKey({ key: "ArrowRight", shiftKey: true })(made).target[0] < 0);
  assert.ok(pointing.cameraKey({ key: "+" })(made).zoom > 1);
  assert.equal(pointing.cameraKey({ key: "x" }), null);
  assert.equal(pointing.cameraKey({ key: "constructor" }), null);
});

test("colours are those of shm preview", () => {
  // The page must use the same colours as converters/picture, which has its own tests.
  const told = JSON.parse(process.env.SHM_COLOURS);
  assert.equal(told.blocks.length, 21);
  told.blocks.forEach((colour, i) => assert.deepEqual(colours.blockColour(i), colour));
  assert.deepEqual(colours.blockColour(21), colours.blockColour(0));
  assert.equal(told.values.length, 16);
  told.values.forEach((colour, i) => assert.deepEqual(colours.valueColour(i / 15), colour));
  assert.deepEqual(colours.valueColour(NaN), told.none);
  assert.deepEqual(colours.valueColour(-5), colours.valueColour(0));
  const table = colours.valueTable();
  const light = (i) => [0.2126, 0.7152, 0.0722].reduce((sum, part, c) =>
    sum + part * table[4 * i + c], 0);
  for (let i = 1; i < 256; ++i) assert.ok(light(i) > light(i - 1) - 1.1, `lightness at ${i}`);
});

test("numbers are formatted as by printf with %g", () => {
  const cases = [[0, "0"], [-0, "0"], [1 / 3, "0.333333"], [-1.5e300, "-1.5e+300"],
    [100000, "100000"], [1000000, "1e+06"], [999999.5, "1e+06"], [0.0001, "0.0001"],
    [0.00001234567, "1.23457e-05"], [42, "42"], [1234.5678, "1234.57"], [Infinity, "inf"],
    [NaN, "no number"], [5e-324, "4.94066e-324"]];
  for (const [number, text] of cases) assert.equal(numbers.valueText(number), text);
  assert.equal(numbers.countText(1234567), "1,234,567");
  assert.equal(numbers.countText(12345678901234567890n), "12,345,678,901,234,567,890");
  assert.equal(numbers.plural(1, "cell", "cells"), "1 cell");
  assert.equal(numbers.bytesText(999), "999 bytes");
  assert.equal(numbers.bytesText(1234), "1.23 kB");
  assert.equal(numbers.bytesText(999_600), "1.00 MB");
  assert.equal(numbers.bytesText(45_678_901), "45.7 MB");
});

test("control characters in names are shown as escapes", () => {
  assert.equal(numbers.nameText("a\nb\u202eexe.mhs"), "a\\u000ab\\u202eexe.mhs");
  assert.equal(numbers.nameText("x".repeat(100)).length, 80);
  assert.equal(numbers.nameText("<b>ü"), "<b>ü");
});

const quad = { points: Float64Array.of(0, 0, 0, 4, 0, 0, 4, 2, 0, 0, 2, 0), faceCount: 1,
  connectivity: Uint32Array.of(2, 3, 0, 1), offsets: Uint32Array.of(0, 4) };

test("a polygon is divided into triangles around its first corner", () => {
  const frame = surface.frameOf(quad.points);
  assert.deepEqual([frame.middle, frame.half], [[2, 1, 0], 2]);
  const places = surface.placesOf(frame, quad.points);
  near(places, [-1, -0.5, 0, 1, 1, -0.5, 0, 1, 1, 0.5, 0, 1, -1, 0.5, 0, 1]);
  const { triangles, faces } = surface.cornersOf(quad, places);
  assert.equal(faces, 1);
  assert.deepEqual([...triangles].filter((_, i) => i % 2 === 0), [0, 1, 2, 0, 2, 3]);
  assert.deepEqual([...triangles].filter((_, i) => i % 2 === 1).map((face) => face >>> 29),
    [3, 3, 3, 6, 6, 6]);
  assert.deepEqual(surface.viewOfPlane(frame), [0, 0, 1]);
});

test("edges between faces of the same side are not outlined", () => {
  const points = Float64Array.of(0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 2, 0, 0, 2, 1, 0);
  const faces = { points, faceCount: 2, connectivity: Uint32Array.of(0, 1, 2, 3, 1, 4, 5, 2),
    offsets: Uint32Array.of(0, 4, 8), cellNumbers: Uint32Array.of(7, 7), sides: Uint32Array.of(1, 1) };
  assert.deepEqual([...surface.innerEdges(faces)], [0, 1, 0, 0, 0, 0, 0, 1]);
  assert.equal(surface.innerEdges({ ...faces, sides: Uint32Array.of(1, 2) }), null);
  const places = surface.placesOf(surface.frameOf(points), points);
  const bits = [...surface.cornersOf(faces, places).triangles].filter((_, i) => i % 6 === 1);
  assert.deepEqual(bits.map((face) => face >>> 29), [1, 6, 3, 2]);
});

test("lines and vertices are drawn, and faces with a vertex that is not finite are left out", () => {
  const points = Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0, NaN, 0, 0, 0, 0, Infinity);
  const faces = { points, faceCount: 4, connectivity: Uint32Array.of(0, 1, 3, 0, 1, 2, 4),
    offsets: BigUint64Array.of(0n, 3n, 5n, 6n, 7n) };
  const made = surface.cornersOf(faces, surface.placesOf(surface.frameOf(points), points));
  assert.deepEqual([made.triangles.length, made.lines.length, made.points.length, made.faces],
    [0, 4, 2, 2]);
  assert.deepEqual([...made.lines], [0, 1, 1, 1]);
  assert.ok(surface.frameOf(new Float64Array(0)).isEmpty);
});

test("the largest and the smallest possible coordinates are drawn at finite positions", () => {
  const large = Number.MAX_VALUE;
  const points = Float64Array.of(-large, 0, 0, large, 5e-324, 0);
  const frame = surface.frameOf(points);
  near(surface.placesOf(frame, points), [-1, 0, 0, 1, 1, 0, 0, 1]);
  const tiny = Float64Array.of(0, 0, 0, 5e-324, 0, 0);
  assert.ok(surface.placesOf(surface.frameOf(tiny), tiny).every((part) => Math.abs(part) <= 2));
  const range = surface.rangeOf([-large, NaN, large, Infinity]);
  assert.deepEqual([-large, 0, large].map((number) => surface.shareOf(number, range)), [0, 0.5, 1]);
  const shares = surface.sharesOf([1, NaN, 3, 2], { least: 1, greatest: 3 });
  assert.deepEqual([...shares], [0, -1, 1, 0.5]);
  assert.equal(surface.shareOf(7, { least: 7, greatest: 7 }), 0.5);
  assert.equal(surface.rangeOf([NaN]), null);
});

test("vectors are shown by their length or by a component", () => {
  const values = Float64Array.of(3, 4, 0, 3e300, 4e300, 0, NaN, 1, 1);
  const length = surface.numbersOf(values, 3, null);
  near(length, [5]);
  assert.ok(Math.abs(length[1] / 5e300 - 1) < 1e-12);
  assert.ok(Number.isNaN(length[2]));
  assert.deepEqual([...surface.numbersOf(values, 3, 1)], [4, 4e300, 1]);
  assert.deepEqual([...surface.numbersOf(BigInt64Array.of(-2n, 5n), 1, null)], [-2, 5]);
});

test("arrays of the same name on different blocks are offered as one array", () => {
  const array = (index, name, blocks, more = {}) => ({ index, name, blocks, role: "",
    location: "cell", components: 1, steps: [0, 1], ...more });
  const listed = choices.colourings([array(0, "heat", [0]), array(1, "heat", [2]),
    array(2, "map", null, { role: "exodus:node_num_map" }),
    array(3, "heat", null, { location: "point" }), array(4, "heat", [1], { steps: null })]);
  assert.deepEqual(listed.map(({ parts }) => parts), [[0, 1], [3], [4]]);
  const parts = [{ blocks: [0], numbers: [1, 2, 3] }, { blocks: [2], numbers: [4, 5, 6] }];
  const joined = surface.joined(parts, Uint32Array.of(0, 1, 2));
  assert.deepEqual([...joined], [1, NaN, 6]);
});

test("choices become a selection", () => {
  const none = { hidden: new Set(), segment: null, clip: null };
  assert.equal(choices.selection(none, 3), undefined);
  assert.deepEqual(choices.selection({ ...none, hidden: new Set([1]) }, 3), { blocks: [0, 2] });
  const segment = { firstCell: 5, cells: 7 };
  assert.deepEqual(choices.selection({ ...none, segment }, 3), { cells: [5, 12] });
  const clip = { axis: 1, from: 0.5, sign: 1 };
  const { box } = choices.selection({ ...none, clip }, 3);
  assert.equal(box[4], 0.5);
  assert.ok(box.every(Number.isFinite));
  assert.equal(choices.selection({ ...none, clip: { ...clip, sign: -1 } }, 3).box[1], 0.5);
  assert.equal(choices.nearStep([0, 4, 8], 5), 1);
  assert.equal(choices.nearStep([3], 0), 0);
});

test("only http and https addresses are fetched", () => {
  const base = "https://example.org/pages/shm.html";
  assert.deepEqual(choices.wantedOf("", base), { url: null, segment: null });
  assert.deepEqual(choices.wantedOf("?url=../run.shm&segment=3", base),
    { url: "https://example.org/run.shm", segment: 3 });
  for (const url of ["file:///etc/passwd", "javascript:alert(1)", "data:,x", "blob:null/1"]) {
    const search = `?url=${encodeURIComponent(url)}`;
    assert.throws(() => choices.wantedOf(search, base), /only http and https/);
  }
  assert.throws(() => choices.wantedOf("?url=http%3A%2F%2F", base), /is not a valid address/);
  assert.equal(choices.wantedOf("?url=a&segment=-1", base).segment, null);
});
