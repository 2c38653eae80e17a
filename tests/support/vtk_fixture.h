// Code that the tests of legacy VTK files share: files in a temporary folder, functions that read
// the complete contents of a mesh, and functions that run VTK's own readers and writers.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/failure.h"
#include "base/spool.h"
#include "compression/compress.h"
#include "compression/decompress.h"
#include "mesh/mesh_source.h"
#include "support/memory_mesh.h"
#include "support/temporary_folder.h"
#include "vtk/legacy/vtk.h"

namespace shm::converters {

namespace fs = std::filesystem;

class VtkTest : public FolderTest {
 protected:
  std::unique_ptr<MeshSource> open_text(const std::string& bytes) {
    return open_vtk(write_file("in.vtk", bytes), spool_);
  }

  Spool spool_{fs::temp_directory_path().string(), std::size_t{1} << 20};
};

// Complete contents of a MeshSource.
struct Snapshot {
  MeshInfo info;
  std::vector<std::byte> points;
  std::vector<std::uint32_t> blocks;
  std::vector<std::uint64_t> corner_begin, corners;
  std::vector<std::vector<std::byte>> arrays;
};

inline Snapshot take(MeshSource& mesh) {
  Snapshot all{mesh.info(), {}, {}, {}, {}, {}};
  all.points.resize(all.info.vertices * 3 * scalar_bytes(all.info.schema.coordinate_type));
  mesh.read_points(0, all.info.vertices, all.points.data());
  mesh.rewind_cells();
  CellBatch batch;
  while (mesh.next_cells(batch, 7)) {
    for (std::size_t i = 0; i < batch.size(); ++i) {
      all.blocks.push_back(batch.blocks[i]);
      all.corner_begin.push_back(all.corners.size());
      const auto cell = batch.cell(i);
      all.corners.insert(all.corners.end(), cell.begin(), cell.end());
    }
  }
  for (std::size_t a = 0; a < all.info.schema.arrays.size(); ++a) {
    const std::uint64_t count = all.info.array_elements(a);
    auto& values = all.arrays.emplace_back(count * all.info.array_stride(a));
    const std::uint64_t half = count / 2;
    mesh.read_array(a, 0, half, count - half, values.data() + half * all.info.array_stride(a));
    mesh.read_array(a, 0, 0, half, values.data());
  }
  return all;
}

inline void expect_same(const Snapshot& a, const Snapshot& b) {
  EXPECT_EQ(a.info.schema, b.info.schema);
  EXPECT_EQ(a.info.vertices, b.info.vertices);
  EXPECT_EQ(a.info.block_cells, b.info.block_cells);
  EXPECT_EQ(a.info.step_times, b.info.step_times);
  EXPECT_EQ(a.info.extras, b.info.extras);
  EXPECT_TRUE(a.points == b.points);
  EXPECT_TRUE(a.blocks == b.blocks);
  EXPECT_TRUE(a.corner_begin == b.corner_begin);
  EXPECT_TRUE(a.corners == b.corners);
  EXPECT_TRUE(a.arrays == b.arrays);
}

inline std::string text_of(const Extra* extra) {
  if (extra == nullptr) return "(absent)";
  return {reinterpret_cast<const char*>(extra->data.data()), extra->data.size()};
}

template <class T>
inline std::vector<T> as(const std::vector<std::byte>& bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
  return values;
}

// Runs vtk_oracle.py, which uses VTK's own readers and writers. Returns false if Python does not
// have VTK.
inline bool run_oracle(const std::string& arguments, int* status) {
  static const bool available =
      std::system("/usr/bin/python3 -c 'import vtk, numpy' >/dev/null 2>&1") == 0;
  if (!available) return false;
  const std::string script = std::string(SHM_SOURCE_DIR) + "/tests/support/vtk_oracle.py";
  const int result = std::system(("/usr/bin/python3 '" + script + "' " + arguments).c_str());
  *status = WIFEXITED(result) ? WEXITSTATUS(result) : -1;
  return true;
}

inline ErrorCode code_of(const std::function<void()>& body) {
  try {
    body();
  } catch (const Failure& failure) {
    EXPECT_FALSE(failure.error().detail.empty());
    return failure.error().code;
  }
  ADD_FAILURE() << "nothing was thrown";
  return ErrorCode::misuse;
}

template <class T>
inline std::string big_endian(const std::vector<T>& values) {
  std::string bytes;
  for (const T value : values) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof raw);
    std::reverse(raw, raw + sizeof raw);  // the hosts of these tests are little-endian
    bytes.append(raw, sizeof raw);
  }
  return bytes;
}

// Reads a file to its end. Reading must return a complete mesh or throw Failure.
inline void try_to_read(const std::string& file, Spool& spool) {
  try {
    take(*open_vtk(file, spool));
  } catch (const Failure&) {
  }
}

// Compresses a mesh to a .shm file, and returns the mesh that is read from this file.
inline std::unique_ptr<MeshSource> through_shm(MeshSource& mesh, Order order, Spool& spool) {
  MemorySink sink;
  CompressOptions options;
  options.order = order;
  compress_mesh(mesh, sink, options, spool);
  MemorySource file(sink.bytes);
  return std::make_unique<StagedMesh>(file, "test.shm", spool);
}

// A MeshSource that replaces the value of one extra of another mesh with `text`.
class BentExtra : public MeshSource {
 public:
  BentExtra(MeshSource& mesh, const std::string& key, const std::string& text)
      : mesh_(mesh), info_(mesh.info()) {
    for (Extra& extra : info_.extras) {
      if (extra.key != key) continue;
      const auto bytes = std::as_bytes(std::span(text));
      extra.data.assign(bytes.begin(), bytes.end());
    }
  }
  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override {
    mesh_.read_points(first, count, out);
  }
  bool next_cells(CellBatch& out, std::size_t most) override { return mesh_.next_cells(out, most); }
  void rewind_cells() override { mesh_.rewind_cells(); }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override {
    mesh_.read_array(array, step, first, count, out);
  }

 private:
  MeshSource& mesh_;
  MeshInfo info_;
};

}  // namespace shm::converters
