#include "tool/report.h"

#include <sys/resource.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>
#include <vector>

#include "base/stored_value.h"
#include "transfer/named_groups.h"

namespace shm::converters {
namespace {

std::uint64_t peak_rss_bytes() {
  struct rusage usage {};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;  // Linux reports the size in KiB
}

// Returns the compressed sizes of the arrays as a JSON object. The keys are
// "LOCATION/NAME", e.g. "point/NAME", which are also the names of the streams.
Json arrays_json(const MeshInfo& info, const std::map<std::string, std::uint64_t>& streams) {
  constexpr std::string_view kPrefix = "array:";
  Json arrays = Json::object();
  const std::vector<std::string> names = array_stream_names(info.schema);
  for (std::size_t a = 0; a < info.schema.arrays.size(); ++a) {
    const std::string& stream = names[a];
    const std::uint64_t bytes = bytes_of(streams, stream), values = value_count(info, a);
    arrays[stream.substr(kPrefix.size())] = {
        {"bits_per_value", bits_each(bytes, values)}, {"values", values}, {"bytes", bytes}};
  }
  return arrays;
}

void add_counts(Json& json, const MeshInfo& info) {
  json["vertices"] = info.vertices;
  json["cells"] = info.cells();
  json["hexahedra"] = hexahedra_of(info);
  json["arrays"] = info.schema.arrays.size();
  json["steps"] = info.step_times.size();
}

}  // namespace

std::string fixed(double value, int digits) {
  char text[64];
  return {text,
          std::to_chars(text, text + sizeof text, value, std::chars_format::fixed, digits).ptr};
}

std::string hexadecimal(std::uint64_t digest) {
  std::string text(16, '0');
  for (std::size_t i = 0; i < text.size(); ++i)
    text[i] = "0123456789abcdef"[digest >> (60 - 4 * i) & 15];
  return text;
}

// Returns the number of bits per element, or null (JSON) if `count` is 0.
Json bits_each(std::uint64_t bytes, std::uint64_t count) {
  if (count == 0) return nullptr;
  return 8.0 * static_cast<double>(bytes) / static_cast<double>(count);
}

std::uint64_t bytes_of(const std::map<std::string, std::uint64_t>& streams,
                       const std::string& kind) {
  const auto found = streams.find(kind);
  return found == streams.end() ? 0 : found->second;
}

std::uint64_t connectivity_bytes(const std::map<std::string, std::uint64_t>& streams) {
  return bytes_of(streams, "connectivity") + bytes_of(streams, "corner order") +
         bytes_of(streams, "vertex numbers") + bytes_of(streams, "cell numbers") +
         bytes_of(streams, "imports");
}

// Returns the number of values of an array, over all steps and components.
std::uint64_t value_count(const MeshInfo& info, std::size_t array) {
  const ArrayInfo& data = info.schema.arrays[array];
  const std::uint64_t sets = data.per_step ? info.step_times.size() : 1;
  return info.array_elements(array) * data.components * sets;
}

// Converts JSON to text. Names come from files and may not be valid UTF-8, so invalid bytes are
// replaced.
std::string dump(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string plural(std::uint64_t count, const std::string& one, const std::string& many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

std::uint64_t hexahedra_of(const MeshInfo& info) {
  std::uint64_t sum = 0;
  for (std::size_t b = 0; b < info.schema.blocks.size(); ++b)
    if (info.schema.blocks[b].shape == CellShape::hexahedron) sum += info.block_cells[b];
  return sum;
}

std::string json_text(const nlohmann::json& json) {
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string counts_text(const MeshInfo& info) {
  const std::uint64_t hexahedra = hexahedra_of(info), others = info.cells() - hexahedra;
  std::string text = plural(info.vertices, "vertex", "vertices") + ", " +
                     plural(hexahedra, "hexahedron", "hexahedra");
  if (others > 0) text += ", " + plural(others, "other cell", "other cells");
  if (!info.schema.arrays.empty())
    text += ", " + plural(info.schema.arrays.size(), "array", "arrays");
  if (!info.step_times.empty())
    text += ", " + plural(info.step_times.size(), "time step", "time steps");
  return text;
}

std::string compress_json(const CompressRun& run, const MeshInfo& info) {
  const SizeReport& sizes = run.sizes;
  Json json;
  json["input"] = run.input;
  json["output"] = run.output;
  json["input_bytes"] = run.input_bytes;
  json["output_bytes"] = sizes.total_bytes;
  json["vertices"] = sizes.vertices;
  json["cells"] = sizes.cells;
  json["hexahedra"] = sizes.hexahedra;
  json["connectivity_bits_per_hex"] = bits_each(connectivity_bytes(sizes.streams), sizes.hexahedra);
  json["geometry_bits_per_vertex"] = bits_each(bytes_of(sizes.streams, "geometry"), sizes.vertices);
  json["max_active_vertices"] = sizes.max_active_vertices;
  json["segments"] = sizes.segments;
  json["imported_vertices"] = sizes.imported_vertices;
  json["seconds"] = run.seconds;
  json["peak_rss_bytes"] = peak_rss_bytes();
  json["arrays"] = arrays_json(info, sizes.streams);
  json["streams"] = sizes.streams;
  return dump(json);
}

std::string ratio_text(std::uint64_t bytes, std::uint64_t source_bytes,
                       const std::string& of_what) {
  const std::string text =
      std::to_string(bytes) + " bytes from " + std::to_string(source_bytes) + of_what;
  if (bytes == 0 || source_bytes == 0) return text;
  const double ratio = static_cast<double>(source_bytes) / static_cast<double>(bytes);
  return text + (ratio < 1 ? ", " + fixed(1 / ratio, 2) + " times as large"
                           : ", " + fixed(ratio, 2) + " times smaller");
}

std::string compress_text(const CompressRun& run, const MeshInfo& info) {
  const SizeReport& sizes = run.sizes;
  std::string text =
      run.output + ": " + ratio_text(sizes.total_bytes, run.input_bytes) + " (" + counts_text(info);
  const std::uint64_t connectivity = connectivity_bytes(sizes.streams);
  const std::uint64_t geometry = bytes_of(sizes.streams, "geometry");
  if (sizes.hexahedra > 0)
    text += "; connectivity " + fixed(bits_each(connectivity, sizes.hexahedra), 2) +
            " bits a hexahedron";
  if (sizes.vertices > 0)
    text += "; geometry " + fixed(bits_each(geometry, sizes.vertices), 2) + " bits a vertex";
  return text + "; " + fixed(run.seconds, 2) + " s)\n";
}

double bits_a_cell(const SizeReport& sizes) {
  if (sizes.cells == 0) return 0;
  return 8.0 * static_cast<double>(connectivity_bytes(sizes.streams)) /
         static_cast<double>(sizes.cells);
}

std::string free_order_hint(const CompressRun& run, std::optional<std::uint64_t> free_bytes) {
  const std::uint64_t bytes = run.sizes.total_bytes;
  // Without a trial, return the hint only if there are many active vertices and connectivity
  // is at least a third of the file.
  if (!free_bytes && (run.sizes.max_active_vertices < run.sizes.vertices / 4 ||
                      connectivity_bytes(run.sizes.streams) < bytes / 3))
    return {};
  if (free_bytes && *free_bytes >= bytes - bytes / 5) return {};
  return run.input + ": its cells are stored in an incoherent order; the same mesh with " +
         "--order free " +
         (free_bytes ? "would take about " + std::to_string(100 * *free_bytes / bytes) +
                           " % of these bytes"
                     : std::string("may be much smaller")) +
         "\n";
}

std::string join_json(const std::string& output, std::uint64_t output_bytes,
                      const std::vector<MemberReport>& members) {
  Json json = {{"output", output}, {"output_bytes", output_bytes}, {"members", Json::array()}};
  for (const MemberReport& member : members)
    json["members"].push_back({{"name", member.name},
                               {"input_bytes", member.input_bytes},
                               {"bytes", member.bytes},
                               {"decoded", member.is_decoded}});
  return dump(json);
}

std::string join_text(const std::string& output, std::uint64_t output_bytes,
                      const std::vector<MemberReport>& members) {
  std::uint64_t input_bytes = 0;
  for (const MemberReport& member : members) input_bytes += member.input_bytes;
  std::string text =
      output + ": " + plural(members.size(), "file", "files") + ", " + std::to_string(input_bytes) +
      " to " + std::to_string(output_bytes) + " bytes (" +
      fixed(static_cast<double>(input_bytes) / static_cast<double>(output_bytes), 1) + "x)\n";
  for (const MemberReport& member : members)
    if (!member.is_decoded)
      text += "  " + member.name +
              " was stored unchanged and not decoded (to check it: shm verify " + output + ")\n";
  return text;
}

std::string sound_json(const std::string& path, const MeshInfo& info, const ParityState& parity,
                       std::uint64_t stray_bytes) {
  Json json;
  json["file"] = path;
  // "sound" describes only the mesh. The parity may be damaged even if "sound" is true.
  json["sound"] = true;
  if (parity.there) {
    json["parity"] = true;
    json["parity_blocks"] = parity.blocks;
    json["damaged_blocks"] = parity.damaged_blocks;
    json["damaged_parity_packets"] = parity.damaged_packets;
  }
  if (stray_bytes > 0) json["stray_bytes"] = stray_bytes;
  add_counts(json, info);
  return dump(json);
}

std::string compare_json(const CompareReport& report, const std::string& source,
                         const std::string& restored, const MeshInfo& info,
                         std::uint64_t stray_bytes) {
  Json json;
  json["file"] = restored;
  json["sound"] = true;
  json["against"] = source;
  json["equal"] = report.equal();
  json["differences"] = report.differences;
  json["first_differences"] = report.first;
  json["quantized"] = Json::array();
  for (const MeasuredError& error : report.measured) {
    Json& entry = json["quantized"].emplace_back();
    entry = {{"what", error.what},
             {"largest_error", error.largest},
             {"promised_error", std::isfinite(error.promised) ? Json(error.promised) : Json()},
             {"rms_error", error.rms()},
             {"psnr", std::isfinite(error.psnr()) ? Json(error.psnr()) : Json()}};
    if (error.promised_relative == 0) continue;
    entry["largest_relative_error"] = error.largest_relative;
    entry["promised_relative_error"] = error.promised_relative;
  }
  if (stray_bytes > 0) json["stray_bytes"] = stray_bytes;
  add_counts(json, info);
  return dump(json);
}

namespace {

// Returns a number with four significant digits.
std::string short_text(double number) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, number, std::chars_format::general, 4);
  return {text, end.ptr};
}

}  // namespace

std::string compare_text(const CompareReport& report, const std::string& source,
                         const std::string& restored, std::uint64_t stray_bytes) {
  std::string text;
  if (report.equal()) {
    text = restored + ": " +
           (report.measured.empty() ? "equal to " : "within its error bounds of ") + source + "\n";
  } else {
    text = restored + ": " + plural(report.differences, "difference", "differences") + " from " +
           source + "\n";
    for (const std::string& difference : report.first) text += "  " + difference + "\n";
    if (report.differences > report.first.size())
      text += "  and " + std::to_string(report.differences - report.first.size()) + " more\n";
  }
  for (const MeasuredError& error : report.measured)
    text += "  " + error.what + ": largest error " +
            (error.promised_relative > 0
                 ? number_text(error.largest_relative) + " of a value, allowed " +
                       number_text(error.promised_relative)
                 : number_text(error.largest) + ", allowed " + number_text(error.promised)) +
            ", rms " + short_text(error.rms()) +
            (std::isfinite(error.psnr()) ? ", PSNR " + short_text(error.psnr()) + " dB" : "") +
            "\n";
  if (stray_bytes > 0)
    text += "  " + plural(stray_bytes, "byte", "bytes") +
            " after the end of the mesh do not belong to it\n";
  return text;
}

}  // namespace shm::converters
