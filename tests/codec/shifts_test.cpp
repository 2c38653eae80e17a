// Tests of cells encoded as shifts: all cells are restored, grids need almost no bytes, and damaged
// bytes are handled safely.
#include "codecs/shifts/shifts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <random>
#include <unordered_map>
#include <utility>
#include <vector>

#include "base/binary.h"
#include "base/packing.h"

namespace shm {
namespace {

using Bytes = std::vector<std::byte>;
using Numbers = std::vector<std::uint64_t>;

struct Cell {
  CellMarks marks;
  Numbers numbers;
  bool operator==(const Cell&) const = default;
};
struct Group {
  std::vector<Cell> cells;
  Numbers unused;
  bool operator==(const Group&) const = default;
};

Schema schema_of(const std::vector<std::uint32_t>& nodes) {
  Schema schema;
  for (std::uint32_t n : nodes) schema.blocks.push_back({1, "", CellShape::other, n});
  return schema;
}
Schema hexahedra() { return schema_of({8}); }

constexpr std::uint64_t kNoLimit = std::uint64_t{1} << 30;

ZstdCompressor& packing() {
  static ZstdCompressor it;
  return it;
}
ZstdDecompressor& unpacking() {
  static ZstdDecompressor it;
  return it;
}

Bytes encode(ShiftEncoder& encoder, const Group& group) {
  for (const Cell& cell : group.cells) encoder.add_cell(cell.marks, cell.numbers);
  for (std::uint64_t number : group.unused) encoder.add_unused(number);
  EXPECT_EQ(encoder.symbols().size(), group.cells.size());
  return encoder.finish(packing());
}
bool begin(ShiftDecoder& decoder, std::span<const std::byte> bytes, std::size_t cells,
           std::uint64_t limit = kNoLimit) {
  return decoder.begin_group(bytes, static_cast<std::uint32_t>(cells), limit, unpacking());
}

/// Cells with one shift.
struct SomeCells {
  const CellMarks* marks = nullptr;
  std::size_t count = 0;
  std::uint32_t nodes = 0;
  Numbers numbers;
};
SomeCells next_cells(ShiftDecoder& decoder, std::size_t most) {
  SomeCells some;
  some.numbers.resize(most * kMostShiftNodes);
  const auto [marks, count] = decoder.next_cells(some.numbers.data(), most);
  if (marks == nullptr) return {};
  EXPECT_GE(count, 1u);
  EXPECT_LE(count, most);
  some.marks = marks;
  some.count = count;
  some.nodes = decoder.nodes(marks->block);
  return some;
}

/// Decodes a group. Returns an empty optional if its bytes are invalid.
std::optional<Group> decode(ShiftDecoder& decoder, std::span<const std::byte> bytes,
                            std::size_t cells, std::size_t unused = 0) {
  if (!begin(decoder, bytes, cells)) return std::nullopt;
  Group group;
  for (std::size_t most = 1; group.cells.size() < cells; most = most % 64 + 1) {
    const SomeCells some = next_cells(decoder, std::min(most, cells - group.cells.size()));
    if (some.marks == nullptr) return std::nullopt;
    for (std::size_t c = 0; c < some.count; ++c) {
      const auto begin = some.numbers.begin() + static_cast<std::ptrdiff_t>(c * some.nodes);
      group.cells.push_back({*some.marks, {begin, begin + some.nodes}});
    }
  }
  for (std::size_t i = 0; i < unused; ++i) {
    const auto number = decoder.next_unused();
    if (!number) return std::nullopt;
    group.unused.push_back(*number);
  }
  if (!decoder.at_end()) return std::nullopt;
  return group;
}

/// Encodes each group and checks that it decodes correctly. Returns the encoded sizes in bytes.
std::vector<std::size_t> expect_back(const Schema& schema, const std::vector<Group>& groups,
                                     bool may_import = false) {
  ShiftEncoder encoder(schema, may_import);
  ShiftDecoder decoder(schema, may_import);
  std::vector<std::size_t> sizes;
  for (const Group& group : groups) {
    const Bytes bytes = encode(encoder, group);
    sizes.push_back(bytes.size());
    const auto back = decode(decoder, bytes, group.cells.size(), group.unused.size());
    EXPECT_TRUE(back.has_value()) << "group " << sizes.size() - 1;
    if (back) {
      EXPECT_TRUE(*back == group) << "group " << sizes.size() - 1;
    }
  }
  return sizes;
}

/// Marks the first and the last use of each vertex in the cells. If is_imported(number) is true,
/// marks the first use as an import.
template <class IsImported>
void mark(Group& group, IsImported&& is_imported) {
  std::unordered_map<std::uint64_t, std::pair<std::size_t, std::size_t>> last;  // cell, node
  for (std::size_t c = 0; c < group.cells.size(); ++c) {
    Cell& cell = group.cells[c];
    for (std::size_t i = 0; i < cell.numbers.size(); ++i) {
      const std::uint64_t number = cell.numbers[i], bit = std::uint64_t{1} << i;
      if (last.insert_or_assign(number, std::pair(c, i)).second) {
        cell.marks.introduced |= bit;
        if (is_imported(number)) cell.marks.imports |= bit;
      }
    }
  }
  for (const auto& [number, at] : last)
    group.cells[at.first].marks.last_use |= std::uint64_t{1} << at.second;
}
void mark(Group& group) {
  mark(group, [](std::uint64_t) { return false; });
}

/// Returns a grid in scanline order. Its vertices are numbered consecutively, beginning with
/// `first`.
Group grid(std::uint64_t nx, std::uint64_t ny, std::uint64_t nz, std::uint64_t first = 0) {
  Group group;
  const auto v = [&](std::uint64_t i, std::uint64_t j, std::uint64_t k) {
    return first + i + (nx + 1) * (j + (ny + 1) * k);
  };
  for (std::uint64_t k = 0; k < nz; ++k)
    for (std::uint64_t j = 0; j < ny; ++j)
      for (std::uint64_t i = 0; i < nx; ++i)
        group.cells.push_back(
            {{},
             {v(i, j, k), v(i + 1, j, k), v(i + 1, j + 1, k), v(i, j + 1, k), v(i, j, k + 1),
              v(i + 1, j, k + 1), v(i + 1, j + 1, k + 1), v(i, j + 1, k + 1)}});
  mark(group);
  return group;
}

Cell random_cell(const Schema& schema, bool may_import, std::mt19937_64& random) {
  Cell cell;
  cell.marks.block = static_cast<std::uint32_t>(random() % schema.blocks.size());
  const std::uint32_t nodes = schema.blocks[cell.marks.block].nodes_per_cell;
  const std::uint64_t all = ~std::uint64_t{0} >> (64 - nodes);
  cell.marks.introduced = random() & all;
  cell.marks.imports = may_import ? random() & cell.marks.introduced : 0;
  cell.marks.last_use = random() & all;
  for (std::uint32_t i = 0; i < nodes; ++i) cell.numbers.push_back(random() >> random() % 64);
  return cell;
}

// --- supported schemas

TEST(Shifts, SchemasThatTakeThem) {
  Schema schema = schema_of({8, 1, 64});
  EXPECT_TRUE(takes_shifts(schema));
  EXPECT_TRUE(takes_shifts(schema_of({})));
  for (const Order order : {Order::stream, Order::free}) {
    schema.order = order;
    EXPECT_TRUE(takes_shifts(schema));
  }
  schema.delay = 1;
  EXPECT_FALSE(takes_shifts(schema));
  schema.delay = 0;
  schema.arrays.resize(2);
  EXPECT_TRUE(takes_shifts(schema));
  schema.arrays[1].per_step = true;
  schema.arrays[1].components = kMostShiftStepComponents;
  EXPECT_TRUE(takes_shifts(schema));
  schema.arrays[1].components = kMostShiftStepComponents + 1;
  EXPECT_FALSE(takes_shifts(schema));
  EXPECT_FALSE(takes_shifts(schema_of({8, 0})));
  EXPECT_FALSE(takes_shifts(schema_of({65, 8})));
}

// --- round trips

TEST(Shifts, NothingAtAll) {
  expect_back(hexahedra(), {{}, {}});
  expect_back(schema_of({}), {{}});
}

TEST(Shifts, GridsCostNextToNothing) {
  const auto sizes = expect_back(hexahedra(), {grid(40, 40, 40)});
  EXPECT_LE(sizes[0], 64000u / 8 / 16);  // one bit for sixteen cells
  // A group that is equal to the previous group needs no new shifts.
  const auto again = expect_back(hexahedra(), {grid(9, 8, 7), grid(9, 8, 7)});
  EXPECT_LE(4 * again[1], 3 * again[0]);
}

TEST(Shifts, MoreThanThereArePlaces) {
  for (const std::uint64_t different : {254u, 255u, 256u, 257u, 700u}) {
    Group group;
    std::uint64_t at = 0;
    std::mt19937_64 random(1);
    for (std::uint64_t n = 0; n < 5000; ++n) {
      // The first cells use all different shifts in turn; the following cells use random shifts.
      // Some shifts therefore recur soon, and others recur only after the table has dropped them.
      at += 1 + (n < 2 * different ? n : random()) % different;
      Cell cell;
      for (std::uint64_t i = 0; i < 8; ++i) cell.numbers.push_back(at + i);
      group.cells.push_back(cell);
    }
    mark(group);
    expect_back(hexahedra(), {group});
  }
}

TEST(Shifts, OneForEachCell) {
  std::mt19937_64 random(2);
  std::vector<Group> groups(3);
  for (Group& group : groups)
    for (int n = 0; n < 1000; ++n) group.cells.push_back(random_cell(hexahedra(), false, random));
  expect_back(hexahedra(), groups);
}

TEST(Shifts, CellsOfOneToSixtyFourNodes) {
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t n = 1; n <= kMostShiftNodes; ++n) nodes.push_back(n);
  std::mt19937_64 random(3);
  const Schema schema = schema_of(nodes);
  Group any, rows;
  for (int n = 0; n < 2000; ++n) any.cells.push_back(random_cell(schema, false, random));
  // Each block is one row of cells. The cells of different blocks alternate.
  for (std::uint64_t n = 0; n < 50; ++n)
    for (std::uint32_t block = 0; block < nodes.size(); ++block) {
      Cell cell;
      cell.marks.block = block;
      for (std::uint64_t i = 0; i < nodes[block]; ++i)
        cell.numbers.push_back((std::uint64_t{block} << 32) + n + i);
      rows.cells.push_back(cell);
    }
  mark(rows);
  const auto sizes = expect_back(schema, {any, rows, rows});
  // The bytes encode the first and the last cell of each row, and the change from one row to the
  // next.
  EXPECT_LE(sizes[1], 64u * 64 * 4);
}

TEST(Shifts, BlocksRememberTheirOwnLastCell) {
  // Two grids whose cells alternate.
  Schema schema = schema_of({8, 8});
  const Group one = grid(10, 10, 10), two = grid(10, 10, 10, 1 << 20);
  Group both;
  for (std::size_t c = 0; c < one.cells.size(); ++c) {
    both.cells.push_back(one.cells[c]);
    both.cells.push_back(two.cells[c]);
    both.cells.back().marks.block = 1;
  }
  EXPECT_LE(expect_back(schema, {both})[0], 2000u);
}

TEST(Shifts, UnusedVertices) {
  Group alone, behind = grid(3, 3, 3);
  alone.unused = {5, 4, 1000, 0, ~std::uint64_t{0}, std::uint64_t{1} << 63, 7};
  behind.unused = {100, 101, 102};
  expect_back(hexahedra(), {alone, behind, alone, behind});
  expect_back(schema_of({}), {alone, alone});
  Group many;
  for (std::uint64_t n = 0; n < 100000; ++n) many.unused.push_back(3 * n);
  EXPECT_LE(expect_back(hexahedra(), {many})[0], 100u);
}

TEST(Shifts, NumbersUpToTheLast) {
  const std::uint64_t last = ~std::uint64_t{0};
  const Group high = grid(9, 9, 9, last - 999);  // its last vertex has the largest number
  ASSERT_EQ(high.cells.back().numbers[6], last);
  expect_back(hexahedra(), {high, grid(9, 9, 9), high});
  Group ends;
  for (int n = 0; n < 10; ++n)
    ends.cells.push_back({{}, {0, last, 1, last - 1, std::uint64_t{1} << 63, last / 2, 0, last}});
  ends.cells.push_back({{}, Numbers(8, 0)});
  ends.cells.push_back({{}, Numbers(8, last)});
  mark(ends);
  expect_back(hexahedra(), {ends});
}

TEST(Shifts, Imports) {
  Group group = grid(12, 12, 12);
  for (Cell& cell : group.cells) cell.marks = {};
  mark(group, [](std::uint64_t number) { return number < 13 * 13; });
  EXPECT_LE(expect_back(hexahedra(), {group}, true)[0], 1000u);
  std::mt19937_64 random(4);
  const Schema schema = schema_of({8, 64, 3});
  std::vector<Group> groups(4);
  for (Group& it : groups) {
    for (int n = 0; n < 300; ++n) it.cells.push_back(random_cell(schema, true, random));
    it.unused = {random(), random()};
  }
  expect_back(schema, groups, true);
}

TEST(Shifts, GroupsOfAnyMake) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    std::mt19937_64 random(seed);
    const Schema schema = schema_of({8, static_cast<std::uint32_t>(1 + random() % 64)});
    const bool may_import = random() % 2 == 0;
    std::vector<Group> groups(1 + random() % 5);
    for (Group& group : groups) {
      if (random() % 3 > 0)
        group =
            grid(1 + random() % 6, 1 + random() % 6, 1 + random() % 6, random() >> random() % 64);
      for (std::uint64_t n = random() % 300; n > 0; --n) {
        const Cell cell = random_cell(schema, may_import, random);
        const auto at = random() % (group.cells.size() + 1);
        group.cells.insert(group.cells.begin() + static_cast<std::ptrdiff_t>(at), cell);
      }
      group.unused.resize(random() % 4);
      for (std::uint64_t& number : group.unused) number = random();
    }
    SCOPED_TRACE("seed " + std::to_string(seed));
    expect_back(schema, groups, may_import);
    if (testing::Test::HasFailure()) return;
  }
}

