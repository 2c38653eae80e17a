// PieceRequest: a request for a piece of a file. From the index, it determines the list of segments
// that may contain requested elements.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "random/indexed_file.h"
#include "shm/selection.h"

namespace shm {

class PieceRequest {
 public:
  /// Segment to read. `probe` is true if it is not certain that the segment contains requested
  /// elements. The cells of such a segment are checked before its values are read.
  struct Visit {
    std::size_t segment = 0;
    bool probe = false;
  };
  static constexpr std::uint64_t kUnknown = ~std::uint64_t{0};

  /// Creates a request. `file` is borrowed. Precondition: `file` is open. Fails if the request
  /// contains elements or arrays that do not exist.
  static Result<PieceRequest> of(ExtractRequest request, const IndexedFile& file);

  const ExtractRequest& request() const { return request_; }
  bool of_vertices() const { return request_.vertices.has_value(); }
  bool wants_unused() const {
    return (request_.unused_vertices || (request_.cells.all() && file_->decodable())) &&
           !of_vertices();
  }
  /// Returns true if the request includes the whole file. Always returns false for a damaged file.
  bool all() const { return !of_vertices() && request_.cells.all() && !file_->decodable(); }
  const std::optional<std::array<double, 6>>& box() const { return request_.cells.box; }

  /// Returns the segments to read, in reading order. Segments without lost values come first. Among
  /// these, and among the other segments, those with `probe` set to true come last.
  std::vector<Visit> visits() const;
  /// Returns true if a cell meets all conditions of the request, ignoring its box.
  bool includes(std::uint64_t number, std::uint32_t block) const;
  bool includes_vertex(std::uint64_t number) const;
  /// Returns the number of elements of the whole mesh that meet all conditions of the request,
  /// ignoring its box, or kUnknown. Reading can stop when this number of elements has been found.
  std::uint64_t expected() const { return expected_; }

  /// Returns true if the group may contain requested cells. Decides this by the cell numbers only.
  bool may_be_in_group(const container::IndexEntry& group) const;
  /// Returns true if a group or segment may have vertices in the requested box. `of_index` is the
  /// box that the index states for the group or segment.
  bool may_be_in_box(const std::array<double, 6>& of_index) const;
  /// Returns a box from the index, enlarged by the maximum quantization error of the coordinates.
  std::array<double, 6> widened(std::array<double, 6> box) const;

 private:
  PieceRequest(ExtractRequest request, const IndexedFile& file)
      : request_(std::move(request)), file_(&file) {}
  Result<void> check() const;
  std::uint64_t count_expected() const;
  bool numbers_are_positions() const;
  bool may_number(std::uint64_t first, std::uint64_t count) const;
  bool blocks_likely(const SegmentInfo& segment) const;

  ExtractRequest request_;
  const IndexedFile* file_;
  std::uint64_t expected_ = kUnknown;
};

}  // namespace shm
