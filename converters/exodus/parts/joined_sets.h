// SetJoin: joins one set of nodes, sides or elements of a decomposed Exodus mesh. A row consists of
// a member and all its values. The rows come from all parts and are sorted by the members' numbers
// in the whole mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "exodus/join.h"
#include "exodus/parts/part_files.h"
#include "exodus/skeleton.h"

namespace shm::converters {

class SetJoin {
 public:
  // `dimension`: name of the dimension that counts the members in the joined structure.
  SetJoin(std::string dimension, const exodus::SetDimension& set)
      : dimension_(std::move(dimension)), set_(&set) {}

  // Returns the rows of a part as a message. The part must have members. Throws Failure; the error
  // names the file.
  std::vector<std::byte> rows_of(const PartFile& part, const exodus::VariableIndex& own) const;
  // Adds the rows of a part. `file`: name of the part's file.
  void add(std::span<const std::byte> rows, const std::string& file);
  // Stores the lengths of dimensions and the values of variables for all rows. A node that occurs
  // in several parts becomes one member. Throws Failure if the parts have different values for this
  // node.
  void finish(std::map<std::string, std::uint64_t>& lengths,
              std::map<std::string, std::vector<std::byte>>& values);

 private:
  friend std::map<std::string, SetJoin> sets_of(const exodus::Skeleton& skeleton,
                                                const exodus::Place& place);
  // A variable that has `outer` runs of `inner` bytes in each row.
  struct Column {
    std::string variable;
    std::size_t at = 0;  // index of the dimension that counts the rows
    std::uint64_t outer = 1, inner = 1;
  };
  struct Row {
    std::uint64_t member = 0, side = 0;
    // Begin and end of the row in bytes_: columns, then factors.
    std::size_t part = 0, begin = 0, end = 0;
  };
  std::vector<std::uint64_t> factors_of_rows(const PartFile& part,
                                             const std::vector<std::int64_t>& members,
                                             const std::vector<std::int64_t>& sides,
                                             std::uint64_t factors) const;

  std::string dimension_;
  const exodus::SetDimension* set_;
  // Names of the variables and of the dimension of factors; empty if there are none.
  std::string members_, sides_, factors_, factor_dimension_;
  ScalarType member_type_ = ScalarType::int32;
  std::uint64_t factor_bytes_ = 0;
  std::vector<Column> columns_;
  std::vector<Row> rows_;
  std::vector<std::byte> bytes_;
  std::vector<std::string> files_;
};

// Returns the sets, by the dimension that counts their members. Throws Failure (unsupported) if a
// variable cannot be joined.
std::map<std::string, SetJoin> sets_of(const exodus::Skeleton& skeleton,
                                       const exodus::Place& place);

}  // namespace shm::converters
