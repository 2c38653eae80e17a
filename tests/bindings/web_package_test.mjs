// Tests the JavaScript code of the web package that calls the decoder: workers, Blobs, servers,
// aborted calls.
//
//     node web_package_test.mjs PACKAGE MESH GOLDEN
//
// MESH: a .shm file of a bar of 40000 hexahedra with the arrays "pressure" (points, 3 steps) and
// "heat" (cells), much larger than one request. GOLDEN: the folder of golden files. web_test.py
// creates the mesh and runs this script.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import test, { after, before } from "node:test";
import { pathToFileURL } from "node:url";

const [folder, mesh, golden] = process.argv.slice(2);
const { open, ShmError } = await import(pathToFileURL(`${folder}/shmformat.js`));
const { Engine } = await import(pathToFileURL(`${folder}/engine.js`));
const content = readFileSync(mesh);
const files = { "/mesh.shm": content, "/foreign": Buffer.alloc(1 << 20, "solid cube\n") };
const CELLS = 40000;

/** Serves ranges of files, and counts requests and bytes. `mode` selects how the server misbehaves. */
const server = createServer((request, response) => {
  const asked = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? "");
  counted.requests += 1;
  const { mode } = counted;
  const content = files[request.url];
  const headers = { ETag: counted.version };
  if (request.method === "HEAD") {
    response.writeHead(200, { ...headers, "Content-Length": content.length }).end();
    return;
  }
  if (content === undefined) {
    response.writeHead(request.url === "/secret" ? 403 : 404).end("none");
    return;
  }
  if (mode === "no ranges" || asked === null) {
    response.writeHead(200, { "Content-Length": content.length }).end(content);
    return;
  }
  const [first, last] = [Number(asked[1]), Math.min(Number(asked[2]), content.length - 1)];
  let body = content.subarray(first, last + 1);
  counted.bytes += body.length;
  if (mode === "longer") body = Buffer.concat([body, Buffer.alloc(1 << 20)]);
  if (mode === "half" && first > 0) {
    response.writeHead(206, { ...headers, "Content-Length": body.length });
    response.write(body.subarray(0, 10));
    setTimeout(() => response.destroy(), 5);
    return;
  }
  const at = mode === "others" && first > 0 ? first + 1 : first;
  if (mode !== "hides") headers["Content-Range"] = `bytes ${at}-${last}/${content.length}`;
  response.writeHead(206, headers);
  if (mode === "waits" && first > 0) return;
  response.end(body);
});
const counted = { requests: 0, bytes: 0, mode: "", version: '"1"' };
let url;

function begin(mode = "") {
  Object.assign(counted, { requests: 0, bytes: 0, mode, version: '"1"' });
}

before(async () => {
  await new Promise((done) => { server.listen(0, "127.0.0.1", done); });
  url = `http://127.0.0.1:${server.address().port}/mesh.shm`;
});
after(() => {
  server.closeAllConnections?.();
  server.close();
});

/** Defines a test that runs twice: with a worker and without a worker. */
function both(name, run) {
  for (const worker of [true, false]) {
    test(`${name}, ${worker ? "in a worker" : "in this thread"}`, { timeout: 60000 },
      () => run({ worker }));
  }
}
const failsWith = (status, words) => (error) => {
  assert.ok(error instanceof ShmError, `${error}`);
  assert.equal(error.status, status);
  assert.match(error.message, words);
  return true;
};

both("an open file has its description", async (options) => {
  const file = await open(content, options);
  assert.equal(file.cellCount, CELLS);
  assert.equal(file.vertexCount, 4 * CELLS + 4);
  assert.deepEqual(file.times, [.5, 1, 2]);
  assert.deepEqual(file.arrays.map(({ name, location, steps }) => [name, location, steps]),
    [["pressure", "point", [0, 1, 2]], ["heat", "cell", null]]);
  assert.deepEqual(file.blocks.map(({ shape, cells }) => [shape, cells]), [["hexahedron", CELLS]]);
  await file.close();
  await assert.rejects(file.read(), failsWith("misuse", /the file is closed/));
});

