// PieceRequest: what is asked of a file, and which segments may have it by what the index lists.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "access/indexed_file.h"
#include "shm/mesh_extract.h"

namespace shm {

class PieceRequest {
 public:
  /// A segment to read. `probe`: it need not have anything; cells are looked at before values.
  struct Visit {
    std::size_t segment = 0;
    bool probe = false;
  };
  static constexpr std::uint64_t kUnknown = ~std::uint64_t{0};

  /// `file` is open and borrowed. Fails for a request that names what there is not.
  static Result<PieceRequest> of(ExtractRequest request, const IndexedFile& file);

  const ExtractRequest& request() const { return request_; }
  bool of_vertices() const { return request_.vertices.has_value(); }
  bool wants_unused() const {
    return (request_.unused_vertices || (request_.cells.all() && file_->decodable())) &&
           !of_vertices();
  }
  /// Whether the piece is the whole file; of a damaged one it never is.
  bool all() const { return !of_vertices() && request_.cells.all() && !file_->decodable(); }
  const std::optional<std::array<double, 6>>& box() const { return request_.cells.box; }

  /// In which order to read: first where things must be, or are likely to be.
  std::vector<Visit> visits() const;
  /// Whether a cell meets all conditions but for the box.
  bool includes(std::uint64_t number, std::uint32_t block) const;
  bool includes_vertex(std::uint64_t number) const;
  /// How many elements of the whole mesh meet all conditions but for the box, if that is known:
  /// when they have come, there are no others. Else kUnknown.
  std::uint64_t expected() const { return expected_; }

  /// Whether the numbers of a group's cells may be wanted.
  bool may_be_in_group(const container::IndexEntry& group) const;
  /// Whether vertices whose box is `of_index` can be in the box.
  bool may_be_in_box(const std::array<double, 6>& of_index) const;
  /// `box` of the index, wider by what rounding may move coordinates.
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
