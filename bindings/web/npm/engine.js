// Engine: an open file. An Engine calls the functions of shmformat.h in WebAssembly, and reads the
// bytes of the file from a Source. It usually runs in a worker (worker.js).
import { ShmError } from "./errors.js";
import { Source } from "./sources.js";
import { LAYOUTS, readStruct, toNumber, writeStruct } from "./structs.js";

const STATUS = ["ok", "io", "truncated", "corrupt", "unsupported", "over limit", "misuse", "output",
  "no memory", "cancelled"];
const CANCELLED = 9;
const TYPES = [null, Int8Array, Uint8Array, Int16Array, Uint16Array, Int32Array, Uint32Array,
  BigInt64Array, BigUint64Array, Float32Array, Float64Array];
const TYPE_NAMES = ["", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64",
  "float32", "float64"];
const SHAPES = ["other", "vertex", "line", "triangle", "quad", "polygon", "tetrahedron", "pyramid",
  "wedge", "hexahedron", "polyhedron", "faces"];
const LOCATIONS = ["point", "cell", "global", "node_set", "side_set", "element_set"];
const NODE_SCHEMES = ["lagrange", "serendipity", "bezier"];
const ORDERS = ["keep", "stream", "free"];
const SETS = ["node", "side", "element"];
const REFERS = ["nothing", "vertices", "cells"];
const LIMITS = ["max_arrays", "max_static_components", "max_blocks", "max_segments",
  "max_active_vertices", "max_chunk_bytes", "max_group_bytes", "max_extra_bytes", "max_steps",
  "max_unpacked_bytes", "max_column_bytes", "max_vertices", "max_cells", "max_decoded_bytes",
  "max_active_bytes"];

const UINT8 = 2;
const UINT32 = 6;
const UINT64 = 8;
const WHAT = { points: 1, corners: 2, cornerBegin: 3, cellBlocks: 4, cellTypes: 5,
  vertexNumbers: 6, cellNumbers: 7, values: 8 };
const FILL = 1;

const utf8 = new TextDecoder();

/** The WebAssembly memory that one call allocates. It is freed at the end of the call. */
class Scratch {
  constructor(wasm) {
    this.wasm = wasm;
    this.places = [];
  }

  bytes(count) {
    const place = this.wasm.malloc(Math.max(count, 1)) >>> 0;
    if (place === 0 || count >= 2 ** 32) {
      throw new ShmError("no memory", `out of memory: cannot allocate ${count} bytes`);
    }
    this.places.push(place);
    return place;
  }
  struct(name, values, count = 1) {
    const place = this.bytes(LAYOUTS[name].bytes * count);
    for (let i = 0; i < count; ++i) {
      writeStruct(this.wasm.view(), name, place + i * LAYOUTS[name].bytes, values);
    }
    return place;
  }
  array(values) {
    const place = this.bytes(values.byteLength);
    new values.constructor(this.wasm.memory.buffer, place, values.length).set(values);
    return place;
  }
  text(words) {
    return this.array(new TextEncoder().encode(`${words}\0`));
  }
  free() {
    for (const place of this.places) this.wasm.free(place);
  }
}

/** A WebAssembly instance of the decoder. After a trap, the instance cannot be used again. */
class Wasm {
  static async make(module, page) {
    const wasm = new Wasm();
    const instance = await WebAssembly.instantiate(module, { page });
    wasm.exports = instance.exports;
    wasm.memory = wasm.exports.memory;
    wasm.exports._initialize();
    wasm.malloc = wasm.exports.malloc;
    wasm.free = wasm.exports.free;
    return wasm;
  }

  view() {
    return new DataView(this.memory.buffer);
  }
  text(place) {
    const bytes = new Uint8Array(this.memory.buffer);
    return place === 0 ? "" : utf8.decode(bytes.subarray(place, bytes.indexOf(0, place)));
  }
  /** Copies `count` numbers from WebAssembly memory to a new typed array with its own buffer. */
  copied(Type, place, count) {
    return new Type(this.memory.buffer.slice(place, place + count * Type.BYTES_PER_ELEMENT));
  }
  /** Returns a ShmError with the reason for a trap of this instance. */
  lastWords(trap) {
    const words = this.view().getUint32(this.exports.shmf_page_last_words.value, true);
    if (words === 0) return new ShmError("io", `the decoder failed: ${trap.message}`);
    const sentence = this.text(words);
    return new ShmError(sentence === "out of memory" ? "no memory" : "io", sentence);
  }
}

