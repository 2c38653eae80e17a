// ProgressLine: shows the progress of a command in one line on the terminal.
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

// A future phase of the command. `share` is the relative amount of its work; the shares of all
// phases need not add up to 1.
struct ExpectedPhase {
  std::string name;
  double share;
};

// Shows the percentage of the completed work, the speed in MB/s and the time left. It is shown only
// if standard error is a terminal. The line is updated at most ten times a second and erased at the
// end.
class ProgressLine {
 public:
  explicit ProgressLine(const CommonOptions& options);
  ~ProgressLine() { wipe(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  // Declares the remaining phases, in the order in which they occur, and the total number of bytes
  // to process. If a phase occurs that was not declared, its name is shown, but the percentage does
  // not change.
  void expect(std::vector<ExpectedPhase> phases, std::uint64_t bytes);
  Progress callback();
  void show(std::string_view phase, std::uint64_t done = 0, std::uint64_t total = 0);
  // Shows the text `words` and the completed fraction of the whole work, `share`. Call this if no
  // phases are declared.
  void show_share(std::string_view words, double share);
  void wipe();
  bool is_shown() const { return shown_; }

  // Call this in a child process that handles one of many files. The process then shows no line,
  // but stores the completed fraction of its work in `*share`, in units of 1/65536. The parent
  // process reads it there.
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

// Formats the progress as text, such as "42 %  12.3 MB/s  0:31 left". Speed and remaining time are
// left out until they can be estimated.
std::string progress_text(double share, std::uint64_t bytes, double seconds);

// A mesh that reports progress while it is read. The progress belongs to the phase `name`, which is
// complete when the number of bytes read equals the size of the mesh.
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

// Sizes in bytes of the parts of a mesh in memory: coordinates, cells, and each array with all its
// steps.
struct MeshBytes {
  std::uint64_t points = 0, cells = 0;
  std::vector<std::uint64_t> arrays;
  std::uint64_t all() const;
};
MeshBytes bytes_of_mesh(const MeshInfo& info);

}  // namespace shm::converters
