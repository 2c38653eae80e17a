/* shmformat.h: the C interface of libshmformat, the container for hexahedral meshes (.shm).

   Reading
     shmf_open_path, _memory, _source    open a file, or any source with random access
     shmf_get_info, _block, _array ...   describe the contents; no value is decoded
     shmf_select                         choose cells: all (the default), or some of them
     shmf_read                           fill the caller's arrays in one pass
     shmf_find_boundary, shmf_get_surface    find the boundary surface, e.g. for drawing
     shmf_verify                         check that the whole file can be decoded
     shmf_close
   Reading a stream (pipe, socket, download); memory grows with the active surface, not with the
   mesh
     shmf_decoder_new, _feed, _next, _free
   Writing
     shmf_writer_path, _sink             write to a file, or to the caller's function
     shmf_writer_append                  add time steps to an existing file
     shmf_writer_block, _array           declare the blocks and arrays of the mesh, then
     shmf_writer_mesh                    write the whole mesh in one call, or
     shmf_writer_vertices, _cells        piece by piece; memory grows with the active surface
     shmf_writer_values, _times, _extra, _sets, _commit,
         _finish, _free

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
   - Every function that can fail returns a shmf_status; SHMF_OK (0) means success. On failure, it
     also stores a description in `error`, unless `error` is NULL. After a failure, a handle can
     still be closed or freed. The contents of the memory for results are undefined after a failure.
   - Structs begin with struct_size, which the caller sets to the sizeof in its own version of this
     header. Later versions add members at the end. The library reads and writes at most struct_size
     bytes, and treats missing members as 0, which always means the default.
   - A vertex or cell is identified by its number, a 64-bit integer. Numbers and indices begin at 0.
     Values are in host byte order and packed; the components of an element are adjacent. The nodes
     of a cell are in VTK's order.
   - Strings are UTF-8 and end with a zero byte. If a name in a file contains a zero byte, the
     name ends at this byte. Pointers that a call returns are valid until the handle is closed or
   freed, unless the comment of the function says otherwise.
   - Handles are independent. Any thread may use a handle, but only one thread at a time. A callback
     such as progress() must not use the handle of the call that is running.
   - The library trusts no byte of a file. The limits and the true size of the file bound the memory
     that the library allocates.
   - No function prints, exits, throws C++ exceptions, or changes the locale, signals or the
     environment. If memory runs out, the returned status is SHMF_NO_MEMORY, and nothing leaks.
   - This header keeps source and binary compatibility within a major version of the library (its
     soname): functions, enumerators and struct members are added, never changed or removed. This
     promise may still be changed before the format reaches version 1.0. */
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
/* Version of this header, as one integer: 1000000 * major + 1000 * minor + patch. shmf_version()
   returns the version of the loaded library in the same form. */
#define SHMF_VERSION (1000000 * SHMF_VERSION_MAJOR + 1000 * SHMF_VERSION_MINOR + SHMF_VERSION_PATCH)
SHMF_API uint32_t shmf_version(void);
SHMF_API const char* shmf_version_string(void); /* Version of the loaded library, e.g. "0.10.0". */

/* Status of a call. The values never change; the values 1 to 7 are the same as in
   shm::ErrorCode. */
typedef enum shmf_status {
  SHMF_OK = 0,
  SHMF_IO = 1,          /* The system or a callback failed to deliver bytes. */
  SHMF_TRUNCATED = 2,   /* The file ends before it should. */
  SHMF_CORRUPT = 3,     /* The file contradicts itself or a checksum. */
  SHMF_UNSUPPORTED = 4, /* The file needs a feature that this library does not support. */
  SHMF_OVER_LIMIT = 5,  /* The file exceeds a limit in shmf_open_options. */
  SHMF_MISUSE = 6,      /* The caller violated the contract of a call. */
  SHMF_OUTPUT = 7,      /* The output could not be written. */
  SHMF_NO_MEMORY = 8,
  SHMF_CANCELLED = 9 /* The callback progress() did not return 0. */
} shmf_status;
/* Returns the name of a status, e.g. "corrupt", or "unknown" if no status has this number. */
SHMF_API const char* shmf_status_name(int32_t status);

#define SHMF_NO_OFFSET UINT64_MAX

/* The failure of a call. It has a fixed size and no pointers, so it can be kept on the stack and
   copied. Long texts are cut at a character boundary. A call that succeeds does not change it. */
typedef struct shmf_error {
  int32_t status; /* Status of the call, a shmf_status. */
  int32_t reserved;
  uint64_t offset;   /* Byte offset of the error in the file; SHMF_NO_OFFSET if unknown. */
  char section[120]; /* Part of the file that has the error, e.g. "group 3, geometry". */
  char detail[360];  /* Cause in one sentence, without the file name, section and offset. */
  /* File name, section, offset and detail in one line: "run.shm: group 3, geometry, at byte 812:
     ..." */
  char message[528];
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
/* Returns the size in bytes of a value of this type: 1, 2, 4 or 8. Returns 0 for an unknown
   type. */
SHMF_API size_t shmf_type_bytes(int32_t type);

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
  /* A polyhedron as a list of the vertices of its faces, face after face. The list does not contain
     the number of vertices of each face; these numbers are in an extra (see shmf_extra) that
     depends on the source format. */
  SHMF_POLYHEDRON = 10,
  /* A polyhedron as a list of the vertices of its faces, in which each face ends with its first
     vertex again. */
  SHMF_FACES = 11
} shmf_shape;

