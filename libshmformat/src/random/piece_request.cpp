#include "random/piece_request.h"

#include <algorithm>
#include <functional>
#include <string>
#include <utility>

#include "base/errors.h"

namespace shm {
namespace {

template <class Number>
bool ascends(const std::vector<Number>& numbers) {
  return std::adjacent_find(numbers.begin(), numbers.end(), std::greater_equal<>()) ==
         numbers.end();
}

template <class Number>
bool has(const std::vector<Number>& numbers, Number number) {
  return std::binary_search(numbers.begin(), numbers.end(), number);
}

/// Returns true if `numbers` contains any of first, ..., first + count - 1. Precondition: `numbers`
/// is in ascending order.
bool has_any(const std::vector<std::uint64_t>& numbers, std::uint64_t first, std::uint64_t count) {
  const auto found = std::lower_bound(numbers.begin(), numbers.end(), first);
  return found != numbers.end() && *found - first < count;
}

bool overlap(std::uint64_t first, std::uint64_t count, std::uint64_t other, std::uint64_t end) {
  return first < end && other < first + count && count > 0 && other < end;
}

}  // namespace

Result<PieceRequest> PieceRequest::of(ExtractRequest request, const IndexedFile& file) {
  PieceRequest checked(std::move(request), file);
  if (auto status = checked.check(); !status) return status.error();
  checked.expected_ = checked.count_expected();
  return checked;
}

Result<void> PieceRequest::check() const {
  const CellSelection& cells = request_.cells;
  const Schema& schema = file_->schema();
  const std::string in_all = "there are " + std::to_string(file_->index().cells) + " cells";
  if (cells.range && cells.range->first > cells.range->end)
    return misuse("a range of cells ends before it begins", "request");
  if (cells.range && cells.range->end > file_->index().cells)
    return misuse("a range of cells ends at " + std::to_string(cells.range->end) + "; " + in_all,
                  "request");
  if (cells.numbers && !ascends(*cells.numbers))
    return misuse("numbers of cells do not ascend", "request");
  if (cells.numbers && !cells.numbers->empty() && cells.numbers->back() >= file_->index().cells)
    return misuse("there is no cell " + std::to_string(cells.numbers->back()) + "; " + in_all,
                  "request");
  if (cells.blocks && (!ascends(*cells.blocks) ||
                       (!cells.blocks->empty() && cells.blocks->back() >= schema.blocks.size())))
    return misuse("numbers of blocks do not ascend, or a block does not exist", "request");
  if (cells.box)
    for (std::size_t c = 0; c < 3; ++c)
      if (!((*cells.box)[c] <= (*cells.box)[3 + c]))
        return misuse("a box ends before it begins", "request");
  if (request_.vertices && !ascends(*request_.vertices))
    return misuse("numbers of vertices do not ascend", "request");
  if (request_.vertices && (cells.range || cells.numbers || cells.blocks))
    return misuse("both vertices and cells are requested", "request");
  if (request_.arrays)
    for (const std::uint32_t array : *request_.arrays)
      if (array >= schema.arrays.size())
        return misuse("there is no array " + std::to_string(array), "request");
  return {};
}

/// Returns true if cells are numbered by their positions in coding order. Otherwise the file stores
/// cell numbers.
bool PieceRequest::numbers_are_positions() const {
  return file_->schema().order != Order::keep || file_->schema().delay == 0;
}

/// Returns true if a requested cell number is one of first, ..., first + count - 1, which are
/// positions in coding order.
bool PieceRequest::may_number(std::uint64_t first, std::uint64_t count) const {
  const CellSelection& cells = request_.cells;
  if (cells.range && !overlap(first, count, cells.range->first, cells.range->end)) return false;
  return !cells.numbers || has_any(*cells.numbers, first, count);
}

bool PieceRequest::may_be_in_group(const container::IndexEntry& group) const {
  if (of_vertices() || all() || !numbers_are_positions()) return true;
  return may_number(group.first_cell, group.cells);
}

bool PieceRequest::may_be_in_box(const std::array<double, 6>& of_index) const {
  if (!box()) return true;
  const auto there = widened(of_index);
  for (std::size_t c = 0; c < 3; ++c)
    if (there[3 + c] < (*box())[c] || there[c] > (*box())[3 + c]) return false;
  return true;
}

/// Returns true if the segment contains cells of the requested blocks, assuming that the cells of
/// each block are consecutive.
bool PieceRequest::blocks_likely(const SegmentInfo& segment) const {
  if (file_->decodable()) return false;
  std::uint64_t first = 0;
  const auto& counts = file_->index().block_cells;
  for (std::uint32_t b = 0; b < counts.size(); ++b) {
    if (has(*request_.cells.blocks, b) &&
        overlap(segment.first_cell, segment.cells, first, first + counts[b]))
      return true;
    first += counts[b];
  }
  return false;
}

auto PieceRequest::visits() const -> std::vector<Visit> {
  std::vector<Visit> visits;
  const bool keeps = file_->schema().order == Order::keep;
  const auto& segments = file_->segments();
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const SegmentInfo& segment = segments[s];
    bool probe = false;
    if (of_vertices()) {
      probe = keeps;
      if (!keeps && !has_any(*request_.vertices, segment.first_vertex, segment.vertices)) continue;
    } else if (!all()) {
      const bool here = may_number(segment.first_cell, segment.cells);
      const bool unused = wants_unused() && segment.cells == 0;
      if (!unused && (segment.cells == 0 || (!here && numbers_are_positions()))) continue;
      probe = !unused && (!here || (request_.cells.blocks && !blocks_likely(segment)));
    }
    if (may_be_in_box(segment.box)) visits.push_back({s, probe});
  }
  std::stable_partition(visits.begin(), visits.end(),
                        [](const Visit& visit) { return !visit.probe; });
  // Segments without lost values are read first. If several segments contain a vertex, its values
  // are taken from the segment that is read first, and they should not be lost there.
  std::stable_partition(visits.begin(), visits.end(), [&](const Visit& visit) {
    return file_->lost_arrays(visit.segment).empty();
  });
  return visits;
}

