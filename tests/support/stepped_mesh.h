// In-memory meshes with time steps, for tests of code that writes and reads steps.
#pragma once

#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "support/feature_files.h"

namespace shm {

using Bytes = std::vector<std::byte>;

/// Values of stepped arrays. The key is a pair of array and step, the value contains all elements
/// in coding order.
using Values = std::map<std::pair<std::uint32_t, std::uint64_t>, Bytes>;

/// Returns options with which steps never wait. Each array, step and group then has a part of its
/// own, even if it is so small that it would otherwise be part of a bundle.
inline WriteOptions without_bundles() {
  WriteOptions options;
  options.waiting_bytes = 0;
  return options;
}

struct Stepped {
  TestMesh mesh;
  Values values;
  WriteOptions options = without_bundles();
};

inline std::uint64_t elements_of(const TestMesh& mesh, std::uint32_t array) {
  if (mesh.schema.arrays[array].location == Location::point) return mesh.vertices;
  std::uint64_t cells = 0;
  for (const TestCell& cell : mesh.cells) cells += mesh.schema.array_covers(array, cell.block);
  return cells;
}

inline std::uint32_t add_stepped(TestMesh& mesh, ArrayInfo info) {
  info.per_step = true;
  mesh.schema.arrays.push_back(std::move(info));
  mesh.arrays.emplace_back();
  return static_cast<std::uint32_t>(mesh.schema.arrays.size() - 1);
}

/// Returns values that change from step to step. Some of them are NaNs, infinities and zeros of
/// both signs.
inline Bytes moving_values(const ArrayInfo& info, std::uint64_t elements, std::uint64_t step) {
  Bytes out;
  for (std::uint64_t i = 0; i < elements * info.components; ++i) {
    const double x = static_cast<double>(i) * .01 + static_cast<double>(step) * .125;
    double v = std::sin(x) * (1 + static_cast<double>(step));
    if (i % 97 == 5) v = std::numeric_limits<double>::quiet_NaN();
    if (i % 89 == 7) v = step % 2 == 0 ? -std::numeric_limits<double>::infinity() : -0.0;
    if (info.type == ScalarType::float64)
      append(out, v);
    else if (info.type == ScalarType::float32)
      append(out, static_cast<float>(v));
    else
      append_scalar(out, info.type, static_cast<std::int64_t>(i / 7 * step));
  }
  return out;
}

/// Adds stepped arrays on points, on cells, and on the cells of one block, with values at steps 0,
/// 1, 2, 4, 5 and 9.
inline Stepped with_steps(TestMesh mesh, Order order) {
  Stepped out;
  out.mesh = with_order(std::move(mesh), order, order == Order::keep, 0);
  add_stepped(out.mesh, array_of("u", Location::point, ScalarType::float64, 3));
  add_stepped(out.mesh, array_of("n", Location::point, ScalarType::int32));
  add_stepped(out.mesh, array_of("p", Location::cell, ScalarType::float32));
  const auto last = static_cast<std::uint32_t>(out.mesh.schema.blocks.size() - 1);
  add_stepped(out.mesh, array_of("some", Location::cell, ScalarType::float64, 1, {last}));
  add_stepped(out.mesh, array_of("bytes", Location::cell, ScalarType::uint8, 2));
  for (std::uint32_t a = 0; a < out.mesh.schema.arrays.size(); ++a)
    for (std::uint64_t step : {0u, 1u, 2u, 4u, 5u, 9u})
      if (out.mesh.schema.arrays[a].per_step)
        out.values[{a, step}] =
            moving_values(out.mesh.schema.arrays[a], elements_of(out.mesh, a), step);
  return out;
}

inline Bytes written(const Stepped& stepped, std::size_t piece_elements = 77) {
  MemorySink sink;
  const auto report =
      write_mesh(stepped.mesh, sink, stepped.options, [&](Writer& writer) -> Result<void> {
        for (const auto& [key, values] : stepped.values) {
          const std::size_t piece = stepped.mesh.stride(key.first) * piece_elements;
          for (std::size_t at = 0; at < values.size(); at += piece)
            if (auto status = writer.add_step_values(
                    key.first, key.second,
                    std::span(values).subspan(at, std::min(piece, values.size() - at)));
                !status)
              return status;
        }
        return {};
      });
  EXPECT_TRUE(report) << (report ? "" : report.error().message());
  return std::move(sink.bytes);
}

inline TestMesh two_blocks() {
  TestMesh mesh = grid(7, 6, 5, ScalarType::float64, warped, porous);
  mesh.schema.blocks.push_back({2, "others", CellShape::hexahedron, 8});
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) mesh.cells[c].block = c / 40 % 2 == 0;
  return mesh;
}

/// Returns a warped grid with a field of waves that move from step to step. The values are in
/// coding order.
inline Stepped waves(std::uint64_t steps) {
  Stepped stepped;
  stepped.mesh = grid(12, 11, 10, ScalarType::float64, warped);
  const std::uint32_t a =
      add_stepped(stepped.mesh, array_of("w", Location::point, ScalarType::float64));
  for (std::uint64_t step = 0; step < steps; ++step)
    for (std::uint64_t v = 0; v < stepped.mesh.vertices; ++v) {
      double p[3];
      std::memcpy(p, &stepped.mesh.xyz[v * 24], 24);
      append(stepped.values[{a, step}], std::sin(3 * p[0] + p[1]) * std::cos(2 * p[2]) +
                                            .01 * static_cast<double>(step) * p[0]);
    }
  return stepped;
}

/// Returns a small file with all kinds of chunks and with several segments, groups, steps and
/// parts. The file also has vertices that no cell uses, and some values that are not finite.
/// `last_time` is the time of the last step.
inline Bytes small_file(ScalarType coordinates, const Quantization& quantization = {},
                        double last_time = 9) {
  TestMesh mesh = grid(4, 3, 3, coordinates, warped);
  mesh.schema.coordinate_quantization = quantization;
  mesh.schema.blocks.push_back({2, "others", CellShape::hexahedron, 8});
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) mesh.cells[c].block = c / 9 % 2 == 0;
  Stepped stepped = with_steps(std::move(mesh), Order::keep);
  stepped.options.group_cells = 9;
  stepped.options.segment_cells = 18;
  MemorySink sink;
  const auto report =
      write_mesh(stepped.mesh, sink, stepped.options, [&](Writer& writer) -> Result<void> {
        for (const auto& [key, values] : stepped.values)
          if (auto status = writer.add_step_values(key.first, key.second, values); !status)
            return status;
        const double times[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, last_time};
        if (auto status = writer.set_step_times(times); !status) return status;
        return writer.add_extra({"title", ScalarType::uint8, Reference::nothing, {5}, Bytes(5)});
      });
  EXPECT_TRUE(report) << (report ? "" : report.error().message());
  return std::move(sink.bytes);
}

}  // namespace shm
