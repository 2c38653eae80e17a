// Reads AVS UCD files. The sections of a file are, in this order: counts, nodes, cells, node data,
// cell data, model data.
#include <algorithm>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "base/failure.h"
#include "base/text_input.h"
#include "mesh/cell_store.h"
#include "mesh/mesh_source.h"
#include "ucd/types.h"
#include "ucd/ucd.h"

namespace shm::converters {
namespace {

using ucd::CellType;
using ucd::kCellTypes;

constexpr std::size_t kMostBlocks = 1024;
constexpr char kBinaryMagic = 7;

// Maps the node or cell numbers of a file to indices, which start at 0.
class Numbering {
 public:
  void add(std::int64_t id) {
    if (id != static_cast<std::int64_t>(count_) + 1) plain_ = false;
    if (!plain_ && by_id_.size() < count_)
      for (std::uint64_t i = by_id_.size(); i < count_; ++i)
        by_id_.emplace_back(static_cast<std::int64_t>(i) + 1, i);
    if (!plain_) by_id_.emplace_back(id, count_);
    ++count_;
  }
  // Sorts the numbers. Must be called once, before find(). Returns false if two items have the same
  // number; find() then returns one of the two items.
  bool finish() {
    std::sort(by_id_.begin(), by_id_.end());
    return std::adjacent_find(by_id_.begin(), by_id_.end(), [](const auto& a, const auto& b) {
             return a.first == b.first;
           }) == by_id_.end();
  }
  bool plain() const { return plain_; }  // true if the numbers are 1, 2, 3, ...
  std::optional<std::uint64_t> find(std::int64_t id) const {
    if (plain_) {
      if (id < 1 || static_cast<std::uint64_t>(id) > count_) return std::nullopt;
      return static_cast<std::uint64_t>(id) - 1;
    }
    const auto found =
        std::lower_bound(by_id_.begin(), by_id_.end(), std::pair(id, std::uint64_t{0}));
    if (found == by_id_.end() || found->first != id) return std::nullopt;
    return found->second;
  }

