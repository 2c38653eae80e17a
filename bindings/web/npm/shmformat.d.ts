/** Numbers of 64 bits are Numbers here; a file that has one above 2^53 is refused with a RangeError. */

/** Why a call failed. `message` is a sentence for people, the library's own where it has one. */
export class ShmError extends Error {
  readonly status: "io" | "truncated" | "corrupt" | "unsupported" | "over limit" | "misuse"
    | "no memory" | "cancelled";
  /** Part of the file, as "group 3, geometry", or "". */
  readonly section: string;
  /** One sentence, without file and place. */
  readonly detail: string;
  /** Bytes from the start of the file; null where that is not known. */
  readonly offset: number | null;
}

export type ScalarType = "int8" | "uint8" | "int16" | "uint16" | "int32" | "uint32" | "int64"
  | "uint64" | "float32" | "float64";
export type Values = Int8Array | Uint8Array | Int16Array | Uint16Array | Int32Array | Uint32Array
  | BigInt64Array | BigUint64Array | Float32Array | Float64Array;
/** Numbers of vertices or cells: 32 bits, and 64 where these do not do. */
export type Numbers = Uint32Array | BigUint64Array;

export interface Run {
  /** What is aborted rejects with the reason of the signal. A worker that decodes meanwhile is ended,
   *  and other calls for the same file begin again in a new one. */
  signal?: AbortSignal;
}
export interface LongRun extends Run {
  /** Told now and then how much is done, from 0 to 1. */
  progress?: (done: number) => void;
}

export interface OpenOptions extends Run {
  /** A hurt file, of which what is whole is wanted: what is lost is missing, values are NaN or 0. */
  damaged?: boolean;
  /** What a file may ask for; what is left out is the library's (shm/reader.h, ReadLimits). */
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
  /** False: decodes in this thread. Else in a worker, where there are workers. */
  worker?: boolean;
  /** Where shmformat.wasm is, or what is in it; else it is looked for beside the package. */
  wasm?: string | URL | ArrayBuffer | ArrayBufferView | WebAssembly.Module;
}

/**
 * Opens a file: reads its end, its index and its schema, and no values. Of a URL what is wanted is
 * fetched by ranges; a server that gives none gives all of it, 256 MiB at most. What a call reads of
 * the file is in memory while it runs. Bytes are copied once and not borrowed. In Node.js a string
 * that is no URL is a path.
 *
 * Errors: ShmError; TypeError of what is no file at all.
 */
export function open(
  source: ArrayBuffer | ArrayBufferView | Blob | URL | string,
  options?: OpenOptions,
): Promise<Mesh | Archive>;

export interface Block {
  /** The source's own; need not be unique. A BigInt above 2^53. */
  readonly id: number | bigint;
  readonly name: string;
  readonly shape: "other" | "vertex" | "line" | "triangle" | "quad" | "polygon" | "tetrahedron"
    | "pyramid" | "wedge" | "hexahedron" | "polyhedron" | "faces";
  /** 0: varies. */
  readonly nodesPerCell: number;
  readonly cells: number;
}

export interface ArrayInfo {
  readonly index: number;
  readonly name: string;
  /** "" for data; else what the source calls it, as "exodus:node_num_map". */
  readonly role: string;
  readonly location: "point" | "cell";
  readonly type: ScalarType;
  readonly components: number;
  /** That have values: vertices, or cells of the blocks below. */
  readonly elements: number;
  /** Cell data: indices of the blocks that have it; null: all have. */
  readonly blocks: number[] | null;
  /** 0: lossless; else the most that a value differs from its source. */
  readonly error: number;
  /** Time steps at which it has values, ascending; null: it has none, and values all the same. */
  readonly steps: number[] | null;
}

/** One array that is wanted: by its index, or the first of its name (and location). */
export interface WantedArray {
  index?: number;
  name?: string;
  location?: "point" | "cell";
  /** Needed where it has time steps. */
  step?: number;
  /** Its own, or "float32" where that is "float64". */
  type?: ScalarType;
  /** Cell data. False: an element for each cell that has values. Else one for each cell, NaN (integers:
   *  0) where it has none. */
  fill?: boolean;
}

/** Cells that meet every condition that is there, with their vertices. */
export interface Selection {
  /** By number, the end left out. */
  cells?: [first: number, end: number];
  /** Indices of blocks. */
  blocks?: Iterable<number>;
  /** One by one. */
  numbers?: Iterable<number | bigint>;
  /** Smallest x y z, largest x y z, of which a cell has a vertex. */
  box?: [number, number, number, number, number, number];
}

export interface Wanted extends LongRun {
  /** True, as when it is left out: of the type that the file has. */
  points?: boolean | "float32" | "float64";
  /** True when it is left out. */
  cells?: boolean;
  arrays?: Iterable<WantedArray>;
  /** Numbers of vertices and cells in the whole mesh. */
  numbers?: boolean;
  /** All cells, and unused vertices, where it is left out. In a piece both are numbered anew. */
  select?: Selection;
}

