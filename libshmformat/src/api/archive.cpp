// Archives: sequences of complete files, called members, with a list of the members at the end.
#include "shm/archive.h"

#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <utility>

#include "base/binary.h"
#include "base/errors.h"
#include "format/chunk_writer.h"
#include "format/random_chunks.h"

namespace shm {

namespace {

constexpr std::size_t kLongestName = 255;

/// Parses the file start, which is at the beginning of `head`. Returns false if the file start is
/// invalid.
bool file_start(std::span<const std::byte> head, container::FileStart& start) {
  ByteReader in(head);
  return container::get(in, start);
}

/// Writes the bytes of a member to the archive and counts them. Stores the first bytes, to check
/// the file start.
class MemberSink final : public ByteSink {
 public:
  explicit MemberSink(ByteSink& sink) : sink_(&sink) {}
  Result<void> write(std::span<const std::byte> more) override {
    if (error_) return *error_;
    if (!open_) return *(error_ = misuse("a member was written to after it had ended", "archive"));
    for (std::size_t i = 0; i < more.size() && bytes_ + i < head_.size(); ++i)
      head_[static_cast<std::size_t>(bytes_) + i] = more[i];
    bytes_ += more.size();
    auto result = sink_->write(more);
    if (!result) error_ = result.error();
    return result;
  }
  void begin() {
    bytes_ = 0;
    open_ = true;
  }
  /// Ends the member and returns its size in bytes. Fails with ErrorCode::misuse if the first bytes
  /// of the member are not those of a .shm file with one mesh.
  Result<std::uint64_t> end() {
    open_ = false;
    if (error_) return *error_;
    container::FileStart start;
    const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(bytes_, head_.size()));
    if (!file_start(std::span(head_).first(size), start))
      return misuse("a member is not a .shm file", "archive");
    if ((start.needed_features & container::kArchiveFeature) != 0)
      return misuse("a member is an archive", "archive");
    return bytes_;
  }

 private:
  ByteSink* sink_;
  std::array<std::byte, container::kFileStartBytes> head_{};
  std::uint64_t bytes_ = 0;
  bool open_ = false;
  std::optional<Error> error_;  // first error that a write returned
};

}  // namespace

bool is_member_name(std::string_view name) {
  if (name.empty() || name.size() > kLongestName || name == "." || name == "..") return false;
  return std::none_of(name.begin(), name.end(), [](char c) {
    return c == '/' || c == '\\' || static_cast<unsigned char>(c) < ' ' || c == '\x7f';
  });
}

class __attribute__((visibility("hidden"))) ArchiveWriter::Impl {
 public:
  explicit Impl(ByteSink& sink) : sink_(&sink), member_(sink) {}

  Result<void> start() {
    list_.start.needed_features = container::kArchiveFeature;
    ByteWriter out;
    container::put(out, list_.start);
    bytes_ = out.bytes.size();
    return sink_->write(out.bytes);
  }
  Result<ByteSink*> add_member(const std::string& name) {
    if (auto status = end_member(); !status) return status.error();
    if (!is_member_name(name))
      return fail(misuse("'" + name + "' is not a valid member name", "archive"));
    if (!names_.insert(name).second)
      return fail(misuse("there are two members '" + name + "'", "archive"));
    list_.members.push_back({name, 0});
    in_member_ = true;
    member_.begin();
    return &member_;
  }
  Result<std::uint64_t> finish() {
    if (auto status = end_member(); !status) return status.error();
    ByteWriter list;
    container::put(list, list_);
    container::ChunkWriter chunks(*sink_);
    if (auto status = chunks.write(container::ChunkKind::members, list.bytes); !status)
      return fail(status.error());
    ByteWriter trailer;
    container::put_trailer(trailer, bytes_);
    if (auto status = sink_->write(trailer.bytes); !status) return fail(status.error());
    if (auto status = sink_->commit(); !status) return fail(status.error());
    failed_ = misuse("the archive is finished", "archive");
    return bytes_ + chunks.offset() + trailer.bytes.size();
  }