/* Meaning of the nodes of a cell that are not corners. */
typedef enum shmf_node_scheme {
  /* Nodes on the cell. This includes all cells of orders 1 and 2, except Bezier cells of order 2.
   */
  SHMF_LAGRANGE = 0,
  /* Nodes on the cell, of order 3 or higher, at corners and on edges only. */
  SHMF_SERENDIPITY = 1,
  /* Control points of order 2 or higher. The corners are on the cell, the others are not. */
  SHMF_BEZIER = 2
} shmf_node_scheme;

/* In the following functions, `shape` is a shmf_shape and `node_scheme` a shmf_node_scheme. */

/* Returns VTK's cell type for a shape with `nodes` nodes, e.g. 12, 25 or 29 for a hexahedron with
   8, 20 or 27 nodes, and 72 (Lagrange) for a hexahedron of order 3 to 10. Returns 2 (a poly-vertex)
   if VTK has no such cell, 41 (a convex point set) for SHMF_POLYHEDRON, and 42 for SHMF_FACES. */
SHMF_API int32_t shmf_vtk_cell_type(int32_t shape, uint32_t nodes, int32_t node_scheme);

/* Returns the order of the polynomials on a cell with `nodes` nodes, 1 to 10, or 0 if it is
   unknown. Hexahedra with 20 and with 27 nodes have order 2. */
SHMF_API uint32_t shmf_cell_order(int32_t shape, uint32_t nodes, int32_t node_scheme);

/* Returns the number of nodes of a cell of order `order`, 1 to 10, or 0 if no such cell exists. If
   `places` is not NULL, stores three bytes for each node in it: the steps of the node along the
   axes of the cell, each from 0 to `order`. At most 3993 bytes are stored. A cell of order 2 that
   lacks some nodes, e.g. a hexahedron with 20, has the first ones of these. The axes lead from
   corner 0 to corners 1, 2 and 3 of a tetrahedron or wedge, and to corners 1, 3 and 4 of a pyramid
   or hexahedron. The specification, section "Nodes of cells of higher order", explains the places.
 */
SHMF_API uint32_t shmf_node_places(int32_t shape, int32_t node_scheme, uint32_t order,
                                   uint8_t* places);

/* Locations of arrays: vertices, cells, the whole mesh, or members of sets. Arrays at the last four
   locations have time steps. */
enum {
  SHMF_POINT_DATA = 0,
  SHMF_CELL_DATA = 1,
  SHMF_GLOBAL_DATA = 2,
  SHMF_NODE_SET_DATA = 3,
  SHMF_SIDE_SET_DATA = 4,
  SHMF_ELEMENT_SET_DATA = 5
};
enum { SHMF_ORDER_KEEP = 0, SHMF_ORDER_STREAM = 1, SHMF_ORDER_FREE = 2 };
enum { SHMF_REFERS_TO_NOTHING = 0, SHMF_REFERS_TO_VERTICES = 1, SHMF_REFERS_TO_CELLS = 2 };
enum { SHMF_LEVEL_DEFAULT = 0, SHMF_LEVEL_FAST = 1, SHMF_LEVEL_BEST = 2 };
enum { SHMF_NODE_SET = 0, SHMF_SIDE_SET = 1, SHMF_ELEMENT_SET = 2 }; /* Kinds of sets. */

/* ---- Opening --------------------------------------------------------------------------------- */

typedef struct shmf_file shmf_file;

/* Options for opening a file, and limits on the memory and on the counts that reading the file may
   require. A limit of 0 means the library's default (ReadLimits in shm/limits.h). */
typedef struct shmf_open_options {
  size_t struct_size;
  /* If not 0, a damaged file is opened, so that its intact parts can be read. Opening then reads
     the whole file once. shmf_select() returns the counts of the intact parts. Lost cells and
     vertices are missing from the results; lost values are NaN, or 0 for integers. */
  int32_t damaged;
  uint32_t max_arrays, max_static_components, max_blocks, max_segments;
  uint64_t max_active_vertices, max_chunk_bytes, max_group_bytes, max_extra_bytes, max_steps;
  /* Limits added in version 0.10. By default, the size of the result is not limited.
     max_decoded_bytes applies only to a shmf_decoder. */
  uint64_t max_unpacked_bytes, max_column_bytes, max_vertices, max_cells, max_decoded_bytes;
  uint64_t max_active_bytes;
} shmf_open_options;

typedef struct shmf_range {
  uint64_t offset, bytes;
} shmf_range;

/* A source with random access that the caller implements, e.g. for a URL, an object store or a part
   of another file. A library call that needs bytes calls the functions of the source one at a time,
   in the thread of that call. The library never reads beyond `bytes`. */
