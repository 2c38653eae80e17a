// Collections of VTK XML files (.pvd, as written by ParaView), which list one file per time step.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace shm::converters {

struct CollectedFile {
  double time = 0;
  std::string file;  // path as written in the collection: relative to its folder, or absolute
};

// Returns true if a file that begins with `head` is a collection.
bool looks_like_collection(std::span<const std::byte> head);
// Returns the files of a collection, sorted by time. No two times are equal. Throws Failure.
std::vector<CollectedFile> read_collection(const std::string& path);
std::string collection_text(std::span<const CollectedFile> files);

}  // namespace shm::converters
