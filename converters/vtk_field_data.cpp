#include "vtk_field_data.h"

#include <cstring>
#include <utility>
#include <vector>

#include "text_input.h"
#include "transfer_sets.h"
#include "vtk_words.h"

namespace shm::converters {
namespace {

// The field data of that name, null when there is none.
const Extra* field_data(const MeshInfo& info, std::string_view name, bool& binary) {
  if (info.schema.source_format != "vtk") return nullptr;
  const Extra* text = find_extra(info, "vtk/skeleton");
  if (text == nullptr) return nullptr;
  const auto skeleton = vtk::parse_skeleton(text_of_extra(*text));
  if (!skeleton) return nullptr;
  binary = skeleton->binary;
  for (const vtk::Entry& entry : skeleton->entries)
    if (entry.origin == vtk::Origin::extra && entry.kind == vtk::EntryKind::array &&
        vtk::decode_name(entry.name) == name)
      return find_extra(info, vtk::data_key(entry.index));
  return nullptr;
}

// A string of a binary file: its length in 6, 14 or 30 bits, whose first byte says which by its two
// highest bits, then its bytes.
void put_string(std::string& out, const std::string& text) {
  const std::size_t size = text.size();
  if (size < 1 << 6) {
    out += static_cast<char>(0xC0 | size);
  } else if (size < 1 << 14) {
    out += {static_cast<char>(0x80 | (size >> 8)), static_cast<char>(size & 0xFF)};
  } else {
    out += {static_cast<char>(0x40 | ((size >> 24) & 0x3F)), static_cast<char>((size >> 16) & 0xFF),
            static_cast<char>((size >> 8) & 0xFF), static_cast<char>(size & 0xFF)};
  }
  out += text;
}

std::vector<std::string> binary_strings(std::string_view raw) {
  std::vector<std::string> strings;
  while (!raw.empty()) {
    const auto first = static_cast<unsigned char>(raw[0]);
    const std::size_t more = first >= 0xC0 ? 0 : first >= 0x80 ? 1 : first >= 0x40 ? 3 : 7;
    if (raw.size() <= more) break;
    std::size_t size = first & 0x3F;
    for (std::size_t i = 1; i <= more; ++i) size = size << 8 | static_cast<unsigned char>(raw[i]);
    raw.remove_prefix(1 + more);
    if (size > raw.size()) break;
    strings.emplace_back(raw.substr(0, size));
    raw.remove_prefix(size);
  }
  return strings;
}

std::vector<std::string> text_strings(std::string_view raw) {
  std::vector<std::string> strings;
  while (!raw.empty()) {
    const std::size_t end = std::min(raw.find('\n'), raw.size());
    strings.push_back(vtk::decode_name(raw.substr(0, end)));
    raw.remove_prefix(std::min(end + 1, raw.size()));
  }
  return strings;
}

}  // namespace

std::optional<double> vtk_time(const MeshInfo& info, std::set<std::string>& told) {
  for (const char* name : {"TIME", "TimeValue"}) {
    bool binary = false;
    const Extra* extra = field_data(info, name, binary);
    if (extra == nullptr || extra->type != ScalarType::float64 || extra->data.size() != 8) continue;
    double time = 0;
    std::memcpy(&time, extra->data.data(), sizeof time);
    told.insert(extra->key);
    return time;
  }
  return std::nullopt;
}

std::map<std::int64_t, std::string> vtk_block_names(const MeshInfo& info,
                                                    std::set<std::string>& told) {
  std::map<std::int64_t, std::string> names;
  bool binary = false;
  const Extra* extra = field_data(info, kVtkBlockNames, binary);
  if (extra == nullptr) return names;
  const std::string raw = text_of_extra(*extra);
  for (const std::string& line : binary ? binary_strings(raw) : text_strings(raw)) {
    const std::size_t blank = line.find(' ');
    std::int64_t id = 0;
    if (blank != std::string::npos && TextInput::parse(std::string_view(line).substr(0, blank), id))
      names.emplace(id, line.substr(blank + 1));
  }
  if (!names.empty()) told.insert(extra->key);
  return names;
}

Extra vtk_block_names_extra(const MeshInfo& info, std::string key) {
  std::map<std::int64_t, std::string> names;
  for (const BlockInfo& block : info.schema.blocks)
    if (!block.name.empty()) names.emplace(block.id, block.name);
  std::string raw;
  for (const auto& [id, name] : names) put_string(raw, std::to_string(id) + ' ' + name);
  Extra extra{std::move(key), ScalarType::uint8, Reference::nothing, {names.size()}, {}};
  extra.data.resize(raw.size());
  if (!raw.empty()) std::memcpy(extra.data.data(), raw.data(), raw.size());
  return extra;
}

}  // namespace shm::converters