typedef struct shmf_source {
  size_t struct_size;
  void* context;
  uint64_t bytes; /* Size of the whole file in bytes. */
  /* Reads the `count` bytes from `offset` on into `into`, and returns 0. If reading fails, the
     function returns another number, and may store the reason in `why`: a sentence of at most
     `why_bytes` bytes, including its terminating 0. The library call then fails with SHMF_IO. */
  int (*read_at)(void* context, uint64_t offset, void* into, uint64_t count, char* why,
                 size_t why_bytes);
  /* Releases the source. May be NULL. The library calls this function once: in shmf_close(), or
     when opening fails. */
  void (*close)(void* context);
  /* Announces the ranges that the library will probably read next, mostly in this order, so that a
     remote source can fetch several ranges together. May be NULL. Some of the ranges may never be
     read. `ranges` is valid only during this call. */
  void (*prefetch)(void* context, const shmf_range* ranges, size_t count);
} shmf_source;

/* Opens a file: reads the end of the file, the index (one entry per chunk) and the schema, but no
   values. `options` may be NULL. On failure *file is NULL. */
SHMF_API shmf_status shmf_open_path(const char* path, const shmf_open_options* options,
                                    shmf_file** file, shmf_error* error);
/* Opens a file in memory. The library does not copy `bytes`: the memory must stay valid until the
   file is closed and, for an archive, all members opened from it are closed. */
SHMF_API shmf_status shmf_open_memory(const void* bytes, uint64_t count,
                                      const shmf_open_options* options, shmf_file** file,
                                      shmf_error* error);
/* Opens a file that is read through the caller's functions in `*source`. The struct is copied. */
SHMF_API shmf_status shmf_open_source(const shmf_source* source, const shmf_open_options* options,
                                      shmf_file** file, shmf_error* error);
/* Closes a file. NULL is allowed. */
SHMF_API void shmf_close(shmf_file* file);

/* An archive contains several files, called members. Calls that read a mesh fail with SHMF_MISUSE
   for an archive: open a member instead. The archive may be closed before its members. */
/* Returns the number of members, or 0 if the file is not an archive. */
SHMF_API uint32_t shmf_member_count(const shmf_file* archive);
/* Returns 1 for an archive, even if it is empty, otherwise 0. */
SHMF_API int32_t shmf_is_archive(const shmf_file* file);
/* Returns the name of a member, or NULL if no such member exists. */
SHMF_API const char* shmf_member_name(const shmf_file* archive, uint32_t member);
SHMF_API shmf_status shmf_open_member(const shmf_file* archive, uint32_t member,
                                      const shmf_open_options* options, shmf_file** file,
                                      shmf_error* error);

/* ---- Contents of a file ---------------------------------------------------------------------- */

typedef struct shmf_info {
  size_t struct_size;
  /* Counts of the whole mesh. For a damaged file, these are the original counts, if they are
     known. */
  uint64_t vertices, cells, hexahedra;
  uint64_t steps; /* Number of time steps. An array may have values at only some of the steps. */
  uint64_t file_bytes;
  uint32_t blocks, arrays, segments;
  int32_t coordinate_type; /* Type of coordinates: SHMF_FLOAT32 or SHMF_FLOAT64. */
  /* Order of vertices and cells, a SHMF_ORDER_... value. SHMF_ORDER_KEEP: vertices and cells have
     the same numbers as in the source. */
  int32_t order;
  int32_t has_digest; /* 1 if the file has digests, otherwise 0. */
  /* Format from which the mesh was converted, e.g. "exodus", "vtk" or "gmsh"; "" if unknown. */
  const char* source_format;
  /* Error bound: largest possible difference between a coordinate and the original coordinate; 0:
     lossless. */
  double coordinate_error;
  /* Digest of the mesh, its values and step times. Files of a mesh with the same numbers, values
     and times have the same digest, however they are coded. 0 unless has_digest is set. */
  uint64_t digest;
} shmf_info;
SHMF_API shmf_status shmf_get_info(const shmf_file* file, shmf_info* info, shmf_error* error);

typedef struct shmf_block {
  size_t struct_size;
  int64_t id; /* Id of the block in the source; need not be unique. */
  const char* name;
  int32_t shape; /* Shape of the cells, a shmf_shape. */
  /* Number of nodes of each cell; 0: the number varies from cell to cell. */
  uint32_t nodes_per_cell;
  uint64_t cells; /* Number of cells. Writers ignore this member. */
  /* Meaning of the nodes that are not corners, a shmf_node_scheme. */
  int32_t node_scheme;
  int32_t reserved;
} shmf_block;
SHMF_API shmf_status shmf_get_block(const shmf_file* file, uint32_t block, shmf_block* info,
                                    shmf_error* error);

