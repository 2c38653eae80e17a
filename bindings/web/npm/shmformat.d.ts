/** 64-bit integers are returned as Number. A file with a number above 2^53 is rejected with a
 *  RangeError. */

/** The failure of a call. `message` is a human-readable sentence, from the library if it returned
 *  one. */
export class ShmError extends Error {
  readonly status: "io" | "truncated" | "corrupt" | "unsupported" | "over limit" | "misuse"
    | "no memory" | "cancelled";
  /** Part of the file, such as "group 3, geometry"; or "". */
  readonly section: string;
  /** One sentence, without the file name, section and offset. */
  readonly detail: string;
  /** Offset from the start of the file in bytes; null if unknown. */
  readonly offset: number | null;
}

export type ScalarType = "int8" | "uint8" | "int16" | "uint16" | "int32" | "uint32" | "int64"
  | "uint64" | "float32" | "float64";
export type Values = Int8Array | Uint8Array | Int16Array | Uint16Array | Int32Array | Uint32Array
  | BigInt64Array | BigUint64Array | Float32Array | Float64Array;
/** Vertex numbers, cell numbers or offsets: 32 bits if all of them fit, otherwise 64 bits. */
export type Numbers = Uint32Array | BigUint64Array;

export interface Run {
  /** Aborting this signal rejects the call with the signal's reason. If a worker is already
   *  decoding the call, the worker is terminated; other calls for the same file start again in a
   *  new one. */
  signal?: AbortSignal;
}
export interface LongRun extends Run {
  /** Called regularly with the completed fraction, 0 to 1. */
  progress?: (done: number) => void;
}

export interface OpenOptions extends Run {
  /** Opens a damaged file and reads its intact parts. Lost values are NaN or 0. */
  damaged?: boolean;
  /** Limits on the resources that a file may demand. Defaults: see ReadLimits in shm/limits.h. */
  limits?: {
    maxArrays?: number;
    maxStaticComponents?: number;
    maxBlocks?: number;
    maxSegments?: number;
    maxActiveVertices?: number;
    maxChunkBytes?: number;
    maxGroupBytes?: number;
    maxExtraBytes?: number;
    maxSteps?: number;
    maxUnpackedBytes?: number;
    maxColumnBytes?: number;
    maxVertices?: number;
    maxCells?: number;
    maxDecodedBytes?: number;
  };
  /** false: decodes in this thread. Default: in a worker, if the platform has workers. */
  worker?: boolean;
  /** Location or contents of shmformat.wasm. Default: the file next to the package. */
  wasm?: string | URL | ArrayBuffer | ArrayBufferView | WebAssembly.Module;
}

/**
 * Opens a file. Reads its end, its index and its schema, but no values. For a URL, only the needed
 * ranges are fetched; a server without range requests sends the whole file, which is accepted up to
 * 256 MiB. The bytes that a call reads stay in memory while the call runs. Buffers are copied once,
 * not borrowed. In Node.js, a string that is not a URL is a path.
 *
 * Throws ShmError; TypeError if `source` is not one of these types.
 */
export function open(
  source: ArrayBuffer | ArrayBufferView | Blob | URL | string,
  options?: OpenOptions,
): Promise<Mesh | Archive>;

export interface Block {
  /** ID in the source file; need not be unique. BigInt if its magnitude exceeds 2^53 - 1. */
  readonly id: number | bigint;
  readonly name: string;
  readonly shape: "other" | "vertex" | "line" | "triangle" | "quad" | "polygon" | "tetrahedron"
    | "pyramid" | "wedge" | "hexahedron" | "polyhedron" | "faces";
  /** Number of nodes of each cell; 0: differs from cell to cell. */
  readonly nodesPerCell: number;
  readonly cells: number;
}

