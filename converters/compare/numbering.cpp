#include "compare/numbering.h"

#include <algorithm>
#include <utility>

#include "compare/order_match.h"
#include "compare/piecewise.h"
#include "compression/compress.h"
#include "mesh/cell_cursor.h"
#include "mesh/cell_rotations.h"
#include "mesh/cell_store.h"
#include "mesh/cell_table.h"
#include "order/reordered_mesh.h"

namespace shm::converters {

NumberingSearch::NumberingSearch(MeshSource& source, MeshSource& restored, Spool& spool,
                                 const Progress& progress, const CellSequence* given_order,
                                 std::unique_ptr<SpooledSource>& spooled)
    : source_(&source),
      restored_(&restored),
      spool_(&spool),
      progress_(progress),
      given_order_(given_order),
      spooled_(spooled),
      wanted_(restored.info().schema.order != Order::keep &&
              source.info().schema.order == Order::keep) {}

// Adopts the candidate renumbering with index `guess`. If both meshes have the same cells in the
// same order, in the whole mesh or in each block, the first candidate uses this order. Each further
// candidate results from encoding the source again, in one of the known cell orders that match the
// restored cells. A candidate for which all cells match may still be wrong for vertices and values,
// because several cells may coincide, or a cell may match in several rotations. The caller then
// tries the next candidate.
void NumberingSearch::take(std::size_t guess) {
  const bool as_they_are = same_as_they_are() || same_within_blocks();
  if (as_they_are) has_more_ = true;
  if (as_they_are && guess == 0) return;
  replay(guess - (as_they_are ? 1 : 0));
}

// Returns true if the cells are equal without any renumbering, e.g. because the source was created
// from the restored mesh. Stops at the first difference.
bool NumberingSearch::same_as_they_are() {
  CellCursor source(*source_), restored(*restored_);
  while (source.next() && restored.next())
    if (source.block() != restored.block() ||
        !same_corners(source.corners(), restored.corners(), source.block()))
      return false;
  return true;
}

// Returns true if each block contains the same cells in the same order in both meshes. This happens
// if a format stores the cells block by block: the order of the cells across blocks may then
// change, but the order of the vertices does not. If true, adopts the resulting cell numbers.
bool NumberingSearch::same_within_blocks() {
  const MeshInfo& info = source_->info();
  const Schema& schema = restored_->info().schema;
  const bool cells_move = schema.delay > 0 || schema.order == Order::free;
  if (!cells_move || info.block_cells.size() < 2) return false;
  std::vector<std::uint64_t> next;  // for each block, the index of its next cell in source_cell
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
    if (!same_corners(one.cell(0), restored.corners(), restored.block())) return false;
    by_block->push_back(number);
  }
  follow(nullptr, std::move(by_block));
  return true;
}

void NumberingSearch::replay(std::size_t guess) {
  if (progress_) progress_("finding the renumbering", 0, 1);
  const Schema& schema = restored_->info().schema;
  if (schema.order == Order::free && schema.delay == 0 && replay_free_order(guess)) return;
  const auto log = std::make_shared<CodingOrderLog>(*spool_);
  replay_coding_order(*source_, restored_->info(), *log, *spool_);
  log->check();
  has_more_ = false;
  follow({log, &log->vertices()},
         schema.delay > 0 ? std::shared_ptr<NumberList>(log, &log->cells()) : nullptr);
}

// Adopts a candidate for a mesh in Order::free, whose cells were reordered before they were
// encoded. Returns false if no known order of the cells matches.
bool NumberingSearch::replay_free_order(std::size_t guess) {
  std::optional<CellTable> table;
  if (given_order_ == nullptr && must_be_spooled(source_->info(), spool_->memory_budget()))
    take_up_spooled();
  else if (table = CellTable::read(*source_, progress_); !table)
    return false;
  const Cells& cells = table ? static_cast<const Cells&>(*table) : *in_spool_;
  std::optional<CellList> order;
  if (given_order_ != nullptr)
    order.emplace(*given_order_);
  else
    order = matching_order(
        cells, *source_, *restored_, guess, progress_,
        in_spool_ == nullptr ? SearchRoom{} : SearchRoom{spool_, spooled_->memory.order_bytes});
  if (!order) return false;
  has_more_ = given_order_ == nullptr;
  ReorderedMesh ordered(*source_, cells, *order, in_spool_ == nullptr ? nullptr : spool_);
  const auto log = std::make_shared<CodingOrderLog>(*spool_, false);
  replay_coding_order(ordered, restored_->info(), *log, *spool_);
  log->check();
  auto moved_cells = std::make_shared<NumberList>(*spool_);
  for (std::uint64_t i = 0; i < order->size(); ++i) moved_cells->push_back((*order)[i]);
  follow({log, &log->vertices()}, std::move(moved_cells));
  return true;
}

