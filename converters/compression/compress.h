// Compresses a MeshSource to a .shm file with a shm::Writer, after vertex compaction.
//
// Reads the cells twice. If there is a delay buffer and an array that covers only some blocks,
// reads them once more. Trying delay buffers on a sample of the mesh needs another pass. Memory
// grows with the active surface (the vertices that later cells still need), not with the size of
// the mesh. Order::free needs the whole mesh at once: the mesh and its data are in memory if the
// memory budget allows that, and otherwise on disk, in the spool. The resulting file is the same in
// both cases. See free_order.h.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "accuracy/lossy.h"
#include "base/failure.h"
#include "base/progress.h"
#include "base/spool.h"
#include "mesh/mesh_source.h"
#include "mesh/vertex_compaction.h"
#include "order/cell_orders.h"
#include "shm/writer.h"

namespace shm::converters {

struct CompressOptions {
  Order order = Order::keep;
  // Number of cells in the delay buffer. Order::free has no delay buffer. If this option is not
  // set, Order::stream uses the result of find_delay(), or no delay buffer at Level::fast.
  std::optional<std::uint32_t> delay = 0;
  Level level = Level::standard;
  ConnectivityCodec connectivity = ConnectivityCodec::automatic;
  Lossy lossy;                      // arrays and coordinates that may be rounded, and their error
                                    // bounds; by default none
  std::uint64_t segment_cells = 0;  // number of cells per segment; 0: restart_budget decides
  double restart_budget = .002;     // maximum fraction of vertices that are stored twice, as in
                                    // shm::WriteOptions

  // Largest distance between key steps, as in shm::WriteOptions. If it is not set, a mesh with one
  // step uses 1, and any other mesh the default of shm::WriteOptions.
  std::optional<std::uint32_t> key_steps;
  bool digest = true;                   // true: the file has digests of its contents
  unsigned threads = 1;                 // number of threads, as in shm::WriteOptions
  CodingOrder* coding_order = nullptr;  // receives the coding order; borrowed, may be null

  // Order of cells for Order::free, which lists each cell once. If it is null, an order is searched
  // for. Borrowed.
  const CellSequence* cell_order = nullptr;
  Progress progress;
};

// Returns the source's schema with the changes that the options require: the order, the delay,
// whether the order of corners must be kept, and the quantization of lossy values (which needs a
// pass over these values). Does not search for a delay: the delay is 0 unless the options set it.
Schema schema_for(MeshSource& mesh, const CompressOptions& options);

// Returns the same schema as schema_for(), but with the delay (the size of the delay buffer) that
// compress_mesh() uses. If the options do not set the delay, this function may test delays on a
// sample of the mesh.
Schema schema_to_write(MeshSource& mesh, const CompressOptions& options, Spool& spool);
// Returns the options that compress_mesh() passes to a Writer.
WriteOptions write_options_for(const MeshSource& mesh, const CompressOptions& options);

// Returns true if any data of the mesh depends on the order of the corners of a cell. Such data are
// side sets, nodes on edges and faces, and values per corner.
bool needs_corner_order(const MeshInfo& info);

// Writes the whole mesh to `sink`, but does not commit the sink. In Order::free, cells are in the
// order `options.cell_order` if it is set, and otherwise in the order that find_free_order()
// expects to result in the smallest file.
SizeReport compress_mesh(MeshSource& mesh, ByteSink& sink, const CompressOptions& options,
                         Spool& spool);

// Estimates the size in bytes that the file would have in Order::free, from a sample of the mesh.
// `sizes` is the size report of the file that was written with `options`. Returns nothing if the
// mesh does not fit in memory.
std::optional<std::uint64_t> bytes_in_free_order(MeshSource& mesh, const CompressOptions& options,
                                                 const SizeReport& sizes, Spool& spool);

// Determines the coding order of a .shm file by encoding its source `mesh` again, but only the
// vertices and cells. `of` is the MeshInfo of the .shm file, which states the order, the delay and
// the segments.
void replay_coding_order(MeshSource& mesh, const MeshInfo& of, CodingOrder& out, Spool& spool);

// Returns the value in a library result. If the result contains an error instead, throws it as
// Failure. The error `misuse` is changed to `unsupported`, because its cause is the mesh and not
// the user.
template <class T>
T checked(Result<T> result) {
  if (!result && result.error().code == ErrorCode::misuse) {
    Error error = result.error();
    error.code = ErrorCode::unsupported;
    throw Failure(std::move(error));
  }
  return unwrap(std::move(result));
}

// A static array: its index in the schema, the size of one element in bytes (`stride`), and the
// number of elements read so far (`next`).
struct StaticArray {
  std::size_t index;
  std::size_t stride;
  std::vector<bool> covers;  // true for each block that the array covers; cell arrays only
  std::uint64_t next = 0;
  std::vector<std::byte> batch;  // values of those cells of the current batch that the array covers
};

inline std::vector<StaticArray> static_arrays(const MeshInfo& info, const Schema& schema,
                                              Location location) {
  std::vector<StaticArray> arrays;
  for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
    const ArrayInfo& array = schema.arrays[a];
    if (array.location != location || array.per_step) continue;
    StaticArray entry{a, info.array_stride(a), {}, 0, {}};
    if (location == Location::cell)
      for (std::uint32_t b = 0; b < schema.blocks.size(); ++b)
        entry.covers.push_back(schema.array_covers(a, b));
    arrays.push_back(std::move(entry));
  }
  return arrays;
}

