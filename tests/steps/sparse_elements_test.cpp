// Tests of arrays that cover only a few elements of the mesh. For such an array, only the mesh data
// of the elements that it needs is kept in memory. A column (the coder of an array) that uses only
// this data must produce the same bytes and values as a column that uses the data of all elements,
// for all meshes, segments, groups and codecs.
#include "steps/sparse_elements.h"

#include <functional>

#include "codecs/shifts/shifts.h"
#include "steps/step_encoder.h"
#include "steps/step_values.h"
#include "support/file_surgery.h"
#include "support/sanitized.h"
#include "support/stepped_mesh.h"

namespace shm {
namespace {

using container::ChunkKind;

/// Returns a grid in which some cells are in separate blocks: scattered cells, a cluster of cells,
/// and a layer of cells.
TestMesh scattered(std::uint64_t n, std::uint32_t seed) {
  TestMesh mesh = grid(n, n, n, ScalarType::float64, warped, porous);
  for (int b = 1; b < 4; ++b) mesh.schema.blocks.push_back({b + 1, "", CellShape::hexahedron, 8});
  PlainRandom random(seed);
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    if (random.below(40) == 0) mesh.cells[c].block = 1;
    if (c * 8 / mesh.cells.size() == 3 && random.below(3) == 0) mesh.cells[c].block = 2;
    if (c >= mesh.cells.size() / 2 && c < mesh.cells.size() / 2 + n) mesh.cells[c].block = 3;
  }
  return mesh;
}

/// Adds arrays on each block, on pairs of blocks, and on points.
Stepped with_arrays_on_few(TestMesh mesh, Order order) {
  Stepped out;
  out.mesh = with_order(std::move(mesh), order, order == Order::keep, 0);
  const auto blocks = static_cast<std::uint32_t>(out.mesh.schema.blocks.size());
  for (std::uint32_t b = 0; b < blocks; ++b) {
    add_stepped(out.mesh, array_of("", Location::cell, ScalarType::float64, 1 + b % 2, {b}));
    if (b > 1)
      add_stepped(out.mesh, array_of("", Location::cell, ScalarType::int32, 1, {b - 2, b}));
  }
  add_stepped(out.mesh, array_of("", Location::cell, ScalarType::float32, 2, {blocks - 1}));
  add_stepped(out.mesh, array_of("", Location::point, ScalarType::float32));
  return out;
}

/// Adds all groups of a file to `replay`.
void add_groups(std::span<const std::byte> bytes, StepTopology& replay) {
  for (const Chunk& chunk : take_apart(bytes).chunks) {
    if (!chunk.is(ChunkKind::group)) continue;
    const auto group = take_group_apart(chunk);
    ASSERT_TRUE(group);
    replay.add_group(
        chunk.header.segment, group->header,
        std::vector<std::span<const std::byte>>(group->streams.begin(), group->streams.end()));
  }
}

/// Returns values of one of five kinds. The kind differs from group to group, so that the domain
/// (the way in which values are mapped to integers) and the codec change between groups.
Bytes values_of(const ArrayInfo& info, std::uint64_t elements, std::size_t group,
                std::size_t turn) {
  Bytes out;
  PlainRandom random(group * 31 + turn);
  const std::size_t kind = (group + turn) % 5;
  for (std::uint64_t i = 0; i < elements * info.components; ++i) {
    const auto bits = static_cast<double>(random.below(1000));
    double v = static_cast<double>(i) * .01 + static_cast<double>(turn);
    if (kind == 1) v = bits;
    if (kind == 2) v = bits * .1 + (random.below(30) == 0 ? .00037 : 0.);
    if (kind == 3)
      v = random.below(9) == 0 ? std::numeric_limits<double>::quiet_NaN() : 1 / (bits + 3);
    if (kind == 4) v = 7;
    if (info.type == ScalarType::float64)
      append(out, v);
    else if (info.type == ScalarType::float32)
      append(out, static_cast<float>(v));
    else
      append_scalar(out, info.type, kind == 3 ? 5 : static_cast<std::int64_t>(v));
  }
  return out;
}

/// Encoders and decoders of the values of one array at one step, for the codecs `columns` and
/// `weighted`.
struct Columns {
  Columns(const Schema& schema, std::uint32_t array)
      : in(schema, array),
        out(schema, array),
        weighted_in(schema, array),
        weighted_out(schema, array, ~std::uint64_t{0}) {}
  StepColumnEncoder in;
  StepColumnDecoder out;
  StepWeightedEncoder weighted_in;
  StepWeightedDecoder weighted_out;
};

/// Encodes a group with the codec `weighted`, and checks that the values are restored. Also decodes
/// damaged copies of the result, to see that nothing crashes.
Bytes expect_weighted_back(Columns& columns, const ColumnElements& elements, std::uint32_t segment,
                           StepReference kind, const Bytes& values, const Bytes& before) {
  EXPECT_TRUE(columns.weighted_in.begin(segment, kind));
  const EncodedColumn coded = columns.weighted_in.encode(elements, values, {before, {}});
  EXPECT_TRUE(columns.weighted_out.begin(segment, kind));
  PlainRandom random(static_cast<std::uint32_t>(coded.bytes.size()));
  for (int i = 0; i < 4; ++i) {
    Bytes damaged = coded.bytes;
    damaged[random.below(damaged.size())] ^= static_cast<std::byte>(1 + random.below(255));
    if (i == 3) damaged.resize(random.below(damaged.size()));
    StepWeightedDecoder decoder = columns.weighted_out;
    const auto back = decoder.decode(elements, damaged, {before, {}});
    EXPECT_TRUE(!back || back->size() == values.size());
  }
  const auto back = columns.weighted_out.decode(elements, coded.bytes, {before, {}});
  EXPECT_TRUE(back && *back == values);
  return coded.bytes;
}

/// Encodes an array twice: with only the mesh data that it needs (`thin`), and with the mesh data
/// of all elements (`all`). Checks that the results are equal. Returns the number of compared
/// groups.
std::size_t expect_same_columns(const Stepped& stepped, StepTopology& replay, StepElements& thin,
                                StepElements& all, std::uint32_t array, std::size_t turn) {
  const ArrayInfo& info = stepped.mesh.schema.arrays[array];
  const StepReference kind = turn % 2 == 0 ? StepReference::nothing : StepReference::before;
  Columns over_thin(stepped.mesh.schema, array), over_all(stepped.mesh.schema, array);
  std::size_t compared = 0;
  for (std::size_t g = 0; g < replay.groups(); ++g) {
    const auto count = thin.count(array, g);
    EXPECT_TRUE(count);
    EXPECT_EQ(*count, *all.count(array, g));
    if (!count || *count == 0) continue;
    const Bytes values = values_of(info, *count, g, turn);
    const Bytes before =
        kind == StepReference::nothing ? Bytes() : values_of(info, *count, g, turn - 1);
    EncodedColumn coded[2];
    Bytes weighted[2];
    std::vector<std::uint64_t> numbers[2];
    for (int i = 0; i < 2; ++i) {
      Columns& columns = i == 0 ? over_thin : over_all;
      const auto elements = (i == 0 ? thin : all).elements(array, g);
      EXPECT_TRUE(elements);
      if (!elements) return compared;
      numbers[i].assign(elements->numbers.begin(), elements->numbers.end());
      EXPECT_TRUE(columns.in.begin(replay.segment_of(g), kind));
      coded[i] = columns.in.encode(*elements, values, stepped.options.level, {before, {}});
      EXPECT_TRUE(columns.out.begin(replay.segment_of(g), kind));
      const auto back =
          columns.out.decode(*elements, coded[i].codec, coded[i].bytes, values.size(), before);
      EXPECT_TRUE(back && *back == values) << "array " << array << " group " << g;
      SCOPED_TRACE("array " + std::to_string(array) + " group " + std::to_string(g));
      weighted[i] =
          expect_weighted_back(columns, *elements, replay.segment_of(g), kind, values, before);
    }
    EXPECT_EQ(weighted[0], weighted[1]) << "array " << array << " group " << g;
    EXPECT_TRUE(coded[0].codec == coded[1].codec && coded[0].bytes == coded[1].bytes)
        << "array " << array << " group " << g;
    EXPECT_EQ(numbers[0].size(), *count);
    EXPECT_EQ(numbers[0], numbers[1]);
    ++compared;
  }
  return compared;
}

std::size_t expect_same_columns(const Stepped& stepped) {
  const Bytes bytes = written(stepped);
  const auto read = read_mesh(bytes);
  EXPECT_TRUE(read);
  if (!read) return 0;
  const Schema& schema = read->schema;
  StepTopology replay(schema, std::uint64_t{1} << 30, ElementNeeds{true, true, true, true});
  add_groups(bytes, replay);
  StepElements thin(schema, replay, cover_numbers(schema)),
      all(schema, replay, cover_numbers(schema));
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a) {
    if (!schema.arrays[a].per_step) continue;
    thin.expect(a, 0);
    all.expect(a, ~std::uint64_t{0});
  }
  std::size_t compared = 0;
  for (std::size_t turn = 0; turn < 3; ++turn)
    for (std::uint32_t a = 0; a < schema.arrays.size(); ++a)
      if (schema.arrays[a].per_step)
        compared += expect_same_columns(stepped, replay, thin, all, a, turn);
  EXPECT_GT(thin.kept_bytes(), 0u);
  EXPECT_EQ(all.kept_bytes(), 0u);
  return compared;
}