TEST(Shifts, TheSameBytesTwice) {
  for (const Group& group : {grid(20, 20, 20), grid(3, 1, 1)}) {
    ShiftEncoder one(hexahedra(), false), two(hexahedra(), false);
    EXPECT_EQ(encode(one, group), encode(two, group));
  }
}

// --- damage

/// The two parts of an encoded group: its words, and one symbol byte per cell.
struct Parts {
  Bytes words, symbols;
};
Bytes put_together(const Parts& parts) {
  ByteWriter out, all;
  out.put_varint(parts.words.size());
  all.put_bytes(parts.words);
  all.put_bytes(parts.symbols);
  out.put_bytes(zstd_compress(all.bytes, 1));
  return std::move(out.bytes);
}
Parts take_apart(const Bytes& bytes, std::size_t cells) {
  ByteReader in(bytes);
  const std::uint64_t words = in.get_varint();
  const auto all = zstd_decompress(in.get_bytes(in.left()), words + cells);
  EXPECT_TRUE(all.has_value());
  if (!all) return {};
  const auto middle = all->begin() + static_cast<std::ptrdiff_t>(words);
  return {Bytes(all->begin(), middle), Bytes(middle, all->end())};
}

/// Decodes all cells of a group and checks that the result is valid, so that callers need not check
/// it.
void read_all(const Schema& schema, bool may_import, const Bytes& bytes, std::size_t cells) {
  ShiftDecoder decoder(schema, may_import);
  if (!begin(decoder, bytes, cells)) return;
  for (std::size_t c = 0; c < cells;) {
    const SomeCells some = next_cells(decoder, std::min<std::size_t>(cells - c, 1 + c % 5));
    const CellMarks* marks = some.marks;
    if (marks == nullptr) break;
    c += some.count;
    ASSERT_LT(marks->block, schema.blocks.size());
    const std::uint32_t nodes = schema.blocks[marks->block].nodes_per_cell;
    ASSERT_EQ(some.nodes, nodes);
    const std::uint64_t all = ~std::uint64_t{0} >> (64 - nodes);
    ASSERT_EQ((marks->introduced | marks->last_use) & ~all, 0u);
    ASSERT_EQ(marks->imports & ~marks->introduced, 0u);
    ASSERT_TRUE(may_import || marks->imports == 0);
  }
  for (int i = 0; i < 3; ++i) decoder.next_unused();
  (void)decoder.at_end();
}

