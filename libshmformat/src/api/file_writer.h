// FileWriter: the chunks of a file into a sink, and the index that lists them. Groups come ready
// from the mesh encoder; step values, times and extras are made here.
// spec: "Container", "Step values", "Step times", "Extras", "Index and trailer"
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bytes/errors.h"
#include "bytes/packing.h"
#include "container/chunk_writer.h"
#include "shm/reader.h"
#include "shm/writer.h"
#include "steps/step_encoder.h"

namespace shm {

/// The calls of a writer: the first error that one of them has every later one has, too.
class Calls {
 public:
  template <class Work>
  Result<void> run(Work&& work) {
    if (error_) return *error_;
    Result<void> result = work();
    if (!result) error_ = result.error();
    return result;
  }
  /// Runs what ends the file: a call behind it is misuse.
  template <class Work>
  Result<SizeReport> finish(Work&& work) {
    if (error_) return *error_;
    Result<SizeReport> report = work();
    error_ = report ? misuse_error("the file is finished", "file") : report.error();
    return report;
  }

 private:
  std::optional<Error> error_;
};

class FileWriter {
 public:
  /// `sink` and `schema`, which is checked, are borrowed.
  FileWriter(ByteSink& sink, const Schema& schema)
      : schema_(&schema), chunks_(sink), array_keys_(array_stream_names(schema)) {}
  FileWriter(const FileWriter&) = delete;
  FileWriter& operator=(const FileWriter&) = delete;

  /// A new file, of this version: its start and the schema.
  Result<void> start();
  /// A file of which some chunks stand in the sink. `schema`: the payload of its schema chunk; what
  /// follows is of its version; `streams`: their bytes, as in the index.
  void go_on(std::vector<std::byte> schema, container::ChunkWriter::State state,
             std::map<std::string, std::uint64_t> streams, std::uint64_t steps);

  /// After go_on(): step values that stood in the last chunk of such, which is not copied: small
  /// ones that come may stand with them, as they would have stood. `payload`: of that chunk, in the
  /// version that the file's have; corrupt where it is none.
  Result<void> go_on_with_parts(std::span<const std::byte> payload);

  /// Chunks that stand in the file already, behind what was written. `part`: what a take_part()
  /// listed; its totals are not looked at. Corrupt where they are not `bytes` bytes.
  Result<void> adopt(const container::Index& part, std::uint64_t bytes);
  /// What the index lists since the beginning, or the last call, and `totals`; forgets it.
  /// No array and step is at hand.
  container::Index take_part(container::Index totals);
  std::uint64_t offset() const { return chunks_.offset(); }
  std::uint32_t chunks() const { return chunks_.count(); }

  Result<void> write_group(std::uint32_t segment, const container::GroupHeader& header,
                           const std::vector<std::vector<std::byte>>& streams);

  bool has_step_encoder() const { return step_values_.has_value(); }
  /// Before the first step values. `topology` is borrowed; the rest as in StepEncoder.
  StepEncoder& begin_steps(StepTopology& topology, std::vector<std::uint64_t> elements,
                           std::uint32_t key_steps, Level level);
  /// Whether `values` may be some of that array.
  Result<void> check_step_values(std::uint32_t array, std::span<const std::byte> values) const;
  /// After begin_steps() and check_step_values().
  Result<void> add_step_values(std::uint32_t array, std::uint64_t step,
                               std::span<const std::byte> values) {
    return step_values_->add(array, step, values);
  }
  /// Ends the array and step at hand, if there is one. Its values may still wait for others, to
  /// stand together with them.
  Result<void> end_step_array() { return step_values_ ? step_values_->end_step() : Result<void>(); }
  /// Writes the values that wait: each all elements of its array.
  Result<void> write_parts() { return write_parts(0); }
  bool has_times() const { return times_set_; }
  Result<void> set_step_times(std::span<const double> times);
  static Result<void> check(const Extra& extra);
  /// After check(). It is written before the next chunk of another kind, with those that come
  /// until then.
  Result<void> add_extra(const Extra& extra);

  /// Writes all that is left: the schema once more in a large file, the index, and the trailer.
  /// `totals`: its totals of the mesh. Nothing may follow.
  Result<SizeReport> finish(container::Index totals);

 private:
  Result<void> write_schema();
  Result<void> write(container::ChunkKind kind, std::span<const std::byte> payload,
                     const container::IndexEntry& entry = {});
  Result<void> write_extras();
  Result<void> add_part(const container::StepHeader& header, std::uint64_t first,
                        std::span<const std::byte> bytes);
  bool stands_with_others(const container::StepPart& part) const;
  Result<void> write_parts(std::uint64_t first);
  const std::string& array_key(std::uint32_t array) const { return array_keys_[array]; }

  const Schema* schema_;
  container::ChunkWriter chunks_;
  std::vector<std::string> array_keys_;
  std::map<std::string, std::uint64_t> stream_bytes_;
  container::FileStart start_;
  UnpackBudget budget_{ReadLimits().max_unpacked_bytes};  // of who reads it
  std::vector<Extra> extras_;                             // that are still to be written
  std::uint64_t extra_bytes_ = 0;
  std::vector<container::StepPart> parts_;  // of step values that are still to be written
  std::vector<std::byte> part_bytes_;
  std::vector<std::byte> schema_payload_;   // of the file that is gone on with, else empty
  std::optional<StepEncoder> step_values_;  // from the first ones on
  bool times_set_ = false;
  std::uint64_t steps_ = 0;  // of what stood there, and of the times
};

}  // namespace shm
