// FileWriter: writes the chunks of a file to a sink, and the index that lists them. The mesh
// encoder delivers complete groups. FileWriter itself encodes step values, times and extras.
// spec: "Container", "Step values", "Step times", "Extras", "Index and trailer"
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/errors.h"
#include "base/packing.h"
#include "format/chunk_writer.h"
#include "shm/reader.h"
#include "shm/writer.h"
#include "steps/step_encoder.h"

namespace shm {

/// Runs the body of each public call to a writer, and remembers the first error. After an error,
/// every later call fails with the same error.
class Calls {
 public:
  template <class Work>
  auto run(Work&& work) -> decltype(work()) {
    if (error_) return *error_;
    auto result = work();
    if (!result) error_ = result.error();
    return result;
  }
  /// Runs the body of the call that finishes the file. Later calls fail with ErrorCode::misuse.
  template <class Work>
  Result<SizeReport> finish(Work&& work) {
    if (error_) return *error_;
    Result<SizeReport> report = work();
    error_ = report ? misuse("the file is finished", "file") : report.error();
    return report;
  }

 private:
  std::optional<Error> error_;
};

class FileWriter {
 public:
  /// Creates a writer. `sink` and `schema` are borrowed. Precondition: `schema` has passed
  /// check_schema(). `digests`: true if the file has digests.
  FileWriter(ByteSink& sink, const Schema& schema, bool digests)
      : schema_(&schema),
        chunks_(sink),
        array_keys_(array_stream_names(schema)),
        has_digests_(digests) {}
  FileWriter(const FileWriter&) = delete;
  FileWriter& operator=(const FileWriter&) = delete;

  /// Starts a new file of the current version: writes the file start and the schema.
  Result<void> start();
  /// Continues a file whose first chunks are already in the sink. `schema` is the payload of the
  /// schema chunk of this file; further chunks are written in the version that it states. `streams`
  /// lists the coded size in bytes of the existing chunks by stream name, as in the index. `digest`
  /// is the sum of the digests of the existing chunks. `times` are the step times in these chunks.
  void go_on(std::vector<std::byte> schema, container::ChunkWriter::State state,
             std::map<std::string, std::uint64_t> streams, std::uint64_t steps,
             std::uint64_t digest, std::vector<double> times = {});
  bool has_digests() const { return has_digests_; }

  /// Continues the final chunk of step values of the existing file. Call this function after
  /// go_on(), and only if that chunk has not been copied. It writes the parts of that chunk again,
  /// so that small parts added later can share one chunk with them, as if the file had been written
  /// without interruption. `payload` is the payload of that chunk, in the format version of the
  /// file. Fails with ErrorCode::corrupt if the payload is invalid.
  Result<void> go_on_with_parts(std::span<const std::byte> payload);

  /// Adds to the index the chunks that another writer has appended to the sink. `part` is the index
  /// of these chunks, as returned by take_part(); its totals are ignored. Fails with
  /// ErrorCode::corrupt if the sizes of the chunks do not add up to `bytes` bytes.
  Result<void> adopt(const container::Index& part, std::uint64_t bytes);
  /// Returns `totals` with the index entries and stream sizes of the chunks that were written since
  /// the previous call (initially: since the start). Precondition: no step of an array is being
  /// written.
  container::Index take_part(container::Index totals);
  std::uint64_t offset() const { return chunks_.offset(); }
  std::uint32_t chunks() const { return chunks_.count(); }

  Result<void> write_group(const EncodedGroup& group);

