// SetJoin: joins the parts of one set of nodes, sides or elements in a decomposed Exodus mesh. A
// row consists of a member of the set and all its values. The rows of all parts are collected, and
// sorted by the number of the member in the whole mesh.
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
  // `dimension` is the name of the netCDF dimension that gives the number of members of the set in
  // the file with the whole mesh.
  SetJoin(std::string dimension, const exodus::SetDimension& set)
      : dimension_(std::move(dimension)), set_(&set) {}

  // Returns the rows of the set in a part, packed as a message to other ranks. The part must
  // contain members of the set. Throws Failure; the error names the part's file.
  std::vector<std::byte> rows_of(const PartFile& part, const exodus::VariableIndex& own) const;
  // Adds the rows of a part, as returned by rows_of(). `file` is the name of the part's file.
  void add(std::span<const std::byte> rows, const std::string& file);
  // Stores the lengths of the set's dimensions in `lengths`, and the joined values of its variables
  // in `values`. If a node is a member in several parts, it becomes one member. Throws Failure if
  // the values of this node differ between the parts.
  void finish(std::map<std::string, std::uint64_t>& lengths,
              std::map<std::string, std::vector<std::byte>>& values);

 private:
  friend std::map<std::string, SetJoin> sets_of(const exodus::Skeleton& skeleton,
                                                const exodus::Place& place);
  // A variable of the set. The values of the variable for one row have `outer` * `inner` bytes. In
  // the variable, these bytes are in `outer` separate runs of `inner` bytes.
  struct Column {
    std::string variable;
    std::size_t at = 0;  // index of the variable's dimension that counts the rows
    std::uint64_t outer = 1, inner = 1;
  };
  struct Row {
    std::uint64_t member = 0, side = 0;
    // Index of the part from which the row came, and the begin and end of the row in bytes_. A row
    // contains the values of all columns, followed by its distribution factors.
    std::size_t part = 0, begin = 0, end = 0;
  };
  std::vector<std::uint64_t> factors_of_rows(const PartFile& part,
                                             const std::vector<std::int64_t>& members,
                                             const std::vector<std::int64_t>& sides,
                                             std::uint64_t factors) const;

  std::string dimension_;
  const exodus::SetDimension* set_;
  // Names of the variables that contain the members, sides and distribution factors, and of the
  // dimension that counts the factors. A name is empty if the set does not have the variable or
  // dimension.
  std::string members_, sides_, factors_, factor_dimension_;
  ScalarType member_type_ = ScalarType::int32;
  std::uint64_t factor_bytes_ = 0;
  std::vector<Column> columns_;
  std::vector<Row> rows_;
  std::vector<std::byte> bytes_;
  std::vector<std::string> files_;
};

// Returns a SetJoin for each set of a structure. The key is the name of the dimension that counts
// the members of the set. Throws Failure (unsupported) if a variable cannot be joined.
std::map<std::string, SetJoin> sets_of(const exodus::Skeleton& skeleton,
                                       const exodus::Place& place);

}  // namespace shm::converters
