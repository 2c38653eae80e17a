// Rank table: the indices that a component uses in a group, in ascending order. An entry is coded
// either as an entry of an earlier table, or as its distance from the previous entry.
// spec: "Value domains", tables
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "codecs/shared/value_domain.h"
#include "entropy/models.h"

namespace shm {

struct RankTableModels {
  CompactNumberModel entries, step, skipped;
  SignedModel<CompactNumberModel> first_entry;
  // Models of the decision whether the distance equals a recent distance. The index is the position
  // in the list of recent distances
  std::array<AdaptiveBit, 4> same_step;
  // Models of the decision whether an entry occurs in an earlier table. The index combines the
  // previous three decisions
  std::array<AdaptiveBit, 8> known_entry;
};

/// Appends to `known` the entries of a table, and the indices of the negated values of these
/// entries.
void add_known_entries(std::span<const std::int64_t> table, DomainKind kind,
                       std::vector<std::int64_t>& known);

/// Codes a table. Precondition: the table is not empty. `known`: entries of other tables, in any
/// order. Returns false if the data is damaged, or if the table has more than `most_entries`
/// entries.
template <class Coder>
bool code_rank_table(Coder& coder, RankTableModels& models, DomainKind kind,
                     std::vector<std::int64_t> known, std::uint64_t most_entries,
                     std::vector<std::int64_t>& table);

}  // namespace shm
