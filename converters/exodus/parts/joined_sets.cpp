#include "exodus/parts/joined_sets.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <tuple>
#include <utility>

#include "exodus/describe.h"
#include "exodus/parts/messages.h"
#include "sets/cell_sides.h"

namespace shm::converters {
namespace {

using namespace exodus;

[[noreturn]] void fail(const std::string& file, ErrorCode code, const std::string& variable,
                       const std::string& detail) {
  throw Failure(Error{
      .code = code, .detail = detail, .section = "variable '" + variable + "'", .file = file});
}

}  // namespace

std::map<std::string, SetJoin> sets_of(const Skeleton& skeleton, const Place& place) {
  std::map<std::string, SetJoin> sets;
  for (const Variable& variable : skeleton.variables) {
    if (joining_of(skeleton, variable) != Joining::members) continue;
    const SetPlace where = set_place(skeleton, variable).value();
    std::string dimension = std::string(where.set->prefix) + where.number;
    SetJoin& set = sets.try_emplace(dimension, dimension, *where.set).first->second;
    const std::uint64_t bytes = scalar_bytes(scalar_of(variable.type));
    const bool list = variable.dimensions.size() == 1;
    const auto refuse = [&] {
      fail(place.file, ErrorCode::unsupported, variable.name,
           "has a shape for which the values of the parts cannot be joined");
    };
    if (variable.type == NC_STRING) refuse();
    if (where.factors) {
      if (!list || !set.factors_.empty()) refuse();
      set.factors_ = variable.name;
      set.factor_dimension_ = skeleton.dimension_name(variable, 0);
      set.factor_bytes_ = bytes;
    } else if (variable.name == std::string(where.set->members) + where.number) {
      if (!list || !is_integer(variable.type)) refuse();
      set.members_ = variable.name;
      set.member_type_ = scalar_of(variable.type);
    } else {
      if (where.set->has_sides && variable.name == "side_ss" + where.number) {
        if (!list || !is_integer(variable.type)) refuse();
        set.sides_ = variable.name;
      }
      SetJoin::Column column{variable.name, where.at, 1, bytes};
      const auto shape = skeleton.shape(variable);
      for (std::size_t d = 0; d < shape.size(); ++d) {
        if (d == where.at) continue;
        std::uint64_t& product = d < where.at ? column.outer : column.inner;
        if (__builtin_mul_overflow(product, shape[d], &product)) refuse();
      }
      set.columns_.push_back(column);
    }
  }
  for (const auto& [dimension, set] : sets)
    if (set.members_.empty() || (set.set_->has_sides && set.sides_.empty()))
      place.fail(ErrorCode::corrupt, "dimension '" + dimension + "'",
                 "counts members of a set, but no variable lists them");
  return sets;
}

std::vector<std::uint64_t> SetJoin::factors_of_rows(const PartFile& part,
                                                    const std::vector<std::int64_t>& members,
                                                    const std::vector<std::int64_t>& sides,
                                                    std::uint64_t factors) const {
  std::vector<std::uint64_t> counts(members.size(), 1);
  if (set_->has_sides) {
    const auto& blocks = part.mesh->layout().blocks;
    const bool flat = part.mesh->skeleton().length_of("num_dim") == 2;
    std::vector<std::uint64_t> ends;
    for (const BlockLayout& block : blocks)
      ends.push_back((ends.empty() ? 0 : ends.back()) + block.cells);
    SideFinder finder;
    std::map<std::pair<std::size_t, std::int64_t>, std::uint64_t> known;
    for (std::size_t i = 0; i < members.size(); ++i) {
      const auto index =
          std::upper_bound(ends.begin(), ends.end(), static_cast<std::uint64_t>(members[i] - 1)) -
          ends.begin();
      const auto b = static_cast<std::size_t>(index);
      const auto [found, fresh] = known.try_emplace({b, sides[i]}, 0);
      if (fresh && sides[i] > 0)
        found->second = finder.nodes_of_side(
            {0, {}, blocks[b].shape, blocks[b].nodes_per_cell, NodeScheme::lagrange},
            static_cast<std::uint64_t>(sides[i]), flat);
      counts[i] = found->second;
    }
  }
  if (std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}) != factors)
    fail(part.file, ErrorCode::unsupported, factors_,
         "has " + std::to_string(factors) +
             " distribution factors; expected one per member, or one per node of each side");
  return counts;
}

