// Tests memory limits. No reader may allocate much memory for a small file, whatever counts the
// file contains. A valid file must not be refused because of a limit.
#include <string>

#include "hostile/asking_files.h"
#include "hostile/hostile.h"
#include "hostile/watched_memory.h"
#include "shm/appender.h"
#include "shm/damage.h"
#include "shm/mesh.h"
#include "shm/mesh_extract.h"
#include "shm/segment_reader.h"
#include "shm/step_reader.h"
#include "support/coded_meshes.h"
#include "support/sanitized.h"

namespace shm {
namespace {

constexpr std::size_t kMostFile = 200000;
constexpr std::size_t kMostMemory = std::size_t{300} << 20;

/// Reads all items that a Reader returns before an error or the end of the file.
void read_all(std::span<const std::byte> bytes) {
  MemorySource source(bytes);
  auto reader = Reader::open(source);
  std::vector<Extra> extras;
  while (reader) {
    auto item = reader->next();
    if (!item || *item == nullptr) break;
    if (auto* extra = std::get_if<Extra>(*item)) extras.push_back(std::move(*extra));
  }
}

const std::vector<AskingFile>& asking() {
  static const std::vector<AskingFile> all = asking_files();
  return all;
}

TEST(Budget, SmallFilesTakeLittleMemory) {
  using Random = MemoryRandomSource;
  const std::vector<std::pair<const char*, void (*)(Random&)>> ways = {
      {"summary", [](Random& source) { (void)read_summary(source); }},
      {"damage", [](Random& source) { (void)find_damage(source); }},
      {"extras",
       [](Random& source) {
         if (auto opened = MeshExtractor::open(source)) (void)opened->extras();
       }},
      {"steps", [](Random& source) { (void)StepReader::open(source); }}};
  SomeCases some(7);
  for (const AskingFile& file : asking()) {
    if (some.skips_next()) continue;
    SCOPED_TRACE(file.name);
    ASSERT_LT(file.bytes.size(), kMostFile);
    EXPECT_LE(memory_of([&] { read_all(file.bytes); }), kMostMemory);
    // These files are tested only with the Reader, because read_mesh() and the other readers below
    // decode them in the same way.
    if (file.name.starts_with("components")) continue;
    EXPECT_LE(memory_of([&] {
                MemorySource source(file.bytes);
                (void)read_mesh(source);
              }),
              kMostMemory);
    for (const auto& [name, read] : ways)
      EXPECT_LE(memory_of([&, read = read] {
                  Random source(file.bytes);
                  read(source);
                }),
                kMostMemory)
          << name;
  }
}

/// Reads the asking file with this name (see asking_files.h). Returns the error message, or an
/// empty string if no error occurs.
std::string complaint(const std::string& name, const ReadLimits& limits = {}) {
  for (const AskingFile& file : asking())
    if (file.name == name) {
      const auto decoded = decode_in_pieces(file.bytes, 0, limits);
      return decoded ? std::string() : decoded.error().message();
    }
  return "there is none";
}

TEST(Budget, WhatIsRefusedIsNamed) {
  const auto says = [](const std::string& name, const std::string& words) {
    EXPECT_NE(complaint(name).find(words), std::string::npos) << name << ": " << complaint(name);
  };
  says("extras of version 1", "unpacks to more bytes than its packed size permits");
  says("source format", "unpacks to more bytes than its packed size permits");
  says("extras of version 0", "the limit is ");
  says("step times", "step times");
  says("empty extras", "takes more than the limit of ");
}

// A caller chooses the limit on unpacked data. Even with a limit of 0, a reader may use memory in
// proportion to the size of the file.
TEST(Budget, IsTheCallers) {
  const auto of = [](std::size_t count, std::uint64_t most) {
    ByteWriter head;
    head.put_text("k");
    for (const std::uint8_t byte : std::initializer_list<std::uint8_t>{2, 0, 1}) head.put_u8(byte);
    head.put_varint(1 << 20);
    const auto payload = packed_zeros(head.bytes, 1 << 20);
    ReadLimits limits;
    limits.max_unpacked_bytes = most;
    const auto bytes = asking_mesh({count, {container::ChunkKind::extra, payload}}, 0);
    const auto read = decode_in_pieces(bytes, 0, limits);
    MemoryRandomSource source(bytes);
    EXPECT_EQ(static_cast<bool>(read_summary(source, limits)), static_cast<bool>(read));
    if (!read) {
      EXPECT_EQ(read.error().code, ErrorCode::over_limit);
    }
    return static_cast<bool>(read);
  };
  constexpr std::uint64_t kMega = std::uint64_t{1} << 20;
  EXPECT_TRUE(of(60, 64 * kMega));
  EXPECT_FALSE(of(70, 64 * kMega));
  EXPECT_TRUE(of(70, 80 * kMega));
  EXPECT_FALSE(of(1, kMega / 2));
}

// Each extra contains ascending numbers, like the set of all cells of a large mesh. Such an extra
// needs few bytes in the file but much memory.
TEST(Budget, HasRoomForWhatAWriterWrites) {
  constexpr std::uint64_t kValues = 3000000, kExtras = 5;
  Extra extra;
  extra.key = "test/all";
  extra.type = ScalarType::int64;
  extra.shape = {kValues};
  for (std::uint64_t i = 0; i < kValues; ++i) append(extra.data, i);
  MemorySink sink;
  WriteOptions options = without_digests();
  ASSERT_TRUE(write_mesh(grid(2, 2, 2), sink, options, [&](Writer& writer) -> Result<void> {
    for (std::uint64_t i = 0; i < kExtras; ++i)
      if (auto status = writer.add_extra(extra); !status) return status;
    return {};
  }));
  EXPECT_LT(sink.bytes.size(), kExtras * extra.data.size() / 128);
  MemorySource source(sink.bytes);
  const auto mesh = read_mesh(source);
  ASSERT_TRUE(mesh) << mesh.error().message();
  ASSERT_EQ(mesh->extras.size(), kExtras);
  for (const Extra& back : mesh->extras) EXPECT_EQ(back, extra);
  MemoryRandomSource random(sink.bytes);
  const auto summary = read_summary(random);
  ASSERT_TRUE(summary) << summary.error().message();
  EXPECT_EQ(summary->extras.size(), kExtras);
}

// The blobs contain only zeros, so zstd achieves a very high compression ratio. If the ratio would
// exceed the ratio that readers accept, the writer packs the blob in another way.
TEST(Budget, BlobsOfZerosStayWithinTheirBound) {
  for (const Packing packing : {Packing::plain, Packing::with_dictionary, Packing::bounded})
    for (const std::size_t size : {std::size_t{100}, std::size_t{1} << 20, std::size_t{40} << 20}) {
      ByteWriter out;
      put_packed(out, Bytes(size), packing);
      EXPECT_LE(size, most_unpacked(out.bytes.size())) << size;
      if (packing == Packing::bounded) {
        EXPECT_LE(size, kMostUnpackedEach * out.bytes.size());
      }
      ByteReader in(out.bytes);
      EXPECT_EQ(get_packed(in, size), std::optional(Bytes(size)));
    }
}

/// Decodes the file with max_column_bytes (the memory limit for the array values of active
/// elements) set to `most`. `most` is so small that columns (the decoders of arrays) must use their
/// memory-saving form. Returns the decoded contents as text.
std::string sparingly(std::span<const std::byte> bytes, std::uint64_t most) {
  ReadLimits limits;
  limits.max_column_bytes = most;
  return text_of(decode_in_pieces(bytes, 0, limits));
}

TEST(Budget, SparingColumnsGiveTheSame) {
  for (const FeatureFile& file : files()) {
    SCOPED_TRACE(file.name);
    if (file.name == "archive") continue;
    const std::string usual = text_of(decode_in_pieces(file.bytes));
    // Even if max_column_bytes is 0, columns may use memory in proportion to the size of the file.
    // In their memory-saving form, they need no more than that.
    EXPECT_TRUE(sparingly(file.bytes, 0) == usual);
    EXPECT_TRUE(sparingly(file.bytes, 4000) == usual);
  }
}

/// The mesh consists of three layers of cells. The test has three cases: all values of each array
/// are equal, every 20000th value differs from the others, or every seventh value does.
TEST(Budget, ColumnsThatAreAlikeTakeNothingBySlot) {
  constexpr std::uint32_t kSide = 70, kComponents = 8;
  for (const Location location : {Location::point, Location::cell})
    for (const std::size_t every : {std::size_t{0}, std::size_t{20000}, std::size_t{7}}) {
      SCOPED_TRACE(every);
      TestMesh mesh = grid(kSide, kSide, 3);
      for (const ScalarType type : {ScalarType::uint8, ScalarType::float64}) {
        const ArrayInfo info = array_of("of type " + std::to_string(static_cast<int>(type)),
                                        location, type, kComponents);
        std::vector<std::byte> values;
        const std::size_t count = location == Location::point ? mesh.vertices : mesh.cells.size();
        for (std::size_t i = 0; i < count * kComponents; ++i)
          append_scalar(values, type,
                        every > 0 && i % every == 1 ? static_cast<std::int64_t>(i % 100) : 5);
        mesh.schema.arrays.push_back(info);
        mesh.arrays.push_back(std::move(values));
      }
      MemorySink sink;
      WriteOptions options;
      options.connectivity = ConnectivityCodec::rows;
      ASSERT_TRUE(write_mesh(mesh, sink, options));
      const std::string usual = text_of(decode_in_pieces(sink.bytes));
      ASSERT_NE(usual.find("array"), std::string::npos);
      // The small limit is a third of the maximum memory of all columns. It suffices for the
      // coordinates and some columns; columns of equal values need no memory. The large limit
      // suffices for all columns, whatever their values are.
      const std::string sparing = sparingly(sink.bytes, every == 7 ? 1 << 24 : 1200000);
      EXPECT_TRUE(sparing == usual) << sparing.substr(0, 300);
    }
}

// A column whose values differ from each other needs more memory than a column of equal values. The
// limit on the memory of all columns depends on the size of the file. A file whose columns need
// more memory is refused.
TEST(Budget, ColumnsTakeNoMoreThanIsAllowed) {
  const auto bytes = asking_columns(66, Location::point, 256);
  ReadLimits limits;
  const auto alike = decode_in_pieces(bytes, 0, limits);
  EXPECT_TRUE(alike) << alike.error().message();
  TestMesh mesh = grid(60, 60, 3);
  constexpr std::size_t kComponents = 128;
  mesh.schema.arrays.push_back(array_of("a", Location::point, ScalarType::uint8, kComponents));
  std::vector<std::byte> values;
  for (std::size_t i = 0; i < mesh.vertices * kComponents; ++i)
    values.push_back(static_cast<std::byte>(i / kComponents % 2));
  mesh.arrays.push_back(std::move(values));
  MemorySink sink;
  WriteOptions options;
  options.connectivity = ConnectivityCodec::rows;
  ASSERT_TRUE(write_mesh(mesh, sink, options));
  ASSERT_LT(512 * sink.bytes.size(), 61 * 61 * kComponents * 19);
  EXPECT_TRUE(decode_in_pieces(sink.bytes, 0, limits));
  limits.max_column_bytes = 0;
  const auto refused = decode_in_pieces(sink.bytes, 0, limits);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::over_limit) << refused.error().message();
}

// Even a small file may have many active vertices, whichever codec it uses. If a reader knows the
// file size, it computes the memory limit for active vertices from the size of the whole file.
TEST(Limits, OfActiveVertices) {
  for (const ConnectivityCodec codec : codecs_for(grid(1, 1, 1).schema)) {
    SCOPED_TRACE(std::string(codec_name(codec)));
    const Bytes bytes = asking_sheet(120, codec);
    ReadLimits limits;
    limits.max_active_bytes = 0;
    const auto refused = decode_in_pieces(bytes, 0, limits);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::over_limit) << refused.error().message();
    EXPECT_NE(refused.error().detail.find("active vertices, the limit is "), std::string::npos);
    limits.max_active_bytes = 15000 * 288;
    const auto all = decode_in_pieces(bytes, 0, limits);
    EXPECT_TRUE(all) << all.error().message();
  }
}

