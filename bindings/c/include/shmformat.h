/* shmformat.h: the C interface of libshmformat, the container for hexahedral meshes (.shm).

   Reading
     shmf_open_path, _memory, _source    open a file, or any source with random access
     shmf_get_info, _block, _array ...   describe the contents; no value is decoded
     shmf_select                         choose cells: all (the default), or some of them
     shmf_read                           fill arrays of the caller, all in one pass
     shmf_find_boundary, shmf_get_surface    find the boundary surface, e.g. for drawing
     shmf_verify                         check that the whole file can be decoded
     shmf_close
   Reading a stream (pipe, socket, download); memory follows the active surface
     shmf_decoder_new, _feed, _next, _free
   Writing
     shmf_writer_path, _sink             write to a file, or to a function of the caller
     shmf_writer_append                  add time steps to an existing file
     shmf_writer_block, _array           declare the blocks and arrays of the mesh, then
     shmf_writer_mesh                    write the whole mesh at once, or
     shmf_writer_vertices, _cells        piece by piece; memory follows the active surface
     shmf_writer_values, _times, _extra, _sets, _finish, _free

   Example: points and hexahedra of a file

     shmf_error why;
     shmf_file* file;
     shmf_counts n = {sizeof n};
     shmf_target want[2] = {{sizeof *want, SHMF_POINTS, SHMF_FLOAT64},
                            {sizeof *want, SHMF_CORNERS, SHMF_INT32}};
     if (shmf_open_path("run.shm", NULL, &file, &why) != SHMF_OK ||
         shmf_select(file, NULL, NULL, &n, &why) != SHMF_OK) {
       fprintf(stderr, "%s\n", why.message);
       return why.status;
     }
     want[0].bytes = n.vertices * 3 * sizeof(double);
     want[0].data = malloc(want[0].bytes);
     want[1].bytes = n.corners * sizeof(int32_t);
     want[1].data = malloc(want[1].bytes);
     if (shmf_read(file, want, 2, NULL, &why) != SHMF_OK) fprintf(stderr, "%s\n", why.message);
     shmf_close(file);

   Conventions
   - The prefix is shmf_, because shm_open(), SHM_INFO, SHM_LOCK ... belong to POSIX shared memory.
   - Every function that can fail returns a shmf_status, 0 for success, and describes a failure in
     `error`, which may be NULL. After a failure a handle can still be closed or freed; the contents
     of memory for results are then undefined.
   - Structs begin with struct_size, which the caller sets to sizeof (of its own header). Later
     versions add members at the end. The library reads and writes at most struct_size bytes, and
     takes missing members as 0. 0 always means the default.
   - Numbers are 64 bit; indices count from 0. Values are in host byte order, packed, with the
     components of an element together. Nodes of cells are in VTK's order.
   - Strings are UTF-8 and end with 0; names from a file are cut at the first 0 in them. Pointers
     returned by a handle are valid as long as the handle, unless the function says otherwise.
   - Handles are independent. A handle may be used by any thread, but by one at a time. Callbacks
     such as progress() must not use the handle that calls them.
   - The library treats every byte of a file as hostile. Memory follows the limits and the number
     of bytes that are really there.
   - No function prints, exits, touches the locale, signals or the environment, or throws C++
     exceptions. If memory runs out, the status says so, and nothing leaks.
   - This header keeps source and binary compatibility within a major version of the library (its
     soname): functions, enumerators and struct members are added, never changed or removed. Until
     the format is 1.0 this promise may still be changed. */
#ifndef SHMFORMAT_H
#define SHMFORMAT_H

#include <stddef.h>
#include <stdint.h>

#if defined(SHMF_STATIC)
#define SHMF_API
#elif defined(_WIN32) && defined(SHMF_BUILD)
#define SHMF_API __declspec(dllexport)
#elif defined(_WIN32)
#define SHMF_API __declspec(dllimport)
#elif defined(__GNUC__)
#define SHMF_API __attribute__((visibility("default")))
#else
#define SHMF_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Version and errors ---------------------------------------------------------------------- */

#define SHMF_VERSION_MAJOR 0
#define SHMF_VERSION_MINOR 10
#define SHMF_VERSION_PATCH 0
/* 1000000 * major + 1000 * minor + patch of this header; shmf_version() returns the number of the
   loaded library. */
