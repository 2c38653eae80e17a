// Polyhedra of Exodus (NFACED blocks): in the file they name faces, which stand once in face
// blocks; in the mesh each has its own faces, node by node. Where every face is used, is unlike all
// others and can be told by its nodes, the face blocks and the lists of faces follow from the
// cells, but for the order of the faces.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "exodus/layout.h"

namespace shm::converters::exodus {

// The faces come in the order in which polyhedra, in the order of the file, first have them; where
// there is kSharedFirst (int32[1]), those that several uses name come before all others.
// kFaceNumbers (int32 or int64): their numbers, from 1, in this order. Missing: 1, 2, 3, ...
inline constexpr const char* kSharedFirst = "exodus/shared_faces_first";
inline constexpr const char* kFaceNumbers = "exodus/face_numbers";

// Places of faces in that order: `uses` of each, as they first come.
std::vector<std::uint64_t> face_places(const std::vector<std::uint32_t>& uses, bool shared_first);

// The variables of a face block that has all its faces in `nodes`.
struct FaceBlock {
  int nodes = -1;   // variable
  int counts = -1;  // variable: nodes of each face; -1: all have `size`
  std::uint64_t faces = 0;
  std::uint64_t size = 0;
};
// Those before the first that has no such variables. Throws Failure where shapes are wrong.
std::vector<FaceBlock> face_blocks(const Skeleton& skeleton, const Place& place);

// Blocks of polyhedra get the shape `faces`, and what follows from their cells is neither extra nor
// array any more.
void derive_faces(const Skeleton& skeleton, Layout& layout, const Place& place);

// Faces that are different lists of nodes, numbered from 0 as they come.
class FaceTable {
 public:
  // The number of a face; the next one if it has not come before.
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