// Passes the vertices and cells of a mesh, with their static data, to a Writer or PartWriter. `Out`
// is the type of this writer. A PartWriter receives only some cells of the mesh.
template <class Out>
class MeshFeeder : public CompactedMesh {
 public:
  // `schema` is the Writer's schema; its arrays must be those of the mesh, or it must have no
  // arrays.
  MeshFeeder(MeshSource& mesh, const Schema& schema, Out& writer, std::size_t cache_bytes)
      : mesh_(&mesh),
        writer_(&writer),
        point_arrays_(static_arrays(mesh.info(), schema, Location::point)),
        cell_arrays_(static_arrays(mesh.info(), schema, Location::cell)),
        xyz_bytes_(3 * scalar_bytes(mesh.info().schema.coordinate_type)),
        record_bytes_(xyz_bytes_ + data_bytes(point_arrays_)),
        records_(mesh.info().vertices, record_bytes_, cache_bytes,
                 [this](std::uint64_t first, std::uint64_t count, std::byte* out) {
                   fetch_records(first, count, out);
                 }) {}

  void begin_batch(const CellBatch& batch, std::uint64_t) override {
    for (StaticArray& array : cell_arrays_) {
      const auto covered = static_cast<std::uint64_t>(
          std::count_if(batch.blocks.begin(), batch.blocks.end(),
                        [&](std::uint32_t block) { return array.covers[block]; }));
      array.batch.resize(covered * array.stride);
      mesh_->read_array(array.index, 0, array.next, covered, array.batch.data());
      array.next += covered;
    }
    array_place_.assign(cell_arrays_.size(), 0);
  }

  void vertex(std::uint64_t number, std::uint64_t last_cell) override {
    const Record record = record_of(number);
    checked(last_cell == kNeverUsed ? writer_->add_unused_vertex(number, record.xyz, record.data)
                                    : writer_->add_vertex(number, record.xyz, record.data));
  }
  // Passes an imported vertex, i.e. a vertex that a cell of an earlier part uses, to the writer.
  // The writer must be a PartWriter.
  void imported_vertex(std::uint64_t number) {
    const Record record = record_of(number);
    checked(writer_->add_imported_vertex(number, record.xyz, record.data));
  }
  // Skips the data of the first `block_cells[b]` cells of each block b. The first batch begins
  // after these cells.
  void skip_cells(const std::vector<std::uint64_t>& block_cells) {
    for (StaticArray& array : cell_arrays_)
      for (std::size_t b = 0; b < block_cells.size(); ++b)
        if (array.covers[b]) array.next += block_cells[b];
  }

  void cell(const CellBatch& batch, std::size_t index, std::uint64_t last_use,
            std::span<const std::uint64_t> other_last_uses) override {
    const std::uint32_t block = batch.blocks[index];
    cell_data_.clear();
    for (std::size_t a = 0; a < cell_arrays_.size(); ++a) {
      const StaticArray& array = cell_arrays_[a];
      if (!array.covers[block]) continue;
      const std::byte* value = array.batch.data() + array_place_[a];
      cell_data_.insert(cell_data_.end(), value, value + array.stride);
      array_place_[a] += array.stride;
    }
    checked(writer_->add_cell(block, batch.cell(index), last_use, cell_data_, other_last_uses));
  }

 private:
  // A view of the record of a vertex (its coordinates and its values in static arrays), valid until
  // the next call to record_of().
  struct Record {
    std::span<const std::byte> xyz, data;
  };
  Record record_of(std::uint64_t number) {
    const std::byte* record = records_[number];
    return {{record, xyz_bytes_}, {record + xyz_bytes_, record_bytes_ - xyz_bytes_}};
  }
  static std::size_t data_bytes(const std::vector<StaticArray>& arrays) {
    std::size_t sum = 0;
    for (const StaticArray& array : arrays) sum += array.stride;
    return sum;
  }

  // Fetches the records of `count` vertices. A record consists of the coordinates of a vertex,
  // followed by its values in each static array, without padding.
  void fetch_records(std::uint64_t first, std::uint64_t count, std::byte* out) {
    if (point_arrays_.empty()) return mesh_->read_points(first, count, out);
    column_.resize(count * record_bytes_);
    mesh_->read_points(first, count, column_.data());
    scatter_column(count, xyz_bytes_, out);
    std::byte* place = out + xyz_bytes_;
    for (const StaticArray& array : point_arrays_) {
      mesh_->read_array(array.index, 0, first, count, column_.data());
      scatter_column(count, array.stride, place);
      place += array.stride;
    }
  }
  void scatter_column(std::uint64_t count, std::size_t bytes, std::byte* out) const {
    for (std::uint64_t i = 0; i < count; ++i)
      std::memcpy(out + i * record_bytes_, column_.data() + i * bytes, bytes);
  }

  MeshSource* mesh_;
  Out* writer_;
  std::vector<StaticArray> point_arrays_, cell_arrays_;
  std::size_t xyz_bytes_, record_bytes_;
  PageCache records_;
  std::vector<std::byte> column_, cell_data_;
  // Offset of the next unread byte in the batch of each cell array.
  std::vector<std::size_t> array_place_;
};

}  // namespace shm::converters
