/** The package returns counts and offsets of 64 bits as Number. If such a number in a file exceeds
 *  2^53, the call rejects with a RangeError. */

/** The failure of a call. `message` is a human-readable sentence. If the library reported the
 *  failure, `message` is the message of the library. */
export class ShmError extends Error {
  readonly status: "io" | "truncated" | "corrupt" | "unsupported" | "over limit" | "misuse"
    | "no memory" | "cancelled";
  /** Part of the file that has the error, such as "group 3, geometry"; "" if unknown. */
  readonly section: string;
  /** Cause in one sentence, without the file name, section and offset. */
  readonly detail: string;
  /** Byte offset of the error in the file; null if unknown. */
  readonly offset: number | null;
}

export type ScalarType = "int8" | "uint8" | "int16" | "uint16" | "int32" | "uint32" | "int64"
  | "uint64" | "float32" | "float64";
export type Values = Int8Array | Uint8Array | Int16Array | Uint16Array | Int32Array | Uint32Array
  | BigInt64Array | BigUint64Array | Float32Array | Float64Array;
/** Vertex numbers, cell numbers or offsets. The type is Uint32Array if all of them fit into 32
 *  bits, otherwise BigUint64Array. */
export type Numbers = Uint32Array | BigUint64Array;

export interface Run {
  /** Aborting this signal rejects the call with the signal's reason. If a worker is already
   *  executing the call, the worker is terminated, and all other pending calls for the same file
   *  start again in a new worker. */
  signal?: AbortSignal;
}
export interface LongRun extends Run {
  /** Called regularly with the completed fraction, 0 to 1. */
  progress?: (done: number) => void;
}

export interface OpenOptions extends Run {
  /** If true, a damaged file can be opened, and its intact parts can be read. Lost values are NaN,
   *  or 0 for integers. Default: false. */
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
  /** Whether to decode in a worker. false: the calling thread decodes. Default: true if the
   *  platform has workers. */
  worker?: boolean;
  /** Location or contents of shmformat.wasm. Default: the file in the folder of the package. */
  wasm?: string | URL | ArrayBuffer | ArrayBufferView | WebAssembly.Module;
}

/**
 * Opens a file. Reads the end of the file, the index and the schema, but no values. For a URL, only
 * the needed ranges are fetched. A server that does not support range requests sends the whole
 * file, which must not exceed 256 MiB. The bytes that a call reads stay in memory while the call
 * runs. If `source` is an ArrayBuffer or a view, its bytes are copied once. In Node.js, a string
 * that is not a URL is a path.
 *
 * Rejects with a ShmError on failure, or with a TypeError if `source` has none of these types.
 */
export function open(
  source: ArrayBuffer | ArrayBufferView | Blob | URL | string,
  options?: OpenOptions,
): Promise<Mesh | Archive>;

export interface Block {
  /** Id of the block in the source file; need not be unique. It is a BigInt if its magnitude
   *  exceeds 2^53 - 1. */
  readonly id: number | bigint;
  readonly name: string;
  readonly shape: "other" | "vertex" | "line" | "triangle" | "quad" | "polygon" | "tetrahedron"
    | "pyramid" | "wedge" | "hexahedron" | "polyhedron" | "faces";
  /** Number of nodes of each cell; 0: the number varies from cell to cell. */
  readonly nodesPerCell: number;
  readonly cells: number;
  /** Meaning of the nodes that are not corners: nodes on the cell; nodes on its edges only (cells
   *  of order 3 and higher); control points. */
  readonly nodeScheme: "lagrange" | "serendipity" | "bezier";
}

/** Where an array has values: vertices, cells, the whole mesh, or members of sets. Arrays at the last
 *  four locations have time steps. */
export type ArrayLocation =
  "point" | "cell" | "global" | "node_set" | "side_set" | "element_set";

export interface ArrayInfo {
  readonly index: number;
  readonly name: string;
  /** Role of the array in the source format, such as "exodus:node_num_map"; "" for field data. */
  readonly role: string;
  readonly location: ArrayLocation;
  readonly type: ScalarType;
  readonly components: number;
  /** Number of elements with values: all vertices, the cells of `blocks`, or the members of the
   *  sets, set after set. */
  readonly elements: number;
  /** For cell data: indices of the blocks whose cells have values; for data of sets: numbers of the
   *  sets, which are numbered from 0 for each kind; null: all blocks or sets. */
  readonly blocks: number[] | null;
  /** Error bound: largest possible difference between a value and the original value; 0:
   *  lossless. */
  readonly error: number;
  /** Error bound relative to the value: largest possible difference between a value and the original
   *  value, divided by the magnitude of the original value; 0: no such bound. */
  readonly relativeError: number;
  /** Fill values, which mark missing values; they are restored exactly under every bound. */
  readonly fills: number[];
  /** Time steps at which the array has values, ascending; null: the array is static. */
  readonly steps: number[] | null;
}

