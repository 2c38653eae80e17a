/* shmformat.h: the C interface of libshmformat, the container for hexahedral meshes (.shm).

   Reading
     shmf_open_path, _memory, _source    a file, or anything that gives bytes from anywhere
     shmf_get_info, _block, _array ...   what it holds; no value is decoded
     shmf_select                         which cells: all (as after opening), or some of them
     shmf_read                           arrays into the caller's memory, all in one pass
     shmf_find_boundary, shmf_get_surface    the faces that one cell alone has, to be drawn
     shmf_verify                         whether all of it can be decoded
     shmf_close
   Reading a stream (pipe, socket, download) in memory that follows the active surface
     shmf_decoder_new, _feed, _next, _free
   Writing
     shmf_writer_path, _sink             to a file, or anything that takes bytes
     shmf_writer_append                  more time steps for a file that is there
     shmf_writer_block, _array           what the mesh is made of, then
     shmf_writer_mesh                    all of it at once, or
     shmf_writer_vertices, _cells        piece by piece, in memory that follows the surface
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
   - The prefix is shmf_, because shm_open() and SHM_INFO, SHM_LOCK ... are POSIX shared memory's.
   - Every function that can fail returns a shmf_status, 0 for success, and says why in `error`,
   which may be NULL. After a failure a handle can still be closed or freed; of memory for results
   nothing is known.
   - Structs begin with struct_size, which the caller sets to sizeof (of the header that he was
   compiled with). Later versions add members at the end; the library reads and writes no more than
   struct_size bytes, and takes what is missing as 0. 0 always means the default.
   - Numbers are 64 bit; indices count from 0. Values are in host byte order, packed, components of
   one element together. Cells have their nodes in VTK's order.
   - Strings are UTF-8 and end with 0; of names that have a 0 in them what stands before it.
   Pointers that a handle gives live as long as the handle, or as the call says.
   - Handles are independent. One handle is used by one thread at a time; any thread may do so.
     Functions of the caller, as progress(), may call nothing of the handle that calls them.
   - Every byte of a file is taken for hostile. Memory follows limits and the bytes that are there.
   - No function prints, exits, touches the locale, signals or the environment, or lets a C++
   exception out. Where memory runs out the status says so, and nothing leaks.
   - What stands here keeps source and binary compatibility within a major version of the library
   (its soname); functions, enumerators and struct members are added, never changed or removed.
   Until the format is 1.0 this is a promise that may still be renewed. */
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
/* 1000000 * major + 1000 * minor + patch: of this header; shmf_version() tells that of the library
 * that runs. */
#define SHMF_VERSION (1000000 * SHMF_VERSION_MAJOR + 1000 * SHMF_VERSION_MINOR + SHMF_VERSION_PATCH)
SHMF_API uint32_t shmf_version(void);
SHMF_API const char* shmf_version_string(void); /* "0.10.0" */

/* Frozen numbers; 1 to 7 are those of shm::ErrorCode. */
typedef enum shmf_status {
  SHMF_OK = 0,
  SHMF_IO = 1,          /* the system, or a callback, did not give the bytes */
  SHMF_TRUNCATED = 2,   /* the file ends before it should */
  SHMF_CORRUPT = 3,     /* the file contradicts itself or a checksum */
  SHMF_UNSUPPORTED = 4, /* valid, but needs something that this library does not know */
  SHMF_OVER_LIMIT = 5,  /* the file asks for more than shmf_open_options allow */
  SHMF_MISUSE = 6,      /* the caller broke the contract of a call */
  SHMF_OUTPUT = 7,      /* the output could not be written */
  SHMF_NO_MEMORY = 8,
  SHMF_CANCELLED = 9 /* progress() said so */
} shmf_status;
SHMF_API const char* shmf_status_name(int32_t status); /* "corrupt"; "unknown" for other numbers */

#define SHMF_NO_OFFSET UINT64_MAX

/* Why a call failed. Fixed size, no pointers: keep it on the stack, copy it. Long texts are cut
   between characters. A call that succeeds leaves it alone. */
