// Archives: several meshes joined into one .shm file, and extracted again. Each member has the name
// of the file from which it was made. A .shm file keeps its name and its bytes in the archive. Any
// other file is compressed, and is restored in its own format.
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
  bool is_decoded = true;  // false: its bytes were stored unchanged and not checked
};

// Writes `inputs` as an archive to `sink`. Files that are not .shm files are compressed with the
// options `how`. Spools use `spool_memory` bytes of memory and the folder `spool_directory`. Throws
// Failure; its code is misuse if two inputs have the same name.
std::vector<MemberReport> join_files(const std::vector<std::string>& inputs, ByteSink& sink,
                                     const CompressOptions& how, const std::string& spool_directory,
                                     std::size_t spool_memory, const MeshLimits& limits = {});

// Returns true if the file begins like an archive. Returns false if `path` is not a regular file.
bool is_archive(const std::string& path);

class ArchiveFile {
 public:
  explicit ArchiveFile(const std::string& path);  // throws Failure
  const std::vector<ArchiveMember>& members() const { return list_.members(); }
  const ArchiveMember& find(const std::string& name) const;  // throws Failure (misuse)

  // Decodes a member. The spool must outlive the mesh. `threads` has the same meaning as in
  // open_shm().
  std::unique_ptr<StagedMesh> open(const ArchiveMember& member, Spool& spool,
                                   const Progress& progress, unsigned threads);
  FileSummary summarize(const ArchiveMember& member);
  // Writes the unchanged bytes of a member to a file, which appears complete or not at all.
  void copy(const ArchiveMember& member, const std::string& path);
  // Restores a member in the format of the file from which it was made. If that format is unknown,
  // uses the format of the member's name.
  void restore(const ArchiveMember& member, const std::string& path, Spool& spool,
               const Progress& progress, unsigned threads);
  std::string place(const ArchiveMember& member) const;  // returns "FILE: NAME", for messages

  // Returns a view of the member's bytes, which is valid as long as this object.
  SectionSource bytes(const ArchiveMember& member);

 private:
  std::string path_;
  std::unique_ptr<FileRandomSource> file_;
  ArchiveReader list_;
};

// Returns true for members that were .shm files before they were joined.
bool was_packed(const ArchiveMember& member);

}  // namespace shm::converters
