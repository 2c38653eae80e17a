#include "archive/damage_report.h"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

namespace shm::converters {
namespace {

const char* kind_word(DamageKind kind) {
  switch (kind) {
    case DamageKind::damaged: return "damaged";
    case DamageKind::missing: return "missing";
    case DamageKind::repeated: return "repeated";
    case DamageKind::out_of_order: return "out of order";
    case DamageKind::stray: return "stray";
  }
  return "";
}

// Damage entries that are reported on one line. All of them have the same kind of damage and the
// same kind of chunk.
struct DamageRun {
  DamageKind kind = DamageKind::damaged;
  std::string section;
  std::uint64_t chunks = 0;
  std::optional<std::uint32_t> first_segment{}, last_segment{};
  std::optional<std::uint64_t> first_cell{};
  std::uint64_t cells = 0;
  std::vector<std::uint32_t> arrays{};
  std::set<std::uint64_t> steps{};
  std::uint64_t begin = 0, end = 0;  // byte range in the file
  bool has_gaps = false;             // true: the byte range also contains undamaged bytes

  explicit DamageRun(const Damage& damage)
      : kind(damage.kind),
        section(damage.section),
        chunks(damage.chunks),
        first_segment(damage.segment),
        last_segment(damage.segment),
        first_cell(damage.first_cell),
        cells(damage.cells),
        arrays(damage.arrays),
        begin(damage.offset),
        end(damage.offset + damage.bytes) {
    if (damage.step) steps.insert(*damage.step);
  }
  void take_bytes(const DamageRun& next) {
    chunks += next.chunks;
    // If both entries have the same byte range, they report damage in different parts of one chunk.
    // There is then no gap between them.
    const bool same_place = next.begin == begin && next.end == end;
    has_gaps |= next.has_gaps || (!same_place && next.begin != end);
    begin = std::min(begin, next.begin);
    end = std::max(end, next.end);
  }
};

bool is_step_values(const Damage& damage) { return damage.step && damage.arrays.size() == 1; }

// Combines entries for damaged step values into runs, so that the report has one line per run.
// First, the damaged steps of one array in one segment form a run. Then runs of the same segment
// are joined if their arrays lost the same steps. Finally, runs of consecutive segments are joined
// if the same arrays lost the same steps.
class StepRuns {
 public:
  void add(const Damage& damage) {
    const auto key = std::make_tuple(damage.kind, damage.segment, damage.arrays[0]);
    const auto [entry, fresh] = place_.try_emplace(key, runs_.size());
    if (fresh) {
      runs_.emplace_back(damage);
      return;
    }
    runs_[entry->second].take_bytes(DamageRun(damage));
    runs_[entry->second].steps.insert(*damage.step);
  }

  std::vector<DamageRun> joined() && { return join_segments(join_arrays(std::move(runs_))); }

 private:
  static std::vector<DamageRun> join_arrays(std::vector<DamageRun> runs) {
    std::vector<DamageRun> joined;
    std::map<std::tuple<DamageKind, std::optional<std::uint32_t>, std::set<std::uint64_t>>,
             std::size_t>
        places;
    for (DamageRun& run : runs) {
      const auto [entry, fresh] =
          places.try_emplace({run.kind, run.first_segment, run.steps}, joined.size());
      if (fresh) {
        joined.push_back(std::move(run));
        continue;
      }
      joined[entry->second].take_bytes(run);
      joined[entry->second].arrays.push_back(run.arrays[0]);
    }
    return joined;
  }

  static std::vector<DamageRun> join_segments(std::vector<DamageRun> runs) {
    std::vector<DamageRun> joined;
    // for each combination of kind of damage, arrays and steps: index in `joined` of the most
    // recent run with this combination
    std::map<std::tuple<DamageKind, std::vector<std::uint32_t>, std::set<std::uint64_t>>,
             std::size_t>
        places;
    for (DamageRun& run : runs) {
      const auto [entry, fresh] =
          places.try_emplace({run.kind, run.arrays, run.steps}, joined.size());
      DamageRun* last = fresh ? nullptr : &joined[entry->second];
      if (last != nullptr && last->last_segment && run.first_segment &&
          *last->last_segment + 1 == *run.first_segment) {
        last->take_bytes(run);
        last->last_segment = run.last_segment;
        continue;
      }
      entry->second = joined.size();
      joined.push_back(std::move(run));
    }
    return joined;
  }