typedef struct shmf_error {
  int32_t status; /* a shmf_status */
  int32_t reserved;
  uint64_t offset;   /* bytes from the start of the file, SHMF_NO_OFFSET where unknown */
  char section[120]; /* part of the file, e.g. "group 3, geometry" */
  char detail[360];  /* one sentence, without file and place */
  char message[528]; /* all of it for people: "run.shm: group 3, geometry, at byte 812: ..." */
} shmf_error;

/* ---- Words of the format (numbers are those of the file) ------------------------------------- */

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
SHMF_API size_t shmf_type_bytes(int32_t type); /* 1, 2, 4 or 8; 0 for no type */

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
      10, /* the vertices of all faces in turn; how many each face has is an extra of its source */
  SHMF_FACES = 11 /* a polyhedron, face by face, each face closed by its first vertex again */
} shmf_shape;
/* VTK's cell type of a shape with so many nodes: 12 for a hexahedron of 8, 25 of 20, 29 of 27 ...;
   2 (a poly-vertex) where VTK has none, 41 (a convex point set) for SHMF_POLYHEDRON, 42 for
   SHMF_FACES. */
SHMF_API int32_t shmf_vtk_cell_type(int32_t shape, uint32_t nodes);

enum { SHMF_POINT_DATA = 0, SHMF_CELL_DATA = 1 }; /* location of an array */
enum { SHMF_ORDER_KEEP = 0, SHMF_ORDER_STREAM = 1, SHMF_ORDER_FREE = 2 };
enum { SHMF_REFERS_TO_NOTHING = 0, SHMF_REFERS_TO_VERTICES = 1, SHMF_REFERS_TO_CELLS = 2 };
enum { SHMF_LEVEL_DEFAULT = 0, SHMF_LEVEL_FAST = 1, SHMF_LEVEL_BEST = 2 };
enum { SHMF_NODE_SET = 0, SHMF_SIDE_SET = 1, SHMF_ELEMENT_SET = 2 }; /* kind of a set */

/* ---- Opening --------------------------------------------------------------------------------- */

typedef struct shmf_file shmf_file;

/* How to open, and what a file may ask for; limits that are 0 are the library's (ReadLimits in
 * shm/reader.h). */
typedef struct shmf_open_options {
  size_t struct_size;
  /* Not 0: a damaged file, of which what is whole is wanted. Reads all of it once. Counts are then
     of what is left, cells and vertices that are lost are missing, values that are lost are NaN,
     integers 0. */
  int32_t damaged;
  uint32_t max_arrays, max_static_components, max_blocks, max_segments;
  uint64_t max_active_vertices, max_chunk_bytes, max_group_bytes, max_extra_bytes, max_steps;
  /* Since 0.10. Of what comes out there is no limit unless one is given; max_decoded_bytes is of
     streams in pieces. */
  uint64_t max_unpacked_bytes, max_column_bytes, max_vertices, max_cells, max_decoded_bytes;
  uint64_t max_active_bytes;
} shmf_open_options;

typedef struct shmf_range {
  uint64_t offset, bytes;
} shmf_range;

/* Bytes from anywhere: ranges of a URL, object stores, another container. Called in the thread of
   the call that needs them, one at a time, never for bytes beyond `bytes`. */
typedef struct shmf_source {
  size_t struct_size;
  void* context;
  uint64_t bytes; /* of the whole file */
  /* Fills `into` with the `count` bytes from `offset` on. Anything but 0 is a failure (SHMF_IO),
     and `why` may then be filled with a sentence, at most `why_bytes` with its 0. */
  int (*read_at)(void* context, uint64_t offset, void* into, uint64_t count, char* why,
                 size_t why_bytes);
  /* May be NULL; called once, by shmf_close() or where opening fails. */
  void (*close)(void* context);
  /* May be NULL. Ranges that read_at() will be asked for next, mostly in this order: told before,
     so that a source whose bytes are far away can fetch them together. They may not be asked for in
     the end. The list lives for the call. */
  void (*prefetch)(void* context, const shmf_range* ranges, size_t count);
} shmf_source;

/* Read the end of the file, its index and its schema: a line for each chunk of it, and no values.
   `options` may be NULL. On failure *file is NULL. */
SHMF_API shmf_status shmf_open_path(const char* path, const shmf_open_options* options,
                                    shmf_file** file, shmf_error* error);