typedef struct shmf_array {
  size_t struct_size;
  const char* name;
  /* "" for an ordinary field. For an array with a special purpose in the source format, the name of
     this purpose, e.g. "exodus:node_num_map". */
  const char* role;
  int32_t location; /* SHMF_POINT_DATA, SHMF_CELL_DATA, ... */
  int32_t type;     /* Type of the values, a shmf_type. */
  uint32_t components;
  /* 1: the array has values at time steps (all, or some of them); 0: the array is static. */
  int32_t per_step;
  /* Number of elements with values: all vertices, the cells of `blocks`, or the members of the
     sets, set after set. Writers ignore this member for point and cell data. */
  uint64_t elements;
  /* For cell data: ascending indices of the blocks whose cells have values; NULL: all blocks. For
     data of sets: ascending numbers of the sets whose members have values; NULL: all sets of this
     kind. The sets of each kind are numbered from 0, in the order of shmf_get_set(). */
  const uint32_t* blocks;
  uint32_t block_count;
  uint32_t fill_count; /* Number of elements of `fills`. */
  /* Error bound: largest possible difference between a value and the original value; 0: lossless.
   */
  double error;
  /* Error bound relative to the value: largest possible difference between a value and the original
     value, divided by the magnitude of the original value; at most 0.5. 0: no such bound. Writers
     must not set both bounds. */
  double relative_error;
  /* Fill values, which mark missing values of a floating-point array: at most 16 finite
     numbers of the type of the array. They are restored exactly under every bound. NULL: none. */
  const double* fills;
} shmf_array;
SHMF_API shmf_status shmf_get_array(const shmf_file* file, uint32_t array, shmf_array* info,
                                    shmf_error* error);
/* Returns the index of the first array with this name and location, or -1. */
SHMF_API int64_t shmf_find_array(const shmf_file* file, int32_t location, const char* name);

/* A segment: a run of cells that can be decoded independently. */
typedef struct shmf_segment {
  size_t struct_size;
  /* Ranges of cells and vertices in the segment. Cells and vertices are numbered in the order in
     which the file stores them. */
  uint64_t first_cell, cells, first_vertex, vertices;
  uint64_t bytes; /* Size of the segment in the file, in bytes. */
  /* Bounding box: smallest x, y, z, then largest x, y, z; +inf and -inf if the segment has no
     vertices. */
  double box[6];
} shmf_segment;
SHMF_API shmf_status shmf_get_segment(const shmf_file* file, uint32_t segment, shmf_segment* info,
                                      shmf_error* error);

/* Returns the time of each step; *count is 0 if the file has no times. */
SHMF_API shmf_status shmf_get_times(shmf_file* file, const double** times, uint64_t* count,
                                    shmf_error* error);
/* Returns the time steps at which an array has values, ascending. *count is 0 if the array is
   static. The list is valid until the next call for this file. */
SHMF_API shmf_status shmf_get_steps(shmf_file* file, uint32_t array, const uint64_t** steps,
                                    uint64_t* count, shmf_error* error);

/* A typed value with a key such as "exodus/skeleton", for data that the mesh model does not
   cover. */
typedef struct shmf_extra {
  size_t struct_size;
  const char* key;
  int32_t type; /* Type of the values, a shmf_type. */
  /* SHMF_REFERS_TO_...: whether the values are vertex numbers, cell numbers or neither. */
  int32_t refers;
  const uint64_t* shape; /* Size of the array `data` in each dimension; row-major order. */
  const void* data;
  uint64_t bytes;
  uint32_t dimensions; /* Number of dimensions: number of entries of `shape`. */
  uint32_t reserved;
} shmf_extra;
/* The first call to shmf_extra_count(), shmf_get_extra(), shmf_set_count() or shmf_get_set() reads
   all extras of the file. */
SHMF_API shmf_status shmf_extra_count(shmf_file* file, uint64_t* count, shmf_error* error);
SHMF_API shmf_status shmf_get_extra(shmf_file* file, uint64_t extra, shmf_extra* info,
                                    shmf_error* error);

/* A named set of vertices, sides or cells, e.g. a node set of Exodus or a physical group of
   Gmsh. */
typedef struct shmf_set {
  size_t struct_size;
  int32_t kind; /* SHMF_NODE_SET, SHMF_SIDE_SET or SHMF_ELEMENT_SET. */
  uint32_t block_count;
  int64_t id;
  const char* name; /* Name of the set; "" if it has no name. */
  uint64_t members;
  /* The vertices of a node set, or the cells of any other set, by their numbers in the whole
     mesh. */
  const uint64_t* numbers;
  /* For a side set: the side of each cell, numbered from 1 as in Exodus. NULL for other sets. */
  const int32_t* sides;
  /* For an element set: indices of blocks whose cells all belong to the set, in addition to the
     cells in `numbers`. */
  const uint32_t* blocks;
  uint64_t factor_count;
  const double* factors; /* Distribution factors; NULL if all are 1. */
} shmf_set;
SHMF_API shmf_status shmf_set_count(shmf_file* file, uint64_t* count, shmf_error* error);
SHMF_API shmf_status shmf_get_set(shmf_file* file, uint64_t set, shmf_set* info, shmf_error* error);

/* ---- Whole arrays of all or of selected cells ------------------------------------------------ */

/* Options for calls that may take a long time. `progress`, unless NULL, is called regularly in the
   caller's thread. `done` is the completed fraction, 0 to 1. If progress() does not return 0, the
   call fails with SHMF_CANCELLED. */
typedef struct shmf_run_options {
  size_t struct_size;
  int (*progress)(void* context, double done);
  void* context;
  /* Number of threads that decode segments in addition to the caller's thread. 0 or 1: no
     additional thread; SHMF_ALL_THREADS: one thread per core. Time steps are always decoded in the
     caller's thread. Results do not depend on the number of threads. */
  uint32_t threads;
  uint32_t reserved;
} shmf_run_options;
#define SHMF_ALL_THREADS UINT32_MAX

