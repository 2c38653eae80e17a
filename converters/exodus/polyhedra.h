// Polyhedra of Exodus (NFACED blocks). In the file, they refer to faces, each of which is stored
// once in a face block; in the mesh, each polyhedron has its own faces, node by node. If every face
// is used, differs from all others and can be identified by its nodes, the face blocks and the
// lists of faces follow from the cells, except for the order of the faces.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "exodus/layout.h"

namespace shm::converters::exodus {

// The faces are in the order in which the polyhedra, in file order, first use them. If the extra
// kSharedFirst (int32[1]) exists, faces used several times come before all others. The extra
// kFaceNumbers (int32 or int64) gives their numbers, from 1, in this order; if missing: 1, 2, 3,
// ...
inline constexpr const char* kSharedFirst = "exodus/shared_faces_first";
inline constexpr const char* kFaceNumbers = "exodus/face_numbers";

// Returns the position of each face in that order. `uses` counts the uses of each face, in the
// order of first use.
std::vector<std::uint64_t> face_places(const std::vector<std::uint32_t>& uses, bool shared_first);

// The variables of a face block that stores its faces in `nodes`.
struct FaceBlock {
  int nodes = -1;   // variable
  int counts = -1;  // variable: number of nodes of each face; -1: all faces have `size`
  std::uint64_t faces = 0;
  std::uint64_t size = 0;
};
// Returns the face blocks before the first one that lacks these variables. Throws Failure if a
// variable has a wrong shape.
std::vector<FaceBlock> face_blocks(const Skeleton& skeleton, const Place& place);

// Gives blocks of polyhedra the shape `faces`. Variables that follow from their cells are then
// neither extras nor arrays.
void derive_faces(const Skeleton& skeleton, Layout& layout, const Place& place);

// Numbers different faces (lists of nodes) from 0, in the order of their first occurrence.
class FaceTable {
 public:
  // Returns the number of a face, which is the next number if the face is new.
  std::uint64_t number_of(std::span<const std::uint64_t> nodes);
  std::uint64_t size() const { return begins_.size() - 1; }
  std::span<const std::uint64_t> nodes(std::uint64_t face) const {
    return std::span(nodes_).subspan(begins_[face], begins_[face + 1] - begins_[face]);
  }

 private:
  std::vector<std::uint64_t> begins_{0}, nodes_;
  std::unordered_multimap<std::uint64_t, std::uint64_t> by_hash_;
};

}  // namespace shm::converters::exodus
