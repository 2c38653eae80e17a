#include "pipeline/spiral_reorderer.h"

#include <algorithm>

#include "mesh/hexahedron.h"

namespace shm {

std::size_t SpiralReorderer::FaceHash::operator()(const Face& face) const {
  std::uint64_t h = 0;
  for (std::uint64_t v : face) h = (h ^ v) * 0x9e3779b97f4a7c15u + (h >> 29);
  return static_cast<std::size_t>(h);
}

auto SpiralReorderer::face_of(const Corners& corners, std::uint32_t face) -> Face {
  Face out{};
  for (std::size_t i = 0; i < 4; ++i) out[i] = corners[kFaceCorners[face][i]];
  std::sort(out.begin(), out.end());
  return out;
}

void SpiralReorderer::push_hexahedron(std::uint32_t handle, const Corners& corners) {
  cells_[handle] = {next_age_, true, corners};
  by_age_[next_age_++] = handle;
  for (std::uint32_t f = 0; f < 6; ++f) {
    auto& sharing = faces_.try_emplace(face_of(corners, f), std::array{kNone, kNone}).first->second;
    if (sharing[0] == kNone)
      sharing[0] = handle;
    else if (sharing[1] == kNone)
      sharing[1] = handle;
  }
}

void SpiralReorderer::push_other(std::uint32_t handle) {
  cells_[handle] = {next_age_, false, {}};
  by_age_[next_age_++] = handle;
}

void SpiralReorderer::remove(std::uint32_t handle) {
  const Waiting cell = cells_.at(handle);
  cells_.erase(handle);
  by_age_.erase(cell.age);
  if (!cell.hexahedral) return;
  for (std::uint32_t f = 0; f < 6; ++f) {
    const auto found = faces_.find(face_of(cell.corners, f));
    if (found == faces_.end()) continue;  // a repeated face of the same cell
    for (std::uint32_t& sharing : found->second)
      if (sharing == handle) sharing = kNone;
    if (found->second[0] == kNone && found->second[1] == kNone) faces_.erase(found);
  }
}

std::uint32_t SpiralReorderer::pop() {
  if (has_previous_) {
    const Label first = last_was_horizontal_ ? horizontal_ : vertical_;
    const Label second = last_was_horizontal_ ? vertical_ : horizontal_;
    for (Label label : {first, second, kFront, kLeft, kRight, kTop, kBottom, kBack}) {
      const auto found = faces_.find(face_of(previous_, face_at_[label]));
      if (found == faces_.end()) continue;
      const std::uint32_t handle = found->second[0] != kNone ? found->second[0] : found->second[1];
      const Corners next = cells_.at(handle).corners;
      const Face shared = found->first;
      remove(handle);
      std::uint32_t entered = 0;
      while (entered < 5 && face_of(next, entered) != shared) ++entered;
      walk_through(label, entered, next);
      return handle;
    }
  }
  const std::uint32_t oldest = by_age_.begin()->second;
  const Waiting cell = cells_.at(oldest);
  remove(oldest);
  if (cell.hexahedral) start_at(cell.corners);
  return oldest;
}

void SpiralReorderer::start_at(const Corners& corners) {
  has_previous_ = true;
  previous_ = corners;
  face_at_ = {5, 1, 3, 4, 2, 0};  // indices of the faces in the order front, left, right, top,
                                  // bottom, back
}

void SpiralReorderer::walk_through(Label label, std::uint32_t entered, const Corners& next) {
  if (label == kLeft || label == kRight) {
    horizontal_ = label;
    last_was_horizontal_ = true;
  } else if (label == kTop || label == kBottom) {
    vertical_ = label;
    last_was_horizontal_ = false;
  }
  // For each face through which the walk leaves the old cell: the orientation of the next cell. A
  // row lists the faces of the old cell that become the left, right, top and bottom of the next
  // cell. For example, after a turn to the right, the old front is on the left.
  constexpr std::array<std::array<std::uint8_t, 4>, kLabels> kBecomes = {{
      {kLeft, kRight, kTop, kBottom},  // row for leaving through the front
      {kBack, kFront, kTop, kBottom},  // row for leaving through the left face
      {kFront, kBack, kTop, kBottom},  // row for leaving through the right face
      {kLeft, kRight, kBack, kFront},  // row for leaving through the top
      {kLeft, kRight, kFront, kBack},  // row for leaving through the bottom
      {kRight, kLeft, kTop, kBottom},  // row for leaving through the back
  }};
  // Returns the face of the next cell that continues `old_face` of the old cell: the two faces
  // share an edge of the face between the two cells.
  const auto carried = [&](std::uint32_t old_face) -> std::uint8_t {
    const Face passed = face_of(previous_, face_at_[label]), side = face_of(previous_, old_face);
    for (std::uint8_t f = 0; f < 6; ++f) {
      if (f == entered || f == kOppositeFace[entered]) continue;
      const Face candidate = face_of(next, f);
      const auto shared = std::count_if(candidate.begin(), candidate.end(), [&](std::uint64_t v) {
        return std::binary_search(passed.begin(), passed.end(), v) &&
               std::binary_search(side.begin(), side.end(), v);
      });
      if (shared >= 2) return f;
    }
    return kOppositeFace[entered];
  };
  std::array<std::uint8_t, kLabels> faces{};
  for (std::size_t i = 0; i < 4; ++i) faces[kLeft + i] = carried(face_at_[kBecomes[label][i]]);
  faces[kFront] = kOppositeFace[entered];
  faces[kBack] = static_cast<std::uint8_t>(entered);
  face_at_ = faces;
  previous_ = next;
}

}  // namespace shm
