// Compression: any MeshSource through vertex compaction into a shm::Writer.
// Two passes over the cells (one more when there is a delay buffer and arrays on some blocks only,
// one more to try delay buffers on a sample);
// memory follows the active surface, not the mesh. Order::free looks at the whole mesh, and keeps
// it in memory with its data where the budget of the spool has room for that, else in the spool;
// the file is the same. See free_order.h.
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
  // Cells in the delay buffer; none in Order::free. Nothing: in Order::stream as find_delay finds,
  // but for Level::fast.
  std::optional<std::uint32_t> delay = 0;
  Level level = Level::standard;
  ConnectivityCodec connectivity = ConnectivityCodec::automatic;
  Lossy lossy;                      // what may come back rounded; nothing
  std::uint64_t segment_cells = 0;  // cells of a segment; 0: cuts follow the budget
  double restart_budget = .002;     // as in shm::WriteOptions
  // As in shm::WriteOptions; nothing: 1 of a mesh with one step, else as there.
  std::optional<std::uint32_t> key_steps;
  unsigned threads = 1;                 // as in shm::WriteOptions
  CodingOrder* coding_order = nullptr;  // also gets the coding order; borrowed, may be null
  // Order::free: the cells in this order, instead of a search for one; borrowed, each cell once.
  const CellSequence* cell_order = nullptr;
  Progress progress;
};

// The schema that the options make of a source's: order, delay, what corners must keep, what is
// rounded and how (a pass over those values). Nothing is tried: no delay buffer unless the options
// give one.
Schema schema_for(MeshSource& mesh, const CompressOptions& options);

// The same with the delay buffer that compress_mesh takes, which may be found by a trial.
Schema schema_to_write(MeshSource& mesh, const CompressOptions& options, Spool& spool);
// The options that compress_mesh gives a Writer.
WriteOptions write_options_for(const MeshSource& mesh, const CompressOptions& options);

// True when something in the mesh counts on the position of corners within a cell: side sets,
// nodes on edges and faces, values per corner.
bool needs_corner_order(const MeshInfo& info);

// Writes the whole mesh to `sink`, which is not committed. In Order::free the order of cells is the
// one that the options give, or the smallest that is known (find_free_order).
SizeReport compress_mesh(MeshSource& mesh, ByteSink& sink, const CompressOptions& options,
                         Spool& spool);

// About how many bytes the file would have in Order::free, where it has `sizes` with `options`;
// from a sample. Nothing when there are too many cells for the memory.
std::optional<std::uint64_t> bytes_in_free_order(MeshSource& mesh, const CompressOptions& options,
                                                 const SizeReport& sizes, Spool& spool);

// Only vertices and cells, for who wants the coding order; `of`, what a .shm file records of
// itself, gives order, delay and segments.
void replay_coding_order(MeshSource& mesh, const MeshInfo& of, CodingOrder& out, Spool& spool);

}  // namespace shm::converters