both("all data is read in one pass, and progress is reported", async (options) => {
  const file = await open(new Blob([content]), options);
  const told = [];
  const got = await file.read({ arrays: [{ name: "pressure", step: 1 }, { name: "heat" }],
    progress: (done) => told.push(done) });
  assert.ok(got.points instanceof Float64Array);
  assert.equal(got.points.length, 3 * (4 * CELLS + 4));
  assert.ok(got.cells.connectivity instanceof Uint32Array);
  assert.deepEqual([...got.cells.connectivity.subarray(-8)],
    [0, 1, 2, 3, 4, 5, 6, 7].map((i) => 4 * (CELLS - 1) + i));
  assert.deepEqual(got.arrays.map(({ name, step, values }) => [name, step, values.length]),
    [["pressure", 1, 4 * CELLS + 4], ["heat", null, CELLS]]);
  assert.ok(got.arrays[0].values.every((value) => value >= 0 && value < 1));
  assert.equal(told.at(-1), 1);
  assert.ok(told.length > 3 && told.every((done, i) => i === 0 || done >= told[i - 1]));
  await file.close();
});

both("a piece has its own numbers", async (options) => {
  const file = await open(content, options);
  const all = await file.read({ points: "float32", cells: false });
  assert.ok(all.points instanceof Float32Array);
  const got = await file.read({ select: { cells: [100, 110] }, numbers: true, points: "float32" });
  assert.equal(got.cellCount, 10);
  assert.deepEqual([...got.cellNumbers], Array.from({ length: 10 }, (_, i) => 100 + i));
  assert.deepEqual([...got.vertexNumbers], Array.from({ length: 44 }, (_, i) => 400 + i));
  assert.deepEqual(got.points, all.points.slice(1200, 1200 + 132));
  const boxed = await file.read({ points: false, select: { box: [50.5, -1, -1, 51.5, 2, 2] } });
  assert.equal(boxed.cellCount, 2);
  const none = await file.read({ select: { cells: [0, 0] } });
  assert.equal(none.cellCount, 0);
  const some = await file.read({ points: false, select: { numbers: [7, 3, 7] } });
  assert.equal(some.cellCount, 2);
  await file.close();
});

both("the boundary surface", async (options) => {
  const file = await open(content, options);
  const arrays = [{ name: "pressure", step: 2 }, { name: "heat" }];
  const got = await file.boundary({ arrays });
  assert.equal(got.faceCount, 4 * CELLS + 2); // boundary of a bar
  assert.equal(got.vertexCount, file.vertexCount);
  assert.equal(got.offsets.at(-1), 4 * got.faceCount);
  assert.equal(got.arrays[0].values.length, got.vertexCount);
  assert.equal(got.arrays[1].values.length, got.faceCount);
  const all = await file.read({ cells: false, arrays: [arrays[1]] });
  assert.ok(got.cellNumbers.every((cell, face) =>
    all.arrays[0].values[cell] === got.arrays[1].values[face]));
  const piece = await file.boundary({ select: { cells: [10, 13] } });
  assert.equal(piece.faceCount, 4 * 3 + 2);
  await assert.rejects(file.boundary({ maxBytes: 1000 }), failsWith("over limit", /./));
  await assert.rejects(file.boundary({ arrays: [{ name: "pressure" }] }), failsWith("misuse", /choose one with step/));
  await file.close();
});

both("only the requested data of a URL is fetched, with few requests", async (options) => {
  begin();
  const file = await open(url, options);
  assert.ok(counted.requests <= 2, `${counted.requests} requests`);
  assert.ok(counted.bytes <= 24 << 10, `${counted.bytes} bytes`);
  const far = await file.read({ points: false, cells: false, arrays: [{ name: "pressure", step: 2 }] });
  // Half of the file consists of step values. Step 2 is coded relative to step 1, and step 1
  // relative to step 0.
  assert.ok(counted.bytes < .51 * content.length, `${counted.bytes} of ${content.length} bytes`);
  assert.ok(counted.requests <= 4, `${counted.requests} requests`);
  await file.close();
  const near = await open(content, options);
  const own = await near.read({ points: false, cells: false, arrays: [{ name: "pressure", step: 2 }] });
  assert.deepEqual(far, own);
  assert.deepEqual(await near.segments(), await near.segments());
  await near.close();
});

