#include "vtk/between/vtk_family.h"

#include <cstring>

#include "mesh/extra_index.h"
#include "sets/transfer_sets.h"
#include "vtk/between/vtu_contents.h"

namespace shm::converters::vtk {

Entry entry_of_array(const MeshInfo& info, std::size_t array) {
  const ArrayInfo& of = info.schema.arrays[array];
  return {.kind = EntryKind::array,
          .origin = Origin::array,
          .index = array,
          .name = encode_name(of.name),
          .type = std::string(word_of_scalar(of.type)),
          .components = of.components,
          .tuples = of.location == Location::cell ? info.cells() : info.vertices};
}

Extra text_extra(std::string key, std::string_view text) {
  Extra extra{std::move(key), ScalarType::uint8, Reference::nothing, {text.size()}, {}};
  const auto* bytes = reinterpret_cast<const std::byte*>(text.data());
  extra.data.assign(bytes, bytes + text.size());
  return extra;
}

std::string quoted_array(std::string_view name) { return "array '" + std::string(name) + "'"; }

bool has_renumbered_cells(const MeshInfo& info) {
  constexpr int kLagrangeHexahedron = 72, kBezierHexahedron = 79;
  return std::any_of(info.schema.blocks.begin(), info.schema.blocks.end(),
                     [](const BlockInfo& block) {
                       return block.id == kLagrangeHexahedron || block.id == kBezierHexahedron;
                     });
}

bool is_numbered_anew(const MeshInfo& info) {
  if (!has_renumbered_cells(info)) return false;
  const ExtraIndex extras(info.extras);
  if (extras.find(kNewNumbering) != nullptr) return true;
  if (const Extra* text = extras.find("vtk/skeleton")) {
    const auto skeleton = parse_skeleton(text_of_extra(*text));
    return skeleton && skeleton->version >= "5.1";
  }
  auto contents = vtu::Contents::of(info);
  return contents && contents->version() >= "2.1";
}

}  // namespace shm::converters::vtk
