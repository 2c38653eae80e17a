// Collections of VTK XML files (.pvd, as ParaView writes them): a file for each time step.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace shm::converters {

struct CollectedFile {
  double time = 0;
  std::string file;  // as the collection has it: relative to its folder, or absolute
};

// Whether a file that begins with `head` is one.
bool looks_like_collection(std::span<const std::byte> head);
// Its files, in the order of their times, which all differ. Throws Failure.
std::vector<CollectedFile> read_collection(const std::string& path);
std::string collection_text(std::span<const CollectedFile> files);

}  // namespace shm::converters