#define SHMF_VERSION (1000000 * SHMF_VERSION_MAJOR + 1000 * SHMF_VERSION_MINOR + SHMF_VERSION_PATCH)
SHMF_API uint32_t shmf_version(void);
SHMF_API const char* shmf_version_string(void); /* "0.10.0" */

/* Frozen numbers; 1 to 7 are those of shm::ErrorCode. */
typedef enum shmf_status {
  SHMF_OK = 0,
  SHMF_IO = 1,          /* the system, or a callback, failed to deliver bytes */
  SHMF_TRUNCATED = 2,   /* the file ends before it should */
  SHMF_CORRUPT = 3,     /* the file contradicts itself or a checksum */
  SHMF_UNSUPPORTED = 4, /* valid, but needs something that this library does not know */
  SHMF_OVER_LIMIT = 5,  /* the file asks for more than shmf_open_options allow */
  SHMF_MISUSE = 6,      /* the caller broke the contract of a call */
  SHMF_OUTPUT = 7,      /* the output could not be written */
  SHMF_NO_MEMORY = 8,
  SHMF_CANCELLED = 9 /* progress() returned nonzero */
} shmf_status;
SHMF_API const char* shmf_status_name(int32_t status); /* "corrupt"; "unknown" for other numbers */

#define SHMF_NO_OFFSET UINT64_MAX

/* Why a call failed. Fixed size, no pointers: keep it on the stack, copy it. Long texts are cut
   at a character boundary. A call that succeeds does not change it. */
typedef struct shmf_error {
  int32_t status; /* a shmf_status */
  int32_t reserved;
  uint64_t offset;   /* bytes from the start of the file, or SHMF_NO_OFFSET if unknown */
  char section[120]; /* part of the file, e.g. "group 3, geometry" */
  char detail[360];  /* one sentence, without file and place */
  char message[528]; /* everything, for people: "run.shm: group 3, geometry, at byte 812: ..." */
} shmf_error;

/* ---- Constants of the format (the values in the file) ---------------------------------------- */

typedef enum shmf_type {
  SHMF_INT8 = 1,
  SHMF_UINT8 = 2,
  SHMF_INT16 = 3,
  SHMF_UINT16 = 4,
  SHMF_INT32 = 5,
  SHMF_UINT32 = 6,
  SHMF_INT64 = 7,
  SHMF_UINT64 = 8,
  SHMF_FLOAT32 = 9,
  SHMF_FLOAT64 = 10
} shmf_type;
SHMF_API size_t shmf_type_bytes(int32_t type); /* 1, 2, 4 or 8; 0 for an unknown type */

typedef enum shmf_shape {
  SHMF_OTHER = 0,
  SHMF_VERTEX = 1,
  SHMF_LINE = 2,
  SHMF_TRIANGLE = 3,
  SHMF_QUAD = 4,
  SHMF_POLYGON = 5,
  SHMF_TETRAHEDRON = 6,
  SHMF_PYRAMID = 7,
  SHMF_WEDGE = 8,
  SHMF_HEXAHEDRON = 9,
  SHMF_POLYHEDRON =
      10, /* the vertices of all faces in turn; an extra of the source format has the face sizes */
  SHMF_FACES = 11 /* a polyhedron, face by face; each face ends by repeating its first vertex */
} shmf_shape;
/* VTK's cell type of a shape with `nodes` nodes: 12, 25, 29 for hexahedra of 8, 20, 27 nodes, ...;
   2 (a poly-vertex) if VTK has no such cell, 41 (a convex point set) for SHMF_POLYHEDRON, 42 for
   SHMF_FACES. */
SHMF_API int32_t shmf_vtk_cell_type(int32_t shape, uint32_t nodes);

enum { SHMF_POINT_DATA = 0, SHMF_CELL_DATA = 1 }; /* location of an array */
enum { SHMF_ORDER_KEEP = 0, SHMF_ORDER_STREAM = 1, SHMF_ORDER_FREE = 2 };
enum { SHMF_REFERS_TO_NOTHING = 0, SHMF_REFERS_TO_VERTICES = 1, SHMF_REFERS_TO_CELLS = 2 };
enum { SHMF_LEVEL_DEFAULT = 0, SHMF_LEVEL_FAST = 1, SHMF_LEVEL_BEST = 2 };
enum { SHMF_NODE_SET = 0, SHMF_SIDE_SET = 1, SHMF_ELEMENT_SET = 2 }; /* kind of a set */

