// Tests of sets that are stored as extras: sets are restored unchanged, also after writing and
// reading a file, and invalid sets are refused.
#include "shm/sets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <numeric>
#include <random>

#include "shm/mesh.h"

namespace shm {
namespace {

using Kind = MeshSet::Kind;
constexpr SetBounds kBounds{1000, 500, 3};

template <class T>
Extra list(std::string key, ScalarType type, Reference refers, const std::vector<T>& values) {
  Extra extra{std::move(key), type, refers, {values.size()}, {}};
  extra.data.resize(values.size() * sizeof(T));
  if (!values.empty()) std::memcpy(extra.data.data(), values.data(), extra.data.size());
  return extra;
}
Extra numbers(std::string key, const std::vector<std::int32_t>& values,
              Reference refers = Reference::nothing) {
  return list(std::move(key), ScalarType::int32, refers, values);
}
Extra vertices(std::string key, const std::vector<std::int32_t>& values) {
  return numbers(std::move(key), values, Reference::vertex);
}
Extra cells(std::string key, const std::vector<std::int32_t>& values) {
  return numbers(std::move(key), values, Reference::cell);
}

std::vector<MeshSet> of_every_kind() {
  MeshSet corner{Kind::nodes, 1, "corner", {999, 0, 0, 5}, {}, {}, {}};
  MeshSet weighted{Kind::nodes, -7, "", {1, 2}, {}, {}, {.5, 1}};
  MeshSet empty{Kind::nodes, 3, "", {}, {}, {}, {}};
  MeshSet inlet{Kind::sides, std::int64_t{1} << 40, "inlet", {3, 3, 499}, {1, 6, 2}, {}, {}};
  MeshSet outlet{Kind::sides, 2, "", {7}, {4}, {}, {.1, .2, .3, 1}};
  MeshSet steel{Kind::elements, 1, "steel", {}, {}, {0, 2}, {}};
  MeshSet both{Kind::elements, 9, "", {8, 9}, {}, {1}, {3, 1e300}};
  return {corner, weighted, empty, inlet, outlet, steel, both};
}

std::vector<std::string> keys_of(const std::vector<Extra>& extras) {
  std::vector<std::string> keys;
  for (const Extra& extra : extras) keys.push_back(extra.key);
  return keys;
}

TEST(Sets, ComeBack) {
  const std::vector<MeshSet> sets = of_every_kind();
  const auto extras = extras_of_sets(sets);
  ASSERT_TRUE(extras) << extras.error().message();
  const auto back = sets_of_extras(*extras, kBounds);
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(*back, sets);
  EXPECT_EQ(*extras_of_sets(*back), *extras);
}

TEST(Sets, SayNoMoreThanTheyMust) {
  const auto extras = extras_of_sets(of_every_kind());
  ASSERT_TRUE(extras);
  EXPECT_EQ(keys_of(*extras),
            (std::vector<std::string>{
                "mesh/node_set/0/name", "mesh/node_set/0/members", "mesh/node_set/1/id",
                "mesh/node_set/1/members", "mesh/node_set/1/factors", "mesh/node_set/2/id",
                "mesh/side_set/0/id", "mesh/side_set/0/name", "mesh/side_set/0/members",
                "mesh/side_set/0/sides", "mesh/side_set/1/members", "mesh/side_set/1/sides",
                "mesh/side_set/1/factors", "mesh/element_set/0/name", "mesh/element_set/0/blocks",
                "mesh/element_set/1/id", "mesh/element_set/1/members", "mesh/element_set/1/blocks",
                "mesh/element_set/1/factors"}));
  for (const Extra& extra : *extras) {
    if (extra.key.ends_with("/members")) {
      EXPECT_EQ(extra.type, ScalarType::int32);
      EXPECT_EQ(extra.refers,
                extra.key.starts_with("mesh/node_set/") ? Reference::vertex : Reference::cell);
    }
  }
  const auto type_of = [&](std::string_view key) {
    return std::find_if(extras->begin(), extras->end(),
                        [&](const Extra& extra) { return extra.key == key; })
        ->type;
  };
  EXPECT_EQ(type_of("mesh/node_set/1/factors"), ScalarType::float32);
  EXPECT_EQ(type_of("mesh/side_set/1/factors"), ScalarType::float64);
  EXPECT_EQ(type_of("mesh/side_set/0/id"), ScalarType::int64);
  const MeshSet ones{Kind::nodes, 1, "", {1, 2}, {}, {}, {1, 1}};
  EXPECT_EQ(keys_of(*extras_of_sets({&ones, 1})),
            (std::vector<std::string>{"mesh/node_set/0/members"}));
}

// After writing and reading a file, a set refers to the same vertices and cells, even if the file
// renumbers the mesh.
TEST(Sets, FollowTheMeshThroughAFile) {
  Mesh mesh;
  mesh.schema.blocks.resize(1);
  constexpr std::size_t kCells = 40;
  for (std::size_t i = 0; i <= kCells; ++i)
    for (int corner = 0; corner < 4; ++corner)
      for (const double x : {double(i), double(corner & 1), double(corner >> 1)}) {
        const auto* bytes = reinterpret_cast<const std::byte*>(&x);
        mesh.xyz.insert(mesh.xyz.end(), bytes, bytes + sizeof x);
      }
  for (const std::size_t cell : {kCells - 1, std::size_t{0}, std::size_t{20}}) {
    mesh.cell_blocks.push_back(0);
    for (const int corner : {0, 1, 3, 2, 4, 5, 7, 6})
      mesh.corners.push_back(4 * cell + static_cast<std::size_t>(corner));
    mesh.corner_begin.push_back(mesh.corners.size());
  }
  const MeshSet nodes{Kind::nodes, 5, "n", {4 * (kCells - 1), 1, 0}, {}, {}, {}};
  const MeshSet sides{Kind::sides, 6, "s", {2, 0}, {5, 1}, {}, {}};
  mesh.extras = *extras_of_sets(std::vector{nodes, sides});
  for (const Order order : {Order::keep, Order::stream}) {
    mesh.schema.order = order;
    MemorySink file;
    ASSERT_TRUE(write_mesh(file, mesh));
    MemorySource source(file.bytes);
    const auto back = read_mesh(source);
    ASSERT_TRUE(back) << back.error().message();
    const auto sets = sets_of(*back);
    ASSERT_TRUE(sets) << sets.error().message();
    ASSERT_EQ(sets->size(), 2u);
    EXPECT_EQ((*sets)[1], sides);  // cells keep their positions
    if (order == Order::keep) {
      EXPECT_EQ((*sets)[0], nodes);
    }
    for (std::size_t i = 0; i < nodes.members.size(); ++i)
      EXPECT_EQ(std::memcmp(mesh.xyz.data() + 24 * nodes.members[i],
                            back->xyz.data() + 24 * (*sets)[0].members[i], 24),
                0);
  }
}

TEST(Sets, LongListsStandInSeveralExtras) {
  MeshSet set{Kind::nodes, 1, "", {}, {}, {}, {}};
  set.members.resize((std::size_t{4} << 20) + 3);
  std::iota(set.members.begin(), set.members.end(), 0);
  auto extras = extras_of_sets({&set, 1});
  ASSERT_TRUE(extras);
  EXPECT_EQ(keys_of(*extras),
            (std::vector<std::string>{"mesh/node_set/0/members", "mesh/node_set/0/members/1"}));
  EXPECT_EQ((*extras)[1].shape, std::vector<std::uint64_t>{3});
  const SetBounds bounds{set.members.size(), 0, 0};
  EXPECT_EQ(sets_of_extras(*extras, bounds)->at(0), set);
  std::swap((*extras)[0], (*extras)[1]);  // in any order
  EXPECT_EQ(sets_of_extras(*extras, bounds)->at(0), set);
  extras->erase(extras->begin() + 1);
  EXPECT_FALSE(sets_of_extras(*extras, bounds));
}

TEST(Sets, AreFoundByTheirKeysAlone) {
  const std::vector<Extra> extras = {
      vertices("mesh/node_set/7/members", {1}),
      vertices("mesh/node_set/07/members", {2}),
      vertices("mesh/node_set/-1/members", {2}),
      vertices("mesh/node_set//members", {2}),
      vertices("mesh/node_set/7", {2}),
      vertices("mesh/node_set/99999999999999999999/members", {2}),
      vertices("exodus/node_set/3/vertices", {2}),
      vertices("mesh/face_set/3/members", {2}),
      numbers("mesh/node_set/7/colour", {2}),
      vertices("mesh/node_set/7/members", {3}),  // the first counts
      vertices("mesh/node_set/7/members/0", {3}),
      cells("mesh/side_set/7/members", {}),
  };
  const auto places = find_sets(extras);
  ASSERT_EQ(places.size(), 2u);
  EXPECT_EQ(places[0].kind, Kind::nodes);
  EXPECT_EQ(places[0].number, 7u);
  EXPECT_EQ(places[0].extras, std::vector<std::size_t>{0});
  EXPECT_EQ(places[1].extras, std::vector<std::size_t>{11});
  const auto set = read_set(extras, places[0], kBounds);
  ASSERT_TRUE(set);
  EXPECT_EQ(set->id, 8);  // default: its number + 1
  EXPECT_EQ(set->members, std::vector<std::uint64_t>{1});
  EXPECT_EQ(set_folder(Kind::sides, 7), "mesh/side_set/7/");
}

TEST(Sets, ThatMakeNoSenseAreRefused) {
  const std::string n = "mesh/node_set/0/", s = "mesh/side_set/0/", e = "mesh/element_set/0/";
  const auto both = [](Extra a, Extra b) { return std::vector{std::move(a), std::move(b)}; };
  const std::vector<std::vector<Extra>> wrong = {
      {vertices(n + "members", {1000})},
      {vertices(n + "members", {-1})},
      {cells(n + "members", {0})},
      {numbers(n + "members", {0})},
      {list<double>(n + "members", ScalarType::float64, Reference::nothing, {0})},
      {list<std::int8_t>(n + "members", ScalarType::int8, Reference::nothing, {0, 0, 0, 0})},
      {numbers(n + "id", {})},
      {numbers(n + "id", {1, 2})},
      {list<std::uint64_t>(n + "id", ScalarType::uint64, Reference::nothing, {1})},
      {numbers(n + "name", {'a'})},
      both(vertices(n + "members", {0}), numbers(n + "sides", {1})),
      both(vertices(n + "members", {0}), numbers(n + "blocks", {0})),
      both(vertices(n + "members", {0}), numbers(n + "factors", {2})),
      {cells(s + "members", {0})},
      {cells(s + "members", {500}), numbers(s + "sides", {1})},
      both(cells(s + "members", {0}), numbers(s + "sides", {0})),
      both(cells(s + "members", {0}),
           list<std::int64_t>(s + "sides", ScalarType::int64, Reference::nothing,
                              {std::int64_t{1} << 31})),
      both(cells(s + "members", {0}), cells(s + "sides", {1})),
      {numbers(e + "blocks", {3})},
      {numbers(e + "blocks", {-1})},
      {vertices(n + "members/1", {0})},
  };
  for (const auto& extras : wrong) {
    const auto sets = sets_of_extras(extras, kBounds);
    ASSERT_FALSE(sets) << extras[0].key;
    EXPECT_EQ(sets.error().code, ErrorCode::corrupt);
    EXPECT_TRUE(extras[0].key.starts_with(sets.error().section)) << sets.error().message();
    const auto places = find_sets(extras);
    ASSERT_EQ(places.size(), 1u);
    EXPECT_FALSE(read_set(extras, places[0], kBounds));
  }
  // The last value of the extra is incomplete. A caller can pass such an extra, but a file cannot
  // contain it.
  Extra cut = vertices(n + "members", {0, 1});
  cut.data.pop_back();
  EXPECT_FALSE(sets_of_extras({&cut, 1}, kBounds));
}

TEST(Sets, ThatContradictThemselvesAreNotWritten) {
  std::vector<MeshSet> wrong(6);
  wrong[0].sides = {1};
  wrong[1].blocks = {0};
  wrong[2].kind = Kind::sides;
  wrong[2].members = {1};
  wrong[3] = wrong[2];
  wrong[3].sides = {0};
  wrong[4].members = {std::uint64_t{1} << 63};
  wrong[5].kind = static_cast<Kind>(3);
  for (const MeshSet& set : wrong) {
    const auto extras = extras_of_sets({&set, 1});
    ASSERT_FALSE(extras);
    EXPECT_EQ(extras.error().code, ErrorCode::misuse);
  }
}

// Decodes extras that have keys as used for sets, but arbitrary types and random bytes. The result
// must be a set or an error.
TEST(Sets, OfRandomExtrasAreSetsOrErrors) {
  std::mt19937_64 random(1);
  const char* fields[] = {"id", "name", "members", "sides", "blocks", "factors", "members/1"};
  const char* folders[] = {"mesh/node_set/", "mesh/side_set/", "mesh/element_set/"};
  std::size_t accepted = 0;
  for (int round = 0; round < 3000; ++round) {
    std::vector<Extra> extras(random() % 8);
    for (Extra& extra : extras) {
      extra.key = std::string(folders[random() % 3]) + std::to_string(random() % 2) + '/' +
                  fields[random() % 7];
      constexpr ScalarType kTypes[] = {ScalarType::int32,   ScalarType::int64,
                                       ScalarType::uint8,   ScalarType::float32,
                                       ScalarType::float64, static_cast<ScalarType>(77)};
      extra.type = kTypes[random() % 6];
      extra.refers = static_cast<Reference>(random() % 3);
      extra.data.resize(random() % 40);
      for (std::byte& byte : extra.data)
        byte = static_cast<std::byte>(random() % 3 == 0 ? random() : 0);
    }
    const auto sets = sets_of_extras(extras, kBounds);
    if (!sets) continue;
    ++accepted;
    const auto again = extras_of_sets(*sets);
    ASSERT_TRUE(again) << again.error().message();
    ASSERT_TRUE(sets_of_extras(*again, kBounds));
  }
  EXPECT_GT(accepted, 100u);
}

}  // namespace
}  // namespace shm
