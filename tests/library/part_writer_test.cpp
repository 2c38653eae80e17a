// Tests of PartWriter and PartJoiner. If parts of a mesh are encoded separately and joined, the
// result must equal the file that one Writer writes.
#include "shm/part_writer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <vector>

#include "support/coded_meshes.h"

namespace shm {
namespace {

constexpr std::uint64_t kUnused = ~std::uint64_t{0};

/// For each vertex: the first and the last cell that uses it.
struct Uses {
  explicit Uses(const TestMesh& mesh) : first(mesh.vertices, kUnused), last(mesh.vertices) {
    for (std::uint64_t c = 0; c < mesh.cells.size(); ++c)
      for (const std::uint64_t v : mesh.cells[c].corners) {
        first[v] = std::min(first[v], c);
        last[v] = c;
      }
  }
  std::vector<std::uint64_t> first, last;
};

/// Returns the mesh without unused vertices (those that no cell uses). The tests use no such
/// vertices, because write_mesh writes them between cells. Precondition: the mesh has no static
/// point arrays.
TestMesh used_only(TestMesh mesh) {
  const Uses uses(mesh);
  std::vector<std::uint64_t> fresh(mesh.vertices);
  const std::size_t bytes = 3 * scalar_bytes(mesh.schema.coordinate_type);
  std::uint64_t used = 0;
  for (std::uint64_t v = 0; v < mesh.vertices; ++v) {
    if (uses.first[v] == kUnused) continue;
    std::copy_n(mesh.xyz.begin() + static_cast<std::ptrdiff_t>(v * bytes), bytes,
                mesh.xyz.begin() + static_cast<std::ptrdiff_t>(used * bytes));
    fresh[v] = used++;
  }
  mesh.vertices = used;
  mesh.xyz.resize(used * bytes);
  for (TestCell& cell : mesh.cells)
    for (std::uint64_t& corner : cell.corners) corner = fresh[corner];
  return mesh;
}

/// The data that is needed to write one part. Outside of tests, each part is written by a separate
/// process, which does not know the data of the other parts.
struct Part {
  std::uint64_t first = 0, end = 0;  ///< range of cells
  RecordedOrder order;
  std::vector<std::uint64_t> imported;
  std::optional<PartWriter> writer;
  std::uint64_t own_vertices = 0;
};

void feed(const TestMesh& mesh, const Uses& uses, Part& part) {
  std::vector<char> given(mesh.vertices);
  const std::size_t xyz_bytes = 3 * scalar_bytes(mesh.schema.coordinate_type);
  const auto value = [&](std::size_t a, std::uint64_t at) {
    return std::span(mesh.arrays[a]).subspan(at * mesh.stride(a), mesh.stride(a));
  };
  for (std::uint64_t c = part.first; c < part.end; ++c) {
    const TestCell& cell = mesh.cells[c];
    std::uint64_t last_use = 0;
    for (std::size_t i = 0; i < cell.corners.size(); ++i) {
      const std::uint64_t v = cell.corners[i];
      if (uses.last[v] == c) last_use |= std::uint64_t{1} << i;
      if (std::exchange(given[v], 1) != 0) continue;
      Bytes data;
      for (std::size_t a = 0; a < mesh.schema.arrays.size(); ++a)
        if (mesh.schema.arrays[a].location == Location::point && !mesh.schema.arrays[a].per_step)
          data.insert(data.end(), value(a, v).begin(), value(a, v).end());
      const auto xyz = std::span(mesh.xyz).subspan(v * xyz_bytes, xyz_bytes);
      if (uses.first[v] < part.first) {
        part.imported.push_back(v);
        ASSERT_TRUE(part.writer->add_imported_vertex(v, xyz, data));
      } else {
        ASSERT_TRUE(part.writer->add_vertex(v, xyz, data));
      }
    }
    Bytes data;
    for (std::uint32_t a = 0; a < mesh.schema.arrays.size(); ++a) {
      if (mesh.schema.arrays[a].location != Location::cell || mesh.schema.arrays[a].per_step ||
          !mesh.schema.array_covers(a, cell.block))
        continue;
      std::uint64_t element = 0;
      for (std::uint64_t before = 0; before < c; ++before)
        element += mesh.schema.array_covers(a, mesh.cells[before].block) ? 1 : 0;
      data.insert(data.end(), value(a, element).begin(), value(a, element).end());
    }
    ASSERT_TRUE(part.writer->add_cell(cell.block, cell.corners, last_use, data));
  }
  ASSERT_TRUE(part.writer->end_mesh());
}

/// Assembles a file from the chunks of all parts. For each part, place() corrects the chunk
/// numbers, which depend on the preceding parts.
class Joined {
 public:
  Joined(const Schema& schema, const WriteOptions& options)
      : joiner_(PartJoiner::create(sink_, schema, options).value()) {
    keep();
  }
  void append(std::vector<PartChunks> chunks) {
    const std::uint64_t begin = joiner_.offset();
    std::uint32_t number = joiner_.chunks();
    for (PartChunks& part : chunks) {
      ASSERT_TRUE(place(part, number));
      number += part.count;
      file_.insert(file_.end(), part.bytes.begin(), part.bytes.end());
      ASSERT_TRUE(joiner_.add(part.index, part.bytes.size()));
    }
    EXPECT_EQ(number, joiner_.chunks());
    EXPECT_EQ(joiner_.offset() - begin, file_.size() - begin);
  }
  Bytes finish(const std::vector<double>& times) {
    if (!times.empty()) {
      EXPECT_TRUE(joiner_.set_step_times(times));
    }
    EXPECT_TRUE(joiner_.finish());
    keep();
    return file_;
  }

