// Appender: more time steps for a file that is there. It writes the file anew: what stands in it is
// copied as it is, not decoded, and the new steps come behind, coded as the Writer that made the
// file would have gone on. Nothing of the old file changes. Whoever puts the new one in its place
// when finish() has succeeded (FileSink does so) has the old one or the new one at every instant.
// Memory as of a Writer after end_mesh, and as of a StepReader that has read the last steps.
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
  /// As in WriteOptions. 0: the longest way from one key step to the next in the file, at least 8.
  /// Steps refer to no more than the file's schema says (Schema::step_references).
  std::uint32_t key_steps = 0;
};

/// Order of calls: open; perhaps drop_extras; then steps, times and extras in any order; then
/// finish. After the first error every call returns that error. Not thread safe.
/// The old file is believed as a StepReader believes it: its index, and the headers of its chunks.
/// Damage inside a chunk that is only copied is found by who reads it, as before.
class SHM_API Appender {
 public:
  /// `file` is a whole .shm file, no archive. Both are borrowed and must outlive the Appender;
  /// `sink` gets nothing before the first step, times or extra.
  static Result<Appender> open(RandomSource& file, ByteSink& sink,
                               const AppendOptions& options = {}, const ReadLimits& limits = {});
  Appender(Appender&&) noexcept;
  Appender& operator=(Appender&&) noexcept;
  ~Appender();

  const Schema& schema() const;
  /// Of the old file, or nothing.
  const std::vector<double>& step_times() const;
  /// Of the old file: as many as it has times, or the highest step + 1 if that is more.
  std::uint64_t steps() const;
  /// How many elements a stepped array has.
  std::uint64_t elements(std::uint32_t array) const;
  /// The old file without its step values, as a .shm file: a Reader gives its mesh, static arrays,
  /// times and extras, and MeshBlock::vertex_numbers and cell_numbers tell the coding order.
  /// Valid as long as the Appender and `file`.
  Result<std::unique_ptr<ByteSource>> without_steps();

  /// The extras of the old file are left out. Before anything else.
  Result<void> drop_extras();
  /// As Writer::add_step_values. Steps of an array come behind its last one in the old file.
  /// Quantized arrays keep their bound, values outside of the box that N bits are of too.
  Result<void> add_step_values(std::uint32_t array, std::uint64_t step,
                               std::span<const std::byte> values);
  /// The time of each step, those of the old file included. Once; never: the old ones stay.
  Result<void> set_step_times(std::span<const double> times);
  Result<void> add_extra(const Extra& extra);

  /// Writes index and totals, and commits the sink. The new file is good only if this succeeds.
  Result<SizeReport> finish();

 private:
  class Impl;
  explicit Appender(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace shm
