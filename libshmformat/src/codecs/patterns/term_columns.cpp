#include "codecs/patterns/term_columns.h"

#include <cstdint>

#include "codecs/surface/mesh_streams.h"

namespace shm {

std::vector<TermColumn> term_columns(const Schema& schema) {
  std::vector<TermColumn> columns;
  std::uint32_t room = kMostTermComponents;
  for_each_static_column(schema, [&](const ArrayInfo& info, const auto&...) {
    const bool fits = info.components <= room;
    if (fits) room -= info.components;
    columns.emplace_back(info, fits);
  });
  return columns;
}

}  // namespace shm
