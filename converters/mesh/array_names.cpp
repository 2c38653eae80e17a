#include "mesh/array_names.h"

#include <string_view>
#include <utility>

#include "base/failure.h"

namespace shm::converters {
namespace {

// A pattern, split into characters. A character is literal or a wildcard.
class Pattern {
 public:
  explicit Pattern(std::string_view text) {
    for (std::size_t i = 0; i < text.size(); ++i) {
      const bool is_literal = text[i] == '\\' && i + 1 < text.size();
      if (is_literal) ++i;
      const bool is_wild = !is_literal && (text[i] == '*' || text[i] == '?');
      characters_.push_back({text[i], is_wild});
      has_wildcards_ = has_wildcards_ || is_wild;
    }
  }
  bool has_wildcards() const { return has_wildcards_; }
  std::string literal() const {
    std::string text;
    for (const auto& [character, is_wild] : characters_) text += character;
    return text;
  }
  bool matches(std::string_view text) const {
    std::size_t p = 0, t = 0, star = std::string::npos, star_at = 0;
    while (t < text.size()) {
      if (p < characters_.size() && fits(p, text[t])) {
        ++p, ++t;
      } else if (is_star(p)) {
        star = p++, star_at = t;
      } else if (star != std::string::npos) {
        p = star + 1, t = ++star_at;
      } else {
        return false;
      }
    }
    while (is_star(p)) ++p;
    return p == characters_.size();
  }

 private:
  bool is_star(std::size_t p) const {
    return p < characters_.size() && characters_[p] == std::pair{'*', true};
  }
  bool fits(std::size_t p, char character) const {
    const auto& [own, is_wild] = characters_[p];
    return is_wild ? own == '?' : own == character;
  }

  std::vector<std::pair<char, bool>> characters_;
  bool has_wildcards_ = false;
};

}  // namespace

std::string array_label(const ArrayInfo& array) {
  return std::string(location_name(array.location)) + "/" + array.name;
}

std::vector<std::string> paths_of(const Schema& schema) {
  constexpr std::string_view kPrefix = "array:";
  std::vector<std::string> paths = array_stream_names(schema);
  for (std::string& path : paths) path.erase(0, kPrefix.size());
  return paths;
}

CalledArrays arrays_called(const Schema& schema, const std::string& name,
                           const std::string& option) {
  const Pattern pattern(name);
  const std::string literal = pattern.literal();
  CalledArrays called, matching;
  matching.is_pattern = true;
  std::string paths;
  const std::vector<std::string> paths_of_all = paths_of(schema);
  for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
    const std::string &path = paths_of_all[a], &own = schema.arrays[a].name;
    // Names are also compared as they are written, so that only names with special characters need
    // a backslash.
    if (path == name || path == literal) return {{a}, false};
    if (pattern.has_wildcards() && (pattern.matches(path) || pattern.matches(own)))
      matching.arrays.push_back(a);
    if (own != name && own != literal) continue;
    called.arrays.push_back(a);
    paths += (paths.empty() ? "" : " or ") + ("'" + path + "'");
  }
  if (called.arrays.size() > 1)
    wrong_use(option + ": several arrays are called '" + name + "'; use " + paths);
  if (!called.arrays.empty()) return called;
  if (matching.arrays.empty()) wrong_use(option + ": the mesh has no array '" + name + "'");
  return matching;
}

std::vector<std::uint32_t> blocks_called(const std::vector<BlockInfo>& blocks,
                                         const std::string& name, const std::string& option) {
  std::vector<std::uint32_t> found;
  const auto take = [&](auto&& text_of) {
    for (std::uint32_t b = 0; b < blocks.size() && !name.empty(); ++b)
      if (text_of(blocks[b]) == name) found.push_back(b);
  };
  take([](const BlockInfo& block) { return block.name; });
  if (found.empty()) take([](const BlockInfo& block) { return std::to_string(block.id); });
  if (found.empty())
    wrong_use(
        option + ": the mesh has no block '" + name + "'; ids are " +
        listed(blocks, [](const BlockInfo& block) { return with_name(block.id, block.name); }));
  return found;
}

std::size_t last_unescaped(const std::string& text, char character) {
  for (std::size_t i = text.size(); i-- > 0;) {
    if (text[i] != character) continue;
    std::size_t backslashes = 0;
    while (backslashes < i && text[i - 1 - backslashes] == '\\') ++backslashes;
    if (backslashes % 2 == 0) return i;
  }
  return std::string::npos;
}

std::string unescaped(std::string_view text) { return Pattern(text).literal(); }

}  // namespace shm::converters