/* ---- Opening --------------------------------------------------------------------------------- */

typedef struct shmf_file shmf_file;

/* Options of opening, and limits on the demands of a file. A limit of 0 means the library's default
   (ReadLimits in shm/reader.h). */
typedef struct shmf_open_options {
  size_t struct_size;
  /* Not 0: opens a damaged file to read its intact parts; the whole file is read once. Counts then
     refer to the intact parts, lost cells and vertices are missing, and lost values are NaN, or 0
     for integers. */
  int32_t damaged;
  uint32_t max_arrays, max_static_components, max_blocks, max_segments;
  uint64_t max_active_vertices, max_chunk_bytes, max_group_bytes, max_extra_bytes, max_steps;
  /* Since 0.10. The size of the result is unlimited unless a limit is given. max_decoded_bytes
     applies to shmf_decoder. */
  uint64_t max_unpacked_bytes, max_column_bytes, max_vertices, max_cells, max_decoded_bytes;
  uint64_t max_active_bytes;
} shmf_open_options;

typedef struct shmf_range {
  uint64_t offset, bytes;
} shmf_range;

/* A source with random access: ranges of a URL, an object store, a part of another file. The
   library calls it in the thread of the call that needs the bytes, one call at a time, never for
   bytes beyond `bytes`. */
typedef struct shmf_source {
  size_t struct_size;
  void* context;
  uint64_t bytes; /* size of the whole file */
  /* Fills `into` with the `count` bytes from `offset` on and returns 0. Any other result is a
     failure (SHMF_IO); `why` may then receive a sentence of at most `why_bytes` bytes, including
     its terminating 0. */
  int (*read_at)(void* context, uint64_t offset, void* into, uint64_t count, char* why,
                 size_t why_bytes);
  /* May be NULL. Called once, by shmf_close() or when opening fails. */
  void (*close)(void* context);
  /* May be NULL. Announces the ranges that read_at() will be asked for next, mostly in this order,
     so that a remote source can fetch them together. Some of them may never be asked for. The list
     is valid during the call. */
  void (*prefetch)(void* context, const shmf_range* ranges, size_t count);
} shmf_source;

/* Opens a file: reads its end, its index (one entry per chunk) and its schema, but no values.
   `options` may be NULL. On failure *file is NULL. */
SHMF_API shmf_status shmf_open_path(const char* path, const shmf_open_options* options,
                                    shmf_file** file, shmf_error* error);
/* `bytes` is borrowed until the file and all members opened from it are closed. */
SHMF_API shmf_status shmf_open_memory(const void* bytes, uint64_t count,
                                      const shmf_open_options* options, shmf_file** file,
                                      shmf_error* error);
/* The struct is copied. */
SHMF_API shmf_status shmf_open_source(const shmf_source* source, const shmf_open_options* options,
                                      shmf_file** file, shmf_error* error);
/* NULL is allowed. */
SHMF_API void shmf_close(shmf_file* file);

/* Archives contain several files: shmf_member_count() returns their number, 0 for other files. Only
   the members of an archive can be accessed; other calls are SHMF_MISUSE. The archive may be closed
   before its members. */
SHMF_API uint32_t shmf_member_count(const shmf_file* archive);
SHMF_API int32_t shmf_is_archive(const shmf_file* file); /* 1: an archive, even if it is empty */
SHMF_API const char* shmf_member_name(const shmf_file* archive,
                                      uint32_t member); /* NULL if it does not exist */
SHMF_API shmf_status shmf_open_member(const shmf_file* archive, uint32_t member,
                                      const shmf_open_options* options, shmf_file** file,
                                      shmf_error* error);

/* ---- Contents of a file ---------------------------------------------------------------------- */

