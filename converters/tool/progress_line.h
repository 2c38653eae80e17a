// Progress of a command: one line on the terminal for all of its work.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/progress.h"
#include "mesh/forwarding_mesh.h"
#include "tool/support.h"

namespace shm::converters {

// A phase still to come, and its share of the work. Shares need not add up to 1.
struct ExpectedPhase {
  std::string name;
  double share;
};

// Shows percentage, MB/s and time left for the whole work on standard error, if that is a terminal.
// The line is rewritten at most ten times a second and erased at the end.
class ProgressLine {
 public:
  explicit ProgressLine(const CommonOptions& options);
  ~ProgressLine() { wipe(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  // Declares the remaining phases, in order, and the number of bytes to work on. Other phases that
  // occur in between are shown by name, and count as no work.
  void expect(std::vector<ExpectedPhase> phases, std::uint64_t bytes);
  Progress callback();
  void show(std::string_view phase, std::uint64_t done = 0, std::uint64_t total = 0);
  // Shows `words` and the completed share of the whole work, for a caller that knows this share.
  void show_share(std::string_view words, double share);
  void wipe();
  bool is_shown() const { return shown_; }

  // Makes this process, which handles one of many files, show no line. It stores the completed
  // share, in units of 1/65536, in `share` for its parent process.
  static void report_to(std::atomic<std::uint32_t>* share);

 private:
  double share_of(std::string_view phase, double of_phase);
  bool is_time() const;
  void print(std::string_view words, const std::string& text);

  bool shown_, dirty_ = false;
  std::vector<ExpectedPhase> phases_;
  std::size_t phase_ = 0;  // index of the current phase
  double begun_share_ = 0, share_ = 0;
  std::uint64_t bytes_ = 0;
  std::chrono::steady_clock::time_point begun_, last_{};
};

// Formats "42 %  12.3 MB/s  0:31 left". Speed and time are left out until they can be estimated.
std::string progress_text(double share, std::uint64_t bytes, double seconds);

// A mesh that reports how much of its data has been read, as progress of the phase `name`. The
// phase is complete when all values have been read once.
class WatchedMesh final : public ForwardingMesh {
 public:
  // Borrows the mesh and the name.
  WatchedMesh(MeshSource& mesh, Progress progress, std::string_view name);
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void seek_cells(std::uint64_t first) override { source_.seek_cells(first); }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override;
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

 private:
  void add(std::uint64_t bytes);

  Progress progress_;
  std::string_view name_;
  std::uint64_t read_ = 0, all_ = 0;
};

// Size in bytes of a mesh in memory: coordinates, cells, and each array with all its steps.
struct MeshBytes {
  std::uint64_t points = 0, cells = 0;
  std::vector<std::uint64_t> arrays;
  std::uint64_t all() const;
};
MeshBytes bytes_of_mesh(const MeshInfo& info);

}  // namespace shm::converters
