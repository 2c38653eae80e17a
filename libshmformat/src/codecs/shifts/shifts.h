// Shifts: codes a cell as the previous cell of its block plus a shift. A shift contains the amounts
// to add to the vertex numbers, and states which vertices are new, imported, or used for the last
// time. If vertices are numbered in rows and layers, shifts repeat. Each cell is then coded as one
// byte, which is the index of its shift in a table. zstd compresses these bytes.
//
// The encoder accepts cells with their vertex numbers, and returns a bitstream for each group.
// Encoder and decoder store the most recent cell of each block and a table of shifts, and update
// them in the same way.
// spec: "Shifts"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/binary.h"
#include "base/packing.h"
#include "shm/schema.h"

namespace shm {

/// Largest number of cells that the decoder decodes in one step.
inline constexpr std::size_t kShiftedCellsAtOnce = 64;

/// The properties of a cell other than its vertex numbers. Each bit mask is a set of node
/// positions; bit 0 represents the first node.
struct CellMarks {
  std::uint32_t block = 0;
  std::uint64_t introduced = 0;  ///< vertices that are new in the segment
  std::uint64_t imports = 0;   ///< those of the `introduced` vertices that an earlier segment owns
  std::uint64_t last_use = 0;  ///< vertices that no later cell uses
  bool operator==(const CellMarks&) const = default;
};

/// Largest number of nodes per cell in a segment coded as shifts. Frozen: part of the format.
inline constexpr std::uint32_t kMostShiftNodes = 64;

/// Largest number of components of a stepped array in a file that uses shifts. In these files, the
/// values of a time step are held in tables indexed by element number. The tables need memory for
/// all element numbers, even if an array has few elements. Frozen: part of the format.
inline constexpr std::uint32_t kMostShiftStepComponents = 32;

struct Shift {
  CellMarks marks;
  /// Amounts to add to the vertex numbers, modulo 2^64
  std::array<std::uint64_t, kMostShiftNodes> by{};
};

/// Returns true if cells of the schema can be coded as shifts: the schema has no delay buffer, each
/// block has a fixed number of nodes per cell, and no stepped array has more than
/// kMostShiftStepComponents components.
bool takes_shifts(const Schema& schema);

/// First import number. An import number is a temporary number of an imported vertex. The encoder
/// does not know the stream numbers of vertices that earlier segments own, so it numbers these
/// vertices from kFirstImport upwards. With Order::keep, the vertex numbers of the source mesh are
/// coded, and import numbers are not needed.
inline constexpr std::uint64_t kFirstImport = std::uint64_t{1} << 63;

/// The table of shifts, used by the encoder and the decoder. Precondition: takes_shifts(schema).
class ShiftTable {
 public:
  // A symbol below kPlaces is the index of a shift in the table. The symbol kNew means that the
  // cell has a new shift.
  static constexpr std::uint32_t kPlaces = 255;
  static constexpr std::uint8_t kNew = 255;

  explicit ShiftTable(const Schema& schema);

  std::uint32_t nodes(std::uint32_t block) const { return nodes_[block]; }
  /// Returns the largest number of nodes that a cell of any block has.
  std::size_t most_nodes() const { return most_nodes_; }
  /// Returns the vertex numbers of the most recent cell of the block. Before the first cell, all
  /// these numbers are 0.
  std::vector<std::uint64_t>& last(std::uint32_t block) {
    if (last_[block].empty()) last_[block].resize(nodes_[block]);
    return last_[block];
  }
  const Shift& at(std::size_t place) const { return shifts_[place]; }
  std::size_t size() const { return shifts_.size(); }
  /// Adds `shift` to the table, and returns its index. If the table is full, `shift` replaces the
  /// oldest shift.
  std::size_t add(const Shift& shift);
  std::size_t blocks() const { return nodes_.size(); }

 private:
  std::vector<std::uint32_t> nodes_;  // number of nodes per cell, by block
  std::size_t most_nodes_ = 0;
  std::vector<std::vector<std::uint64_t>> last_;
  std::vector<Shift> shifts_;
  std::size_t next_ = 0;
};

class ShiftEncoder {
 public:
  ShiftEncoder(const Schema& schema, bool may_import);

  void add_cell(const CellMarks& marks, std::span<const std::uint64_t> numbers);
  /// Adds a vertex that no cell uses. Call this function after adding the cells of the group.
  void add_unused(std::uint64_t number);
  /// Returns the bitstream of the current group as if the group ended now.
  std::vector<std::byte> packed(ZstdCompressor& zstd) const;
  /// Returns the bitstream of the group, and begins the next group.
  std::vector<std::byte> finish(ZstdCompressor& zstd);
  /// Returns the symbols of the group, one for each cell.
  std::span<const std::uint8_t> symbols() const { return symbols_; }

 private:
  std::size_t find(const Shift& shift, std::uint32_t nodes) const;
  void write(const Shift& shift, std::uint32_t nodes);

  ShiftTable table_;
  bool may_import_;
  std::vector<std::uint64_t> keys_;  // hash of each shift, by index in the table
  // For each shift in the table: the index of the shift that followed its most recent occurrence
  std::vector<std::uint8_t> followed_;
  std::size_t last_place_ = 0;
  Shift shift_;
  ByteWriter bytes_;  // new shifts, followed by unused vertices
  std::vector<std::uint8_t> symbols_;
  std::uint64_t last_unused_ = 0;
};

class ShiftDecoder {
 public:
  ShiftDecoder(const Schema& schema, bool may_import);

  /// Begins a group with `cells` cells. `limit`: largest unpacked size of the group in bytes.
  /// Returns false if the data is damaged.
  bool begin_group(std::span<const std::byte> bytes, std::uint32_t cells, std::uint64_t limit,
                   ZstdDecompressor& zstd);
  /// Decodes the next cells of the group that have the same shift. It decodes at least one cell and
  /// at most `most` cells. Precondition: `most` is above 0. Stores the vertex numbers of the cells
  /// in `numbers`, which must have space for `most` cells of any block. If the data is damaged, the
  /// returned `marks` is null.
  struct Cells {
    const CellMarks* marks;
    std::size_t count;
  };
  Cells next_cells(std::uint64_t* numbers, std::size_t most);
  std::uint32_t nodes(std::uint32_t block) const { return table_.nodes(block); }
  std::size_t most_nodes() const { return table_.most_nodes(); }
  /// Returns the number of the next unused vertex, or nothing if the data is damaged.
  std::optional<std::uint64_t> next_unused();
  /// Returns true if all data of the group has been read.
  bool at_end() const {
    return bytes_.ok() && bytes_.left() == 0 && next_symbol_ == symbols_.size();
  }

 private:
  const Shift* read_shift();

  ShiftTable table_;
  bool may_import_;
  Shift shift_;
  std::vector<std::byte> unpacked_;
  ByteReader bytes_{{}};
  std::span<const std::byte> symbols_;
  std::size_t next_symbol_ = 0;
  std::uint64_t last_unused_ = 0;
};

}  // namespace shm
