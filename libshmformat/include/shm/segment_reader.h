// SegmentReader: reads one segment of a .shm file at a time, in any order. It reads only the bytes
// of the segment, the index and the schema. Distinct SegmentReaders are independent, so that
// several threads or processes can each read some segments of a file.
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

class SHM_API SegmentReader {
 public:
  /// Reads the index and the schema. `source` is borrowed and must outlive the SegmentReader.
  static Result<SegmentReader> open(RandomSource& source, const ReadLimits& limits = {});
  SegmentReader(SegmentReader&&) noexcept;
  SegmentReader& operator=(SegmentReader&&) noexcept;
  ~SegmentReader();

  const Schema& schema() const;
  const std::vector<SegmentInfo>& segments() const;
  /// Reads all of segment `index`: its cells and every vertex that these cells use.
  /// MeshBlock::imported marks vertices that an earlier segment owns; such a vertex has the same
  /// number and the same values in both segments. Only the last segment that uses a vertex
  /// finalizes it.
  Result<std::vector<MeshBlock>> read(std::size_t index);

 private:
  class Impl;
  explicit SegmentReader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace shm
