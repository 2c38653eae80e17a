// StepReader: one stepped array at one step, without the rest of the file. Beside index and schema
// it reads the chunks of that array from the step's key step on, and of the mesh only what says how
// cells are connected, where values are predicted from it or numbers are asked for.
// Memory as of a Reader: the compressed connectivity that was read, up to 64 MiB of what it tells,
// and the last steps that were read of arrays whose steps refer to each other, 128 MiB at most.
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
  std::uint32_t array = 0;  ///< a stepped one
  std::uint64_t step = 0;
  std::optional<std::size_t> segment{};  ///< of this one alone; else of all, in order
  /// Whether the numbers of the elements are wanted. Values alone take fewer bytes where the
  /// numbers are those of the source, and numbers are the same at every step.
  bool numbers = true;
};

/// The values of one chunk group.
struct StepValues {
  std::uint64_t first = 0;        ///< first element, in the array's coding order
  std::vector<std::byte> values;  ///< of its elements, packed
  /// If asked for: number of the vertex or cell of each value, the same as in
  /// MeshBlock::vertex_numbers and MeshBlock::cell_numbers.
  std::vector<std::uint64_t> numbers;
};

/// Steps in ascending order cost least: a step that follows the one read before needs no other.
/// Not thread safe; distinct StepReaders are independent.
class SHM_API StepReader {
 public:
  /// Reads index, schema and step times. `source` is borrowed and must outlive the StepReader.
  static Result<StepReader> open(RandomSource& source, const ReadLimits& limits = {});
  /// Of a damaged file what is left, as MeshExtractor::open_damaged() finds it: segments() are
  /// those of which anything is, and steps() have values of any of them. next() leaves out segments
  /// whose values are lost.
  static Result<StepReader> open_damaged(RandomSource& source, const ReadLimits& limits = {});
  StepReader(StepReader&&) noexcept;
  StepReader& operator=(StepReader&&) noexcept;
  ~StepReader();

  const Schema& schema() const;
  const std::vector<SegmentInfo>& segments() const;
  /// The time of each step, or nothing.
  const std::vector<double>& step_times() const;
  /// How many elements a stepped array has, as the index tells.
  std::uint64_t elements(std::uint32_t array) const;
  /// The steps at which the array has values, ascending.
  std::vector<std::uint64_t> steps(std::uint32_t array) const;

  /// What next() is to give; drops what is left of the request before.
  Result<void> begin(const StepRequest& request);
  /// The values of the next group that has some, in coding order; null at the end. Valid until the
  /// next call. A vertex comes with the segment that owns it.
  Result<StepValues*> next();
  /// All at once.
  Result<std::vector<StepValues>> read(const StepRequest& request);

 private:
  friend class MeshExtractor;
  class Impl;
  explicit StepReader(std::unique_ptr<Impl> impl);
  /// Of a file that is open.
  static Result<StepReader> of(std::shared_ptr<IndexedFile> file);
  /// Fails where begin() would.
  Result<void> expect(std::uint32_t array, std::uint64_t step) const;
  std::unique_ptr<Impl> impl_;
};

}  // namespace shm
