#include "vtk/legacy/plan.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "base/failure.h"
#include "vtk/between/field_data.h"
#include "vtk/between/vtk_from_vtu.h"
#include "vtk/strings.h"
#include "vtk/values.h"

namespace shm::converters::vtk {
namespace {

// Largest point number or count that a list of cells may contain in a binary file up to version
// 4.x. Such files store these numbers as 32-bit integers.
constexpr std::uint64_t kMostClassic = std::numeric_limits<std::int32_t>::max();

}  // namespace

FilePlan::FilePlan(MeshSource& mesh) : CellPlan(mesh) {
  const Extra* text = info_.schema.source_format == "vtk" ? extra("vtk/skeleton") : nullptr;
  if (text != nullptr) {
    plan_from_source(*text);
  } else {
    plan_for_foreign();
  }
  add_missing_parts();
  check_lists();
  add_unplaced_arrays();
  choose_layout();
  set_old_numbering(skeleton_.version < kNewNumberingInLegacy);
}

// Throws Failure if the skeleton contains a cell list (CELLS, POLYGONS, ...) twice, or a cell list
// that its kind of data set cannot have.
void FilePlan::check_lists() const {
  std::set<EntryKind> listed;
  for (const Entry& each : skeleton_.entries) {
    if (!lists_cells(each.kind)) continue;
    const bool known = std::any_of(lists_.begin(), lists_.end(),
                                   [&](const CellList& list) { return list.kind == each.kind; });
    if (!known || !listed.insert(each.kind).second)
      fail_extra("vtk/skeleton",
                 "the stored structure has the same list of cells twice, or a list that its data "
                 "set cannot have");
  }
}

// Returns the list of cells of kind `kind`. The file must have such a list.
const FilePlan::CellList& FilePlan::cell_list(EntryKind kind) const {
  return *std::find_if(lists_.begin(), lists_.end(),
                       [&](const CellList& list) { return list.kind == kind; });
}

void FilePlan::plan_from_source(const Extra& text) {
  const auto* begin = reinterpret_cast<const char*>(text.data.data());
  auto parsed = parse_skeleton({begin, text.data.size()});
  if (!parsed) fail_extra(text.key, "the stored structure of the VTK file is invalid");
  skeleton_ = std::move(*parsed);
  settle_dataset();
  Location location = Location::point;
  std::erase_if(skeleton_.entries, [&](const Entry& each) {
    if (each.kind == EntryKind::cell_data) location = Location::cell;
    if (each.kind == EntryKind::point_data) location = Location::point;
    return each.origin == Origin::array && !place_array(each, location);
  });
  add_missing_time();
}

// Changes the data set to an unstructured grid if the original data set can no longer express the
// mesh: if the mesh was renumbered, so that the dimensions do not determine its points and cells,
// or if cells of polygonal data moved to another list.
void FilePlan::settle_dataset() {
  if (skeleton_.dataset == Dataset::unstructured_grid) return;
  if (is_lattice(skeleton_.dataset) ? plan_lattice() : plan_polydata()) return;
  skeleton_.dataset = Dataset::unstructured_grid;
  lists_.clear();
  std::erase_if(skeleton_.entries, [](const Entry& each) {
    return plain_words(each.kind) > 0 || each.kind >= EntryKind::x_coordinates ||
           (lists_cells(each.kind) && each.kind != EntryKind::cells);
  });
}

bool FilePlan::plan_lattice() {
  std::optional<Lattice> lattice;
  for (const Entry& each : skeleton_.entries)
    if (each.kind == EntryKind::dimensions || each.kind == EntryKind::extent)
      lattice = lattice_of(each);
  if (!lattice) fail_extra("vtk/skeleton", "has no valid dimensions");
  if (!is_lattice_of(*lattice)) return false;
  if (skeleton_.dataset == Dataset::structured_grid) return true;
  std::string problem;
  const auto points = lattice_points_of(
      skeleton_, [&](const std::string& key) { return extra(key); }, problem);
  if (!points) fail_extra("vtk/skeleton", problem);
  return has_points_of(*lattice, *points);
}

// Returns true if the cells of the mesh are exactly the cells that the dimensions determine, in the
// same order.
bool FilePlan::is_lattice_of(const Lattice& lattice) {
  if (lattice.points() != info_.vertices || lattice.cells() != info_.cells()) return false;
  std::uint64_t cell = 0;
  bool same = true;
  Lattice expected = lattice;
  for_each_batch([&](const CellBatch& batch) {
    for (std::size_t i = 0; i < batch.size() && same; ++i, ++cell) {
      const auto found = batch.cell(i);
      const auto corners = expected.corners(cell);
      same = std::equal(found.begin(), found.end(), corners.begin(), corners.end());
    }
  });
  return same;
}

// Returns true if the points of the mesh are those that the axes determine. Rounded points are not
// compared, because the axes determine the exact points.
bool FilePlan::has_points_of(const Lattice& lattice, const LatticePoints& points) {
  if (points.type != info_.schema.coordinate_type) return false;
  if (info_.schema.coordinate_quantization.lossy()) return true;
  const std::size_t bytes = 3 * scalar_bytes(points.type);
  std::vector<std::byte> found(kBatchCells * bytes), expected(kBatchCells * bytes);
  for (std::uint64_t first = 0; first < info_.vertices; first += kBatchCells) {
    const std::uint64_t count = std::min<std::uint64_t>(kBatchCells, info_.vertices - first);
    mesh_.read_points(first, count, found.data());
    points.read(lattice, first, count, expected.data());
    if (std::memcmp(found.data(), expected.data(), count * bytes) != 0) return false;
  }
  return true;
}

// Returns true if the mesh can be written as polygonal data: its cells are grouped by list, in
// VTK's order of the lists, and each cell has a type that its list allows.
bool FilePlan::plan_polydata() {
  std::uint64_t first = 0;
  for (const EntryKind kind :
       {EntryKind::vertices, EntryKind::lines, EntryKind::polygons, EntryKind::triangle_strips}) {
    std::uint64_t cells = 0;
    for (const Entry& each : skeleton_.entries)
      if (each.kind == kind) cells = each.tuples;
    if (cells > info_.cells() - first) return false;
    lists_.push_back({kind, first, cells, 0});
    first += cells;
  }
  if (first != info_.cells()) return false;
  bool fits = true;
  std::uint64_t cell = 0;
  auto list = lists_.begin();
  for_each_batch([&](const CellBatch& batch) {
    for (std::size_t i = 0; i < batch.size() && fits; ++i, ++cell) {
      while (cell - list->first >= list->cells) ++list;
      fits = block_type(batch.blocks[i]) == cell_type_in(list->kind, batch.cell(i).size());
    }
  });
  return fits;
}

// Checks that the mesh array to which a skeleton entry refers can be written, and records that the
// skeleton contains it. Returns false if the array is missing, if its location, type or size
// differs from the entry, or if an earlier entry already has the same array and role.
bool FilePlan::place_array(const Entry& entry, Location location) {
  if (entry.index >= info_.schema.arrays.size()) return false;
  const ArrayInfo& array = info_.schema.arrays[entry.index];
  const ValueForm form = form_of_word(entry.type);
  if (form == ValueForm::string || form == ValueForm::variant) {
    if (array.role != kStringRole || array.per_step) return false;
  } else if (!is_written(entry.index)) {
    return false;
  }
  const std::uint64_t fixed = fixed_components(entry.kind);
  const std::uint64_t tuples = location == Location::cell ? info_.cells() : info_.vertices;
  const bool fits = array.location == location && entry.components == array.components &&
                    entry.tuples == tuples && (fixed == 0 || fixed == array.components) &&
                    (form == ValueForm::number || array.blocks.empty()) &&
                    array_type_of_word(entry.type, skeleton_.binary) == array.type;
  if (!fits || !roles_.emplace(entry.index, entry.kind).second) return false;
  placed_.insert(entry.index);
  return true;
}

bool FilePlan::is_written(std::size_t array) const {
  const ArrayInfo& info = info_.schema.arrays[array];
  return info.role.empty() && (!info.per_step || !info_.step_times.empty());
}

void FilePlan::add_unplaced_arrays() {
  for (const Location location : {Location::cell, Location::point}) {
    std::vector<Entry> arrays;
    for (std::size_t i = 0; i < info_.schema.arrays.size(); ++i)
      if (info_.schema.arrays[i].location == location && is_written(i) && !placed_.contains(i))
        arrays.push_back(entry_of_array(info_, i));
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
  const Dataset dataset = skeleton_.dataset;
  if (!is_lattice(dataset) || dataset == Dataset::structured_grid)
    add(EntryKind::points, std::string(word_of_scalar(info_.schema.coordinate_type)));
  if (dataset != Dataset::unstructured_grid) return;
  if (info_.cells() > 0) add(EntryKind::cells, {});
  lists_ = {CellList{EntryKind::cells, 0, info_.cells(), 0}};
}

void FilePlan::plan_for_foreign() {
  if (info_.schema.source_format == "vtu" && extra("vtu/skeleton") != nullptr) {
    LegacyParts parts = legacy_of_xml(info_, nullptr);
    skeleton_ = std::move(parts.skeleton);
    placed_ = std::move(parts.placed);
    made_ = std::move(parts.made);
    made_.register_in(extras_);
    return;
  }
  if (extra(kNewNumbering) != nullptr || makes_lagrange_cells())
    skeleton_.version = kNewNumberingInLegacy;
  if (const Extra* title = extra("mesh/title")) set_title(*title);
  if (!info_.step_times.empty()) skeleton_.entries = time_entries(0);
  for (std::size_t i = 0; i < info_.schema.arrays.size(); ++i)
    if (info_.schema.arrays[i].location == Location::global && is_written(i))
      skeleton_.entries.push_back(entry_of_array(info_, i));
  add_block_names();
  add_missing_parts();
  add_block_ids();
}

// Returns skeleton entries for a new FIELD with one array, which contains the time of the final
// step. Stores the time as the extra vtk/data/<index>; this key must be unused.
std::vector<Entry> FilePlan::time_entries(std::size_t index) {
  time_ = Extra{data_key(index), ScalarType::float64, Reference::nothing, {1, 1}, {}};
  time_.data.resize(sizeof(double));
  std::memcpy(time_.data.data(), &info_.step_times.back(), sizeof(double));
  extras_[time_.key] = &time_;
  return {{.kind = EntryKind::field, .name = "FieldData"},
          {.kind = EntryKind::array,
           .origin = Origin::extra,
           .index = index,
           .name = std::string(kLegacyTime),
           .type = "double",
           .components = 1,
           .tuples = 1}};
}

// Adds the time of the final step if the skeleton does not contain a time, for example because the
// source is a series of files whose times are in a collection file. If the data set already has a
// field, the time becomes an array of the first field, because readers keep only one field.
void FilePlan::add_missing_time() {
  auto& entries = skeleton_.entries;
  const auto end = std::find_if(entries.begin(), entries.end(), [](const Entry& each) {
    return each.kind == EntryKind::point_data || each.kind == EntryKind::cell_data;
  });
  const bool has_time = std::any_of(entries.begin(), end, [](const Entry& each) {
    return each.kind == EntryKind::array && each.name == kLegacyTime;
  });
  if (info_.step_times.empty() || has_time) return;
  std::size_t index = 0;
  while (extra(data_key(index)) != nullptr) ++index;
  const std::vector<Entry> added = time_entries(index);
  const auto field = std::find_if(entries.begin(), end,
                                  [](const Entry& each) { return each.kind == EntryKind::field; });
  if (field == end)
    entries.insert(entries.begin(), added.begin(), added.end());
  else
    entries.insert(field + 1, added.back());
}

// Sets the title of the file. VTK's readers accept a title of one line with at most 255 bytes.
void FilePlan::set_title(const Extra& title) {
  constexpr std::size_t kLongest = 255;
  const auto* begin = reinterpret_cast<const char*>(title.data.data());
  skeleton_.title.assign(begin, std::min(title.data.size(), kLongest));
  for (char& c : skeleton_.title)
    if (c == '\n' || c == '\r' || c == '\0') c = ' ';
}

void FilePlan::add_block_names() {
  names_ = block_names_extra(info_, data_key(1), StringForm::lengths);
  if (names_.shape[0] == 0) return;
  extras_[names_.key] = &names_;
  if (skeleton_.entries.empty())
    skeleton_.entries.push_back({.kind = EntryKind::field, .name = "FieldData"});
  skeleton_.entries.push_back({.kind = EntryKind::array,
                               .origin = Origin::extra,
                               .index = 1,
                               .name = kBlockNames,
                               .type = "string",
                               .components = 1,
                               .tuples = names_.shape[0]});
}

// Adds an array with the block ids of a mesh from another format, because a VTK file stores only
// the type of each cell, not its block.
void FilePlan::add_block_ids() {
  const auto& blocks = info_.schema.blocks;
  // No array is needed for a mesh that came from VTK, because its block ids are cell types.
  if (info_.schema.source_format.starts_with("vt")) return;
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

// Counts the integers that the file stores for all cells. Chooses the layout of version 5.x if the
// layout of older versions, which is limited to 32-bit numbers, cannot store the cells.
void FilePlan::choose_layout() {
  bool all_fixed = !has_polyhedra() && lists_.size() == 1;
  std::uint64_t all_numbers = 0;
  for (std::size_t b = 0; b < info_.schema.blocks.size(); ++b) {
    const std::uint32_t nodes = info_.schema.blocks[b].nodes_per_cell;
    all_fixed &= nodes > 0 || info_.block_cells[b] == 0;
    all_numbers += nodes * info_.block_cells[b];
  }
  bool too_large = info_.vertices > kMostClassic;
  for (CellList& list : lists_) {
    if (all_fixed) {
      list.numbers = all_numbers;
    } else {
      for_each_cell_of(list, [&](const auto& numbers) { list.numbers += numbers.size(); });
    }
    too_large |= list.numbers + list.cells > kMostClassic;
  }
  if (skeleton_.major_version() < 5 && skeleton_.binary && too_large && !lists_.empty())
    skeleton_.version = "5.1";
  for (Entry& each : skeleton_.entries) {
    if (!lists_cells(each.kind)) continue;
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

}  // namespace shm::converters::vtk
