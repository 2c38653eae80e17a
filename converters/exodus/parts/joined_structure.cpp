#include "exodus/parts/joined_structure.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

#include "exodus/describe.h"
#include "exodus/join.h"
#include "exodus/parts/joined_sets.h"
#include "exodus/parts/messages.h"

namespace shm::converters {
namespace {

using namespace exodus;

using ValuesByName = std::map<std::string, std::vector<std::byte>>;

class JoinedValues final : public VariableValues {
 public:
  JoinedValues(const Skeleton& skeleton, const ValuesByName& values)
      : skeleton_(skeleton), values_(values) {}
  std::vector<std::byte> rows(int variable, std::uint64_t first,
                              std::uint64_t count) const override {
    const Variable& one = skeleton_.variables[static_cast<std::size_t>(variable)];
    const auto found = values_.find(one.name);
    if (found == values_.end()) return {};
    const std::vector<std::byte>& all = found->second;
    const auto shape = skeleton_.shape(one);
    if (shape.empty() || shape[0] == count || shape[0] == 0) return all;
    const std::uint64_t row = all.size() / shape[0];
    return {all.begin() + static_cast<std::ptrdiff_t>(first * row),
            all.begin() + static_cast<std::ptrdiff_t>((first + count) * row)};
  }

 private:
  const Skeleton& skeleton_;
  const ValuesByName& values_;
};

// Combines the flags (integers that are 0 or 1) of two parts with a logical OR, and stores the
// result in `known`.
void unite(std::vector<std::byte>& known, const std::vector<std::byte>& more) {
  for (std::size_t i = 0; i < std::min(known.size(), more.size()); ++i) known[i] |= more[i];
}

class Joiner {
 public:
  explicit Joiner(PartFiles& parts) : parts_(parts), ranks_(parts.ranks()) {}

  JoinedStructure join() {
    join_skeletons();
    gather_values();
    tell_all();
    ranks_.together([&] { compare(); });
    return std::move(out_);
  }

 private:
  void join_skeletons();
  void gather_values();
  void pack_values(const PartFile& part, Packer& out) const;
  void take_values(std::span<const std::byte> bytes);
  void check_joinable(const PartFile& part) const;
  void tell_all();
  void compare() const;

  Place place() const { return {parts_.names().front(), ErrorCode::corrupt}; }
  // Collective. Sends the bytes of each rank to rank 0. Rank 0 calls take(bytes) for each rank, in
  // order of the ranks.
  template <class Take>
  void collect(const std::vector<std::byte>& bytes, Take&& take) {
    std::optional<Error> error;
    ranks_.gather(bytes, [&](std::size_t, const std::vector<std::byte>& got) {
      try {
        if (!error) take(std::span<const std::byte>(got));
      } catch (...) {
        error = current_error();
      }
    });
    ranks_.agree(error);
  }

  PartFiles& parts_;
  Ranks& ranks_;
  SkeletonJoin skeletons_;  // joins the structures of the parts; used only on rank 0

