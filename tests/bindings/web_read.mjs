// Reads files with the web package, and prints the data as lines. web_meshes.py creates the same
// lines with the native library.
//
//     node web_read.mjs PACKAGE < REQUESTS
//
// PACKAGE: the folder of the package. Each input line is {"path", "flips", "cut", "bare"}: the
// file, a list [[byte, bit]] of bits to flip, the number of bytes to keep (null: all), and whether
// only to measure the time of reading. Each output line is {"lines": [[subject, value]], "seconds":
// CPU time of the calls}.
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";

const { open, ShmError } = await import(pathToFileURL(`${process.argv[2]}/shmformat.js`));

const TYPES = { Int8Array: "int8", Uint8Array: "uint8", Int16Array: "int16", Uint16Array: "uint16",
  Int32Array: "int32", Uint32Array: "uint32", BigInt64Array: "int64", BigUint64Array: "uint64",
  Float32Array: "float32", Float64Array: "float64" };

function hashed(values) {
  const bytes = new Uint8Array(values.buffer, values.byteOffset, values.byteLength);
  return `${TYPES[values.constructor.name]} ${values.length} `
    + createHash("sha256").update(bytes).digest("hex");
}
const doubles = (...numbers) => hashed(Float64Array.from(numbers));
const wide = (numbers) => hashed(BigUint64Array.from(numbers, BigInt));

let lines;
let seconds;

/** Runs a call. Adds the lines of its result, or a line with its error. */
async function attempt(what, call, put) {
  const before = process.cpuUsage();
  let result;
  try {
    result = await call();
  } catch (error) {
    if (!(error instanceof ShmError)) throw error;
    lines.push([what, `! ${error.status}: ${error.message}`]);
    return undefined;
  } finally {
    const { user, system } = process.cpuUsage(before);
    seconds += (user + system) / 1e6;
  }
  put?.(result);
  return result;
}

function describe(mesh) {
  lines.push(["mesh", [mesh.vertexCount, mesh.cellCount, mesh.hexahedronCount, mesh.stepCount,
    mesh.fileBytes, mesh.segmentCount, mesh.coordinateType, mesh.order, mesh.sourceFormat,
    doubles(mesh.coordinateError), String(mesh.digest)].join(" ")]);
  for (const { id, name, shape, nodesPerCell, cells } of mesh.blocks) {
    lines.push(["block", `${id} ${shape} ${nodesPerCell} ${cells} ${name}`]);
  }
  for (const { name, role, location, type, components, elements, blocks, error, steps }
    of mesh.arrays) {
    lines.push(["array", [location, type, components, elements, blocks ?? "all", doubles(error),
      steps ?? "none", role, name].join(" ")]);
  }
  lines.push(["times", doubles(...mesh.times)]);
}

function put(prefix, got) {
  lines.push([`${prefix} counts`, `${got.vertexCount} ${got.cellCount}`]);
  if (got.points) lines.push([`${prefix} points`, hashed(got.points)]);
  if (got.cells) {
    lines.push([`${prefix} connectivity`, wide(got.cells.connectivity)]);
    lines.push([`${prefix} offsets`, wide(got.cells.offsets)]);
    lines.push([`${prefix} types`, hashed(got.cells.types)]);
    lines.push([`${prefix} blocks`, hashed(got.cells.blocks)]);
  }
  if (got.vertexNumbers) {
    lines.push([`${prefix} vertex numbers`, wide(got.vertexNumbers)]);
    lines.push([`${prefix} cell numbers`, wide(got.cellNumbers)]);
  }
  for (const { name, location, step, values } of got.arrays) {
    lines.push([`${prefix} ${location} ${name} ${step ?? "static"}`, hashed(values)]);
  }
}

async function readMesh(mesh, bare) {
  const still = mesh.arrays.filter(({ steps }) => steps === null);
  await attempt("read", () => mesh.read({ arrays: still }), bare ? undefined : (got) => put("all", got));
  for (const array of mesh.arrays) {
    for (const step of array.steps ?? []) {
      const wanted = { points: false, cells: false, arrays: [{ ...array, step }] };
      await attempt("step", () => mesh.read(wanted), bare ? undefined : (got) => put("step", got));
    }
  }
  if (bare) return;
  const first = Math.floor(mesh.cellCount / 3);
  const piece = { cells: [first, Math.min(first + 20, mesh.cellCount)] };
  await attempt("piece", () => mesh.read({ arrays: still, select: piece, numbers: true }),
    (got) => put("piece", got));
  await attempt("boundary", () => mesh.boundary({ arrays: still }), (got) => {
    lines.push(["boundary", [got.vertexCount, got.faceCount, got.leftOut, hashed(got.points),
      wide(got.connectivity), wide(got.offsets), wide(got.vertexNumbers), wide(got.cellNumbers),
      hashed(got.blocks), hashed(got.sides), ...got.arrays.map(({ values }) => hashed(values))]
      .join(" ")]);
  });
  await attempt("segments", () => mesh.segments(), (segments) => {
    for (const { firstCell, cells, firstVertex, vertices, bytes, box } of segments) {
      lines.push(["segment",
        `${firstCell} ${cells} ${firstVertex} ${vertices} ${bytes} ${doubles(...box)}`]);
    }
  });
  await attempt("sets", () => mesh.sets(), (sets) => {
    for (const { kind, id, name, numbers, sides, blocks, factors } of sets) {
      const some = (values) => (values === null ? "none" : hashed(values));
      lines.push(["set", [kind, id, wide(numbers), some(sides), some(blocks), some(factors), name]
        .join(" ")]);
    }
  });
  await attempt("extras", () => mesh.extras(), (extras) => {
    for (const { key, refers, shape, values } of extras) {
      lines.push(["extra", `${key} ${refers} ${shape} ${hashed(values)}`]);
    }
  });
  await attempt("verify", () => mesh.verify(), () => lines.push(["verify", "good"]));
}

async function readBytes(bytes, bare) {
  const options = { worker: false };
  const file = await attempt("open", () => open(bytes, options));
  if (file === undefined) return;
  if (file.members === undefined) {
    if (!bare) describe(file);
    await readMesh(file, bare);
    await file.close();
    return;
  }
  for (const member of file.members) {
    lines.push(["member", member]);
    const mesh = await attempt("open", () => file.open(member));
    if (mesh === undefined) continue;
    if (!bare) describe(mesh);
    await readMesh(mesh, bare);
    await mesh.close();
  }
}

for await (const line of createInterface({ input: process.stdin })) {
  const { path, flips, cut, bare } = JSON.parse(line);
  const bytes = readFileSync(path);
  for (const [byte, bit] of flips ?? []) bytes[byte] ^= 1 << bit;
  lines = [];
  seconds = 0;
  await readBytes(bytes.subarray(0, cut ?? bytes.length), bare ?? false);
  process.stdout.write(`${JSON.stringify({ lines, seconds })}\n`);
}
