// Writes AVS UCD files front to back.
#include <algorithm>
#include <charconv>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/failure.h"
#include "base/output_file.h"
#include "base/stored_value.h"
#include "mesh/mesh_source.h"
#include "ucd/types.h"
#include "ucd/ucd.h"

namespace shm::converters {
namespace {

using ucd::CellType;
using ucd::kCellTypes;

constexpr std::uint64_t kPiece = 4096;

template <class T>
T value_at(const std::byte* values, std::uint64_t index) {
  T value;
  std::memcpy(&value, values + index * sizeof(T), sizeof(T));
  return value;
}

// Appends a value to a line, as the shortest decimal that reads back to the same value.
void append_number(std::string& line, ScalarType type, const std::byte* values,
                   std::uint64_t index) {
  with_scalar(type, [&](auto zero) {
    using T = decltype(zero);
    using Written = std::conditional_t<std::is_same_v<T, float>, double, T>;
    char text[32];
    const Written value{value_at<T>(values, index)};
    line.append(text, std::to_chars(text, text + sizeof text, value).ptr);
  });
}

class UcdWriter {
 public:
  UcdWriter(MeshSource& mesh, const std::string& path)
      : mesh_(mesh), info_(mesh.info()), path_(path), out_(path, false) {}
  void write();

 private:
  // An array that is being written. `piece` contains the values that were read most recently, and
  // `read` is the number of elements read so far.
  struct Column {
    std::size_t array;
    std::uint64_t step, read = 0;
    std::vector<std::byte> piece;
  };
  std::string text_of(std::string_view key) const;
  std::optional<std::size_t> array_of(std::string_view role) const;
  std::vector<Column> columns(Location location) const;
  void counts(std::uint64_t node_values, std::uint64_t cell_values);
  void nodes();
  void cells();
  void labels(const std::vector<Column>& columns, std::string_view units_key);
  void node_data(std::vector<Column>& columns);
  void cell_data(std::vector<Column>& columns);
  void values(std::string& line, const Column& column, std::uint64_t element) const;
  std::vector<std::int64_t> numbers(std::optional<std::size_t> array, std::uint64_t first,
                                    std::uint64_t count);
  const CellType& type_of(std::uint32_t block) const;

