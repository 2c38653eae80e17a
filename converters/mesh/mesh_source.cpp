#include "mesh/mesh_source.h"

#include <cstring>
#include <span>
#include <utility>

namespace shm::converters {
namespace {

template <class T>
Extra extra_of(std::string key, ScalarType type, Reference refers, std::span<const T> values) {
  const auto bytes = std::as_bytes(values);
  Extra extra{std::move(key), type, refers, {values.size()}, {}};
  extra.data.assign(bytes.begin(), bytes.end());
  return extra;
}

}  // namespace

const Extra* find_extra(const MeshInfo& info, std::string_view key) {
  for (const Extra& extra : info.extras)
    if (extra.key == key) return &extra;
  return nullptr;
}

std::string text_of_extra(const Extra& extra) {
  if (extra.type != ScalarType::uint8 || extra.data.empty()) return {};
  return {reinterpret_cast<const char*>(extra.data.data()), extra.data.size()};
}

std::vector<std::int64_t> integers_of_extra(const Extra& extra) {
  std::vector<std::int64_t> values;
  const auto read = [&](auto value) {
    for (std::size_t at = 0; at + sizeof value <= extra.data.size(); at += sizeof value) {
      std::memcpy(&value, extra.data.data() + at, sizeof value);
      values.push_back(value);
    }
  };
  if (extra.type == ScalarType::int32) read(std::int32_t{});
  if (extra.type == ScalarType::int64) read(std::int64_t{});
  return values;
}

Extra text_extra(std::string key, std::string_view text) {
  return extra_of(std::move(key), ScalarType::uint8, Reference::nothing, std::span(text));
}

Extra integers_extra(std::string key, const std::vector<std::int64_t>& values, Reference refers) {
  return extra_of(std::move(key), ScalarType::int64, refers, std::span(values));
}

Extra integers_extra(std::string key, const std::vector<std::int32_t>& values, Reference refers) {
  return extra_of(std::move(key), ScalarType::int32, refers, std::span(values));
}

}  // namespace shm::converters