/* `bytes` are borrowed until the file and all members opened from it are closed. */
SHMF_API shmf_status shmf_open_memory(const void* bytes, uint64_t count,
                                      const shmf_open_options* options, shmf_file** file,
                                      shmf_error* error);
/* The struct is copied. */
SHMF_API shmf_status shmf_open_source(const shmf_source* source, const shmf_open_options* options,
                                      shmf_file** file, shmf_error* error);
/* NULL is allowed. */
SHMF_API void shmf_close(shmf_file* file);

/* Archives hold several files: shmf_member_count() of them, 0 for a file that is none. Of an
   archive there is nothing but members; other calls are SHMF_MISUSE. It may be closed before its
   members. */
SHMF_API uint32_t shmf_member_count(const shmf_file* archive);
SHMF_API int32_t shmf_is_archive(const shmf_file* file); /* 1: it is one, perhaps of nothing */
SHMF_API const char* shmf_member_name(const shmf_file* archive,
                                      uint32_t member); /* NULL: none such */
SHMF_API shmf_status shmf_open_member(const shmf_file* archive, uint32_t member,
                                      const shmf_open_options* options, shmf_file** file,
                                      shmf_error* error);

/* ---- What a file holds ----------------------------------------------------------------------- */

typedef struct shmf_info {
  size_t struct_size;
  uint64_t vertices, cells, hexahedra; /* of a damaged file: that it had, as far as that is known */
  uint64_t steps;                      /* time steps: each array has values at some of them */
  uint64_t file_bytes;
  uint32_t blocks, arrays, segments;
  int32_t coordinate_type; /* a shmf_type: SHMF_FLOAT32 or SHMF_FLOAT64 */
  int32_t order;           /* SHMF_ORDER_KEEP: vertices and cells have the numbers that they had */
  int32_t reserved;
  const char* source_format; /* "exodus", "vtk", "gmsh", ..., or "" */
  double
      coordinate_error; /* 0: lossless; else the most that a coordinate differs from its source */
} shmf_info;
SHMF_API shmf_status shmf_get_info(const shmf_file* file, shmf_info* info, shmf_error* error);

typedef struct shmf_block {
  size_t struct_size;
  int64_t id; /* the source's own; need not be unique */
  const char* name;
  int32_t shape;           /* a shmf_shape */
  uint32_t nodes_per_cell; /* 0: varies */
  uint64_t cells;          /* a writer does not look at it */
} shmf_block;
SHMF_API shmf_status shmf_get_block(const shmf_file* file, uint32_t block, shmf_block* info,
                                    shmf_error* error);

typedef struct shmf_array {
  size_t struct_size;
  const char* name;
  const char* role; /* "" for data; else what the source calls it, e.g. "exodus:node_num_map" */
  int32_t location; /* SHMF_POINT_DATA or SHMF_CELL_DATA */
  int32_t type;     /* a shmf_type */
  uint32_t components;
  int32_t per_step;  /* 1: values at time steps; 0: at none */
  uint64_t elements; /* that have values: vertices, or cells of the blocks below; a writer does not
                        look at it */
  const uint32_t*
      blocks; /* cell data: indices of the blocks that have it, ascending; NULL: all have */
  uint32_t block_count;
  uint32_t reserved;
  double error; /* 0: lossless; else the most that a value differs from its source */
} shmf_array;
SHMF_API shmf_status shmf_get_array(const shmf_file* file, uint32_t array, shmf_array* info,
                                    shmf_error* error);
/* The first of that name and location, or -1. */
SHMF_API int64_t shmf_find_array(const shmf_file* file, int32_t location, const char* name);

/* Runs of cells that can be decoded alone. */
typedef struct shmf_segment {
  size_t struct_size;
  uint64_t first_cell, cells, first_vertex, vertices; /* in coding order */
  uint64_t bytes;                                     /* in the file */
  double box[6]; /* smallest x y z, largest x y z; +inf and -inf where it has no vertices */
} shmf_segment;
SHMF_API shmf_status shmf_get_segment(const shmf_file* file, uint32_t segment, shmf_segment* info,
                                      shmf_error* error);

/* Times of the steps, *count of them: none where the file does not say. */
SHMF_API shmf_status shmf_get_times(shmf_file* file, const double** times, uint64_t* count,
                                    shmf_error* error);
