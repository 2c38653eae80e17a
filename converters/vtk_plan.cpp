#include "vtk_plan.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "failure.h"
#include "vtk_field_data.h"
#include "vtk_values.h"

namespace shm::converters::vtk {
namespace {

// Rows of binary files up to 4.x are 32-bit integers.
constexpr std::uint64_t kMostClassic = std::numeric_limits<std::int32_t>::max();

}  // namespace

void fail_extra(const std::string& key, std::string detail) {
  throw Failure(Error{ErrorCode::corrupt, std::move(detail), "extra '" + key + "'", kNoOffset, {}});
}

const Extra* FilePlan::extra(const std::string& key) const {
  const auto found = extras_.find(key);
  return found == extras_.end() ? nullptr : found->second;
}

// Values of an int32 or int64 extra; empty when it is absent.
std::vector<std::int64_t> FilePlan::integers(const std::string& key) const {
  std::vector<std::int64_t> values;
  const Extra* found = extra(key);
  if (found == nullptr) return values;
  if (found->type != ScalarType::int32 && found->type != ScalarType::int64)
    fail_extra(key, "has values of the wrong type");
  with_scalar(found->type, [&](auto value) {
    for (std::size_t at = 0; at + sizeof value <= found->data.size(); at += sizeof value) {
      std::memcpy(&value, found->data.data() + at, sizeof value);
      values.push_back(static_cast<std::int64_t>(value));
    }
  });
  return values;
}

FilePlan::FilePlan(MeshSource& mesh) : mesh_(mesh), info_(mesh.info()) {
  for (const Extra& each : info_.extras) extras_.emplace(each.key, &each);
  const Extra* text = info_.schema.source_format == "vtk" ? extra("vtk/skeleton") : nullptr;
  if (text != nullptr) {
    plan_from_source(*text);
  } else {
    plan_for_foreign();
  }
  add_missing_parts();
  add_unplaced_arrays();
  load_cell_types();
  load_polyhedra();
  choose_layout();
}

void FilePlan::plan_from_source(const Extra& text) {
  const auto* begin = reinterpret_cast<const char*>(text.data.data());
  auto parsed = parse_skeleton({begin, text.data.size()});
  if (!parsed) fail_extra(text.key, "is not the skeleton of a VTK file");
  skeleton_ = std::move(*parsed);
  Location location = Location::point;
  std::erase_if(skeleton_.entries, [&](const Entry& each) {
    if (each.kind == EntryKind::cell_data) location = Location::cell;
    if (each.kind == EntryKind::point_data) location = Location::point;
    return each.origin == Origin::array && !place_array(each, location);
  });
}

// False when the array that the entry names is not there, or no longer what it was.
bool FilePlan::place_array(const Entry& entry, Location location) {
  if (entry.index >= info_.schema.arrays.size() || !is_written(entry.index)) return false;
  const ArrayInfo& array = info_.schema.arrays[entry.index];
  const std::uint64_t fixed = fixed_components(entry.kind);
  const bool fits = array.location == location && entry.components == array.components &&
                    (fixed == 0 || fixed == array.components) &&
                    scalar_of_word(entry.type, skeleton_.binary) == array.type;
  return fits && placed_.insert(entry.index).second;
}

bool FilePlan::is_written(std::size_t array) const {
  const ArrayInfo& info = info_.schema.arrays[array];
  return info.role.empty() && (!info.per_step || !info_.step_times.empty());
}

Entry FilePlan::array_entry(std::size_t array) const {
  const ArrayInfo& info = info_.schema.arrays[array];
  return Entry{.kind = EntryKind::array,
               .origin = Origin::array,
               .index = array,
               .name = encode_name(info.name),
               .type = std::string(word_of_scalar(info.type)),
               .components = info.components,
               .tuples = info.location == Location::cell ? info_.cells() : info_.vertices};
}

void FilePlan::add_unplaced_arrays() {
  for (const Location location : {Location::cell, Location::point}) {
    std::vector<Entry> arrays;
    for (std::size_t i = 0; i < info_.schema.arrays.size(); ++i)
      if (info_.schema.arrays[i].location == location && is_written(i) && !placed_.contains(i))
        arrays.push_back(array_entry(i));
    if (arrays.empty()) continue;
    auto& entries = skeleton_.entries;
    if (location == Location::point || entries.back().origin != Origin::block_ids) {
      const bool of_cells = location == Location::cell;
      entries.push_back({.kind = of_cells ? EntryKind::cell_data : EntryKind::point_data});
      entries.push_back({.kind = EntryKind::field, .name = "FieldData"});
    }
    entries.insert(entries.end(), arrays.begin(), arrays.end());
  }
}

void FilePlan::add_missing_parts() {
  auto& entries = skeleton_.entries;
  const auto is_attribute = [](const Entry& e) {
    return e.kind == EntryKind::cell_data || e.kind == EntryKind::point_data;
  };
  const auto add = [&](EntryKind kind, std::string type) {
    for (const Entry& e : entries)
      if (e.kind == kind) return;
    entries.insert(std::find_if(entries.begin(), entries.end(), is_attribute),
                   Entry{.kind = kind, .type = std::move(type)});
  };
  add(EntryKind::points, std::string(word_of_scalar(info_.schema.coordinate_type)));
  if (info_.cells() > 0) add(EntryKind::cells, {});
}

void FilePlan::plan_for_foreign() {
  if (const Extra* title = extra("mesh/title")) set_title(*title);
  if (!info_.step_times.empty()) add_time();
  add_block_names();
  add_missing_parts();
  add_block_ids();
}

void FilePlan::add_time() {
  time_ = Extra{data_key(0), ScalarType::float64, Reference::nothing, {1, 1}, {}};
  time_.data.resize(sizeof(double));
  std::memcpy(time_.data.data(), &info_.step_times.back(), sizeof(double));
  extras_[time_.key] = &time_;
  skeleton_.entries.push_back({.kind = EntryKind::field, .name = "FieldData"});
  skeleton_.entries.push_back({.kind = EntryKind::array,
                               .origin = Origin::extra,
                               .name = "TIME",
                               .type = "double",
                               .components = 1,
                               .tuples = 1});
}

// VTK's readers take one line of at most 255 bytes.
void FilePlan::set_title(const Extra& title) {
  constexpr std::size_t kLongest = 255;
  const auto* begin = reinterpret_cast<const char*>(title.data.data());
  skeleton_.title.assign(begin, std::min(title.data.size(), kLongest));
  for (char& c : skeleton_.title)
    if (c == '\n' || c == '\r' || c == '\0') c = ' ';
}

void FilePlan::add_block_names() {
  names_ = vtk_block_names_extra(info_, data_key(1));
  if (names_.shape[0] == 0) return;
  extras_[names_.key] = &names_;
  if (skeleton_.entries.empty())
    skeleton_.entries.push_back({.kind = EntryKind::field, .name = "FieldData"});
  skeleton_.entries.push_back({.kind = EntryKind::array,
                               .origin = Origin::extra,
                               .index = 1,
                               .name = kVtkBlockNames,
                               .type = "string",
                               .components = 1,
                               .tuples = names_.shape[0]});
}

// Blocks of other formats have numbers of their own; VTK has only types, so they become an array.
void FilePlan::add_block_ids() {
  const auto& blocks = info_.schema.blocks;
  bool differ = false, wide = false;
  for (const BlockInfo& block : blocks) {
    differ |= block.id != blocks.front().id || !block.name.empty();
    wide |= block.id != static_cast<std::int32_t>(block.id);
  }
  for (const ArrayInfo& array : info_.schema.arrays)
    if (array.location == Location::cell && array.name == "BlockId") return;
  if (!differ) return;
  auto& entries = skeleton_.entries;
  entries.push_back({.kind = EntryKind::cell_data});
  entries.push_back({.kind = EntryKind::field, .name = "FieldData"});
  entries.push_back({.kind = EntryKind::array,
                     .origin = Origin::block_ids,
                     .name = "BlockId",
                     .type = wide ? "vtktypeint64" : "int",
                     .components = 1,
                     .tuples = info_.cells()});
}

void FilePlan::load_cell_types() {
  const std::string key = "vtk/cell_types";
  const std::vector<std::int64_t> types = integers(key);
  const auto& blocks = info_.schema.blocks;
  const bool own = info_.schema.source_format == "vtk" && !types.empty();
  if (own && types.size() != blocks.size())
    fail_extra(key, "has " + std::to_string(types.size()) + " types for " +
                        std::to_string(blocks.size()) + " blocks");
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (own && (types[b] < 0 || types[b] > 255)) fail_extra(key, "has an unknown cell type");
    block_types_.push_back(own ? static_cast<int>(types[b]) : cell_type_of_block(blocks[b]));
  }
}