/** An array to read, identified by its index, or by its name (and location). If several arrays
 *  match, the first one is read. */
export interface WantedArray {
  index?: number;
  name?: string;
  location?: ArrayLocation;
  /** Time step; required if the array has time steps. */
  step?: number;
  /** Type of the returned values. Default: the type of the array. float64 arrays can also be read
   *  as "float32". */
  type?: ScalarType;
  /** For cell data. If true (the default), read() returns an element for every cell; elements
   *  without values are NaN, or 0 for integers. If false, read() returns only the cells that have
   *  values. */
  fill?: boolean;
}

/** A selection of cells: the cells that meet all given conditions, with their vertices. */
export interface Selection {
  /** Selects the cells with the numbers first to end - 1. */
  cells?: [first: number, end: number];
  /** Selects the cells of the blocks with these indices. */
  blocks?: Iterable<number>;
  /** Selects the cells with these numbers. */
  numbers?: Iterable<number | bigint>;
  /** Selects cells with a vertex in this box: smallest x, y, z, then largest x, y, z. */
  box?: [number, number, number, number, number, number];
}

export interface Wanted extends LongRun {
  /** Whether to read coordinates, and in which type. true (the default): in the type of the
   *  file. */
  points?: boolean | "float32" | "float64";
  /** Whether to read the cells. Default: true. */
  cells?: boolean;
  arrays?: Iterable<WantedArray>;
  /** Whether to return `vertexNumbers` and `cellNumbers`: the numbers that the vertices and cells
   *  have in the whole mesh. Default: false. */
  numbers?: boolean;
  /** Cells to read, together with their vertices. The selected cells and vertices are renumbered
   *  from 0. Default: all cells and all vertices, even vertices that no cell uses. */
  select?: Selection;
}

/** Cells in the layout of VTK. The vertices of cell i are connectivity[offsets[i]] to
 *  connectivity[offsets[i + 1] - 1]. */
export interface Cells {
  readonly connectivity: Numbers;
  /** Offset in `connectivity` of the first vertex of each cell. Length: number of cells + 1. */
  readonly offsets: Numbers;
  /** For each cell: its type in VTK. */
  readonly types: Uint8Array;
  /** For each cell: the index of its block. */
  readonly blocks: Uint32Array;
}

export interface ReadArray {
  readonly index: number;
  readonly name: string;
  readonly location: ArrayLocation;
  readonly components: number;
  /** Time step of the values; null for static arrays. */
  readonly step: number | null;
  /** Values of all elements. Length: elements * components. The components of an element are
   *  adjacent. */
  readonly values: Values;
}

/** The data that read() returns. Each typed array has a separate buffer, which belongs to the
 *  caller. */
export interface Arrays {
  readonly vertexCount: number;
  readonly cellCount: number;
  /** Coordinates of the vertices. Length: 3 * number of vertices. */
  readonly points?: Float32Array | Float64Array;
  readonly cells?: Cells;
  /** The requested arrays, in the order of the request. */
  readonly arrays: ReadArray[];
  readonly vertexNumbers?: Numbers;
  readonly cellNumbers?: Numbers;
}

export interface WantedBoundary extends LongRun {
  /** Arrays whose values on the boundary are returned. */
  arrays?: Iterable<Pick<WantedArray, "index" | "name" | "location" | "step">>;
  /** Cells whose boundary is found. Default: all cells. */
  select?: Selection;
  /** Divides the sides of cells of higher order into flat faces at their nodes. Default: false. */
  subdivide?: boolean;
  /** Memory limit for the surface and the search for it, in bytes; 0: 4 GiB. */
  maxBytes?: number;
}

/** Boundary surface of a mesh. The points of face i are connectivity[offsets[i]] to
 *  connectivity[offsets[i + 1] - 1], in counter-clockwise order when seen from outside. A face can
 *  also be a line (2 points) or a vertex (1 point). */
