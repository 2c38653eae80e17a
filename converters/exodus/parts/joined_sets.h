// SetJoin: one set of nodes, sides or elements of a decomposed Exodus mesh. Rows are members with
// all values that stand for them; they come from all parts, and are put into the order of their
// numbers in the whole mesh.
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
  // `dimension` counts the members in the joined structure.
  SetJoin(std::string dimension, const exodus::SetDimension& set)
      : dimension_(std::move(dimension)), set_(&set) {}

  // The rows of a part, which has some, as a message. Throws Failure, naming the file.
  std::vector<std::byte> rows_of(const PartFile& part, const exodus::VariableIndex& own) const;
  // `rows` of a part in `file`.
  void add(std::span<const std::byte> rows, const std::string& file);
  // Lengths of dimensions and values of variables of all rows. A node that is in several parts is
  // one member; throws Failure where these disagree about it.
  void finish(std::map<std::string, std::uint64_t>& lengths,
              std::map<std::string, std::vector<std::byte>>& values);

 private:
  friend std::map<std::string, SetJoin> sets_of(const exodus::Skeleton& skeleton,
                                                const exodus::Place& place);
  // A variable of which each row has so many bytes in each place of the dimensions before it.
  struct Column {
    std::string variable;
    std::size_t at = 0;  // of the dimension of rows
    std::uint64_t outer = 1, inner = 1;
  };
  struct Row {
    std::uint64_t member = 0, side = 0;
    std::size_t part = 0, begin = 0, end = 0;  // in bytes_: columns, then factors
  };
  std::vector<std::uint64_t> factors_of_rows(const PartFile& part,
                                             const std::vector<std::int64_t>& members,
                                             const std::vector<std::int64_t>& sides,
                                             std::uint64_t factors) const;

  std::string dimension_;
  const exodus::SetDimension* set_;
  std::string members_, sides_, factors_, factor_dimension_;  // variables, where there are such
  ScalarType member_type_ = ScalarType::int32;
  std::uint64_t factor_bytes_ = 0;
  std::vector<Column> columns_;
  std::vector<Row> rows_;
  std::vector<std::byte> bytes_;
  std::vector<std::string> files_;
};

// By the dimension of their members. Throws Failure (unsupported) for what cannot be joined.
std::map<std::string, SetJoin> sets_of(const exodus::Skeleton& skeleton,
                                       const exodus::Place& place);

}  // namespace shm::converters
