#include "compare/extras.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>

#include "compare/values.h"

namespace shm::converters {
namespace {

constexpr std::size_t kLongestLine = 100;

std::string_view characters(const Extra& extra) {
  return {reinterpret_cast<const char*>(extra.data.data()), extra.data.size()};
}

// Returns true if the bytes are text: printable characters of any encoding, tabs, line breaks, and
// zero bytes for termination or padding.
bool is_text(const Extra& extra) {
  if (extra.type != ScalarType::uint8 || extra.refers != Reference::nothing) return false;
  return std::all_of(extra.data.begin(), extra.data.end(), [](std::byte byte) {
    const auto c = static_cast<unsigned char>(byte);
    return c >= ' ' ? c != 127 : c == 0 || c == '\n' || c == '\r' || c == '\t';
  });
}

// Splits text at line breaks and at zero bytes. Fixed-width words that are padded with zero bytes
// thus become separate items. Empty items are omitted.
std::vector<std::string_view> lines_of(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = text.find_first_of(std::string_view("\n\0", 2));
    if (end > 0) lines.push_back(text.substr(0, end));
    text.remove_prefix(end == text.npos ? text.size() : end + 1);
  }
  return lines;
}

std::string shown(std::string_view line) {
  return "'" + std::string(line.substr(0, kLongestLine)) +
         (line.size() > kLongestLine ? "..." : "") + "'";
}

class ExtrasDiff {
 public:
  ExtrasDiff(const std::vector<Extra>& a, const std::vector<Extra>& b, const ExtrasComparison& how)
      : how_(how) {
    for (const Extra& extra : a) renumbered_.push_back(renumbered(extra, how.to_b));
    if (how.in_any_order) {
      others_ = b;
      sort_members(renumbered_);
      sort_members(others_);
      a_ = sorted_by_key(renumbered_);
      b_ = sorted_by_key(others_);
    } else {
      a_ = sorted_by_key(renumbered_);
      b_ = sorted_by_key(b);
    }
  }

  std::vector<Finding> run() {
    auto a = a_.begin();
    auto b = b_.begin();
    while (a != a_.end() || b != b_.end()) {
      if (b == b_.end() || (a != a_.end() && (*a)->key < (*b)->key)) {
        only("only_in_a", **a++);
      } else if (a == a_.end() || (*b)->key < (*a)->key) {
        only("only_in_b", **b++);
      } else {
        compare(**a++, **b++);
      }
    }
    return std::move(found_);
  }

 private:
  void only(const char* kind, const Extra& extra) {
    if (!how_.is_ignored(extra.key)) found_.push_back({kind, "extra '" + extra.key + "'"});
  }

  void compare(const Extra& a, const Extra& b) {
    if (a == b || how_.is_ignored(a.key)) return;
    Finding finding{"extra", "extra '" + a.key + "'"};
    const bool lists = a.refers != Reference::nothing && a.refers == b.refers;
    if (lists && a.shape.size() == 1 && b.shape.size() == 1 && a.type == b.type) {
      compare_members(a, b, finding);
    } else if (is_text(a) && is_text(b)) {
      compare_text(a, b, finding);
    } else if (a.type != b.type || a.shape != b.shape || a.refers != b.refers ||
               a.data.size() != b.data.size()) {
      finding.a = kind_text(a);
      finding.b = kind_text(b);
    } else {
      compare_values(a, b, finding);
      if (finding.different == 0) return;
    }
    found_.push_back(std::move(finding));
  }

  // Compares lists of vertices or cells. Counts the members of each list that are not in the other
  // list.
  static void compare_members(const Extra& a, const Extra& b, Finding& finding) {
    const auto members = [](const Extra& extra) {
      std::vector<std::int64_t> list(extra.data.size() / scalar_bytes(extra.type));
      for (std::size_t i = 0; i < list.size(); ++i)
        list[i] = extra.type == ScalarType::int32 ? load<std::int32_t>(extra.data.data() + 4 * i)
                                                  : load<std::int64_t>(extra.data.data() + 8 * i);
      std::sort(list.begin(), list.end());
      return list;
    };
    const auto text = [](const Extra& extra, const auto& own, const auto& other, const char* mesh) {
      std::vector<std::int64_t> alone;
      std::set_difference(own.begin(), own.end(), other.begin(), other.end(),
                          std::back_inserter(alone));
      return std::to_string(own.size()) +
             (extra.refers == Reference::vertex ? " vertices" : " cells") + " (" +
             std::to_string(alone.size()) + " not in " + mesh + ")";
    };
    const auto list_a = members(a), list_b = members(b);
    finding.a = text(a, list_a, list_b, "B");
    finding.b = text(b, list_b, list_a, "A");
    if (list_a == list_b) finding.b += ", in another order";
  }

