// Collections of VTK XML files (.pvd files, which ParaView writes). A collection lists one file per
// time step.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace shm::converters {

struct CollectedFile {
  double time = 0;
  std::string file;  // path as written in the collection: absolute, or relative to the folder of
                     // the collection
};

// Returns true if a file that begins with `head` is a collection.
bool looks_like_collection(std::span<const std::byte> head);
// Returns the files that a collection lists, sorted by time. Throws Failure if the collection is
// invalid or lists two files for the same time.
std::vector<CollectedFile> read_collection(const std::string& path);
std::string collection_text(std::span<const CollectedFile> files);

}  // namespace shm::converters
