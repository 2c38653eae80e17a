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
#include "transfer/mesh_sets.h"

namespace shm::converters {
namespace {

using Json = nlohmann::ordered_json;

std::uint64_t peak_rss_bytes() {
  struct rusage usage {};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;  // Linux counts kibibytes
}

std::string fixed(double value, int digits) {
  char text[64];
  return {text,
          std::to_chars(text, text + sizeof text, value, std::chars_format::fixed, digits).ptr};
}

// Bits for each of `count`; null (JSON) when there is none.
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

// Values of an array, all steps and components together.
std::uint64_t value_count(const MeshInfo& info, std::size_t array) {
  const ArrayInfo& data = info.schema.arrays[array];
  const std::uint64_t sets = data.per_step ? info.step_times.size() : 1;
  return info.array_elements(array) * data.components * sets;
}

// By "point/NAME" or "cell/NAME", as in the names of streams.
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

// Names come from files and need not be UTF-8.
std::string dump(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

// Arrays by the names of their streams.
std::map<std::string, std::size_t> arrays_by_stream(const Schema& schema) {
  std::map<std::string, std::size_t> arrays;
  for (std::string& name : array_stream_names(schema))
    arrays.emplace(std::move(name), arrays.size());
  return arrays;
}

// The element that a stream is counted by, and how many there are; "" for none.
std::pair<std::string, std::uint64_t> element_of(const std::string& stream,
                                                 const std::map<std::string, std::size_t>& arrays,
                                                 const MeshInfo& info, const Totals& totals) {
  if (stream == "connectivity" || stream == "corner order" || stream == "cell numbers" ||
      stream == "imports")
    return {"cell", totals.cells};
  if (stream == "geometry" || stream == "vertex numbers") return {"vertex", totals.vertices};
  const auto array = arrays.find(stream);
  if (array == arrays.end()) return {"", 0};
  return {"value", value_count(info, array->second)};
}

std::string padded(std::string text, std::size_t width, bool right = false) {
  if (text.size() < width)
    text.insert(right ? 0 : text.size(), std::string(width - text.size(), ' '));
  return text;
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

std::string codecs_text(const std::vector<ConnectivityCodec>& of_segments) {
  std::map<ConnectivityCodec, std::size_t> segments;
  for (ConnectivityCodec codec : of_segments)
    if (codec != ConnectivityCodec::automatic) ++segments[codec];  // else there are no cells
  if (segments.empty()) return "none";
  std::string text;
  for (const auto& [codec, count] : segments) {
    text += (text.empty() ? "" : ", ") + std::string(codec_name(codec));
    if (segments.size() > 1) text += " in " + plural(count, "segment", "segments");
  }
  return text;
}

// By segment.
Json codecs_json(const std::vector<ConnectivityCodec>& of_segments) {
  Json names = Json::array();
  for (ConnectivityCodec codec : of_segments)
    names.push_back(codec == ConnectivityCodec::automatic ? "none" : codec_name(codec));
  return names;
}

std::string quantization_text(const Quantization& quantization, ScalarType type) {
  if (!quantization.lossy()) return {};
  std::string text = ", rounded";
  if (quantization.bits != Quantization::kAbsolute)
    text += " to " + std::to_string(quantization.bits) + " bits";
  return text + ", error at most " + number_text(quantization.max_error(type));
}

// Bits of the box, 0 where there is none; and the largest error, null where there is no loss.
void add_quantization(Json& json, const std::string& prefix, const Quantization& quantization,
                      ScalarType type) {
  const bool of_box = quantization.lossy() && quantization.bits != Quantization::kAbsolute;
  json[prefix + "bits"] = of_box ? quantization.bits : 0;
  json[prefix + "max_error"] =
      quantization.lossy() ? Json(quantization.max_error(type)) : Json(nullptr);
}

Json schema_json(const MeshInfo& info) {
  const Schema& schema = info.schema;
  Json json;
  json["source_format"] = schema.source_format;
  json["order"] = order_name(schema.order);
  json["delay"] = schema.delay;
  json["corner_order"] = schema.corner_order;
  json["coordinate_type"] = scalar_name(schema.coordinate_type);
  add_quantization(json, "coordinate_", schema.coordinate_quantization, schema.coordinate_type);
  json["vertices"] = info.vertices;
  json["cells"] = info.cells();
  json["hexahedra"] = hexahedra_of(info);
  json["blocks"] = Json::array();
  for (std::size_t b = 0; b < schema.blocks.size(); ++b) {
    const BlockInfo& block = schema.blocks[b];
    json["blocks"].push_back({{"id", block.id},
                              {"name", block.name},
                              {"shape", shape_name(block.shape)},
                              {"nodes_per_cell", block.nodes_per_cell},
                              {"cells", info.block_cells[b]}});
  }
  json["arrays"] = Json::array();
  for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
    const ArrayInfo& array = schema.arrays[a];
    Json entry = {{"name", array.name},
                  {"location", array.location == Location::point ? "point" : "cell"},
                  {"type", scalar_name(array.type)},
                  {"components", array.components},
                  {"per_step", array.per_step},
                  {"elements", info.array_elements(a)},
                  {"role", array.role},
                  {"blocks", array.blocks}};
    add_quantization(entry, "", array.quantization, array.type);
    json["arrays"].push_back(std::move(entry));
  }
  json["step_times"] = info.step_times;
  json["sets"] = Json::array();
  for (const MeshSet& set : mesh_sets(info)) {
    Json entry = {{"kind", set.kind}, {"id", set.id}, {"name", set.name}};
    entry["members"] = set.members ? Json(*set.members) : Json(nullptr);
    json["sets"].push_back(std::move(entry));
  }
  json["extras"] = Json::array();
  for (const Extra& extra : info.extras)
    json["extras"].push_back({{"key", extra.key},
                              {"type", scalar_name(extra.type)},
                              {"shape", extra.shape},
                              {"bytes", extra.data.size()}});
  return json;
}

void add_counts(Json& json, const MeshInfo& info) {
  json["vertices"] = info.vertices;
  json["cells"] = info.cells();
  json["hexahedra"] = hexahedra_of(info);
  json["arrays"] = info.schema.arrays.size();
  json["steps"] = info.step_times.size();
}

}  // namespace

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

std::string ratio_text(std::uint64_t bytes, std::uint64_t source_bytes) {
  const std::string text = std::to_string(bytes) + " bytes from " + std::to_string(source_bytes);
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
  // Where no trial was made: only what is surely bad, and a third of the file.
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

namespace {

Json info_fields(const std::string& path, const MeshInfo& info, const Totals* totals) {
  Json json;
  json["file"] = path;
  json.update(schema_json(info));
  if (totals == nullptr) return json;
  json["total_bytes"] = totals->total_bytes;
  json["max_active_vertices"] = totals->max_active_vertices;
  json["segments"] = totals->segment_starts.size();
  json["segment_starts"] = totals->segment_starts;
  json["segment_codecs"] = codecs_json(totals->segment_connectivity);
  json["imported_vertices"] = totals->imported_vertices;
  json["connectivity_bits_per_hex"] =
      bits_each(connectivity_bytes(totals->streams), totals->hexahedra);
  json["geometry_bits_per_vertex"] =
      bits_each(bytes_of(totals->streams, "geometry"), totals->vertices);
  json["streams"] = Json::object();
  const auto arrays = arrays_by_stream(info.schema);
  for (const auto& [name, bytes] : totals->streams) {
    const auto [element, count] = element_of(name, arrays, info, *totals);
    Json entry = {{"bytes", bytes}};
    if (!element.empty()) {
      entry["element"] = element;
      entry["elements"] = count;
      entry["bits_per_element"] = bits_each(bytes, count);
    }
    json["streams"][name] = std::move(entry);
  }
  return json;
}

}  // namespace

std::string info_json(const std::string& path, const MeshInfo& info, const Totals* totals) {
  return dump(info_fields(path, info, totals));
}

std::string archive_json(const std::string& path, const std::vector<MemberSummary>& members) {
  Json json = {{"file", path}, {"members", Json::array()}};
  for (const MemberSummary& member : members)
    json["members"].push_back(info_fields(member.name, member.file.info, &member.file.totals));
  return dump(json);
}

std::string archive_text(const std::string& path, const std::vector<MemberSummary>& members) {
  std::string text = path + ": archive of " + plural(members.size(), "file", "files") + "\n";
  std::size_t width = 0;
  for (const MemberSummary& member : members) width = std::max(width, member.name.size());
  for (const MemberSummary& member : members)
    text += "  " + padded(member.name, width) + "  " +
            padded(std::to_string(member.file.totals.total_bytes), 12, true) + " bytes, " +
            counts_text(member.file.info) + "\n";
  return text;
}

std::string join_json(const std::string& output, std::uint64_t output_bytes,
                      const std::vector<MemberReport>& members) {
  Json json = {{"output", output}, {"output_bytes", output_bytes}, {"members", Json::array()}};
  for (const MemberReport& member : members)
    json["members"].push_back(
        {{"name", member.name}, {"input_bytes", member.input_bytes}, {"bytes", member.bytes}});
  return dump(json);
}

std::string join_text(const std::string& output, std::uint64_t output_bytes,
                      const std::vector<MemberReport>& members) {
  std::uint64_t input_bytes = 0;
  for (const MemberReport& member : members) input_bytes += member.input_bytes;
  return output + ": " + plural(members.size(), "file", "files") + ", " +
         std::to_string(input_bytes) + " to " + std::to_string(output_bytes) + " bytes (" +
         fixed(static_cast<double>(input_bytes) / static_cast<double>(output_bytes), 1) + "x)\n";
}

std::string info_text(const std::string& path, const MeshInfo& info, const Totals* totals) {
  const Schema& schema = info.schema;
  std::string text = path + ": " + counts_text(info) + "\n";
  text +=
      "source       " + (schema.source_format.empty() ? "unknown" : schema.source_format) + "\n";
  if (totals != nullptr) {
    text += "order        " + std::string(order_name(schema.order));
    if (schema.delay > 0) text += ", delay buffer of " + plural(schema.delay, "cell", "cells");
    if (!schema.corner_order) text += ", corners may come back rotated";
    text += "\ncodec        " + codecs_text(totals->segment_connectivity);
    text += "\nwidth        " + plural(totals->max_active_vertices, "vertex", "vertices") +
            " active at most";
    if (info.vertices > 0)
      text += ", " +
              fixed(100.0 * static_cast<double>(totals->max_active_vertices) /
                        static_cast<double>(info.vertices),
                    2) +
              " %";
    text += "\nsegments     " + std::to_string(totals->segment_starts.size());
    if (totals->segment_starts.size() > 1)
      text += ", " + plural(totals->imported_vertices, "vertex", "vertices") + " imported, " +
              fixed(100.0 * static_cast<double>(totals->imported_vertices) /
                        static_cast<double>(info.vertices),
                    2) +
              " %";
    text += "\n";
  }
  text += "coordinates  " + std::string(scalar_name(schema.coordinate_type)) +
          quantization_text(schema.coordinate_quantization, schema.coordinate_type) + "\n";

  text += "\nblocks\n";
  for (std::size_t b = 0; b < schema.blocks.size(); ++b) {
    const BlockInfo& block = schema.blocks[b];
    text += "  id " + std::to_string(block.id) +
            (block.name.empty() ? "" : " '" + block.name + "'") + ": " +
            plural(info.block_cells[b], "cell", "cells") + ", " +
            std::string(shape_name(block.shape)) + " of " +
            (block.nodes_per_cell == 0 ? "any number of nodes"
                                       : plural(block.nodes_per_cell, "node", "nodes")) +
            "\n";
  }
  if (!schema.arrays.empty()) text += "\narrays\n";
  for (const ArrayInfo& array : schema.arrays) {
    text += "  '" + array.name + "': " + (array.location == Location::point ? "point" : "cell") +
            " data, " + std::to_string(array.components) + " x " +
            std::string(scalar_name(array.type)) + (array.per_step ? ", each step" : "");
    if (!array.blocks.empty()) text += ", on " + plural(array.blocks.size(), "block", "blocks");
    if (!array.role.empty()) text += ", " + array.role;
    text += quantization_text(array.quantization, array.type) + "\n";
  }
  if (!info.step_times.empty())
    text += "\nsteps\n  " + plural(info.step_times.size(), "step", "steps") + ", times " +
            number_text(info.step_times.front()) + " to " + number_text(info.step_times.back()) +
            "\n";
  const std::vector<MeshSet> sets = mesh_sets(info);
  if (!sets.empty()) text += "\nsets\n";
  for (const MeshSet& set : sets) {
    text += "  " + set.kind + " " + set.id + (set.name.empty() ? "" : " '" + set.name + "'");
    if (set.members) text += ": " + plural(*set.members, "member", "members");
    text += "\n";
  }
  if (totals == nullptr) return text;

  text += "\nstreams" + padded("bytes", 41, true) + padded("bits per element", 24, true) + "\n";
  const auto arrays = arrays_by_stream(info.schema);
  for (const auto& [name, bytes] : totals->streams) {
    const auto [element, count] = element_of(name, arrays, info, *totals);
    text += "  " + padded(name, 30) + " " + padded(std::to_string(bytes), 15, true);
    if (count > 0) text += padded(fixed(bits_each(bytes, count), 3), 15, true) + " / " + element;
    text += "\n";
  }
  return text + "  " + padded("all", 30) + " " +
         padded(std::to_string(totals->total_bytes), 15, true) + "\n";
}

std::string sound_json(const std::string& path, const MeshInfo& info, const ParityState& parity,
                       std::uint64_t stray_bytes) {
  Json json;
  json["file"] = path;
  json["sound"] = true;  // the mesh
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
                         const std::string& restored, const MeshInfo& info) {
  Json json;
  json["file"] = restored;
  json["sound"] = true;
  json["against"] = source;
  json["equal"] = report.equal();
  json["differences"] = report.differences;
  json["first_differences"] = report.first;
  json["quantized"] = Json::array();
  for (const MeasuredError& error : report.measured)
    json["quantized"].push_back({{"what", error.what},
                                 {"largest_error", error.largest},
                                 {"promised_error", error.promised}});
  add_counts(json, info);
  return dump(json);
}

std::string compare_text(const CompareReport& report, const std::string& source,
                         const std::string& restored) {
  std::string text;
  if (report.equal()) {
    text = restored + ": " + (report.measured.empty() ? "equal to " : "within its promise of ") +
           source + "\n";
  } else {
    text = restored + ": " + plural(report.differences, "difference", "differences") + " from " +
           source + "\n";
    for (const std::string& difference : report.first) text += "  " + difference + "\n";
    if (report.differences > report.first.size())
      text += "  and " + std::to_string(report.differences - report.first.size()) + " more\n";
  }
  for (const MeasuredError& error : report.measured)
    text += "  " + error.what + ": largest error " + number_text(error.largest) + ", promised " +
            number_text(error.promised) + "\n";
  return text;
}

}  // namespace shm::converters
