// StreamNumbers: stores the stream numbers of vertices that later segments may import, and encodes
// the numbers of the vertices that a group imports. The stream number of a vertex is its position
// among all vertices of the file in coding order. Several segments may be encoded at the same time,
// so the stream number is known only when the group that owns the vertex is complete. Until then, a
// ticket identifies the vertex. This class is not used in Order::keep, because groups then contain
// the caller's vertex numbers.
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
  /// Frees a ticket as soon as complete() has received the group with the last use of the vertex.
  /// `cell`: number, in coding order, of the last cell that uses the vertex. `cell` must not
  /// decrease from one call to the next.
  void end_ticket(std::uint32_t ticket, std::uint64_t cell) { ending_.emplace_back(cell, ticket); }

  // Vertices owned by segments before the encoded part of the mesh: call set_imported() before
  // complete()

  /// Returns a new ticket for an imported vertex: its owner is a segment that precedes the part of
  /// the mesh that is encoded.
  std::uint32_t new_imported() { return imported_.emplace_back(new_ticket()); }
  /// Returns the number of calls to new_imported().
  std::size_t imported() const { return imported_.size(); }
  /// Sets the stream numbers of the vertices for which new_imported() was called, in the order of
  /// these calls. Precondition: `numbers` has imported() entries.
  void set_imported(std::span<const std::uint64_t> numbers);

  /// Resets the coder of import numbers. Call it before the first group of each segment.
  void begin_segment() { column_ = {}; }
  /// Completes a group: adds the stream with the numbers of its imported vertices, and stores the
  /// numbers of the vertices that it owns. Call it for all groups in file order.
  void complete(EncodedGroup& group);

 private:
  void store_own(const EncodedGroup& group);
  std::vector<std::byte> code_imports(const EncodedGroup& group);

  std::vector<std::uint64_t> numbers_;  // by ticket
  std::vector<std::uint32_t> free_;
  // Tickets to be freed: the number of the last cell that uses the vertex, and the ticket.
  std::deque<std::pair<std::uint64_t, std::uint32_t>> ending_;
  // Tickets of the vertices owned by segments before the encoded part of the mesh.
  std::vector<std::uint32_t> imported_;
  NumberColumn<RangeEncoder> column_;
  RangeEncoder coder_;
};

}  // namespace shm
