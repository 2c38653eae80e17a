// How far a command is: one line on the terminal for all of its work.
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

// A phase that is to come, and what share of the work it is; shares need not add up to anything.
struct ExpectedPhase {
  std::string name;
  double share;
};

// Percent, MB/s and time left of all the work, on standard error where that is a terminal;
// rewritten at most ten times a second and wiped at the end.
class ProgressLine {
 public:
  explicit ProgressLine(const CommonOptions& options);
  ~ProgressLine() { wipe(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  // The phases that are left, in their order, and of how many bytes the work is. Others that come
  // between them are shown by their names, and count as nothing.
  void expect(std::vector<ExpectedPhase> phases, std::uint64_t bytes);
  Progress callback();
  void show(std::string_view phase, std::uint64_t done = 0, std::uint64_t total = 0);
  // The same where somebody else knows the share of all the work.
  void show_share(std::string_view words, double share);
  void wipe();
  bool is_shown() const { return shown_; }

  // In a process of one of many files there is no line: `share`, of 65536ths, tells its parent.
  static void report_to(std::atomic<std::uint32_t>* share);

 private:
  double share_of(std::string_view phase, double of_phase);
  bool is_time() const;
  void print(std::string_view words, const std::string& text);

  bool shown_, dirty_ = false;
  std::vector<ExpectedPhase> phases_;
  std::size_t phase_ = 0;  // the one that runs
  double begun_share_ = 0, share_ = 0;
  std::uint64_t bytes_ = 0;
  std::chrono::steady_clock::time_point begun_, last_{};
};

// "42 %  12.3 MB/s  0:31 left", once there is something to go by.
std::string progress_text(double share, std::uint64_t bytes, double seconds);

// A mesh that reports what is read of it, as the phase `name`: all its values once are all.
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

// Bytes of a mesh in memory: coordinates, cells, and each array with all its steps.
struct MeshBytes {
  std::uint64_t points = 0, cells = 0;
  std::vector<std::uint64_t> arrays;
  std::uint64_t all() const;
};
MeshBytes bytes_of_mesh(const MeshInfo& info);

}  // namespace shm::converters
