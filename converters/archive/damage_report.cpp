#include "archive/damage_report.h"

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

std::string place_text(const Damage& damage) {
  if (damage.bytes == 0) return "at byte " + std::to_string(damage.offset);
  return "bytes " + std::to_string(damage.offset) + "-" +
         std::to_string(damage.offset + damage.bytes - 1);
}

std::string line_of(const Damage& damage, const std::optional<Schema>& schema) {
  std::string line = damage.chunks > 1 ? std::to_string(damage.chunks) + " chunks" : damage.section;
  if (damage.kind == DamageKind::stray) line = "what belongs to nothing";
  if (damage.segment) line += " of segment " + std::to_string(*damage.segment);
  if (damage.step && !damage.arrays.empty())
    line +=
        " of " + array_label(schema, damage.arrays[0]) + " at step " + std::to_string(*damage.step);
  line += ", " + place_text(damage) + ": ";
  if (damage.kind != DamageKind::damaged && damage.kind != DamageKind::missing)
    return line + kind_word(damage.kind);
  if (!damage.step && !damage.arrays.empty()) {
    line += "only values of ";
    for (std::size_t i = 0; i < damage.arrays.size(); ++i)
      line += (i > 0 ? ", " : "") + array_label(schema, damage.arrays[i]);
    line += " ";
  }
  line += kind_word(damage.kind);
  if (damage.first_cell && damage.cells > 0)
    line += (damage.chunks > 1 || damage.section == "chunk" ? ", within cells " : ", cells ") +
            std::to_string(*damage.first_cell) + "-" +
            std::to_string(*damage.first_cell + damage.cells - 1);
  return line;
}

}  // namespace

std::string counted(std::uint64_t count, const std::string& one) {
  return std::to_string(count) + " " + one + (count == 1 ? "" : "s");
}

std::string array_label(const std::optional<Schema>& schema, std::uint32_t array) {
  if (!schema || array >= schema->arrays.size()) return "array " + std::to_string(array);
  const ArrayInfo& info = schema->arrays[array];
  return (info.location == Location::point ? "point/" : "cell/") + info.name;
}

std::vector<std::string> damage_lines(const DamageReport& report, std::size_t most) {
  std::vector<std::string> lines;
  for (const Damage& damage : report.damages) {
    if (lines.size() == most) {
      lines.push_back("... and " + std::to_string(report.damages.size() - most) +
                      " more (--json lists all)");
      break;
    }
    lines.push_back(line_of(damage, report.schema));
  }
  return lines;
}

nlohmann::json damage_json(const DamageReport& report) {
  nlohmann::json list = nlohmann::json::array();
  for (const Damage& damage : report.damages) {
    nlohmann::json it;
    it["what"] = kind_word(damage.kind);
    it["section"] = damage.section;
    it["offset"] = damage.offset;
    it["bytes"] = damage.bytes;
    it["chunks"] = damage.chunks;
    if (damage.segment) it["segment"] = *damage.segment;
    if (damage.first_cell) {
      it["first_cell"] = *damage.first_cell;
      it["cells"] = damage.cells;
    }
    if (damage.step) it["step"] = *damage.step;
    if (!damage.arrays.empty()) {
      it["arrays"] = nlohmann::json::array();
      for (const std::uint32_t array : damage.arrays)
        it["arrays"].push_back(array_label(report.schema, array));
    }
    list.push_back(std::move(it));
  }
  return list;
}

}  // namespace shm::converters