/* A selection of cells: the cells that meet all of these conditions. */
typedef struct shmf_selection {
  size_t struct_size;
  /* The cell number is at least first_cell and less than end_cell. If both are 0, all cell numbers
     are allowed. */
  uint64_t first_cell, end_cell;
  /* The cell is in one of these blocks, given by ascending block indices. NULL: no condition. */
  const uint32_t* blocks;
  uint32_t block_count;
  int32_t has_box;
  /* If has_box is not 0: at least one vertex of the cell is in this box (smallest x, y, z, then
     largest x, y, z). */
  double box[6];
  const uint64_t* numbers; /* The cell number is in this ascending list. NULL: no condition. */
  uint64_t number_count;
} shmf_selection;

typedef struct shmf_counts {
  size_t struct_size;
  uint64_t vertices, cells, corners;
} shmf_counts;

/* Selects the cells that later calls to shmf_read() return, with their vertices, and returns the
   counts of the selected elements. If `selection` is NULL, all cells and all vertices are selected,
   even vertices that no cell uses. The counts usually come from the index. For selections, for
   blocks with a varying number of nodes, and for damaged files, the connectivity must be decoded to
   count the elements. The vertices and cells of a selection are renumbered from 0 without changing
   their order; shmf_read() returns their numbers in the whole mesh on request. `run` may be
     NULL. */
SHMF_API shmf_status shmf_select(shmf_file* file, const shmf_selection* selection,
                                 const shmf_run_options* run, shmf_counts* counts,
                                 shmf_error* error);

/* Contents of a shmf_target. Vertex numbers, cell numbers and offsets can be 32-bit or 64-bit
   integers. */
typedef enum shmf_what {
  /* 3 coordinates of each vertex, as SHMF_FLOAT32 or SHMF_FLOAT64; converted if the file contains
     the other type. */
  SHMF_POINTS = 1,
  /* Vertex numbers of the corners of the first cell, then of the second cell, and so on. */
  SHMF_CORNERS = 2,
  SHMF_CORNER_BEGIN = 3,   /* Offset of each cell's first corner; cells + 1 elements. */
  SHMF_CELL_BLOCKS = 4,    /* Block index of each cell; SHMF_UINT32 or SHMF_INT32. */
  SHMF_CELL_TYPES = 5,     /* VTK cell type of each cell; SHMF_UINT8. */
  SHMF_VERTEX_NUMBERS = 6, /* For each vertex: its number in the whole mesh. */
  SHMF_CELL_NUMBERS = 7,   /* For each cell: its number in the whole mesh. */
  /* Values of an array at a time step (step 0 if the array is static): elements * components values
     of the array's type. An array of SHMF_FLOAT64 can also be read as SHMF_FLOAT32. For cell data,
     the elements are the selected cells that have values, in the order of the cells; with
     SHMF_FILL, they are all selected cells. */
  SHMF_VALUES = 8
} shmf_what;

/* Flag for SHMF_VALUES of cell data: requests one element for every cell. Cells without values
   receive NaN, or 0 for integers. */
enum { SHMF_FILL = 1 };

/* One array that shmf_read() fills, or that shmf_writer_mesh() writes. */
typedef struct shmf_target {
  size_t struct_size;
  int32_t what;   /* Contents of the target, a shmf_what. */
  int32_t type;   /* Type of the elements of `data`, a shmf_type. */
  uint32_t array; /* For SHMF_VALUES: index of the array in the file. */
  uint32_t flags; /* Flags: 0 or SHMF_FILL. */
  uint64_t step;  /* For SHMF_VALUES: time step of the values; 0 for a static array. */
  /* The caller's memory, aligned for the type. If `data` is NULL, shmf_read() only sets `used`. */
  void* data;
  /* Size of `data` in bytes. Bytes after the required size are not changed. If `data` is too small,
     the call fails with SHMF_MISUSE before anything is read. */
  uint64_t bytes;
  uint64_t used; /* Receives the required size of `data` in bytes, even if `bytes` is too small. */
} shmf_target;

/* Fills all targets in one pass over the file. Request all arrays in a single call, because each
   call is a separate pass. Data that no target needs is neither fetched nor decoded; values at time
   steps are read without the mesh if possible. If a target has a 32-bit type and the vertex or cell
   numbers do not fit into it, the call fails with SHMF_MISUSE before anything is read. `run` may be
   NULL. */
SHMF_API shmf_status shmf_read(shmf_file* file, shmf_target* targets, size_t count,
                               const shmf_run_options* run, shmf_error* error);

/* Decodes the whole file once and discards the result. SHMF_OK means that every checksum and every
   bitstream is valid. The call fails with SHMF_MISUSE for an archive and for a file opened with
   options->damaged. */
SHMF_API shmf_status shmf_verify(shmf_file* file, const shmf_run_options* run, shmf_error* error);

/* ---- The boundary surface -------------------------------------------------------------------- */

/* A boundary surface. Its faces are the sides that belong to exactly one volume cell, and all cells
   of lower dimension. */