TEST(SparseElements, SayWhatAllElementsSay) {
  SomeCases some(7);
  std::size_t compared = 0;
  for (const Order order : {Order::keep, Order::stream})
    for (const auto codec :
         {ConnectivityCodec::paper, ConnectivityCodec::rows, ConnectivityCodec::replay,
          ConnectivityCodec::mixed, ConnectivityCodec::shifts})
      for (const std::uint64_t segment_cells : {0u, 150u})
        for (const std::uint32_t group_cells : {19u, 65536u})
          for (int family = 0; family < 4; ++family) {
            Stepped stepped = with_arrays_on_few(family == 0   ? scattered(9, 1)
                                                 : family == 1 ? mixed_cells()
                                                 : family == 2 ? every_shape()
                                                               : replayed(order),
                                                 order);
            if (codec == ConnectivityCodec::shifts && !takes_shifts(stepped.mesh.schema)) continue;
            if (some.skips_next()) continue;
            stepped.options.connectivity = codec;
            stepped.options.level = family == 0 ? Level::standard : Level::fast;
            stepped.options.segment_cells = segment_cells;
            stepped.options.group_cells = group_cells;
            SCOPED_TRACE(std::to_string(family) + " codec " +
                         std::to_string(static_cast<int>(codec)) + " order " +
                         std::to_string(static_cast<int>(order)) + " groups of " +
                         std::to_string(group_cells));
            compared += expect_same_columns(stepped);
          }
  EXPECT_GT(compared, 10000 / every(10));
}

