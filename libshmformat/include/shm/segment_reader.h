// SegmentReader: one segment of a .shm file at a time, in any order; reads its bytes, the index and
// the schema, and no others. Distinct SegmentReaders are independent, so threads or processes can
// share a file out among them.
// spec: "Segments", "Index and trailer"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "shm/io.h"
#include "shm/reader.h"
#include "shm/schema.h"

namespace shm {

/// What the index says of a segment. It is believed until the segment is read, which must be so.
struct SegmentInfo {
  std::uint64_t first_cell = 0, cells = 0;       ///< in coding order
  std::uint64_t first_vertex = 0, vertices = 0;  ///< that it owns; stream numbers
  std::uint64_t bytes = 0;                       ///< of its groups in the file
  /// Smallest x y z and largest x y z of its vertices, imported ones too; +inf -inf if none.
  std::array<double, 6> box{};
};

class SHM_API SegmentReader {
 public:
  /// Reads index and schema. `source` is borrowed and must outlive the SegmentReader.
  static Result<SegmentReader> open(RandomSource& source, const ReadLimits& limits = {});
  SegmentReader(SegmentReader&&) noexcept;
  SegmentReader& operator=(SegmentReader&&) noexcept;
  ~SegmentReader();

  const Schema& schema() const;
  const std::vector<SegmentInfo>& segments() const;
  /// All of segment `index`: its cells and every vertex that they use. Vertices that an earlier
  /// segment owns are marked in MeshBlock::imported; their numbers and values are those that they
  /// have there. A vertex is finalized only by the last segment that uses it.
  Result<std::vector<MeshBlock>> read(std::size_t index);

 private:
  class Impl;
  explicit SegmentReader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace shm