typedef struct shmf_info {
  size_t struct_size;
  uint64_t vertices, cells, hexahedra; /* of a damaged file: its original counts, if known */
  uint64_t steps;                      /* time steps: each array has values at some of them */
  uint64_t file_bytes;
  uint32_t blocks, arrays, segments;
  int32_t coordinate_type; /* a shmf_type: SHMF_FLOAT32 or SHMF_FLOAT64 */
  int32_t order;           /* SHMF_ORDER_KEEP: vertices and cells have their original numbers */
  int32_t reserved;
  const char* source_format; /* "exodus", "vtk", "gmsh", ..., or "" */
  double coordinate_error;   /* 0: lossless; otherwise the largest error of a coordinate */
} shmf_info;
SHMF_API shmf_status shmf_get_info(const shmf_file* file, shmf_info* info, shmf_error* error);

typedef struct shmf_block {
  size_t struct_size;
  int64_t id; /* number used by the source; need not be unique */
  const char* name;
  int32_t shape;           /* a shmf_shape */
  uint32_t nodes_per_cell; /* 0: varies from cell to cell */
  uint64_t cells;          /* a writer ignores it */
} shmf_block;
SHMF_API shmf_status shmf_get_block(const shmf_file* file, uint32_t block, shmf_block* info,
                                    shmf_error* error);

typedef struct shmf_array {
  size_t struct_size;
  const char* name;
  const char* role; /* "" for data; otherwise the source's name for it: "exodus:node_num_map" */
  int32_t location; /* SHMF_POINT_DATA or SHMF_CELL_DATA */
  int32_t type;     /* a shmf_type */
  uint32_t components;
  int32_t per_step;  /* 1: has values at time steps; 0: static */
  uint64_t elements; /* number of vertices, or of cells in the blocks below, with values; a writer
                        ignores it */
  const uint32_t*
      blocks; /* cell data: indices of the blocks with values, ascending; NULL: all blocks */
  uint32_t block_count;
  uint32_t reserved;
  double error; /* 0: lossless; otherwise the largest error of a value */
} shmf_array;
SHMF_API shmf_status shmf_get_array(const shmf_file* file, uint32_t array, shmf_array* info,
                                    shmf_error* error);
/* Returns the index of the first array of that name and location, or -1. */
SHMF_API int64_t shmf_find_array(const shmf_file* file, int32_t location, const char* name);

/* A segment: a run of cells that can be decoded independently. */
typedef struct shmf_segment {
  size_t struct_size;
  uint64_t first_cell, cells, first_vertex, vertices; /* in coding order */
  uint64_t bytes;                                     /* in the file */
  double box[6]; /* smallest x y z, largest x y z; +inf and -inf if it has no vertices */
} shmf_segment;
SHMF_API shmf_status shmf_get_segment(const shmf_file* file, uint32_t segment, shmf_segment* info,
                                      shmf_error* error);

/* Returns the times of the steps; *count is 0 if the file has none. */
SHMF_API shmf_status shmf_get_times(shmf_file* file, const double** times, uint64_t* count,
                                    shmf_error* error);
/* Returns the steps at which an array has values, ascending; none if the array is not per step. The
   list is valid until the next call for this file. */
SHMF_API shmf_status shmf_get_steps(shmf_file* file, uint32_t array, const uint64_t** steps,
                                    uint64_t* count, shmf_error* error);

/* Data that the mesh model does not cover, by key, e.g. "exodus/skeleton". */
typedef struct shmf_extra {
  size_t struct_size;
  const char* key;
  int32_t type;          /* a shmf_type */
  int32_t refers;        /* SHMF_REFERS_TO_...: the kind of numbers that it contains */
  const uint64_t* shape; /* row-major */
  const void* data;
  uint64_t bytes;
  uint32_t dimensions; /* number of entries of `shape` */
  uint32_t reserved;
} shmf_extra;
/* The first call of any of the following four functions reads all extras. */
SHMF_API shmf_status shmf_extra_count(shmf_file* file, uint64_t* count, shmf_error* error);
SHMF_API shmf_status shmf_get_extra(shmf_file* file, uint64_t extra, shmf_extra* info,
                                    shmf_error* error);