/* The steps at which an array has values, ascending; none of an array that is not per step. They
   live until the next call for this file. */
SHMF_API shmf_status shmf_get_steps(shmf_file* file, uint32_t array, const uint64_t** steps,
                                    uint64_t* count, shmf_error* error);

/* What the model has no word for, by key: "exodus/skeleton". */
typedef struct shmf_extra {
  size_t struct_size;
  const char* key;
  int32_t type;          /* a shmf_type */
  int32_t refers;        /* SHMF_REFERS_TO_...: what its integers are numbers of */
  const uint64_t* shape; /* row-major */
  const void* data;
  uint64_t bytes;
  uint32_t dimensions; /* of the shape */
  uint32_t reserved;
} shmf_extra;
/* The first call of either of these four reads all extras. */
SHMF_API shmf_status shmf_extra_count(shmf_file* file, uint64_t* count, shmf_error* error);
SHMF_API shmf_status shmf_get_extra(shmf_file* file, uint64_t extra, shmf_extra* info,
                                    shmf_error* error);

/* Named groups, whatever format they came from: sets of Exodus, physical groups of Gmsh. */
typedef struct shmf_set {
  size_t struct_size;
  int32_t kind; /* SHMF_NODE_SET, SHMF_SIDE_SET or SHMF_ELEMENT_SET */
  uint32_t block_count;
  int64_t id;
  const char* name; /* "" where it has none */
  uint64_t members;
  const uint64_t* numbers; /* vertices of node sets, cells of the others; of the whole mesh */
  const int32_t*
      sides; /* side sets: which side of each cell, from 1, as Exodus counts; else NULL */
  const uint32_t* blocks; /* element sets: all cells of these belong to it, too */
  uint64_t factor_count;
  const double* factors; /* distribution factors where they are not all 1 */
} shmf_set;
SHMF_API shmf_status shmf_set_count(shmf_file* file, uint64_t* count, shmf_error* error);
SHMF_API shmf_status shmf_get_set(shmf_file* file, uint64_t set, shmf_set* info, shmf_error* error);

/* ---- Whole arrays, of all or of some cells --------------------------------------------------- */

/* What runs long reports now and then, in the caller's thread, how much is done, from 0 to 1.
   Anything but 0 that it returns ends the call with SHMF_CANCELLED. NULL where no struct or no
   function is given. */
typedef struct shmf_run_options {
  size_t struct_size;
  int (*progress)(void* context, double done);
  void* context;
  /* That decode segments beside the caller's: 0, 1: none; SHMF_ALL_THREADS: one for each core. Time
     steps are decoded by the caller's. What comes back is the same for any number. */
  uint32_t threads;
  uint32_t reserved;
} shmf_run_options;
#define SHMF_ALL_THREADS UINT32_MAX

/* Cells that meet every condition that is there. */
typedef struct shmf_selection {
  size_t struct_size;
  uint64_t first_cell, end_cell; /* by number, end left out; 0, 0: no condition */
  const uint32_t* blocks;        /* indices, ascending; NULL: no condition */
  uint32_t block_count;
  int32_t has_box;
  double box[6];           /* smallest x y z, largest x y z: cells with a vertex in it */
  const uint64_t* numbers; /* the cells one by one, ascending; NULL: no condition */
  uint64_t number_count;
} shmf_selection;

typedef struct shmf_counts {
  size_t struct_size;
  uint64_t vertices, cells, corners;
} shmf_counts;

/* What shmf_read() gives from now on: the cells of the selection with their vertices; NULL is all,
   unused vertices, too. Pieces, cells of varying size and damaged files are counted by decoding
   their connectivity; all else the index knows. In a piece vertices and cells are numbered anew, in
   their old order; shmf_read() gives the old numbers if asked. `run` may be NULL. */
SHMF_API shmf_status shmf_select(shmf_file* file, const shmf_selection* selection,
                                 const shmf_run_options* run, shmf_counts* counts,
                                 shmf_error* error);

