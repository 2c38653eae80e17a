// Tests of reading through the C interface. For every golden file, the C interface must return the
// same data as the C++ library. Invalid calls must return errors.
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <numeric>
#include <string>
#include <vector>

#include "bindings/c_interface.h"
#include "shm/archive.h"
#include "shm/sets.h"
#include "support/file_surgery.h"
#include "support/golden_files.h"

namespace shm {
namespace {

/// Checks that the data read from a file through the C interface equals `mesh`, the result of
/// read_mesh().
void expect_same(shmf_file* file, const Mesh& mesh) {
  shmf_error why{};
  shmf_info info{};
  info.struct_size = sizeof info;
  ASSERT_EQ(shmf_get_info(file, &info, &why), SHMF_OK) << why.message;
  EXPECT_EQ(info.vertices, mesh.vertex_count());
  EXPECT_EQ(info.cells, mesh.cell_count());
  EXPECT_EQ(info.source_format, mesh.schema.source_format);
  ASSERT_EQ(info.blocks, mesh.schema.blocks.size());
  ASSERT_EQ(info.arrays, mesh.schema.arrays.size());
  shmf_counts counts{};
  counts.struct_size = sizeof counts;
  ASSERT_EQ(shmf_select(file, nullptr, nullptr, &counts, &why), SHMF_OK) << why.message;
  EXPECT_EQ(counts.corners, mesh.corners.size());

  const auto coordinates = static_cast<std::int32_t>(mesh.schema.coordinate_type);
  std::vector<Wanted> wanted{{SHMF_POINTS, coordinates},
                             {SHMF_CORNERS, SHMF_UINT64},
                             {SHMF_CORNER_BEGIN, SHMF_INT64},
                             {SHMF_CELL_BLOCKS, SHMF_UINT32},
                             {SHMF_CELL_NUMBERS, SHMF_INT64}};
  std::vector<Bytes> expected{mesh.xyz, raw(mesh.corners), raw(mesh.corner_begin),
                              raw(mesh.cell_blocks)};
  std::vector<std::uint64_t> numbers(mesh.cell_count());
  std::iota(numbers.begin(), numbers.end(), 0);
  expected.push_back(raw(numbers));
  for (std::uint32_t a = 0; a < mesh.schema.arrays.size(); ++a) {
    const ArrayInfo& array = mesh.schema.arrays[a];
    shmf_array told{};
    told.struct_size = sizeof told;
    ASSERT_EQ(shmf_get_array(file, a, &told, &why), SHMF_OK) << why.message;
    EXPECT_EQ(told.name, array.name);
    EXPECT_EQ(std::vector(told.blocks, told.blocks + told.block_count), array.blocks);
    EXPECT_EQ(told.error > 0 || told.relative_error > 0, array.quantization.lossy());
    EXPECT_EQ(told.relative_error, array.quantization.max_rel);
    EXPECT_EQ(std::vector<double>(told.fills, told.fills + told.fill_count), array.fills);
    const auto type = static_cast<std::int32_t>(array.type);
    const std::uint64_t* steps = nullptr;
    std::uint64_t count = 0;
    ASSERT_EQ(shmf_get_steps(file, a, &steps, &count, &why), SHMF_OK) << why.message;
    EXPECT_EQ(count > 0, array.per_step && !mesh.steps[a].empty());
    if (!array.per_step) {
      wanted.emplace_back(SHMF_VALUES, type, a);
      expected.push_back(mesh.arrays[a]);
    }
    for (std::uint64_t s = 0; s < count; ++s) {
      wanted.emplace_back(SHMF_VALUES, type, a, steps[s]);
      expected.push_back(mesh.steps[a][steps[s]]);
    }
  }
  ASSERT_EQ(read_all(file, wanted, why), SHMF_OK) << why.message;
  for (std::size_t i = 0; i < wanted.size(); ++i)
    EXPECT_EQ(wanted[i].bytes(), expected[i]) << "target " << i;

  const double* times = nullptr;
  std::uint64_t count = 0;
  ASSERT_EQ(shmf_get_times(file, &times, &count, &why), SHMF_OK) << why.message;
  ASSERT_EQ(count, mesh.step_times.size());
  for (std::uint64_t i = 0; i < count; ++i)  // compares bits, because a time may be a NaN
    EXPECT_EQ(std::bit_cast<std::uint64_t>(times[i]),
              std::bit_cast<std::uint64_t>(mesh.step_times[i]));
  ASSERT_EQ(shmf_extra_count(file, &count, &why), SHMF_OK) << why.message;
  ASSERT_EQ(count, mesh.extras.size());
  for (std::uint64_t i = 0; i < count; ++i) {
    shmf_extra extra{};
    extra.struct_size = sizeof extra;
    ASSERT_EQ(shmf_get_extra(file, i, &extra, &why), SHMF_OK) << why.message;
    EXPECT_EQ(extra.key, mesh.extras[i].key);
    EXPECT_EQ(std::vector(extra.shape, extra.shape + extra.dimensions), mesh.extras[i].shape);
    const auto* data = static_cast<const std::byte*>(extra.data);
    EXPECT_EQ(Bytes(data, data + extra.bytes), mesh.extras[i].data);
  }
  const auto sets = sets_of(mesh);
  const auto status = shmf_set_count(file, &count, &why);
  ASSERT_EQ(status == SHMF_OK, static_cast<bool>(sets));
  EXPECT_TRUE(!sets || count == sets->size());
  EXPECT_EQ(shmf_verify(file, nullptr, &why), SHMF_OK) << why.message;
}

void expect_same(std::span<const std::byte> bytes, const File& file) {
  MemorySource source(bytes);
  const auto mesh = read_mesh(source);
  if (mesh) {
    expect_same(file.get(), *mesh);
    return;
  }
  // An array of the whole mesh can be read only if the vertices are numbered consecutively from 0.
  // In this file, they are not.
  EXPECT_EQ(mesh.error().code, ErrorCode::corrupt);
  std::vector<Wanted> wanted{{SHMF_POINTS, SHMF_FLOAT64}};
  shmf_error why{};
  EXPECT_EQ(read_all(file.get(), wanted, why), SHMF_CORRUPT);
}

TEST(CInterface, EveryGoldenFileReadsAsAWholeMesh) {
  int members = 0;
  for (const auto& path : golden_files()) {
    SCOPED_TRACE(path);
    const std::string bytes = content(path);
    const File file = opened(bytes_of(bytes));
    ASSERT_TRUE(file);
    if (shmf_member_count(file.get()) == 0) {
      expect_same(bytes_of(bytes), file);
      continue;
    }
    MemoryRandomSource source(bytes_of(bytes));
    const auto archive = ArchiveReader::open(source);
    ASSERT_TRUE(archive);
    for (std::uint32_t m = 0; m < shmf_member_count(file.get()); ++m) {
      const ArchiveMember& member = archive->members()[m];
      EXPECT_EQ(shmf_member_name(file.get(), m), member.name);
      shmf_file* one = nullptr;
      shmf_error why{};
      ASSERT_EQ(shmf_open_member(file.get(), m, nullptr, &one, &why), SHMF_OK) << why.message;
      expect_same(bytes_of(bytes).subspan(member.offset, member.bytes), File(one));
      ++members;
    }
    shmf_info info{};
    info.struct_size = sizeof info;
    EXPECT_EQ(shmf_get_info(file.get(), &info, nullptr), SHMF_MISUSE);
  }
  EXPECT_GT(members, 0);
}

/// Checks that a selection returns the corresponding part of the whole mesh.
void expect_piece(std::span<const std::byte> bytes, const shmf_selection& selection) {
  MemorySource source(bytes);
  const auto mesh = read_mesh(source);
  ASSERT_TRUE(mesh);
  const File file = opened(bytes);
  shmf_error why{};
  shmf_counts counts{};
  counts.struct_size = sizeof counts;
  ASSERT_EQ(shmf_select(file.get(), &selection, nullptr, &counts, &why), SHMF_OK) << why.message;
  ASSERT_GT(counts.cells, 0u);
  ASSERT_LT(counts.cells, mesh->cell_count());
  std::vector<Wanted> wanted{
      {SHMF_POINTS, SHMF_FLOAT64},       {SHMF_CORNERS, SHMF_INT32},
      {SHMF_CORNER_BEGIN, SHMF_INT32},   {SHMF_VERTEX_NUMBERS, SHMF_INT64},
      {SHMF_CELL_NUMBERS, SHMF_UINT64},  {SHMF_CELL_BLOCKS, SHMF_INT32},
      {SHMF_VALUES, SHMF_FLOAT64, 0},    {SHMF_VALUES, SHMF_FLOAT64, 1},
      {SHMF_VALUES, SHMF_FLOAT64, 2},    {SHMF_VALUES, SHMF_FLOAT64, 2, 0, SHMF_FILL},
      {SHMF_VALUES, SHMF_FLOAT64, 3, 1}, {SHMF_VALUES, SHMF_FLOAT64, 4, 2},
      {SHMF_VALUES, SHMF_FLOAT64, 5, 1}, {SHMF_VALUES, SHMF_FLOAT64, 5, 1, SHMF_FILL}};
  ASSERT_EQ(read_all(file.get(), wanted, why), SHMF_OK) << why.message;
  const auto vertices = wanted[3].values<std::uint64_t>(),
             cells = wanted[4].values<std::uint64_t>();
  ASSERT_EQ(vertices.size(), counts.vertices);
  ASSERT_EQ(cells.size(), counts.cells);
  EXPECT_TRUE(std::is_sorted(vertices.begin(), vertices.end()));
  EXPECT_TRUE(std::is_sorted(cells.begin(), cells.end()));

  const auto copied = [](Bytes& to, const Bytes& from, std::uint64_t i, std::size_t stride) {
    const auto* at = from.data() + i * stride;
    to.insert(to.end(), at, at + stride);
  };
  Bytes points;
  for (const std::uint64_t v : vertices) copied(points, mesh->xyz, v, 24);
  EXPECT_EQ(wanted[0].bytes(), points);
  const auto corners = wanted[1].values<std::int32_t>(), begin = wanted[2].values<std::int32_t>();
  // For each cell of block 1: its index in the arrays that are defined on block 1 only.
  std::vector<std::uint64_t> element(mesh->cell_count());
  std::uint64_t next = 0;
  for (std::size_t c = 0; c < element.size(); ++c)
    if (mesh->cell_blocks[c] == 1) element[c] = next++;
  Bytes blocks, whole, some, filled, step_whole, step_some, step_filled;
  const auto nothing = [](Bytes& to, std::size_t scalars) {
    for (std::size_t i = 0; i < scalars; ++i) append(to, std::numeric_limits<double>::quiet_NaN());
  };
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::uint64_t c = cells[i];
    ASSERT_EQ(static_cast<std::uint64_t>(begin[i + 1] - begin[i]),
              mesh->corner_begin[c + 1] - mesh->corner_begin[c]);
    for (std::int32_t k = begin[i]; k < begin[i + 1]; ++k)
      ASSERT_EQ(vertices[static_cast<std::size_t>(corners[static_cast<std::size_t>(k)])],
                mesh->corners[mesh->corner_begin[c] + static_cast<std::uint64_t>(k - begin[i])]);
    append(blocks, mesh->cell_blocks[c]);
    copied(whole, mesh->arrays[1], c, 16);
    copied(step_whole, mesh->steps[4][2], c, 8);
    if (mesh->cell_blocks[c] == 1) {
      for (Bytes* to : {&some, &filled}) copied(*to, mesh->arrays[2], element[c], 8);
      for (Bytes* to : {&step_some, &step_filled}) copied(*to, mesh->steps[5][1], element[c], 16);
    } else {
      nothing(filled, 1);
      nothing(step_filled, 2);
    }
  }
  EXPECT_EQ(wanted[5].bytes(), blocks);
  Bytes of_points, step_points;
  for (const std::uint64_t v : vertices) {
    copied(of_points, mesh->arrays[0], v, 8);
    copied(step_points, mesh->steps[3][1], v, 16);
  }
  EXPECT_EQ(wanted[6].bytes(), of_points);
  EXPECT_EQ(wanted[7].bytes(), whole);
  EXPECT_EQ(wanted[8].bytes(), some);
  EXPECT_EQ(wanted[9].bytes(), filled);
  EXPECT_EQ(wanted[10].bytes(), step_points);
  EXPECT_EQ(wanted[11].bytes(), step_whole);
  EXPECT_EQ(wanted[12].bytes(), step_some);
  EXPECT_EQ(wanted[13].bytes(), step_filled);
}

TEST(CInterface, PiecesAreWhatTheWholeHasThere) {
  for (const auto& [order, segment_cells] :
       {std::pair(Order::keep, 0), {Order::keep, 50}, {Order::stream, 50}}) {
    const Bytes bytes = two_blocks_file(order, static_cast<std::uint64_t>(segment_cells));
    shmf_selection selection{};
    selection.struct_size = sizeof selection;
    selection.first_cell = 40;
    selection.end_cell = 100;
    expect_piece(bytes, selection);
    const std::uint32_t block = 1;
    selection.blocks = &block;
    selection.block_count = 1;
    expect_piece(bytes, selection);
    selection.first_cell = selection.end_cell = 0;
    expect_piece(bytes, selection);
    selection.blocks = nullptr;
    selection.block_count = 0;
    selection.has_box = 1;
    const double box[6] = {-1e9, -1e9, -1e9, .4, 1e9, 1e9};
    std::copy(box, box + 6, selection.box);
    expect_piece(bytes, selection);
    const std::uint64_t numbers[] = {0, 3, 50, 51, 200};
    selection.has_box = 0;
    selection.numbers = numbers;
    selection.number_count = 5;
    expect_piece(bytes, selection);
  }
}

TEST(CInterface, ValuesComeInOtherTypes) {
  const Bytes bytes = two_blocks_file();
  const File file = opened(bytes);
  shmf_error why{};
  std::vector<Wanted> wanted{{SHMF_POINTS, SHMF_FLOAT64},       {SHMF_POINTS, SHMF_FLOAT32},
                             {SHMF_CORNERS, SHMF_UINT32},       {SHMF_CORNERS, SHMF_INT64},
                             {SHMF_VALUES, SHMF_FLOAT64, 3, 2}, {SHMF_VALUES, SHMF_FLOAT32, 3, 2},
                             {SHMF_CELL_TYPES, SHMF_UINT8},     {SHMF_CELL_BLOCKS, SHMF_UINT32}};
  ASSERT_EQ(read_all(file.get(), wanted, why), SHMF_OK) << why.message;
  const auto narrow = [](const Wanted& wide) {
    std::vector<float> out;
    for (const double v : wide.values<double>()) out.push_back(static_cast<float>(v));
    return raw(out);
  };
  EXPECT_EQ(wanted[1].bytes(), narrow(wanted[0]));
  EXPECT_EQ(wanted[5].bytes(), narrow(wanted[4]));
  const auto few = wanted[2].values<std::uint32_t>();
  const auto many = wanted[3].values<std::int64_t>();
  EXPECT_TRUE(std::equal(few.begin(), few.end(), many.begin(), many.end()));
  const auto types = wanted[6].values<std::uint8_t>();
  const auto blocks = wanted[7].values<std::uint32_t>();
  ASSERT_EQ(types.size(), blocks.size());
  for (std::size_t c = 0; c < types.size(); ++c) EXPECT_EQ(types[c], blocks[c] == 1 ? 13 : 12);
}

TEST(CInterface, WrongTargetsAreMisuseBeforeAnyIsFilled) {
  const Bytes bytes = two_blocks_file();
  const File file = opened(bytes);
  std::vector<std::uint64_t> memory(100000, 7);
  const auto refused = [&](Wanted wanted, std::uint64_t room, const std::string& word) {
    std::vector<shmf_target> targets(2);
    targets[0] = Wanted(SHMF_POINTS, SHMF_FLOAT64).target;
    targets[0].data = memory.data();
    targets[0].bytes = memory.size() * 8;
    targets[1] = wanted.target;
    targets[1].data = memory.data() + 50000;
    targets[1].bytes = room;
    shmf_error why{};
    EXPECT_EQ(shmf_read(file.get(), targets.data(), 2, nullptr, &why), SHMF_MISUSE) << word;
    EXPECT_NE(std::string(why.message).find("target 1"), std::string::npos) << why.message;
    EXPECT_NE(std::string(why.detail).find(word), std::string::npos) << why.detail;
    EXPECT_EQ(std::count(memory.begin(), memory.end(), 7), std::ptrdiff_t{100000});
    return targets[1].used;
  };
  const std::uint64_t corners = refused({SHMF_CORNERS, SHMF_INT64}, 100, "room for 100 bytes");
  EXPECT_GT(corners, 100u);
  refused({SHMF_CORNERS, SHMF_INT64}, corners - 1, "room for");
  refused({SHMF_CORNERS, SHMF_INT16}, 400000, "32-bit or 64-bit integers");
  refused({SHMF_POINTS, SHMF_INT32}, 400000, "float32 or float64");
  refused({SHMF_CELL_TYPES, SHMF_INT32}, 400000, "uint8");
  refused({SHMF_VALUES, SHMF_INT32, 0}, 400000, "another type");
  refused({SHMF_VALUES, SHMF_FLOAT64, 6}, 400000, "no array 6");
  refused({SHMF_VALUES, SHMF_FLOAT64, 0, 1}, 400000, "the array is static");
  refused({99, SHMF_FLOAT64}, 400000, "there is no shmf_what 99");
  refused({SHMF_POINTS, 0}, 400000, "no type 0");
}

// The index states the number of cells in each block. The size of an array on a block depends on
// this number.
TEST(CInterface, AnIndexThatLiesAboutBlocksIsCorrupt) {
  const Bytes bytes = two_blocks_file();
  for (const int more : {-1, 1}) {
    const Bytes inconsistent = with_index(bytes, [&](container::Index& index) {
      index.block_cells[0] += static_cast<std::uint64_t>(more);
      index.block_cells[1] -= static_cast<std::uint64_t>(more);
    });
    const File file = opened(inconsistent);
    for (const std::uint32_t array :
         {2u, 5u}) {  // one array without steps and one array with steps, both on block 1
      std::vector<Wanted> wanted{{SHMF_VALUES, SHMF_FLOAT64, array}};
      shmf_error why{};
      EXPECT_EQ(read_all(file.get(), wanted, why), SHMF_CORRUPT) << array << ", " << more;
    }
  }
}

TEST(CInterface, ASelectionThatFailsLeavesTheOneBefore) {
  const Bytes bytes = two_blocks_file();
  const File file = opened(bytes);
  shmf_selection selection{};
  selection.struct_size = sizeof selection;
  selection.first_cell = 10;
  selection.end_cell = 20;
  shmf_counts counts{};
  counts.struct_size = sizeof counts;
  ASSERT_EQ(shmf_select(file.get(), &selection, nullptr, &counts, nullptr), SHMF_OK);
  shmf_selection wrong = selection;
  wrong.end_cell = std::uint64_t{1} << 40;
  EXPECT_NE(shmf_select(file.get(), &wrong, nullptr, nullptr, nullptr), SHMF_OK);
  shmf_target numbers = Wanted(SHMF_CELL_NUMBERS, SHMF_INT64).target;
  ASSERT_EQ(shmf_read(file.get(), &numbers, 1, nullptr, nullptr), SHMF_OK);
  EXPECT_EQ(numbers.used, counts.cells * 8);
}

TEST(CInterface, CallsFromWithinACallAreMisuse) {
  const Bytes bytes = two_blocks_file();
  const File file = opened(bytes);
  struct Nested {
    shmf_file* file;
    int calls = 0;
  } nested{file.get()};
  shmf_run_options run{};
  run.struct_size = sizeof run;
  run.context = &nested;
  run.progress = [](void* context, double) {
    auto& own = *static_cast<Nested*>(context);
    ++own.calls;
    shmf_error why{};
    EXPECT_EQ(shmf_select(own.file, nullptr, nullptr, nullptr, &why), SHMF_MISUSE);
    EXPECT_NE(std::string(why.detail).find("busy"), std::string::npos);
    return 0;
  };
  EXPECT_EQ(shmf_verify(file.get(), &run, nullptr), SHMF_OK);
  EXPECT_GT(nested.calls, 0);
  EXPECT_EQ(shmf_verify(file.get(), nullptr, nullptr), SHMF_OK);
}

// The caller may have been compiled with an older or a newer header, whose structs have fewer or
// more members.
TEST(CInterface, StructsMayBeShorterAndLonger) {
  const Bytes bytes = two_blocks_file();
  const File file = opened(bytes);
  struct Shorter {
    size_t struct_size;
    std::uint64_t vertices, untouched;
  } shorter{offsetof(Shorter, untouched), 0, 5};
  ASSERT_EQ(shmf_get_info(file.get(), reinterpret_cast<shmf_info*>(&shorter), nullptr), SHMF_OK);
  EXPECT_EQ(shorter.struct_size, offsetof(Shorter, untouched));
  EXPECT_GT(shorter.vertices, 0u);
  EXPECT_EQ(shorter.untouched, 5u);
  struct {
    shmf_info known;
    std::uint64_t untouched;
  } longer{{}, 5};
  longer.known.struct_size = sizeof longer;
  ASSERT_EQ(shmf_get_info(file.get(), &longer.known, nullptr), SHMF_OK);
  EXPECT_EQ(longer.known.struct_size, sizeof longer);
  EXPECT_EQ(longer.known.vertices, shorter.vertices);
  EXPECT_EQ(longer.untouched, 5u);
  shmf_info none{};
  shmf_error why{};
  EXPECT_EQ(shmf_get_info(file.get(), &none, &why), SHMF_MISUSE);
  EXPECT_NE(std::string(why.detail).find("struct_size"), std::string::npos);
  EXPECT_EQ(shmf_get_info(file.get(), nullptr, &why), SHMF_MISUSE);
}

/// A source that counts its reads and can be made to fail.
struct Fetched {
  std::span<const std::byte> bytes;
  std::uint64_t reads = 0, read_bytes = 0, fails_at = ~std::uint64_t{0};
  std::uint64_t told = 0;
  int closed = 0;