typedef struct shmf_boundary shmf_boundary;

typedef struct shmf_boundary_options {
  size_t struct_size;
  /* Indices of the arrays whose values are transferred to the surface. */
  const uint32_t* arrays;
  /* Time step for each array; ignored for static arrays. NULL: step 0 for all arrays. */
  const uint64_t* steps;
  size_t array_count;
  /* Memory limit in bytes for the surface and the search for it; 0: 4 GiB. If the limit is
     exceeded, the call fails with SHMF_OVER_LIMIT. */
  uint64_t max_bytes;
  /* 1: sides of cells of higher order are divided into flat faces at their nodes, e.g. to draw
     curved cells (BoundaryOptions::subdivide in shm/surface.h). 0: only corners are used. */
  uint32_t subdivide;
  uint32_t reserved;
} shmf_boundary_options;

/* Finds the boundary of the cells chosen by shmf_select(), in one pass. Memory grows with the
   active surface (the vertices that later cells still use) and the boundary. For selections and
   damaged files, memory grows with the size of the selection instead. shm/surface.h describes which
   sides of cells are part of the boundary, and how degenerate cells are treated. The call fails
   with SHMF_MISUSE if an array has no values at its step. `options` and `run` may be NULL. On
   failure *boundary is NULL. The result stays valid after the file is closed. */
SHMF_API shmf_status shmf_find_boundary(shmf_file* file, const shmf_boundary_options* options,
                                        const shmf_run_options* run, shmf_boundary** boundary,
                                        shmf_error* error);

/* Arrays of a boundary surface. The pointers are valid until shmf_boundary_free(). */
typedef struct shmf_surface {
  size_t struct_size;
  uint64_t vertices, faces, corners;
  /* Number of cells missing from the surface because the faces of their shape are not known
     (SHMF_OTHER, SHMF_POLYHEDRON ...). */
  uint64_t left_out;
  const uint64_t* vertex_numbers; /* For each vertex: its number in the whole mesh. */
  const void* xyz;                /* 3 coordinates of each vertex, of the coordinate type. */
  const uint64_t* face_begin;     /* Offset of each face's first corner; faces + 1 elements. */
  /* Vertex indices of each face, counter-clockwise as seen from outside. A line has 2 indices, a
     point has 1. */
  const uint32_t* face_corners;
  const uint64_t* cell_numbers; /* For each face: number of its cell in the whole mesh. */
  const uint32_t* cell_blocks;  /* For each face: index of the block of its cell. */
  /* For each face: the side of its cell, numbered from 1 as in Exodus; 0 if the face is the cell
     itself. */
  const uint32_t* sides;
  /* Values of the arrays in options->arrays, in the same order. Each list of values has the type of
     its array, and one element per vertex (point data) or per face (cell data). If the cell of a
     face has no values, the values of the face are NaN, or 0 for integers. */
  const void* const* array_values;
  const uint64_t* array_bytes;
  int32_t coordinate_type; /* Type of the coordinates, a shmf_type. */
  int32_t reserved;
} shmf_surface;
SHMF_API shmf_status shmf_get_surface(const shmf_boundary* boundary, shmf_surface* surface,
                                      shmf_error* error);
/* Frees a boundary. NULL is allowed. */
SHMF_API void shmf_boundary_free(shmf_boundary* boundary);

/* ---- Decoding a stream piece by piece -------------------------------------------------------- */

typedef struct shmf_decoder shmf_decoder;

typedef enum shmf_item_kind {
  SHMF_NEED_INPUT = 0, /* No item is available. Feed more bytes. */
  SHMF_MESH = 1,
  SHMF_STEP = 2,
  SHMF_TIMES = 3,
  SHMF_EXTRA = 4,
  SHMF_END = 5 /* All items have been returned, and the whole stream was valid. */
} shmf_item_kind;

/* One item of a stream. Items of kind SHMF_STEP come after all items of kind SHMF_MESH; times and
   extras can come anywhere. The pointers are valid until the next call for this decoder. */
typedef struct shmf_item {
  size_t struct_size;
  int32_t kind;   /* Kind of the item, a shmf_item_kind. */
  uint32_t array; /* For SHMF_STEP: index of the array. */
  /* For SHMF_MESH: a run of vertices and a run of cells, in the order of the stream. */
  uint64_t vertices, cells, first_vertex, first_cell;
  /* Numbers of the vertices and cells of this item. With SHMF_ORDER_KEEP, these are the numbers in
     the source. With other orders, vertices and cells are numbered in the order of the stream. */
  const uint64_t *vertex_numbers, *cell_numbers;
  const void* xyz; /* 3 coordinates of each vertex, of the coordinate type. */
  const uint32_t* cell_blocks;
  const uint64_t* corner_begin; /* Offset of each cell's first corner; cells + 1 elements. */
  const uint64_t* corners;      /* Vertex number of each corner. */
  /* For each cell: bit i is set if no later cell uses corner i. Corners from 64 on have no bits. */
  const uint64_t* last_use;
  /* For each cell: number of vertices of this item that precede the cell in the stream. The cell
     uses only these vertices and vertices of earlier items. */
  const uint64_t* vertices_before_cell;
  /* For each array of the file: its values for this item; NULL if it has none. */
  const void* const* array_values;
  const uint64_t* array_bytes; /* For each array of the file: size of its values in bytes. */
  /* For SHMF_STEP: values of `array` at time step `step`, from element first_element on. Elements
     are in the order of the stream. */
  uint64_t step, first_element;
  const void* values;
  uint64_t values_bytes;
  /* For SHMF_TIMES: the times of step `step` and of the steps after it. A file that was written
     with several commits has several such items. */
  const double* times;
  uint64_t time_count;
  /* For SHMF_EXTRA: the extra; otherwise NULL. */
  const shmf_extra* extra;
} shmf_item;