std::vector<std::byte> SetJoin::rows_of(const PartFile& part, const VariableIndex& own) const {
  const Skeleton& skeleton = part.mesh->skeleton();
  const std::uint64_t count = skeleton.length_of(dimension_);
  const auto index_of = [&](const std::string& name) {
    const int index = own.find(name);
    if (index < 0)
      fail(part.file, ErrorCode::corrupt, name,
           "is missing, although this part has members of the set");
    return index;
  };
  const auto members = part.mesh->integers(index_of(members_), 0, count);
  std::vector<std::int64_t> sides(count);
  if (!sides_.empty()) sides = part.mesh->integers(index_of(sides_), 0, count);
  const auto& numbers = set_->of_nodes ? part.vertices : part.cells;
  for (const std::int64_t member : members)
    if (member < 1 || std::cmp_greater(member, numbers.size()))
      fail(part.file, ErrorCode::corrupt, members_,
           "has member " + std::to_string(member) + " of " + std::to_string(numbers.size()));

  std::vector<std::vector<std::byte>> values;
  for (const Column& column : columns_) {
    values.push_back(whole_variable(skeleton, *part.mesh, index_of(column.variable)));
    if (values.back().size() != count * column.outer * column.inner)
      fail(part.file, ErrorCode::corrupt, column.variable, "has a different shape in other parts");
  }
  std::vector<std::byte> factors;
  std::vector<std::uint64_t> factor_counts(count);
  if (!factors_.empty()) {
    factors = whole_variable(skeleton, *part.mesh, index_of(factors_));
    factor_counts = factors_of_rows(part, members, sides, factors.size() / factor_bytes_);
  }
  Packer out;
  const std::byte* factor = factors.data();
  for (std::size_t i = 0; i < count; ++i) {
    out.put(numbers[static_cast<std::size_t>(members[i] - 1)]);
    out.put(static_cast<std::uint64_t>(sides[i]));
    const std::uint64_t factor_size = factor_counts[i] * factor_bytes_;
    std::vector<std::byte> row;
    for (std::size_t c = 0; c < columns_.size(); ++c)
      for (std::uint64_t o = 0; o < columns_[c].outer; ++o) {
        const std::byte* from = values[c].data() + (o * count + i) * columns_[c].inner;
        row.insert(row.end(), from, from + columns_[c].inner);
      }
    row.insert(row.end(), factor, factor + factor_size);
    factor += factor_size;
    out.put_bytes(row);
  }
  return std::move(out.bytes);
}

void SetJoin::add(std::span<const std::byte> rows, const std::string& file) {
  for (Unpacker in(rows); !in.empty();) {
    Row row;
    row.member = in.get<std::uint64_t>();
    row.side = in.get<std::uint64_t>();
    row.part = files_.size();
    const auto bytes = in.get_bytes();
    row.begin = bytes_.size();
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    row.end = bytes_.size();
    rows_.push_back(row);
  }
  files_.push_back(file);
}

void SetJoin::finish(std::map<std::string, std::uint64_t>& lengths,
                     std::map<std::string, std::vector<std::byte>>& values) {
  std::stable_sort(rows_.begin(), rows_.end(), [](const Row& a, const Row& b) {
    return std::tie(a.member, a.side) < std::tie(b.member, b.side);
  });
  if (set_->of_nodes) {
    // If several parts contain a row for the same node, keep only one of these rows.
    const auto same = [&](const Row& a, const Row& b) {
      if (a.member != b.member) return false;
      if (!std::equal(bytes_.begin() + static_cast<std::ptrdiff_t>(a.begin),
                      bytes_.begin() + static_cast<std::ptrdiff_t>(a.end),
                      bytes_.begin() + static_cast<std::ptrdiff_t>(b.begin),
                      bytes_.begin() + static_cast<std::ptrdiff_t>(b.end)))
        fail(files_[b.part], ErrorCode::corrupt, members_,
             "the values of node " + std::to_string(a.member + 1) + " of the mesh in this set " +
                 "differ from those in " + files_[a.part]);
      return true;
    };
    rows_.erase(std::unique(rows_.begin(), rows_.end(), same), rows_.end());
  }
  lengths[dimension_] = rows_.size();
  std::vector<std::byte>& members = values[members_];
  for (const Row& row : rows_)
    if (!append_integer(members, member_type_, static_cast<std::int64_t>(row.member + 1)))
      fail(files_[row.part], ErrorCode::over_limit, members_,
           "has a type that cannot hold the numbers of the whole mesh");
  std::uint64_t offset = 0;  // offset of the column in a row
  for (const Column& column : columns_) {
    std::vector<std::byte>& all = values[column.variable];
    for (std::uint64_t o = 0; o < column.outer; ++o)
      for (const Row& row : rows_) {
        const auto from =
            bytes_.begin() + static_cast<std::ptrdiff_t>(row.begin + offset + o * column.inner);
        all.insert(all.end(), from, from + static_cast<std::ptrdiff_t>(column.inner));
      }
    offset += column.outer * column.inner;
  }
  if (factors_.empty()) return;
  std::vector<std::byte>& factors = values[factors_];
  for (const Row& row : rows_)
    factors.insert(factors.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(row.begin + offset),
                   bytes_.begin() + static_cast<std::ptrdiff_t>(row.end));
  lengths[factor_dimension_] = factors.size() / factor_bytes_;
}

}  // namespace shm::converters