export interface ArrayInfo {
  readonly index: number;
  readonly name: string;
  /** "" for field data; otherwise its role in the source format, such as "exodus:node_num_map". */
  readonly role: string;
  readonly location: "point" | "cell";
  readonly type: ScalarType;
  readonly components: number;
  /** Number of elements with values: all vertices, or the cells of `blocks`. */
  readonly elements: number;
  /** For cell data: indices of the blocks whose cells have values; null: all blocks. */
  readonly blocks: number[] | null;
  /** 0: lossless; otherwise the largest difference between a value and its source. */
  readonly error: number;
  /** Time steps with values, ascending; null: a static array, with one set of values. */
  readonly steps: number[] | null;
}

/** An array to read, identified by its index; or the first array with this name (and location). */
export interface WantedArray {
  index?: number;
  name?: string;
  location?: "point" | "cell";
  /** Time step; required if the array has time steps. */
  step?: number;
  /** Type of the returned values. Default: the type of the array. float64 arrays can also be read
   *  as "float32". */
  type?: ScalarType;
  /** For cell data. true (the default): returns values for all cells: NaN (0 for integers) for
   *  cells without values. false: returns only the existing values. */
  fill?: boolean;
}

/** Selects the cells that meet all given conditions, with their vertices. */
export interface Selection {
  /** Range of cell numbers, first to end - 1. */
  cells?: [first: number, end: number];
  /** Indices of blocks. */
  blocks?: Iterable<number>;
  /** Individual cell numbers. */
  numbers?: Iterable<number | bigint>;
  /** Smallest x y z, largest x y z. Selects cells with a vertex in this box. */
  box?: [number, number, number, number, number, number];
}

export interface Wanted extends LongRun {
  /** Whether to read coordinates. true (the default): in the type of the file; otherwise in the
   *  given type. */
  points?: boolean | "float32" | "float64";
  /** Whether to read the cells. Default: true. */
  cells?: boolean;
  arrays?: Iterable<WantedArray>;
  /** Whether to return the numbers of vertices and cells in the whole mesh. */
  numbers?: boolean;
  /** Default: all cells, and all vertices, even unused ones. Selected vertices and cells are
   *  renumbered from 0. */
  select?: Selection;
}

/** Cells in the layout of VTK: the vertices of cell i are connectivity[offsets[i]] to
 *  connectivity[offsets[i + 1] - 1]. */
export interface Cells {
  readonly connectivity: Numbers;
  /** Length: cells + 1. */
  readonly offsets: Numbers;
  /** VTK cell types. */
  readonly types: Uint8Array;
  /** Index of the block of each cell. */
  readonly blocks: Uint32Array;
}

export interface ReadArray {
  readonly index: number;
  readonly name: string;
  readonly location: "point" | "cell";
  readonly components: number;
  /** Time step of the values; null for static arrays. */
  readonly step: number | null;
  /** Length: elements * components. The components of an element are adjacent. */
  readonly values: Values;
}

/** The arrays that read() returns. Each array has a separate buffer, which belongs to the
 *  caller. */
export interface Arrays {
  readonly vertexCount: number;
  readonly cellCount: number;
  /** Length: 3 * vertices. */
  readonly points?: Float32Array | Float64Array;
  readonly cells?: Cells;
  /** In the order of the request. */
  readonly arrays: ReadArray[];
  readonly vertexNumbers?: Numbers;
  readonly cellNumbers?: Numbers;
}

export interface WantedBoundary extends LongRun {
  /** Arrays whose values on the boundary are returned. */
  arrays?: Iterable<Pick<WantedArray, "index" | "name" | "location" | "step">>;
  /** Default: all cells. */
  select?: Selection;
  /** Memory limit for the surface and the search for it, in bytes; 0: 4 GiB. */
  maxBytes?: number;
}

/** Surface of a mesh. The points of face i are connectivity[offsets[i]] to connectivity[offsets[i +
 *  1] - 1], counter-clockwise when seen from outside; lines have 2 points, vertices 1. */
