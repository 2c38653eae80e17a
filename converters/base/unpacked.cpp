#include "base/unpacked.h"

#include <archive.h>
#include <archive_entry.h>

#include <array>
#include <new>
#include <string_view>
#include <utility>

#include "base/loaded_library.h"

namespace shm::converters {
namespace {

// The functions of libarchive that are used here. The constructor throws Failure if the library
// cannot be loaded.
struct ArchiveFunctions {
#ifdef SHM_ARCHIVE_LIBRARY
  LoadedLibrary library{SHM_ARCHIVE_LIBRARY};
#define SHM_FUNCTION(name) decltype(&::name) name = library.find<decltype(::name)>(#name)
#else
#define SHM_FUNCTION(name) decltype(&::name) name = &::name
#endif
  SHM_FUNCTION(archive_error_string);
  SHM_FUNCTION(archive_read_data);
  SHM_FUNCTION(archive_read_free);
  SHM_FUNCTION(archive_read_new);
  SHM_FUNCTION(archive_read_next_header);
  SHM_FUNCTION(archive_read_open);
  SHM_FUNCTION(archive_read_support_filter_gzip);
  SHM_FUNCTION(archive_read_support_filter_xz);
  SHM_FUNCTION(archive_read_support_filter_zstd);
  SHM_FUNCTION(archive_read_support_format_raw);
#undef SHM_FUNCTION
};

// Returns the functions of libarchive. The first call loads the library.
const ArchiveFunctions& libarchive() {
  static const ArchiveFunctions functions;
  return functions;
}

constexpr std::size_t kPieceBytes = std::size_t{1} << 16;

constexpr std::array<std::string_view, 3> kExtensions = {".gz", ".xz", ".zst"};

}  // namespace

std::string unpacked_name(const std::string& path) {
  for (const std::string_view extension : kExtensions)
    if (path.size() > extension.size() && path.ends_with(extension))
      return path.substr(0, path.size() - extension.size());
  return path;
}

void UnpackedSource::Closed::operator()(archive* reader) const {
  libarchive().archive_read_free(reader);
}

UnpackedSource::UnpackedSource(std::unique_ptr<ByteSource> packed, std::string name)
    : packed_(std::move(packed)),
      name_(std::move(name)),
      piece_(kPieceBytes),
      reader_(libarchive().archive_read_new()) {
  if (reader_ == nullptr) throw std::bad_alloc();
  libarchive().archive_read_support_filter_gzip(reader_.get());
  libarchive().archive_read_support_filter_xz(reader_.get());
  libarchive().archive_read_support_filter_zstd(reader_.get());
  libarchive().archive_read_support_format_raw(reader_.get());
}
UnpackedSource::~UnpackedSource() = default;

std::ptrdiff_t UnpackedSource::give(archive*, void* self, const void** bytes) {
  UnpackedSource& source = *static_cast<UnpackedSource*>(self);
  const Result<std::size_t> count = source.packed_->read(source.piece_);
  if (!count) {
    source.refusal_ = count.error();
    return -1;
  }
  source.at_end_ = *count == 0;
  *bytes = source.piece_.data();
  return static_cast<std::ptrdiff_t>(*count);
}

Error UnpackedSource::error() const {
  if (!refusal_) return refusal_.error();
  if (at_end_)
    return Error{
        .code = ErrorCode::truncated, .detail = "the compressed data ends early", .file = name_};
  const char* const words = libarchive().archive_error_string(reader_.get());
  return Error{.code = ErrorCode::corrupt,
               .detail = std::string("does not unpack: ") + (words != nullptr ? words : "unknown"),
               .file = name_};
}

Result<std::size_t> UnpackedSource::read(std::span<std::byte> into) {
  if (!begun_) {
    begun_ = true;
    archive_entry* entry = nullptr;
    int state = libarchive().archive_read_open(reader_.get(), this, nullptr, give, nullptr);
    if (state == ARCHIVE_OK) state = libarchive().archive_read_next_header(reader_.get(), &entry);
    if (state == ARCHIVE_EOF) return std::size_t{0};  // the compressed file is empty
    if (state != ARCHIVE_OK) return error();
  }
  const la_ssize_t count = libarchive().archive_read_data(reader_.get(), into.data(), into.size());
  if (count < 0) return error();
  return static_cast<std::size_t>(count);
}

}  // namespace shm::converters
