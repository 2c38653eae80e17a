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

#include "base/page_cache.h"
#include "base/stored_value.h"
#include "compare/order_match.h"
#include "compare/piecewise.h"
#include "compression/compress.h"
#include "mesh/cell_cursor.h"
#include "mesh/cell_store.h"
#include "mesh/cell_turns.h"
#include "mesh/coding_order.h"
#include "order/coherent_mesh.h"
#include "order/reordered_mesh.h"

namespace shm::converters {
namespace {

// A run of values on both sides.
struct Column {
  std::string name;     // "coordinates" or "array 'T'"
  std::string what;     // the same, for one step: "array 'T', step 3"
  std::string element;  // "vertex", "cell" or "element"
  ScalarType type;
  std::uint32_t components;
  std::uint64_t elements;
  Quantization quantization;
  PageCache::Fetch source, restored;
};

// The source with other numbers and what is found about it, where it does not fit the memory. Made
// once for all guesses.
struct SpooledSource {
  SpooledSource(MeshSource& source, const Spool& spool, const Progress& progress)
      : memory(spool.memory_budget()),
        mesh_spool(spool.directory(), memory.mesh_bytes),
        table_spool(spool.directory(), memory.table_bytes),
        mesh(source, mesh_spool, memory.sort_bytes, progress) {}

  SpooledSearch memory;
  Spool mesh_spool, table_spool;
  CoherentMesh mesh;
};

class Comparison {
 public:
  // `spooled`: where that is found; made where it is needed.
  Comparison(MeshSource& source, MeshSource& restored, Spool& spool, const Progress& progress,
             const CellSequence* told_order, std::size_t guess, bool with_steps,
             std::unique_ptr<SpooledSource>& spooled)
      : source_(&source),
        restored_(&restored),
        spool_(&spool),
        spooled_(&spooled),
        progress_(progress),
        told_order_(told_order),
        guess_(guess),
        with_steps_(with_steps) {}

  CompareReport run() {
    compare_structure();
    if (!same_counts_) return std::move(report_);
    const Schema& schema = restored_->info().schema;
    as_mesh_ = schema.order != Order::keep && source_->info().schema.order == Order::keep;
    if (as_mesh_) guess_numbering();
    compare_points();
    compare_cells();
    const std::vector<std::string> names = array_names(restored_->info().schema);
    for (std::size_t a = 0; same_arrays_ && a < schema.arrays.size(); ++a)
      if (with_steps_ || !schema.arrays[a].per_step) compare_array(a, names[a]);
    if (with_steps_) compare_extras();
    return std::move(report_);
  }
  // After run(): there is another guess about the numbering.
  bool may_guess_again() const { return may_guess_again_; }
  // After run(): the guess. It lives on without the comparison, in `spool`.
  Numbering numbering(Spool& spool) const;

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
  bool same_numbering();
  bool same_within_blocks();
  void guess_numbering();
  void find_renumbering(std::size_t guess);
  bool find_free_order(std::size_t guess);
  void take_up_spooled();
  std::string corners_as_before(std::span<const std::uint64_t> corners) const;
  void follow(std::shared_ptr<NumberList> vertices, std::shared_ptr<NumberList> cells);
  void compare_points();
  void compare_cells();
  void compare_cell(std::uint64_t number, std::uint32_t source_block,
                    std::span<const std::uint64_t> source_corners, std::uint32_t block,
                    std::span<const std::uint64_t> corners);
  bool same_corners(std::span<const std::uint64_t> source, std::uint32_t block);
  void compare_array(std::size_t array, const std::string& name);
  static std::vector<std::string> array_names(const Schema& schema);
  void compare_column(const Column& column, NumberList* order);
  void compare_values(const Column& column, std::uint64_t first, std::uint64_t count,
                      const std::byte* source, const std::byte* restored, MeasuredError* measured);
  MeasuredError* measured_error(const Column& column);
  void compare_extras();
  void compare_extra(const Extra& source, const Extra& restored);