void FilePlan::load_polyhedra() {
  if (std::find(block_types_.begin(), block_types_.end(), kPolyhedron) == block_types_.end())
    return;
  const std::vector<std::int64_t> cells = integers("vtk/polyhedron/cells");
  const std::vector<std::int64_t> faces = integers("vtk/polyhedron/faces");
  face_sizes_ = integers("vtk/polyhedron/face_sizes");
  if (faces.size() != cells.size())
    fail_extra("vtk/polyhedron/faces", "is not as long as the list of polyhedra");
  std::uint64_t first = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (faces[i] < 0 || static_cast<std::uint64_t>(faces[i]) > face_sizes_.size() - first)
      fail_extra("vtk/polyhedron/faces", "states more faces than there are");
    polyhedra_.push_back({cells[i], static_cast<std::uint64_t>(faces[i]), first});
    first += static_cast<std::uint64_t>(faces[i]);
  }
  std::sort(polyhedra_.begin(), polyhedra_.end(),
            [](const Polyhedron& a, const Polyhedron& b) { return a.cell < b.cell; });
}

// Counts the numbers of all cells, and takes the 5.x layout where the classic one is too small.
void FilePlan::choose_layout() {
  bool all_fixed = polyhedra_.empty();
  for (std::size_t b = 0; b < info_.schema.blocks.size(); ++b) {
    const std::uint32_t nodes = info_.schema.blocks[b].nodes_per_cell;
    all_fixed &= nodes > 0 || info_.block_cells[b] == 0;
    cell_numbers_ += nodes * info_.block_cells[b];
  }
  if (!all_fixed) {
    cell_numbers_ = 0;
    for_each_cell([&](const auto& numbers) { cell_numbers_ += numbers.size(); });
  }
  const bool too_large =
      cell_numbers_ + info_.cells() > kMostClassic || info_.vertices > kMostClassic;
  if (skeleton_.major_version() < 5 && skeleton_.binary && too_large) skeleton_.version = "5.1";
  for (Entry& each : skeleton_.entries) {
    if (each.kind != EntryKind::cells) continue;
    const auto is_integer = [&](const std::string& word) {
      const auto type = scalar_of_word(word, skeleton_.binary);
      return type && !is_float(*type);
    };
    if (skeleton_.major_version() < 5) {
      each.type.clear();
    } else if (!is_integer(each.type) || !is_integer(each.second)) {
      each.type = each.second = "vtktypeint64";
    }
  }
}

