#include "shm/recorded_order.h"

#include <cstring>
#include <numeric>
#include <span>
#include <string>
#include <utility>

#include "api/positions.h"
#include "base/errors.h"

namespace shm {
namespace {

constexpr std::uint64_t kUnset = ~std::uint64_t{0};

Error not_counted(std::size_t vertices) {
  return misuse("the vertices are not numbered from 0 to " + std::to_string(vertices - 1) +
                    ", each number once",
                "coding order");
}

template <class T>
void replace(std::span<std::byte> values, const std::vector<std::uint64_t>& position) {
  for (std::size_t offset = 0; offset + sizeof(T) <= values.size(); offset += sizeof(T)) {
    T number{};
    std::memcpy(&number, values.data() + offset, sizeof number);
    if (number < 0 || static_cast<std::uint64_t>(number) >= position.size()) continue;
    number = static_cast<T>(position[static_cast<std::size_t>(number)]);
    std::memcpy(values.data() + offset, &number, sizeof number);
  }
}

}  // namespace

Result<std::vector<std::uint64_t>> RecordedOrder::elements(
    const Schema& schema, std::size_t array, std::span<const std::uint32_t> cell_blocks) const {
  if (array >= schema.arrays.size())
    return misuse("there is no array " + std::to_string(array), "coding order");
  const ArrayInfo& info = schema.arrays[array];
  if (!is_on_mesh(info.location)) {
    std::vector<std::uint64_t> numbers(static_cast<std::size_t>(info.elements));
    std::iota(numbers.begin(), numbers.end(), std::uint64_t{0});
    return numbers;
  }
  if (info.location == Location::point) {
    if (positions_in(vertices).size() != vertices.size()) return not_counted(vertices.size());
    return vertices;
  }
  if (positions_in(cells).size() != cells.size())
    return misuse("the cells are not numbered from 0 to " + std::to_string(cells.size() - 1) +
                      ", each number once",
                  "coding order");
  if (info.blocks.empty()) return cells;
  if (cell_blocks.size() != cells.size())
    return misuse("cell_blocks has " + std::to_string(cell_blocks.size()) +
                      " elements, but the number of cells is " + std::to_string(cells.size()),
                  "coding order");
  std::vector<std::uint64_t> element(cells.size(), kUnset);
  std::uint64_t count = 0;
  for (std::size_t c = 0; c < cells.size(); ++c)
    if (schema.array_covers(array, cell_blocks[c])) element[c] = count++;
  std::vector<std::uint64_t> coded;
  coded.reserve(static_cast<std::size_t>(count));
  for (const std::uint64_t c : cells)
    if (element[static_cast<std::size_t>(c)] != kUnset)
      coded.push_back(element[static_cast<std::size_t>(c)]);
  return coded;
}

Result<void> RecordedOrder::renumber(Extra& extra) const {
  if (extra.refers == Reference::nothing) return {};
  const bool of_vertices = extra.refers == Reference::vertex;
  const auto& order = of_vertices ? vertices : cells;
  const auto position = positions_in(order);
  if (position.size() != order.size()) return not_counted(order.size());
  if (extra.type == ScalarType::int32)
    replace<std::int32_t>(extra.data, position);
  else if (extra.type == ScalarType::int64)
    replace<std::int64_t>(extra.data, position);
  else
    return misuse("references must be int32 or int64", extra.key);
  return {};
}

}  // namespace shm
