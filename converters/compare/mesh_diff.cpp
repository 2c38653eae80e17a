#include "compare/mesh_diff.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "accuracy/block_bounds.h"
#include "base/spool.h"
#include "compare/extras.h"
#include "compare/field_pairs.h"
#include "compare/mesh_match.h"
#include "compare/names.h"
#include "compare/pairs.h"
#include "compare/piecewise.h"
#include "compare/places.h"
#include "compare/values.h"
#include "formats/formats.h"
#include "interface/format.h"
#include "mesh/cell_cursor.h"
#include "mesh/cell_rotations.h"
#include "mesh/cell_store.h"

namespace shm::converters {
namespace {

MeshDiff::Counts counts_of(const MeshInfo& info) {
  return {info.vertices,
          info.cells(),
          info.schema.blocks.size(),
          info.schema.arrays.size(),
          info.step_times.size(),
          info.schema.source_format};
}

class Diff {
 public:
  Diff(MeshSource& a, MeshSource& b, const DiffOptions& options, Spool& spool,
       const Progress& progress)
      : mesh_a_(a),
        mesh_b_(b),
        a_(a.info()),
        b_(b.info()),
        options_(options),
        names_(options, a_, b_),
        spool_(spool),
        progress_(progress),
        one_format_(a_.schema.source_format == b_.schema.source_format),
        blocks_(pair_blocks(a_, b_, one_format_)) {}

  MeshDiff run() {
    result_.a = counts_of(a_);
    result_.b = counts_of(b_);
    compare_structure();
    steps_ = pair_steps(a_, b_, one_format_, times_likeness(), options_.limit, result_);
    const Likeness places = coordinates_likeness();
    if (options_.match) match(places.tolerant ? places.bound : 0);
    compare_coordinates(places);
    compare_cells();
    compare_fields();
    if (one_format_ && options_.with_extras) compare_extras();
    PlaceFinder(mesh_a_, mesh_b_).fill(result_);
    return std::move(result_);
  }

 private:
  void differ(Finding finding) { result_.differences.push_back(std::move(finding)); }
  void note(Finding finding) { result_.notes.push_back(std::move(finding)); }

  void compare_structure();
  void compare_blocks();
  void compare_types(const std::string& what, const std::string& a, const std::string& b,
                     bool tolerant);
  Likeness coordinates_likeness();
  Likeness times_likeness() const;
  void match(double tolerance);
  void add_unmatched(const char* element, const std::vector<std::uint32_t>& to, bool of_a);
  void compare_coordinates(const Likeness& likeness);
  void compare_cells();
  void compare_cell(std::uint64_t a, std::uint64_t b, const CellBatch& of_a, const CellBatch& of_b,
                    Finding& finding);
  void compare_fields();
  std::optional<CommonStrings> common_strings(const FieldPair& field) const;
  void compare_field(const FieldPair& field);
  ValueRange range_of(FieldReader& reader, const FieldPair& field);
  void compare_step(const StepPair& step, const FieldPair& field, FieldReader& a, FieldReader& b,
                    ValueScan& scan);
  void compare_uncovered(const StepPair& step, const FieldPair& field, FieldReader& a,
                         FieldReader& b, ValueScan& scan);
  void add_values(Finding finding, const std::function<double()>& range);
  void compare_extras();
  void not_compared(const std::string& what, const std::string& why) {
    differ({"not_compared", what, why});
  }

  // Returns true if the correspondence between the vertices (or cells) of A and B is known: either
  // they have been matched, or A and B have the same number of them, and equal numbers correspond.
  bool is_paired(Location location) const {
    return match_ || !is_on_mesh(location) ||
           (location == Location::point ? a_.vertices == b_.vertices : a_.cells() == b_.cells());
  }
  // Convert a vertex or cell of A to its counterpart in B, and back. Return nothing if no
  // counterpart exists.
  std::optional<std::uint64_t> to_b(Location location, std::uint64_t number) const {
    return match_ && is_on_mesh(location)
               ? through(location == Location::point ? match_->vertex : match_->cell, number)
               : number;
  }
  std::optional<std::uint64_t> to_a(Location location, std::uint64_t number) const {
    return match_ && is_on_mesh(location)
               ? through(location == Location::point ? match_->vertex_of_b : match_->cell_of_b,
                         number)
               : number;
  }
  static std::optional<std::uint64_t> through(const std::vector<std::uint32_t>& map,
                                              std::uint64_t number) {
    if (map[number] == MeshMatch::kNone) return std::nullopt;
    return map[number];
  }

