#include "compare/compare.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "accuracy/block_bounds.h"
#include "base/spool.h"
#include "base/stored_value.h"
#include "compare/extras.h"
#include "compare/piecewise.h"
#include "mesh/cell_cursor.h"
#include "mesh/cell_store.h"

namespace shm::converters {
namespace {

// A sequence of values that both meshes have: the coordinates, or an array at one step.
struct Column {
  std::string name;     // "coordinates" or "array 'T'"
  std::string what;     // name and step, e.g. "array 'T', step 3"
  std::string element;  // "vertex", "cell" or "element"
  ScalarType type;
  std::uint32_t components;
  std::uint64_t elements;
  Quantization quantization;
  std::vector<double> fills;
  PageCache::Fetch source, restored;
};

class Comparison {
 public:
  // `spooled` receives the renumbered copy of the source, which is created when it is first needed.
  Comparison(MeshSource& source, MeshSource& restored, Spool& spool, const Progress& progress,
             const CellSequence* given_order, bool with_steps,
             std::unique_ptr<SpooledSource>& spooled)
      : source_(&source),
        restored_(&restored),
        progress_(progress),
        with_steps_(with_steps),
        numbers_(source, restored, spool, progress, given_order, spooled) {}

  // Compares the meshes. If they may number vertices and cells differently, assumes the candidate
  // renumbering with index `guess`.
  CompareReport run(std::size_t guess) {
    compare_structure();
    if (!same_counts_) return std::move(report_);
    const Schema& schema = restored_->info().schema;
    if (numbers_.is_wanted()) numbers_.take(guess);
    source_ = &numbers_.source();
    compare_points();
    compare_cells();
    bounds_ = block_bounds_in(restored_->info());
    if (same_arrays_ && has_any(bounds_))
      rounded_ = std::make_unique<RoundedMesh>(*source_, bounds_, schema);
    const std::vector<std::string> names = array_names(schema);
    for (std::size_t a = 0; same_arrays_ && a < schema.arrays.size(); ++a)
      if (with_steps_ || !schema.arrays[a].per_step) compare_array(a, names[a]);
    if (with_steps_) compare_extras();
    return std::move(report_);
  }
  // Returns the object that searches for the renumbering. Its current candidate is the one that
  // run() used. Precondition: run() has been called.
  const NumberingSearch& numbers() const { return numbers_; }

 private:
  void differ(const std::string& sentence) {
    if (report_.differences++ < kDifferencesInWords) report_.first.push_back(sentence);
  }
  void differ(const std::string& where, const std::string& source, const std::string& restored,
              const std::string& remark = {}) {
    differ(where + ": " + source + " in the source, " + restored + " in the restored mesh" +
           remark);
  }
  bool same_count(const std::string& what, std::uint64_t source, std::uint64_t restored) {
    if (source == restored) return true;
    differ("number of " + what, std::to_string(source), std::to_string(restored));
    return false;
  }

  void compare_structure();
  void compare_block_lists();
  void compare_array_lists();
  void compare_points();
  void compare_cells();
  void compare_cell(std::uint64_t number, std::uint32_t source_block,
                    std::span<const std::uint64_t> source_corners, std::uint32_t block,
                    std::span<const std::uint64_t> corners);
  void compare_array(std::size_t array, const std::string& name);
  static std::vector<std::string> array_names(const Schema& schema);
  void compare_column(const Column& column, NumberList* order);
  void compare_values(const Column& column, std::uint64_t first, std::uint64_t count,
                      const std::byte* source, const std::byte* restored, MeasuredError* measured);
  static void measure(double value, double error, MeasuredError& measured);
  MeasuredError* measured_error(const Column& column);
  void compare_extras();
  void compare_extra(const Extra& source, const Extra& restored);

