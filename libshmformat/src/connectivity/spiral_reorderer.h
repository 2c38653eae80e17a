// Spiral reorderer: the delay buffer. Of the cells waiting it picks the one that hugs the
// previous one best, so that gates are found on the previous hexahedron more often.
// in: cells in input order     out: the same cells; one that nothing leads to may wait long, but
// never more cells wait than the buffer holds
// source: paper section 3.1.1; nothing of it is part of the format: a reader sees only the order.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <unordered_map>

#include "surface/number_map.h"

namespace shm {

class SpiralReorderer {
 public:
  using Corners = std::array<std::uint64_t, 8>;  // any names of vertices, corners as stored

  /// `handle` is the caller's; handles of waiting cells are different.
  void push_hexahedron(std::uint32_t handle, const Corners& corners);
  void push_other(std::uint32_t handle);
  std::size_t waiting() const { return by_age_.size(); }
  /// Must hold: something waits. Picks, removes and returns it.
  std::uint32_t pop();

 private:
  /// Faces of the previous hexahedron, seen by somebody who walks through the mesh.
  enum Label : std::uint8_t { kFront, kLeft, kRight, kTop, kBottom, kBack, kLabels };
  using Face = std::array<std::uint64_t, 4>;  // sorted vertex numbers
  struct FaceHash {
    std::size_t operator()(const Face& face) const;
  };
  struct Waiting {
    std::uint64_t age = 0;
    bool hexahedral = false;
    Corners corners{};
  };

  static Face face_of(const Corners& corners, std::uint32_t face);
  void remove(std::uint32_t handle);
  void walk_through(Label label, std::uint32_t entered_face, const Corners& next);
  void start_at(const Corners& corners);

  std::uint64_t next_age_ = 0;
  std::map<std::uint64_t, std::uint32_t> by_age_;
  std::unordered_map<std::uint32_t, Waiting> cells_;
  std::unordered_map<Face, std::array<std::uint32_t, 2>, FaceHash> faces_;  // at most two each

  bool has_previous_ = false;
  Corners previous_{};
  std::array<std::uint8_t, kLabels> face_at_{};  // label -> face of previous_
  Label horizontal_ = kRight, vertical_ = kTop;
  bool last_was_horizontal_ = true;
};

}  // namespace shm
