// Collections of VTK XML files (.pvd, as ParaView writes them): a file for each time step.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace shm::converters {

struct CollectedFile {
  double time = 0;
  std::string file;  // as the collection has it: relative to its folder, or absolute
};

std::string collection_text(std::span<const CollectedFile> files);

}  // namespace shm::converters
