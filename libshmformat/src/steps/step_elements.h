// StepElements: which groups have elements of a stepped array, and which these are: what a column
// needs of the mesh. Of arrays on few elements it is kept from step to step (sparse_elements.h), so
// that a step costs what it holds and not what the mesh holds; of the others the mesh is
// decoded again. spec: "Step values"
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

/// Arrays of more components are left to zstd: columns cost memory each.
inline constexpr std::uint32_t kMostStepComponents = 256;

/// What a column needs of a group.
struct ColumnElements {
  const TiledItems* items = nullptr;
  std::uint32_t slots = 0;  ///< above every slot that an item names
  /// The same of all elements of the mesh, where some are left out.
  std::uint32_t all_slots = 0;
  /// As a Reader numbers the covered elements, where a StepTopology was asked for that.
  std::span<const std::uint64_t> numbers;
};

/// Which stepped arrays cover the same elements, by array: the number of what they cover.
using CoverNumbers = std::shared_ptr<const std::vector<std::uint32_t>>;
CoverNumbers cover_numbers(const Schema& schema);

class StepElements {
 public:
  struct OfGroup {
    std::uint32_t group = 0;
    std::uint64_t count = 0;  ///< elements, never 0
  };

  /// `schema` is checked and borrowed, and so is `topology`, which has all its groups. `covers`:
  /// cover_numbers(schema).
  StepElements(const Schema& schema, StepTopology& topology, CoverNumbers covers);

  /// Before all else about an array: how many elements it has in all groups, by which
  /// it is decided whether they are kept.
  void expect(std::uint32_t array, std::uint64_t elements);
  /// The nth group that has elements of the array; null where there is none up to group `last`.
  /// Valid until the next call.
  Result<const OfGroup*> nth_group(std::uint32_t array, std::size_t nth, std::size_t last);
  /// How many elements of the array the group has.
  Result<std::uint64_t> count(std::uint32_t array, std::size_t group);
  /// Those of a group that has some. Valid until the next call. Groups in order cost least.
  Result<ColumnElements> elements(std::uint32_t array, std::size_t group);

  std::uint32_t segment_of(std::size_t group) const { return topology_->segment_of(group); }
  bool has_neighbourhoods(std::size_t group) const { return topology_->has_neighbourhoods(group); }
  std::size_t groups() const { return topology_->groups(); }
  std::uint64_t most_active() const { return topology_->most_active(); }
  /// Of what is kept of arrays on few elements.
  std::size_t kept_bytes() const { return kept_bytes_; }

 private:
  /// Arrays that cover the same elements.
  struct Cover {
    std::uint32_t array = 0;          // one of them
    bool is_sparse = false;           // their elements are few
    bool made = false;                // what is sparse of it
    std::vector<OfGroup> groups;      // that have elements
    std::size_t counted = 0;          // groups
    std::vector<SparseGroup> sparse;  // once made: of these groups

    /// Of the groups that have elements the first one that is no earlier.
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