/** Cells as VTK has them: cell i has the vertices connectivity[offsets[i]] to [offsets[i + 1]]. */
export interface Cells {
  readonly connectivity: Numbers;
  /** cells + 1. */
  readonly offsets: Numbers;
  /** VTK's cell types. */
  readonly types: Uint8Array;
  /** Index of the block of each cell. */
  readonly blocks: Uint32Array;
}

export interface ReadArray {
  readonly index: number;
  readonly name: string;
  readonly location: "point" | "cell";
  readonly components: number;
  /** null where it has no time steps. */
  readonly step: number | null;
  /** elements * components, components of one element together. */
  readonly values: Values;
}

/** Every array has a buffer of its own, which is the caller's. */
export interface Arrays {
  readonly vertexCount: number;
  readonly cellCount: number;
  /** 3 * vertices. */
  readonly points?: Float32Array | Float64Array;
  readonly cells?: Cells;
  /** In the order in which they were wanted. */
  readonly arrays: ReadArray[];
  readonly vertexNumbers?: Numbers;
  readonly cellNumbers?: Numbers;
}

export interface WantedBoundary extends LongRun {
  /** That are carried along. */
  arrays?: Iterable<Pick<WantedArray, "index" | "name" | "location" | "step">>;
  /** Of these cells; of all where it is left out. */
  select?: Selection;
  /** What the surface, and the search for it, may take; 0: 4 GiB. */
  maxBytes?: number;
}

/** Face i has the points connectivity[offsets[i]] to [offsets[i + 1]], counter-clockwise seen from
 *  outside; 2 of a line, 1 of a vertex. */
export interface Boundary {
  readonly vertexCount: number;
  readonly faceCount: number;
  /** Cells of which no face is known, as polyhedra. */
  readonly leftOut: number;
  /** 3 * vertices: those that faces use. */
  readonly points: Float32Array | Float64Array;
  readonly connectivity: Uint32Array;
  /** faces + 1. */
  readonly offsets: Numbers;
  /** Of each vertex, in the whole mesh. */
  readonly vertexNumbers: Numbers;
  /** Of each face: its cell, in the whole mesh. */
  readonly cellNumbers: Numbers;
  /** Index of the block of that. */
  readonly blocks: Uint32Array;
  /** Which side of it, from 1, as Exodus counts; 0: the cell itself. */
  readonly sides: Uint32Array;
  /** In the order in which they were wanted: an element for each vertex, or for each face. */
  readonly arrays: ReadArray[];
}

export interface Segment {
  readonly firstCell: number;
  readonly cells: number;
  readonly firstVertex: number;
  readonly vertices: number;
  /** In the file. */
  readonly bytes: number;
  /** Smallest x y z, largest x y z. */
  readonly box: number[];
}

/** A named group. Numbers are those of the whole mesh. */
export interface MeshSet {
  readonly kind: "node" | "side" | "element";
  readonly id: number | bigint;
  readonly name: string;
  /** Vertices of node sets, cells of the others. */
  readonly numbers: Numbers;
  /** Of side sets: which side of each cell, from 1, as Exodus counts. */
  readonly sides: Int32Array | null;
  /** Of element sets: all cells of these blocks belong to it, too. */
  readonly blocks: Uint32Array | null;
  /** Distribution factors where they are not all 1. */
  readonly factors: Float64Array | null;
}

/** What the model has no word for. */
export interface Extra {
  readonly key: string;
  readonly refers: "nothing" | "vertices" | "cells";
  readonly shape: number[];
  readonly values: Values;
}

/** An open mesh. Calls may overlap; they are done one after the other. */
export interface Mesh {
  readonly vertexCount: number;
  readonly cellCount: number;
  readonly hexahedronCount: number;
  readonly stepCount: number;
  readonly segmentCount: number;
  readonly fileBytes: number;
  readonly coordinateType: "float32" | "float64";
  /** 0: lossless; else the most that a coordinate differs from its source. */
  readonly coordinateError: number;
  /** "keep": vertices and cells have the numbers that they had. */
  readonly order: "keep" | "stream" | "free";
  /** "exodus", "vtk", "gmsh", ..., or "". */
  readonly sourceFormat: string;
  readonly blocks: Block[];
  readonly arrays: ArrayInfo[];
  /** Of the time steps; empty where the file does not say. */
  readonly times: number[];

  /** Points, cells and arrays: what is not wanted is neither fetched nor decoded. */
  read(wanted?: Wanted): Promise<Arrays>;
  /** What is seen from outside: the sides that one volume cell alone has, and cells of fewer dimensions
   *  themselves. In one pass; memory follows the active surface and what is found. */
  boundary(wanted?: WantedBoundary): Promise<Boundary>;
  /** Runs of cells that can be decoded alone. */
  segments(run?: Run): Promise<Segment[]>;
  sets(run?: Run): Promise<MeshSet[]>;
  extras(run?: Run): Promise<Extra[]>;
  /** Decodes everything once and keeps nothing; rejects where anything is wrong. */
  verify(run?: LongRun): Promise<void>;
  /** Calls that are under way reject. Arrays that were read stay. */
  close(): Promise<void>;
}

/** Several files in one. */
export interface Archive {
  /** Their names. */
  readonly members: string[];
  /** Opens one, which is closed by itself. */
  open(name: string, run?: Run): Promise<Mesh>;
}
