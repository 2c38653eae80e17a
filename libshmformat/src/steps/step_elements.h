// StepElements: the groups that have elements of a stepped array, and these elements, which a
// column needs. Those of arrays on few elements are kept from step to step (sparse_elements.h), so
// that the cost of a step depends on its own values and not on the mesh. For other arrays the mesh
// is decoded again.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "steps/sparse_elements.h"
#include "steps/step_topology.h"

namespace shm {

/// Most components of an array in columns, since each column needs memory. Wider arrays are left to
/// zstd.
inline constexpr std::uint32_t kMostStepComponents = 256;

/// Elements of a group, as a column needs them.
struct ColumnElements {
  const TiledItems* items = nullptr;
  std::uint32_t slots = 0;  ///< upper bound of the slots named by items
  /// The same for all elements of the mesh, if some are left out.
  std::uint32_t all_slots = 0;
  /// Numbers of the covered elements in a Reader, if the StepTopology was asked for them.
  std::span<const std::uint64_t> numbers;
};

/// By array: the number of its cover. Stepped arrays that cover the same elements have the same
/// number.
using CoverNumbers = std::shared_ptr<const std::vector<std::uint32_t>>;
CoverNumbers cover_numbers(const Schema& schema);

class StepElements {
 public:
  struct OfGroup {
    std::uint32_t group = 0;
    std::uint64_t count = 0;  ///< number of elements, never 0
  };

  /// `schema` has passed check_schema(). It and `topology`, which has all its groups, must outlive
  /// this object. `covers`: cover_numbers(schema).
  StepElements(const Schema& schema, StepTopology& topology, CoverNumbers covers);

  /// Sets the number of elements that an array has in all groups, which decides whether they are
  /// kept. Call it before anything else about the array.
  void expect(std::uint32_t array, std::uint64_t elements);
  /// Returns the nth group that has elements of the array; null if there is none up to group
  /// `last`. Valid until the next call.
  Result<const OfGroup*> nth_group(std::uint32_t array, std::size_t nth, std::size_t last);
  /// Returns the number of elements of the array in the group.
  Result<std::uint64_t> count(std::uint32_t array, std::size_t group);
  /// Returns the elements of the array in a group that has some. Valid until the next call. Reading
  /// groups in order is fastest.
  Result<ColumnElements> elements(std::uint32_t array, std::size_t group);

  std::uint32_t segment_of(std::size_t group) const { return topology_->segment_of(group); }
  bool has_neighbourhoods(std::size_t group) const { return topology_->has_neighbourhoods(group); }
  std::size_t groups() const { return topology_->groups(); }
  std::uint64_t most_active() const { return topology_->most_active(); }
  /// Bytes kept for arrays on few elements.
  std::size_t kept_bytes() const { return kept_bytes_; }

 private:
  /// Arrays that cover the same elements.
  struct Cover {
    std::uint32_t array = 0;          // one of these arrays
    bool is_sparse = false;           // true: they cover few elements
    bool made = false;                // true: `sparse` has been built
    std::vector<OfGroup> groups;      // groups that have elements
    std::size_t counted = 0;          // number of groups counted
    std::vector<SparseGroup> sparse;  // sparse elements of `groups`, once made

    /// Returns the index in `groups` of the first group that is not before `group`.
    std::size_t nth(std::size_t group) const;
  };
  struct Making;

  Cover& cover(std::uint32_t array) { return covers_[(*numbers_of_covers_)[array]]; }
  bool of_points(const Cover& cover) const {
    return schema_->arrays[cover.array].location == Location::point;
  }
  std::span<const std::uint32_t> covered_blocks(const Cover& cover) const;
  Result<void> count_up_to(Cover& cover, std::size_t group);
  Result<void> make_sparse(std::uint32_t wanted);
  Result<void> add_group(std::size_t group, std::span<Making> all);
  static void make_dense(Cover& cover);
  ColumnElements dense(std::uint32_t array, const GroupElements& all);

  const Schema* schema_;
  StepTopology* topology_;
  CoverNumbers numbers_of_covers_;
  std::map<std::uint32_t, Cover> covers_;  // by number
  std::size_t kept_bytes_ = 0, made_at_once_ = 1;
  TiledItems unfolded_;
  std::vector<std::uint64_t> numbers_;
};

}  // namespace shm