  // For each variable whose values come from a single part (Joining::same and Joining::first), the
  // index of that part.
  std::map<std::string, std::uint64_t> suppliers_;
  Skeleton skeleton_;  // structure of the whole mesh; the lengths of set dimensions are upper
                       // bounds
  // The key is the name of the dimension that counts the members of the set.
  std::map<std::string, SetJoin> sets_;
  ValuesByName values_;
  JoinedStructure out_;
};

void Joiner::join_skeletons() {
  Packer mine;
  ranks_.together([&] {
    for (const PartFile& part : parts_.mine()) {
      mine.put(std::uint64_t{part.part});
      mine.put_text(to_text(part.mesh->skeleton()));
    }
  });
  collect(mine.bytes, [&](std::span<const std::byte> bytes) {
    for (Unpacker in(bytes); !in.empty();) {
      const auto number = in.get<std::uint64_t>();
      const std::string& file = parts_.names()[number];
      const Skeleton skeleton = from_text(in.get_text(), {file, ErrorCode::corrupt});
      skeletons_.add(skeleton, file);
      for (const Variable& variable : skeleton.variables) {
        const Joining how = joining_of(skeleton, variable);
        if (how == Joining::same || how == Joining::first)
          suppliers_.emplace(variable.name, number);
      }
    }
  });
  Packer all;
  ranks_.together([&] {
    if (!ranks_.first()) return;
    all.put_text(to_text(skeletons_.joined({{"num_nodes", parts_.vertices()}})));
    for (const auto& [name, part] : suppliers_) {
      all.put_text(name);
      all.put(part);
    }
  });
  all.bytes = ranks_.broadcast(std::move(all.bytes));
  ranks_.together([&] {
    Unpacker in(all.bytes);
    skeleton_ = from_text(in.get_text(), place());
    while (!in.empty()) {
      std::string name = in.get_text();
      suppliers_[std::move(name)] = in.get<std::uint64_t>();
    }
    sets_ = sets_of(skeleton_, place());
  });
}

// Throws Failure if the part has a variable that cannot be joined: it has values for nodes or
// elements, but is not an array of the part's mesh.
void Joiner::check_joinable(const PartFile& part) const {
  const Skeleton& skeleton = part.mesh->skeleton();
  const Layout& layout = part.mesh->layout();
  for (std::size_t v = 0; v < skeleton.variables.size(); ++v) {
    const Variable& variable = skeleton.variables[v];
    if (layout.uses[v] == Use::extra && joining_of(skeleton, variable) == Joining::elements)
      throw Failure(Error{.code = ErrorCode::unsupported,
                          .detail = "has values for nodes or elements that cannot be joined",
                          .section = "variable '" + variable.name + "'",
                          .file = part.file});
  }
  for (const ArrayLayout& array : layout.arrays)
    if (array.info.role == "exodus:connectivity")
      throw Failure(Error{.code = ErrorCode::unsupported,
                          .detail = "parts with elements of this type cannot be joined",
                          .section = "variable '" + array.info.name + "'",
                          .file = part.file});
}

// Packs the data of a part that rank 0 joins: the names and values of variables, and the dimensions
// and rows of sets.
void Joiner::pack_values(const PartFile& part, Packer& out) const {
  const Skeleton& skeleton = part.mesh->skeleton();
  const VariableIndex own(skeleton);
  for (const Variable& variable : skeleton_.variables) {
    const int index = own.find(variable.name);
    if (index < 0) continue;
    const Joining how = joining_of(skeleton_, variable);
    const bool one = how == Joining::same || how == Joining::first;
    if (how != Joining::any && !(one && suppliers_.at(variable.name) == part.part)) continue;
    out.put_text(variable.name);
    out.put_bytes(whole_variable(skeleton, *part.mesh, index));
  }
  for (const auto& [dimension, set] : sets_) {
    if (skeleton.length_of(dimension) == 0) continue;
    out.put_text(dimension);
    out.put_bytes(set.rows_of(part, own));
  }
}

void Joiner::take_values(std::span<const std::byte> bytes) {
  for (Unpacker in(bytes); !in.empty();) {
    const auto part = in.get<std::uint64_t>();
    for (Unpacker of_part(in.get_bytes()); !of_part.empty();) {
      const std::string name = of_part.get_text();
      const auto got = of_part.get_bytes();
      if (const auto set = sets_.find(name); set != sets_.end()) {
        set->second.add(got, parts_.names()[part]);
        continue;
      }
      const auto [known, fresh] = values_.try_emplace(name, got.begin(), got.end());
      if (!fresh) unite(known->second, {got.begin(), got.end()});
    }
  }
}

void Joiner::gather_values() {
  Packer mine;
  ranks_.together([&] {
    for (const PartFile& part : parts_.mine()) {
      check_joinable(part);
      Packer values;
      pack_values(part, values);
      mine.put(std::uint64_t{part.part});
      mine.put_bytes(values.bytes);
    }
  });
  collect(mine.bytes, [&](std::span<const std::byte> bytes) { take_values(bytes); });
}

void Joiner::tell_all() {
  Packer all;
  ranks_.together([&] {
    if (!ranks_.first()) return;
    std::map<std::string, std::uint64_t> lengths{{"num_nodes", parts_.vertices()}};
    for (auto& [dimension, set] : sets_) set.finish(lengths, values_);
    all.put_text(to_text(skeletons_.joined(lengths)));
    for (const auto& [name, values] : values_) {
      all.put_text(name);
      all.put_bytes(values);
    }
    sets_.clear();
    values_.clear();
  });
  all.bytes = ranks_.broadcast(std::move(all.bytes));
  ranks_.together([&] {
    Unpacker in(all.bytes);
    out_.skeleton = from_text(in.get_text(), place());
    while (!in.empty()) {
      std::string name = in.get_text();
      const auto values = in.get_bytes();
      values_.emplace(std::move(name), std::vector<std::byte>(values.begin(), values.end()));
    }
    out_.layout = lay_out(out_.skeleton, place(), true);
    const JoinedValues values(out_.skeleton, values_);
    out_.info = describe(out_.skeleton, out_.layout, values, place());
    for (const ArrayLayout& array : out_.layout.arrays)
      for (const ArrayPart& part : array.parts)
        if (!is_on_mesh(array.info.location) && !out_.beside_mesh.contains(part.variable))
          out_.beside_mesh.emplace(part.variable,
                                   whole_variable(out_.skeleton, values, part.variable));
  });
}

// Throws Failure if a variable that must be equal in all parts (Joining::same) differs in one of
// this rank's parts.
void Joiner::compare() const {
  for (const PartFile& part : parts_.mine()) {
    const Skeleton& skeleton = part.mesh->skeleton();
    for (std::size_t v = 0; v < skeleton.variables.size(); ++v) {
      const Variable& variable = skeleton.variables[v];
      if (joining_of(skeleton, variable) != Joining::same) continue;
      const auto all = values_.find(variable.name);
      if (all != values_.end() &&
          all->second != whole_variable(skeleton, *part.mesh, static_cast<int>(v)))
        throw Failure(Error{
            .code = ErrorCode::corrupt,
            .detail = "has values that differ from " + parts_.names()[suppliers_.at(variable.name)],
            .section = "variable '" + variable.name + "'",
            .file = part.file});
    }
  }
}

}  // namespace

JoinedStructure join_structure(PartFiles& parts) { return Joiner(parts).join(); }

}  // namespace shm::converters
