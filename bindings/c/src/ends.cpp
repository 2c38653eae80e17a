#include "ends.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

namespace shmf {

shm::Result<void> CallbackSource::read_at(std::uint64_t offset, std::span<std::byte> into) {
  if (offset > source_.bytes || into.size() > source_.bytes - offset)
    return shm::Error{shm::ErrorCode::truncated, "the file ends before", "", offset, {}};
  if (into.empty()) return {};
  char why[256] = {};
  if (source_.read_at(source_.context, offset, into.data(), into.size(), why, sizeof why) == 0)
    return {};
  why[sizeof why - 1] = 0;
  return shm::Error{
      shm::ErrorCode::io, why[0] != 0 ? why : "the source gave no bytes", "", offset, {}};
}

void CallbackSource::prefetch(std::span<const shm::ByteRange> ranges) {
  if (source_.prefetch == nullptr) return;
  std::vector<shmf_range> told;
  for (const shm::ByteRange& range : ranges)
    if (range.offset < source_.bytes && range.bytes > 0)
      told.push_back({range.offset, std::min(range.bytes, source_.bytes - range.offset)});
  if (told.empty()) return;
  source_.prefetch(source_.context, told.data(), told.size());
}

shm::Result<void> CallbackSink::write(std::span<const std::byte> bytes) {
  if (bytes.empty() || write_(context_, bytes.data(), bytes.size()) == 0) return {};
  return shm::Error{shm::ErrorCode::output, "the bytes were not taken", "", shm::kNoOffset, {}};
}

shm::ReadOptions read_options(const shmf_run_options& run) {
  shm::ReadOptions options;
  options.threads = run.threads == SHMF_ALL_THREADS ? 0 : std::max(run.threads, 1u);
  options.max_ahead_bytes = std::uint64_t{32} << 20;  // beside the caller's arrays
  return options;
}

shm::Result<void> Watch::tell(double done, double all) {
  if (run_.progress == nullptr) return {};
  const double now = all > 0 ? std::min(done / all, 1.0) : 1.0;
  constexpr double kStep = 1.0 / 256;  // nobody sees less
  if (now < 1 && now < told_ + kStep) return {};
  told_ = now;
  if (run_.progress(run_.context, now) == 0) return {};
  return shm::Error{kCancelled, "the caller wanted no more", "", shm::kNoOffset, {}};
}

}  // namespace shmf