// In these meshes, slots are reused: slots of cells because the ring of cells becomes full, and
// slots of vertices because vertices are finalized and new vertices are introduced.
TEST(SparseElements, InMeshesThatTakePlacesAgain) {
  for (const auto codec : {ConnectivityCodec::rows, ConnectivityCodec::shifts})
    for (const std::uint32_t group_cells : {700u, 65536u}) {
      Stepped stepped = with_arrays_on_few(scattered(kSanitized ? 14 : 30, 2), Order::keep);
      stepped.options.connectivity = codec;
      stepped.options.group_cells = group_cells;
      EXPECT_GT(expect_same_columns(stepped), 10u);
    }
}

// A column may change its domain (the way in which values are mapped to integers) only a limited
// number of times. The limit depends on the number of elements and slots. It must also count the
// elements and slots whose mesh data is not kept.
TEST(SparseElements, MayChangeDomainsAsOftenAsAllElements) {
  Stepped stepped = with_arrays_on_few(scattered(kSanitized ? 13 : 24, 5), Order::stream);
  stepped.options.connectivity = ConnectivityCodec::rows;
  stepped.options.group_cells = 2;
  EXPECT_GT(expect_same_columns(stepped), 1000u);
}

TEST(SparseElements, AtLevelBest) {
  Stepped stepped = with_arrays_on_few(scattered(8, 3), Order::stream);
  stepped.options.level = Level::best;
  stepped.options.group_cells = 90;
  EXPECT_GT(expect_same_columns(stepped), 50u);
}