  MeshSource* source_;
  MeshSource* restored_;
  const Progress& progress_;
  bool with_steps_;  // false: compare only data that does not change with time
  NumberingSearch numbers_;
  CompareReport report_;
  bool same_counts_ = true, same_arrays_ = true;
  // Bounds of blocks that the restored mesh records, and the source rounded within these bounds.
  BlockBounds bounds_;
  std::unique_ptr<RoundedMesh> rounded_;
};

void Comparison::compare_structure() {
  const MeshInfo& a = source_->info();
  const MeshInfo& b = restored_->info();
  if (a.schema.source_format != b.schema.source_format)
    differ("source format", a.schema.source_format, b.schema.source_format);
  if (a.schema.coordinate_type != b.schema.coordinate_type) {
    differ("coordinate type", std::string(scalar_name(a.schema.coordinate_type)),
           std::string(scalar_name(b.schema.coordinate_type)));
    same_counts_ = false;
  }
  same_counts_ &= same_count("vertices", a.vertices, b.vertices);
  same_counts_ &= same_count("cells", a.cells(), b.cells());
  compare_block_lists();
  compare_array_lists();
  if (!with_steps_) return;
  if (!same_count("time steps", a.step_times.size(), b.step_times.size())) {
    same_arrays_ = false;
  } else {
    for (std::size_t s = 0; s < a.step_times.size(); ++s)
      if (std::memcmp(&a.step_times[s], &b.step_times[s], sizeof(double)) != 0)
        differ("time of step " + std::to_string(s), number_text(a.step_times[s]),
               number_text(b.step_times[s]));
  }
}

void Comparison::compare_block_lists() {
  const MeshInfo& a = source_->info();
  const MeshInfo& b = restored_->info();
  if (!same_count("blocks", a.schema.blocks.size(), b.schema.blocks.size())) {
    same_counts_ = false;
    return;
  }
  const auto text = [](const BlockInfo& block) {
    return "id " + std::to_string(block.id) + ", '" + block.name + "', " + kind_of_cells(block) +
           " of " + std::to_string(block.nodes_per_cell);
  };
  for (std::size_t i = 0; i < a.schema.blocks.size(); ++i) {
    if (a.schema.blocks[i] != b.schema.blocks[i])
      differ("block " + std::to_string(i), text(a.schema.blocks[i]), text(b.schema.blocks[i]));
    same_counts_ &=
        same_count("cells of block " + std::to_string(i), a.block_cells[i], b.block_cells[i]);
  }
}

void Comparison::compare_array_lists() {
  const auto& a = source_->info().schema.arrays;
  const auto& b = restored_->info().schema.arrays;
  if (!same_count("arrays", a.size(), b.size())) {
    same_arrays_ = false;
    return;
  }
  const auto text = [](const ArrayInfo& array) {
    return "'" + array.name + "' (" + std::string(location_name(array.location)) + " data, " +
           std::to_string(array.components) + " x " + std::string(scalar_name(array.type)) +
           (array.per_step ? " per step" : "") + (array.role.empty() ? "" : ", " + array.role) +
           ", on " + (array.blocks.empty() ? "all" : std::to_string(array.blocks.size())) +
           " blocks" +
           (is_on_mesh(array.location) ? "" : ", " + std::to_string(array.elements) + " elements") +
           ")";
  };
  for (std::size_t i = 0; i < a.size(); ++i) {
    ArrayInfo plain = b[i];
    plain.quantization = a[i].quantization;
    plain.fills = a[i].fills;
    if (a[i] == plain) continue;
    differ("array " + std::to_string(i), text(a[i]), text(b[i]));
    same_arrays_ = false;
  }
}

void Comparison::compare_points() {
  const MeshInfo& info = restored_->info();
  Column column{"coordinates",
                "coordinates",
                "vertex",
                info.schema.coordinate_type,
                3,
                info.vertices,
                info.schema.coordinate_quantization,
                {},
                [&](std::uint64_t first, std::uint64_t count, std::byte* out) {
                  source_->read_points(first, count, out);
                },
                [&](std::uint64_t first, std::uint64_t count, std::byte* out) {
                  restored_->read_points(first, count, out);
                }};
  compare_column(column, numbers_.vertices());
}

void Comparison::compare_cells() {
  const std::uint64_t cells = restored_->info().cells();
  CellCursor restored(*restored_);
  if (numbers_.cells() == nullptr) {
    CellCursor source(*source_);
    for (std::uint64_t i = 0; i < cells && source.next() && restored.next(); ++i)
      compare_cell(i, source.block(), source.corners(), restored.block(), restored.corners());
    return;
  }
  CellStore store(numbers_.spool());
  for (CellCursor source(*source_); source.next();) store.append(source.block(), source.corners());
  CellBatch one;
  numbers_.cells()->for_each([&](std::uint64_t position, std::uint64_t number) {
    if (!restored.next()) return;
    one.clear();
    store.read(number, one);
    compare_cell(position, one.blocks[0], one.cell(0), restored.block(), restored.corners());
  });
}

void Comparison::compare_cell(std::uint64_t number, std::uint32_t source_block,
                              std::span<const std::uint64_t> source_corners, std::uint32_t block,
                              std::span<const std::uint64_t> corners) {
  if (source_block != block)
    return differ("block of cell " + std::to_string(number), std::to_string(source_block),
                  std::to_string(block));
  if (!numbers_.same_corners(source_corners, corners, block))
    differ("corners of cell " + std::to_string(number), numbers_.corners_text(source_corners),
           numbers_.corners_text(numbers_.mapped_corners()));
}

void Comparison::compare_array(std::size_t array, const std::string& name) {
  const MeshInfo& info = restored_->info();
  const ArrayInfo& data = info.schema.arrays[array];
  NumberList* order = numbers_.elements(array);
  const std::uint64_t steps = data.per_step ? info.step_times.size() : 1;
  for (std::uint64_t step = 0; step < steps; ++step) {
    const auto from = [array, step](MeshSource* mesh) {
      return [=](std::uint64_t first, std::uint64_t count, std::byte* out) {
        mesh->read_array(array, step, first, count, out);
      };
    };
    std::string what = name;
    if (data.per_step) what += ", step " + std::to_string(step);
    const char* element = data.location == Location::point                         ? "vertex"
                          : data.location == Location::cell && data.blocks.empty() ? "cell"
                                                                                   : "element";
    Column column{name,
                  std::move(what),
                  element,
                  data.type,
                  data.components,
                  info.array_elements(array),
                  data.quantization,
                  data.fills,
                  from(source_),
                  from(restored_)};
    if (!bounds_[array].empty()) {
      // The source, rounded in the same way, must be equal. The error is measured as well.
      column.source = from(rounded_.get());
      compare_column(column, order);
      column.source = from(source_);
      const double most = *std::max_element(bounds_[array].begin(), bounds_[array].end());
      if (!(most > 0)) continue;
      column.quantization = Quantization::absolute(most, data.components);
    }
    compare_column(column, order);
  }
}

// Returns names such as "array 'T'", or "array 'point/T'" if several arrays are called T.
std::vector<std::string> Comparison::array_names(const Schema& schema) {
  constexpr std::string_view kPrefix = "array:";
  std::map<std::string_view, std::size_t> same;
  for (const ArrayInfo& array : schema.arrays) ++same[array.name];
  std::vector<std::string> names = array_stream_names(schema);
  for (std::size_t a = 0; a < names.size(); ++a) {
    const std::string& name = schema.arrays[a].name;
    names[a] = "array '" + (same[name] == 1 ? name : names[a].substr(kPrefix.size())) + "'";
  }
  return names;
}

MeasuredError* Comparison::measured_error(const Column& column) {
  if (!column.quantization.lossy()) return nullptr;
  for (MeasuredError& entry : report_.measured)
    if (entry.what == column.name) return &entry;
  report_.measured.push_back({column.name, 0, column.quantization.max_error(column.type)});
  report_.measured.back().promised_relative = column.quantization.max_rel;
  return &report_.measured.back();
}

// Compares the values of a column (the coordinates, or an array at one step) in the source and in
// the restored mesh. Element i of the restored mesh is element `order[i]` of the source, or element
// i if `order` is null.
void Comparison::compare_column(const Column& column, NumberList* order) {
  const std::size_t stride = column.components * scalar_bytes(column.type);
  MeasuredError* measured = measured_error(column);
  std::vector<std::byte> source, restored;
  std::vector<std::uint64_t> numbers;
  PageCache cache(column.elements, stride, numbers_.cache_bytes(), column.source);
  for (std::uint64_t first = 0; first < column.elements; first += kPieceElements) {
    const std::uint64_t count = std::min(kPieceElements, column.elements - first);
    source.resize(count * stride);
    restored.resize(count * stride);
    column.restored(first, count, restored.data());
    if (order == nullptr) {
      column.source(first, count, source.data());
    } else {
      order->read(first, count, numbers);
      for (std::uint64_t i = 0; i < count; ++i)
        std::memcpy(source.data() + i * stride, cache[numbers[i]], stride);
    }
    if (measured != nullptr || source != restored)
      compare_values(column, first, count, source.data(), restored.data(), measured);
    if (progress_) progress_(column.what, first + count, column.elements);
  }
}

void Comparison::measure(double value, double error, MeasuredError& measured) {
  if (measured.values++ == 0) measured.minimum = measured.maximum = value;
  measured.minimum = std::min(measured.minimum, value);
  measured.maximum = std::max(measured.maximum, value);
  measured.largest = std::max(measured.largest, error);
  measured.squares += error * error;
  if (measured.promised_relative > 0 && error > 0)
    measured.largest_relative = std::max(measured.largest_relative, error / std::fabs(value));
}

void Comparison::compare_values(const Column& column, std::uint64_t first, std::uint64_t count,
                                const std::byte* source, const std::byte* restored,
                                MeasuredError* measured) {
  const std::size_t bytes = scalar_bytes(column.type);
  for (std::uint64_t i = 0; i < count * column.components; ++i) {
    const std::byte* a = source + i * bytes;
    const std::byte* b = restored + i * bytes;
    const double value = as_double(a, column.type);
    const double error = std::fabs(value - as_double(b, column.type));
    const bool is_fill = is_fill_value(column.fills, value);
    const bool is_measured = measured != nullptr && std::isfinite(error) && !is_fill;
    if (is_measured) measure(value, error, *measured);
    if (std::memcmp(a, b, bytes) == 0) continue;
    double allowed = 0;
    if (is_measured)
      allowed = measured->promised_relative > 0 ? measured->promised_relative * std::fabs(value)
                                                : measured->promised;
    if (is_measured && error <= allowed) continue;
    std::string broken;
    if (is_measured)
      broken = "; error " + number_text(error) + ", allowed " + number_text(allowed);
    else if (is_fill)
      broken = "; a fill value must not change";
    std::string where =
        column.what + ", " + column.element + " " + std::to_string(first + i / column.components);
    if (column.components > 1) where += ", component " + std::to_string(i % column.components);
    differ(where, value_text(a, column.type), value_text(b, column.type), broken);
  }
}

void Comparison::compare_extras() {
  const Renumbering to = numbers_.to_restored();
  const auto source = sorted_by_key(source_->info().extras);
  const auto restored = sorted_by_key(restored_->info().extras);
  auto a = source.begin();
  auto b = restored.begin();
  while (a != source.end() || b != restored.end()) {
    if (b == restored.end() || (a != source.end() && (*a)->key < (*b)->key)) {
      differ("extra '" + (*a)->key + "' is missing from the restored mesh");
      ++a;
    } else if (a == source.end() || (*b)->key < (*a)->key) {
      if (!is_block_bounds((*b)->key)) differ("extra '" + (*b)->key + "' is not in the source");
      ++b;
    } else {
      compare_extra(renumbered(**a, to), **b);
      ++a;
      ++b;
    }
  }
}

void Comparison::compare_extra(const Extra& source, const Extra& restored) {
  if (source == restored) return;
  const std::string name = "extra '" + source.key + "'";
  if (source.type != restored.type || source.shape != restored.shape ||
      source.refers != restored.refers || source.data.size() != restored.data.size())
    return differ(name, kind_text(source), kind_text(restored));
  const std::size_t bytes = scalar_bytes(source.type);
  for (std::size_t offset = 0; offset + bytes <= source.data.size(); offset += bytes)
    if (std::memcmp(source.data.data() + offset, restored.data.data() + offset, bytes) != 0)
      return differ(name + ", value " + std::to_string(offset / bytes),
                    value_text(source.data.data() + offset, source.type),
                    value_text(restored.data.data() + offset, source.type));
}

CompareReport best_guess(MeshSource& source, MeshSource& restored, Spool& spool,
                         const Progress& progress, const CellSequence* cell_order, bool with_steps,
                         Numbering* numbering) {
  CompareReport best;
  std::unique_ptr<SpooledSource> spooled;
  for (std::size_t guess = 0;; ++guess) {
    Comparison comparison(source, restored, spool, progress, cell_order, with_steps, spooled);
    CompareReport report = comparison.run(guess);
    if (guess == 0 || report.differences < best.differences) best = std::move(report);
    if (best.equal() && numbering != nullptr) *numbering = comparison.numbers().numbering(spool);
    if (best.equal() || !comparison.numbers().has_more()) return best;
  }
}

}  // namespace

double MeasuredError::rms() const {
  return values > 0 ? std::sqrt(squares / static_cast<double>(values)) : 0;
}
double MeasuredError::psnr() const {
  const double noise = rms();
  return noise > 0 ? 20 * std::log10((maximum - minimum) / noise)
                   : std::numeric_limits<double>::infinity();
}

CompareReport compare_meshes(MeshSource& source, MeshSource& restored, Spool& spool,
                             const Progress& progress, const CellSequence* cell_order) {
  return best_guess(source, restored, spool, progress, cell_order, true, nullptr);
}

CompareReport compare_without_steps(MeshSource& source, MeshSource& restored, Spool& spool,
                                    const Progress& progress, const CellSequence* cell_order,
                                    Numbering& numbering) {
  return best_guess(source, restored, spool, progress, cell_order, false, &numbering);
}

}  // namespace shm::converters
