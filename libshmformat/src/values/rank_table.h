// Rank tables: which indices of its domain a component has in a group, ascending: entry by entry,
// each one that another table has too, or by its distance from the last.
// spec: "Value domains", tables
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "entropy/models.h"
#include "values/value_domain.h"

namespace shm {

struct RankTableModels {
  CompactNumberModel entries, step, skipped;
  SignedModel<CompactNumberModel> first_entry;
  std::array<AdaptiveBit, 4> same_step;    // as one of the last
  std::array<AdaptiveBit, 8> known_entry;  // by the last three
};

/// Entries of some table that one of this kind may have too: of either sign.
void add_known_entries(std::span<const std::int64_t> table, DomainKind kind,
                       std::vector<std::int64_t>& known);

/// Codes a table that is not empty. `known`: entries of other tables, in any order. False for
/// damaged data, and for more than `most_entries`.
template <class Coder>
bool code_rank_table(Coder& coder, RankTableModels& models, DomainKind kind,
                     std::vector<std::int64_t> known, std::uint64_t most_entries,
                     std::vector<std::int64_t>& table);

}  // namespace shm