/* Numbers have an integer type of 32 or 64 bits. */
typedef enum shmf_what {
  SHMF_POINTS = 1,         /* 3 * vertices; SHMF_FLOAT32 or SHMF_FLOAT64, rounded or widened */
  SHMF_CORNERS = 2,        /* corners: numbers of vertices, cell after cell */
  SHMF_CORNER_BEGIN = 3,   /* cells + 1: numbers of corners, with which each cell begins */
  SHMF_CELL_BLOCKS = 4,    /* cells: index of the block; SHMF_UINT32 or SHMF_INT32 */
  SHMF_CELL_TYPES = 5,     /* cells: VTK's cell types; SHMF_UINT8 */
  SHMF_VERTEX_NUMBERS = 6, /* vertices: numbers in the whole mesh */
  SHMF_CELL_NUMBERS = 7,   /* cells: likewise */
  /* Of an array at a step (0 where it is not per step): elements * components, of its own type or,
     where that is SHMF_FLOAT64, of SHMF_FLOAT32. Of cell data, elements are those cells of the
     selection that have it, in their order; see SHMF_FILL. */
  SHMF_VALUES = 8
} shmf_what;

/* SHMF_VALUES of cell data: an element for each cell, NaN (integers: 0) where it has no values. */
enum { SHMF_FILL = 1 };

/* One array that is wanted. */
typedef struct shmf_target {
  size_t struct_size;
  int32_t what;   /* a shmf_what */
  int32_t type;   /* a shmf_type: what is to be in `data` */
  uint32_t array; /* SHMF_VALUES: its index */
  uint32_t flags; /* SHMF_FILL */
  uint64_t step;  /* SHMF_VALUES */
  void* data;     /* the caller's, aligned for its type; NULL: only `used` is wanted */
  uint64_t bytes; /* room; what is not needed is left alone, and less than needed is SHMF_MISUSE
                     before any is read */
  uint64_t used;  /* out, also where there is too little room: the bytes that it takes */
} shmf_target;

/* Fills all targets in one pass: ask for all that is wanted in one call. What nobody wants is
   neither fetched nor decoded; time steps are read without the mesh where they can be. Numbers that
   an integer type of 32 bits cannot hold are SHMF_MISUSE before any is read. `run` may be NULL. */
SHMF_API shmf_status shmf_read(shmf_file* file, shmf_target* targets, size_t count,
                               const shmf_run_options* run, shmf_error* error);

/* Decodes everything once and keeps nothing: SHMF_OK says that every checksum and every bitstream
   is good. Not for archives or damaged files. */
SHMF_API shmf_status shmf_verify(shmf_file* file, const shmf_run_options* run, shmf_error* error);

/* ---- The boundary surface -------------------------------------------------------------------- */

/* Sides of volume cells that one cell alone has, and all cells of fewer dimensions themselves. */
typedef struct shmf_boundary shmf_boundary;

typedef struct shmf_boundary_options {
  size_t struct_size;
  /* Indices of arrays whose values are carried along, and the step of each that is per step (NULL:
     0). */
  const uint32_t* arrays;
  const uint64_t* steps;
  size_t array_count;
  uint64_t max_bytes; /* what the surface, and the search for it, may take: more is SHMF_OVER_LIMIT;
                         0: 4 GiB */
} shmf_boundary_options;

/* Of the cells that shmf_select() was asked for, in one pass: memory follows the active surface and
   the boundary, of pieces and damaged files the piece. What of cells comes, and how degenerate ones
   count, is in shm/boundary_surface.h. An array without values at its step is SHMF_MISUSE.
   `options` and `run` may be NULL. On failure *boundary is NULL. It needs the file no more. */
SHMF_API shmf_status shmf_find_boundary(shmf_file* file, const shmf_boundary_options* options,
                                        const shmf_run_options* run, shmf_boundary** boundary,
                                        shmf_error* error);

/* Pointers live as long as the boundary. */
typedef struct shmf_surface {
  size_t struct_size;
  uint64_t vertices, faces, corners;
  uint64_t left_out; /* cells of which no face is known: SHMF_OTHER, SHMF_POLYHEDRON ... */
  const uint64_t* vertex_numbers; /* of the vertices that faces use: numbers in the whole mesh */
  const void* xyz;                /* 3 * vertices, of the coordinate type */
  const uint64_t* face_begin;     /* faces + 1: the corners with which each face begins */
  /* Indices of vertices, from 0, counter-clockwise seen from outside; 2 of a line, 1 of a point. */
  const uint32_t* face_corners;
  const uint64_t* cell_numbers; /* of the cell of each face, in the whole mesh */
  const uint32_t* cell_blocks;
  const uint32_t* sides; /* which side of its cell a face is, as in shmf_set; 0: the cell itself */
  /* Of options->arrays: an element for each vertex, or for each face (NaN, integers 0, where its
     cell has no values), of the array's own type. */
  const void* const* array_values;
  const uint64_t* array_bytes;
  int32_t coordinate_type; /* a shmf_type */
  int32_t reserved;
} shmf_surface;
SHMF_API shmf_status shmf_get_surface(const shmf_boundary* boundary, shmf_surface* surface,
                                      shmf_error* error);
