// StepReader: reads one stepped array at one step, without the rest of the file. The StepReader
// reads the index, the schema, and the chunks of that array's steps, from the most recent key step
// up to the requested step. It reads the connectivity of the mesh only if values are predicted from
// it or if element numbers are requested, and no other data of the mesh. Like a Reader, it keeps in
// memory the compressed connectivity that was read, and up to 64 MiB of neighbourhoods decoded from
// it. It also keeps the most recently read steps of arrays whose steps refer to each other
// (ReadLimits::max_kept_steps_bytes).
// spec: "Step values", "Index and trailer"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "shm/io.h"
#include "shm/reader.h"
#include "shm/schema.h"
#include "shm/segment_reader.h"

namespace shm {

class IndexedFile;

struct StepRequest {
  std::uint32_t array = 0;  ///< index of a stepped array
  std::uint64_t step = 0;
  /// Index of the segment to read. If not given, all segments are read, in order.
  std::optional<std::size_t> segment{};
  /// If true, requests the vertex or cell number of each value. If the file stores the numbers of
  /// the source mesh, a request without numbers reads fewer bytes. The numbers are the same at
  /// every step.
  bool numbers = true;
};

/// Values of one array at one step, for the elements of one chunk group.
struct StepValues {
  std::uint64_t first = 0;  ///< index of the first element, counted in the array's coding order
  std::vector<std::byte> values;  ///< values of the elements, packed
  /// Number of the vertex or cell of each value, as in MeshBlock::vertex_numbers and
  /// MeshBlock::cell_numbers. For other arrays: index of the element, from 0. Empty if not
  /// requested.
  std::vector<std::uint64_t> numbers;
};

/// Reads stepped arrays. Reading in ascending order is fastest: the step after the most recently
/// read step can be decoded without other steps. A StepReader is not thread safe; distinct
/// StepReaders are independent.
class SHM_API StepReader {
 public:
  /// Reads the index, the schema and the step times. `source` is borrowed and must outlive the
  /// StepReader.
  static Result<StepReader> open(RandomSource& source, const ReadLimits& limits = {});
  /// Opens a damaged file for reading its intact parts, as MeshExtractor::open_damaged() does.
  /// After this call, segments() lists the segments that are at least partly intact, and steps()
  /// lists the steps with values in any of these segments. next() skips segments whose values are
  /// lost.
  static Result<StepReader> open_damaged(RandomSource& source, const ReadLimits& limits = {});
  StepReader(StepReader&&) noexcept;
  StepReader& operator=(StepReader&&) noexcept;
  ~StepReader();

  const Schema& schema() const;
  const std::vector<SegmentInfo>& segments() const;
  /// Returns the time of each step; empty if the file has no step times.
  const std::vector<double>& step_times() const;
  /// Returns the number of elements of a stepped array, according to the index.
  std::uint64_t elements(std::uint32_t array) const;
  /// Returns the steps at which the array has values, ascending.
  std::vector<std::uint64_t> steps(std::uint32_t array) const;

  /// Starts a request, and cancels the previous request. Call next() to get the requested values.
  Result<void> begin(const StepRequest& request);
  /// Returns the values of the next group that has elements of the array, in coding order; null at
  /// the end. The values are valid until the next call. The value of a vertex is stored in the
  /// segment that owns the vertex.
  Result<StepValues*> next();
  /// Reads all values of a request, as begin() and next() would return them.
  Result<std::vector<StepValues>> read(const StepRequest& request);

 private:
  friend class MeshExtractor;
  class Impl;
  explicit StepReader(std::unique_ptr<Impl> impl);
  /// Creates a StepReader for a file that is already open.
  static Result<StepReader> of(std::shared_ptr<IndexedFile> file);
  /// Checks a request for `array` at `step`. Fails if begin() would fail with this request.
  Result<void> expect(std::uint32_t array, std::uint64_t step) const;
  std::unique_ptr<Impl> impl_;
};

}  // namespace shm
