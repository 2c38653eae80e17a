// Code that the tests of the C interface share: handles that free the objects they refer to,
// targets that own their memory, and a file with every kind of data.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "shm/mesh.h"
#include "shmformat.h"
#include "support/stepped_mesh.h"

namespace shm {

struct Closing {
  void operator()(shmf_file* file) const { shmf_close(file); }
  void operator()(shmf_writer* writer) const { shmf_writer_free(writer); }
  void operator()(shmf_decoder* decoder) const { shmf_decoder_free(decoder); }
  void operator()(shmf_boundary* boundary) const { shmf_boundary_free(boundary); }
};
using File = std::unique_ptr<shmf_file, Closing>;
using CWriter = std::unique_ptr<shmf_writer, Closing>;
using CDecoder = std::unique_ptr<shmf_decoder, Closing>;
using CBoundary = std::unique_ptr<shmf_boundary, Closing>;

inline std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

inline File opened(std::span<const std::byte> bytes, bool damaged = false) {
  shmf_error why{};
  shmf_file* file = nullptr;
  shmf_open_options options{};
  options.struct_size = sizeof options;
  options.damaged = damaged ? 1 : 0;
  EXPECT_EQ(shmf_open_memory(bytes.data(), bytes.size(), &options, &file, &why), SHMF_OK)
      << why.message;
  return File(file);
}

/// A target (shmf_target) that owns its memory. Guard bytes after this memory must stay unchanged.
struct Wanted {
  static constexpr std::size_t kBehind = 16;
  shmf_target target{};
  std::vector<std::uint64_t> memory;

  Wanted(std::int32_t what, std::int32_t type, std::uint32_t array = 0, std::uint64_t step = 0,
         std::uint32_t flags = 0) {
    target.struct_size = sizeof target;
    target.what = what;
    target.type = type;
    target.array = array;
    target.step = step;
    target.flags = flags;
  }
  /// Returns the bytes that were used.
  Bytes bytes() const {
    const auto all = std::as_bytes(std::span(memory));
    return {all.begin(), all.begin() + static_cast<std::ptrdiff_t>(target.used)};
  }
  template <class T>
  std::vector<T> values() const {
    std::vector<T> out(target.used / sizeof(T));
    if (!out.empty()) std::memcpy(out.data(), memory.data(), out.size() * sizeof(T));
    return out;
  }
};

/// Asks for the sizes of all targets, allocates memory for them, and reads their data in one call.
inline shmf_status read_all(shmf_file* file, std::vector<Wanted>& wanted, shmf_error& why) {
  std::vector<shmf_target> targets;
  for (const Wanted& it : wanted) targets.push_back(it.target);
  if (const auto status = shmf_read(file, targets.data(), targets.size(), nullptr, &why))
    return status;
  constexpr std::uint64_t kUntouched = 0x5a5a5a5a5a5a5a5a;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const std::uint64_t used = targets[i].used;
    wanted[i].memory.assign(static_cast<std::size_t>(used + 7) / 8 + Wanted::kBehind, kUntouched);
    targets[i].data = wanted[i].memory.data();
    targets[i].bytes = used;
  }
  const auto status = shmf_read(file, targets.data(), targets.size(), nullptr, &why);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    wanted[i].target = targets[i];
    const auto& memory = wanted[i].memory;
    for (std::size_t w = memory.size() - Wanted::kBehind; w < memory.size(); ++w)
      EXPECT_EQ(memory[w], kUntouched) << "target " << i;
  }
  return status;
}

template <class T>
Bytes raw(const std::vector<T>& values) {
  const auto bytes = std::as_bytes(std::span(values));
  return {bytes.begin(), bytes.end()};
}

/// Returns a file with points, the cells of two blocks, arrays of all kinds, and time steps.
inline Bytes two_blocks_file(Order order = Order::keep, std::uint64_t segment_cells = 0) {
  Mesh mesh;
  const TestMesh from = grid(9, 8, 7, ScalarType::float64, warped, porous);
  mesh.schema = from.schema;
  mesh.schema.order = order;
  mesh.schema.blocks.push_back({7, "wedges", CellShape::wedge, 6});
  mesh.xyz = from.xyz;
  for (std::size_t c = 0; c < from.cells.size(); ++c) {
    const bool other = c % 3 == 0;
    mesh.cell_blocks.push_back(other ? 1 : 0);
    const auto& corners = from.cells[c].corners;
    mesh.corners.insert(mesh.corners.end(), corners.begin(), corners.begin() + (other ? 6 : 8));
    mesh.corner_begin.push_back(mesh.corners.size());
  }
  for (std::uint32_t kind = 0; kind < 6; ++kind) {
    const bool of_points = kind % 3 == 0;
    ArrayInfo info =
        array_of("a" + std::to_string(kind), of_points ? Location::point : Location::cell,
                 ScalarType::float64, 1 + kind % 2);
    info.per_step = kind >= 3;
    if (kind % 3 == 2) info.blocks = {1};
    const std::uint64_t elements = of_points       ? mesh.vertex_count()
                                   : kind % 3 == 1 ? mesh.cell_count()
                                                   : (mesh.cell_count() + 2) / 3;
    mesh.schema.arrays.push_back(info);
    mesh.arrays.push_back(info.per_step ? Bytes() : moving_values(info, elements, kind));
    mesh.steps.emplace_back();
    for (std::uint64_t s = 0; s < 3 && info.per_step; ++s)
      mesh.steps.back().push_back(moving_values(info, elements, s));
  }
  mesh.step_times = {0, .5, 1};
  WriteOptions options;
  options.segment_cells = segment_cells;
  MemorySink sink;
  const auto report = write_mesh(sink, mesh, options);
  EXPECT_TRUE(report) << report.error().message();
  return sink.bytes;
}

}  // namespace shm