  MeshSource* source_;
  MeshSource* restored_;
  Spool* spool_;
  std::unique_ptr<SpooledSource>* spooled_;
  const CoherentMesh* coherent_ = nullptr;  // source_ is this one, with numbers of its own
  const Progress& progress_;
  const CellSequence* told_order_;
  std::size_t guess_;
  bool with_steps_;  // else only what does not change with time
  bool may_guess_again_ = false;
  CompareReport report_;
  bool same_counts_ = true, same_arrays_ = true;
  bool as_mesh_ = false;  // the restored mesh is in another order than keep, the source is not

  // A guess about how the restored mesh is numbered, checked like anything else: the source's
  // number of each restored vertex and cell. Null: the same.
  std::shared_ptr<NumberList> vertex_order_, cell_order_;
  std::optional<NumberTable> source_vertex_;       // of a restored vertex
  std::optional<NumberTable> position_of_vertex_;  // of a source vertex; exists: a bijection
  std::optional<NumberTable> position_of_cell_;
  std::unique_ptr<CoveredOrder> covered_;
  std::vector<std::uint64_t> mapped_;  // corners of a restored cell in source numbers
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
    return "id " + std::to_string(block.id) + ", '" + block.name + "', " +
           std::string(shape_name(block.shape)) + " of " + std::to_string(block.nodes_per_cell);
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
    return "'" + array.name + "' (" + (array.location == Location::point ? "point" : "cell") +
           " data, " + std::to_string(array.components) + " x " +
           std::string(scalar_name(array.type)) + (array.per_step ? " per step" : "") +
           (array.role.empty() ? "" : ", " + array.role) + ", on " +
           (array.blocks.empty() ? "all" : std::to_string(array.blocks.size())) + " blocks)";
  };
  for (std::size_t i = 0; i < a.size(); ++i) {
    ArrayInfo plain = b[i];
    plain.quantization = a[i].quantization;
    if (a[i] == plain) continue;
    differ("array " + std::to_string(i), text(a[i]), text(b[i]));
    same_arrays_ = false;
  }
}

// Whether the cells are the same without any renumbering, as in a file that was made of the
// restored mesh. Stops at the first difference.
bool Comparison::same_numbering() {
  CellCursor source(*source_), restored(*restored_);
  while (source.next() && restored.next()) {
    mapped_.assign(restored.corners().begin(), restored.corners().end());
    if (source.block() != restored.block() || !same_corners(source.corners(), source.block()))
      return false;
  }
  return true;
}

// Whether the cells are the same when those of each block are taken by themselves: a format that
// stores one block after the other moves cells, but no vertices.
bool Comparison::same_within_blocks() {
  const MeshInfo& info = source_->info();
  const Schema& schema = restored_->info().schema;
  const bool cells_move = schema.delay > 0 || schema.order == Order::free;
  if (!cells_move || info.block_cells.size() < 2) return false;
  std::vector<std::uint64_t> next;  // place of the next cell of each block in source_cell
  for (std::uint64_t sum = 0; const std::uint64_t count : info.block_cells) {
    next.push_back(sum);
    sum += count;
  }
  const std::vector<std::uint64_t> begin = next;
  NumberTable source_cell(*spool_, info.cells());
  CellStore store(*spool_);
  for (CellCursor source(*source_); source.next();) {
    source_cell.set(next[source.block()]++, store.size());
    store.append(source.block(), source.corners());
  }
  next = begin;
  auto by_block = std::make_shared<NumberList>(*spool_);
  CellBatch one;
  for (CellCursor restored(*restored_); restored.next();) {
    const std::uint64_t number = source_cell.get(next[restored.block()]++);
    one.clear();
    store.read(number, one);
    mapped_.assign(restored.corners().begin(), restored.corners().end());
    if (!same_corners(one.cell(0), restored.block())) return false;
    by_block->push_back(number);
  }
  follow(nullptr, std::move(by_block));
  return true;
}

// Cells that look the same turned, or lie on each other, may fit a guess that their vertices and
// values do not fit. Then the next guess is due: the numbers as they are, then as coding the source
// gives them, in each order of cells that fits.
void Comparison::guess_numbering() {
  const bool as_they_are = same_numbering() || same_within_blocks();
  if (as_they_are) may_guess_again_ = true;
  if (as_they_are && guess_ == 0) return;
  find_renumbering(guess_ - (as_they_are ? 1 : 0));
}

void Comparison::find_renumbering(std::size_t guess) {
  if (progress_) progress_("finding the renumbering", 0, 1);
  const Schema& schema = restored_->info().schema;
  if (schema.order == Order::free && schema.delay == 0 && find_free_order(guess)) return;
  const auto log = std::make_shared<CodingOrderLog>(*spool_);
  replay_coding_order(*source_, restored_->info(), *log, *spool_);
  log->check();
  may_guess_again_ = false;
  follow({log, &log->vertices()},
         schema.delay > 0 ? std::shared_ptr<NumberList>(log, &log->cells()) : nullptr);
}

// The same where cells were put in another order first.
bool Comparison::find_free_order(std::size_t guess) {
  std::optional<CellTable> table;
  if (told_order_ == nullptr && must_be_spooled(source_->info(), spool_->memory_budget()))
    take_up_spooled();
  else if (table = CellTable::read(*source_, progress_); !table)
    return false;
  const Cells& cells = table ? static_cast<const Cells&>(*table) : *coherent_;
  std::optional<CellList> order;
  if (told_order_ != nullptr)
    order.emplace(*told_order_);
  else
    order = matching_order(
        cells, *source_, *restored_, guess, progress_,
        coherent_ == nullptr ? SearchRoom{} : SearchRoom{spool_, (*spooled_)->memory.order_bytes});
  if (!order) return false;
  may_guess_again_ = told_order_ == nullptr;
  ReorderedMesh ordered(*source_, cells, *order, coherent_ == nullptr ? nullptr : spool_);
  const auto log = std::make_shared<CodingOrderLog>(*spool_, false);
  replay_coding_order(ordered, restored_->info(), *log, *spool_);
  log->check();
  auto moved_cells = std::make_shared<NumberList>(*spool_);
  for (std::uint64_t at = 0; at < order->size(); ++at) moved_cells->push_back((*order)[at]);
  follow({log, &log->vertices()}, std::move(moved_cells));
  return true;
}

// From now on the source is the same mesh with other numbers, in a spool.
void Comparison::take_up_spooled() {
  if (*spooled_ == nullptr)
    *spooled_ = std::make_unique<SpooledSource>(*source_, *spool_, progress_);
  coherent_ = &(*spooled_)->mesh;
  source_ = &(*spooled_)->mesh;
  spool_ = &(*spooled_)->table_spool;
}

Numbering Comparison::numbering(Spool& spool) const {
  if (coherent_ == nullptr) return {vertex_order_, cell_order_};
  const auto as_before = [&](const std::shared_ptr<NumberList>& list, auto&& number) {
    std::shared_ptr<NumberList> out;
    if (list == nullptr) return out;
    out = std::make_shared<NumberList>(spool);
    list->for_each([&](std::uint64_t, std::uint64_t n) {
      out->push_back(number(static_cast<std::uint32_t>(n)));
    });
    return out;
  };
  return {as_before(vertex_order_, [&](std::uint32_t v) { return coherent_->number_of_vertex(v); }),
          as_before(cell_order_, [&](std::uint32_t c) { return coherent_->number_of(c); })};
}

// Takes up a guess. Throws when it is no bijection.
void Comparison::follow(std::shared_ptr<NumberList> vertices, std::shared_ptr<NumberList> cells) {
  const MeshInfo& info = source_->info();
  vertex_order_ = vertices;
  cell_order_ = cells;
  if (vertices != nullptr) {
    position_of_vertex_ = invert(*vertices, info.vertices, "vertex", *spool_);
    source_vertex_.emplace(*spool_, info.vertices);
    vertices->for_each(
        [&](std::uint64_t at, std::uint64_t number) { source_vertex_->set(at, number); });
  }
  if (cells != nullptr) {
    position_of_cell_ = invert(*cells, info.cells(), "cell", *spool_);
    covered_ = std::make_unique<CoveredOrder>(*source_, *cells, *spool_);
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
                [&](std::uint64_t first, std::uint64_t count, std::byte* out) {
                  source_->read_points(first, count, out);
                },
                [&](std::uint64_t first, std::uint64_t count, std::byte* out) {
                  restored_->read_points(first, count, out);
                }};
  compare_column(column, vertex_order_.get());
}

void Comparison::compare_cells() {
  const std::uint64_t cells = restored_->info().cells();
  CellCursor restored(*restored_);
  if (cell_order_ == nullptr) {
    CellCursor source(*source_);
    for (std::uint64_t i = 0; i < cells && source.next() && restored.next(); ++i)
      compare_cell(i, source.block(), source.corners(), restored.block(), restored.corners());
    return;
  }
  CellStore store(*spool_);
  for (CellCursor source(*source_); source.next();) store.append(source.block(), source.corners());
  CellBatch one;
  cell_order_->for_each([&](std::uint64_t at, std::uint64_t number) {
    if (!restored.next()) return;
    one.clear();
    store.read(number, one);
    compare_cell(at, one.blocks[0], one.cell(0), restored.block(), restored.corners());
  });
}

void Comparison::compare_cell(std::uint64_t number, std::uint32_t source_block,
                              std::span<const std::uint64_t> source_corners, std::uint32_t block,
                              std::span<const std::uint64_t> corners) {
  if (source_block != block)
    return differ("block of cell " + std::to_string(number), std::to_string(source_block),
                  std::to_string(block));
  mapped_.assign(corners.begin(), corners.end());
  if (source_vertex_)
    for (std::uint64_t& v : mapped_) v = source_vertex_->get(v);
  if (!same_corners(source_corners, block))
    differ("corners of cell " + std::to_string(number), corners_as_before(source_corners),
           corners_as_before(mapped_));
}

// In words, with the source's own numbers.
std::string Comparison::corners_as_before(std::span<const std::uint64_t> corners) const {
  if (coherent_ == nullptr) return corners_text(corners);
  std::vector<std::uint64_t> numbers;
  for (const std::uint64_t v : corners)
    numbers.push_back(coherent_->number_of_vertex(static_cast<std::uint32_t>(v)));
  return corners_text(numbers);
}

bool Comparison::same_corners(std::span<const std::uint64_t> source, std::uint32_t block) {
  if (std::equal(source.begin(), source.end(), mapped_.begin(), mapped_.end())) return true;
  const Schema& schema = restored_->info().schema;
  const BlockInfo& info = schema.blocks[block];
  if (!as_mesh_ || schema.corner_order || info.shape != CellShape::hexahedron ||
      source.size() != 8 || mapped_.size() != 8)
    return false;
  return is_turned<std::uint64_t>(info.shape, source, mapped_);
}

void Comparison::compare_array(std::size_t array, const std::string& name) {
  const MeshInfo& info = restored_->info();
  const ArrayInfo& data = info.schema.arrays[array];
  NumberList* order = vertex_order_.get();
  if (data.location == Location::cell)
    order = cell_order_ != nullptr ? &covered_->elements(array) : nullptr;
  const std::uint64_t steps = data.per_step ? info.step_times.size() : 1;
  for (std::uint64_t step = 0; step < steps; ++step) {
    const auto from = [array, step](MeshSource* mesh) {
      return [=](std::uint64_t first, std::uint64_t count, std::byte* out) {
        mesh->read_array(array, step, first, count, out);
      };
    };
    std::string what = name;
    if (data.per_step) what += ", step " + std::to_string(step);
    const char* element = data.location == Location::point ? "vertex"
                          : data.blocks.empty()            ? "cell"
                                                           : "element";
    compare_column({name, std::move(what), element, data.type, data.components,
                    info.array_elements(array), data.quantization, from(source_), from(restored_)},
                   order);
  }
}

// "array 'T'", or "array 'point/T'" where there are several T.
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
  return &report_.measured.back();
}

