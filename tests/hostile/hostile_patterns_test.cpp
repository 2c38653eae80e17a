// Tests of inconsistent data with correct checksums in groups whose cells are coded with the
// patterns codec.
#include <functional>
#include <string>
#include <vector>

#include "base/binary.h"
#include "base/packing.h"
#include "codecs/patterns/byte_planes.h"
#include "codecs/patterns/pattern_cells.h"
#include "hostile/hostile.h"
#include "hostile/watched_memory.h"

namespace shm {
namespace {

using Numbers = std::vector<std::uint32_t>;

/// The parsed connectivity stream of a group of the patterns codec, with all byte planes unpacked.
/// The cells of the group belong to one block.
struct PatternWords {
  std::uint8_t history_bits = 0;
  std::vector<std::uint64_t>
      runs;  // number of runs, then the block and the number of cells of each run
  std::uint64_t patterns = 0;
  Bytes ops;  // source and position
  Numbers places, last_use;
  Numbers distances, slots;
  Bytes numbers;
};

PatternWords words_of(const GroupParts& group) {
  PatternWords it;
  ByteReader in(group.streams[0]);
  ZstdDecompressor zstd;
  Bytes room;
  it.history_bits = in.get_u8();
  it.runs.push_back(in.get_varint());
  for (std::uint64_t r = 0; r < 2 * it.runs[0]; ++r) it.runs.push_back(in.get_varint());
  it.patterns = in.get_varint();
  EXPECT_TRUE(get_plane(in, it.patterns * 16, it.ops, zstd));
  EXPECT_TRUE(get_numbers(in, group.header.cells, it.places, room, zstd));
  EXPECT_TRUE(get_numbers(in, group.header.cells, it.last_use, room, zstd));
  EXPECT_TRUE(get_numbers(in, in.get_varint(), it.distances, room, zstd));
  EXPECT_TRUE(get_numbers(in, in.get_varint(), it.slots, room, zstd));
  EXPECT_TRUE(get_plane(in, in.get_varint(), it.numbers, zstd));
  EXPECT_TRUE(in.ok() && in.left() == 0);
  return it;
}

Bytes bytes_of(const PatternWords& it) {
  ByteWriter out;
  ZstdCompressor zstd;
  Bytes room;
  out.put_u8(it.history_bits);
  for (const std::uint64_t word : it.runs) out.put_varint(word);
  out.put_varint(it.patterns);
  put_plane(out, it.ops, zstd);
  put_numbers(out, it.places, room, zstd);
  put_numbers(out, it.last_use, room, zstd);
  for (const Numbers* list : {&it.distances, &it.slots}) {
    out.put_varint(list->size());
    put_numbers(out, *list, room, zstd);
  }
  out.put_varint(it.numbers.size());
  put_plane(out, it.numbers, zstd);
  return std::move(out.bytes);
}

/// Returns the file after `change` has changed the first group of its second segment.
Bytes with_words(const char* name, const std::function<void(PatternWords&)>& lie) {
  return shifts_with(
      [&](GroupParts& group) {
        PatternWords words = words_of(group);
        lie(words);
        group.streams[0] = bytes_of(words);
      },
      name);
}

/// A pattern describes each node of a cell by two bytes: the source of the vertex, and its position
/// in that source. Returns a reference to the source byte if `which` is 0, and to the position byte
/// if `which` is 1.
std::byte& op(PatternWords& words, std::size_t pattern, std::size_t node, std::size_t which) {
  return words.ops[(2 * node + which) * static_cast<std::size_t>(words.patterns) + pattern];
}
void set_op(PatternWords& words, std::size_t node, std::uint32_t source, std::uint32_t place) {
  op(words, words.places[0], node, 0) = static_cast<std::byte>(source);
  op(words, words.places[0], node, 1) = static_cast<std::byte>(place);
}

// The reader must refuse a group in which a vertex is introduced twice, is used while it is not
// live, or is not imported although an earlier segment contains it.
void expect_patterns_refuse_lies(const char* name) {
  using namespace pattern_source;
  SCOPED_TRACE(name);
  EXPECT_EQ(text_of(decode_in_pieces(with_words(name, [](PatternWords&) {}))),
            text_of(decode_in_pieces(file(name))));
  const std::vector<std::function<void(PatternWords&)>> lies = {
      [](PatternWords& w) { w.history_bits = 21; },
      [](PatternWords& w) { w.runs[0] = 0, w.runs.resize(1); },
      [](PatternWords& w) { w.runs[1] = 1; },   // no such block
      [](PatternWords& w) { w.runs[2] -= 1; },  // a cell without a run
      [](PatternWords& w) { w.runs[2] += 1; },  // more cells than the group has
      [](PatternWords& w) { w.runs[2] = ~std::uint64_t{0}; },
      [](PatternWords& w) { w.patterns += 1000; },  // more patterns than cells
      [](PatternWords& w) { w.places[0] = static_cast<std::uint32_t>(w.patterns); },
      [](PatternWords& w) { w.places.pop_back(); },
      [](PatternWords& w) { w.last_use[0] |= 0x100; },    // a node that does not exist
      [](PatternWords& w) { w.last_use[0] = 0xff; },      // a vertex that is used later
      [](PatternWords& w) { set_op(w, 0, kBefore, 0); },  // no previous cell
      [](PatternWords& w) { set_op(w, 7, kBefore, 7); },
      [](PatternWords& w) { set_op(w, 0, kOn, 0); },     // the previous cell referred to nothing
      [](PatternWords& w) { set_op(w, 0, kUsers, 0); },  // a node that does not precede
      [](PatternWords& w) { set_op(w, 7, kUsers + 12, 0); },  // no cell used it before
      [](PatternWords& w) { set_op(w, 0, kFar, 0); },         // no distance
      [](PatternWords& w) { set_op(w, 0, kFar, 0), w.distances.push_back(0); },
      [](PatternWords& w) { set_op(w, 0, kFar, 0), w.distances.push_back(1 << 30); },
      [](PatternWords& w) { set_op(w, 0, kSlot, 0); },  // no slot
      [](PatternWords& w) { set_op(w, 0, kSlot, 0), w.slots.push_back(0); },
      [](PatternWords& w) { set_op(w, 0, kSlot, 0), w.slots.push_back(~0u); },
      [](PatternWords& w) { set_op(w, 0, kHere, 0); },  // the node itself
      [](PatternWords& w) { set_op(w, 3, kHere, 5); },  // a later node
      [](PatternWords& w) { set_op(w, 0, kNew, 4); },
      [](PatternWords& w) { set_op(w, 0, kCount, 0); },
      [](PatternWords& w) { set_op(w, 1, kNew, 0xff); },
      [](PatternWords& w) { set_op(w, 1, kBefore, 8); },  // no such node
      [](PatternWords& w) { w.distances.push_back(1); },  // unused
      [](PatternWords& w) { w.slots.push_back(0); },
      [](PatternWords& w) { w.numbers.push_back(std::byte{0}); },
  };
  for (std::size_t i = 0; i < lies.size(); ++i)
    EXPECT_EQ(code_of(with_words(name, lies[i])), ErrorCode::corrupt) << "lie " << i;
}
TEST(Hostile, LyingPatterns) { expect_patterns_refuse_lies("patterns"); }
TEST(Hostile, LyingPatternsOfOrderStream) { expect_patterns_refuse_lies("patterns_stream"); }

/// Returns the file "patterns" after `lie` has changed its first stream of values, whose codec is
/// `terms`.
Bytes with_values(const std::function<void(Bytes&)>& lie) {
  return shifts_with([&](GroupParts& group) { lie(group.streams[1]); }, "patterns");
}

TEST(Hostile, LyingTerms) {
  // The stream contains the number of values, then for each component: a byte that states its
  // domain and predictor, an exponent, and the number of bytes of a residual.
  const std::vector<std::function<void(Bytes&)>> lies = {
      [](Bytes& b) { b[0] = std::byte{0}; },
      [](Bytes& b) { b[0] = b[0] ^ std::byte{1}; },  // another number of values
      [](Bytes& b) { b[1] = std::byte{7}; },         // no such domain
      [](Bytes& b) { b[1] = std::byte{5}; },         // integers
      [](Bytes& b) { b[1] = std::byte{5 << 3}; },    // no such predictor
      [](Bytes& b) { b[1] = std::byte{3 << 3}; },    // needs a reference
      [](Bytes& b) { b[1] |= std::byte{0x80}; },
      [](Bytes& b) { b[1] |= std::byte{0x40}; },  // a table
      [](Bytes& b) { b[3] = std::byte{9}; },      // too many bytes of a residual
      [](Bytes& b) { b.pop_back(); },
      [](Bytes& b) { b.push_back(std::byte{0}); },
  };
  for (std::size_t i = 0; i < lies.size(); ++i)
    EXPECT_EQ(code_of(with_values(lies[i])), ErrorCode::corrupt) << "lie " << i;
}

// Each file contains a list of millions of equal numbers. The packed list is small, but the
// unpacked list has far more entries than the group needs. The reader must refuse the file without
// using much memory.
TEST(Hostile, PatternsTakeMemoryAsTheyAreStated) {
  for (const auto& lie : std::vector<std::function<void(PatternWords&)>>{
           [](PatternWords& w) { w.distances.assign(1 << 22, 1); },
           [](PatternWords& w) { w.slots.assign(1 << 22, 0); },
           [](PatternWords& w) { w.numbers.assign(1 << 24, std::byte{0}); },
       }) {
    const Bytes bytes = with_words("patterns", lie);
    EXPECT_LT(memory_of([&] { EXPECT_FALSE(decode_in_pieces(bytes)); }), std::size_t{4} << 20);
  }
}

}  // namespace
}  // namespace shm
