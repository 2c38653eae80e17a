// Archives as files: several meshes joined into one .shm file, and taken apart again.
// Members have the names of the files they came from. One that was a .shm file when it was joined
// keeps its name and its bytes; any other is compressed, and comes back in its own format.
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
  bool is_decoded = true;  // else it went in as it is, sound or not
};

// Writes `inputs`, compressed by `how` where they are no .shm files yet, as an archive into
// `sink`. Spools go to `spool_directory`, with so much memory. Throws Failure; misuse when two
// inputs have the same name.
std::vector<MemberReport> join_files(const std::vector<std::string>& inputs, ByteSink& sink,
                                     const CompressOptions& how, const std::string& spool_directory,
                                     std::size_t spool_memory, const MeshLimits& limits = {});

// By its first bytes; what is no file is none.
bool is_archive(const std::string& path);

class ArchiveFile {
 public:
  explicit ArchiveFile(const std::string& path);  // throws Failure
  const std::vector<ArchiveMember>& members() const { return list_.members(); }
  const ArchiveMember& find(const std::string& name) const;  // throws Failure (misuse)

  // Decodes a member. The spool must outlive the mesh. `threads`: as in open_shm.
  std::unique_ptr<StagedMesh> open(const ArchiveMember& member, Spool& spool,
                                   const Progress& progress, unsigned threads);
  FileSummary summarize(const ArchiveMember& member);
  // Its bytes as they stand, into a file that appears whole or not at all.
  void copy(const ArchiveMember& member, const std::string& path);
  // In the format that the mesh came from, or else the one of its name.
  void restore(const ArchiveMember& member, const std::string& path, Spool& spool,
               const Progress& progress, unsigned threads);
  std::string place(const ArchiveMember& member) const;  // "FILE: NAME", for messages
  // A view of it as it stands, as long as this lives.
  SectionSource bytes(const ArchiveMember& member);

 private:
  std::string path_;
  std::unique_ptr<FileRandomSource> file_;
  ArchiveReader list_;
};

// True for members that were .shm files when they were joined.
bool was_packed(const ArchiveMember& member);

}  // namespace shm::converters