 private:
  void keep() {
    file_.insert(file_.end(), sink_.bytes.begin(), sink_.bytes.end());
    sink_.bytes.clear();
  }
  MemorySink sink_;
  PartJoiner joiner_;
  Bytes file_;
};

/// Writes a mesh in parts of `segments` segments each and returns the resulting file. The number of
/// cells per segment is options.segment_cells. `values` are in coding order.
Bytes written_in_parts(const TestMesh& mesh, WriteOptions options, std::uint64_t segments,
                       const Values& values = {}, const std::vector<double>& times = {}) {
  const Uses uses(mesh);
  const std::uint64_t share = options.segment_cells * segments;
  std::vector<Part> parts((mesh.cells.size() + share - 1) / share);
  std::uint64_t own = 0;
  std::map<std::uint64_t, std::uint64_t> fresh;  // numbers in the file
  for (std::size_t p = 0; p < parts.size(); ++p) {
    Part& part = parts[p];
    part.first = p * share;
    part.end = std::min<std::uint64_t>(part.first + share, mesh.cells.size());
    options.coding_order = &part.order;
    part.writer = PartWriter::create(mesh.schema, options,
                                     {static_cast<std::uint32_t>(p * segments), part.first, own})
                      .value();
    feed(mesh, uses, part);
    for (std::size_t i = 0; i < part.order.vertices.size(); ++i)
      fresh[part.order.vertices[i]] = own + i;
    own += part.own_vertices = part.order.vertices.size();
  }
  Joined file(mesh.schema, options);
  std::vector<PartChunks> chunks;
  for (Part& part : parts) {
    std::vector<std::uint64_t> numbers;
    for (const std::uint64_t v : part.imported) numbers.push_back(fresh.at(v));
    if (mesh.schema.order != Order::keep) {
      EXPECT_TRUE(part.writer->set_imported_numbers(numbers));
    }
    chunks.push_back(part.writer->mesh_chunks().value());
  }
  file.append(chunks);
  if (values.empty()) return file.finish(times);

  PartSteps steps;
  steps.first_elements.resize(mesh.schema.arrays.size());
  for (std::uint32_t a = 0; a < mesh.schema.arrays.size(); ++a)
    steps.elements.push_back(elements_of(mesh, a));
  // begins[p][a] is the first element of part p in array a. The last row contains the element
  // counts.
  std::vector<std::vector<std::uint64_t>> begins;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    EXPECT_TRUE(parts[p].writer->begin_steps(steps));
    begins.push_back(steps.first_elements);
    steps.first_group += chunks[p].count;
    for (std::uint32_t a = 0; a < mesh.schema.arrays.size(); ++a) {
      if (mesh.schema.arrays[a].location == Location::point)
        steps.first_elements[a] += parts[p].own_vertices;
      else
        for (std::uint64_t c = parts[p].first; c < parts[p].end; ++c)
          steps.first_elements[a] += mesh.schema.array_covers(a, mesh.cells[c].block) ? 1 : 0;
    }
  }
  begins.push_back(steps.first_elements);
  for (const auto& [of, all] : values) {
    const auto& [array, step] = of;
    std::optional<StepBasis> basis;
    std::vector<PartChunks> coded;
    for (std::size_t p = 0; p < parts.size(); ++p) {
      PartWriter& writer = *parts[p].writer;
      const bool chooses = writer.chooses(array);
      EXPECT_TRUE(writer.begin_step(array, step, chooses ? std::nullopt : basis));
      const std::size_t stride = mesh.stride(array);
      EXPECT_TRUE(writer.add_step_values(std::span(all).subspan(
          begins[p][array] * stride, (begins[p + 1][array] - begins[p][array]) * stride)));
      if (chooses) basis = writer.step_basis();
      coded.push_back(writer.end_step().value());
    }
    file.append(std::move(coded));
  }
  std::vector<PartChunks> rest;
  for (auto& part : parts) rest.push_back(part.writer->end_steps().value());
  file.append(std::move(rest));
  return file.finish(times);
}

TEST(PartWriter, PartsMakeTheFileOfOneWriter) {
  const std::vector<TestMesh> meshes = {
      bent_grid(5, 4, 4),       shuffled(bent_grid(4, 4, 4)),
      used_only(mixed_cells()), with_arrays_of_every_type(bent_grid(3, 3, 3)),
      arrays_on_some_blocks(),  quantized()};
  for (const TestMesh& family : meshes)
    for (const auto& [order, delay] : {std::pair(Order::keep, 0u), std::pair(Order::keep, 6u),
                                       std::pair(Order::stream, 0u), std::pair(Order::stream, 5u)})
      for (const std::uint64_t cells : {3u, 10u})
        for (const std::uint64_t segments : {1u, 2u}) {
          SCOPED_TRACE(testing::Message() << "mesh " << &family - meshes.data() << ", order "
                                          << static_cast<int>(order) << ", delay " << delay << ", "
                                          << segments << " segments of " << cells);
          const TestMesh mesh = with_order(family, order, true, delay);
          WriteOptions options;
          options.segment_cells = cells;
          options.group_cells = 4;
          MemorySink alone;
          ASSERT_TRUE(write_mesh(mesh, alone, options));
          EXPECT_TRUE(written_in_parts(mesh, options, segments) == alone.bytes);
        }
}

/// Writes a mesh with two blocks and with steps, once in parts and once with a single Writer.
/// Checks that the two files are equal.
void expect_steps_in_parts(Order order, WriteOptions options) {
  Stepped stepped = with_steps(used_only(two_blocks()), order);
  options.segment_cells = 7;
  options.group_cells = 5;
  MemorySink alone;
  const auto steps = [&](Writer& writer) -> Result<void> {
    for (const auto& [of, values] : stepped.values)
      if (auto status = writer.add_step_values(of.first, of.second, values); !status) return status;
    return {};
  };
  ASSERT_TRUE(write_mesh(stepped.mesh, alone, options, steps));
  for (const std::uint64_t segments : {1u, 3u})
    EXPECT_TRUE(written_in_parts(stepped.mesh, options, segments, stepped.values) == alone.bytes);
}

TEST(PartWriter, StepsToo) {
  for (const Order order : {Order::keep, Order::stream}) expect_steps_in_parts(order, {});
}

TEST(PartWriter, CellsInCodecsWithoutDelay) {
  const std::vector<TestMesh> meshes = {bent_grid(5, 4, 4), used_only(two_blocks()), quantized(),
                                        arrays_on_some_blocks()};
  for (const TestMesh& family : meshes)
    for (const Order order : {Order::keep, Order::stream})
      for (const std::uint64_t cells : {3u, 10u})
        for (const std::uint64_t segments : {1u, 2u}) {
          SCOPED_TRACE(testing::Message()
                       << "mesh " << &family - meshes.data() << ", order "
                       << static_cast<int>(order) << ", " << segments << " segments of " << cells);
          const TestMesh mesh = with_order(family, order, true, 0);
          WriteOptions options;
          options.segment_cells = cells;
          options.group_cells = 4;
          for (const auto codec : codecs_without_delay()) {
            options.connectivity = codec;
            MemorySink alone;
            ASSERT_TRUE(write_mesh(mesh, alone, options));
            EXPECT_TRUE(written_in_parts(mesh, options, segments) == alone.bytes);
          }
        }
}

TEST(PartWriter, StepsOverThoseToo) {
  for (const Order order : {Order::keep, Order::stream})
    for (const auto codec : codecs_without_delay())
      for (const std::uint32_t key_steps : {1u, 2u, 8u}) {
        SCOPED_TRACE(key_steps);
        expect_steps_in_parts(order, {.connectivity = codec, .key_steps = key_steps});
      }
}

TEST(PartWriter, RefusesWhatCannotFit) {
  const TestMesh mesh = bent_grid(2, 2, 2);
  const auto refused = [&](const WriteOptions& options, const PartStart& start) {
    const auto writer = PartWriter::create(mesh.schema, options, start);
    return !writer && writer.error().code == ErrorCode::misuse;
  };
  WriteOptions options;
  // By default, restart_budget determines the cells at which segments begin, so these cells are not
  // known in advance. The mesh can then not be divided into parts, because each part must begin
  // with a segment.
  EXPECT_TRUE(refused(options, {}));
  options.segment_cells = 4;
  EXPECT_TRUE(refused(options, {1, 5, 0}));
  EXPECT_TRUE(refused(options, {2, 4, 0}));
  EXPECT_FALSE(refused(options, {1, 4, 0}));
  options.segment_starts = {3, 6};
  EXPECT_TRUE(refused(options, {1, 4, 0}));
  EXPECT_FALSE(refused(options, {2, 6, 0}));

  options.segment_starts.clear();
  auto writer = PartWriter::create(mesh.schema, options, {}).value();
  // mesh_chunks() fails, because it is called too early. Later calls return the same error.
  EXPECT_FALSE(writer.mesh_chunks());
  EXPECT_FALSE(writer.end_mesh());
  auto first = PartWriter::create(mesh.schema, options, {}).value();
  EXPECT_FALSE(first.add_imported_vertex(0, std::span(mesh.xyz).first(12)));
}

TEST(PartJoiner, RefusesWhatIsNoPart) {
  const TestMesh mesh = with_order(bent_grid(2, 2, 2), Order::keep, true, 0);
  WriteOptions options;
  options.segment_cells = 8;
  const Uses uses(mesh);
  Part part;
  part.end = mesh.cells.size();
  part.writer = PartWriter::create(mesh.schema, options, {}).value();
  feed(mesh, uses, part);
  PartChunks chunks = part.writer->mesh_chunks().value();
  MemorySink sink;
  const auto refuses = [&](const Bytes& index, std::uint64_t bytes) {
    auto joiner = PartJoiner::create(sink, mesh.schema, options).value();
    const auto status = joiner.add(index, bytes);
    return !status && status.error().code == ErrorCode::corrupt && !joiner.finish();
  };
  EXPECT_FALSE(refuses(chunks.index, chunks.bytes.size()));
  EXPECT_TRUE(refuses(chunks.index, chunks.bytes.size() + 1));
  EXPECT_TRUE(refuses(chunks.index, chunks.bytes.size() - 1));
  for (std::size_t cut = 0; cut < chunks.index.size(); ++cut)
    EXPECT_TRUE(refuses(
        Bytes(chunks.index.begin(), chunks.index.begin() + static_cast<std::ptrdiff_t>(cut)),
        chunks.bytes.size()));
  // The chunks of this part belong to another mesh. Its schema has the same blocks as the joiner's
  // schema, but one array fewer.
  Schema other = mesh.schema;
  other.arrays.push_back(ArrayInfo{});
  other.arrays.back().name = "one more";
  auto joiner = PartJoiner::create(sink, other, options).value();
  const auto status = joiner.add(chunks.index, chunks.bytes.size());
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().message().find("another schema"), std::string::npos);
  // The parts of a file have digests if the file has them.
  WriteOptions plain = options;
  plain.digest = false;
  auto without = PartJoiner::create(sink, mesh.schema, plain).value();
  const auto mixed = without.add(chunks.index, chunks.bytes.size());
  ASSERT_FALSE(mixed);
  EXPECT_NE(mixed.error().message().find("must have digests, or none"), std::string::npos);
  chunks.bytes.pop_back();
  EXPECT_FALSE(place(chunks, 1));
}

}  // namespace
}  // namespace shm
