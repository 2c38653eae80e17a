// SetArrays: a mesh whose sets become additional arrays, for formats without sets. The array of a
// set is 1 on its nodes or cells and 0 elsewhere. The array of a side set has a bit for each side
// of a cell; side 1 is the lowest bit.
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
  // Labels of the sets that were left out: those with a side number beyond the available bits, and
  // those that would make the arrays of all sets larger than both 256 MiB and 64 times the mesh.
  const std::vector<std::string>& left_out() const { return left_out_; }

 private:
  bool fill(const MeshSet& set, PagedArray& marks);

  std::size_t own_arrays_;
  std::vector<PagedArray> marks_;  // uint8, for each added array, up to the last member
  std::vector<std::string> left_out_;
};

}  // namespace shm::converters
