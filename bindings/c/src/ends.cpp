#include "ends.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

namespace shmf {

shm::Result<void> CallbackSource::read_at(std::uint64_t offset, std::span<std::byte> into) {
  if (offset > source_.bytes || into.size() > source_.bytes - offset)
    return shm::Error{
        shm::ErrorCode::truncated, "a read goes beyond the end of the file", {}, offset};
  if (into.empty()) return {};
  char why[256] = {};
  if (source_.read_at(source_.context, offset, into.data(), into.size(), why, sizeof why) == 0)
    return {};
  why[sizeof why - 1] = 0;
  return shm::Error{
      shm::ErrorCode::io, why[0] != 0 ? why : "the source returned no bytes", {}, offset};
}

void CallbackSource::prefetch(std::span<const shm::ByteRange> ranges) {
  if (source_.prefetch == nullptr) return;
  std::vector<shmf_range> announced;
  for (const shm::ByteRange& range : ranges)
    if (range.offset < source_.bytes && range.bytes > 0)
      announced.push_back({range.offset, std::min(range.bytes, source_.bytes - range.offset)});
  if (announced.empty()) return;
  source_.prefetch(source_.context, announced.data(), announced.size());
}

shm::Result<void> CallbackSink::write(std::span<const std::byte> bytes) {
  if (bytes.empty() || write_(context_, bytes.data(), bytes.size()) == 0) return {};
  return shm::Error{shm::ErrorCode::output, "the sink did not accept the bytes"};
}

shm::ReadOptions read_options(const shmf_run_options& run) {
  shm::ReadOptions options;
  options.threads = run.threads == SHMF_ALL_THREADS ? 0 : std::max(run.threads, 1u);
  // memory limit in bytes for mesh blocks that are decoded before they are needed; the caller's
  // arrays do not count
  options.max_ahead_bytes = std::uint64_t{32} << 20;
  return options;
}

shm::Result<void> Watch::tell(double done, double all) {
  if (run_.progress == nullptr) return {};
  const double now = all > 0 ? std::min(done / all, 1.0) : 1.0;
  // progress() is called only if the completed fraction has grown by at least kStep since the
  // previous call
  constexpr double kStep = 1.0 / 256;
  if (now < 1 && now < told_ + kStep) return {};
  told_ = now;
  if (run_.progress(run_.context, now) == 0) return {};
  return shm::Error{kCancelled, "cancelled by the caller"};
}

}  // namespace shmf