// In a damaged file, an index entry may state a wrong number of elements for one step after correct
// numbers for the previous steps.
TEST(SparseElements, AreNotThinLater) {
  Stepped stepped = with_arrays_on_few(scattered(9, 1), Order::keep);
  stepped.options.group_cells = 60;
  const Bytes bytes = written(stepped);
  const auto read = read_mesh(bytes);
  ASSERT_TRUE(read);
  StepTopology replay(read->schema, std::uint64_t{1} << 30, ElementNeeds{true, true, true, true});
  add_groups(bytes, replay);
  StepElements elements(read->schema, replay, cover_numbers(read->schema));
  const std::uint32_t array = 1;  // on one block
  elements.expect(array, ~std::uint64_t{0});
  const std::size_t last = replay.groups() - 1;
  for (std::size_t g = 0; g < last; ++g) ASSERT_TRUE(elements.count(array, g));
  elements.expect(array, 1);
  std::uint64_t all = 0;
  for (std::size_t g = 0; g <= last; ++g) {
    const auto count = elements.count(array, g);
    ASSERT_TRUE(count);
    if (*count == 0) continue;
    const auto of_group = elements.elements(array, g);
    ASSERT_TRUE(of_group);
    EXPECT_EQ(of_group->numbers.size(), *count);
    all += *count;
  }
  EXPECT_EQ(all, elements_of(stepped.mesh, array));
}

/// Announces that array `a` has `expected` elements, which may be wrong, and sets the memory limit
/// to `most` bytes. Returns the number of bytes of mesh data that are then kept for the array.
std::size_t kept_of(const Stepped& stepped, std::uint32_t a, std::uint64_t expected,
                    std::size_t most) {
  const Bytes bytes = written(stepped);
  const auto read = read_mesh(bytes);
  EXPECT_TRUE(read);
  StepTopology replay(read->schema, std::uint64_t{1} << 30, ElementNeeds{true, true, false, false},
                      most);
  add_groups(bytes, replay);
  StepElements elements(read->schema, replay, cover_numbers(read->schema));
  elements.expect(a, expected);
  for (std::size_t g = 0; g < replay.groups(); ++g) {
    const auto count = elements.count(a, g);
    EXPECT_TRUE(count);
    if (!count || *count == 0) continue;
    const auto found = elements.elements(a, g);
    EXPECT_TRUE(found);
    if (found) {
      EXPECT_LE(*count, found->items->items.size());
    }
  }
  return elements.kept_bytes();
}

TEST(SparseElements, AreKeptWhereTheyAreFewAndWithinALimit) {
  Stepped stepped = with_arrays_on_few(scattered(40, 4), Order::keep);
  const auto array_on = [&](std::uint32_t block) {
    const auto& arrays = stepped.mesh.schema.arrays;
    return static_cast<std::uint32_t>(std::find_if(arrays.begin(), arrays.end(),
                                                   [&](const ArrayInfo& info) {
                                                     return info.blocks ==
                                                            std::vector<std::uint32_t>{block};
                                                   }) -
                                      arrays.begin());
  };
  const std::uint32_t few = array_on(1), many = array_on(0);
  const std::uint64_t elements = elements_of(stepped.mesh, few);
  const std::size_t kept = kept_of(stepped, few, elements, 0);
  EXPECT_GT(kept, elements * sizeof(Neighbourhood));
  EXPECT_LT(kept, elements * (sizeof(Neighbourhood) * 9 / 8 + 4 * 14) + (64u << 10));
  EXPECT_EQ(kept_of(stepped, many, elements_of(stepped.mesh, many), 0), 0u);
  // The caller announces fewer elements than the array has. With a limit of 0 bytes, no mesh data
  // is kept; with a limit of 64 MiB, all of it is kept.
  EXPECT_EQ(kept_of(stepped, many, 0, 0), 0u);
  EXPECT_GT(kept_of(stepped, many, 0, std::size_t{64} << 20), std::size_t{1} << 20);
}

}  // namespace
}  // namespace shm