  bool has_step_encoder() const { return step_values_.has_value(); }
  /// Begins the step values. Must be called before the first step values. `topology` is borrowed.
  /// The other arguments are those of StepEncoder.
  StepEncoder& begin_steps(StepTopology& topology, std::vector<std::uint64_t> elements,
                           std::uint32_t key_steps, KeptSteps kept, Level level);
  /// Allows bundles for step values, if the version of the file permits them. Must be called before
  /// the first step values. The arguments are those of StepEncoder::use_bundles().
  void use_bundles(std::uint64_t waiting_bytes, std::uint64_t pairs = 0, std::uint64_t bytes = 0);
  /// Checks that the array is stepped and that `values` consist of whole elements.
  Result<void> check_step_values(std::uint32_t array, std::span<const std::byte> values) const;
  /// Adds values of a step. Precondition: begin_steps() has been called, and check_step_values()
  /// has accepted the values.
  Result<void> add_step_values(std::uint32_t array, std::uint64_t step,
                               std::span<const std::byte> values) {
    return step_values_->add(array, step, values);
  }
  /// Ends the current step of an array, if there is one, and encodes all steps that wait. Small
  /// parts may be held back until other small parts can share their chunk.
  Result<void> end_step_array() {
    return step_values_ ? step_values_->end_steps() : Result<void>();
  }
  /// Writes the parts that were held back. Each of them contains all elements of its array.
  Result<void> write_parts() { return write_parts(0); }
  bool has_times() const { return times_set_; }
  /// Writes the times of all steps. A later call must repeat these times, and may add further
  /// times.
  Result<void> set_step_times(std::span<const double> times);
  static Result<void> check(const Extra& extra);
  /// Adds an extra. Precondition: check() has accepted the extra. Extras are collected, and written
  /// together before the next chunk of another kind.
  Result<void> add_extra(const Extra& extra);

  /// Writes everything added so far, and an index: the bytes in the sink are then a whole file.
  /// `totals` are the totals of the mesh. Fails with ErrorCode::misuse if a step is incomplete.
  Result<void> commit(container::Index totals);
  /// Writes the rest of the file: a second copy of the schema if the file is large, then the index
  /// and the trailer. `totals` are the totals of the mesh. No other function may be called
  /// afterwards.
  Result<SizeReport> finish(container::Index totals);
  /// As finish(), but the index lists only what is new, as that of commit(), and the schema is not
  /// repeated.
  Result<SizeReport> finish_with_commit(container::Index totals);

 private:
  std::uint8_t version_of(container::ChunkKind kind) const {
    return container::with_digest(container::version_of_chunk(kind, start_), has_digests_);
  }
  Result<void> write_schema();
  Result<void> write(container::ChunkKind kind, std::span<const std::byte> payload,
                     const container::IndexEntry& entry = {});
  Result<void> write(container::ChunkKind kind, std::span<const std::byte> payload,
                     const container::IndexEntry& entry, std::uint8_t version);
  Result<void> write_bundle(std::span<const container::StepPart> parts,
                            std::span<const std::byte> bytes);
  Result<void> write_extras();
  Result<void> add_part(const container::StepHeader& header, std::uint64_t first,
                        std::span<const std::byte> bytes, std::uint64_t digest);
  bool may_share_chunk(const container::StepPart& part) const;
  Result<void> write_parts(std::uint64_t first);
  Result<void> write_waiting();
  void add_totals(container::Index& totals) const;
  SizeReport report_of(const container::Index& totals) const;
  const std::string& array_key(std::uint32_t array) const { return array_keys_[array]; }

  const Schema* schema_;
  container::ChunkWriter chunks_;
  std::vector<std::string> array_keys_;
  std::map<std::string, std::uint64_t> stream_bytes_;
  container::FileStart start_;
  bool has_digests_;
  std::uint64_t digest_ = 0;  // sum of the digests of all chunks so far
  // Memory budget that a reader with default limits has for unpacked data.
  UnpackBudget budget_{ReadLimits().max_unpacked_bytes};
  std::vector<Extra> extras_;  // extras that have not been written yet
  std::uint64_t extra_bytes_ = 0;
  std::vector<container::StepPart> parts_;  // parts of step values that have not been written yet
  std::vector<std::byte> part_bytes_;
  // Payload of the schema chunk of the file that go_on() continues; otherwise empty.
  std::vector<std::byte> schema_payload_;
  std::optional<StepEncoder> step_values_;  // encoder of step values; set by begin_steps()
  bool times_set_ = false;
  std::vector<double> times_;  // step times written so far
  // Number of steps according to the step times and to the chunks that this object did not write
  // itself (see adopt() and go_on()).
  std::uint64_t steps_ = 0;
};

}  // namespace shm
