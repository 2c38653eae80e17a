#include "vtk/strings.h"

#include <limits>

#include "mesh/mesh_source.h"

namespace shm::converters::vtk {

StringForm string_form(ValueForm form, bool binary) {
  return binary && form == ValueForm::string ? StringForm::lengths : StringForm::lines;
}

std::optional<std::vector<std::string_view>> split_strings(std::string_view list, StringForm form) {
  std::vector<std::string_view> strings;
  while (!list.empty()) {
    std::uint64_t size = 0;
    if (form == StringForm::lengths) {
      const std::size_t head = length_bytes(static_cast<std::byte>(list[0]));
      if (head > list.size()) return std::nullopt;
      size = static_cast<unsigned char>(list[0]) & 63U;
      for (std::size_t b = 1; b < head; ++b) size = size << 8 | static_cast<unsigned char>(list[b]);
      if (size > list.size() - head) return std::nullopt;
      size += head;
    } else {
      const std::size_t end = list.find(form == StringForm::zeros ? '\0' : '\n');
      if (end == std::string_view::npos) return std::nullopt;
      size = end + 1;
    }
    strings.push_back(list.substr(0, size));
    list.remove_prefix(size);
  }
  return strings;
}

std::string plain_string(std::string_view piece, StringForm form) {
  if (form == StringForm::lengths)
    return std::string(piece.substr(piece.empty() ? 0 : length_bytes(std::byte(piece[0]))));
  piece.remove_suffix(piece.empty() ? 0 : 1);
  return form == StringForm::lines ? decode_name(piece) : std::string(piece);
}

void append_string(std::string& list, std::string_view plain, StringForm form) {
  if (form == StringForm::zeros) {
    list.append(plain.substr(0, plain.find('\0'))) += '\0';
    return;
  }
  const std::uint64_t length = plain.size();
  const int bytes = length < 64 ? 1 : length < 16384 ? 2 : length < (1U << 30) ? 4 : 8;
  const std::uint64_t mark = bytes == 1 ? 3 : bytes == 2 ? 2 : bytes == 4 ? 1 : 0;
  const std::uint64_t head = length | mark << (8 * bytes - 2);
  for (int b = bytes - 1; b >= 0; --b) list += static_cast<char>(head >> (8 * b) & 0xff);
  list.append(plain);
}

std::string recoded(std::string_view list, StringForm from, StringForm to) {
  std::string out;
  const auto pieces = split_strings(list, from);
  if (!pieces) return out;
  for (const std::string_view piece : *pieces) append_string(out, plain_string(piece, from), to);
  return out;
}

std::optional<std::uint32_t> StringLister::place_of(const std::string& piece) {
  constexpr std::uint64_t kBytesOfPlace = 64;
  const auto next = static_cast<std::uint32_t>(places_.size());
  const auto [entry, fresh] = places_.try_emplace(piece, next);
  if (fresh) {
    list_ += piece;
    if (2 * list_.size() + places_.size() * kBytesOfPlace > most_bytes_ ||
        next == std::numeric_limits<std::uint32_t>::max())
      return std::nullopt;
  }
  return entry->second;
}

std::string strings_key(std::size_t array) {
  return std::string(kStringLists) + std::to_string(array);
}

StringForm form_of_strings(const MeshInfo& info, std::size_t array) {
  if (info.schema.source_format == "vtu") return StringForm::zeros;
  const Extra* text = find_extra(info, "vtk/skeleton");
  const auto skeleton = text == nullptr ? std::nullopt : parse_skeleton(text_of_extra(*text));
  if (!skeleton) return StringForm::lines;
  for (const Entry& entry : skeleton->entries)
    if (entry.origin == Origin::array && entry.index == array)
      return string_form(form_of_word(entry.type), skeleton->binary);
  return StringForm::lines;
}

std::vector<std::string> strings_of_array(const MeshInfo& info, std::size_t array) {
  std::vector<std::string> strings;
  const Extra* list = find_extra(info, strings_key(array));
  if (list == nullptr) return strings;
  const StringForm form = form_of_strings(info, array);
  const std::string text = text_of_extra(*list);
  const auto pieces = split_strings(text, form);
  if (!pieces) return strings;
  for (const std::string_view piece : *pieces) strings.push_back(plain_string(piece, form));
  return strings;
}

}  // namespace shm::converters::vtk
