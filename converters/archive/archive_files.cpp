#include "archive/archive_files.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <system_error>
#include <utility>

#include "base/failure.h"
#include "base/output_file.h"
#include "files/mesh_files.h"
#include "formats/formats.h"
#include "shm/summary.h"

namespace shm::converters {
namespace {

constexpr std::size_t kCopyBytes = std::size_t{1} << 20;

// Counts the bytes that it passes on.
class CountingSink final : public ByteSink {
 public:
  explicit CountingSink(ByteSink& sink) : sink_(&sink) {}
  Result<void> write(std::span<const std::byte> more) override {
    bytes += more.size();
    return sink_->write(more);
  }
  std::uint64_t bytes = 0;

 private:
  ByteSink* sink_;
};

void copy_all(ByteSource& from, const std::string& name, ByteSink& to) {
  std::vector<std::byte> piece(kCopyBytes);
  while (const std::size_t n = unwrap(from.read(piece), name))
    unwrap(to.write(std::span(piece).first(n)));
}

// Returns the member name of each input: its file name without the folder. Throws Failure (misuse)
// if two inputs have the same name.
std::map<std::string, std::string> member_names(const std::vector<std::string>& inputs) {
  std::map<std::string, std::string> names;  // maps each input to its name in the archive
  std::map<std::string, std::string> taken;  // maps each name in the archive to its input
  for (const std::string& input : inputs) {
    const std::string name = std::filesystem::path(input).filename().string();
    const auto [entry, is_new] = taken.emplace(name, input);
    if (!is_new)
      throw Failure(ErrorCode::misuse, "two files would be called '" + name +
                                           "' in the archive: " + entry->second + " and " + input);
    if (!is_member_name(name) || is_archive(input))
      throw Failure(ErrorCode::misuse,
                    "'" + input + "' cannot be added to an archive, because it is an archive " +
                        "itself, or because its name is not valid on all systems");
    names[input] = name;
  }
  return names;
}

}  // namespace

std::vector<MemberReport> join_files(const std::vector<std::string>& inputs, ByteSink& sink,
                                     const CompressOptions& how, const std::string& spool_directory,
                                     std::size_t spool_memory, const MeshLimits& limits) {
  const auto names = member_names(inputs);
  ArchiveWriter archive = unwrap(ArchiveWriter::create(sink));
  std::vector<MemberReport> report;
  for (const std::string& input : inputs) {
    CountingSink member(*unwrap(archive.add_member(names.at(input))));
    const Format* format = format_of_file(input);
    const bool is_packed = format != nullptr && format->name == "shm";
    if (is_packed) {
      copy_all(*unwrap(FileSource::open(input), input), input, member);
    } else {
      Spool spool(spool_directory, spool_memory, limits);
      const auto mesh = open_mesh(input, spool, how.progress);
      compress_mesh(*mesh, member, how, spool);
    }
    report.push_back(
        {names.at(input), std::filesystem::file_size(input), member.bytes, !is_packed});
  }
  unwrap(archive.finish());
  return report;
}

bool is_archive(const std::string& path) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) return false;
  if (path == "-") return false;
  std::array<std::byte, 16> head{};
  const auto file = unwrap(FileSource::open(path), path);
  return looks_like_archive(std::span(head).first(unwrap(file->read(head), path)));
}

bool was_packed(const ArchiveMember& member) { return member.name.ends_with(".shm"); }

namespace {

Result<ArchiveReader> no_archive() {
  return Error{.code = ErrorCode::unsupported,
               .detail = "is not an archive of several files made by shm join"};
}

}  // namespace

ArchiveFile::ArchiveFile(const std::string& path)
    : path_(path),
      file_(unwrap(FileRandomSource::open(path), path)),
      list_(unwrap(is_archive(path) ? ArchiveReader::open(*file_) : no_archive(), path)) {}

const ArchiveMember& ArchiveFile::find(const std::string& name) const {
  if (const ArchiveMember* member = list_.find(name)) return *member;
  throw Failure(ErrorCode::misuse, "there is no '" + name + "' in the archive", path_);
}

std::string ArchiveFile::place(const ArchiveMember& member) const {
  return path_ + ": " + member.name;
}

SectionSource ArchiveFile::bytes(const ArchiveMember& member) {
  return {*file_, member.offset, member.bytes};
}

std::unique_ptr<StagedMesh> ArchiveFile::open(const ArchiveMember& member, Spool& spool,
                                              const Progress& progress, unsigned threads) {
  SectionSource stored = bytes(member);
  const auto end = bytes_of_file(stored);
  return stage_shm(stored, place(member), member.bytes, spool, progress, threads, end ? *end : 0);
}

FileSummary ArchiveFile::summarize(const ArchiveMember& member) {
  SectionSource stored = bytes(member);
  return summarize_shm(stored, place(member));
}

void ArchiveFile::copy(const ArchiveMember& member, const std::string& path) {
  SectionSource stored = bytes(member);
  OutputFile output(path);
  ByteSink& sink = output.sink();
  copy_all(stored, place(member), sink);
  output.commit();
}

void ArchiveFile::restore(const ArchiveMember& member, const std::string& path, Spool& spool,
                          const Progress& progress, unsigned threads) {
  const auto mesh = open(member, spool, progress, threads);
  const Format* format = format_named(mesh->info().schema.source_format);
  write_mesh(*mesh, path, format != nullptr ? *format : output_format(path, {}), spool);
}

}  // namespace shm::converters
