// Shifts: cells as differences. A shift is the difference of a cell from the one before it of its
// block: what is added to its vertex numbers, and which of its vertices are new, imported, and used
// for the last time. Shifts repeat where numbers run in rows and layers; a cell is then one byte,
// its place in a table of shifts, and bytes go to zstd.
//
// in:    cells, with numbers                     out: a bitstream for each group
// keeps: the last cell of each block, a table of shifts; changed alike in both directions
// spec: "Shifts"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bytes/binary.h"
#include "bytes/packing.h"
#include "shm/schema.h"

namespace shm {

/// Cells that are looked at together.
inline constexpr std::size_t kShiftedCellsAtOnce = 64;

/// A cell, but for its vertex numbers. Positions are bits.
struct CellMarks {
  std::uint32_t block = 0;
  std::uint64_t introduced = 0;  ///< vertices that no cell of the segment used before
  std::uint64_t imports = 0;     ///< of these, those that an earlier segment owns
  std::uint64_t last_use = 0;    ///< vertices that no later cell uses
  bool operator==(const CellMarks&) const = default;
};

/// Most nodes of a cell in shifts. Frozen: part of the format.
inline constexpr std::uint32_t kMostShiftNodes = 64;

/// Most components of a stepped array beside them: values over shifts are kept by number, and take
/// room where there are few. Frozen: part of the format.
inline constexpr std::uint32_t kMostShiftStepComponents = 32;

struct Shift {
  CellMarks marks;
  std::array<std::uint64_t, kMostShiftNodes> by{};  ///< what is added to the numbers, modulo 2^64
};

/// Whether cells of the schema can be in shifts: no delay, blocks of as many nodes each, no stepped
/// array of many components.
bool takes_shifts(const Schema& schema);

/// Where vertices are numbered as they are introduced, shifts run over stream numbers; vertices
/// that earlier segments own, whose numbers an encoder does not know, count from here on.
inline constexpr std::uint64_t kFirstImport = std::uint64_t{1} << 63;

/// What both directions keep. For schemas that shifts take.
class ShiftTable {
 public:
  // A symbol below kPlaces is the place of a shift in the table; kNew: a new one comes.
  static constexpr std::uint32_t kPlaces = 255;
  static constexpr std::uint8_t kNew = 255;

  explicit ShiftTable(const Schema& schema);

  std::uint32_t nodes(std::uint32_t block) const { return nodes_[block]; }
  /// Of a cell of any block.
  std::size_t most_nodes() const { return most_nodes_; }
  /// The numbers of the last cell of the block; zeros at first.
  std::vector<std::uint64_t>& last(std::uint32_t block) {
    if (last_[block].empty()) last_[block].resize(nodes_[block]);
    return last_[block];
  }
  const Shift& at(std::size_t place) const { return shifts_[place]; }
  std::size_t size() const { return shifts_.size(); }
  /// Takes the place of the oldest, which it returns.
  std::size_t add(const Shift& shift);
  std::size_t blocks() const { return nodes_.size(); }

 private:
  std::vector<std::uint32_t> nodes_;  // by block
  std::size_t most_nodes_ = 0;
  std::vector<std::vector<std::uint64_t>> last_;
  std::vector<Shift> shifts_;
  std::size_t next_ = 0;
};

class ShiftEncoder {
 public:
  ShiftEncoder(const Schema& schema, bool may_import);

  void add_cell(const CellMarks& marks, std::span<const std::uint64_t> numbers);
  /// A vertex that no cell uses; after the cells of the group.
  void add_unused(std::uint64_t number);
  /// The group's bitstream so far.
  std::vector<std::byte> packed(ZstdCompressor& zstd) const;
  /// The group's bitstream; the next group begins.
  std::vector<std::byte> finish(ZstdCompressor& zstd);
  /// The symbol of each cell of the group.
  std::span<const std::uint8_t> symbols() const { return symbols_; }

 private:
  std::size_t find(const Shift& shift, std::uint32_t nodes) const;
  void write(const Shift& shift, std::uint32_t nodes);

  ShiftTable table_;
  bool may_import_;
  std::vector<std::uint64_t> keys_;     // of each place
  std::vector<std::uint8_t> followed_;  // by place: what came after it the last time
  std::size_t last_place_ = 0;
  Shift shift_;
  ByteWriter bytes_;  // new shifts, then unused vertices
  std::vector<std::uint8_t> symbols_;
  std::uint64_t last_unused_ = 0;
};

class ShiftDecoder {
 public:
  ShiftDecoder(const Schema& schema, bool may_import);

  /// `bytes` of a group with so many cells; may unpack to `limit` bytes. False for damaged data.
  bool begin_group(std::span<const std::byte> bytes, std::uint32_t cells, std::uint64_t limit,
                   ZstdDecompressor& zstd);
  /// The next cells of the group that have one shift: at least one, at most `most`, which is
  /// above 0; null for damaged data. Their numbers go to `numbers`, which has room for those of any
  /// block.
  struct Cells {
    const CellMarks* marks;
    std::size_t count;
  };
  Cells next_cells(std::uint64_t* numbers, std::size_t most);
  std::uint32_t nodes(std::uint32_t block) const { return table_.nodes(block); }
  std::size_t most_nodes() const { return table_.most_nodes(); }
  /// A vertex that no cell uses; nothing for damaged data.
  std::optional<std::uint64_t> next_unused();
  /// Whether the group was used up, no more and no less.
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
