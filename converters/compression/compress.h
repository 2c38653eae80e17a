// Compression: encodes a MeshSource with a shm::Writer, after vertex compaction.
//
// Makes two passes over the cells. A third pass is needed if there is a delay buffer and arrays
// that cover only some blocks, and another one to try delay buffers on a sample. Memory grows with
// the active surface, not with the mesh. Order::free needs the whole mesh: it is kept in memory
// with its data if the spool's budget allows that, and otherwise in the spool. The resulting file
// is the same in both cases. See free_order.h.
#pragma once

#include <cstdint>
#include <optional>

#include "base/progress.h"
#include "base/spool.h"
#include "mesh/lossy.h"
#include "mesh/mesh_source.h"
#include "order/cell_orders.h"
#include "shm/writer.h"

namespace shm::converters {

struct CompressOptions {
  Order order = Order::keep;
  // Number of cells in the delay buffer; Order::free has no delay buffer. If not set, Order::stream
  // uses the result of find_delay, except at Level::fast.
  std::optional<std::uint32_t> delay = 0;
  Level level = Level::standard;
  ConnectivityCodec connectivity = ConnectivityCodec::automatic;
  Lossy lossy;                      // arrays and coordinates that may be rounded; by default none
  std::uint64_t segment_cells = 0;  // number of cells per segment; 0: restart_budget decides
  double restart_budget = .002;  // maximum share of vertices stored twice, as in shm::WriteOptions

  // Largest distance between key steps, as in shm::WriteOptions. If not set: 1 for a mesh with one
  // step, otherwise the default of shm::WriteOptions.
  std::optional<std::uint32_t> key_steps;
  unsigned threads = 1;                 // number of threads, as in shm::WriteOptions
  CodingOrder* coding_order = nullptr;  // receives the coding order, too; borrowed, may be null

  // For Order::free: the order of cells to use instead of searching for one. Lists each cell once.
  // Borrowed; may be null.
  const CellSequence* cell_order = nullptr;
  Progress progress;
};

// Returns the source's schema with the changes that the options require: order, delay, whether the
// positions of corners must be kept, and the quantization of lossy values (which needs a pass over
// these values). Does not try delay buffers: the delay is 0 unless the options set one.
Schema schema_for(MeshSource& mesh, const CompressOptions& options);

// Returns the same schema as schema_for(), but with the delay that compress_mesh() uses, which may
// be the result of a trial.
Schema schema_to_write(MeshSource& mesh, const CompressOptions& options, Spool& spool);
// Returns the options that compress_mesh() passes to a Writer.
WriteOptions write_options_for(const MeshSource& mesh, const CompressOptions& options);

// Returns true if any data of the mesh depends on the position of corners within a cell: side sets,
// nodes on edges and faces, or values per corner.
bool needs_corner_order(const MeshInfo& info);

// Writes the whole mesh to `sink`, but does not commit the sink. In Order::free the cells are in
// the order that the options contain, or in the order that gives the smallest known file
// (find_free_order).
SizeReport compress_mesh(MeshSource& mesh, ByteSink& sink, const CompressOptions& options,
                         Spool& spool);

// Estimates from a sample the size in bytes that the file would have in Order::free. `sizes` are
// the sizes of the file with `options`. Returns nothing if there are too many cells for the memory.
std::optional<std::uint64_t> bytes_in_free_order(MeshSource& mesh, const CompressOptions& options,
                                                 const SizeReport& sizes, Spool& spool);

// Repeats the encoding of vertices and cells, without other data, to determine the coding order.
// `of` is the MeshInfo recorded in a .shm file; it contains the order, delay and segments.
void replay_coding_order(MeshSource& mesh, const MeshInfo& of, CodingOrder& out, Spool& spool);

}  // namespace shm::converters
