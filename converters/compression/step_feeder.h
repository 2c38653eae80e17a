// Passes the values of one array at one step to a callback, in coding order and in pieces.
#pragma once

#include <algorithm>
#include <cstring>
#include <vector>

#include "base/spool.h"
#include "mesh/coding_order.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Calls put(values) until the values of all elements of `array` at `step` have been passed. `order`
// lists the element numbers in coding order. If `order` is null, the coding order is the order of
// the mesh.
template <class Put>
void feed_step(MeshSource& mesh, std::size_t array, std::uint64_t step, NumberList* order,
               std::size_t cache_bytes, Put&& put) {
  constexpr std::uint64_t kPieceElements = 65536;
  const std::uint64_t elements = mesh.info().array_elements(array);
  const std::size_t stride = mesh.info().array_stride(array);
  std::vector<std::byte> values;
  std::vector<std::uint64_t> numbers;
  PageCache cache(elements, stride, cache_bytes,
                  [&](std::uint64_t first, std::uint64_t count, std::byte* out) {
                    mesh.read_array(array, step, first, count, out);
                  });
  for (std::uint64_t first = 0; first < elements; first += kPieceElements) {
    const std::uint64_t count = std::min(kPieceElements, elements - first);
    values.resize(count * stride);
    if (order == nullptr) {
      mesh.read_array(array, step, first, count, values.data());
    } else {
      order->read(first, count, numbers);
      for (std::uint64_t i = 0; i < count; ++i)
        std::memcpy(values.data() + i * stride, cache[numbers[i]], stride);
    }
    put(values);
  }
}

}  // namespace shm::converters