/** Converts numbers to 32-bit integers if all of them fit. Otherwise returns them unchanged. */
function narrowed(numbers) {
  return numbers.every((number) => number < 2n ** 32n) ? Uint32Array.from(numbers, Number) : numbers;
}

/** Returns true if the instance cannot be used after this error, e.g. after a stack overflow. */
function isTrap(error) {
  return error instanceof WebAssembly.RuntimeError || error.name === "InternalError"
    || (error instanceof RangeError && /call stack/.test(error.message));
}

function isSafe(id) {
  return id <= BigInt(Number.MAX_SAFE_INTEGER) && id >= BigInt(Number.MIN_SAFE_INTEGER);
}

export class Engine {
  /**
   * @param {WebAssembly.Module} module
   * @param {string | Blob} source an absolute URL, or a Blob
   * @param {{damaged?: boolean, limits?: object, member?: number}} options
   */
  constructor(module, source, options) {
    this.module = module;
    this.from = source;
    this.options = options;
    this.wasm = null;
    this.file = 0;
    this.knownArrays = null;
    this.last = Promise.resolve();
    this.ended = false;
  }

  /** Runs a call as soon as all earlier calls for this file have ended. `name` is a key of CALLS;
   *  `run` is {signal, progress}. */
  async call(name, argument, run = {}) {
    if (this.ended) throw new ShmError("misuse", "the file is closed");
    const mine = this.last.then(() => this.attempt(name, argument, run));
    this.last = mine.catch(() => {});
    return mine;
  }

  /** Runs a call. If bytes of the file are missing, fetches them and runs the call again. */
  async attempt(name, argument, run) {
    if (!Object.hasOwn(CALLS, name)) throw new TypeError(`unknown call ${name}`);
    run.signal?.throwIfAborted();
    this.source ??= await Source.open(this.from, this.options.damaged === true, run.signal);
    this.run = { ...run, told: 0, from: 0, share: 1 };
    const kept = {}; // parts of the result that earlier attempts at this call have completed
    try {
      while (true) {
        this.source.begin();
        this.wasm ??= await Wasm.make(this.module, this.page());
        const scratch = new Scratch(this.wasm);
        try {
          if (this.file === 0) this.open(scratch);
          return CALLS[name](this, scratch, argument, kept);
        } catch (error) {
          const { missing } = this.source;
          if (isTrap(error)) {
            const { wasm } = this;
            this.died();
            throw wasm.lastWords(error);
          }
          // WebAssembly memory never shrinks; only a new instance frees it
          if (error.status === "no memory") this.died();
          else this.close(); // the failed call may have left the handle in an inconsistent state
          if (missing === null) throw error;
        } finally {
          if (this.wasm !== null) scratch.free();
        }
        await this.source.fetchMissing(run.signal);
      }
    } finally {
      this.run = null;
      this.source.end();
    }
  }

  /** Returns the functions that the decoder calls. They must not throw, since exceptions cannot
   *  pass through the decoder. */
  page() {
    const bytesAt = (place, count) => new Uint8Array(this.wasm.memory.buffer, place >>> 0, count);
    return {
      read_at: (_, offset, into, count, why, whyBytes) => {
        const buffer = bytesAt(into, Number(count));
        if (this.source.read(Number(offset), buffer)) return 0;
        const sentence = new TextEncoder().encode("the bytes have not been fetched yet\0");
        if (sentence.length <= whyBytes) bytesAt(why, sentence.length).set(sentence);
        return 1;
      },
      prefetch: (_, ranges, count) => {
        const { bytes } = LAYOUTS.shmf_range;
        for (let i = 0; i < count; ++i) {
          const range = readStruct(this.wasm.view(), "shmf_range", (ranges >>> 0) + i * bytes);
          this.source.tell([{ offset: Number(range.offset), bytes: Number(range.bytes) }]);
        }
      },
      progress: (_, done) => {
        try {
          this.tell(done);
          return this.run.signal?.aborted ? 1 : 0;
        } catch (error) {
          this.run.thrown = error;
          return 1;
        }
      },
    };
  }

  /** Reports progress to the caller. When a call is repeated, reports nothing until the completed
   *  fraction exceeds the fraction that was reported before. */
  tell(done) {
    const all = this.run.from + this.run.share * done;
    if (all <= this.run.told) return;
    this.run.told = all;
    this.run.progress?.(all);
  }