both("everything of a URL", async (options) => {
  begin();
  const file = await open(new URL(url), options);
  const far = await file.read({ arrays: [{ name: "heat" }] });
  const { requests } = counted;
  assert.ok(requests <= 6, `${requests} requests`);
  assert.ok(counted.bytes < 1.01 * content.length, `${counted.bytes} bytes`);
  await file.read({ arrays: [{ name: "heat" }] });
  assert.equal(counted.requests, requests); // the array was kept
  await file.verify();
  await file.close();
  const near = await open(mesh, options);
  assert.deepEqual(far, await near.read({ arrays: [{ name: "heat" }] }));
  await near.close();
});

both("if a server does not support range requests, the whole file is fetched", async (options) => {
  begin("no ranges");
  const file = await open(url, options);
  assert.equal((await file.read()).cellCount, CELLS);
  assert.equal(counted.requests, 1);
  await file.close();
});

both("a file of another format on a server is recognized by its first bytes", async (options) => {
  for (const mode of ["", "no ranges"]) {
    begin(mode);
    const foreign = url.replace("mesh.shm", "foreign");
    await assert.rejects(open(foreign, options),
      failsWith("corrupt", /foreign: this is not a .shm file$/));
    assert.equal(counted.requests, 1);
    await assert.rejects(open(foreign, { ...options, damaged: true }), ShmError);
    assert.ok(counted.requests > 1);
  }
});

both("if the answer to a range request lacks the file size, the package asks for it", async (options) => {
  begin("hides");
  const file = await open(url, options);
  assert.equal((await file.read()).cellCount, CELLS);
  await file.close();
});

both("errors of servers are reported", async (options) => {
  begin("longer");
  await assert.rejects(open(url, options), failsWith("io", /did not return the requested bytes/));
  begin("others");
  await assert.rejects(open(url, options), failsWith("io", /did not return the requested bytes/));
  begin("half");
  await assert.rejects(open(url, options), failsWith("io", /mesh\.shm: the connection failed/));
  begin();
  const file = await open(url, options);
  counted.version = '"2"';
  await assert.rejects(file.read(), failsWith("io", /the file on the server has changed/));
  begin();
  assert.equal((await file.read()).cellCount, CELLS); // the error does not persist
  await file.close();
  await assert.rejects(open(`${url}x`, options), failsWith("io", /no such file: the server answers 404$/));
  await assert.rejects(open(url.replace("mesh.shm", "secret"), options),
    failsWith("io", /refuses access: it answers 403$/));
  await assert.rejects(open("http://127.0.0.1:9/x.shm", options), failsWith("io", /failed/));
});

both("errors contain the message of the library and the position in the file", async (options) => {
  const hurt = new Uint8Array(content);
  hurt[content.length / 2 | 0] ^= 1;
  const file = await open(hurt, options);
  await assert.rejects(file.verify(), (error) => {
    failsWith("corrupt", /checksum/)(error);
    assert.ok(error.offset > 0 && error.section !== "" && error.detail !== "");
    return true;
  });
  const whole = await file.read({ points: false, cells: false, select: { cells: [0, 1] },
    arrays: [] });
  assert.equal(whole.cellCount, 1);
  await assert.rejects(file.read({ arrays: [{ name: "none" }] }), failsWith("misuse", /no array none/));
  await assert.rejects(file.read({ arrays: [{ name: "pressure" }] }), failsWith("misuse", /choose one with step/));
  await assert.rejects(file.read({ arrays: [{ name: "pressure", step: 9 }] }),
    failsWith("misuse", /no values at step 9/));
  await file.close();
  const damaged = await open(hurt, { ...options, damaged: true });
  assert.ok((await damaged.read()).cellCount > 0);
  await damaged.close();
  await assert.rejects(open(new Uint8Array(100), options), failsWith("truncated", /does not end with an end record/));
  await assert.rejects(open(new Uint8Array(0), options), failsWith("truncated", /./));
  await assert.rejects(open(`${mesh}.none`, options), failsWith("io", /cannot be opened/));
  await assert.rejects(open(7, options), TypeError);
  const limits = { maxArrays: 1 };
  await assert.rejects(open(content, { ...options, limits }), failsWith("over limit", /./));
});

both("members of an archive", async (options) => {
  const archive = await open(`${golden}/0.10/archive.shm`, options);
  assert.ok(archive.members.length > 1);
  for (const name of archive.members) {
    const member = await archive.open(name);
    const got = await member.read();
    assert.equal(got.vertexCount, member.vertexCount);
    await member.close();
  }
  assert.throws(() => archive.open("none"), failsWith("misuse", /no member none/));
});