/* A named set, from any format: sets of Exodus, physical groups of Gmsh. */
typedef struct shmf_set {
  size_t struct_size;
  int32_t kind; /* SHMF_NODE_SET, SHMF_SIDE_SET or SHMF_ELEMENT_SET */
  uint32_t block_count;
  int64_t id;
  const char* name; /* "" if it has none */
  uint64_t members;
  const uint64_t* numbers; /* vertices of a node set, otherwise cells; numbers in the whole mesh */
  const int32_t* sides;    /* side sets: side of each cell, from 1, as in Exodus; otherwise NULL */
  const uint32_t* blocks;  /* element sets: all cells of these blocks belong to the set too */
  uint64_t factor_count;
  const double* factors; /* distribution factors, unless all are 1 */
} shmf_set;
SHMF_API shmf_status shmf_set_count(shmf_file* file, uint64_t* count, shmf_error* error);
SHMF_API shmf_status shmf_get_set(shmf_file* file, uint64_t set, shmf_set* info, shmf_error* error);

/* ---- Whole arrays, of all cells or of a selection -------------------------------------------- */

/* Options of calls that may take long. `progress` is called regularly, in the caller's thread, with
   the completed fraction, 0 to 1; if it returns nonzero, the call ends with SHMF_CANCELLED. It may
   be NULL, and so may the pointer to this struct. */
typedef struct shmf_run_options {
  size_t struct_size;
  int (*progress)(void* context, double done);
  void* context;
  /* Threads that decode segments in addition to the caller's. 0, 1: none; SHMF_ALL_THREADS: one per
     core. Time steps are decoded in the caller's thread. Results do not depend on it. */
  uint32_t threads;
  uint32_t reserved;
} shmf_run_options;
#define SHMF_ALL_THREADS UINT32_MAX

/* Selects the cells that meet every given condition. */
typedef struct shmf_selection {
  size_t struct_size;
  uint64_t first_cell, end_cell; /* numbers first_cell to end_cell - 1; 0, 0: no condition */
  const uint32_t* blocks;        /* indices, ascending; NULL: no condition */
  uint32_t block_count;
  int32_t has_box;
  double box[6];           /* smallest x y z, largest x y z: cells with a vertex in this box */
  const uint64_t* numbers; /* single cells, ascending; NULL: no condition */
  uint64_t number_count;
} shmf_selection;

typedef struct shmf_counts {
  size_t struct_size;
  uint64_t vertices, cells, corners;
} shmf_counts;

/* Chooses the cells that later calls of shmf_read() return, with their vertices. NULL selects all
   cells, and unused vertices too. The counts come from the index, except for selections, for cells
   of varying size and for damaged files, whose connectivity is decoded to count them. In a
   selection, vertices and cells are renumbered in their old order; shmf_read() returns the old
   numbers on request. `run` may be NULL. */
SHMF_API shmf_status shmf_select(shmf_file* file, const shmf_selection* selection,
                                 const shmf_run_options* run, shmf_counts* counts,
                                 shmf_error* error);

/* Contents of a target. Numbers have an integer type of 32 or 64 bits. */
typedef enum shmf_what {
  SHMF_POINTS = 1,         /* 3 * vertices; SHMF_FLOAT32 or SHMF_FLOAT64, converted if necessary */
  SHMF_CORNERS = 2,        /* corners: vertex numbers, cell after cell */
  SHMF_CORNER_BEGIN = 3,   /* cells + 1: offset of the first corner of each cell */
  SHMF_CELL_BLOCKS = 4,    /* cells: index of the block; SHMF_UINT32 or SHMF_INT32 */
  SHMF_CELL_TYPES = 5,     /* cells: VTK's cell types; SHMF_UINT8 */
  SHMF_VERTEX_NUMBERS = 6, /* vertices: numbers in the whole mesh */
  SHMF_CELL_NUMBERS = 7,   /* cells: numbers in the whole mesh */
  /* Values of an array at a step (0 if it is not per step): elements * components, of the array's
     type; arrays of SHMF_FLOAT64 may be read as SHMF_FLOAT32 too. For cell data, the elements are
     the selected cells that have values, in order; see SHMF_FILL. */
  SHMF_VALUES = 8
} shmf_what;

/* For SHMF_VALUES of cell data: one element per cell; NaN (integers: 0) if it has no values. */
enum { SHMF_FILL = 1 };

