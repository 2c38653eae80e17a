// Archives: files that contain several named .shm files, e.g. the pieces of a decomposed mesh or
// the files of a restarted run. Each member is a complete .shm file, stored unchanged, so that any
// Reader can read it.
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

/// File in an archive.
struct ArchiveMember {
  std::string name;          ///< file name of the member; is_member_name() returns true for it
  std::uint64_t offset = 0;  ///< offset of the member's first byte in the archive
  std::uint64_t bytes = 0;
};

/// Returns true if `name` is a plain file name of 1 to 255 bytes, not a path. Such a name contains
/// no '/', '\\' or control characters, and is neither "." nor "..".
SHM_API bool is_member_name(std::string_view name);

/// Writes an archive, member after member, front to back. After the first error every call returns
/// that error. An ArchiveWriter is not thread safe; distinct ArchiveWriters are independent.
class SHM_API ArchiveWriter {
 public:
  /// `sink` is borrowed and must outlive the ArchiveWriter.
  static Result<ArchiveWriter> create(ByteSink& sink);
  ArchiveWriter(ArchiveWriter&&) noexcept;
  ArchiveWriter& operator=(ArchiveWriter&&) noexcept;
  ~ArchiveWriter();

  /// Ends the previous member, if any, and begins a new member. `name` must be a valid member name,
  /// and no other member may have this name. The bytes written to the returned sink until the next
  /// call to the ArchiveWriter must form one .shm file that is not itself an archive. The
  /// ArchiveWriter checks only the file start (the first 16 bytes). The sink lives as long as the
  /// ArchiveWriter.
  Result<ByteSink*> add_member(const std::string& name);
  /// Ends the current member, writes the list of members and commits the sink. The file is valid
  /// only if finish() succeeds; the destructor reports no errors. Returns the total number of bytes
  /// written.
  Result<std::uint64_t> finish();

 private:
  class Impl;
  explicit ArchiveWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Returns true if a file that begins with `head` is an archive. The first 16 bytes of a file are
/// enough.
SHM_API bool looks_like_archive(std::span<const std::byte> head);

/// Lists the members of an archive. To read a member, use a SectionSource. Distinct ArchiveReaders
/// are independent.
class SHM_API ArchiveReader {
 public:
  /// Reads the list of members. The list may have at most limits.max_chunk_bytes bytes. `source` is
  /// borrowed during the call.
  static Result<ArchiveReader> open(RandomSource& source, const ReadLimits& limits = {});
  /// Returns the members in file order. All names are valid member names and distinct.
  const std::vector<ArchiveMember>& members() const { return members_; }
  /// Returns the member with the name `name`, or null.
  const ArchiveMember* find(std::string_view name) const;

 private:
  std::vector<ArchiveMember> members_;
};

}  // namespace shm