void FilePlan::file_numbers(std::uint32_t block, std::span<const std::uint64_t> corners) {
  const int type = block_types_[block];
  if (type != kPolyhedron) {
    numbers_.assign(corners.begin(), corners.end());
    permute_corners(type, numbers_.data(), numbers_.size());
    return;
  }
  const auto cell = static_cast<std::int64_t>(cell_);
  while (next_polyhedron_ < polyhedra_.size() && polyhedra_[next_polyhedron_].cell < cell)
    ++next_polyhedron_;
  if (next_polyhedron_ == polyhedra_.size() || polyhedra_[next_polyhedron_].cell != cell)
    fail_extra("vtk/polyhedron/cells", "lacks cell " + std::to_string(cell_));
  const Polyhedron& faces = polyhedra_[next_polyhedron_];
  numbers_.assign(1, faces.faces);
  std::size_t corner = 0;
  for (std::uint64_t f = 0; f < faces.faces; ++f) {
    const auto size = static_cast<std::uint64_t>(face_sizes_[faces.first_size + f]);
    if (size > corners.size() - corner) break;
    numbers_.push_back(size);
    const auto from = corners.begin() + static_cast<std::ptrdiff_t>(corner);
    numbers_.insert(numbers_.end(), from, from + static_cast<std::ptrdiff_t>(size));
    corner += size;
  }
  if (corner != corners.size() || numbers_.size() != 1 + faces.faces + corner)
    fail_extra("vtk/polyhedron/face_sizes", "does not fit cell " + std::to_string(cell_));
}

}  // namespace shm::converters::vtk