/* One array to be filled. */
typedef struct shmf_target {
  size_t struct_size;
  int32_t what;   /* a shmf_what */
  int32_t type;   /* a shmf_type: the type in `data` */
  uint32_t array; /* SHMF_VALUES: index of the array */
  uint32_t flags; /* SHMF_FILL */
  uint64_t step;  /* SHMF_VALUES */
  void* data;     /* memory of the caller, aligned for the type; NULL: only `used` is set */
  uint64_t bytes; /* size of `data`; excess bytes are not touched, and too small a size is
                     SHMF_MISUSE before anything is read */
  uint64_t used;  /* output, set even if `bytes` is too small: the number of bytes needed */
} shmf_target;

/* Fills all targets in one pass, so ask for everything in one call. Other data is neither fetched
   nor decoded; time steps are read without the mesh if possible. If numbers do not fit an integer
   type of 32 bits, the call fails with SHMF_MISUSE before anything is read. `run` may be NULL. */
SHMF_API shmf_status shmf_read(shmf_file* file, shmf_target* targets, size_t count,
                               const shmf_run_options* run, shmf_error* error);

/* Decodes the whole file once and discards the result: SHMF_OK means that every checksum and every
   bitstream is valid. Not for archives or files opened as damaged. */
SHMF_API shmf_status shmf_verify(shmf_file* file, const shmf_run_options* run, shmf_error* error);

/* ---- The boundary surface -------------------------------------------------------------------- */

/* The sides of volume cells that belong to exactly one cell, and all cells of lower dimension. */
typedef struct shmf_boundary shmf_boundary;

typedef struct shmf_boundary_options {
  size_t struct_size;
  /* Indices of arrays whose values are transferred to the surface, and for each the step if it is
     per step (NULL: 0). */
  const uint32_t* arrays;
  const uint64_t* steps;
  size_t array_count;
  uint64_t max_bytes; /* memory limit for the surface and the search; more is SHMF_OVER_LIMIT;
                         0: 4 GiB */
} shmf_boundary_options;

/* Finds the boundary of the cells chosen by shmf_select(), in one pass. Memory follows the active
   surface and the boundary; for selections and damaged files, the size of the selection. Which
   sides of cells are part of it, and how degenerate cells count, is described in
   shm/boundary_surface.h. An array without values at its step is SHMF_MISUSE. `options` and `run`
   may be NULL. On failure *boundary is NULL. The result stays valid after the file is closed. */
SHMF_API shmf_status shmf_find_boundary(shmf_file* file, const shmf_boundary_options* options,
                                        const shmf_run_options* run, shmf_boundary** boundary,
                                        shmf_error* error);

/* The pointers are valid as long as the boundary. */
typedef struct shmf_surface {
  size_t struct_size;
  uint64_t vertices, faces, corners;
  uint64_t left_out; /* cells whose faces are unknown: SHMF_OTHER, SHMF_POLYHEDRON ... */
  const uint64_t* vertex_numbers; /* vertices used by faces: their numbers in the whole mesh */
  const void* xyz;                /* 3 * vertices, of the coordinate type */
  const uint64_t* face_begin;     /* faces + 1: offset of the first corner of each face */
  /* Indices of vertices, counter-clockwise as seen from outside; a line has 2, a point 1. */
  const uint32_t* face_corners;
  const uint64_t* cell_numbers; /* cell of each face: its number in the whole mesh */
  const uint32_t* cell_blocks;
  const uint32_t* sides; /* side of its cell that a face is, as in shmf_set; 0: the cell itself */
  /* Values of options->arrays, of each array's own type: one element per vertex, or per face (NaN,
     or 0 for integers, if its cell has no values). */
  const void* const* array_values;
  const uint64_t* array_bytes;
  int32_t coordinate_type; /* a shmf_type */
  int32_t reserved;
} shmf_surface;
SHMF_API shmf_status shmf_get_surface(const shmf_boundary* boundary, shmf_surface* surface,
                                      shmf_error* error);
/* NULL is allowed. */
SHMF_API void shmf_boundary_free(shmf_boundary* boundary);

/* ---- Decoding a stream piece by piece -------------------------------------------------------- */

typedef struct shmf_decoder shmf_decoder;

typedef enum shmf_item_kind {
  SHMF_NEED_INPUT = 0, /* feed more */
  SHMF_MESH = 1,
  SHMF_STEP = 2,
  SHMF_TIMES = 3,
  SHMF_EXTRA = 4,
  SHMF_END = 5 /* everything has been returned, and everything was valid */
} shmf_item_kind;

