// Archives: several .shm files in one file, by name: the pieces of a decomposed mesh, the files of
// a run that was restarted. Each member is a whole .shm file and stands as it is, so that every
// Reader reads it.
// spec: "Archive"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shm/io.h"
#include "shm/reader.h"

namespace shm {

/// One file in an archive.
struct ArchiveMember {
  std::string name;          ///< see is_member_name()
  std::uint64_t offset = 0;  ///< of its first byte in the archive
  std::uint64_t bytes = 0;
};

/// True for 1 to 255 bytes that name a file and no place: no '/', '\\' or control character,
/// neither
/// "." nor "..".
SHM_API bool is_member_name(std::string_view name);

/// Takes members one after the other, front to back. After the first error every call returns that
/// error. Not thread safe; distinct ArchiveWriters are independent.
class SHM_API ArchiveWriter {
 public:
  /// `sink` is borrowed and must outlive the ArchiveWriter.
  static Result<ArchiveWriter> create(ByteSink& sink);
  ArchiveWriter(ArchiveWriter&&) noexcept;
  ArchiveWriter& operator=(ArchiveWriter&&) noexcept;
  ~ArchiveWriter();

  /// Ends the member before, and begins one named `name`: a member name that is not taken. What is
  /// written to the sink until the next call of the ArchiveWriter must be one .shm file, which is
  /// no archive itself; only its first bytes are checked. The sink lives as long as the
  /// ArchiveWriter.
  Result<ByteSink*> add_member(const std::string& name);
  /// Ends the last member, writes the list of all and commits the sink. The file is good only if
  /// this succeeds; the destructor is silent. Returns all bytes written.
  Result<std::uint64_t> finish();

 private:
  class Impl;
  explicit ArchiveWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// True when a file that begins with `head` (16 bytes do) is an archive.
SHM_API bool looks_like_archive(std::span<const std::byte> head);

/// Lists an archive; members are read through SectionSource. Distinct readers are independent.
class SHM_API ArchiveReader {
 public:
  /// Reads the list of members, at most limits.max_chunk_bytes. `source` is borrowed during the
  /// call.
  static Result<ArchiveReader> open(RandomSource& source, const ReadLimits& limits = {});
  /// In the order of the file; names are member names, no two alike.
  const std::vector<ArchiveMember>& members() const { return members_; }
  /// The first member of that name, or null.
  const ArchiveMember* find(std::string_view name) const;

 private:
  std::vector<ArchiveMember> members_;
};

}  // namespace shm
