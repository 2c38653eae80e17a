#include "base/spool.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "base/failure.h"

namespace shm::converters {
namespace {

[[noreturn]] void fail(const std::string& directory, const char* what) {
  throw Failure(Error{.code = ErrorCode::output,
                      .detail = std::string(what) + ": " + std::strerror(errno),
                      .section = "temporary spool file",
                      .file = directory});
}

}  // namespace

Spool::Spool(std::string directory, std::size_t memory_budget, const MeshLimits& limits)
    : directory_(directory.empty() ? "." : std::move(directory)),
      memory_budget_(memory_budget),
      limits_(limits),
      frames_(kPageBytes, kStartBytes,
              memory_budget - memory_budget / 4 - kept_topology_bytes(*this)),
      small_room_(memory_budget) {}

Spool::~Spool() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::uint64_t Spool::reserve_pages(std::uint64_t count) {
  const std::uint64_t first = frames_.pages();
  frames_.add_pages(count);
  return first;
}

bool Spool::take_small(std::size_t bytes) {
  if (bytes > small_room_) return false;
  small_room_ -= bytes;
  return true;
}

void Spool::begin_writing(Frame& frame) {
  frame.dirty = true;
  if (ever_written_.size() <= frame.page) ever_written_.resize(frames_.pages());
  pages_written_ += ever_written_[frame.page] ? 0 : 1;
  ever_written_[frame.page] = true;
}

Spool::Frame* Spool::load(std::uint64_t number) {
  const bool written = frames_.was_here(number) && descriptor_ >= 0;
  Frame& frame = frames_.bring(number, [this](const Frame& leaving) {
    if (leaving.dirty) write_out(leaving);
  });
  // A page contains only zeros if it was never in memory, or if it is in a hole or past the end of
  // the temporary file.
  std::size_t done = 0;
  while (written && done < kPageBytes) {
    const ssize_t n = ::pread(descriptor_, frame.bytes.get() + done, kPageBytes - done,
                              static_cast<off_t>(number * kPageBytes + done));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(directory_, "cannot read it");
    if (n == 0) break;
    done += static_cast<std::size_t>(n);
  }
  std::memset(frame.bytes.get() + done, 0, kPageBytes - done);
  return &frame;
}

void Spool::write_out(const Frame& frame) {
  if (descriptor_ < 0) {
    // Creates a file without a name. If the file system does not support that, creates a named file
    // and unlinks it immediately.
    descriptor_ = ::open(directory_.c_str(), O_RDWR | O_TMPFILE | O_EXCL | O_CLOEXEC, 0600);
    std::string name = directory_ + "/.shm-spool-XXXXXX";
    if (descriptor_ < 0) {
      descriptor_ = ::mkstemp(name.data());
      if (descriptor_ < 0) fail(directory_, "cannot create it");
      ::unlink(name.c_str());
    }
  }
  for (std::size_t done = 0; done < kPageBytes;) {
    const ssize_t n = ::pwrite(descriptor_, frame.bytes.get() + done, kPageBytes - done,
                               static_cast<off_t>(frame.page * kPageBytes + done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) fail(directory_, "cannot write it");
    done += static_cast<std::size_t>(n);
  }
}

PagedArray::PagedArray(Spool& spool, std::size_t element_bytes)
    : spool_(&spool), element_bytes_(element_bytes) {}

void PagedArray::reserve(std::uint64_t page) {
  while (extents_.size() <= page / kExtentPages)
    extents_.push_back(spool_->reserve_pages(kExtentPages));
}

void PagedArray::read(std::uint64_t first, std::uint64_t count, std::byte* out) {
  std::uint64_t byte = first * element_bytes_;
  std::uint64_t left = count * element_bytes_;
  if (is_small()) {
    const std::uint64_t held = byte < small_.size() ? std::min(left, small_.size() - byte) : 0;
    if (held > 0) std::memcpy(out, small_.data() + byte, held);
    std::fill_n(out + held, left - held, std::byte{0});
    return;
  }
  while (left > 0) {
    const std::uint64_t run = std::min(left, Spool::kPageBytes - byte % Spool::kPageBytes);
    std::memcpy(out, at(byte, false), run);
    out += run;
    byte += run;
    left -= run;
  }
}

void PagedArray::write(std::uint64_t first, std::uint64_t count, const std::byte* in) {
  const std::uint64_t byte = first * element_bytes_, bytes = count * element_bytes_;
  if (!write_small(byte, bytes, in)) write_paged(byte, bytes, in);
  size_ = std::max(size_, first + count);
}

// Writes to an array that is held in one buffer instead of pages. Returns false if the array is
// already in pages, or must be moved to pages because it grows too large.
bool PagedArray::write_small(std::uint64_t byte, std::uint64_t bytes, const std::byte* in) {
  if (!is_small()) return false;
  if (bytes == 0) return true;
  const std::uint64_t end = byte + bytes;
  const std::uint64_t more = end > small_.size() ? end - small_.size() : 0;
  if (end > Spool::kSmallBytes || !spool_->take_small(more)) {
    const std::vector<std::byte> all = std::exchange(small_, {});
    write_paged(0, all.size(), all.data());
    return false;
  }
  if (more > 0) small_.resize(end);
  std::memcpy(small_.data() + byte, in, bytes);
  return true;
}

void PagedArray::write_paged(std::uint64_t byte, std::uint64_t left, const std::byte* in) {
  while (left > 0) {
    const std::uint64_t run = std::min(left, Spool::kPageBytes - byte % Spool::kPageBytes);
    std::memcpy(at(byte, true), in, run);
    in += run;
    byte += run;
    left -= run;
  }
}

NumberTable invert(NumberList& order, std::uint64_t size, const char* what, Spool& spool) {
  const auto fail = [&](const std::string& detail) {
    throw Failure(Error{
        .code = ErrorCode::corrupt, .detail = detail, .section = std::string(what) + " numbers"});
  };
  if (order.size() != size)
    fail("there are " + std::to_string(order.size()) + " numbers, but " + std::to_string(size) +
         " are expected");
  NumberTable position(spool, size, size);
  order.for_each([&](std::uint64_t index, std::uint64_t number) {
    if (number >= size)
      fail("number " + std::to_string(number) + " is beyond the last, " + std::to_string(size - 1));
    if (position.get(number) != 0) fail("number " + std::to_string(number) + " occurs twice");
    position.set(number, index + 1);
  });
  // So far, each entry is a position plus 1, because 0 marks a number that has not occurred.
  // Subtract 1.
  for (std::uint64_t n = 0; n < size; ++n) position.set(n, position.get(n) - 1);
  return position;
}

}  // namespace shm::converters