/* One item of a stream: steps come after the mesh, times and extras at any place. The pointers are
   valid until the next call for this decoder. */
typedef struct shmf_item {
  size_t struct_size;
  int32_t kind;   /* a shmf_item_kind */
  uint32_t array; /* SHMF_STEP */
  /* SHMF_MESH: some vertices and cells in coding order. */
  uint64_t vertices, cells, first_vertex, first_cell;
  const uint64_t *vertex_numbers,
      *cell_numbers; /* order keep: as in the source; otherwise in the order of the stream */
  const void* xyz;   /* of the coordinate type */
  const uint32_t* cell_blocks;
  const uint64_t* corner_begin;         /* cells + 1 */
  const uint64_t* corners;              /* vertex numbers */
  const uint64_t* last_use;             /* for each cell: bit i, no later cell uses corner i */
  const uint64_t* vertices_before_cell; /* for each cell: how many vertices of this item precede it;
                                           it uses none of the following vertices */
  const void* const* array_values;      /* by array; NULL if it has no values here */
  const uint64_t* array_bytes;          /* by array */
  /* SHMF_STEP: values of `array` at `step`, from first_element on, in coding order. */
  uint64_t step, first_element;
  const void* values;
  uint64_t values_bytes;
  /* SHMF_TIMES */
  const double* times;
  uint64_t time_count;
  /* SHMF_EXTRA */
  const shmf_extra* extra;
} shmf_item;

/* `options` may be NULL. Setting options->damaged is SHMF_MISUSE. */
SHMF_API shmf_status shmf_decoder_new(const shmf_open_options* options, shmf_decoder** decoder,
                                      shmf_error* error);
/* Accepts pieces of any size and copies them. A count of 0 declares the end of the stream. */
SHMF_API shmf_status shmf_decoder_feed(shmf_decoder* decoder, const void* bytes, uint64_t count,
                                       shmf_error* error);
SHMF_API shmf_status shmf_decoder_next(shmf_decoder* decoder, shmf_item* item, shmf_error* error);
/* The description of the mesh at the start of the stream: available from the first item on, earlier
   calls are SHMF_MISUSE. Counts of cells, vertices and elements are 0. */
SHMF_API shmf_status shmf_decoder_info(const shmf_decoder* decoder, shmf_info* info,
                                       shmf_error* error);
SHMF_API shmf_status shmf_decoder_block(const shmf_decoder* decoder, uint32_t block,
                                        shmf_block* info, shmf_error* error);
SHMF_API shmf_status shmf_decoder_array(const shmf_decoder* decoder, uint32_t array,
                                        shmf_array* info, shmf_error* error);
/* NULL is allowed. */
SHMF_API void shmf_decoder_free(shmf_decoder* decoder);

/* ---- Writing --------------------------------------------------------------------------------- */

typedef struct shmf_writer shmf_writer;

typedef struct shmf_write_options {
  size_t struct_size;
  int32_t order;             /* SHMF_ORDER_KEEP (0) ... */
  int32_t level;             /* SHMF_LEVEL_DEFAULT (0) ... */
  int32_t coordinate_type;   /* SHMF_FLOAT64 (0 is the same) or SHMF_FLOAT32 */
  uint32_t threads;          /* that encode segments in addition to the caller's: 0, 1: none;
                                SHMF_ALL_THREADS: one per core. The file does not depend on it. */
  double coordinate_error;   /* 0: lossless; otherwise the allowed error of coordinates, above 0 */
  uint64_t segment_cells;    /* cells per segment; 0: segments begin where they cost little */
  const char* source_format; /* NULL: "" */
  int32_t replace; /* shmf_writer_path(): 1: replaces an existing file; 0: fails with SHMF_OUTPUT */
  uint32_t key_steps; /* at least one of this many steps of an array refers to no other step; 0: the
                         library's default, 1: all steps */
} shmf_write_options;

/* The file appears under its name, complete, when shmf_writer_finish() succeeds, or not at all.
   `options` may be NULL. On failure *writer is NULL. */
SHMF_API shmf_status shmf_writer_path(const char* path, const shmf_write_options* options,
                                      shmf_writer** writer, shmf_error* error);