bool PieceRequest::includes(std::uint64_t number, std::uint32_t block) const {
  const CellSelection& cells = request_.cells;
  if (cells.range && (number < cells.range->first || number >= cells.range->end)) return false;
  if (cells.numbers && !has(*cells.numbers, number)) return false;
  return !cells.blocks || has(*cells.blocks, block);
}

bool PieceRequest::includes_vertex(std::uint64_t number) const {
  return has(*request_.vertices, number);
}

std::uint64_t PieceRequest::count_expected() const {
  const CellSelection& cells = request_.cells;
  if (file_->decodable()) return kUnknown;
  if (of_vertices()) return request_.vertices->size();
  if (!cells.range && !cells.numbers && cells.blocks) {
    std::uint64_t sum = 0;
    for (const std::uint32_t block : *cells.blocks) sum += file_->index().block_cells[block];
    return sum;
  }
  if (cells.blocks || (!cells.range && !cells.numbers)) return kUnknown;
  if (!cells.numbers) return cells.range->end - cells.range->first;
  return static_cast<std::uint64_t>(
      std::count_if(cells.numbers->begin(), cells.numbers->end(), [&](std::uint64_t number) {
        return !cells.range || (number >= cells.range->first && number < cells.range->end);
      }));
}

std::array<double, 6> PieceRequest::widened(std::array<double, 6> box) const {
  const Quantization& rounded = file_->schema().coordinate_quantization;
  const double by = rounded.lossy() ? rounded.max_error(file_->schema().coordinate_type) : 0;
  for (std::size_t c = 0; c < 3; ++c) {
    box[c] -= by;
    box[3 + c] += by;
  }
  return box;
}

}  // namespace shm
