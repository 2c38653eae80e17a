// StreamNumbers: the stream numbers of vertices that later segments may import, and the streams
// with which groups list the numbers of the vertices that they import. The stream number of a
// vertex is known when the group that owns the vertex is complete. Until then a ticket identifies
// the vertex, since other segments may be encoded at the same time. Not used in Order::keep, in
// which groups contain the caller's numbers.
// spec: "Imports"
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <utility>
#include <vector>

#include "codecs/shared/segment_encoder.h"
#include "codecs/surface/cells/number_column.h"
#include "entropy/range_coder.h"

namespace shm {

class StreamNumbers {
 public:
  std::uint32_t new_ticket();
  /// Frees a ticket once the group with cell `cell`, the last one that uses its vertex, has passed
  /// complete(). `cell` counts cells in coding order and ascends from call to call.
  void end_ticket(std::uint32_t ticket, std::uint64_t cell) { ending_.emplace_back(cell, ticket); }

  // Imports from before the part that is encoded: set_imported() must precede complete()

  /// Returns the ticket of a vertex that a segment before the part owns.
  std::uint32_t new_imported() { return imported_.emplace_back(new_ticket()); }
  /// Returns the number of calls of new_imported().
  std::size_t imported() const { return imported_.size(); }
  /// Sets the stream numbers of these vertices, in the order of new_imported(). There must be
  /// imported() numbers.
  void set_imported(std::span<const std::uint64_t> numbers);

  /// Call it before the first group of each segment.
  void begin_segment() { column_ = {}; }
  /// Adds a stream with the numbers of the vertices that the group imports, and stores the numbers
  /// of the vertices that it owns. Call it for all groups in file order.
  void complete(EncodedGroup& group);

 private:
  void store_own(const EncodedGroup& group);
  std::vector<std::byte> code_imports(const EncodedGroup& group);

  std::vector<std::uint64_t> numbers_;  // by ticket
  std::vector<std::uint32_t> free_;
  std::deque<std::pair<std::uint64_t, std::uint32_t>>
      ending_;  // for each ticket that ends: number of the cell with the last use, and the ticket
  std::vector<std::uint32_t> imported_;  // tickets of the vertices owned before the part
  NumberColumn<RangeEncoder> column_;
  RangeEncoder coder_;
};

}  // namespace shm