  MeshSource &mesh_a_, &mesh_b_;
  const MeshInfo &a_, &b_;
  const DiffOptions& options_;
  DiffNames names_;
  Spool& spool_;
  const Progress& progress_;
  bool one_format_;
  BlockPairs blocks_;
  std::vector<StepPair> steps_;
  std::optional<MeshMatch> match_;
  MeshDiff result_;
};

void Diff::compare_structure() {
  if (!one_format_) note({"format", "format", a_.schema.source_format, b_.schema.source_format});
  const auto count = [&](const char* what, std::uint64_t a, std::uint64_t b) {
    if (a != b) differ({"count", what, std::to_string(a), std::to_string(b)});
  };
  count("vertices", a_.vertices, b_.vertices);
  count("cells", a_.cells(), b_.cells());
  compare_blocks();
}

void Diff::compare_blocks() {
  for (BlockPairs::Difference& difference : blocks_.differences) {
    Finding finding{difference.only_a   ? "only_in_a"
                    : difference.only_b ? "only_in_b"
                                        : "block",
                    difference.what, difference.a, difference.b};
    if (one_format_)
      differ(std::move(finding));
    else
      note(std::move(finding));
  }
}

// Reports that two scalar types differ. This is a difference only in an exact comparison of meshes
// of the same format. Otherwise it is a note, because not all formats support the same types.
void Diff::compare_types(const std::string& what, const std::string& a, const std::string& b,
                         bool tolerant) {
  Finding finding{"type", what, a, b};
  if (one_format_ && !tolerant)
    differ(std::move(finding));
  else
    note(std::move(finding));
}

Likeness Diff::times_likeness() const {
  const Accuracy& accuracy = options_.tolerance.fields;
  Likeness likeness{accuracy.kind != Accuracy::Kind::lossless, accuracy.bound};
  if (accuracy.kind == Accuracy::Kind::relative) {
    ValueRange range(1);
    range.add(reinterpret_cast<const std::byte*>(a_.step_times.data()), a_.step_times.size(),
              ScalarType::float64);
    likeness.bound *= range.overall();
  }
  return likeness;
}

Likeness Diff::coordinates_likeness() {
  const Accuracy accuracy = names_.accuracy_of_coordinates();
  Likeness likeness{accuracy.kind != Accuracy::Kind::lossless, accuracy.bound};
  if (accuracy.kind == Accuracy::Kind::relative)
    likeness.bound *= range_of_points(mesh_a_).largest_side();
  return likeness;
}

void Diff::match(double tolerance) {
  match_ = match_meshes(mesh_a_, mesh_b_, {blocks_.class_a, blocks_.class_b, tolerance}, progress_);
  result_.matched_vertices = match_->matched_vertices;
  result_.matched_cells = match_->matched_cells;
  add_unmatched("vertex", match_->vertex, true);
  add_unmatched("vertex", match_->vertex_of_b, false);
  add_unmatched("cell", match_->cell, true);
  add_unmatched("cell", match_->cell_of_b, false);
}

void Diff::add_unmatched(const char* element, const std::vector<std::uint32_t>& to, bool of_a) {
  const bool vertices = std::string_view(element) == "vertex";
  Finding finding{"unmatched",
                  std::string(vertices ? "vertices" : "cells") + (of_a ? " of A" : " of B")};
  finding.compared = to.size();
  for (std::uint64_t i = 0; i < to.size(); ++i) {
    if (to[i] != MeshMatch::kNone) continue;
    if (finding.different++ >= options_.limit) continue;
    DiffPlace place;
    place.element = element;
    (of_a ? place.a : place.b) = i;
    finding.places.push_back(std::move(place));
  }
  if (finding.different > 0) differ(std::move(finding));
}

// Adds the numbers of compared and different values in `finding` to the result. If any values
// differ, reports `finding` as a difference. `range` returns the range of A's values.
void Diff::add_values(Finding finding, const std::function<double()>& range) {
  result_.values_compared += finding.compared;
  result_.values_different += finding.different;
  if (finding.different == 0) return;
  const double whole = range();
  if (whole > 0 && std::isfinite(finding.largest)) finding.relative = finding.largest / whole;
  differ(std::move(finding));
}

void Diff::compare_coordinates(const Likeness& likeness) {
  const ScalarType type_a = a_.schema.coordinate_type, type_b = b_.schema.coordinate_type;
  if (names_.is_ignored("coordinates")) return;
  if (type_a != type_b)
    compare_types("coordinates", std::string(scalar_name(type_a)), std::string(scalar_name(type_b)),
                  likeness.tolerant);
  if (!is_paired(Location::point)) return not_compared("coordinates", "numbers of vertices differ");
  Finding finding{"coordinates", "coordinates"};
  ValueScan scan(finding, 3, type_a, type_b, likeness, options_.limit);
  const std::size_t stride_a = 3 * scalar_bytes(type_a), stride_b = 3 * scalar_bytes(type_b);
  PageCache cache(b_.vertices, stride_b, kCacheBytes,
                  [&](std::uint64_t first, std::uint64_t count, std::byte* out) {
                    mesh_b_.read_points(first, count, out);
                  });
  std::vector<std::byte> values_a, values_b;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> numbers;
  for (std::uint64_t first = 0; first < a_.vertices; first += kPieceElements) {
    const std::uint64_t count = std::min(kPieceElements, a_.vertices - first);
    values_a.resize(count * stride_a);
    values_b.resize(count * stride_b);
    mesh_a_.read_points(first, count, values_a.data());
    numbers.clear();
    for (std::uint64_t i = 0; i < count && match_; ++i) {
      const auto other = to_b(Location::point, first + i);
      if (!other) continue;
      const std::size_t kept = numbers.size();
      std::memmove(values_a.data() + kept * stride_a, values_a.data() + i * stride_a, stride_a);
      std::memcpy(values_b.data() + kept * stride_b, cache[*other], stride_b);
      numbers.emplace_back(first + i, *other);
    }
    if (!match_) mesh_b_.read_points(first, count, values_b.data());
    scan.compare(values_a.data(), values_b.data(), match_ ? numbers.size() : count,
                 [&](std::uint64_t i) {
                   DiffPlace place;
                   place.element = "vertex";
                   place.a = match_ ? numbers[i].first : first + i;
                   place.b = match_ ? numbers[i].second : first + i;
                   return place;
                 });
    if (progress_) progress_("coordinates", first + count, a_.vertices);
  }
  scan.finish();
  add_values(std::move(finding), [&] { return range_of_points(mesh_a_).largest_side(); });
}

void Diff::compare_cells() {
  if (!is_paired(Location::cell)) return not_compared("cells", "numbers of cells differ");
  Finding finding{"cells", "cells"};
  CellBatch one_a, one_b;
  const auto take = [](CellBatch& batch, const CellCursor& cursor) {
    batch.clear();
    batch.blocks.push_back(cursor.block());
    batch.corners.assign(cursor.corners().begin(), cursor.corners().end());
    batch.corner_begin.push_back(batch.corners.size());
  };
  CellStore store(spool_);
  if (match_)
    for (CellCursor cells(mesh_b_); cells.next();) store.append(cells.block(), cells.corners());
  CellCursor cells_a(mesh_a_), cells_b(mesh_b_);
  for (std::uint64_t cell = 0; cells_a.next(); ++cell) {
    const auto other = to_b(Location::cell, cell);
    if (!other) continue;
    if (match_) {
      one_b.clear();
      store.read(*other, one_b);
    } else {
      if (!cells_b.next()) break;
      take(one_b, cells_b);
    }
    take(one_a, cells_a);
    compare_cell(cell, *other, one_a, one_b, finding);
  }
  if (finding.different > 0) differ(std::move(finding));
}

void Diff::compare_cell(std::uint64_t a, std::uint64_t b, const CellBatch& of_a,
                        const CellBatch& of_b, Finding& finding) {
  ++finding.compared;
  const std::uint32_t block_a = of_a.blocks[0], block_b = of_b.blocks[0];
  bool same = of_a.corners == of_b.corners;
  std::vector<std::uint64_t> mapped;
  if (match_) {
    for (const std::uint64_t v : of_a.corners)
      mapped.push_back(to_b(Location::point, v).value_or(MeshMatch::kNone));
    same = is_rotated<std::uint64_t>(b_.schema.blocks[block_b].shape, mapped, of_b.corners);
  }
  const bool same_block = blocks_.class_a[block_a] == blocks_.class_b[block_b];
  if (same && same_block) return;
  if (finding.different++ >= options_.limit) return;
  DiffPlace place;
  place.element = "cell";
  place.a = a;
  place.b = b;
  if (!same) {
    place.value_a = "corners " + corners_text(of_a.corners);
    place.value_b = "corners " + corners_text(of_b.corners);
  }
  if (!same_block) {
    place.value_a = block_text(a_.schema.blocks[block_a]) + (same ? "" : ", ") + place.value_a;
    place.value_b = block_text(b_.schema.blocks[block_b]) + (same ? "" : ", ") + place.value_b;
  }
  finding.places.push_back(std::move(place));
}

void Diff::compare_fields() {
  const FieldPairs fields = pair_fields(a_, b_, one_format_, options_.with_roles);
  for (const std::string& path : fields.only_a)
    if (names_.is_wanted(path)) differ({"only_in_a", "array '" + path + "'"});
  for (const std::string& path : fields.only_b)
    if (names_.is_wanted(path)) differ({"only_in_b", "array '" + path + "'"});
  for (const FieldDifference& difference : fields.differences) {
    if (!names_.is_wanted(difference.path)) continue;
    const std::string what = "array '" + difference.path + "'";
    if (difference.is_type)
      compare_types(what, difference.a, difference.b,
                    names_.accuracy_of(difference.path).kind != Accuracy::Kind::lossless);
    else
      differ({"array", what, difference.a, difference.b});
  }
  for (const FieldPair& field : fields.pairs)
    if (names_.is_wanted(field.path)) compare_field(field);
}

ValueRange Diff::range_of(FieldReader& reader, const FieldPair& field) {
  ValueRange range(field.components);
  const std::uint64_t steps = field.a.per_step ? a_.step_times.size() : 1;
  std::vector<std::byte> values;
  for (std::uint64_t step = 0; step < steps; ++step)
    for (std::uint64_t first = 0; first < reader.elements(); first += kPieceElements) {
      const std::uint64_t count = std::min(kPieceElements, reader.elements() - first);
      values.resize(count * reader.stride());
      reader.read(step, first, count, values.data());
      range.add(values.data(), count, reader.type());
    }
  return range;
}

// Returns the common list of strings for the two arrays of a field, if the values of both are
// indices into lists of strings. Otherwise returns nothing.
std::optional<CommonStrings> Diff::common_strings(const FieldPair& field) const {
  if (field.a.parts.empty() || field.b.parts.empty()) return std::nullopt;
  const std::size_t a = field.a.parts.front().array, b = field.b.parts.front().array;
  const auto has_strings = [](const MeshInfo& info, std::size_t array) {
    return array < info.schema.arrays.size() &&
           source_format(info).has_strings(info.schema.arrays[array]);
  };
  if (!has_strings(a_, a) || !has_strings(b_, b)) return std::nullopt;
  return CommonStrings(a_, a, b_, b);
}

void Diff::compare_field(const FieldPair& field) {
  const std::string what = "array '" + field.path + "'";
  if (!is_paired(field.location))
    return not_compared(what, field.location == Location::point ? "numbers of vertices differ"
                                                                : "numbers of cells differ");
  FieldReader a(mesh_a_, field, field.a, spool_), b(mesh_b_, field, field.b, spool_);
  const auto strings = common_strings(field);
  if (strings) {
    a.translate_by(*strings, true);
    b.translate_by(*strings, false);
  }
  const Accuracy accuracy = names_.accuracy_of(field.path);
  Likeness likeness{accuracy.kind != Accuracy::Kind::lossless, accuracy.bound};
  if (accuracy.kind == Accuracy::Kind::relative) likeness.bound *= range_of(a, field).overall();
  Finding finding{"values", what};
  ValueScan scan(finding, field.components, field.a.type, field.b.type, likeness, options_.limit);
  if (strings) scan.show_strings(*strings);
  for (const StepPair& step : steps_of(field, steps_, a_.step_times.size(), b_.step_times.size()))
    compare_step(step, field, a, b, scan);
  scan.finish();
  add_values(std::move(finding), [&] { return range_of(a, field).overall(); });
}

// Compares the values of a field on the vertices or cells of A with those on the corresponding
// vertices or cells of B.
void Diff::compare_step(const StepPair& step, const FieldPair& field, FieldReader& a,
                        FieldReader& b, ValueScan& scan) {
  const bool as_they_are = !match_ && a.covers_all() && b.covers_all();
  PageCache cache(b.elements(), b.stride(), kCacheBytes,
                  [&](std::uint64_t first, std::uint64_t count, std::byte* out) {
                    b.read(step.b, first, count, out);
                  });
  std::vector<std::byte> values_a, values_b, alone;
  std::vector<std::uint64_t> entities, compared, without;
  for (std::uint64_t first = 0; first < a.elements(); first += kPieceElements) {
    const std::uint64_t count = std::min(kPieceElements, a.elements() - first);
    values_a.resize(count * a.stride());
    values_b.resize(count * b.stride());
    a.read(step.a, first, count, values_a.data());
    a.entities(first, count, entities);
    alone.clear();
    without.clear();
    if (as_they_are) {
      b.read(step.b, first, count, values_b.data());
      compared = entities;
    } else {
      compared.clear();
      for (std::uint64_t i = 0; i < count; ++i) {
        const auto other = to_b(field.location, entities[i]);
        if (!other) continue;
        const std::byte* value = values_a.data() + i * a.stride();
        if (const auto element = b.element_of(*other)) {
          std::memmove(values_a.data() + compared.size() * a.stride(), value, a.stride());
          std::memcpy(values_b.data() + compared.size() * b.stride(), cache[*element], b.stride());
          compared.push_back(entities[i]);
        } else if (!one_format_) {
          alone.insert(alone.end(), value, value + a.stride());
          without.push_back(entities[i]);
        }
      }
    }
    const auto place_in = [&](const std::vector<std::uint64_t>& list) {
      return [&](std::uint64_t i) {
        return place_of(step, field, list[i], *to_b(field.location, list[i]), a_, b_);
      };
    };
    scan.compare(values_a.data(), values_b.data(), compared.size(), place_in(compared));
    scan.compare_with_none(alone.data(), true, without.size(), place_in(without));
    if (progress_) progress_("array " + field.path, first + count, a.elements());
  }
  if (!one_format_ && !a.covers_all()) compare_uncovered(step, field, a, b, scan);
}

// Checks the vertices or cells that have values of the field in B but not in A. If the formats
// differ, these values should be NaN or zero, because one format may not support fields that cover
// only some blocks.
void Diff::compare_uncovered(const StepPair& step, const FieldPair& field, FieldReader& a,
                             FieldReader& b, ValueScan& scan) {
  std::vector<std::byte> values;
  std::vector<std::uint64_t> entities;
  for (std::uint64_t first = 0; first < b.elements(); first += kPieceElements) {
    const std::uint64_t count = std::min(kPieceElements, b.elements() - first);
    values.resize(count * b.stride());
    b.read(step.b, first, count, values.data());
    b.entities(first, count, entities);
    for (std::uint64_t i = 0; i < count; ++i) {
      const auto other = to_a(field.location, entities[i]);
      if (!other || a.element_of(*other)) continue;
      scan.compare_with_none(values.data() + i * b.stride(), false, 1, [&](std::uint64_t) {
        return place_of(step, field, *other, entities[i], a_, b_);
      });
    }
  }
}

void Diff::compare_extras() {
  ExtrasComparison how;
  how.is_ignored = [&](const std::string& key) {
    // Lists of strings are compared together with the arrays that refer to them, not as extras.
    // Bounds of blocks describe a .shm file, and are not data of the mesh.
    return source_format(a_).is_list_of_strings(key) || is_block_bounds(key) ||
           names_.is_ignored_extra(key);
  };
  how.accuracy = options_.tolerance.fields;
  how.in_any_order = options_.match;
  how.limit = options_.limit;
  if (match_) {
    constexpr std::uint64_t kNowhere = std::numeric_limits<std::int32_t>::max();
    how.to_b.vertices = a_.vertices;
    how.to_b.cells = a_.cells();
    how.to_b.vertex = [&](std::uint64_t v) { return to_b(Location::point, v).value_or(kNowhere); };
    how.to_b.cell = [&](std::uint64_t c) { return to_b(Location::cell, c).value_or(kNowhere); };
  }
  for (Finding& finding : diff_extras(a_.extras, b_.extras, how)) differ(std::move(finding));
}

}  // namespace

MeshDiff diff_meshes(MeshSource& a, MeshSource& b, const DiffOptions& options, Spool& spool,
                     const Progress& progress) {
  return Diff(a, b, options, spool, progress).run();
}

}  // namespace shm::converters
