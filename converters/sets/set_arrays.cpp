#include "sets/set_arrays.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "mesh/unique_names.h"

namespace shm::converters {
namespace {

// The total size of the arrays of all sets is limited to a number of bytes or a multiple of the
// size of the mesh, whichever is larger. A limit is needed because an array needs one byte per
// vertex or cell of the mesh, even if its set is small.
constexpr std::uint64_t kSetBytesAllowed = std::uint64_t{256} << 20, kMostOfMesh = 64;

// Estimates how many bytes the coordinates and the connectivity of a mesh need in most file
// formats.
std::uint64_t bytes_of_mesh(const MeshInfo& info) { return 24 * info.vertices + 64 * info.cells(); }

}  // namespace

SetArrays::SetArrays(MeshSource& source, const std::vector<MeshSet>& sets, Spool& spool)
    : ForwardingMesh(source), own_arrays_(source.info().schema.arrays.size()) {
  info_ = source.info();
  UniqueNames names;
  for (const ArrayInfo& array : info_.schema.arrays) names.keep(array.location, array.name);
  std::uint64_t room = std::max(kSetBytesAllowed, kMostOfMesh * bytes_of_mesh(info_));
  for (const MeshSet& set : sets) {
    ArrayInfo info;
    info.location = set.kind == MeshSet::Kind::nodes ? Location::point : Location::cell;
    const std::uint64_t bytes = info.location == Location::point ? info_.vertices : info_.cells();
    if (bytes > room) {
      left_out_.push_back(label_of(set) + " (the arrays of all sets would be too large)");
      continue;
    }
    PagedArray marks(spool, 1);
    if (!fill(set, marks)) {
      left_out_.push_back(label_of(set));
      continue;
    }
    room -= bytes;
    info.type = ScalarType::uint8;
    info.name = names.take(info.location, short_name_of(set));
    if (!set.blocks.empty()) info.blocks = set.blocks;
    info_.schema.arrays.push_back(std::move(info));
    marks_.push_back(std::move(marks));
  }
}

bool SetArrays::fill(const MeshSet& set, PagedArray& marks) {
  constexpr std::int32_t kMostSides = 8;
  for (std::size_t i = 0; i < set.members.size(); ++i) {
    const std::uint64_t member = set.members[i];
    std::uint8_t mark = 1;
    if (set.kind == MeshSet::Kind::sides) {
      const std::int32_t side = set.sides[i];
      if (side < 1 || side > kMostSides) return false;
      mark = static_cast<std::uint8_t>(1 << (side - 1));
      if (member < marks.size()) mark |= marks.get<std::uint8_t>(member);
    }
    marks.set(member, mark);
  }
  return true;
}

void SetArrays::read_array(std::size_t array, std::uint64_t step, std::uint64_t first,
                           std::uint64_t count, std::byte* out) {
  if (array < own_arrays_) return source_.read_array(array, step, first, count, out);
  // If the set consists of whole blocks, the array covers only these blocks, and all its values
  // are 1.
  if (!info_.schema.arrays[array].blocks.empty()) {
    std::fill_n(out, count, std::byte{1});
    return;
  }
  PagedArray& marks = marks_[array - own_arrays_];
  const std::uint64_t marked = first < marks.size() ? std::min(count, marks.size() - first) : 0;
  if (marked > 0) marks.read(first, marked, out);
  std::fill(out + marked, out + count, std::byte{0});
}

}  // namespace shm::converters