export interface Boundary {
  readonly vertexCount: number;
  readonly faceCount: number;
  /** Number of cells missing from the surface because the faces of their cell type are not known,
   *  e.g. polyhedra. */
  readonly leftOut: number;
  /** Coordinates of the points that the faces use. Length: 3 * number of vertices. */
  readonly points: Float32Array | Float64Array;
  readonly connectivity: Uint32Array;
  /** Offset in `connectivity` of the first point of each face. Length: number of faces + 1. */
  readonly offsets: Numbers;
  /** For each point: its vertex number in the whole mesh. */
  readonly vertexNumbers: Numbers;
  /** For each face: the number of its cell in the whole mesh. */
  readonly cellNumbers: Numbers;
  /** For each face: the index of the block of its cell. */
  readonly blocks: Uint32Array;
  /** For each face: the side of its cell, numbered from 1 as in Exodus; 0 if the face is the cell
   *  itself. */
  readonly sides: Uint32Array;
  /** The requested arrays, in the order of the request, with one element per vertex or per face. */
  readonly arrays: ReadArray[];
}

export interface Segment {
  readonly firstCell: number;
  readonly cells: number;
  readonly firstVertex: number;
  readonly vertices: number;
  /** Size of the segment in the file, in bytes. */
  readonly bytes: number;
  /** Bounding box of the vertices: smallest x, y, z, then largest x, y, z. */
  readonly box: number[];
}

/** A named set of vertices, sides or cells. */
export interface MeshSet {
  readonly kind: "node" | "side" | "element";
  readonly id: number | bigint;
  readonly name: string;
  /** Numbers of the vertices (node sets) or of the cells (other sets) in the whole mesh. */
  readonly numbers: Numbers;
  /** For side sets: the side of each cell, numbered from 1 as in Exodus. null for other sets. */
  readonly sides: Int32Array | null;
  /** For element sets: indices of blocks whose cells all belong to the set; null if there are no
   *  such blocks. */
  readonly blocks: Uint32Array | null;
  /** Distribution factors; null if all are 1. */
  readonly factors: Float64Array | null;
}

/** An array of values with a key, for data that the other properties of a mesh do not cover. */
export interface Extra {
  readonly key: string;
  readonly refers: "nothing" | "vertices" | "cells";
  readonly shape: number[];
  readonly values: Values;
}

/** An open mesh. A caller may start a call before earlier calls have ended; the calls run one after
 *  the other. */
export interface Mesh {
  readonly vertexCount: number;
  readonly cellCount: number;
  readonly hexahedronCount: number;
  readonly stepCount: number;
  /** Digest of the mesh, its values and step times: 16 hexadecimal digits, the same for all files of
   *  a mesh with the same numbers. `null` if the file has no digests. */
  readonly digest: string | null;
  readonly segmentCount: number;
  readonly fileBytes: number;
  readonly coordinateType: "float32" | "float64";
  /** Error bound: largest possible difference between a coordinate and the original coordinate; 0:
   *  lossless. */
  readonly coordinateError: number;
  /** Order of vertices and cells. With "keep", they have the same numbers as in the source. */
  readonly order: "keep" | "stream" | "free";
  /** Format of the source, such as "exodus", "vtk" or "gmsh"; "" if unknown. */
  readonly sourceFormat: string;
  readonly blocks: Block[];
  readonly arrays: ArrayInfo[];
  /** The time of each step; empty if the file has no times. */
  readonly times: number[];

  /** Reads points, cells and arrays. Only the requested data is fetched and decoded. */
  read(wanted?: Wanted): Promise<Arrays>;
  /** Finds the boundary surface: the sides that belong to a single volume cell, and all cells of
   *  lower dimension. The search needs one pass over the cells. Memory grows with the active
   *  surface (the vertices that later cells still use) and the boundary. */
  boundary(wanted?: WantedBoundary): Promise<Boundary>;
  /** Returns the segments: runs of cells that can be decoded independently. */
  segments(run?: Run): Promise<Segment[]>;
  sets(run?: Run): Promise<MeshSet[]>;
  extras(run?: Run): Promise<Extra[]>;
  /** Decodes the whole file and discards the result. Rejects if any part of the file is invalid. */
  verify(run?: LongRun): Promise<void>;
  /** Closes the file. Pending calls are rejected; arrays that were read stay valid. */
  close(): Promise<void>;
}

/** An archive: a file that contains several files, its members. */
export interface Archive {
  /** Names of the members. */
  readonly members: string[];
  /** Opens the member with this name. The caller must close the returned Mesh. */
  open(name: string, run?: Run): Promise<Mesh>;
}