struct SmallGroup {
  Schema schema = schema_of({8, 64, 2});
  bool may_import = false;
  Group group;
};
SmallGroup small_group(bool may_import) {
  SmallGroup it;
  it.may_import = may_import;
  it.group = grid(3, 2, 2);
  std::mt19937_64 random(6);
  for (int n = 0; n < 4; ++n) it.group.cells.push_back(random_cell(it.schema, may_import, random));
  it.group.unused = {100, 3};
  return it;
}

TEST(ShiftsDamaged, EveryCut) {
  for (const bool may_import : {false, true}) {
    const SmallGroup it = small_group(may_import);
    ShiftEncoder encoder(it.schema, may_import);
    const Bytes whole = encode(encoder, it.group);
    const std::size_t cells = it.group.cells.size();
    for (std::size_t size = 0; size < whole.size(); ++size) {
      // An exact-size copy, so that a read past the end is detected.
      const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
      ShiftDecoder decoder(it.schema, may_import);
      EXPECT_FALSE(begin(decoder, cut, cells)) << size;
    }
    Bytes more = whole;
    more.push_back(std::byte{0});
    ShiftDecoder decoder(it.schema, may_import);
    EXPECT_FALSE(begin(decoder, more, cells));
    // The zstd frame is valid, but the words that it contains end too early.
    const Parts parts = take_apart(whole, cells);
    for (std::size_t size = 0; size < parts.words.size(); ++size) {
      Parts less = parts;
      less.words.resize(size);
      const Bytes bytes = put_together(less);
      ShiftDecoder of_less(it.schema, may_import);
      EXPECT_FALSE(decode(of_less, bytes, cells, it.group.unused.size())) << size;
      read_all(it.schema, may_import, bytes, cells);
    }
  }
}