  /** Calls a function of shmformat.h that returns a status. Throws ShmError if the function fails.
   *  `args`: all arguments except the last one, a shmf_error. */
  status(scratch, name, ...args) {
    const error = scratch.struct("shmf_error");
    const status = this.wasm.exports[name](...args, error);
    if (status === 0) return;
    if (status === CANCELLED) {
      if (this.run.thrown !== undefined) throw this.run.thrown;
      this.run.signal?.throwIfAborted();
    }
    const report = readStruct(this.wasm.view(), "shmf_error", error);
    const { fields } = LAYOUTS.shmf_error;
    const name_ = this.source.name;
    const message = this.wasm.text(error + fields.message.offset);
    throw new ShmError(STATUS[status] ?? "io", name_ === "" ? message : `${name_}: ${message}`, {
      section: this.wasm.text(error + fields.section.offset),
      detail: this.wasm.text(error + fields.detail.offset),
      offset: report.offset < 2n ** 53n ? Number(report.offset) : null,
    });
  }
  /** Calls a function of shmformat.h that fills a struct of the type `struct`, and returns the
   *  members of the struct. */
  told(scratch, call, struct, ...args) {
    const place = scratch.struct(struct);
    this.status(scratch, call, this.file, ...args, place);
    return readStruct(this.wasm.view(), struct, place);
  }
  /** Calls a function of shmformat.h that returns a list as a pointer and a count, and returns a
   *  copy of the list. */
  listed(scratch, call, Type, ...args) {
    const places = scratch.bytes(16);
    this.status(scratch, call, this.file, ...args, places, places + 8);
    const view = this.wasm.view();
    return this.wasm.copied(Type, view.getUint32(places, true),
      toNumber(view.getBigUint64(places + 8, true)));
  }

  open(scratch) {
    const { exports } = this.wasm;
    const options = { damaged: this.options.damaged ? 1 : 0 };
    for (const name of LIMITS) {
      const limit = this.options.limits?.[name.replace(/_(\w)/g, (_, c) => c.toUpperCase())];
      if (limit !== undefined) options[name] = limit;
    }
    const how = scratch.struct("shmf_open_options", options);
    const source = scratch.bytes(LAYOUTS.shmf_source.bytes);
    const template = readStruct(this.wasm.view(), "shmf_source", exports.shmf_page_source.value);
    writeStruct(this.wasm.view(), "shmf_source", source,
      { ...template, bytes: BigInt(this.source.size) });
    const handle = scratch.array(new Uint32Array(1));
    const opened = () => this.wasm.view().getUint32(handle, true);
    this.status(scratch, "shmf_open_source", source, how, handle);
    this.file = opened();
    if (this.options.member === undefined) return;
    const archive = this.file;
    this.file = 0;
    try {
      this.status(scratch, "shmf_open_member", archive, this.options.member, how, handle);
      this.file = opened();
    } finally {
      exports.shmf_close(archive);
    }
  }

  /** Closes the handle of the file in the decoder, if there is one. */
  close() {
    if (this.file !== 0) this.wasm.exports.shmf_close(this.file);
    this.file = 0;
  }
  died() {
    this.wasm = null;
    this.file = 0;
  }
  async end() {
    this.ended = true;
    await this.last;
    this.died();
    await this.source?.close();
    this.source = undefined;
  }

  runOptions(scratch) {
    const place = this.wasm.exports.shmf_page_run.value;
    return scratch.struct("shmf_run_options",
      { progress: readStruct(this.wasm.view(), "shmf_run_options", place).progress });
  }

  select(scratch, select) {
    let selection = 0;
    if (select !== undefined) {
      const own = {};
      if (select.cells !== undefined) {
        [own.first_cell, own.end_cell] = select.cells;
        // An empty list of blocks selects no cells. The range 0, 0 would mean "no condition".
        if (own.first_cell === 0 && own.end_cell === 0) own.blocks = scratch.bytes(1);
      }
      if (select.blocks !== undefined && own.blocks === undefined) {
        const blocks = Uint32Array.from(new Set(select.blocks)).sort();
        Object.assign(own, { blocks: scratch.array(blocks), block_count: blocks.length });
      }
      if (select.numbers !== undefined) {
        const numbers = BigUint64Array.from(
          new Set(Array.from(select.numbers, (number) => BigInt(number)))).sort();
        Object.assign(own, { numbers: scratch.array(numbers), number_count: numbers.length });
      }
      if (select.box !== undefined) Object.assign(own, { has_box: 1, box: select.box });
      selection = scratch.struct("shmf_selection", own);
    }
    const counts = this.told(scratch, "shmf_select", "shmf_counts", selection, 0);
    return { vertices: toNumber(counts.vertices), cells: toNumber(counts.cells),
      corners: toNumber(counts.corners) };
  }