/* NULL is allowed. */
SHMF_API void shmf_boundary_free(shmf_boundary* boundary);

/* ---- A stream, in pieces --------------------------------------------------------------------- */

typedef struct shmf_decoder shmf_decoder;

typedef enum shmf_item_kind {
  SHMF_NEED_INPUT = 0, /* feed more */
  SHMF_MESH = 1,
  SHMF_STEP = 2,
  SHMF_TIMES = 3,
  SHMF_EXTRA = 4,
  SHMF_END = 5 /* all has been given, and all of it was good */
} shmf_item_kind;

/* One thing of a stream: steps come behind the mesh, times and extras anywhere. Pointers live until
   the next call for this decoder. */
typedef struct shmf_item {
  size_t struct_size;
  int32_t kind;   /* a shmf_item_kind */
  uint32_t array; /* SHMF_STEP */
  /* SHMF_MESH: some vertices and cells in coding order. */
  uint64_t vertices, cells, first_vertex, first_cell;
  const uint64_t *vertex_numbers,
      *cell_numbers; /* as in the source where the order is kept; else as they come */
  const void* xyz;   /* of the coordinate type */
  const uint32_t* cell_blocks;
  const uint64_t* corner_begin;         /* cells + 1 */
  const uint64_t* corners;              /* vertex numbers */
  const uint64_t* last_use;             /* of each cell: bit i, no later cell uses corner i */
  const uint64_t* vertices_before_cell; /* of each cell: how many of these vertices it and cells
                                           before may use */
  const void* const* array_values;      /* by array; NULL where it has none here */
  const uint64_t* array_bytes;          /* likewise */
  /* SHMF_STEP: values of elements first_element ... of `array` at a step, in coding order. */
  uint64_t step, first_element;
  const void* values;
  uint64_t values_bytes;
  /* SHMF_TIMES */
  const double* times;
  uint64_t time_count;
  /* SHMF_EXTRA */
  const shmf_extra* extra;
} shmf_item;

/* options->damaged is SHMF_MISUSE. */
SHMF_API shmf_status shmf_decoder_new(const shmf_open_options* options, shmf_decoder** decoder,
                                      shmf_error* error);
/* Pieces of any size, copied. 0 bytes: there are no more. */
SHMF_API shmf_status shmf_decoder_feed(shmf_decoder* decoder, const void* bytes, uint64_t count,
                                       shmf_error* error);
SHMF_API shmf_status shmf_decoder_next(shmf_decoder* decoder, shmf_item* item, shmf_error* error);
/* What the stream says of itself before its first vertex: known from the first item on, SHMF_MISUSE
   before. Counts of cells, vertices and elements are 0. */
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
  int32_t order;           /* SHMF_ORDER_KEEP (0) ... */
  int32_t level;           /* SHMF_LEVEL_DEFAULT (0) ... */
  int32_t coordinate_type; /* SHMF_FLOAT64 (0 is the same) or SHMF_FLOAT32 */
  uint32_t threads; /* that encode segments beside the caller's: 0, 1: none; SHMF_ALL_THREADS: one
                       for each core. The file is the same for any number. */
  double coordinate_error;   /* 0: lossless; else the most that a coordinate may differ, above 0 */
  uint64_t segment_cells;    /* 0: segments begin where they cost little */
  const char* source_format; /* NULL: "" */
  int32_t
      replace; /* shmf_writer_path(): 1: instead of a file of that name; 0: that is SHMF_OUTPUT */
  uint32_t key_steps; /* of an array's steps one in so many refers to no other; 0: by the library,
                         1: all */
} shmf_write_options;

