#include "tool/progress_line.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <utility>

namespace shm::converters {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kCornerBytes = 4, kUsualNodes = 8;

std::atomic<std::uint32_t>* reported_share = nullptr;

double seconds_since(Clock::time_point begun) {
  return std::chrono::duration<double>(Clock::now() - begun).count();
}

}  // namespace

std::string progress_text(double share, std::uint64_t bytes, double seconds) {
  constexpr double kFewSeconds = 2, kLittle = .02;
  char text[80];
  std::snprintf(text, sizeof text, "%3.0f %%", 100 * share);
  std::string line = text;
  if (seconds < kFewSeconds || share < kLittle) return line;
  if (bytes > 0) {
    std::snprintf(text, sizeof text, "  %.1f MB/s",
                  1e-6 * static_cast<double>(bytes) * share / seconds);
    line += text;
  }
  const double left = std::ceil(seconds * (1 - share) / share);
  if (left < 360000) {
    std::snprintf(text, sizeof text, "  %d:%02d left", static_cast<int>(left) / 60,
                  static_cast<int>(left) % 60);
    line += text;
  }
  return line;
}

ProgressLine::ProgressLine(const CommonOptions& options)
    : shown_(!options.quiet && ::isatty(STDERR_FILENO) != 0), begun_(Clock::now()) {}

void ProgressLine::report_to(std::atomic<std::uint32_t>* share) { reported_share = share; }

void ProgressLine::expect(std::vector<ExpectedPhase> phases, std::uint64_t bytes) {
  phases_ = std::move(phases);
  const double sum = std::accumulate(phases_.begin(), phases_.end(), 0.0,
                                     [](double s, const ExpectedPhase& p) { return s + p.share; });
  for (ExpectedPhase& phase : phases_) phase.share *= (1 - share_) / std::max(sum, 1e-9);
  begun_share_ = share_;
  phase_ = 0;
  bytes_ = bytes;
}

Progress ProgressLine::callback() {
  if (!shown_ && reported_share == nullptr) return {};
  return [this](std::string_view phase, std::uint64_t done, std::uint64_t total) {
    show(phase, done, total);
  };
}

// Returns the completed fraction of the whole work, which never decreases. `of_phase` is the
// completed fraction of the current phase.
double ProgressLine::share_of(std::string_view phase, double of_phase) {
  for (std::size_t index = phase_; index < phases_.size(); ++index) {
    if (phases_[index].name != phase) continue;
    for (; phase_ < index; ++phase_) begun_share_ += phases_[phase_].share;
    share_ = std::clamp(begun_share_ + of_phase * phases_[index].share, share_, 1.0);
    break;
  }
  return share_;
}

void ProgressLine::show(std::string_view phase, std::uint64_t done, std::uint64_t total) {
  const double of_phase =
      total == 0 ? 0 : std::min(1.0, static_cast<double>(done) / static_cast<double>(total));
  const double share = share_of(phase, of_phase);
  if (reported_share != nullptr) reported_share->store(static_cast<std::uint32_t>(65536 * share));
  if (total != 0 && !is_time()) return;
  if (!phases_.empty())
    print(phase, progress_text(share, bytes_, seconds_since(begun_)));
  else
    print(phase, total > 0 ? progress_text(of_phase, 0, 0) : std::string());
}

void ProgressLine::show_share(std::string_view words, double share) {
  if (is_time()) print(words, progress_text(share, bytes_, seconds_since(begun_)));
}

bool ProgressLine::is_time() const {
  return Clock::now() - last_ >= std::chrono::milliseconds(100);
}

void ProgressLine::print(std::string_view words, const std::string& text) {
  if (!shown_) return;
  last_ = Clock::now();
  dirty_ = true;
  std::fprintf(stderr, "\r\033[K%.*s %s", static_cast<int>(words.size()), words.data(),
               text.c_str());
}

void ProgressLine::wipe() {
  if (dirty_) std::fputs("\r\033[K", stderr);
  dirty_ = false;
}

std::uint64_t MeshBytes::all() const {
  return std::accumulate(arrays.begin(), arrays.end(), points + cells);
}

MeshBytes bytes_of_mesh(const MeshInfo& info) {
  MeshBytes bytes;
  bytes.points = info.vertices * 3 * scalar_bytes(info.schema.coordinate_type);
  for (std::size_t b = 0; b < info.schema.blocks.size(); ++b) {
    const std::uint32_t nodes = info.schema.blocks[b].nodes_per_cell;
    bytes.cells += info.block_cells[b] * (nodes == 0 ? kUsualNodes : nodes) * kCornerBytes;
  }
  for (std::size_t a = 0; a < info.schema.arrays.size(); ++a) {
    const std::uint64_t steps = info.schema.arrays[a].per_step ? info.step_times.size() : 1;
    bytes.arrays.push_back(info.array_elements(a) * info.array_stride(a) * steps);
  }
  return bytes;
}

WatchedMesh::WatchedMesh(MeshSource& mesh, Progress progress, std::string_view name)
    : ForwardingMesh(mesh),
      progress_(std::move(progress)),
      name_(name),
      all_(bytes_of_mesh(mesh.info()).all()) {
  info_ = mesh.info();
}

void WatchedMesh::add(std::uint64_t bytes) {
  // The number of bytes read is capped at the size of the mesh, because some data may be read
  // twice.
  read_ = std::min(read_ + bytes, all_);
  if (progress_) progress_(name_, read_, all_);
}

bool WatchedMesh::next_cells(CellBatch& out, std::size_t max_cells) {
  const bool more = source_.next_cells(out, max_cells);
  add(out.corners.size() * kCornerBytes);
  return more;
}

void WatchedMesh::read_points(std::uint64_t first, std::uint64_t count, std::byte* out) {
  source_.read_points(first, count, out);
  add(count * 3 * scalar_bytes(info_.schema.coordinate_type));
}

void WatchedMesh::read_array(std::size_t array, std::uint64_t step, std::uint64_t first,
                             std::uint64_t count, std::byte* out) {
  source_.read_array(array, step, first, count, out);
  add(count * info_.array_stride(array));
}

}  // namespace shm::converters