both("sets and extras", async (options) => {
  const file = await open(`${golden}/0.10/steps_and_extras.shm`, options);
  const extras = await file.extras();
  assert.ok(extras.length > 0);
  for (const { shape, values } of extras) {
    assert.equal(shape.reduce((product, length) => product * length, 1), values.length);
  }
  assert.ok(Array.isArray(await file.sets()));
  await file.close();
});

test("a call can be aborted while it waits for a server", async () => {
  for (const worker of [true, false]) {
    begin();
    const file = await open(url, { worker });
    begin("waits");
    const signal = AbortSignal.timeout(50);
    await assert.rejects(file.read({ signal }), { name: "TimeoutError" });
    begin();
    assert.equal((await file.read()).cellCount, CELLS);
    const over = AbortSignal.abort();
    await assert.rejects(file.read({ signal: over }), { name: "AbortError" });
    await assert.rejects(open(url, { signal: over }), { name: "AbortError" });
    await file.close();
  }
});

test("a call that is aborted while it decodes does not affect other calls", async () => {
  const file = await open(content);
  const controller = new AbortController();
  const first = file.read({ signal: controller.signal, progress: () => controller.abort() });
  const second = file.read({ points: false });
  await assert.rejects(first, { name: "AbortError" });
  assert.equal((await second).cellCount, CELLS);
  const waiting = new AbortController();
  const third = file.read();
  const fourth = file.read({ signal: waiting.signal });
  waiting.abort();
  await assert.rejects(fourth, { name: "AbortError" });
  assert.equal((await third).cellCount, CELLS);
  await file.close();
});

test("the package uses workers in browsers, and works in pages that forbid workers", async () => {
  const { Worker } = await import("node:worker_threads");
  let made = 0;
  globalThis.Worker = class {
    constructor(where, { type }) {
      assert.equal(type, "module");
      made += 1;
      this.worker = new Worker(where);
      this.worker.on("message", (data) => this.onmessage({ data }));
    }
    postMessage(message) {
      this.worker.postMessage(message);
    }
    terminate() {
      this.worker.terminate();
    }
  };
  try {
    const file = await open(content);
    assert.equal((await file.read()).cellCount, CELLS);
    await file.close();
    assert.equal(made, 1);
    globalThis.Worker = class {
      constructor() {
        throw new Error("not allowed here");
      }
    };
    await assert.rejects(open(content), failsWith("io", /cannot be started: not allowed here/));
    globalThis.Worker = class {
      postMessage() {
        setTimeout(() => this.onerror({ message: "no such script" }), 1);
      }
      terminate() {}
    };
    await assert.rejects(open(content), failsWith("io", /the worker failed: no such script/));
  } finally {
    delete globalThis.Worker;
  }
});

test("closing a file ends its running calls", async () => {
  const file = await open(content);
  const reading = file.read();
  const done = assert.rejects(reading, failsWith("misuse", /the file was closed/));
  await file.close();
  await done;
});

both("several calls at once", async (options) => {
  const file = await open(url, options);
  const all = await Promise.all([0, 1, 2].map((step) =>
    file.read({ points: false, cells: false, arrays: [{ name: "pressure", step }] })));
  assert.deepEqual(all.map(({ arrays }) => arrays[0].step), [0, 1, 2]);
  assert.notDeepEqual(all[0].arrays[0].values, all[1].arrays[0].values);
  await file.close();
});

test("running out of memory is an error, and the next call uses a new decoder", async () => {
  const wasm = await WebAssembly.compile(readFileSync(`${folder}/shmformat.wasm`));
  const engine = new Engine(wasm, new Blob([content]), {});
  for (const left of [0, 1 << 16, 1 << 20, 16 << 20]) {
    await engine.call("describe");
    const instance = engine.wasm;
    const room = instance.malloc(Math.max(left, 1));
    for (let bytes = 1 << 30; bytes >= 16;) if (instance.malloc(bytes) === 0) bytes >>= 1;
    if (left > 0) instance.free(room);
    await assert.rejects(engine.call("read", { points: true, cells: true, arrays: [{ name: "heat" }] }),
      failsWith("no memory", /^out of memory/));
    const got = await engine.call("read", { points: true, select: { cells: [0, 5] } });
    assert.equal(got.cellCount, 5);
    assert.notEqual(engine.wasm, instance);
  }
  await engine.end();
});
