// SetArrays: a mesh whose sets are converted to additional arrays, for formats without sets. The
// array of a node set or element set is 1 for members of the set and 0 for all other vertices or
// cells. The array of a side set has 8 bits for each cell: the lowest bit is 1 if side 1 of the
// cell is in the set, the next bit is 1 if side 2 is in the set, and so on.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/spool.h"
#include "mesh/forwarding_mesh.h"
#include "sets/transfer_sets.h"

namespace shm::converters {

class SetArrays final : public ForwardingMesh {
 public:
  SetArrays(MeshSource& source, const std::vector<MeshSet>& sets, Spool& spool);
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;
  // Returns the labels of the sets that were not converted to arrays. A set is not converted if it
  // contains a side number outside 1..8, because there are only 8 bits per cell, or if the total
  // size of the arrays of all sets would exceed the larger of two limits: 256 MiB, and 64 times the
  // size of the mesh.
  const std::vector<std::string>& left_out() const { return left_out_; }

 private:
  bool fill(const MeshSet& set, PagedArray& marks);

  std::size_t own_arrays_;
  // Values (uint8) of each added array, up to the last member of its set. The values after the last
  // member are 0 and are not stored.
  std::vector<PagedArray> marks_;
  std::vector<std::string> left_out_;
};

}  // namespace shm::converters