 private:
  Error fail(Error error) {
    failed_ = error;
    return error;
  }
  /// Ends the current member. Fails if an earlier call failed.
  Result<void> end_member() {
    if (failed_) return *failed_;
    if (!std::exchange(in_member_, false)) return {};
    const auto bytes = member_.end();
    if (!bytes) return fail(bytes.error());
    list_.members.back().bytes = *bytes;
    bytes_ += *bytes;
    return {};
  }

  ByteSink* sink_;
  MemberSink member_;
  bool in_member_ = false;
  std::uint64_t bytes_ = 0;  // size in bytes of the file start and of all members so far
  container::MemberList list_;
  std::set<std::string> names_;
  std::optional<Error> failed_;
};

ArchiveWriter::ArchiveWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ArchiveWriter::ArchiveWriter(ArchiveWriter&&) noexcept = default;
ArchiveWriter& ArchiveWriter::operator=(ArchiveWriter&&) noexcept = default;
ArchiveWriter::~ArchiveWriter() = default;

Result<ArchiveWriter> ArchiveWriter::create(ByteSink& sink) {
  auto impl = std::make_unique<Impl>(sink);
  if (auto status = impl->start(); !status) return status.error();
  return ArchiveWriter(std::move(impl));
}
Result<ByteSink*> ArchiveWriter::add_member(const std::string& name) {
  return impl_->add_member(name);
}
Result<std::uint64_t> ArchiveWriter::finish() { return impl_->finish(); }

bool looks_like_archive(std::span<const std::byte> head) {
  container::FileStart start;
  return file_start(head, start) && (start.needed_features & container::kArchiveFeature) != 0;
}

Result<ArchiveReader> ArchiveReader::open(RandomSource& source, const ReadLimits& limits) {
  const auto wrong = [](std::string detail, std::uint64_t offset,
                        ErrorCode code = ErrorCode::corrupt) {
    return Error{code, std::move(detail), "members", offset};
  };
  std::array<std::byte, container::kFileStartBytes> head{};
  container::FileStart start;
  if (source.size() < head.size()) return wrong("this is not an archive", 0);
  if (auto status = source.read_at(0, head); !status) return status.error();
  if (!file_start(head, start) || (start.needed_features & container::kArchiveFeature) == 0)
    return wrong("this is not an archive", 0);
  if (!container::is_known_version(start) || start.needed_features != container::kArchiveFeature)
    return wrong("the archive needs a newer reader", 0, ErrorCode::unsupported);

  const auto place = container::last_chunk(source, container::ChunkKind::members);
  if (!place) return place.error();
  const auto payload = container::read_chunk(source, *place, within_sizes(limits).max_chunk_bytes);
  if (!payload) return payload.error();
  ByteReader in(*payload);
  container::MemberList list;
  if (!container::get(in, list) || list.start != start) return wrong("is invalid", place->offset);

  ArchiveReader archive;
  std::set<std::string_view> names;
  std::uint64_t offset = container::kFileStartBytes;
  for (const container::Member& member : list.members) {
    if (!is_member_name(member.name) || !names.insert(member.name).second)
      return wrong("a member name is invalid or repeated", place->offset);
    if (member.bytes > place->offset - offset)
      return wrong("member '" + member.name + "' would not fit into the file", place->offset);
    archive.members_.push_back({member.name, offset, member.bytes});
    offset += member.bytes;
  }
  if (offset != place->offset)
    return wrong("there are bytes that belong to no member", place->offset);
  return archive;
}

const ArchiveMember* ArchiveReader::find(std::string_view name) const {
  const auto found = std::find_if(members_.begin(), members_.end(),
                                  [&](const ArchiveMember& member) { return member.name == name; });
  return found == members_.end() ? nullptr : &*found;
}

}  // namespace shm