  void compare_text(const Extra& a, const Extra& b, Finding& finding) {
    const auto lines_a = lines_of(characters(a)), lines_b = lines_of(characters(b));
    std::size_t line = 0;
    while (line < lines_a.size() && line < lines_b.size() && lines_a[line] == lines_b[line]) ++line;
    // If all lines are equal, the texts differ only in zero bytes or line breaks.
    if (line == lines_a.size() && line == lines_b.size()) {
      finding.a = kind_text(a);
      finding.b = kind_text(b);
      return;
    }
    finding.a = line < lines_a.size() ? shown(lines_a[line]) : "no line " + std::to_string(line);
    finding.b = line < lines_b.size() ? shown(lines_b[line]) : "no line " + std::to_string(line);
  }

  void compare_values(const Extra& a, const Extra& b, Finding& finding) const {
    const std::uint64_t values = a.data.size() / scalar_bytes(a.type);
    Likeness likeness{how_.accuracy.kind != Accuracy::Kind::lossless, how_.accuracy.bound};
    ValueRange range(1);
    range.add(a.data.data(), values, a.type);
    if (how_.accuracy.kind == Accuracy::Kind::relative) likeness.bound *= range.overall();
    ValueScan scan(finding, 1, a.type, b.type, likeness, how_.limit);
    scan.compare(a.data.data(), b.data.data(), values, [](std::uint64_t i) {
      DiffPlace place;
      place.element = "value";
      place.a = place.b = i;
      return place;
    });
    scan.finish();
    if (range.overall() > 0) finding.relative = finding.largest / range.overall();
  }

  // Sorts the members of each set in ascending order. If another list of the set (e.g. the sides)
  // has one row per member, its rows are reordered in the same way.
  static void sort_members(std::vector<Extra>& extras) {
    std::map<std::string, std::vector<Extra*>> by_parent;
    for (Extra& extra : extras)
      by_parent[extra.key.substr(0, extra.key.rfind('/'))].push_back(&extra);
    for (auto& [parent, list] : by_parent) {
      const auto refers = [](const Extra* extra) { return extra->refers != Reference::nothing; };
      const bool is_set = parent.find("_set/") != std::string::npos;
      if (is_set && std::count_if(list.begin(), list.end(), refers) == 1) {
        sort_rows(**std::find_if(list.begin(), list.end(), refers), list);
      } else {
        for (Extra* extra : list)
          if (refers(extra) && extra->shape.size() == 1) sort_rows(*extra, {extra});
      }
    }
  }

  static void sort_rows(Extra& members, const std::vector<Extra*>& columns) {
    const std::size_t bytes = scalar_bytes(members.type), rows = members.data.size() / bytes;
    std::vector<Extra*> following;
    for (Extra* column : columns)
      if (column != &members && column->type != ScalarType::uint8 &&
          column->data.size() == rows * scalar_bytes(column->type))
        following.push_back(column);
    const auto number = [&](std::size_t row) {
      const std::byte* from = members.data.data() + row * bytes;
      return bytes == 4 ? load<std::int32_t>(from) : load<std::int64_t>(from);
    };
    const auto compare_rows = [&](std::size_t x, std::size_t y) {
      if (number(x) != number(y)) return number(x) < number(y);
      for (const Extra* column : following) {
        const std::size_t width = scalar_bytes(column->type);
        const int order =
            std::memcmp(column->data.data() + x * width, column->data.data() + y * width, width);
        if (order != 0) return order < 0;
      }
      return false;
    };
    std::vector<std::size_t> order(rows);
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), compare_rows);
    following.push_back(&members);
    for (Extra* column : following) {
      const std::size_t width = scalar_bytes(column->type);
      std::vector<std::byte> moved(column->data.size());
      for (std::size_t row = 0; row < rows; ++row)
        std::memcpy(moved.data() + row * width, column->data.data() + order[row] * width, width);
      column->data = std::move(moved);
    }
  }

  const ExtrasComparison& how_;
  std::vector<Extra> renumbered_, others_;
  std::vector<const Extra*> a_, b_;
  std::vector<Finding> found_;
};

}  // namespace

std::vector<const Extra*> sorted_by_key(const std::vector<Extra>& extras) {
  std::vector<const Extra*> list;
  for (const Extra& extra : extras) list.push_back(&extra);
  std::stable_sort(list.begin(), list.end(),
                   [](const Extra* a, const Extra* b) { return a->key < b->key; });
  return list;
}

std::string kind_text(const Extra& extra) {
  std::string shape;
  for (const std::uint64_t n : extra.shape)
    shape += (shape.empty() ? "" : " x ") + std::to_string(n);
  return "[" + shape + "] " + std::string(scalar_name(extra.type)) +
         (extra.refers == Reference::vertex ? " vertices"
          : extra.refers == Reference::cell ? " cells"
                                            : "");
}

std::vector<Finding> diff_extras(const std::vector<Extra>& a, const std::vector<Extra>& b,
                                 const ExtrasComparison& how) {
  return ExtrasDiff(a, b, how).run();
}

}  // namespace shm::converters
