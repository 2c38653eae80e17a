// Archives: several named .shm files in one file, e.g. the pieces of a decomposed mesh or the files
// of a restarted run. Each member is a complete .shm file, stored unchanged, so that any Reader can
// read it.
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
  std::uint64_t offset = 0;  ///< offset of its first byte in the archive
  std::uint64_t bytes = 0;
};

/// Returns true if `name` is a plain file name of 1 to 255 bytes, not a path: without '/', '\\' and
/// control characters, and neither "." nor "..".
SHM_API bool is_member_name(std::string_view name);

/// Writes members one after the other, front to back. After the first error every call returns that
/// error. Not thread safe; distinct ArchiveWriters are independent.
class SHM_API ArchiveWriter {
 public:
  /// `sink` is borrowed and must outlive the ArchiveWriter.
  static Result<ArchiveWriter> create(ByteSink& sink);
  ArchiveWriter(ArchiveWriter&&) noexcept;
  ArchiveWriter& operator=(ArchiveWriter&&) noexcept;
  ~ArchiveWriter();

  /// Ends the previous member and begins one named `name`, which must be a valid member name that
  /// is not in use yet. The bytes written to the returned sink until the next call of the
  /// ArchiveWriter must form one .shm file that is not itself an archive; only its first bytes are
  /// checked. The sink lives as long as the ArchiveWriter.
  Result<ByteSink*> add_member(const std::string& name);
  /// Ends the last member, writes the list of members and commits the sink. The file is valid only
  /// if this succeeds; the destructor reports nothing. Returns the total number of bytes written.
  Result<std::uint64_t> finish();

 private:
  class Impl;
  explicit ArchiveWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Returns true if a file that begins with `head` is an archive. 16 bytes are enough.
SHM_API bool looks_like_archive(std::span<const std::byte> head);

/// Lists the members of an archive; read a member through a SectionSource. Distinct readers are
/// independent.
class SHM_API ArchiveReader {
 public:
  /// Reads the list of members, whose size is limited by limits.max_chunk_bytes. `source` is
  /// borrowed during the call.
  static Result<ArchiveReader> open(RandomSource& source, const ReadLimits& limits = {});
  /// Members in file order. All names are valid member names and distinct.
  const std::vector<ArchiveMember>& members() const { return members_; }
  /// Returns the member of that name, or null.
  const ArchiveMember* find(std::string_view name) const;

 private:
  std::vector<ArchiveMember> members_;
};

}  // namespace shm
