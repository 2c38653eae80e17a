// Tests that the C interface writes the same files as the library.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "bindings/c_interface.h"
#include "support/temporary_folder.h"

namespace shm {
namespace {

/// Passes the schema of `mesh` (blocks, arrays, options) to `writer`.
void declare(shmf_writer* writer, const Schema& schema) {
  shmf_error why{};
  for (const BlockInfo& block : schema.blocks) {
    shmf_block own{};
    own.struct_size = sizeof own;
    own.id = block.id;
    own.name = block.name.c_str();
    own.shape = static_cast<std::int32_t>(block.shape);
    own.nodes_per_cell = block.nodes_per_cell;
    ASSERT_EQ(shmf_writer_block(writer, &own, &why), SHMF_OK) << why.message;
  }
  for (const ArrayInfo& array : schema.arrays) {
    shmf_array own{};
    own.struct_size = sizeof own;
    own.name = array.name.c_str();
    own.role = array.role.c_str();
    own.location = static_cast<std::int32_t>(array.location);
    own.type = static_cast<std::int32_t>(array.type);
    own.components = array.components;
    own.per_step = array.per_step ? 1 : 0;
    own.blocks = array.blocks.empty() ? nullptr : array.blocks.data();
    own.block_count = static_cast<std::uint32_t>(array.blocks.size());
    ASSERT_EQ(shmf_writer_array(writer, &own, &why), SHMF_OK) << why.message;
  }
}

/// Returns a writer that appends its output to `out`.
CWriter writer_into(Bytes& out, const shmf_write_options& options) {
  shmf_writer* writer = nullptr;
  shmf_error why{};
  const auto write = [](void* context, const void* bytes, std::uint64_t count) {
    auto& to = *static_cast<Bytes*>(context);
    const auto* from = static_cast<const std::byte*>(bytes);
    to.insert(to.end(), from, from + count);
    return 0;
  };
  EXPECT_EQ(shmf_writer_sink(write, &out, &options, &writer, &why), SHMF_OK) << why.message;
  return CWriter(writer);
}

shmf_target given(std::int32_t what, std::int32_t type, const Bytes& bytes,
                  std::uint32_t array = 0) {
  shmf_target target = Wanted(what, type, array).target;
  target.data = const_cast<std::byte*>(bytes.data());
  target.bytes = bytes.size();
  return target;
}

/// Writes the steps, step times and extras of a mesh.
void write_rest(shmf_writer* writer, const Mesh& mesh) {
  shmf_error why{};
  for (std::uint32_t a = 0; a < mesh.steps.size(); ++a)
    for (std::uint64_t s = 0; s < mesh.steps[a].size(); ++s)
      ASSERT_EQ(
          shmf_writer_values(writer, a, s, mesh.steps[a][s].data(), mesh.steps[a][s].size(), &why),
          SHMF_OK)
          << why.message;
  ASSERT_EQ(shmf_writer_times(writer, mesh.step_times.data(), mesh.step_times.size(), &why),
            SHMF_OK)
      << why.message;
  for (const Extra& extra : mesh.extras) {
    shmf_extra own{};
    own.struct_size = sizeof own;
    own.key = extra.key.c_str();
    own.type = static_cast<std::int32_t>(extra.type);
    own.refers = static_cast<std::int32_t>(extra.refers);
    own.shape = extra.shape.data();
    own.dimensions = static_cast<std::uint32_t>(extra.shape.size());
    own.data = extra.data.data();
    own.bytes = extra.data.size();
    ASSERT_EQ(shmf_writer_extra(writer, &own, &why), SHMF_OK) << why.message;
  }
}

Mesh sample(Order order) {
  const Bytes bytes = two_blocks_file();
  MemorySource source(bytes);
  Mesh mesh = std::move(*read_mesh(source));
  mesh.schema.order = order;
  Extra set{"test/vertices", ScalarType::int64, Reference::vertex, {3}, {}};
  for (const std::int64_t v : {5, 0, 17}) append(set.data, v);
  mesh.extras.push_back(set);
  return mesh;
}

TEST(CInterface, WhatItWritesIsWhatTheLibraryWrites) {
  for (const Order order : {Order::keep, Order::stream, Order::free})
    for (const bool narrow : {false, true}) {
      const Mesh mesh = sample(order);
      MemorySink expected;
      ASSERT_TRUE(write_mesh(expected, mesh));
      shmf_write_options options{};
      options.struct_size = sizeof options;
      options.order = static_cast<std::int32_t>(order);
      options.threads = narrow ? 2 : 0;
      Bytes out;
      const CWriter writer = writer_into(out, options);
      declare(writer.get(), mesh.schema);
      const Bytes few = raw(std::vector<std::int32_t>(mesh.corners.begin(), mesh.corners.end()));
      const Bytes many = raw(mesh.corners), begin = raw(mesh.corner_begin),
                  blocks = raw(mesh.cell_blocks);
      std::vector<shmf_target> arrays{
          given(SHMF_POINTS, SHMF_FLOAT64, mesh.xyz),
          given(SHMF_CORNERS, narrow ? SHMF_INT32 : SHMF_UINT64, narrow ? few : many),
          given(SHMF_CELL_BLOCKS, SHMF_INT32, blocks)};
      // SHMF_CORNER_BEGIN is needed only if a block does not state the number of corners per cell.
      if (!narrow) arrays.push_back(given(SHMF_CORNER_BEGIN, SHMF_INT64, begin));
      for (std::uint32_t a = 0; a < mesh.arrays.size(); ++a)
        if (!mesh.schema.arrays[a].per_step)
          arrays.push_back(given(SHMF_VALUES, static_cast<std::int32_t>(mesh.schema.arrays[a].type),
                                 mesh.arrays[a], a));
      shmf_error why{};
      ASSERT_EQ(shmf_writer_mesh(writer.get(), arrays.data(), arrays.size(), &why), SHMF_OK)
          << why.message;
      write_rest(writer.get(), mesh);
      std::uint64_t size = 0;
      ASSERT_EQ(shmf_writer_finish(writer.get(), &size, &why), SHMF_OK) << why.message;
      EXPECT_EQ(size, out.size());
      EXPECT_TRUE(out == expected.bytes) << order_name(order) << (narrow ? ", narrow" : "");
    }
}

TEST(CInterface, PieceByPieceIsTheSameFile) {
  const Mesh mesh = sample(Order::keep);
  MemorySink expected;
  ASSERT_TRUE(write_mesh(expected, mesh));
  shmf_write_options options{};
  options.struct_size = sizeof options;
  Bytes out;
  const CWriter writer = writer_into(out, options);
  declare(writer.get(), mesh.schema);
  std::vector<std::size_t> last(mesh.vertex_count());
  for (std::size_t c = 0; c < mesh.cell_count(); ++c)
    for (std::uint64_t k = mesh.corner_begin[c]; k < mesh.corner_begin[c + 1]; ++k)
      last[mesh.corners[k]] = c;
  std::vector<char> added(mesh.vertex_count());
  shmf_error why{};
  std::uint64_t element = 0;  // number within the array on block 1
  const auto add = [&](std::uint64_t v) {
    if (std::exchange(added[v], 1) != 0) return;
    ASSERT_EQ(shmf_writer_vertices(writer.get(), 1, &v, mesh.xyz.data() + v * 24,
                                   mesh.arrays[0].data() + v * 8, &why),
              SHMF_OK)
        << why.message;
  };
  for (std::size_t c = 0; c < mesh.cell_count(); ++c) {
    const std::uint64_t begin = mesh.corner_begin[c], count = mesh.corner_begin[c + 1] - begin;
    std::uint64_t last_use = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint64_t v = mesh.corners[begin + i];
      add(v);
      if (last[v] == c) last_use |= std::uint64_t{1} << i;
    }
    Bytes values(mesh.arrays[1].begin() + static_cast<std::ptrdiff_t>(c * 16),
                 mesh.arrays[1].begin() + static_cast<std::ptrdiff_t>(c * 16 + 16));
    if (mesh.cell_blocks[c] == 1) {
      const auto* from = mesh.arrays[2].data() + element++ * 8;
      values.insert(values.end(), from, from + 8);
    }
    ASSERT_EQ(
        shmf_writer_cells(writer.get(), 1, mesh.cell_blocks[c], static_cast<std::uint32_t>(count),
                          mesh.corners.data() + begin, &last_use, values.data(), &why),
        SHMF_OK)
        << why.message;
  }
  for (std::uint64_t v = 0; v < mesh.vertex_count(); ++v) add(v);
  write_rest(writer.get(), mesh);
  ASSERT_EQ(shmf_writer_finish(writer.get(), nullptr, &why), SHMF_OK) << why.message;
  EXPECT_TRUE(out == expected.bytes);
}

TEST(CInterface, SetsGoInAndOut) {
  shmf_write_options options{};
  options.struct_size = sizeof options;
  Bytes out;
  const CWriter writer = writer_into(out, options);
  const Mesh mesh = sample(Order::keep);
  declare(writer.get(), mesh.schema);
  const Bytes corners = raw(mesh.corners), begin = raw(mesh.corner_begin),
              blocks = raw(mesh.cell_blocks);
  std::vector<shmf_target> arrays{
      given(SHMF_POINTS, SHMF_FLOAT64, mesh.xyz), given(SHMF_CORNERS, SHMF_UINT64, corners),
      given(SHMF_CORNER_BEGIN, SHMF_UINT64, begin), given(SHMF_CELL_BLOCKS, SHMF_UINT32, blocks)};
  for (std::uint32_t a = 0; a < 3; ++a)
    arrays.push_back(given(SHMF_VALUES, SHMF_FLOAT64, mesh.arrays[a], a));
  shmf_error why{};
  ASSERT_EQ(shmf_writer_mesh(writer.get(), arrays.data(), arrays.size(), &why), SHMF_OK)
      << why.message;
  const std::uint64_t nodes[] = {3, 1, 4}, cells[] = {10, 20};
  const std::int32_t sides[] = {6, 1};
  const std::uint32_t some = 1;
  std::vector<shmf_set> sets(3);
  for (shmf_set& set : sets) set.struct_size = sizeof set;
  sets[0].kind = SHMF_NODE_SET;
  sets[0].id = 9;
  sets[0].name = "inlet";
  sets[0].members = 3;
  sets[0].numbers = nodes;
  sets[1].kind = SHMF_SIDE_SET;
  sets[1].members = 2;
  sets[1].numbers = cells;
  sets[1].sides = sides;
  sets[2].kind = SHMF_ELEMENT_SET;
  sets[2].blocks = &some;
  sets[2].block_count = 1;
  ASSERT_EQ(shmf_writer_sets(writer.get(), sets.data(), sets.size(), &why), SHMF_OK) << why.message;
  ASSERT_EQ(shmf_writer_finish(writer.get(), nullptr, &why), SHMF_OK) << why.message;
  const File file = opened(out);
  std::uint64_t count = 0;
  ASSERT_EQ(shmf_set_count(file.get(), &count, &why), SHMF_OK) << why.message;
  ASSERT_EQ(count, 3u);
  for (std::uint64_t i = 0; i < count; ++i) {
    shmf_set set{};
    set.struct_size = sizeof set;
    ASSERT_EQ(shmf_get_set(file.get(), i, &set, &why), SHMF_OK) << why.message;
    EXPECT_EQ(set.kind, sets[i].kind);
    EXPECT_EQ(set.id, sets[i].id);
    EXPECT_STREQ(set.name, sets[i].name == nullptr ? "" : sets[i].name);
    ASSERT_EQ(set.members, sets[i].members);
    EXPECT_TRUE(std::equal(set.numbers, set.numbers + set.members, sets[i].numbers));
    if (i == 1) {
      EXPECT_TRUE(std::equal(set.sides, set.sides + 2, sides));
    }
    ASSERT_EQ(set.block_count, sets[i].block_count);
    if (i == 2) {
      EXPECT_EQ(set.blocks[0], 1u);
    }
  }
}

using CWriterOfPaths = FolderTest;

TEST_F(CWriterOfPaths, NothingIsReplacedUnaskedAndNothingHalfDoneIsLeft) {
  const std::string name = path("mesh.shm");
  const auto one_vertex = [](shmf_writer* writer) {
    const std::uint64_t number = 0;
    const double xyz[3] = {1, 2, 3};
    return shmf_writer_vertices(writer, 1, &number, xyz, nullptr, nullptr);
  };
  shmf_writer* writer = nullptr;
  shmf_error why{};
  ASSERT_EQ(shmf_writer_path(name.c_str(), nullptr, &writer, &why), SHMF_OK) << why.message;
  EXPECT_EQ(one_vertex(writer), SHMF_OK);
  EXPECT_FALSE(std::filesystem::exists(name));
  shmf_writer_free(writer);  // without shmf_writer_finish()
  EXPECT_TRUE(std::filesystem::is_empty(std::filesystem::path(name).parent_path()));

  ASSERT_EQ(shmf_writer_path(name.c_str(), nullptr, &writer, &why), SHMF_OK) << why.message;
  EXPECT_EQ(one_vertex(writer), SHMF_OK);
  EXPECT_EQ(shmf_writer_finish(writer, nullptr, &why), SHMF_OK) << why.message;
  EXPECT_EQ(one_vertex(writer), SHMF_MISUSE);
  shmf_writer_free(writer);
  shmf_file* file = nullptr;
  ASSERT_EQ(shmf_open_path(name.c_str(), nullptr, &file, &why), SHMF_OK) << why.message;
  shmf_close(file);

  EXPECT_EQ(shmf_writer_path(name.c_str(), nullptr, &writer, &why), SHMF_OUTPUT);
  EXPECT_EQ(writer, nullptr);
  EXPECT_NE(std::string(why.message).find(name), std::string::npos);
  shmf_write_options options{};
  options.struct_size = sizeof options;
  options.replace = 1;
  EXPECT_EQ(shmf_writer_path(name.c_str(), &options, &writer, &why), SHMF_OK) << why.message;
  shmf_writer_free(writer);
  EXPECT_EQ(shmf_open_path(path("none").c_str(), nullptr, &file, &why), SHMF_IO);
  EXPECT_NE(std::string(why.message).find("none"), std::string::npos);
}

// A file whose steps are appended later equals a file whose steps are all written in one run.
TEST_F(CWriterOfPaths, StepsAreAppended) {
  for (const Order order : {Order::keep, Order::stream}) {
    const Mesh mesh = sample(order);
    Mesh fewer = mesh;
    for (auto& steps : fewer.steps)
      if (!steps.empty()) steps.resize(1);
    fewer.step_times.resize(1);
    const std::string name = path("mesh.shm");
    ASSERT_TRUE(shm::write_file(name, fewer, {}, FileSink::Existing::replace));
    shmf_writer* writer = nullptr;
    shmf_error why{};
    ASSERT_EQ(shmf_writer_append(name.c_str(), nullptr, &writer, &why), SHMF_OK) << why.message;
    const CWriter owner(writer);
    // In order `stream`, appended values refer to the vertex and cell numbers that readers return,
    // not to those of the source.
    const auto old = read_file(name);
    ASSERT_TRUE(old);
    const auto whole = [&] {
      MemorySink sink;
      EXPECT_TRUE(write_mesh(sink, mesh));
      MemorySource source(sink.bytes);
      return *read_mesh(source);
    }();
    for (std::uint32_t a = 0; a < whole.steps.size(); ++a)
      for (std::uint64_t s = 1; s < whole.steps[a].size(); ++s) {
        const Bytes& values = whole.steps[a][s];
        ASSERT_EQ(shmf_writer_values(writer, a, s, values.data(), values.size(), &why), SHMF_OK)
            << why.message;
      }
    ASSERT_EQ(shmf_writer_times(writer, mesh.step_times.data(), mesh.step_times.size(), &why),
              SHMF_OK)
        << why.message;
    EXPECT_EQ(*read_file(name), *old);  // unchanged until the writer finishes
    ASSERT_EQ(shmf_writer_finish(writer, nullptr, &why), SHMF_OK) << why.message;
    const auto longer = read_file(name);
    ASSERT_TRUE(longer) << longer.error().message();
    EXPECT_EQ(*longer, whole);
  }
  shmf_writer* writer = nullptr;
  EXPECT_EQ(shmf_writer_append(path("none").c_str(), nullptr, &writer, nullptr), SHMF_IO);
  ASSERT_EQ(shmf_writer_append(path("mesh.shm").c_str(), nullptr, &writer, nullptr), SHMF_OK);
  const CWriter owner(writer);
  const std::uint64_t number = 0;
  const double xyz[3] = {1, 2, 3};
  EXPECT_EQ(shmf_writer_vertices(writer, 1, &number, xyz, nullptr, nullptr), SHMF_MISUSE);
}

TEST(CInterface, TheFirstFailureOfAWriterStays) {
  shmf_write_options options{};
  options.struct_size = sizeof options;
  Bytes out;
  const CWriter writer = writer_into(out, options);
  const std::uint64_t number = 0, none = 5;
  const double xyz[3] = {1, 2, 3};
  shmf_error why{}, later{};
  ASSERT_EQ(shmf_writer_vertices(writer.get(), 1, &number, xyz, nullptr, &why), SHMF_OK);
  EXPECT_EQ(shmf_writer_cells(writer.get(), 1, 0, 1, &none, nullptr, nullptr, &why), SHMF_MISUSE);
  EXPECT_EQ(shmf_writer_finish(writer.get(), nullptr, &later), SHMF_MISUSE);
  EXPECT_STREQ(why.message, later.message);
  shmf_writer* other = nullptr;
  const auto full = [](void*, const void*, std::uint64_t) { return 1; };
  ASSERT_EQ(shmf_writer_sink(full, nullptr, nullptr, &other, &why), SHMF_OK);
  const CWriter owner(other);
  EXPECT_EQ(shmf_writer_finish(other, nullptr, &why), SHMF_OUTPUT);
}

}  // namespace
}  // namespace shm
