// The entry point of the package: opens and reads .shm files, in a worker if the platform has
// workers. shmformat.d.ts documents the functions.
import { Engine } from "./engine.js";
import { ShmError } from "./errors.js";
import { Remote } from "./remote.js";

export { ShmError };

let compiled;

/** Returns the compiled decoder. `wasm` is the location or the contents of shmformat.wasm. If
 *  `wasm` is undefined, the file next to this module is compiled when it is first needed. */
function moduleOf(wasm) {
  if (wasm instanceof WebAssembly.Module) return wasm;
  if (wasm instanceof ArrayBuffer || ArrayBuffer.isView(wasm)) return WebAssembly.compile(wasm);
  if (wasm !== undefined) return compiledFrom(urlOf(wasm));
  if (compiled === undefined) {
    compiled = compiledFrom(new URL("./shmformat.wasm", import.meta.url));
    compiled.catch(() => { compiled = undefined; });
  }
  return compiled;
}

async function compiledFrom(url) {
  if (url.protocol === "file:") {
    const { readFile } = await import("node:fs/promises");
    return WebAssembly.compile(await readFile(url));
  }
  const answer = await fetch(url);
  if (!answer.ok) throw new ShmError("io", `${url}: the server answers ${answer.status}`);
  // compileStreaming() is not used, because it needs a MIME type that some servers do not send.
  return WebAssembly.compile(await answer.arrayBuffer());
}

function urlOf(source) {
  return source instanceof URL ? source : new URL(source, globalThis.location?.href);
}

/** Converts a source to a value that can be sent to a worker: an absolute URL, or a Blob. */
async function sourceOf(source) {
  if (source instanceof Blob) return source;
  if (source instanceof ArrayBuffer || ArrayBuffer.isView(source)) return new Blob([source]);
  if (typeof source !== "string" && !(source instanceof URL)) {
    throw new TypeError("a file must be an ArrayBuffer, a view of an ArrayBuffer, a Blob or a URL");
  }
  const isPath = globalThis.process?.versions?.node !== undefined && typeof source === "string"
    && !/^[a-z][a-z0-9+.-]+:/i.test(source);
  if (!isPath) return urlOf(source).href;
  const { pathToFileURL } = await import("node:url");
  return pathToFileURL(source).href;
}

/** An open mesh, with its properties and the calls that read it. */
class Mesh {
  #engine;
  constructor(engine, info) {
    this.#engine = engine;
    Object.assign(this, info);
  }

  read({ signal, progress, ...wanted } = {}) {
    return this.#engine.call("read", { points: true, cells: true, ...wanted },
      { signal, progress });
  }
  boundary({ signal, progress, ...wanted } = {}) {
    return this.#engine.call("boundary", wanted, { signal, progress });
  }
  segments(run) {
    return this.#engine.call("segments", undefined, run);
  }
  sets(run) {
    return this.#engine.call("sets", undefined, run);
  }
  extras(run) {
    return this.#engine.call("extras", undefined, run);
  }
  async verify(run) {
    await this.#engine.call("verify", undefined, run);
  }
  close() {
    return this.#engine.end();
  }
}

/** An archive, with the names of its members and a call that opens a member. */
class Archive {
  #open;
  constructor(open, members) {
    this.#open = open;
    this.members = members;
  }

  open(name, { signal } = {}) {
    const member = this.members.indexOf(name);
    if (member < 0) throw new ShmError("misuse", `no member ${name}`);
    const [module, source, options] = this.#open;
    return opened([module, source, { ...options, member }], signal);
  }
}

async function opened(open, signal) {
  const [, , { worker = Remote.canBe() }] = open;
  const engine = worker ? new Remote(...open) : new Engine(...open);
  try {
    const info = await engine.call("describe", undefined, { signal });
    if (info.archive === undefined) return new Mesh(engine, info);
    await engine.end();
    return new Archive(open, info.archive);
  } catch (error) {
    await engine.end();
    throw error;
  }
}

export async function open(source, { signal, wasm, ...options } = {}) {
  signal?.throwIfAborted();
  return opened([await moduleOf(wasm), await sourceOf(source), options], signal);
}
