#include "spool.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "failure.h"

namespace shm::converters {
namespace {

[[noreturn]] void fail(const std::string& directory, const char* what) {
  throw Failure(Error{ErrorCode::output, std::string(what) + ": " + std::strerror(errno),
                      "temporary spool file", kNoOffset, directory});
}

}  // namespace

Spool::Spool(std::string directory, std::size_t memory_budget)
    : directory_(directory.empty() ? "." : std::move(directory)),
      max_pages_(std::max<std::size_t>(memory_budget / kPageBytes, 4)) {}

Spool::~Spool() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::uint64_t Spool::reserve_pages(std::uint64_t count) {
  return std::exchange(next_page_, next_page_ + count);
}

void Spool::evict_one() {
  const std::uint64_t number = by_age_.back();
  Page& page = resident_.at(number);
  if (page.dirty) {
    if (descriptor_ < 0) {
      // A file that never has a name, or, where there is none such, one that loses it at once.
      descriptor_ = ::open(directory_.c_str(), O_RDWR | O_TMPFILE | O_EXCL | O_CLOEXEC, 0600);
      std::string name = directory_ + "/.shm-spool-XXXXXX";
      if (descriptor_ < 0) {
        descriptor_ = ::mkstemp(name.data());
        if (descriptor_ < 0) fail(directory_, "cannot create it");
        ::unlink(name.c_str());
      }
    }
    std::size_t done = 0;
    while (done < kPageBytes) {
      const ssize_t n = ::pwrite(descriptor_, page.bytes.get() + done, kPageBytes - done,
                                 static_cast<off_t>(number * kPageBytes + done));
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) fail(directory_, "cannot write it");
      done += static_cast<std::size_t>(n);
    }
  }
  by_age_.pop_back();
  resident_.erase(number);
}

std::byte* Spool::page(std::uint64_t number, bool for_writing) {
  auto found = resident_.find(number);
  if (found == resident_.end()) {
    if (resident_.size() >= max_pages_) evict_one();
    Page fresh;
    fresh.bytes = std::make_unique<std::byte[]>(kPageBytes);
    std::size_t done = 0;
    // Past the end of the file, or in a hole, a page reads as the zeros it starts with.
    while (descriptor_ >= 0 && done < kPageBytes) {
      const ssize_t n = ::pread(descriptor_, fresh.bytes.get() + done, kPageBytes - done,
                                static_cast<off_t>(number * kPageBytes + done));
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) fail(directory_, "cannot read it");
      if (n == 0) break;
      done += static_cast<std::size_t>(n);
    }
    by_age_.push_front(number);
    fresh.age = by_age_.begin();
    found = resident_.emplace(number, std::move(fresh)).first;
  } else if (found->second.age != by_age_.begin()) {
    by_age_.splice(by_age_.begin(), by_age_, found->second.age);
  }
  found->second.dirty |= for_writing;
  return found->second.bytes.get();
}

PagedArray::PagedArray(Spool& spool, std::size_t element_bytes)
    : spool_(&spool), element_bytes_(element_bytes) {}

std::byte* PagedArray::at(std::uint64_t byte, bool for_writing) {
  const std::uint64_t page = byte / Spool::kPageBytes;
  while (extents_.size() <= page / kExtentPages)
    extents_.push_back(spool_->reserve_pages(kExtentPages));
  const std::uint64_t number = extents_[page / kExtentPages] + page % kExtentPages;
  return spool_->page(number, for_writing) + byte % Spool::kPageBytes;
}

void PagedArray::read(std::uint64_t first, std::uint64_t count, std::byte* out) {
  std::uint64_t byte = first * element_bytes_;
  std::uint64_t left = count * element_bytes_;
  while (left > 0) {
    const std::uint64_t run = std::min(left, Spool::kPageBytes - byte % Spool::kPageBytes);
    std::memcpy(out, at(byte, false), run);
    out += run;
    byte += run;
    left -= run;
  }
}

void PagedArray::write(std::uint64_t first, std::uint64_t count, const std::byte* in) {
  std::uint64_t byte = first * element_bytes_;
  std::uint64_t left = count * element_bytes_;
  while (left > 0) {
    const std::uint64_t run = std::min(left, Spool::kPageBytes - byte % Spool::kPageBytes);
    std::memcpy(at(byte, true), in, run);
    in += run;
    byte += run;
    left -= run;
  }
  size_ = std::max(size_, first + count);
}

}  // namespace shm::converters