TEST(ShiftsDamaged, EveryByteChanged) {
  for (const bool may_import : {false, true}) {
    const SmallGroup it = small_group(may_import);
    ShiftEncoder encoder(it.schema, may_import);
    Bytes whole = encode(encoder, it.group);
    const std::size_t cells = it.group.cells.size();
    const Parts parts = take_apart(whole, cells);
    for (std::byte& byte : whole)
      for (const int change : {1, 2, 4, 8, 16, 32, 64, 128, 255}) {
        byte ^= static_cast<std::byte>(change);
        read_all(it.schema, may_import, whole, cells);
        byte ^= static_cast<std::byte>(change);
      }
    for (const bool in_words : {true, false}) {
      Parts damaged = parts;
      for (std::byte& byte : in_words ? damaged.words : damaged.symbols)
        for (const int change : {1, 2, 4, 8, 16, 32, 64, 128, 255}) {
          byte ^= static_cast<std::byte>(change);
          read_all(it.schema, may_import, put_together(damaged), cells);
          byte ^= static_cast<std::byte>(change);
        }
    }
  }
}

/// Returns the words of a group with one new shift, for a block with two nodes per cell.
Bytes words(std::uint64_t block, std::uint64_t births, std::optional<std::uint64_t> imports,
            std::uint64_t last_use) {
  ByteWriter out;
  out.put_varint(block);
  out.put_signed(5);
  out.put_signed(-5);
  out.put_varint(births);
  if (imports) out.put_varint(*imports);
  out.put_varint(last_use);
  return std::move(out.bytes);
}
Bytes symbols(std::initializer_list<int> list) {
  Bytes bytes;
  for (int value : list) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

TEST(ShiftsDamaged, LiesAreRefused) {
  const Schema schema = schema_of({2, 64});
  const auto is_good = [&](const Parts& parts, std::size_t cells, bool may_import = false) {
    ShiftDecoder decoder(schema, may_import);
    return decode(decoder, put_together(parts), cells).has_value();
  };
  EXPECT_TRUE(is_good({words(0, 3, {}, 2), symbols({255})}, 1));
  EXPECT_TRUE(is_good({words(0, 3, 1, 2), symbols({255})}, 1, true));
  EXPECT_TRUE(is_good({words(0, 3, {}, 2), symbols({255, 0, 0})}, 3));
  EXPECT_FALSE(is_good({words(2, 3, {}, 2), symbols({255})}, 1)) << "no block 2";
  EXPECT_FALSE(is_good({words(~std::uint64_t{0}, 3, {}, 2), symbols({255})}, 1))
      << "no block 2^64 - 1";
  EXPECT_FALSE(is_good({words(std::uint64_t{1} << 32, 3, {}, 2), symbols({255})}, 1))
      << "no block 2^32";
  EXPECT_FALSE(is_good({words(0, 4, {}, 2), symbols({255})}, 1)) << "a first use of a missing node";
  EXPECT_FALSE(is_good({words(0, 3, {}, std::uint64_t{1} << 63), symbols({255})}, 1))
      << "a last use of a missing node";
  EXPECT_FALSE(is_good({words(0, 1, 2, 2), symbols({255})}, 1, true))
      << "a vertex is marked as imported in a cell that is not its first use";
  EXPECT_FALSE(is_good({words(0, 3, 4, 2), symbols({255})}, 1, true))
      << "an import of a missing node";
  EXPECT_FALSE(is_good({words(0, 3, {}, 2), symbols({0})}, 1)) << "no shift at position 0 yet";
  EXPECT_FALSE(is_good({words(0, 3, {}, 2), symbols({255, 1})}, 2)) << "no shift at position 1";
  EXPECT_FALSE(is_good({words(0, 3, {}, 2), symbols({255, 254})}, 2))
      << "no shift at the last position";
  EXPECT_FALSE(is_good({words(0, 3, {}, 2), symbols({255, 255})}, 2))
      << "two new shifts, one is given";
  EXPECT_FALSE(is_good({{}, symbols({255})}, 1)) << "one new shift, none is given";
  EXPECT_FALSE(is_good({words(0, 3, {}, 2), symbols({255, 0})}, 1)) << "too many symbols";
  EXPECT_FALSE(is_good({words(0, 3, {}, 2), symbols({255})}, 2)) << "too few";
  Parts long_one{words(0, 3, {}, 2), symbols({255})};
  long_one.words.push_back(std::byte{0});
  EXPECT_FALSE(is_good(long_one, 1)) << "unused words";
}

TEST(ShiftsDamaged, SymbolsMustAllBeUsed) {
  ShiftDecoder decoder(schema_of({2}), false);
  ASSERT_TRUE(begin(decoder, put_together({words(0, 3, {}, 2), symbols({255, 0})}), 2));
  ASSERT_NE(next_cells(decoder, 9).marks, nullptr);
  EXPECT_FALSE(decoder.at_end());
  ASSERT_NE(next_cells(decoder, 9).marks, nullptr);
  EXPECT_TRUE(decoder.at_end());
  EXPECT_EQ(next_cells(decoder, 9).marks, nullptr);
  EXPECT_FALSE(decoder.next_unused().has_value());
  EXPECT_FALSE(decoder.at_end());
}

TEST(ShiftsDamaged, StatedSizesAreLimited) {
  const Parts parts{words(0, 3, {}, 2), symbols({255})};
  ShiftDecoder decoder(schema_of({2}), false);
  EXPECT_TRUE(begin(decoder, put_together(parts), 1, parts.words.size()));
  EXPECT_FALSE(begin(decoder, put_together(parts), 1, parts.words.size() - 1));
  for (const std::uint64_t stated : {kNoLimit, kNoLimit + 1, ~std::uint64_t{0}}) {
    ByteWriter out;
    out.put_varint(stated);
    out.put_bytes(zstd_compress(parts.words, 1));
    EXPECT_FALSE(begin(decoder, out.bytes, 1)) << stated;
  }
  EXPECT_FALSE(begin(decoder, {}, 0));
}

}  // namespace
}  // namespace shm
