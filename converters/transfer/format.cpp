#include "transfer/format.h"

#include <utility>

namespace shm::converters {

std::vector<TransferSet> transfer_sets(const MeshInfo& info, Keys& used) {
  std::vector<TransferSet> sets = source_format(info).sets(info, used);
  for (TransferSet& set : sets_of_extras(info, used)) sets.push_back(std::move(set));
  return sets;
}

}  // namespace shm::converters