  shmf_source source() {
    shmf_source out{};
    out.struct_size = sizeof out;
    out.context = this;
    out.bytes = bytes.size();
    out.read_at = [](void* context, std::uint64_t offset, void* into, std::uint64_t count,
                     char* why, size_t why_bytes) {
      auto& own = *static_cast<Fetched*>(context);
      EXPECT_LE(offset + count, own.bytes.size());
      if (own.reads++ >= own.fails_at) {
        std::strncpy(why, "the line is dead", why_bytes);
        return 1;
      }
      own.read_bytes += count;
      std::memcpy(into, own.bytes.data() + offset, count);
      return 0;
    };
    out.close = [](void* context) { ++static_cast<Fetched*>(context)->closed; };
    out.prefetch = [](void* context, const shmf_range* ranges, size_t count) {
      for (size_t i = 0; i < count; ++i) static_cast<Fetched*>(context)->told += ranges[i].bytes;
    };
    return out;
  }
};

TEST(CInterface, SourcesAreClosedOnceAndMayFailAnywhere) {
  const Bytes bytes = two_blocks_file();
  std::uint64_t reads = 1;
  for (std::uint64_t fails_at = 0; fails_at <= reads; ++fails_at) {
    Fetched fetched{bytes};
    fetched.fails_at = fails_at;
    const shmf_source source = fetched.source();
    shmf_file* file = nullptr;
    shmf_error why{};
    shmf_status status = shmf_open_source(&source, nullptr, &file, &why);
    EXPECT_EQ(file == nullptr, status != SHMF_OK);
    if (status == SHMF_OK) {
      EXPECT_EQ(fetched.closed, 0);
      std::vector<Wanted> wanted{{SHMF_POINTS, SHMF_FLOAT64},
                                 {SHMF_VALUES, SHMF_FLOAT64, 1},
                                 {SHMF_VALUES, SHMF_FLOAT64, 4, 1}};
      status = read_all(file, wanted, why);
    }
    shmf_close(file);
    EXPECT_EQ(fetched.closed, 1);
    reads = std::max(reads, fetched.reads);
    if (fails_at < fetched.reads) {
      EXPECT_EQ(status, SHMF_IO);
      EXPECT_STREQ(why.detail, "the line is dead");
    } else {
      EXPECT_EQ(status, SHMF_OK) << why.message;
    }
  }
  EXPECT_GT(reads, 5u);
  Fetched fetched{bytes};
  shmf_source source = fetched.source();
  EXPECT_EQ(shmf_open_source(&source, nullptr, nullptr, nullptr), SHMF_MISUSE);
  EXPECT_EQ(fetched.closed, 1);
  source.read_at = nullptr;
  shmf_file* file = nullptr;
  EXPECT_EQ(shmf_open_source(&source, nullptr, &file, nullptr), SHMF_MISUSE);
  EXPECT_EQ(fetched.closed, 2);
}

// The library must not read data that was not requested.
TEST(CInterface, OnlyWhatIsWantedIsRead) {
  const Bytes bytes = two_blocks_file();
  const auto fetched_for = [&](std::vector<Wanted> wanted) {
    Fetched fetched{bytes};
    const shmf_source source = fetched.source();
    shmf_file* file = nullptr;
    shmf_error why{};
    EXPECT_EQ(shmf_open_source(&source, nullptr, &file, &why), SHMF_OK) << why.message;
    const std::uint64_t opened = fetched.read_bytes;
    EXPECT_EQ(read_all(file, wanted, why), SHMF_OK) << why.message;
    shmf_close(file);
    EXPECT_EQ(fetched.told, fetched.read_bytes - opened);
    return fetched.read_bytes;
  };
  const auto nothing = fetched_for({});
  const auto corners = fetched_for({{SHMF_CORNERS, SHMF_INT32}});
  const auto points = fetched_for({{SHMF_POINTS, SHMF_FLOAT64}});
  const auto values = fetched_for({{SHMF_VALUES, SHMF_FLOAT64, 1}});
  EXPECT_LT(nothing, bytes.size() / 4);
  EXPECT_LT(corners + 1000, points);
  EXPECT_LT(corners + 500, values);
}

TEST(CInterface, ThreadsGiveTheSame) {
  const Bytes bytes = two_blocks_file();
  std::vector<std::vector<double>> read;
  for (const std::uint32_t threads : {0u, 1u, 3u, SHMF_ALL_THREADS}) {
    const File file = opened(bytes);
    shmf_run_options run{};
    run.struct_size = sizeof run;
    run.threads = threads;
    shmf_counts counts{};
    counts.struct_size = sizeof counts;
    ASSERT_EQ(shmf_select(file.get(), nullptr, &run, &counts, nullptr), SHMF_OK);
    std::vector<double> points(counts.vertices * 3);
    shmf_target target{};
    target.struct_size = sizeof target;
    target.what = SHMF_POINTS;
    target.type = SHMF_FLOAT64;
    target.data = points.data();
    target.bytes = points.size() * sizeof(double);
    ASSERT_EQ(shmf_read(file.get(), &target, 1, &run, nullptr), SHMF_OK);
    EXPECT_EQ(shmf_verify(file.get(), &run, nullptr), SHMF_OK);
    read.push_back(std::move(points));
  }
  for (const auto& points : read) EXPECT_EQ(points, read.front());
}

TEST(CInterface, ACallerMayEndARun) {
  const Bytes bytes = two_blocks_file();
  const File file = opened(bytes);
  std::vector<double> told;
  shmf_run_options run{};
  run.struct_size = sizeof run;
  run.context = &told;
  run.progress = [](void* context, double done) {
    static_cast<std::vector<double>*>(context)->push_back(done);
    return 0;
  };
  ASSERT_EQ(shmf_verify(file.get(), &run, nullptr), SHMF_OK);
  ASSERT_FALSE(told.empty());
  EXPECT_EQ(told.back(), 1.0);
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  run.progress = [](void*, double) { return 1; };
  shmf_error why{};
  EXPECT_EQ(shmf_verify(file.get(), &run, &why), SHMF_CANCELLED);
  EXPECT_EQ(why.status, SHMF_CANCELLED);
  std::vector<double> points(100000);
  shmf_target target = Wanted(SHMF_POINTS, SHMF_FLOAT64).target;
  target.data = points.data();
  target.bytes = points.size() * 8;
  EXPECT_EQ(shmf_read(file.get(), &target, 1, &run, &why), SHMF_CANCELLED);
  EXPECT_EQ(shmf_read(file.get(), &target, 1, nullptr, &why), SHMF_OK);
}

// Data that is still complete in a truncated file can be read.
TEST(CInterface, DamagedFilesGiveWhatIsWhole) {
  const Bytes bytes = two_blocks_file();
  const File whole = opened(bytes);
  const auto cut = std::span(bytes).first(bytes.size() - 200);
  shmf_file* none = nullptr;
  shmf_error why{};
  EXPECT_EQ(shmf_open_memory(cut.data(), cut.size(), nullptr, &none, &why), SHMF_TRUNCATED);
  EXPECT_EQ(none, nullptr);
  const File left = opened(cut, true);
  ASSERT_TRUE(left);
  std::vector<Wanted> wanted{
      {SHMF_POINTS, SHMF_FLOAT64}, {SHMF_CORNERS, SHMF_INT64}, {SHMF_VALUES, SHMF_FLOAT64, 1}};
  std::vector<Wanted> again = wanted;
  ASSERT_EQ(read_all(whole.get(), wanted, why), SHMF_OK) << why.message;
  ASSERT_EQ(read_all(left.get(), again, why), SHMF_OK) << why.message;
  for (std::size_t i = 0; i < wanted.size(); ++i) EXPECT_EQ(wanted[i].bytes(), again[i].bytes());
  EXPECT_EQ(shmf_verify(left.get(), nullptr, &why), SHMF_MISUSE);
}

/// Returns the line of list.txt that describes a faulty file.
std::string faulty_line(const std::string& number) {
  std::ifstream list(faulty_folder() / "list.txt");
  for (std::string line; std::getline(list, line);)
    if (line.starts_with(number)) return line;
  return {};
}

// Every faulty file leads to an error: when it is opened, when it is verified, or when all of its
// data is read.
TEST(CInterface, EveryFaultyFileIsRefused) {
  for (const auto& entry : std::filesystem::directory_iterator(faulty_folder())) {
    if (entry.path().extension() != ".shm") continue;
    SCOPED_TRACE(entry.path());
    const std::string bytes = content(entry.path());
    shmf_error why{};
    shmf_file* file = nullptr;
    shmf_status status = shmf_open_memory(bytes.data(), bytes.size(), nullptr, &file, &why);
    const File owner(file);
    if (status == SHMF_OK && shmf_member_count(file) == 0)
      status = shmf_verify(file, nullptr, &why);
    if (status == SHMF_OK && shmf_member_count(file) > 0) continue;  // a member is faulty
    // Faults after the last index are data that was not committed.
    const std::string line = faulty_line(entry.path().stem().string());
    if (line.find("truncated Commit:") != std::string::npos) continue;
    EXPECT_NE(status, SHMF_OK);
    EXPECT_GT(std::strlen(why.message), 10u);
  }
}

/// Passes a whole stream to the decoder in pieces of `piece` bytes.
std::map<std::int32_t, int> decoded(std::span<const std::byte> bytes, std::size_t piece, Bytes& xyz,
                                    shmf_status& status,
                                    const shmf_open_options* options = nullptr) {
  shmf_decoder* handle = nullptr;
  EXPECT_EQ(shmf_decoder_new(options, &handle, nullptr), SHMF_OK);
  const CDecoder decoder(handle);
  std::map<std::int32_t, int> kinds;
  shmf_info info{};
  info.struct_size = sizeof info;
  EXPECT_EQ(shmf_decoder_info(handle, &info, nullptr), SHMF_MISUSE);
  while (true) {
    shmf_item item{};
    item.struct_size = sizeof item;
    shmf_error why{};
    status = shmf_decoder_next(handle, &item, &why);
    if (status != SHMF_OK) return kinds;
    if (item.kind != SHMF_NEED_INPUT) ++kinds[item.kind];
    if (item.kind == SHMF_END) return kinds;
    if (item.kind == SHMF_NEED_INPUT) {
      const auto some = bytes.first(std::min(piece, bytes.size()));
      bytes = bytes.subspan(some.size());
      status = shmf_decoder_feed(handle, some.data(), some.size(), &why);
      if (status != SHMF_OK) return kinds;
    }
    if (item.kind == SHMF_MESH) {
      EXPECT_EQ(shmf_decoder_info(handle, &info, nullptr), SHMF_OK);
      const auto* points = static_cast<const std::byte*>(item.xyz);
      xyz.insert(xyz.end(), points, points + item.vertices * 24);
    }
  }
}

TEST(CInterface, StreamsComeInPiecesOfAnySize) {
  const Bytes bytes = two_blocks_file(Order::stream);
  MemorySource source(bytes);
  const auto mesh = read_mesh(source);
  ASSERT_TRUE(mesh);
  for (const std::size_t piece : {std::size_t{1}, std::size_t{777}, bytes.size()}) {
    Bytes xyz;
    shmf_status status{};
    const auto kinds = decoded(bytes, piece, xyz, status);
    EXPECT_EQ(status, SHMF_OK);
    EXPECT_EQ(xyz, mesh->xyz);
    EXPECT_EQ(kinds.at(SHMF_END), 1);
    EXPECT_EQ(kinds.at(SHMF_TIMES), 1);
    EXPECT_GE(kinds.at(SHMF_STEP), 9);
  }
  Bytes xyz;
  shmf_status status{};
  decoded(std::span(bytes).first(bytes.size() / 2), 1000, xyz, status);
  EXPECT_EQ(status, SHMF_TRUNCATED);
}

TEST(CInterface, WhatComesOutMayBeLimited) {
  const Bytes bytes = two_blocks_file();
  using Limit = std::uint64_t shmf_open_options::*;
  for (const Limit limit : {&shmf_open_options::max_cells, &shmf_open_options::max_vertices,
                            &shmf_open_options::max_decoded_bytes})
    for (const bool enough : {false, true}) {
      shmf_open_options options{};
      options.struct_size = sizeof options;
      options.*limit = enough ? 1000000 : 3;
      Bytes xyz;
      shmf_status status{};
      decoded(bytes, bytes.size(), xyz, status, &options);
      EXPECT_EQ(status, enough ? SHMF_OK : SHMF_OVER_LIMIT);
      shmf_file* file = nullptr;
      const bool by_index = limit != &shmf_open_options::max_decoded_bytes;
      EXPECT_EQ(shmf_open_memory(bytes.data(), bytes.size(), &options, &file, nullptr),
                enough || !by_index ? SHMF_OK : SHMF_OVER_LIMIT);
      shmf_close(file);
    }
}

TEST(CInterface, ActiveVerticesMayBeLimited) {
  MemorySink sink;
  ASSERT_TRUE(write_mesh(grid(100, 100, 2, ScalarType::float64), sink,
                         {.connectivity = ConnectivityCodec::rows}));
  for (const bool enough : {false, true}) {
    shmf_open_options options{};
    options.struct_size = sizeof options;
    options.max_active_bytes = enough ? 0 : 1;
    Bytes xyz;
    shmf_status status{};
    decoded(sink.bytes, sink.bytes.size(), xyz, status, &options);
    EXPECT_EQ(status, enough ? SHMF_OK : SHMF_OVER_LIMIT);
  }
}

TEST(CInterface, WordsAndNumbersAreThose) {
  EXPECT_EQ(shmf_version(), static_cast<std::uint32_t>(SHMF_VERSION));
  EXPECT_EQ(std::string(shmf_version_string()), std::to_string(SHMF_VERSION_MAJOR) + "." +
                                                    std::to_string(SHMF_VERSION_MINOR) + "." +
                                                    std::to_string(SHMF_VERSION_PATCH));
  EXPECT_EQ(static_cast<int>(ErrorCode::output), static_cast<int>(SHMF_OUTPUT));
  EXPECT_EQ(static_cast<int>(ScalarType::float64), static_cast<int>(SHMF_FLOAT64));
  EXPECT_EQ(static_cast<int>(CellShape::faces), static_cast<int>(SHMF_FACES));
  EXPECT_EQ(static_cast<int>(Order::free), static_cast<int>(SHMF_ORDER_FREE));
  EXPECT_EQ(static_cast<int>(MeshSet::Kind::elements), static_cast<int>(SHMF_ELEMENT_SET));
  EXPECT_STREQ(shmf_status_name(SHMF_CORRUPT), "corrupt");
  EXPECT_STREQ(shmf_status_name(-1), "unknown");
  EXPECT_STREQ(shmf_status_name(10), "unknown");
  EXPECT_EQ(shmf_type_bytes(SHMF_FLOAT32), 4u);
  EXPECT_EQ(shmf_type_bytes(11), 0u);
  EXPECT_EQ(shmf_vtk_cell_type(SHMF_HEXAHEDRON, 20, SHMF_LAGRANGE), 25);
  EXPECT_EQ(shmf_vtk_cell_type(SHMF_HEXAHEDRON, 21, SHMF_LAGRANGE), 2);
  EXPECT_EQ(shmf_vtk_cell_type(SHMF_HEXAHEDRON, 64, SHMF_LAGRANGE), 72);
  EXPECT_EQ(shmf_vtk_cell_type(SHMF_HEXAHEDRON, 64, SHMF_BEZIER), 79);
  EXPECT_EQ(shmf_vtk_cell_type(SHMF_QUAD, 16, SHMF_SERENDIPITY), 2);
  EXPECT_EQ(shmf_vtk_cell_type(SHMF_PYRAMID, 30, SHMF_LAGRANGE), 2);
  EXPECT_EQ(shmf_vtk_cell_type(SHMF_HEXAHEDRON, 64, 3), 2);
  EXPECT_EQ(shmf_cell_order(SHMF_QUAD, 16, SHMF_LAGRANGE), 3u);
  EXPECT_EQ(shmf_cell_order(SHMF_QUAD, 16, SHMF_SERENDIPITY), 4u);
  EXPECT_EQ(shmf_cell_order(SHMF_QUAD, 17, SHMF_LAGRANGE), 0u);
  EXPECT_EQ(shmf_cell_order(-1, 8, SHMF_LAGRANGE), 0u);
  EXPECT_EQ(shmf_cell_order(SHMF_HEXAHEDRON, 8, -1), 0u);
  std::array<std::uint8_t, 12> places{};
  EXPECT_EQ(shmf_node_places(SHMF_LINE, SHMF_LAGRANGE, 3, places.data()), 4u);
  EXPECT_EQ(places, (std::array<std::uint8_t, 12>{0, 0, 0, 3, 0, 0, 1, 0, 0, 2, 0, 0}));
  EXPECT_EQ(shmf_node_places(SHMF_HEXAHEDRON, SHMF_LAGRANGE, 10, nullptr), 1331u);
  EXPECT_EQ(shmf_node_places(SHMF_HEXAHEDRON, SHMF_LAGRANGE, 11, nullptr), 0u);
  EXPECT_EQ(shmf_node_places(SHMF_POLYGON, SHMF_LAGRANGE, 1, nullptr), 0u);
}

TEST(CInterface, NullIsMisuseEverywhere) {
  shmf_error why{};
  EXPECT_EQ(shmf_open_path(nullptr, nullptr, nullptr, &why), SHMF_MISUSE);
  shmf_file* file = nullptr;
  EXPECT_EQ(shmf_open_path(nullptr, nullptr, &file, &why), SHMF_MISUSE);
  EXPECT_EQ(shmf_open_source(nullptr, nullptr, &file, &why), SHMF_MISUSE);
  EXPECT_EQ(shmf_read(nullptr, nullptr, 0, nullptr, &why), SHMF_MISUSE);
  EXPECT_EQ(shmf_verify(nullptr, nullptr, nullptr), SHMF_MISUSE);
  EXPECT_EQ(shmf_find_array(nullptr, 0, "x"), -1);
  EXPECT_EQ(shmf_member_count(nullptr), 0u);
  EXPECT_EQ(shmf_decoder_next(nullptr, nullptr, &why), SHMF_MISUSE);
  EXPECT_EQ(shmf_writer_finish(nullptr, nullptr, &why), SHMF_MISUSE);
  shmf_close(nullptr);
  shmf_decoder_free(nullptr);
  shmf_writer_free(nullptr);
}

}  // namespace
}  // namespace shm