/* Makes a decoder. `options` may be NULL. If options->damaged is set, the call fails with
   SHMF_MISUSE. */
SHMF_API shmf_status shmf_decoder_new(const shmf_open_options* options, shmf_decoder** decoder,
                                      shmf_error* error);
/* Passes the next `count` bytes of the stream to the decoder, which copies them. A count of 0 means
   the end of the stream. */
SHMF_API shmf_status shmf_decoder_feed(shmf_decoder* decoder, const void* bytes, uint64_t count,
                                       shmf_error* error);
/* Stores the next item in *item. If the decoder needs more bytes first, the kind of the item is
   SHMF_NEED_INPUT. */
SHMF_API shmf_status shmf_decoder_next(shmf_decoder* decoder, shmf_item* item, shmf_error* error);
/* shmf_decoder_info(), _block() and _array() describe the mesh as declared at the start of the
   stream. A call before the first item fails with SHMF_MISUSE. The start of the stream does not
   contain the counts of cells, vertices and elements, so these are 0. */
SHMF_API shmf_status shmf_decoder_info(const shmf_decoder* decoder, shmf_info* info,
                                       shmf_error* error);
SHMF_API shmf_status shmf_decoder_block(const shmf_decoder* decoder, uint32_t block,
                                        shmf_block* info, shmf_error* error);
SHMF_API shmf_status shmf_decoder_array(const shmf_decoder* decoder, uint32_t array,
                                        shmf_array* info, shmf_error* error);
/* Frees a decoder. NULL is allowed. */
SHMF_API void shmf_decoder_free(shmf_decoder* decoder);

/* ---- Writing --------------------------------------------------------------------------------- */

typedef struct shmf_writer shmf_writer;

typedef struct shmf_write_options {
  size_t struct_size;
  int32_t order;           /* Order: SHMF_ORDER_KEEP (0), SHMF_ORDER_STREAM or SHMF_ORDER_FREE. */
  int32_t level;           /* Level: SHMF_LEVEL_DEFAULT (0), SHMF_LEVEL_FAST or SHMF_LEVEL_BEST. */
  int32_t coordinate_type; /* Type of coordinates: SHMF_FLOAT64 (also 0) or SHMF_FLOAT32. */
  /* Number of threads that encode segments in addition to the caller's thread. 0 or 1: no
     additional thread; SHMF_ALL_THREADS: one thread per core. The bytes of the file do not depend
     on the number of threads. */
  uint32_t threads;
  /* Largest allowed error of a coordinate, at least 0. 0: coordinates are lossless. */
  double coordinate_error;
  /* Number of cells per segment. 0: segments begin where few vertices are shared with earlier
     segments. */
  uint64_t segment_cells;
  const char* source_format; /* Format of the source of the mesh, e.g. "exodus". NULL means "". */
  /* 1: shmf_writer_path() may replace an existing file; 0: it fails with SHMF_OUTPUT if the file
     exists. */
  int32_t replace;
  /* Interval of key steps: any key_steps consecutive steps of an array include at least one key
     step, i.e. a step that can be decoded without other steps. 0: the library's default; 1: every
     step is a key step. */
  uint32_t key_steps;
  /* 1: readers may open the file while it is written. The file appears with the first
     shmf_writer_commit(), and keeps what has been committed whatever happens later. Not for
     shmf_writer_sink(). */
  int32_t live;
} shmf_write_options;

/* Makes a writer that writes a file. The file appears under its name only when it is complete, i.e.
   when shmf_writer_finish() succeeds. `options` may be NULL. On failure *writer is NULL. */
SHMF_API shmf_status shmf_writer_path(const char* path, const shmf_write_options* options,
                                      shmf_writer** writer, shmf_error* error);
/* Makes a writer that passes the bytes of the file, from the first to the last, to the function
   `write`. `write` must accept all bytes and return 0. If it returns another number, the library
   call fails with SHMF_OUTPUT. */
SHMF_API shmf_status shmf_writer_sink(int (*write)(void* context, const void* bytes,
                                                   uint64_t count),
                                      void* context, const shmf_write_options* options,
                                      shmf_writer** writer, shmf_error* error);

/* Makes a writer that adds time steps to an existing file. The file is unchanged until
   shmf_writer_finish() replaces it. Continue with shmf_writer_values(), shmf_writer_times() (with
   the times of all steps, including the existing steps) and shmf_writer_extra(). Only the members
   level, key_steps and live of `options` are used. If `live` is 1, the file itself grows: nothing
   is copied, data that was not committed is removed, and shmf_writer_commit() makes new steps
   readable. A run continues in this way after a crash. The file must have one name, no parity, and
   format version 0.10. */