// `order`: for each restored element the source's; null: the same.
void Comparison::compare_column(const Column& column, NumberList* order) {
  const std::size_t stride = column.components * scalar_bytes(column.type);
  MeasuredError* measured = measured_error(column);
  std::vector<std::byte> source, restored;
  std::vector<std::uint64_t> numbers;
  // A coherent mesh has the pages that are wanted in its spool.
  const std::size_t cache_bytes =
      coherent_ == nullptr ? kCacheBytes : (*spooled_)->memory.cache_bytes / 4;
  PageCache cache(column.elements, stride, cache_bytes, column.source);
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
    if (source != restored)
      compare_values(column, first, count, source.data(), restored.data(), measured);
    if (progress_) progress_(column.what, first + count, column.elements);
  }
}

void Comparison::compare_values(const Column& column, std::uint64_t first, std::uint64_t count,
                                const std::byte* source, const std::byte* restored,
                                MeasuredError* measured) {
  const std::size_t bytes = scalar_bytes(column.type);
  for (std::uint64_t i = 0; i < count * column.components; ++i) {
    const std::byte* a = source + i * bytes;
    const std::byte* b = restored + i * bytes;
    if (std::memcmp(a, b, bytes) == 0) continue;
    std::string broken;
    if (measured != nullptr) {
      const double error = std::fabs(as_double(a, column.type) - as_double(b, column.type));
      if (std::isfinite(error)) {
        measured->largest = std::max(measured->largest, error);
        if (error <= measured->promised) continue;
        broken = "; error " + number_text(error) + ", promised " + number_text(measured->promised);
      }
    }
    std::string where =
        column.what + ", " + column.element + " " + std::to_string(first + i / column.components);
    if (column.components > 1) where += ", component " + std::to_string(i % column.components);
    differ(where, value_text(a, column.type), value_text(b, column.type), broken);
  }
}

