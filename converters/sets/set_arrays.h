// SetArrays: a mesh whose sets are arrays behind its own, for formats without sets: 1 on the nodes
// or cells of a set; for a side set the sides of each cell as bits, side 1 the lowest. 0 elsewhere.
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
  // Labels of the sets with a side beyond the bits that there are, and of those that would make the
  // arrays of all sets more than 256 MiB and 64 times as large as the mesh.
  const std::vector<std::string>& left_out() const { return left_out_; }

 private:
  bool fill(const MeshSet& set, PagedArray& marks);

  std::size_t own_arrays_;
  std::vector<PagedArray> marks_;  // uint8, of each added array, up to the last member
  std::vector<std::string> left_out_;
};

}  // namespace shm::converters