export interface Boundary {
  readonly vertexCount: number;
  readonly faceCount: number;
  /** Number of cells whose faces are unknown, such as polyhedra. */
  readonly leftOut: number;
  /** Points that the faces use. Length: 3 * vertices. */
  readonly points: Float32Array | Float64Array;
  readonly connectivity: Uint32Array;
  /** Length: faces + 1. */
  readonly offsets: Numbers;
  /** Number of each vertex in the whole mesh. */
  readonly vertexNumbers: Numbers;
  /** Number of each face's cell in the whole mesh. */
  readonly cellNumbers: Numbers;
  /** Block index of each face's cell. */
  readonly blocks: Uint32Array;
  /** Side of the cell, numbered from 1 as in Exodus; 0: the cell itself. */
  readonly sides: Uint32Array;
  /** In the order of the request, with one element per vertex or per face. */
  readonly arrays: ReadArray[];
}

export interface Segment {
  readonly firstCell: number;
  readonly cells: number;
  readonly firstVertex: number;
  readonly vertices: number;
  /** Size of the segment in the file, in bytes. */
  readonly bytes: number;
  /** Smallest x y z, largest x y z. */
  readonly box: number[];
}

/** A named set of vertices, sides or cells. Its numbers refer to the whole mesh. */
export interface MeshSet {
  readonly kind: "node" | "side" | "element";
  readonly id: number | bigint;
  readonly name: string;
  /** Vertex numbers in node sets, cell numbers in other sets. */
  readonly numbers: Numbers;
  /** For side sets: the side of each cell, numbered from 1 as in Exodus. */
  readonly sides: Int32Array | null;
  /** For element sets: blocks whose cells all belong to the set as well. */
  readonly blocks: Uint32Array | null;
  /** Distribution factors; null if all are 1. */
  readonly factors: Float64Array | null;
}

/** A typed value with a key, for data that the other properties do not cover. */
export interface Extra {
  readonly key: string;
  readonly refers: "nothing" | "vertices" | "cells";
  readonly shape: number[];
  readonly values: Values;
}

/** An open mesh. Calls may overlap; they run one after the other. */
export interface Mesh {
  readonly vertexCount: number;
  readonly cellCount: number;
  readonly hexahedronCount: number;
  readonly stepCount: number;
  readonly segmentCount: number;
  readonly fileBytes: number;
  readonly coordinateType: "float32" | "float64";
  /** 0: lossless; otherwise the largest difference between a coordinate and its source. */
  readonly coordinateError: number;
  /** "keep": vertices and cells have the numbers of the source. */
  readonly order: "keep" | "stream" | "free";
  /** "exodus", "vtk", "gmsh", ..., or "". */
  readonly sourceFormat: string;
  readonly blocks: Block[];
  readonly arrays: ArrayInfo[];
  /** The time of each step; empty if the file has no times. */
  readonly times: number[];

  /** Reads points, cells and arrays. Only the requested data is fetched and decoded. */
  read(wanted?: Wanted): Promise<Arrays>;
  /** Finds the boundary: sides that belong to a single volume cell, and all cells of lower
   *  dimension. It needs one pass over the cells; memory grows with the active surface and the
   *  boundary. */
  boundary(wanted?: WantedBoundary): Promise<Boundary>;
  /** Returns the segments: runs of cells that can be decoded independently. */
  segments(run?: Run): Promise<Segment[]>;
  sets(run?: Run): Promise<MeshSet[]>;
  extras(run?: Run): Promise<Extra[]>;
  /** Decodes the whole file and discards the result. Rejects if any part of the file is invalid. */
  verify(run?: LongRun): Promise<void>;
  /** Closes the file and rejects the pending calls. Arrays that were read stay valid. */
  close(): Promise<void>;
}

/** A file that contains several files. */
export interface Archive {
  /** Names of the files. */
  readonly members: string[];
  /** Opens a member. The caller closes the returned Mesh with its close(). */
  open(name: string, run?: Run): Promise<Mesh>;
}