  /** Calls shmf_read() for some targets. If a target has `data`, the call fills it; otherwise the
   *  call stores the required size in `used`. */
  readTargets(scratch, targets) {
    const { bytes } = LAYOUTS.shmf_target;
    const place = scratch.bytes(bytes * targets.length);
    targets.forEach(({ own, data = 0, used = 0 }, i) => {
      writeStruct(this.wasm.view(), "shmf_target", place + i * bytes, { ...own, data, bytes: used });
    });
    const run = targets[0]?.data === undefined ? 0 : this.runOptions(scratch);
    this.status(scratch, "shmf_read", this.file, place, targets.length, run);
    targets.forEach((target, i) => {
      const { used } = readStruct(this.wasm.view(), "shmf_target", place + i * bytes);
      target.used = toNumber(used);
    });
  }

  /** Returns the properties of all arrays. They are read from the file only once. */
  arrays(scratch) {
    const { arrays } = this.told(scratch, "shmf_get_info", "shmf_info");
    this.knownArrays ??= Array.from({ length: arrays }, (_, i) => {
      const info = this.told(scratch, "shmf_get_array", "shmf_array", i);
      return {
        index: i,
        name: this.wasm.text(info.name),
        role: this.wasm.text(info.role),
        location: LOCATIONS[info.location],
        type: TYPE_NAMES[info.type],
        components: info.components,
        elements: toNumber(info.elements),
        blocks: info.blocks === 0 ? null
          : Array.from(this.wasm.copied(Uint32Array, info.blocks, info.block_count)),
        error: info.error,
        relativeError: info.relative_error,
        fills: info.fills === 0 ? []
          : Array.from(this.wasm.copied(Float64Array, info.fills, info.fill_count)),
        steps: info.per_step === 0 ? null
          : Array.from(this.listed(scratch, "shmf_get_steps", BigUint64Array, i), toNumber),
      };
    });
    return this.knownArrays;
  }
}

/** Returns the properties of the array that `wanted` identifies by index, or by name and
 *  location. */
function found(arrays, wanted) {
  const array = arrays.find(({ index, name, location }) => (wanted.index === undefined
    ? name === wanted.name && (wanted.location ?? location) === location
    : index === wanted.index));
  const name = wanted.name ?? wanted.index;
  if (array === undefined) throw new ShmError("misuse", `no array ${name}`);
  if (array.steps !== null && wanted.step === undefined) {
    throw new ShmError("misuse", `array ${name} has time steps: choose one with step`);
  }
  return array;
}

