#include "tool/input.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "archive/archive_files.h"
#include "base/failure.h"
#include "base/unpacked.h"
#include "files/mesh_files.h"
#include "formats/formats.h"
#include "series/open_series.h"

namespace shm::converters {
namespace {

// Returns true if an input can be read only once. This is the case for standard input, named pipes
// (such as <(COMMAND) in a shell), devices and sockets.
bool is_read_once(const std::string& path) {
  std::error_code none;
  const auto status = std::filesystem::status(path, none);
  return path == "-" || std::filesystem::is_fifo(status) ||
         std::filesystem::is_character_file(status) || std::filesystem::is_socket(status);
}

// Returns true if `head`, the first bytes of an input, are those of an HDF5 file. This matters if
// the path of the input is in /proc, because the HDF5 library cannot open a file through such a
// path.
bool needs_name(std::span<const std::byte> head) {
  constexpr std::array<unsigned char, 4> kHdf5 = {0x89, 'H', 'D', 'F'};
  return head.size() >= kHdf5.size() && std::memcmp(head.data(), kHdf5.data(), kHdf5.size()) == 0;
}

bool looks_packed(std::span<const std::byte> head) {
  const std::string_view bytes(reinterpret_cast<const char*>(head.data()), head.size());
  constexpr std::string_view kGzip("\x1f\x8b", 2), kXz("\xfd\x37zXZ\0", 6),
      kZstd("\x28\xb5\x2f\xfd", 4);
  return bytes.starts_with(kGzip) || bytes.starts_with(kXz) || bytes.starts_with(kZstd);
}

// A byte source whose first bytes can be inspected before they are read.
class HeadedSource final : public ByteSource {
 public:
  HeadedSource(std::unique_ptr<ByteSource> source, const std::string& name)
      : source_(std::move(source)) {
    head_.resize(kHead);
    std::size_t size = 0;
    while (size < kHead) {
      const std::size_t n = unwrap(source_->read(std::span(head_).subspan(size)), name);
      if (n == 0) break;
      size += n;
    }
    head_.resize(size);
  }
  std::span<const std::byte> head() const { return head_; }

  Result<std::size_t> read(std::span<std::byte> into) override {
    if (given_ == head_.size()) return source_->read(into);
    const std::size_t n = std::min(into.size(), head_.size() - given_);
    std::copy_n(head_.begin() + static_cast<std::ptrdiff_t>(given_), n, into.begin());
    given_ += n;
    return n;
  }

 private:
  // Number of leading bytes needed to recognize .shm files, archives and HDF5 files.
  static constexpr std::size_t kHead = 16;
  std::unique_ptr<ByteSource> source_;
  std::vector<std::byte> head_;
  std::size_t given_ = 0;
};

std::unique_ptr<HeadedSource> opened(const std::string& path) {
  auto source = std::make_unique<HeadedSource>(unwrap(FileSource::open(path), path), path);
  if (!looks_packed(source->head())) return source;
  return std::make_unique<HeadedSource>(std::make_unique<UnpackedSource>(std::move(source), path),
                                        path);
}

}  // namespace

bool is_packed(const std::string& path) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) return false;
  const auto file = FileSource::open(path);
  std::array<std::byte, 6> head{};
  if (!file) return false;
  const auto count = (*file)->read(head);
  return count && looks_packed(std::span(head).first(*count));
}

class ToolInput::Stream final : public ByteSource {
 public:
  explicit Stream(const std::string& path) : source_(opened(path)) {}
  std::span<const std::byte> head() const { return source_->head(); }
  Result<std::size_t> read(std::span<std::byte> into) override { return source_->read(into); }

 private:
  std::unique_ptr<HeadedSource> source_;
};

ToolInput::ToolInput(CommonOptions& options, const std::string& path, std::string part)
    : name_(path), path_(path), part_(std::move(part)) {
  if (!is_read_once(path_)) {
    series_ = series_of(path_);
    if (is_series() || !is_packed(path_)) return;
  }
  stream_ = std::make_unique<Stream>(path_);
  if (looks_like_shm(stream_->head()) && !looks_like_archive(stream_->head())) return;
  const auto how =
      needs_name(stream_->head()) ? FileSink::Temporary::named : FileSink::Temporary::unnamed;
  {
    const RemovedOnSignals::Pause pause;
    spool_ = unwrap(FileSink::create_scratch(spool_directory(options), "input", how), path_);
    if (spool_->is_named()) on_signals_.emplace(spool_->temporary().c_str());
  }
  std::vector<std::byte> piece(std::size_t{1} << 20);
  while (const std::size_t n = unwrap(stream_->read(piece), name_))
    unwrap(spool_->write(std::span(piece).first(n)));
  stream_.reset();
  path_ = options.spooled = spool_->temporary();
  options.spooled_from = name_;
}
ToolInput::~ToolInput() = default;

bool ToolInput::is_shm() const {
  return is_stream() || (!is_series() && converters::is_shm(path_));
}

void ToolInput::require_shm() const {
  if (is_series())
    throw Failure(ErrorCode::unsupported, "is a series of files, not a .shm file", path_);
  if (!is_stream()) converters::require_shm(path_);
}

std::uint64_t ToolInput::bytes() const {
  std::uint64_t sum = file_bytes(path_);
  if (series_)
    for (const SeriesFile& file : *series_) sum += file_bytes(file.path);
  return sum;
}

const ArchiveMember& part_of(const std::vector<ArchiveMember>& members, const std::string& part,
                             const std::string& path) {
  constexpr std::size_t kNamed = 10;
  if (part.empty() && members.size() == 1) return members.front();
  std::string names;
  for (std::size_t m = 0; m < members.size(); ++m) {
    if (!part.empty() && members[m].name == part) return members[m];
    if (m < kNamed) names += (m == 0 ? "" : ", ") + members[m].name;
  }
  if (members.size() > kNamed) names += ", ...";
  wrong_use(part.empty() ? path + " is an archive of " + names +
                               ": --part names one of them; shm split restores all"
                         : "there is no part " + part + " in " + path + "; there are " + names);
}

void print_remark(const std::string& sentence) {
  std::fprintf(stderr, "shm: %s\n", sentence.c_str());
}

std::unique_ptr<MeshSource> ToolInput::open(Spool& spool, const Progress& progress,
                                            unsigned threads) {
  if (is_stream()) return stage_shm(*stream_, name_, 0, spool, progress, threads);
  const auto open_part = [&]() -> std::unique_ptr<MeshSource> {
    ArchiveFile archive(path_);
    return archive.open(part_of(archive.members(), part_, name_), spool, progress, threads);
  };
  if (!part_.empty()) {
    if (is_series() || !is_archive(path_))
      wrong_use("--part needs an archive; " + name_ + " is not one");
    return open_part();
  }
  if (is_series()) return open_series(*series_, spool, progress, print_remark);
  try {
    return is_shm() ? open_shm(path_, spool, progress, threads) : open_mesh(path_, spool, progress);
  } catch (const Failure& failure) {
    if (failure.error().code != ErrorCode::unsupported || !is_archive(path_)) throw;
    return open_part();
  }
}

FileSummary ToolInput::summarize(const Progress& progress) {
  return is_stream() ? summarize_stream(*stream_, name_, progress) : summarize_shm(path_);
}

}  // namespace shm::converters