 private:
  bool plain_ = true;
  std::uint64_t count_ = 0;
  // Pairs (number, index), sorted by number. Empty as long as the numbers are 1, 2, 3, ...
  std::vector<std::pair<std::int64_t, std::uint64_t>> by_id_;
};

class UcdMesh final : public MeshSource {
 public:
  UcdMesh(const std::string& path, Spool& spool)
      : input_(path),
        spool_(&spool),
        points_(spool, 3 * sizeof(double)),
        cells_(spool),
        node_ids_(spool, sizeof(std::int64_t)),
        cell_ids_(spool, sizeof(std::int64_t)),
        materials_(spool, sizeof(std::int64_t)) {
    read();
  }

  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override {
    points_.read(first, count, out);
  }
  bool next_cells(CellBatch& out, std::size_t max_cells) override {
    out.clear();
    const std::uint64_t count = std::min<std::uint64_t>(max_cells, cells_.size() - next_cell_);
    cells_.read_run(next_cell_, count, out);
    for (std::uint64_t i = 0; i < count; ++i)
      out.blocks[i] = block_of(next_cell_ + i, out.blocks[i]);
    next_cell_ += count;
    return count > 0;
  }
  void rewind_cells() override { next_cell_ = 0; }
  void seek_cells(std::uint64_t first) override { next_cell_ = first; }
  void read_array(std::size_t array, std::uint64_t, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override {
    values_[array]->read(first, count, out);
  }

 private:
  void read();
  void comments();
  void nodes(std::uint64_t count);
  void cells(std::uint64_t count);
  void data(Location location, std::uint64_t values, std::uint64_t elements);
  std::uint64_t element_of_row(Location location, std::uint64_t row, std::int64_t id);
  void model(std::int64_t values);
  void find_blocks();
  void add_array(std::string name, std::string role, Location location, ScalarType type,
                 std::uint32_t components, PagedArray& values);
  std::uint32_t block_of(std::uint64_t cell, std::uint32_t type) {
    return block_numbers_.at(
        {materials_are_blocks_ ? materials_.get<std::int64_t>(cell) : 0, type});
  }

  TextInput input_;
  Spool* spool_;
  MeshInfo info_;
  PagedArray points_;
  // The cells of the file. In cells_, the block of a cell is the index of its cell type in
  // kCellTypes.
  CellStore cells_;
  PagedArray node_ids_, cell_ids_, materials_;
  Numbering node_numbers_, cell_numbers_;
  std::vector<std::unique_ptr<PagedArray>> data_;
  std::vector<PagedArray*> values_;  // values of each array of the schema
  bool materials_are_blocks_ = true;
  std::map<std::pair<std::int64_t, std::uint32_t>, std::uint32_t> block_numbers_;
  std::uint64_t next_cell_ = 0;
};

void UcdMesh::read() {
  info_.schema.source_format = "ucd";
  info_.schema.coordinate_type = ScalarType::float64;
  comments();
  input_.enter("counts");
  const auto node_count = input_.number<std::uint64_t>();
  const auto cell_count = input_.number<std::uint64_t>();
  const auto node_values = input_.number<std::uint64_t>();
  const auto cell_values = input_.number<std::uint64_t>();
  const auto model_values = input_.number<std::int64_t>();
  nodes(node_count);
  cells(cell_count);
  find_blocks();
  data(Location::point, node_values, node_count);
  data(Location::cell, cell_values, cell_count);
  model(model_values);
  if (!node_numbers_.plain())
    add_array("node id", "ucd:node_id", Location::point, ScalarType::int64, 1, node_ids_);
  if (!cell_numbers_.plain())
    add_array("cell id", "ucd:cell_id", Location::cell, ScalarType::int64, 1, cell_ids_);
  if (!materials_are_blocks_)
    add_array("material", "ucd:material", Location::cell, ScalarType::int64, 1, materials_);
}

void UcdMesh::comments() {
  input_.enter("comments");
  std::string comments;
  while (!input_.at_end() && input_.peek_word().starts_with('#')) comments += input_.line() + "\n";
  if (!comments.empty()) info_.extras.push_back(text_extra("ucd/comments", comments));
}

void UcdMesh::nodes(std::uint64_t count) {
  input_.enter("nodes");
  // Each node has a line of at least 8 bytes: four numbers and their separators.
  input_.expect_room(count, 8, "nodes");
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto id = input_.number<std::int64_t>();
    node_numbers_.add(id);
    node_ids_.append(1, reinterpret_cast<const std::byte*>(&id));
    std::array<double, 3> xyz;
    for (double& x : xyz) x = input_.number<double>();
    points_.append(1, reinterpret_cast<const std::byte*>(xyz.data()));
  }
  if (!node_numbers_.finish()) input_.fail(ErrorCode::corrupt, "two nodes have the same number");
  info_.vertices = count;
}

void UcdMesh::cells(std::uint64_t count) {
  input_.enter("cells");
  input_.expect_room(count, 7, "cells");  // the shortest line of a cell is "1 1 pt 1"
  std::vector<std::uint64_t> corners;
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto id = input_.number<std::int64_t>(), material = input_.number<std::int64_t>();
    const std::string_view word = input_.word();
    const auto* type = std::find_if(kCellTypes.begin(), kCellTypes.end(),
                                    [&](const CellType& each) { return each.name == word; });
    if (type == kCellTypes.end())
      input_.fail(ErrorCode::corrupt, "'" + std::string(word) + "' is not a cell type of UCD");
    corners.clear();
    for (std::uint32_t n = 0; n < type->nodes; ++n) {
      const auto node = input_.number<std::int64_t>();
      const auto vertex = node_numbers_.find(node);
      if (!vertex) input_.fail(ErrorCode::corrupt, "unknown node " + std::to_string(node));
      corners.push_back(*vertex);
    }
    ucd::to_model_order(*type, corners);
    cells_.append(static_cast<std::uint32_t>(type - kCellTypes.begin()), corners);
    cell_numbers_.add(id);
    cell_ids_.append(1, reinterpret_cast<const std::byte*>(&id));
    materials_.append(1, reinterpret_cast<const std::byte*>(&material));
  }
  // Ignore the result, which is false if two cells have the same number. Cell numbers may repeat,
  // because some programs number quads and hexahedra separately.
  cell_numbers_.finish();
}

// Creates one block for each combination of material and cell type. If there would be too many
// blocks, creates one block for each cell type.
void UcdMesh::find_blocks() {
  CellBatch cell;
  for (int attempt = 0; attempt < 2; ++attempt) {
    block_numbers_.clear();
    info_.schema.blocks.clear();
    info_.block_cells.clear();
    for (std::uint64_t i = 0; i < cells_.size(); ++i) {
      cell.clear();
      cells_.read(i, cell);
      const std::uint32_t type = cell.blocks[0];
      const std::int64_t material = materials_are_blocks_ ? materials_.get<std::int64_t>(i) : 0;
      const auto next = static_cast<std::uint32_t>(info_.schema.blocks.size());
      const auto [entry, is_new] = block_numbers_.try_emplace({material, type}, next);
      if (is_new) {
        info_.schema.blocks.push_back(
            {material, {}, kCellTypes[type].shape, kCellTypes[type].nodes});
        info_.block_cells.push_back(0);
        if (info_.schema.blocks.size() > kMostBlocks) break;
      }
      ++info_.block_cells[entry->second];
    }
    if (info_.schema.blocks.size() <= kMostBlocks) return;
    materials_are_blocks_ = false;
  }
}

// Returns the index of the node or cell to which row `row` of a data section belongs. `id` is the
// node or cell number in that row. Usually, the rows are in the order of the nodes or cells, and
// the result is `row`. If cell numbers repeat, the rows must be in the order of the cells.
std::uint64_t UcdMesh::element_of_row(Location location, std::uint64_t row, std::int64_t id) {
  const bool point = location == Location::point;
  if ((point ? node_ids_ : cell_ids_).get<std::int64_t>(row) == id) return row;
  const auto element = (point ? node_numbers_ : cell_numbers_).find(id);
  if (!element)
    input_.fail(ErrorCode::corrupt, "has values for number " + std::to_string(id) +
                                        ", but no node or cell has this number");
  return *element;
}

// Reads a data section: first the labels of the components, then one line of values for each node
// or cell.
void UcdMesh::data(Location location, std::uint64_t values, std::uint64_t elements) {
  if (values == 0) return;
  input_.enter(location == Location::point ? "node data" : "cell data");
  const auto count = input_.number<std::uint64_t>();
  input_.expect_room(count, 2, "components");
  std::vector<std::uint32_t> sizes;
  std::uint64_t sum = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    sizes.push_back(input_.number<std::uint16_t>());
    sum += sizes.back();
  }
  if (sum != values || std::count(sizes.begin(), sizes.end(), 0u) > 0)
    input_.fail(ErrorCode::corrupt, "the components have " + std::to_string(sum) +
                                        " values in total, not " + std::to_string(values));
  input_.expect_room(elements, 2 * (values + 1) - 1, "values");
  input_.skip_line();
  std::string units;
  std::vector<PagedArray*> arrays;
  for (const std::uint32_t size : sizes) {
    const std::string line = input_.line();
    const std::size_t comma = line.find(',');
    data_.push_back(std::make_unique<PagedArray>(*spool_, size * sizeof(double)));
    arrays.push_back(data_.back().get());
    add_array(line.substr(0, comma), {}, location, ScalarType::float64, size, *arrays.back());
    if (comma != std::string::npos) units += line.substr(comma);
    units += "\n";
  }
  info_.extras.push_back(
      text_extra(location == Location::point ? "ucd/point_units" : "ucd/cell_units", units));
  std::vector<double> piece;
  std::vector<bool> seen(static_cast<std::size_t>(elements));
  for (std::uint64_t i = 0; i < elements; ++i) {
    const std::uint64_t element = element_of_row(location, i, input_.number<std::int64_t>());
    if (seen[static_cast<std::size_t>(element)])
      input_.fail(ErrorCode::corrupt, "the section has values for the same node or cell twice");
    seen[static_cast<std::size_t>(element)] = true;
    for (std::size_t a = 0; a < arrays.size(); ++a) {
      piece.resize(sizes[a]);
      for (double& value : piece) value = input_.number<double>();
      arrays[a]->write(element, 1, reinterpret_cast<const std::byte*>(piece.data()));
    }
  }
}