/* The file appears whole under its name when shmf_writer_finish() succeeds, or not at all.
   `options` may be NULL. On failure *writer is NULL. */
SHMF_API shmf_status shmf_writer_path(const char* path, const shmf_write_options* options,
                                      shmf_writer** writer, shmf_error* error);
/* `write` takes all bytes or returns anything but 0 (SHMF_OUTPUT). Front to back, never sought. */
SHMF_API shmf_status shmf_writer_sink(int (*write)(void* context, const void* bytes,
                                                   uint64_t count),
                                      void* context, const shmf_write_options* options,
                                      shmf_writer** writer, shmf_error* error);

/* More time steps for a file that is there, which stays as it is until shmf_writer_finish() puts
   the longer one in its place. What follows are shmf_writer_values(), _times() (of all steps, the
   old ones included) and _extra(). Of `options`, level and key_steps are looked at. */
SHMF_API shmf_status shmf_writer_append(const char* path, const shmf_write_options* options,
                                        shmf_writer** writer, shmf_error* error);

/* What the mesh is made of, before its first vertex. Strings and lists are copied; the first block
   has index 0, the first array, too. After the first failure of a writer's call all others fail for
   the same reason. */
SHMF_API shmf_status shmf_writer_block(shmf_writer* writer, const shmf_block* block,
                                       shmf_error* error);
SHMF_API shmf_status shmf_writer_array(shmf_writer* writer, const shmf_array* array,
                                       shmf_error* error);

/* All at once, from arrays as shmf_read() gives them: SHMF_POINTS of the coordinate type,
   SHMF_CORNERS, SHMF_CORNER_BEGIN (needed where the nodes of a block vary), SHMF_CELL_BLOCKS (left
   out: all of block 0), and SHMF_VALUES of each array that is not per step. `data` is only read,
   during the call, and `bytes` says how much there is. */
SHMF_API shmf_status shmf_writer_mesh(shmf_writer* writer, const shmf_target* arrays, size_t count,
                                      shmf_error* error);

/* Or piece by piece: a vertex before the first cell that uses it. `numbers` name the vertices in
   later calls; of the order keep they are those that readers see, and all from 0 on come. `values`:
   of each element its arrays that are not per step (cells: those of its block), packed, in order of
   the arrays; NULL where there are none. */
SHMF_API shmf_status shmf_writer_vertices(shmf_writer* writer, uint64_t count,
                                          const uint64_t* numbers, const void* xyz,
                                          const void* values, shmf_error* error);
/* Cells of one block, `nodes` corners each. `last_use`, of each cell: bit i, no later cell uses
   corner i; NULL: none is ever the last, and all vertices stay in memory on both sides. */
SHMF_API shmf_status shmf_writer_cells(shmf_writer* writer, uint64_t count, uint32_t block,
                                       uint32_t nodes, const uint64_t* corners,
                                       const uint64_t* last_use, const void* values,
                                       shmf_error* error);

/* After the mesh: an array at a step, all elements that have values, points by number, cells as
   they came. Steps of an array ascend. */
SHMF_API shmf_status shmf_writer_values(shmf_writer* writer, uint32_t array, uint64_t step,
                                        const void* values, uint64_t bytes, shmf_error* error);
/* Once, after the mesh. */
SHMF_API shmf_status shmf_writer_times(shmf_writer* writer, const double* times, uint64_t count,
                                       shmf_error* error);
/* After the mesh. Numbers of vertices and cells in them are those of the calls above: they are
   brought to what readers see. */
SHMF_API shmf_status shmf_writer_extra(shmf_writer* writer, const shmf_extra* extra,
                                       shmf_error* error);
/* All sets at once, once. `sets` is read as structs of sets->struct_size bytes each. */
SHMF_API shmf_status shmf_writer_sets(shmf_writer* writer, const shmf_set* sets, uint64_t count,
                                      shmf_error* error);
/* Writes index and totals, and gives the file its name. *bytes, where asked for: those of the file.
 */
SHMF_API shmf_status shmf_writer_finish(shmf_writer* writer, uint64_t* bytes, shmf_error* error);
/* Without finish before: nothing is left of the file. NULL is allowed. */
SHMF_API void shmf_writer_free(shmf_writer* writer);

#ifdef __cplusplus
}
#endif
#endif