SHMF_API shmf_status shmf_writer_append(const char* path, const shmf_write_options* options,
                                        shmf_writer** writer, shmf_error* error);

/* Declares a block or an array of the mesh. All blocks and arrays must be declared before the first
   vertex. Strings and lists are copied. The first declared block has index 0, the next block has
   index 1, and so on; the same holds for arrays. After the first failed call for a writer, all
   later calls for this writer fail with the same error. */
SHMF_API shmf_status shmf_writer_block(shmf_writer* writer, const shmf_block* block,
                                       shmf_error* error);
SHMF_API shmf_status shmf_writer_array(shmf_writer* writer, const shmf_array* array,
                                       shmf_error* error);

/* Writes the whole mesh in one call. The arrays have the same form as those that shmf_read() fills:
   SHMF_POINTS of the coordinate type, SHMF_CORNERS, SHMF_CORNER_BEGIN (required if a block has a
   varying number of nodes), SHMF_CELL_BLOCKS (without it, all cells belong to block 0), and
   SHMF_VALUES for each static array. `bytes` is the size of `data`. The library does not change
   `data`, and reads it only during the call. */
SHMF_API shmf_status shmf_writer_mesh(shmf_writer* writer, const shmf_target* arrays, size_t count,
                                      shmf_error* error);

/* Adds vertices. Instead of calling shmf_writer_mesh(), a caller can add vertices and cells piece
   by piece. Each vertex must be added before the first cell that uses it. `numbers` contains the
   number of each vertex, which identifies the vertex in later calls. With SHMF_ORDER_KEEP, readers
   see the same numbers; in this case, the numbers of a mesh with n vertices must be 0 to n - 1.
   `values` contains, for each vertex, one element of each static point array, packed, in the order
   of the arrays. It is NULL if the file has no static point arrays. */
SHMF_API shmf_status shmf_writer_vertices(shmf_writer* writer, uint64_t count,
                                          const uint64_t* numbers, const void* xyz,
                                          const void* values, shmf_error* error);
/* Adds cells of one block with `nodes` corners each. `last_use` has one integer per cell: bit i is
   set if no later cell uses corner i. Vertices that a cell has only at corners from 64 on stay in
   memory until the end of the mesh; shmf_writer_mesh() has no such limit. If `last_use` is NULL,
   the writer and all readers keep all vertices in memory until the end of the mesh. `values`
   contains, for each cell, one element of each static array that covers the block, packed, in the
   order of the arrays. */
SHMF_API shmf_status shmf_writer_cells(shmf_writer* writer, uint64_t count, uint32_t block,
                                       uint32_t nodes, const uint64_t* corners,
                                       const uint64_t* last_use, const void* values,
                                       shmf_error* error);

/* Writes the values of an array at a time step, after the mesh. Point data has one element per
   vertex, in ascending order of the vertex numbers. Cell data has one element per cell of the
   array's blocks, in the order in which the cells were added. Write the steps of an array in
   ascending order. */
SHMF_API shmf_status shmf_writer_values(shmf_writer* writer, uint32_t array, uint64_t step,
                                        const void* values, uint64_t bytes, shmf_error* error);
/* Writes the times of all steps so far, after the mesh. A later call must repeat the times of the
   earlier call, and may add the times of further steps. */
SHMF_API shmf_status shmf_writer_times(shmf_writer* writer, const double* times, uint64_t count,
                                       shmf_error* error);
/* Writes an extra, after the mesh. If its values are vertex or cell numbers, pass the same numbers
   as for the mesh: the vertex numbers that the caller passed with the vertices, and cell numbers
   from 0 in the order in which the cells were added. The library converts them to the numbers that
   readers see. */
SHMF_API shmf_status shmf_writer_extra(shmf_writer* writer, const shmf_extra* extra,
                                       shmf_error* error);
/* Writes all sets. Call this function at most once. `sets` is an array of `count` structs of
   sets->struct_size bytes each. */
SHMF_API shmf_status shmf_writer_sets(shmf_writer* writer, const shmf_set* sets, uint64_t count,
                                      shmf_error* error);
/* Makes everything written so far readable: the mesh, and all steps with their times. Call it after
   the mesh is complete, and after the last array of a step. Whatever happens later, the file keeps
   this state until the next commit. More steps, times and extras may follow. If the file is not
   live (shmf_write_options.live), fails with SHMF_MISUSE. */
SHMF_API shmf_status shmf_writer_commit(shmf_writer* writer, shmf_error* error);
/* Completes the file: writes the index and the totals, and makes the file visible under its name.
   Stores the size of the file in *bytes, unless `bytes` is NULL. */
SHMF_API shmf_status shmf_writer_finish(shmf_writer* writer, uint64_t* bytes, shmf_error* error);
/* Frees a writer. If shmf_writer_finish() has not succeeded, no file remains; a live file keeps
   what has been committed. NULL is allowed. */
SHMF_API void shmf_writer_free(shmf_writer* writer);

#ifdef __cplusplus
}
#endif
#endif