void Comparison::compare_extras() {
  Renumbering to;
  to.vertices = source_->info().vertices;
  to.cells = source_->info().cells();
  if (vertex_order_ != nullptr)
    to.vertex = [&](std::uint64_t v) { return position_of_vertex_->get(v); };
  if (cell_order_ != nullptr) to.cell = [&](std::uint64_t c) { return position_of_cell_->get(c); };
  // Sorted by key; the order in which extras come means nothing, except under the same key.
  const auto sorted = [](const std::vector<Extra>& extras) {
    std::vector<const Extra*> list;
    for (const Extra& extra : extras) list.push_back(&extra);
    std::stable_sort(list.begin(), list.end(),
                     [](const Extra* a, const Extra* b) { return a->key < b->key; });
    return list;
  };
  const auto source = sorted(source_->info().extras);
  const auto restored = sorted(restored_->info().extras);
  auto a = source.begin();
  auto b = restored.begin();
  while (a != source.end() || b != restored.end()) {
    if (b == restored.end() || (a != source.end() && (*a)->key < (*b)->key)) {
      differ("extra '" + (*a)->key + "' is missing from the restored mesh");
      ++a;
    } else if (a == source.end() || (*b)->key < (*a)->key) {
      differ("extra '" + (*b)->key + "' is not in the source");
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
  const auto text = [](const Extra& extra) {
    std::string shape;
    for (const std::uint64_t n : extra.shape)
      shape += (shape.empty() ? "" : " x ") + std::to_string(n);
    return "[" + shape + "] " + std::string(scalar_name(extra.type)) +
           (extra.refers == Reference::vertex ? " vertices"
            : extra.refers == Reference::cell ? " cells"
                                              : "");
  };
  if (source.type != restored.type || source.shape != restored.shape ||
      source.refers != restored.refers || source.data.size() != restored.data.size())
    return differ(name, text(source), text(restored));
  const std::size_t bytes = scalar_bytes(source.type);
  for (std::size_t at = 0; at + bytes <= source.data.size(); at += bytes)
    if (std::memcmp(source.data.data() + at, restored.data.data() + at, bytes) != 0)
      return differ(name + ", value " + std::to_string(at / bytes),
                    value_text(source.data.data() + at, source.type),
                    value_text(restored.data.data() + at, source.type));
}

}  // namespace

namespace {

CompareReport best_guess(MeshSource& source, MeshSource& restored, Spool& spool,
                         const Progress& progress, const CellSequence* cell_order, bool with_steps,
                         Numbering* numbering) {
  CompareReport best;
  std::unique_ptr<SpooledSource> spooled;
  for (std::size_t guess = 0;; ++guess) {
    Comparison comparison(source, restored, spool, progress, cell_order, guess, with_steps,
                          spooled);
    CompareReport report = comparison.run();
    if (guess == 0 || report.differences < best.differences) best = std::move(report);
    if (best.equal() && numbering != nullptr) *numbering = comparison.numbering(spool);
    if (best.equal() || !comparison.may_guess_again()) return best;
  }
}

}  // namespace

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
