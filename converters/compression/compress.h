// Compression: encodes a MeshSource with a shm::Writer, after vertex compaction.
//
// Makes two passes over the cells; one more if there is a delay buffer and arrays that cover only
// some blocks, and one more to try delay buffers on a sample. Memory follows the size of the active
// surface, not of the mesh. Order::free needs the whole mesh. It is kept in memory with its data if
// the spool's budget allows that, and otherwise in the spool; the resulting file is the same. See
// free_order.h.
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
  // Number of cells in the delay buffer; Order::free has none. If not set, Order::stream uses the
  // result of find_delay, except at Level::fast.
  std::optional<std::uint32_t> delay = 0;
  Level level = Level::standard;
  ConnectivityCodec connectivity = ConnectivityCodec::automatic;
  Lossy lossy;                      // arrays and coordinates that may be rounded; default: none
  std::uint64_t segment_cells = 0;  // cells per segment; 0: cuts follow the budget
  double restart_budget = .002;     // as in shm::WriteOptions
  // As in shm::WriteOptions. If not set: 1 for a mesh with one step, otherwise the default there.
  std::optional<std::uint32_t> key_steps;
  unsigned threads = 1;                 // as in shm::WriteOptions
  CodingOrder* coding_order = nullptr;  // also receives the coding order; borrowed, may be null
  // Order::free: use this order of cells instead of searching for one. Borrowed; lists each cell
  // once.
  const CellSequence* cell_order = nullptr;
  Progress progress;
};

// Returns the source's schema, changed as the options require: order, delay, whether the positions
// of corners must be kept, and the quantization of lossy values (which takes a pass over these
// values). No delay buffer is tried; the delay is 0 unless the options set one.
Schema schema_for(MeshSource& mesh, const CompressOptions& options);

// As schema_for, but with the delay that compress_mesh uses, which may be the result of a trial.
Schema schema_to_write(MeshSource& mesh, const CompressOptions& options, Spool& spool);
// Returns the options that compress_mesh passes to a Writer.
WriteOptions write_options_for(const MeshSource& mesh, const CompressOptions& options);

// Returns true if any data of the mesh depends on the position of corners within a cell: side sets,
// nodes on edges and faces, values per corner.
bool needs_corner_order(const MeshInfo& info);

// Writes the whole mesh to `sink`, which is not committed. In Order::free the cells are in the
// order that the options give, or in the one that gives the smallest known file (find_free_order).
SizeReport compress_mesh(MeshSource& mesh, ByteSink& sink, const CompressOptions& options,
                         Spool& spool);

// Estimates from a sample how many bytes the file would have in Order::free, given the `sizes` that
// it has with `options`. Returns nothing if there are too many cells for the memory.
std::optional<std::uint64_t> bytes_in_free_order(MeshSource& mesh, const CompressOptions& options,
                                                 const SizeReport& sizes, Spool& spool);

// Repeats the encoding of vertices and cells only, to get the coding order. `of` is the MeshInfo
// recorded in a .shm file; it gives the order, delay and segments.
void replay_coding_order(MeshSource& mesh, const MeshInfo& of, CodingOrder& out, Spool& spool);

}  // namespace shm::converters
