#include "base/unpacked.h"

#include <archive.h>
#include <archive_entry.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <new>
#include <system_error>
#include <utility>

namespace shm::converters {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 16;

struct Packer {
  std::string_view signature, extension;
};
constexpr std::array<Packer, 3> kPackers = {{{std::string_view("\x1f\x8b", 2), ".gz"},
                                             {std::string_view("\xfd"
                                                               "7zXZ\0",
                                                               6),
                                              ".xz"},
                                             {"\x28\xb5\x2f\xfd", ".zst"}}};

}  // namespace

bool looks_packed(std::span<const std::byte> head) {
  const std::string_view bytes(reinterpret_cast<const char*>(head.data()), head.size());
  return std::any_of(kPackers.begin(), kPackers.end(),
                     [&](const Packer& packer) { return bytes.starts_with(packer.signature); });
}

bool is_packed(const std::string& path) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) return false;
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) return false;
  std::array<std::byte, 6> head{};
  const std::size_t count = std::fread(head.data(), 1, head.size(), file);
  std::fclose(file);
  return looks_packed(std::span(head).first(count));
}

std::string unpacked_name(const std::string& path) {
  for (const Packer& packer : kPackers)
    if (path.size() > packer.extension.size() && path.ends_with(packer.extension))
      return path.substr(0, path.size() - packer.extension.size());
  return path;
}

void UnpackedSource::Closed::operator()(archive* reader) const { ::archive_read_free(reader); }

UnpackedSource::UnpackedSource(std::unique_ptr<ByteSource> packed, std::string name)
    : packed_(std::move(packed)),
      name_(std::move(name)),
      piece_(kPieceBytes),
      reader_(::archive_read_new()) {
  if (reader_ == nullptr) throw std::bad_alloc();
  ::archive_read_support_filter_gzip(reader_.get());
  ::archive_read_support_filter_xz(reader_.get());
  ::archive_read_support_filter_zstd(reader_.get());
  ::archive_read_support_format_raw(reader_.get());
}
UnpackedSource::~UnpackedSource() = default;

std::ptrdiff_t UnpackedSource::give(archive*, void* self, const void** bytes) {
  UnpackedSource& it = *static_cast<UnpackedSource*>(self);
  const Result<std::size_t> count = it.packed_->read(it.piece_);
  if (!count) {
    it.refusal_ = count.error();
    return -1;
  }
  it.at_end_ = *count == 0;
  *bytes = it.piece_.data();
  return static_cast<std::ptrdiff_t>(*count);
}

Error UnpackedSource::error() const {
  if (!refusal_) return refusal_.error();
  if (at_end_)
    return {ErrorCode::truncated, "ends before what is packed in it does", {}, kNoOffset, name_};
  const char* const words = ::archive_error_string(reader_.get());
  return {ErrorCode::corrupt,
          std::string("does not unpack: ") + (words != nullptr ? words : "unknown"),
          {},
          kNoOffset,
          name_};
}

Result<std::size_t> UnpackedSource::read(std::span<std::byte> into) {
  if (!begun_) {
    begun_ = true;
    archive_entry* entry = nullptr;
    int state = ::archive_read_open(reader_.get(), this, nullptr, give, nullptr);
    if (state == ARCHIVE_OK) state = ::archive_read_next_header(reader_.get(), &entry);
    if (state == ARCHIVE_EOF) return std::size_t{0};  // nothing was packed
    if (state != ARCHIVE_OK) return error();
  }
  const la_ssize_t count = ::archive_read_data(reader_.get(), into.data(), into.size());
  if (count < 0) return error();
  return static_cast<std::size_t>(count);
}

}  // namespace shm::converters