// Replaces the source with a renumbered copy in a spool (temporary storage, on disk if large).
void NumberingSearch::take_up_spooled() {
  if (spooled_ == nullptr) spooled_ = std::make_unique<SpooledSource>(*source_, *spool_, progress_);
  in_spool_ = &spooled_->mesh;
  source_ = &spooled_->mesh;
  spool_ = &spooled_->table_spool;
}

void NumberingSearch::follow(std::shared_ptr<NumberList> vertices,
                             std::shared_ptr<NumberList> cells) {
  const MeshInfo& info = source_->info();
  numbering_ = {vertices, cells};
  if (vertices != nullptr) {
    position_of_vertex_ = invert(*vertices, info.vertices, "vertex", *spool_);
    source_vertex_.emplace(*spool_, info.vertices);
    vertices->for_each([&](std::uint64_t position, std::uint64_t number) {
      source_vertex_->set(position, number);
    });
  }
  if (cells != nullptr) {
    position_of_cell_ = invert(*cells, info.cells(), "cell", *spool_);
    covered_ = std::make_unique<CoveredOrder>(*source_, *cells, *spool_);
  }
}

NumberList* NumberingSearch::elements(std::size_t array) {
  const Location location = restored_->info().schema.arrays[array].location;
  if (location == Location::point) return vertices();
  return location == Location::cell && cells() != nullptr ? &covered_->elements(array) : nullptr;
}

Renumbering NumberingSearch::to_restored() {
  Renumbering to;
  to.vertices = source_->info().vertices;
  to.cells = source_->info().cells();
  if (vertices() != nullptr)
    to.vertex = [this](std::uint64_t v) { return position_of_vertex_->get(v); };
  if (cells() != nullptr) to.cell = [this](std::uint64_t c) { return position_of_cell_->get(c); };
  return to;
}

bool NumberingSearch::same_corners(std::span<const std::uint64_t> source,
                                   std::span<const std::uint64_t> restored, std::uint32_t block) {
  mapped_.assign(restored.begin(), restored.end());
  if (source_vertex_)
    for (std::uint64_t& v : mapped_) v = source_vertex_->get(v);
  if (std::equal(source.begin(), source.end(), mapped_.begin(), mapped_.end())) return true;
  const Schema& schema = restored_->info().schema;
  const BlockInfo& info = schema.blocks[block];
  if (!wanted_ || schema.corner_order || info.shape != CellShape::hexahedron ||
      source.size() != 8 || mapped_.size() != 8)
    return false;
  return is_rotated<std::uint64_t>(info.shape, source, mapped_);
}

std::string NumberingSearch::corners_text(std::span<const std::uint64_t> corners) const {
  if (in_spool_ == nullptr) return converters::corners_text(corners);
  std::vector<std::uint64_t> numbers;
  for (const std::uint64_t v : corners)
    numbers.push_back(in_spool_->number_of_vertex(static_cast<std::uint32_t>(v)));
  return converters::corners_text(numbers);
}

std::size_t NumberingSearch::cache_bytes() const {
  // A small cache suffices, because the spool that contains the mesh already caches the pages that
  // are needed.
  return in_spool_ == nullptr ? kCacheBytes : spooled_->memory.cache_bytes / 4;
}

Numbering NumberingSearch::numbering(Spool& spool) const {
  if (in_spool_ == nullptr) return numbering_;
  const auto as_before = [&](const std::shared_ptr<NumberList>& list, auto&& number) {
    std::shared_ptr<NumberList> out;
    if (list == nullptr) return out;
    out = std::make_shared<NumberList>(spool);
    list->for_each([&](std::uint64_t, std::uint64_t n) {
      out->push_back(number(static_cast<std::uint32_t>(n)));
    });
    return out;
  };
  return {as_before(numbering_.vertices,
                    [&](std::uint32_t v) { return in_spool_->number_of_vertex(v); }),
          as_before(numbering_.cells, [&](std::uint32_t c) { return in_spool_->number_of(c); })};
}

}  // namespace shm::converters