  MeshSource& mesh_;
  const MeshInfo& info_;
  std::string path_;
  NumberOutput out_;
  std::optional<std::size_t> node_ids_, cell_ids_, materials_;
};

void UcdWriter::write() {
  for (std::uint32_t b = 0; b < info_.schema.blocks.size(); ++b) type_of(b);
  node_ids_ = array_of("ucd:node_id");
  cell_ids_ = array_of("ucd:cell_id");
  materials_ = array_of("ucd:material");
  std::vector<Column> of_nodes = columns(Location::point), of_cells = columns(Location::cell);
  const auto width = [&](const std::vector<Column>& all) {
    std::uint64_t sum = 0;
    for (const Column& column : all) sum += info_.schema.arrays[column.array].components;
    return sum;
  };
  out_.text(text_of("ucd/comments"));
  counts(width(of_nodes), width(of_cells));
  nodes();
  cells();
  labels(of_nodes, "ucd/point_units");
  node_data(of_nodes);
  labels(of_cells, "ucd/cell_units");
  cell_data(of_cells);
  out_.text(text_of("ucd/model"));
  out_.finish();
}

std::string UcdWriter::text_of(std::string_view key) const {
  const Extra* extra = find_extra(info_, key);
  return extra == nullptr ? std::string() : text_of_extra(*extra);
}

std::optional<std::size_t> UcdWriter::array_of(std::string_view role) const {
  for (std::size_t a = 0; a < info_.schema.arrays.size(); ++a) {
    const ArrayInfo& array = info_.schema.arrays[a];
    if (array.role == role && array.type == ScalarType::int64 && array.components == 1 &&
        array.blocks.empty() && !array.per_step)
      return a;
  }
  return std::nullopt;
}

// Returns the arrays that are written as node or cell data: those without a role. For a stepped
// array, the result refers to the values at the last time step.
std::vector<UcdWriter::Column> UcdWriter::columns(Location location) const {
  std::vector<Column> found;
  for (std::size_t a = 0; a < info_.schema.arrays.size(); ++a) {
    const ArrayInfo& array = info_.schema.arrays[a];
    if (!array.role.empty() || array.location != location) continue;
    if (array.per_step && info_.step_times.empty()) continue;
    found.push_back({a, array.per_step ? info_.step_times.size() - 1 : 0, 0, {}});
  }
  return found;
}

void UcdWriter::counts(std::uint64_t node_values, std::uint64_t cell_values) {
  std::int64_t model_values = 0;
  for (const Extra& extra : info_.extras)
    if (extra.key == "ucd/model_values" && extra.type == ScalarType::int64 &&
        extra.data.size() == sizeof model_values)
      model_values = value_at<std::int64_t>(extra.data.data(), 0);
  out_.line(std::to_string(info_.vertices) + " " + std::to_string(info_.cells()) + " " +
            std::to_string(node_values) + " " + std::to_string(cell_values) + " " +
            std::to_string(model_values));
}

// Returns the numbers of `count` nodes or cells: the values of `array`, or, if `array` is empty,
// consecutive numbers that start at 1 for node 0 or cell 0.
std::vector<std::int64_t> UcdWriter::numbers(std::optional<std::size_t> array, std::uint64_t first,
                                             std::uint64_t count) {
  std::vector<std::int64_t> out(count);
  if (array)
    mesh_.read_array(*array, 0, first, count, reinterpret_cast<std::byte*>(out.data()));
  else
    for (std::uint64_t i = 0; i < count; ++i) out[i] = static_cast<std::int64_t>(first + i) + 1;
  return out;
}

void UcdWriter::nodes() {
  const ScalarType type = info_.schema.coordinate_type;
  std::vector<std::byte> xyz;
  std::string line;
  for (std::uint64_t first = 0; first < info_.vertices; first += kPiece) {
    const std::uint64_t count = std::min(kPiece, info_.vertices - first);
    xyz.resize(count * 3 * scalar_bytes(type));
    mesh_.read_points(first, count, xyz.data());
    const auto ids = numbers(node_ids_, first, count);
    for (std::uint64_t i = 0; i < count; ++i) {
      line = std::to_string(ids[i]);
      for (std::uint64_t c = 0; c < 3; ++c) {
        line += ' ';
        append_number(line, type, xyz.data(), 3 * i + c);
      }
      out_.line(line);
    }
  }
}

const CellType& UcdWriter::type_of(std::uint32_t block) const {
  const BlockInfo& info = info_.schema.blocks[block];
  for (const CellType& type : kCellTypes)
    if (type.shape == info.shape && type.nodes == info.nodes_per_cell &&
        info.scheme == NodeScheme::lagrange)
      return type;
  throw Failure(Error{.code = ErrorCode::unsupported,
                      .detail = "UCD cannot represent the cells of block " +
                                std::to_string(info.id) + " (" + kind_of_cells(info) + ", " +
                                std::to_string(info.nodes_per_cell) + " nodes)",
                      .section = "cells",
                      .file = path_});
}

void UcdWriter::cells() {
  CellBatch batch;
  std::string line;
  std::vector<std::uint64_t> corners;
  std::uint64_t first = 0;
  for (mesh_.rewind_cells(); mesh_.next_cells(batch, kPiece); first += batch.size()) {
    const auto ids = numbers(cell_ids_, first, batch.size());
    std::vector<std::int64_t> materials(batch.size());
    for (std::size_t i = 0; i < batch.size(); ++i)
      materials[i] = info_.schema.blocks[batch.blocks[i]].id;
    if (materials_) materials = numbers(materials_, first, batch.size());
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const CellType& type = type_of(batch.blocks[i]);
      corners.assign(batch.cell(i).begin(), batch.cell(i).end());
      ucd::to_file_order(type, corners);
      line = std::to_string(ids[i]) + " " + std::to_string(materials[i]) + " " +
             std::string(type.name);
      for (const std::uint64_t corner : corners) {
        line += ' ';
        line += std::to_string(numbers(node_ids_, corner, 1)[0]);
      }
      out_.line(line);
    }
  }
}

void UcdWriter::labels(const std::vector<Column>& columns, std::string_view units_key) {
  if (columns.empty()) return;
  std::string line = std::to_string(columns.size());
  for (const Column& column : columns)
    line += " " + std::to_string(info_.schema.arrays[column.array].components);
  out_.line(line);
  const std::string units = text_of(units_key);
  std::size_t position = 0;
  for (const Column& column : columns) {
    const std::size_t end = std::min(units.find('\n', position), units.size());
    std::string label = info_.schema.arrays[column.array].name;
    std::replace_if(
        label.begin(), label.end(), [](char c) { return c == ',' || c == '\n' || c == '\r'; }, '_');
    out_.line(label + (units.empty() ? ", none" : units.substr(position, end - position)));
    position = std::min(end + 1, units.size());
  }
}

void UcdWriter::values(std::string& line, const Column& column, std::uint64_t element) const {
  const ArrayInfo& array = info_.schema.arrays[column.array];
  for (std::uint32_t c = 0; c < array.components; ++c) {
    line += ' ';
    append_number(line, array.type, column.piece.data(), element * array.components + c);
  }
}

void UcdWriter::node_data(std::vector<Column>& columns) {
  if (columns.empty()) return;
  std::string line;
  for (std::uint64_t first = 0; first < info_.vertices; first += kPiece) {
    const std::uint64_t count = std::min(kPiece, info_.vertices - first);
    for (Column& column : columns) {
      column.piece.resize(count * info_.array_stride(column.array));
      mesh_.read_array(column.array, column.step, first, count, column.piece.data());
    }
    const auto ids = numbers(node_ids_, first, count);
    for (std::uint64_t i = 0; i < count; ++i) {
      line = std::to_string(ids[i]);
      for (const Column& column : columns) values(line, column, i);
      out_.line(line);
    }
  }
}

// Writes the cell data. In blocks that an array does not cover, the array has the value NaN
// (floats) or 0 (integers).
void UcdWriter::cell_data(std::vector<Column>& columns) {
  if (columns.empty()) return;
  CellBatch batch;
  std::string line;
  std::uint64_t first = 0;
  std::vector<std::uint64_t> taken(columns.size());
  for (mesh_.rewind_cells(); mesh_.next_cells(batch, kPiece); first += batch.size()) {
    for (Column& column : columns) {
      std::uint64_t count = 0;
      for (const std::uint32_t block : batch.blocks)
        count += info_.schema.array_covers(column.array, block);
      column.piece.resize(count * info_.array_stride(column.array));
      mesh_.read_array(column.array, column.step, column.read, count, column.piece.data());
      column.read += count;
    }
    std::fill(taken.begin(), taken.end(), 0);
    const auto ids = numbers(cell_ids_, first, batch.size());
    for (std::size_t i = 0; i < batch.size(); ++i) {
      line = std::to_string(ids[i]);
      for (std::size_t k = 0; k < columns.size(); ++k) {
        const ArrayInfo& array = info_.schema.arrays[columns[k].array];
        if (info_.schema.array_covers(columns[k].array, batch.blocks[i]))
          values(line, columns[k], taken[k]++);
        else
          for (std::uint32_t c = 0; c < array.components; ++c)
            line += is_float(array.type) ? " nan" : " 0";
      }
      out_.line(line);
    }
  }
}

}  // namespace

void write_ucd(MeshSource& mesh, const std::string& path) { UcdWriter(mesh, path).write(); }

}  // namespace shm::converters
