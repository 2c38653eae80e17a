#include "tool/diff_report.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/stored_value.h"
#include "tool/report.h"

namespace shm::converters {
namespace {

// Formats a number with six digits, for the text report. The JSON report contains all digits.
std::string rounded(double value) {
  char text[64];
  return {text, std::to_chars(text, text + sizeof text, value, std::chars_format::general, 6).ptr};
}

std::string count_text(std::uint64_t n, const char* one, const char* more) {
  return std::to_string(n) + " " + (n == 1 ? one : more);
}

std::string numbers_text(const std::optional<std::uint64_t>& a,
                         const std::optional<std::uint64_t>& b) {
  if (a && b && *a != *b) return std::to_string(*a) + " (" + std::to_string(*b) + " in B)";
  return std::to_string(a ? *a : b.value_or(0));
}

std::string place_text(const DiffPlace& place) {
  std::string text = place.element + " " + numbers_text(place.a, place.b);
  if (place.where)
    text += " at (" + rounded((*place.where)[0]) + " " + rounded((*place.where)[1]) + " " +
            rounded((*place.where)[2]) + ")";
  if (place.step_a || place.step_b) text += ", step " + numbers_text(place.step_a, place.step_b);
  if (place.time) text += ", time " + number_text(*place.time);
  if (place.component) text += ", component " + std::to_string(*place.component);
  return text;
}

std::string values_text(const DiffPlace& place) {
  if (place.value_a.empty() && place.value_b.empty()) return {};
  return ": " + place.value_a + " in A, " + place.value_b + " in B";
}

std::string element_of(const Finding& finding, bool one) {
  const std::string element =
      finding.kind == "cells" ? "cell"
      : finding.kind == "unmatched" || finding.kind == "times" || finding.what == "time steps"
          ? (finding.places.empty() ? "value" : finding.places.front().element)
          : "value";
  if (one) return element;
  return element == "vertex" ? "vertices" : element + "s";
}

std::string share_text(const Finding& finding, const char* verb, const char* verbs) {
  return std::to_string(finding.different) + " of " + std::to_string(finding.compared) + " " +
         element_of(finding, finding.compared == 1) + " " + (finding.different == 1 ? verb : verbs);
}

// Returns the line of the report that describes a difference. The locations of the difference are
// listed on separate lines.
std::string headline(const Finding& finding) {
  const std::string& kind = finding.kind;
  if (kind == "only_in_a" || kind == "only_in_b") {
    const std::string where = kind == "only_in_a" ? "only in A" : "only in B";
    if (finding.different == 0) return finding.what + ": " + where;
    return finding.what + ": " + std::to_string(finding.different) + " of " +
           std::to_string(finding.compared) + " " + where;
  }
  if (kind == "not_compared") return finding.what + ": not compared, " + finding.a;
  if (kind == "unmatched")
    return finding.what + ": " + share_text(finding, "has", "have") + " no counterpart";
  if (finding.different == 0) {
    const std::string type = kind == "type" ? ", type" : "";
    return finding.what + type + ": " + finding.a + " in A, " + finding.b + " in B";
  }
  std::string text = finding.what + ": " + share_text(finding, "differs", "differ");
  if (kind == "cells") return text + " in corners or block";
  const auto& places = finding.places;
  if (kind == "values" && !places.empty() && !places.front().distance) return text;  // strings
  if (std::isinf(finding.largest)) return text + ", some of them not finite";
  text += ", largest difference " + rounded(finding.largest);
  if (finding.relative) text += " (" + rounded(*finding.relative) + " of the range in A)";
  return text;
}

std::string finding_text(const Finding& finding) {
  std::string text = "  " + headline(finding) + "\n";
  for (const DiffPlace& place : finding.places)
    text += "    " + place_text(place) + values_text(place) + "\n";
  if (!finding.places.empty() && finding.different > finding.places.size())
    text += "    and " + std::to_string(finding.different - finding.places.size()) + " more\n";
  return text;
}

std::string summary_text(const DiffRun& run, const MeshDiff& diff) {
  std::string text = run.a + " and " + run.b;
  if (diff.equal())
    text += run.tolerance == "exact" ? " are equal" : " are equal within " + run.tolerance;
  else
    text += " differ: " + count_text(diff.differences.size(), "difference", "differences");
  text += " (" + count_text(diff.a.vertices, "vertex", "vertices") + ", " +
          count_text(diff.a.cells, "cell", "cells");
  if (diff.matched_vertices)
    text += ", matched " + std::to_string(*diff.matched_vertices) + " and " +
            std::to_string(*diff.matched_cells);
  text += "; " + std::to_string(diff.values_different) + " of " +
          count_text(diff.values_compared, "value differs", "values differ") + ")\n";
  return text;
}

template <class T>
Json optional_json(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

// Returns the number as JSON. Returns null if the number is not finite, because JSON has no such
// numbers.
Json number_json(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json place_json(const DiffPlace& place) {
  Json json;
  json["element"] = place.element;
  json["a"] = optional_json(place.a);
  json["b"] = optional_json(place.b);
  json["where"] = nullptr;
  if (place.where) {
    json["where"] = Json::array();
    for (const double x : *place.where) json["where"].push_back(number_json(x));
  }
  json["step_a"] = optional_json(place.step_a);
  json["step_b"] = optional_json(place.step_b);
  json["time"] = place.time ? number_json(*place.time) : Json(nullptr);
  json["component"] = optional_json(place.component);
  json["value_a"] = place.value_a;
  json["value_b"] = place.value_b;
  json["difference"] = place.distance ? number_json(*place.distance) : Json(nullptr);
  return json;
}

Json finding_json(const Finding& finding) {
  Json json;
  json["kind"] = finding.kind;
  json["what"] = finding.what;
  json["a"] = finding.a;
  json["b"] = finding.b;
  json["compared"] = finding.compared;
  json["different"] = finding.different;
  json["largest_difference"] = number_json(finding.largest);
  json["largest_relative"] = finding.relative ? number_json(*finding.relative) : Json(nullptr);
  json["places"] = Json::array();
  for (const DiffPlace& place : finding.places) json["places"].push_back(place_json(place));
  return json;
}

Json mesh_json(const std::string& path, const MeshDiff::Counts& counts) {
  return {{"file", path},          {"format", counts.format}, {"vertices", counts.vertices},
          {"cells", counts.cells}, {"blocks", counts.blocks}, {"arrays", counts.arrays},
          {"steps", counts.steps}};
}

Json findings_json(const std::vector<Finding>& findings) {
  Json json = Json::array();
  for (const Finding& finding : findings) json.push_back(finding_json(finding));
  return json;
}

}  // namespace

std::string diff_text(const DiffRun& run, const MeshDiff& diff) {
  std::string text;
  for (const Finding& finding : diff.differences) text += finding_text(finding);
  for (const Finding& finding : diff.notes) text += "  (" + headline(finding) + ")\n";
  return text + summary_text(run, diff);
}

std::string diff_json(const DiffRun& run, const MeshDiff& diff) {
  Json json;
  json["equal"] = diff.equal();
  json["tolerance"] = run.tolerance;
  json["match"] = run.match;
  json["a"] = mesh_json(run.a, diff.a);
  json["b"] = mesh_json(run.b, diff.b);
  json["matched_vertices"] = optional_json(diff.matched_vertices);
  json["matched_cells"] = optional_json(diff.matched_cells);
  json["values_compared"] = diff.values_compared;
  json["values_different"] = diff.values_different;
  json["differences"] = findings_json(diff.differences);
  json["notes"] = findings_json(diff.notes);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace shm::converters
