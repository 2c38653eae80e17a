// Archives: several meshes joined into one .shm file, and extracted again. Each member has the name
// of its input file. A .shm file is stored unchanged. Any other file is compressed when it is
// joined, and restored in its original format when it is extracted.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/spool.h"
#include "compression/compress.h"
#include "compression/decompress.h"
#include "mesh/mesh_source.h"
#include "shm/archive.h"
#include "shm/io.h"

namespace shm::converters {

struct MemberReport {
  std::string name;
  std::uint64_t input_bytes = 0, bytes = 0;
  bool is_decoded = true;  // false: the member was stored as unchanged bytes that were not checked
};

// Writes the files `inputs` as an archive to `sink`. Inputs that are not .shm files are compressed
// with the options `how`. Meshes are kept in spools (temporary storage). Each spool uses at most
// `spool_memory` bytes of memory, and has a temporary file in `spool_directory`. Throws Failure;
// its code is misuse if two inputs have the same name.
std::vector<MemberReport> join_files(const std::vector<std::string>& inputs, ByteSink& sink,
                                     const CompressOptions& how, const std::string& spool_directory,
                                     std::size_t spool_memory, const MeshLimits& limits = {});

// Returns true if the first bytes of the file are those of an archive. Returns false if `path` is
// not a regular file.
bool is_archive(const std::string& path);

class ArchiveFile {
 public:
  explicit ArchiveFile(const std::string& path);  // throws Failure
  const std::vector<ArchiveMember>& members() const { return list_.members(); }
  const ArchiveMember& find(const std::string& name) const;  // throws Failure (misuse)

  // Decodes a member to a mesh. `spool` must outlive the mesh. `threads` has the same meaning as in
  // open_shm().
  std::unique_ptr<StagedMesh> open(const ArchiveMember& member, Spool& spool,
                                   const Progress& progress, unsigned threads);
  FileSummary summarize(const ArchiveMember& member);
  // Writes the bytes of a member, unchanged, to a file. The file appears under its name only when
  // it is complete.
  void copy(const ArchiveMember& member, const std::string& path);
  // Writes a member in the format of its input file. If that format is unknown, the extension of
  // the member's name determines the format.
  void restore(const ArchiveMember& member, const std::string& path, Spool& spool,
               const Progress& progress, unsigned threads);
  std::string place(const ArchiveMember& member) const;  // returns "FILE: NAME", for messages

  // Returns a view of the member's bytes, which is valid as long as this object exists.
  SectionSource bytes(const ArchiveMember& member);

 private:
  std::string path_;
  std::unique_ptr<FileRandomSource> file_;
  ArchiveReader list_;
};

// Returns true if the member was already a .shm file when it was joined.
bool was_packed(const ArchiveMember& member);

}  // namespace shm::converters
