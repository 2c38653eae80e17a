// StepElements: finds the groups that have elements of a stepped array, and provides these elements
// to a column. For an array that covers only a few elements, it keeps these elements in memory from
// step to step (sparse_elements.h). The cost of a step then depends on the number of its values and
// not on the size of the mesh. For other arrays, the mesh is decoded again at each step. All
// elements of an array that is neither on points nor on cells belong to group 0. spec: "Step
// values"
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

/// Maximum number of components of an array that is coded with the codec `columns`, which needs
/// memory for each component. Arrays with more components are coded only with zstd.
inline constexpr std::uint32_t kMostStepComponents = 256;

/// Elements of a group, in the form that a column (the coder of an array) needs.
struct ColumnElements {
  const TiledItems* items = nullptr;
  std::uint32_t slots = 0;  ///< upper bound on the slots in `items`: each slot is less

  /// Upper bound on the slots of all elements of the mesh. Set only if `items` contains only some
  /// of the elements; otherwise 0.
  std::uint32_t all_slots = 0;
  /// Numbers of the covered elements, as a Reader returns them. Empty unless the ElementNeeds of
  /// the StepTopology request numbers.
  std::span<const std::uint64_t> numbers;
};

/// For each array: the number of its cover, i.e. of the set of elements for which the array has
/// values. Stepped arrays with the same cover have the same number.
using CoverNumbers = std::shared_ptr<const std::vector<std::uint32_t>>;
CoverNumbers cover_numbers(const Schema& schema);

class StepElements {
 public:
  struct OfGroup {
    std::uint32_t group = 0;
    std::uint64_t count = 0;  ///< number of elements, never 0
  };

  /// Creates an object for a mesh. `schema` must have passed check_schema(). All groups must have
  /// been added to `topology`. Both must outlive this object. `covers` is the result of
  /// cover_numbers(schema).
  StepElements(const Schema& schema, StepTopology& topology, CoverNumbers covers);

  /// Sets the total number of elements of an array. The elements are kept in memory only if this
  /// number is small. Must be called before any other function for the array.
  void expect(std::uint32_t array, std::uint64_t elements);
  /// Returns the nth group that has elements of the array, or null if no such group exists up to
  /// group `last`. The result is valid until the next call.
  Result<const OfGroup*> nth_group(std::uint32_t array, std::size_t nth, std::size_t last);
  /// Returns the number of elements of the array in the group.
  Result<std::uint64_t> count(std::uint32_t array, std::size_t group);
  /// Returns the elements of the array in a group, which must have elements of the array. The
  /// result is valid until the next call. Reading groups in order is fastest.
  Result<ColumnElements> elements(std::uint32_t array, std::size_t group);

  /// Returns the digest of the values of an array at one step in a group. `first`: index of the
  /// first element among those of the array in the whole mesh. `values`: as a reader restores them.
  /// Precondition: the topology has the numbers that digests need, see needs_of_steps().
  Result<std::uint64_t> digest(std::uint32_t array, std::uint64_t step, std::size_t group,
                               std::uint64_t first, std::span<const std::byte> values);
  std::uint32_t segment_of(std::size_t group) const { return topology_->segment_of(group); }
  /// Returns true if the elements of the array in this group have neighbourhoods.
  bool has_neighbourhoods(std::uint32_t array, std::size_t group) const {
    return is_on_mesh(schema_->arrays[array].location) && topology_->has_neighbourhoods(group);
  }
  std::size_t groups() const { return topology_->groups(); }
  std::uint64_t most_active() const { return topology_->most_active(); }
  /// Returns the number of bytes used to store the elements of arrays that cover only a few
  /// elements.
  std::size_t kept_bytes() const { return kept_bytes_; }

 private:
  /// Data shared by arrays that cover the same elements.
  struct Cover {
    std::uint32_t array = 0;      // one of the arrays that cover these elements
    bool is_sparse = false;       // true: the arrays cover few elements
    bool made = false;            // true: `sparse` has been built
    std::vector<OfGroup> groups;  // groups that have elements of the arrays
    std::size_t counted = 0;      // number of groups whose elements have been counted
    // For each of `groups`: the elements that a column (the coder of an array) needs. Filled if
    // both `made` and `is_sparse` are true.
    std::vector<SparseGroup> sparse;

    /// Returns the index in `groups` of the first group whose number is at least `group`.
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
  Result<std::span<const std::uint64_t>> numbers(std::uint32_t array, std::size_t group,
                                                 std::uint64_t first, std::size_t count);

  const Schema* schema_;
  StepTopology* topology_;
  CoverNumbers numbers_of_covers_;
  // Data of each cover (set of covered elements), by cover number.
  std::map<std::uint32_t, Cover> covers_;
  std::size_t kept_bytes_ = 0, made_at_once_ = 1;
  TiledItems unfolded_;
  std::vector<std::uint64_t> numbers_;
};

}  // namespace shm
