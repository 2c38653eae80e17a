// SetArrays: a mesh whose sets become additional arrays, for formats without sets. The array of a
// node set or element set is 1 on the members of the set and 0 elsewhere. The array of a side set
// has a bit for each side of a cell; side 1 is the lowest bit.
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
  // Returns the labels of the sets that were left out. A set is left out if it contains a side
  // number outside 1..8, since only 8 bits are available. A set is also left out if the arrays of
  // all sets would need more than both 256 MiB and 64 times the size of the mesh.
  const std::vector<std::string>& left_out() const { return left_out_; }

 private:
  bool fill(const MeshSet& set, PagedArray& marks);

  std::size_t own_arrays_;
  // Values (uint8) of each added array, up to the last member of its set; all later values are 0.
  std::vector<PagedArray> marks_;
  std::vector<std::string> left_out_;
};

}  // namespace shm::converters