// The memory limit for array values also applies to step values, whether the file is read front to
// back or using the index.
TEST(Limits, OfWhatColumnsOfStepsKeep) {
  const Bytes bytes = asking_sheet(60, ConnectivityCodec::rows, 16);
  for (const bool fits : {false, true}) {
    ReadLimits limits;
    if (!fits) limits.max_column_bytes = std::uint64_t{300} << 10;  // enough for the coordinates
    const auto all = decode_in_pieces(bytes, 0, limits);
    MemoryRandomSource source(bytes);
    auto opened = StepReader::open(source, limits);
    ASSERT_TRUE(opened);
    const auto values = opened->read({.array = 0, .step = 0});
    ASSERT_EQ(static_cast<bool>(all), fits) << bytes.size();
    ASSERT_EQ(static_cast<bool>(values), fits) << bytes.size();
    if (fits) continue;
    EXPECT_EQ(all.error().code, ErrorCode::over_limit) << all.error().message();
    EXPECT_EQ(values.error().code, ErrorCode::over_limit) << values.error().message();
  }
}

TEST(Limits, OfWhatComesOut) {
  MemorySink sink;
  ASSERT_TRUE(write_mesh(grid(5, 5, 5), sink));
  const auto code_with = [&](auto&& change) {
    ReadLimits limits;
    change(limits);
    const auto decoded = decode_in_pieces(sink.bytes, 0, limits);
    return decoded ? std::optional<ErrorCode>() : decoded.error().code;
  };
  const auto code_by_index = [&](auto&& change) {
    ReadLimits limits;
    change(limits);
    MemoryRandomSource source(sink.bytes);
    const auto opened = MeshExtractor::open(source, limits);
    return opened ? std::optional<ErrorCode>() : opened.error().code;
  };
  for (const std::uint64_t more : {0, 1}) {
    const auto expected = more > 0 ? std::optional<ErrorCode>() : ErrorCode::over_limit;
    const auto cells = [&](ReadLimits& limits) { limits.max_cells = 124 + more; };
    const auto vertices = [&](ReadLimits& limits) { limits.max_vertices = 215 + more; };
    const auto bytes = [&](ReadLimits& limits) {
      limits.max_decoded_bytes = 216 * 12 + 125 * 64 - 1 + more;
    };
    EXPECT_EQ(code_with(cells), expected);
    EXPECT_EQ(code_with(vertices), expected);
    EXPECT_EQ(code_with(bytes), expected);
    EXPECT_EQ(code_by_index(cells), expected);
    EXPECT_EQ(code_by_index(vertices), expected);
    ReadLimits limits;
    cells(limits);
    MemoryRandomSource source(sink.bytes);
    EXPECT_TRUE(read_summary(source, limits));  // which decodes nothing
  }
}

}  // namespace
}  // namespace shm