void UcdMesh::model(std::int64_t values) {
  std::string text;
  if (!input_.at_end()) input_.skip_line();
  while (!input_.at_end()) text += input_.line() + "\n";
  const bool blank = text.find_first_not_of(" \t\n") == std::string::npos;
  if (values == 0 && blank) return;
  Extra count{"ucd/model_values", ScalarType::int64, Reference::nothing, {1}, {}};
  const auto bytes = std::as_bytes(std::span(&values, 1));
  count.data.assign(bytes.begin(), bytes.end());
  info_.extras.push_back(std::move(count));
  info_.extras.push_back(text_extra("ucd/model", text));
}

void UcdMesh::add_array(std::string name, std::string role, Location location, ScalarType type,
                        std::uint32_t components, PagedArray& values) {
  ArrayInfo info;
  info.name = std::move(name);
  info.role = std::move(role);
  info.location = location;
  info.type = type;
  info.components = components;
  info_.schema.arrays.push_back(std::move(info));
  values_.push_back(&values);
}

}  // namespace

// Returns true for the header of a legacy VTK file, in upper or lower case. Compares the whole
// header, because a comment in a UCD file may begin with the word "VTK".
static bool is_vtk_header(std::string_view text) {
  constexpr std::string_view kHeader = "# vtk datafile version";
  return text.size() >= kHeader.size() &&
         std::equal(kHeader.begin(), kHeader.end(), text.begin(),
                    [](char a, char b) { return a == (b >= 'A' && b <= 'Z' ? b - 'A' + 'a' : b); });
}

// Recognizes a UCD file by its first line that is not a comment: the line contains exactly five
// counts.
bool looks_like_ucd(std::span<const std::byte> head) {
  std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  if (!text.empty() && text.front() == kBinaryMagic) return true;
  while (text.starts_with('#')) {
    if (text.starts_with("# vtk ") || is_vtk_header(text)) return false;
    text.remove_prefix(std::min(text.size(), text.find('\n') + 1));
  }
  const std::string_view line = text.substr(0, text.find('\n'));
  int words = 0;
  bool in_word = false;
  for (const char c : line) {
    const bool digit = c >= '0' && c <= '9', space = c == ' ' || c == '\t' || c == '\r';
    if (!digit && !space) return false;
    words += digit && !in_word;
    in_word = digit;
  }
  return words == 5;
}

std::unique_ptr<MeshSource> open_ucd(const std::string& path, Spool& spool) {
  {
    TextInput input(path);
    std::byte first{};
    if (!input.at_end()) input.bytes(&first, 1);
    if (first == std::byte{kBinaryMagic})
      input.fail(ErrorCode::unsupported, "binary UCD files cannot be read, only text files");
  }
  return std::make_unique<UcdMesh>(path, spool);
}

}  // namespace shm::converters
