// Checks the worked example of spec/examples.md, byte for byte. The Writer writes the file of the
// example, and the test compares the file with the hex dump in the text. A change to the Writer
// therefore requires the same change to the text.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "shm/reader.h"
#include "shm/writer.h"

namespace shm {
namespace {

/// Writes the file of the example. It contains the unit cube as a single hexahedron, a static cell
/// array, a stepped cell array, the time of one step, and one extra (a typed value with a key).
Result<std::vector<std::byte>> example_file() {
  Schema schema;
  schema.coordinate_type = ScalarType::float32;
  schema.source_format = "demo";
  schema.blocks.push_back({1, "cube", CellShape::hexahedron, 8});
  ArrayInfo material;
  material.name = "m";
  material.location = Location::cell;
  material.type = ScalarType::int32;
  ArrayInfo heat;
  heat.name = "t";
  heat.location = Location::cell;
  heat.type = ScalarType::float32;
  heat.per_step = true;
  schema.arrays = {material, heat};

  MemorySink sink;
  WriteOptions options;
  options.connectivity = ConnectivityCodec::rows;
  options.waiting_bytes = 0;  // no bundles
  auto writer = Writer::create(sink, schema, options);
  if (!writer) return writer.error();
  const std::array<std::uint64_t, 8> corners{0, 1, 2, 3, 4, 5, 6, 7};
  constexpr float kXyz[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  // finish() returns the first error.
  for (const std::uint64_t vertex : corners)
    (void)writer->add_vertex(vertex, std::as_bytes(std::span(kXyz[vertex])));
  const std::array<std::int32_t, 1> seven{7};
  (void)writer->add_cell(0, corners, 0xff, std::as_bytes(std::span(seven)));
  (void)writer->end_mesh();
  const std::array<float, 1> warm{2.5f};
  const std::array<double, 1> times{0.5};
  (void)writer->set_step_times(times);
  Extra note;
  note.key = "demo/note";
  note.shape = {2};
  note.data = {std::byte{'h'}, std::byte{'i'}};
  (void)writer->add_extra(note);
  (void)writer->add_step_values(1, 0, std::as_bytes(std::span(warm)));
  if (auto sizes = writer->finish(); !sizes) return sizes.error();
  return std::move(sink.bytes);
}

/// Parses a text such as "89 53 48 4d" into bytes. Returns false if the text does not have this
/// form.
bool parse_hex(const std::string& text, std::vector<std::byte>& out) {
  for (std::size_t at = 0; at < text.size(); at += 3) {
    const std::string pair = text.substr(at, 2);
    if (pair.size() != 2 || pair.find_first_not_of("0123456789abcdef") != std::string::npos)
      return false;
    if (at + 2 < text.size() && text[at + 2] != ' ') return false;
    out.push_back(static_cast<std::byte>(std::stoi(pair, nullptr, 16)));
  }
  return true;
}

/// Returns the bytes that the tables of spec/examples.md list. The table rows have the form "|
/// offset | `hex` | field | ... |".
std::vector<std::byte> stated_bytes() {
  std::ifstream text(SHM_SOURCE_DIR "/spec/examples.md");
  EXPECT_TRUE(text) << "spec/examples.md cannot be read";
  std::vector<std::byte> bytes;
  for (std::string line; std::getline(text, line);) {
    const std::size_t second = line.find(" | `", 2);
    if (line.rfind("| ", 0) != 0 || second == std::string::npos) continue;
    const std::string offset = line.substr(2, second - 2);
    if (offset.empty() || offset.find_first_not_of("0123456789") != std::string::npos) continue;
    EXPECT_EQ(std::stoull(offset), bytes.size()) << "offset of the row: " << line;
    const std::size_t begin = second + 4, end = line.find('`', begin);
    EXPECT_TRUE(end != std::string::npos && parse_hex(line.substr(begin, end - begin), bytes))
        << "hex of the row: " << line;
  }
  return bytes;
}

std::string hex_lines(std::span<const std::byte> bytes) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const auto value = std::to_integer<unsigned>(bytes[i]);
    if (i % 16 == 0) text += "\n" + std::to_string(i) + ":";
    text += {' ', kDigits[value >> 4], kDigits[value & 15]};
  }
  return text;
}

TEST(SpecExample, WriterMakesTheBytesOfTheText) {
  const auto file = example_file();
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(hex_lines(*file), hex_lines(stated_bytes()));
}

TEST(SpecExample, TextReadsBackAsTheMesh) {
  const std::vector<std::byte> bytes = stated_bytes();
  MemorySource source(bytes);
  auto reader = Reader::open(source);
  ASSERT_TRUE(reader) << reader.error().message();
  EXPECT_EQ(reader->schema().source_format, "demo");
  int blocks = 0, pieces = 0, times = 0, extras = 0, totals = 0;
  while (true) {
    const auto item = reader->next();
    ASSERT_TRUE(item) << item.error().message();
    if (*item == nullptr) break;
    if (const auto* block = std::get_if<MeshBlock>(*item)) {
      ++blocks;
      EXPECT_EQ(block->corners, (std::vector<std::uint64_t>{0, 1, 2, 3, 4, 5, 6, 7}));
      EXPECT_EQ(block->last_use, std::vector<std::uint64_t>{0xff});
    }
    pieces += std::holds_alternative<StepPiece>(**item) ? 1 : 0;
    times += std::holds_alternative<StepTimes>(**item) ? 1 : 0;
    extras += std::holds_alternative<Extra>(**item) ? 1 : 0;
    totals += std::holds_alternative<Totals>(**item) ? 1 : 0;
  }
  EXPECT_EQ(blocks, 1);
  EXPECT_EQ(pieces, 1);
  EXPECT_EQ(times, 1);
  EXPECT_EQ(extras, 1);
  EXPECT_EQ(totals, 1);
}

}  // namespace
}  // namespace shm