  std::map<std::tuple<DamageKind, std::optional<std::uint32_t>, std::uint32_t>, std::size_t> place_;
  std::vector<DamageRun> runs_;
};

// Returns true if the cell group `next` directly follows the last group of `run`.
bool continues(const DamageRun& run, const DamageRun& next) {
  return next.section == "group" && run.section == "group" && run.kind == next.kind &&
         run.arrays == next.arrays && run.steps.empty() && run.first_cell && next.first_cell &&
         next.cells > 0 && *run.first_cell + run.cells == *next.first_cell && run.last_segment &&
         next.first_segment && *next.first_segment - *run.last_segment <= 1;
}

std::vector<DamageRun> runs_of(const std::vector<Damage>& damages) {
  std::vector<DamageRun> runs;
  StepRuns of_steps;
  for (const Damage& damage : damages) {
    if (is_step_values(damage)) {
      of_steps.add(damage);
    } else if (const DamageRun next(damage); !runs.empty() && continues(runs.back(), next)) {
      runs.back().take_bytes(next);
      runs.back().cells += next.cells;
      runs.back().last_segment = next.last_segment;
    } else {
      runs.push_back(next);
    }
  }
  for (DamageRun& run : std::move(of_steps).joined()) runs.push_back(std::move(run));
  std::stable_sort(runs.begin(), runs.end(),
                   [](const DamageRun& a, const DamageRun& b) { return a.begin < b.begin; });
  return runs;
}

std::string segments_text(const DamageRun& run) {
  if (run.first_segment == run.last_segment) return "segment " + std::to_string(*run.first_segment);
  return "segments " + std::to_string(*run.first_segment) + " to " +
         std::to_string(*run.last_segment);
}

std::string place_text(const DamageRun& run) {
  if (run.begin == run.end) return "at byte " + std::to_string(run.begin);
  return (run.has_gaps ? "within bytes " : "bytes ") + std::to_string(run.begin) + "-" +
         std::to_string(run.end - 1);
}

std::string line_of(const DamageRun& run, const std::optional<Schema>& schema) {
  const bool of_steps = !run.steps.empty() && !run.arrays.empty();
  std::string line = run.chunks == 1 || of_steps ? run.section
                     : run.section == "group"    ? std::to_string(run.chunks) + " groups"
                                                 : std::to_string(run.chunks) + " chunks";
  if (run.kind == DamageKind::stray) line = "data that belongs to no chunk";
  if (run.first_segment) line += " of " + segments_text(run);
  if (of_steps) line += " of " + array_labels(schema, run.arrays) + " at " + steps_text(run.steps);
  line += ", " + place_text(run) + ": ";
  if (run.kind != DamageKind::damaged && run.kind != DamageKind::missing)
    return line + kind_word(run.kind);
  if (of_steps && run.chunks > 1) line += std::to_string(run.chunks) + " chunks ";
  if (!of_steps && !run.arrays.empty())
    line += "only values of " + array_labels(schema, run.arrays) + " ";
  line += kind_word(run.kind);
  if (run.first_cell && run.cells > 0)
    line += (run.section == "chunk" ? ", within cells " : ", cells ") +
            std::to_string(*run.first_cell) + "-" + std::to_string(*run.first_cell + run.cells - 1);
  return line;
}

}  // namespace

std::string counted(std::uint64_t count, const std::string& one) {
  return std::to_string(count) + " " + one + (count == 1 ? "" : "s");
}

std::string array_label(const std::optional<Schema>& schema, std::uint32_t array) {
  if (!schema || array >= schema->arrays.size()) return "array " + std::to_string(array);
  const ArrayInfo& info = schema->arrays[array];
  return std::string(location_name(info.location)) + "/" + info.name;
}

std::string array_labels(const std::optional<Schema>& schema,
                         std::span<const std::uint32_t> arrays) {
  constexpr std::size_t kMost = 12;
  std::string text;
  for (std::size_t i = 0; i < arrays.size() && i < kMost; ++i)
    text += (i > 0 ? ", " : "") + array_label(schema, arrays[i]);
  return arrays.size() <= kMost ? text : text + ", ... (" + std::to_string(arrays.size()) + ")";
}

std::string steps_text(const std::set<std::uint64_t>& steps) {
  constexpr int kMostRanges = 8;
  std::string text;
  int ranges = 0;
  for (auto step = steps.begin(); step != steps.end();) {
    const std::uint64_t first = *step;
    std::uint64_t last = first;
    while (++step != steps.end() && *step == last + 1) last = *step;
    if (++ranges > kMostRanges) {
      text += ", ... (" + std::to_string(steps.size()) + ")";
      break;
    }
    text += (text.empty() ? "" : ", ") + std::to_string(first) +
            (first == last ? "" : " to " + std::to_string(last));
  }
  return (steps.size() == 1 ? "step " : "steps ") + text;
}

std::vector<std::string> damage_lines(const DamageReport& report, std::size_t most) {
  const std::vector<DamageRun> runs = runs_of(report.damages);
  std::vector<std::string> lines;
  for (const DamageRun& run : runs) {
    if (lines.size() == most) {
      lines.push_back("... and " + std::to_string(runs.size() - most) + " more (--json lists all)");
      break;
    }
    lines.push_back(line_of(run, report.schema));
  }
  return lines;
}

nlohmann::json damage_json(const DamageReport& report) {
  nlohmann::json list = nlohmann::json::array();
  for (const Damage& damage : report.damages) {
    nlohmann::json entry;
    entry["what"] = kind_word(damage.kind);
    entry["section"] = damage.section;
    entry["offset"] = damage.offset;
    entry["bytes"] = damage.bytes;
    entry["chunks"] = damage.chunks;
    if (damage.segment) entry["segment"] = *damage.segment;
    if (damage.first_cell) {
      entry["first_cell"] = *damage.first_cell;
      entry["cells"] = damage.cells;
    }
    if (damage.step) entry["step"] = *damage.step;
    if (!damage.arrays.empty()) {
      entry["arrays"] = nlohmann::json::array();
      for (const std::uint32_t array : damage.arrays)
        entry["arrays"].push_back(array_label(report.schema, array));
    }
    list.push_back(std::move(entry));
  }
  return list;
}

}  // namespace shm::converters
