// Decides which arrays and extras are compared, and with which tolerances, from the names in the
// user's options.
#pragma once

#include <string>

#include "compare/diff.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

class DiffNames {
 public:
  // Throws Failure (misuse) if a name occurs in neither mesh, or if a tolerance is invalid.
  DiffNames(const DiffOptions& options, const MeshInfo& a, const MeshInfo& b);

  bool is_ignored(const std::string& path) const;  // e.g. "coordinates", "point/T"

  // Returns true if the item is to be compared, and is not ignored.
  bool is_wanted(const std::string& path) const;
  bool is_ignored_extra(const std::string& key) const;
  Accuracy accuracy_of(const std::string& path) const;
  Accuracy accuracy_of_coordinates() const;

 private:
  const DiffOptions& options_;
};

}  // namespace shm::converters
