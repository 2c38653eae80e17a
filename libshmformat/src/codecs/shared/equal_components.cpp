#include "codecs/shared/equal_components.h"

#include <cstring>

namespace shm {

std::optional<std::size_t> equal_component(const ArrayInfo& info, const std::byte* values,
                                           std::size_t stride, std::size_t count,
                                           std::size_t component) {
  const std::size_t width = scalar_bytes(info.type);
  const auto are_equal = [&](std::size_t other) {
    for (const auto* bounds : {&info.quantization.minimum, &info.quantization.maximum})
      if (!bounds->empty() && (*bounds)[component] != (*bounds)[other]) return false;
    for (std::size_t e = 0; e < count; ++e) {
      const std::byte* const element = values + e * stride;
      if (std::memcmp(element + component * width, element + other * width, width) != 0)
        return false;
    }
    return true;
  };
  for (std::size_t other = 0; other < component; ++other)
    if (are_equal(other)) return other;
  return std::nullopt;
}

void put_copy(ByteWriter& out, std::size_t source) {
  out.put_u8(kCopiedComponent);
  out.put_varint(source);
}

std::optional<std::size_t> get_source(ByteReader& in, std::size_t component) {
  const std::uint64_t source = in.get_varint();
  if (!in.ok() || source >= component) return std::nullopt;
  return static_cast<std::size_t>(source);
}

}  // namespace shm
