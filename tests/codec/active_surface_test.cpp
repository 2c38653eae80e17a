#include "mesh/active_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <vector>

namespace shm {
namespace {

constexpr std::array<std::uint8_t, 4> kCorners = {0, 3, 2, 1};

std::vector<std::uint32_t> add_vertices(ActiveSurface& surface, std::size_t count) {
  std::vector<std::uint32_t> slots(count);
  for (auto& slot : slots) slot = surface.add_vertex();
  return slots;
}

TEST(ActiveSurface, VerticesAreNumberedFromBirth) {
  ActiveSurface surface;
  EXPECT_EQ(surface.oldest_id(), 0u);
  const auto v = add_vertices(surface, 3);
  EXPECT_EQ(surface.next_id(), 3u);
  EXPECT_EQ(surface.active_vertices(), 3u);
  for (std::uint64_t id = 0; id < 3; ++id) {
    EXPECT_EQ(surface.vertex(v[id]).id, id);
    EXPECT_EQ(surface.slot_of(id), v[id]);
  }
  surface.finalize(v[1]);
  EXPECT_EQ(surface.oldest_id(), 0u);
  EXPECT_EQ(surface.slot_of(1), kNone);
  EXPECT_FALSE(surface.vertex(v[1]).alive);
  surface.finalize(v[0]);
  EXPECT_EQ(surface.oldest_id(), 2u);
  surface.finalize(v[2]);
  EXPECT_EQ(surface.oldest_id(), 3u);
  EXPECT_EQ(surface.active_vertices(), 0u);
}

TEST(ActiveSurface, SlotsAreReused) {
  ActiveSurface surface;
  for (int n = 0; n < 1000; ++n) {
    const auto v = add_vertices(surface, 8);
    surface.begin_cell();
    surface.add_face({v[0], v[1], v[2], v[3]}, kCorners, 0);
    surface.end_cell();
    for (std::uint32_t slot : v) surface.finalize(slot);
  }
  EXPECT_EQ(surface.next_id(), 8000u);
  EXPECT_LE(surface.vertex_slots(),
            256u + 3 * 8u);  // slots of finalized vertices are reused only after a delay
  EXPECT_LE(surface.cell_slots(), 2u);
}

TEST(ActiveSurface, FacesAreFoundInEitherDirectionFromAnyCorner) {
  ActiveSurface surface;
  const auto v = add_vertices(surface, 6);
  const std::uint32_t cell = surface.begin_cell();
  const std::uint32_t face = surface.add_face({v[0], v[1], v[2], v[3]}, kCorners, 0);
  surface.end_cell();
  for (std::uint32_t turn = 0; turn < 4; ++turn) {
    const auto at = [&](std::uint32_t i) { return v[(turn + i) % 4]; };
    EXPECT_EQ(surface.find_face(at(0), at(1), at(2), at(3)), face);
    EXPECT_EQ(surface.find_face(at(0), at(3), at(2), at(1)), face);
    EXPECT_EQ(surface.find_face(at(0), at(2), at(1), at(3)), kNone);  // crossed
    EXPECT_EQ(surface.find_path(at(0), at(1), at(2)), face * 4 + (turn + 1) % 4);
    EXPECT_EQ(surface.find_path(at(2), at(1), at(0)), face * 4 + (turn + 1) % 4);
    EXPECT_EQ(surface.find_path(at(0), at(1), at(3)), kNone);
  }
  EXPECT_EQ(surface.find_face(v[0], v[1], v[2], v[4]), kNone);
  EXPECT_EQ(surface.find_face(v[4], v[1], v[2], v[5]), kNone);
  EXPECT_EQ(surface.face(face).cell, cell);
  EXPECT_EQ(surface.face(face).owner_corner, kCorners);
}

TEST(ActiveSurface, TheNewestFaceIsFoundFirst) {
  ActiveSurface surface;
  const auto v = add_vertices(surface, 5);
  surface.begin_cell();
  const std::uint32_t older = surface.add_face({v[0], v[1], v[2], v[3]}, kCorners, 0);
  const std::uint32_t newer = surface.add_face({v[4], v[0], v[1], v[2]}, kCorners, 0);
  surface.end_cell();
  EXPECT_EQ(surface.find_path(v[0], v[1], v[2]) / 4, newer);
  surface.remove_face(newer);
  EXPECT_EQ(surface.find_path(v[0], v[1], v[2]) / 4, older);
}

TEST(ActiveSurface, AFaceGoesWithItsFirstVertex) {
  for (std::size_t gone = 0; gone < 4; ++gone) {
    ActiveSurface surface;
    const auto v = add_vertices(surface, 4);
    surface.begin_cell();
    const std::uint32_t face = surface.add_face({v[0], v[1], v[2], v[3]}, kCorners, 0);
    surface.end_cell();
    EXPECT_EQ(surface.vertex(v[0]).face_count, 1u);
    surface.finalize(v[gone]);
    EXPECT_FALSE(surface.face(face).alive);
    for (std::size_t i = 0; i < 4; ++i)
      if (i != gone) {
        EXPECT_EQ(surface.vertex(v[i]).face_count, 0u);
        EXPECT_EQ(surface.vertex(v[i]).first_face, kNone);
      }
  }
}

TEST(ActiveSurface, ACellKeepsItsSlotWhileItHasAFace) {
  ActiveSurface surface;
  const auto v = add_vertices(surface, 8);
  const std::uint32_t first = surface.begin_cell();
  const std::uint32_t a = surface.add_face({v[0], v[1], v[2], v[3]}, kCorners, 0);
  const std::uint32_t b = surface.add_face({v[4], v[5], v[6], v[7]}, kCorners, 0);
  surface.end_cell();
  const std::uint32_t second = surface.begin_cell();
  EXPECT_NE(second, first);
  surface.remove_face(a);
  surface.end_cell();  // the second cell has added no face, so its slot is free again
  const std::uint32_t third = surface.begin_cell();
  EXPECT_EQ(third, second);
  surface.remove_face(b);  // the last face of the first cell
  EXPECT_NE(surface.cell_slots(), 0u);
  surface.add_face({v[0], v[1], v[2], v[3]}, kCorners, 0);
  surface.end_cell();
  EXPECT_EQ(surface.begin_cell(), first);
}

// After random sequences of operations that add, remove and finalize elements, the surface has the
// same faces as a plain list.
TEST(ActiveSurface, LikeAPlainList) {
  std::mt19937_64 random(1);
  ActiveSurface surface;
  std::map<std::uint32_t, Quad> faces;
  std::vector<std::uint32_t> alive;
  std::map<std::uint32_t, std::uint64_t> ids;
  for (int n = 0; n < 5000; ++n) {
    while (alive.size() < 6 || random() % 3 == 0) {
      alive.push_back(surface.add_vertex());
      ids[alive.back()] = surface.next_id() - 1;
    }
    std::shuffle(alive.begin(), alive.end(), random);
    const Quad quad = {alive[0], alive[1], alive[2], alive[3]};
    surface.begin_cell();
    const std::uint32_t found = surface.find_face(quad[0], quad[1], quad[2], quad[3]);
    if (found == kNone) faces[surface.add_face(quad, kCorners, 0)] = quad;
    surface.end_cell();
    if (random() % 4 == 0 && !faces.empty()) {
      const auto any =
          std::next(faces.begin(), static_cast<std::ptrdiff_t>(random() % faces.size()));
      surface.remove_face(any->first);
      faces.erase(any);
    }
    while (alive.size() > 12) {
      const std::uint32_t gone = alive.back();
      alive.pop_back();
      ids.erase(gone);
      surface.finalize(gone);
      std::erase_if(faces, [&](const auto& face) {
        return std::find(face.second.begin(), face.second.end(), gone) != face.second.end();
      });
    }
    ASSERT_EQ(surface.active_vertices(), alive.size());
    std::uint64_t oldest = surface.next_id();
    std::map<std::uint32_t, std::uint32_t> count;
    for (const auto& [slot, id] : ids) oldest = std::min(oldest, id);
    for (const auto& [slot, face] : faces) {
      ASSERT_TRUE(surface.face(slot).alive);
      ASSERT_NE(surface.find_face(face[0], face[1], face[2], face[3]), kNone);
      for (std::uint32_t v : face) ++count[v];
    }
    for (std::uint32_t v : alive) ASSERT_EQ(surface.vertex(v).face_count, count[v]);
    ASSERT_EQ(surface.oldest_id(), oldest);
  }
}

TEST(ActiveSurface, MatesAreForgottenWithTheirFaces) {
  ActiveSurface surface;
  const auto v = add_vertices(surface, 6);
  surface.begin_cell();
  const std::uint32_t a = surface.add_face({v[0], v[1], v[2], v[3]}, kCorners, 0);
  const std::uint32_t b = surface.add_face({v[1], v[0], v[4], v[5]}, kCorners, 2);
  EXPECT_EQ(surface.mate(a * 4), kNone);
  surface.join(a * 4, b * 4, 3);
  EXPECT_EQ(surface.mate(a * 4), b * 4);
  EXPECT_EQ(surface.mate(b * 4), a * 4);
  EXPECT_EQ(surface.fan(b * 4), 3u);
  surface.join(a * 4 + 1, kNone, 700);
  EXPECT_EQ(surface.mate(a * 4 + 1), kNone);
  EXPECT_EQ(surface.fan(a * 4 + 1), 255u);
  surface.finalize(v[4]);
  EXPECT_FALSE(surface.face(b).alive);
  EXPECT_EQ(surface.mate(a * 4), kNone);
}

}  // namespace
}  // namespace shm