const CALLS = {
  /** Returns the properties of a mesh. For an archive, returns the names of its members. */
  describe(engine, scratch) {
    const { exports } = engine.wasm;
    if (exports.shmf_is_archive(engine.file)) {
      const members = exports.shmf_member_count(engine.file);
      return { archive: Array.from({ length: members }, (_, i) =>
        engine.wasm.text(exports.shmf_member_name(engine.file, i))) };
    }
    const info = engine.told(scratch, "shmf_get_info", "shmf_info");
    return {
      vertexCount: toNumber(info.vertices),
      cellCount: toNumber(info.cells),
      hexahedronCount: toNumber(info.hexahedra),
      stepCount: toNumber(info.steps),
      digest: info.has_digest ? info.digest.toString(16).padStart(16, "0") : null,
      fileBytes: toNumber(info.file_bytes),
      segmentCount: info.segments,
      coordinateType: TYPE_NAMES[info.coordinate_type],
      coordinateError: info.coordinate_error,
      order: ORDERS[info.order],
      sourceFormat: engine.wasm.text(info.source_format),
      blocks: Array.from({ length: info.blocks }, (_, i) => {
        const block = engine.told(scratch, "shmf_get_block", "shmf_block", i);
        return { id: isSafe(block.id) ? Number(block.id) : block.id,
          name: engine.wasm.text(block.name), shape: SHAPES[block.shape] ?? "other",
          nodesPerCell: block.nodes_per_cell, cells: toNumber(block.cells),
          nodeScheme: NODE_SCHEMES[block.node_scheme] ?? "lagrange" };
      }),
      arrays: engine.arrays(scratch),
      times: Array.from(engine.listed(scratch, "shmf_get_times", Float64Array)),
    };
  },

  segments(engine, scratch) {
    const { segments } = engine.told(scratch, "shmf_get_info", "shmf_info");
    return Array.from({ length: segments }, (_, i) => {
      const segment = engine.told(scratch, "shmf_get_segment", "shmf_segment", i);
      return { firstCell: toNumber(segment.first_cell), cells: toNumber(segment.cells),
        firstVertex: toNumber(segment.first_vertex), vertices: toNumber(segment.vertices),
        bytes: toNumber(segment.bytes), box: segment.box };
    });
  },

  /** Reads the requested data in two passes: first the mesh and static arrays, then arrays at time
   *  steps. If bytes are missing in the second pass, only this pass is repeated. */
  read(engine, scratch, wanted, kept) {
    const arrays = engine.arrays(scratch);
    const counts = engine.select(scratch, wanted.select);
    const info = engine.told(scratch, "shmf_get_info", "shmf_info");
    const wide = Math.max(counts.vertices, counts.corners + 1) >= 2 ** 32 ? UINT64 : UINT32;
    const result = kept.result ??= { vertexCount: counts.vertices, cellCount: counts.cells };
    const passes = [[], []]; // {own, put, used, data}
    const want = (what, type, put, more = {}, stepped = false) =>
      passes[stepped ? 1 : 0].push({ own: { what: WHAT[what], type, ...more }, put });
    if (wanted.points) {
      const type = wanted.points === true ? info.coordinate_type
        : TYPE_NAMES.indexOf(wanted.points, 9);
      if (type < 0) throw new ShmError("misuse", `points cannot be of type ${wanted.points}`);
      want("points", type, (values) => { result.points = values; });
    }
    if (wanted.cells) {
      const cells = result.cells ??= {};
      want("corners", wide, (values) => { cells.connectivity = values; });
      want("cornerBegin", wide, (values) => { cells.offsets = values; });
      want("cellTypes", UINT8, (values) => { cells.types = values; });
      want("cellBlocks", UINT32, (values) => { cells.blocks = values; });
    }
    if (wanted.numbers) {
      want("vertexNumbers", UINT64, (values) => { result.vertexNumbers = narrowed(values); });
      want("cellNumbers", UINT64, (values) => { result.cellNumbers = narrowed(values); });
    }
    result.arrays ??= [];
    (wanted.arrays ?? []).forEach((one, place) => {
      const array = found(arrays, one);
      const type = TYPE_NAMES.indexOf(one.type ?? array.type);
      if (type < 1) throw new ShmError("misuse", `unknown type ${one.type}`);
      const { index, name, location, components } = array;
      const step = array.steps === null ? null : one.step;
      want("values", type, (values) => {
        result.arrays[place] = { index, name, location, components, step, values };
      }, { array: index, step: step ?? 0, flags: one.fill === false ? 0 : FILL }, step !== null);
    });
    // Stores the size of each target in `used`. The second call to readTargets(), below, reads the
    // values into the targets.
    for (const pass of passes) engine.readTargets(scratch, pass);
    const bytes = passes.map((pass) => pass.reduce((sum, { used }) => sum + used, 0));
    const all = Math.max(bytes[0] + bytes[1], 1);
    passes.forEach((pass, i) => {
      if (pass.length === 0 || kept[i]) return;
      Object.assign(engine.run, { from: i * (bytes[0] / all), share: bytes[i] / all });
      for (const target of pass) target.data = scratch.bytes(target.used);
      engine.readTargets(scratch, pass);
      for (const { own, used, data, put } of pass) {
        const Type = TYPES[own.type];
        put(engine.wasm.copied(Type, data, used / Type.BYTES_PER_ELEMENT));
      }
      kept[i] = true;
    });
    return result;
  },

  /** Returns the boundary surface: the sides that belong to a single volume cell, and all cells of
   *  lower dimension. */
  boundary(engine, scratch, wanted) {
    const { exports } = engine.wasm;
    const arrays = Array.from(wanted.arrays ?? [], (one) => {
      const array = found(engine.arrays(scratch), one);
      return { ...array, step: array.steps === null ? null : one.step };
    });
    engine.select(scratch, wanted.select);
    const options = scratch.struct("shmf_boundary_options", {
      arrays: scratch.array(Uint32Array.from(arrays, ({ index }) => index)),
      steps: scratch.array(BigUint64Array.from(arrays, ({ step }) => BigInt(step ?? 0))),
      array_count: arrays.length,
      max_bytes: wanted.maxBytes ?? 0,
      subdivide: wanted.subdivide ? 1 : 0,
    });
    const handle = scratch.array(new Uint32Array(1));
    engine.status(scratch, "shmf_find_boundary", engine.file, options, engine.runOptions(scratch),
      handle);
    const boundary = engine.wasm.view().getUint32(handle, true);
    try {
      const place = scratch.struct("shmf_surface");
      engine.status(scratch, "shmf_get_surface", boundary, place);
      const surface = readStruct(engine.wasm.view(), "shmf_surface", place);
      const [vertices, faces, corners] =
        [surface.vertices, surface.faces, surface.corners].map(toNumber);
      const copied = (Type, pointer, count) => engine.wasm.copied(Type, pointer, count);
      const offsets = copied(BigUint64Array, surface.face_begin, faces + 1);
      return {
        vertexCount: vertices,
        faceCount: faces,
        leftOut: toNumber(surface.left_out),
        points: copied(TYPES[surface.coordinate_type], surface.xyz, 3 * vertices),
        connectivity: copied(Uint32Array, surface.face_corners, corners),
        offsets: narrowed(offsets),
        vertexNumbers: narrowed(copied(BigUint64Array, surface.vertex_numbers, vertices)),
        cellNumbers: narrowed(copied(BigUint64Array, surface.cell_numbers, faces)),
        blocks: copied(Uint32Array, surface.cell_blocks, faces),
        sides: copied(Uint32Array, surface.sides, faces),
        arrays: arrays.map(({ index, name, location, type, components, step }, i) => {
          const view = engine.wasm.view();
          const Type = TYPES[TYPE_NAMES.indexOf(type)];
          const bytes = toNumber(view.getBigUint64(surface.array_bytes + 8 * i, true));
          const values = copied(Type, view.getUint32(surface.array_values + 4 * i, true),
            bytes / Type.BYTES_PER_ELEMENT);
          return { index, name, location, components, step, values };
        }),
      };
    } finally {
      exports.shmf_boundary_free(boundary);
    }
  },

  sets(engine, scratch) {
    const count = scratch.bytes(8);
    engine.status(scratch, "shmf_set_count", engine.file, count);
    const sets = toNumber(engine.wasm.view().getBigUint64(count, true));
    return Array.from({ length: sets }, (_, i) => {
      const set = engine.told(scratch, "shmf_get_set", "shmf_set", BigInt(i));
      const members = toNumber(set.members);
      const list = (Type, place, length) =>
        (place === 0 || length === 0 ? null : engine.wasm.copied(Type, place, length));
      return {
        kind: SETS[set.kind],
        id: isSafe(set.id) ? Number(set.id) : set.id,
        name: engine.wasm.text(set.name),
        numbers: narrowed(engine.wasm.copied(BigUint64Array, set.numbers, members)),
        sides: set.sides === 0 ? null : engine.wasm.copied(Int32Array, set.sides, members),
        blocks: list(Uint32Array, set.blocks, set.block_count),
        factors: list(Float64Array, set.factors, toNumber(set.factor_count)),
      };
    });
  },

  extras(engine, scratch) {
    const count = scratch.bytes(8);
    engine.status(scratch, "shmf_extra_count", engine.file, count);
    const extras = toNumber(engine.wasm.view().getBigUint64(count, true));
    return Array.from({ length: extras }, (_, i) => {
      const extra = engine.told(scratch, "shmf_get_extra", "shmf_extra", BigInt(i));
      const Type = TYPES[extra.type];
      return {
        key: engine.wasm.text(extra.key),
        refers: REFERS[extra.refers],
        shape: Array.from(
          engine.wasm.copied(BigUint64Array, extra.shape, extra.dimensions), toNumber),
        values: engine.wasm.copied(Type, extra.data,
          toNumber(extra.bytes) / Type.BYTES_PER_ELEMENT),
      };
    });
  },

  verify(engine, scratch) {
    engine.status(scratch, "shmf_verify", engine.file, engine.runOptions(scratch));
  },
};

/** Returns the buffers of all typed arrays in `result`, so that they can be transferred to another
 *  thread. */
export function buffersOf(result, buffers = []) {
  if (ArrayBuffer.isView(result)) buffers.push(result.buffer);
  else if (result !== null && typeof result === "object") {
    for (const value of Object.values(result)) buffersOf(value, buffers);
  }
  return buffers;
}