/* `write` takes all bytes and returns 0; any other result is SHMF_OUTPUT. There is no seeking. */
SHMF_API shmf_status shmf_writer_sink(int (*write)(void* context, const void* bytes,
                                                   uint64_t count),
                                      void* context, const shmf_write_options* options,
                                      shmf_writer** writer, shmf_error* error);

/* Adds time steps to an existing file, which is unchanged until shmf_writer_finish() replaces it.
   Continue with shmf_writer_values(), _times() (the times of all steps, old steps included) and
   _extra(). Of `options`, only level and key_steps are used. */
SHMF_API shmf_status shmf_writer_append(const char* path, const shmf_write_options* options,
                                        shmf_writer** writer, shmf_error* error);

/* Declare the blocks and arrays of the mesh, before its first vertex. Strings and lists are copied.
   Blocks, and likewise arrays, are numbered from 0 in the order of the calls. After the first
   failed call of a writer all later calls fail for the same reason. */
SHMF_API shmf_status shmf_writer_block(shmf_writer* writer, const shmf_block* block,
                                       shmf_error* error);
SHMF_API shmf_status shmf_writer_array(shmf_writer* writer, const shmf_array* array,
                                       shmf_error* error);

/* Writes the whole mesh at once, from arrays as filled by shmf_read(): SHMF_POINTS of the
   coordinate type, SHMF_CORNERS, SHMF_CORNER_BEGIN (needed if the number of nodes in a block
   varies), SHMF_CELL_BLOCKS (if left out, all cells belong to block 0), and SHMF_VALUES of each
   array that is not per step. `data` is only read, during the call; `bytes` gives its size. */
SHMF_API shmf_status shmf_writer_mesh(shmf_writer* writer, const shmf_target* arrays, size_t count,
                                      shmf_error* error);

/* Alternatively piece by piece, each vertex before the first cell that uses it. `numbers` identify
   the vertices in later calls; in the order keep, readers see the same numbers, which must be 0 to
   n - 1. `values`: for each element the values of its arrays that are not per step (for cells:
   those of its block), packed, in order of the arrays; NULL if there are none. */
SHMF_API shmf_status shmf_writer_vertices(shmf_writer* writer, uint64_t count,
                                          const uint64_t* numbers, const void* xyz,
                                          const void* values, shmf_error* error);
/* Adds cells of one block, `nodes` corners each. `last_use`, for each cell: bit i, no later cell
   uses corner i; NULL: all vertices stay in memory to the end, in writer and readers. */
SHMF_API shmf_status shmf_writer_cells(shmf_writer* writer, uint64_t count, uint32_t block,
                                       uint32_t nodes, const uint64_t* corners,
                                       const uint64_t* last_use, const void* values,
                                       shmf_error* error);

/* After the mesh: writes an array at a step, with all elements that have values: vertices by
   number, cells in the order in which they were added. Steps of an array must ascend. */
SHMF_API shmf_status shmf_writer_values(shmf_writer* writer, uint32_t array, uint64_t step,
                                        const void* values, uint64_t bytes, shmf_error* error);
/* After the mesh, at most once. */
SHMF_API shmf_status shmf_writer_times(shmf_writer* writer, const double* times, uint64_t count,
                                       shmf_error* error);
/* After the mesh. References use the vertex and cell numbers of the calls above and are converted
   to the numbers that readers see. */
SHMF_API shmf_status shmf_writer_extra(shmf_writer* writer, const shmf_extra* extra,
                                       shmf_error* error);
/* Writes all sets; call it at most once. `sets` is read as structs of sets->struct_size bytes. */
SHMF_API shmf_status shmf_writer_sets(shmf_writer* writer, const shmf_set* sets, uint64_t count,
                                      shmf_error* error);
/* Writes index and totals, and gives the file its name. *bytes, if not NULL, receives its size. */
SHMF_API shmf_status shmf_writer_finish(shmf_writer* writer, uint64_t* bytes, shmf_error* error);
/* Without a successful shmf_writer_finish() nothing is left of the file. NULL is allowed. */
SHMF_API void shmf_writer_free(shmf_writer* writer);

#ifdef __cplusplus
}
#endif
#endif
