// Appender: adds time steps to an existing file by writing a new file. It copies the contents of
// the old file without decoding them. It then writes the new steps, encoded exactly as the Writer
// of the old file would have encoded them. The old file does not change. If a caller replaces the
// old file only after finish() has succeeded (a FileSink does so), either the old or the new file
// is in place at every instant. An Appender needs the memory of a Writer after end_mesh(), plus the
// memory of a StepReader that has read the final steps of the old file.
// spec: "Step values", "Index and trailer"
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "shm/io.h"
#include "shm/reader.h"
#include "shm/schema.h"
#include "shm/writer.h"

namespace shm {

struct AppendOptions {
  Level level = Level::standard;
  /// Distance between key steps, as in WriteOptions::key_steps: among any `key_steps` consecutive
  /// steps of an array, at least one is a key step. If 0, the Appender uses the longest distance
  /// between key steps in the old file, but at least 8. The schema of the old file limits the
  /// number of earlier steps to which a new step may refer (Schema::step_references).
  std::uint32_t key_steps = 0;
  /// Folder of the temporary file for values of earlier steps that exceed
  /// ReadLimits::max_kept_steps_bytes, as ReadLimits::temporary_folder.
  std::string temporary_folder;
  /// Memory limit in bytes for steps that wait, as in WriteOptions::waiting_bytes.
  std::uint64_t waiting_bytes = std::uint64_t{8} << 20;
  /// True if the sink continues the old file itself, after its last index (FileSink::open_live()).
  /// Nothing of the old file is copied or changed, and commit() can be called after each step.
  /// Extras of the old file cannot be dropped, and set_step_times() must repeat its times.
  bool in_place = false;
};

/// Adds time steps to a copy of a file. Order of calls: open; optionally drop_extras; then steps,
/// times and extras in any order; then finish. After the first error every call returns that error.
/// An Appender is not thread safe. Like a StepReader, it relies on the index and the chunk headers
/// of the old file. Damage inside a chunk that is only copied remains in the new file; a reader of
/// that chunk detects the damage.
class SHM_API Appender {
 public:
  /// Opens `file`, a complete .shm file that is not an archive. Both arguments are borrowed and
  /// must outlive the Appender. Nothing is written to `sink` before the first call that adds a
  /// step, times or an extra. With AppendOptions::in_place, fails with ErrorCode::unsupported for
  /// files before version 0.10 and for files with parity, which would no longer match the file.
  static Result<Appender> open(RandomSource& file, ByteSink& sink,
                               const AppendOptions& options = {}, const ReadLimits& limits = {});
  Appender(Appender&&) noexcept;
  Appender& operator=(Appender&&) noexcept;
  ~Appender();

  const Schema& schema() const;
  /// Returns the time of each step of the old file; empty if the file has no times.
  const std::vector<double>& step_times() const;
  /// Returns the number of steps of the old file: the size of step_times(), or the highest step
  /// number in the file + 1 if that is larger.
  std::uint64_t steps() const;
  /// Returns the number of elements of a stepped array.
  std::uint64_t elements(std::uint32_t array) const;
  /// Returns a source from which a complete .shm file can be read: the old file without its step
  /// values. A Reader of this source returns the mesh, static arrays, times and extras. From
  /// MeshBlock::vertex_numbers and MeshBlock::cell_numbers, the caller can determine the coding
  /// order, in which add_step_values() expects values. The source is valid as long as the Appender
  /// and `file` exist.
  Result<std::unique_ptr<ByteSource>> without_steps();

  /// Omits the extras of the old file from the new file. Call this function before the first call
  /// that adds a step, times or an extra.
  Result<void> drop_extras();
  /// Adds values of a stepped array at a step, as Writer::add_step_values() does. The number of a
  /// new step must be higher than all step numbers that the array has in the old file. Quantized
  /// arrays keep their error bound. This also holds for values outside the range (minimum to
  /// maximum) of an array that is quantized to N bits.
  Result<void> add_step_values(std::uint32_t array, std::uint64_t step,
                               std::span<const std::byte> values);
  /// Sets the time of every step, including the steps of the old file. Call this function at most
  /// once. Without a call the new file has the times of the old file.
  Result<void> set_step_times(std::span<const double> times);
  Result<void> add_extra(const Extra& extra);

  /// Makes everything added so far readable, as Writer::commit() does. Only with
  /// AppendOptions::in_place.
  Result<void> commit();
  /// Writes the index, which includes the totals (the counts of vertices, cells, ...), and commits
  /// the sink. The new file is valid only if finish() succeeds.
  Result<SizeReport> finish();

 private:
  class Impl;
  explicit Appender(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace shm
