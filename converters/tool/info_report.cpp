#include "tool/info_report.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

#include "accuracy/block_bounds.h"
#include "base/failure.h"
#include "base/stored_value.h"
#include "formats/formats.h"
#include "interface/format.h"
#include "mesh/array_names.h"
#include "shm/cell_nodes.h"
#include "shm/segment_reader.h"
#include "tool/progress_line.h"
#include "tool/report.h"
#include "transfer/named_groups.h"

namespace shm::converters {
namespace {

using Box = std::array<double, 6>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr Box kNoBox = {kInfinity, kInfinity, kInfinity, -kInfinity, -kInfinity, -kInfinity};

// Maps the stream name of each array to the index of the array.
std::map<std::string, std::size_t> arrays_by_stream(const Schema& schema) {
  std::map<std::string, std::size_t> arrays;
  for (std::string& name : array_stream_names(schema))
    arrays.emplace(std::move(name), arrays.size());
  return arrays;
}

// The report shows the size of a stream in bits per cell, bits per vertex or bits per value.
// Returns the kind of element ("cell", "vertex" or "value") for the given stream, and the number of
// these elements. The kind is "" if the report does not show bits per element for this stream.
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

std::string codecs_text(const std::vector<ConnectivityCodec>& of_segments) {
  std::map<ConnectivityCodec, std::size_t> segments;
  for (ConnectivityCodec codec : of_segments)
    if (codec != ConnectivityCodec::automatic)
      ++segments[codec];  // `automatic` means that the segment has no cells
  if (segments.empty()) return "none";
  std::string text;
  for (const auto& [codec, count] : segments) {
    text += (text.empty() ? "" : ", ") + std::string(codec_name(codec));
    if (segments.size() > 1) text += " in " + plural(count, "segment", "segments");
  }
  return text;
}

// Returns the codec names as JSON, one name per segment.
Json codecs_json(const std::vector<ConnectivityCodec>& of_segments) {
  Json names = Json::array();
  for (ConnectivityCodec codec : of_segments)
    names.push_back(codec == ConnectivityCodec::automatic ? "none" : codec_name(codec));
  return names;
}

std::string quantization_text(const Quantization& quantization, ScalarType type) {
  if (!quantization.lossy()) return {};
  std::string text = ", rounded";
  if (quantization.bits == Quantization::kRelative)
    return text + ", error at most " + number_text(quantization.max_rel) + " of each value";
  if (quantization.bits != Quantization::kAbsolute)
    text += " to " + std::to_string(quantization.bits) + " bits";
  return text + ", error at most " + number_text(quantization.max_error(type));
}

// Adds two members to `json`. "bits" is the number of bits per coordinate or value, or 0 if the
// data was not rounded to a number of bits. "max_error" is the largest error, or null if the data
// is lossless or its bound is relative to each value. `prefix` precedes both names. The bound that
// is relative to each value is "max_relative_error".
void add_quantization(Json& json, const std::string& prefix, const Quantization& quantization,
                      ScalarType type) {
  const bool is_relative = quantization.bits == Quantization::kRelative;
  const bool of_box = quantization.bits > 0 && quantization.bits < Quantization::kAbsolute;
  json[prefix + "bits"] = of_box ? quantization.bits : 0;
  json[prefix + "max_error"] =
      quantization.lossy() && !is_relative ? Json(quantization.max_error(type)) : Json(nullptr);
  if (is_relative) json[prefix + "max_relative_error"] = quantization.max_rel;
}

// Returns the order of the cells of a block, or null if it is unknown.
Json order_json(const BlockInfo& block) {
  const std::uint32_t order = cell_order(block);
  return order > 0 ? Json(order) : Json(nullptr);
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
                              {"order", order_json(block)},
                              {"node_scheme", scheme_name(block.scheme)},
                              {"cells", info.block_cells[b]}});
  }
  json["arrays"] = Json::array();
  const BlockBounds bounds = block_bounds_in(info);
  for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
    const ArrayInfo& array = schema.arrays[a];
    Json entry = {{"name", array.name},
                  {"location", location_name(array.location)},
                  {"type", scalar_name(array.type)},
                  {"components", array.components},
                  {"per_step", array.per_step},
                  {"elements", info.array_elements(a)},
                  {"role", array.role},
                  {"blocks", array.blocks}};
    if (!is_on_mesh(array.location)) {
      entry["blocks"] = Json::array();
      entry["sets"] = array.blocks;
    }
    add_quantization(entry, "", array.quantization, array.type);
    if (!bounds[a].empty()) entry["max_error_of_blocks"] = bounds[a];
    entry["fills"] = array.fills;
    json["arrays"].push_back(std::move(entry));
  }
  json["step_times"] = info.step_times;
  json["sets"] = Json::array();
  for (const NamedGroup& set : named_groups_of(info)) {
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

// Returns the title of the mesh. Some formats pad titles with zero bytes, which are removed.
std::string title_of(const MeshInfo& info) {
  Keys used;
  const Extra* const given = find_extra(info, "mesh/title");
  const std::string title =
      given != nullptr ? text_of_extra(*given) : source_format(info).title(info, used);
  return title.substr(0, title.find('\0'));
}

// Replaces control characters in a name. Names come from files, and control characters could move
// the cursor of a terminal.
std::string quoted(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  return "'" + name + "'";
}

Json info_fields(const InfoReport& report) {
  const MeshInfo& info = report.info;
  const Totals* const totals = report.totals;
  Json json;
  json["file"] = report.path;
  json["title"] = title_of(info);
  json.update(schema_json(info));
  json["bytes_as_numbers"] = bytes_of_mesh(info).all();
  json["box"] = report.extent.box ? Json(*report.extent.box) : Json(nullptr);
  for (std::size_t a = 0; a < report.extent.ranges.size(); ++a) {
    const FoundRange& range = report.extent.ranges[a];
    json["arrays"][a]["range"] =
        range.is_empty ? Json(nullptr) : Json::array({range.least, range.most});
    json["arrays"][a]["not_finite"] = range.not_finite;
  }
  if (totals == nullptr) return json;
  json["total_bytes"] = totals->total_bytes;
  json["digest"] = totals->digest ? Json(hexadecimal(*totals->digest)) : Json(nullptr);
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

// Formats a number with six significant digits.
std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

std::string megabytes(std::uint64_t bytes) {
  if (bytes < 1'000'000) return plural(bytes, "byte", "bytes");
  return fixed(1e-6 * static_cast<double>(bytes), 1) + " MB";
}

std::string box_text(const Box& box) {
  std::string text;
  constexpr std::string_view kAxes = "xyz";
  for (std::size_t axis = 0; axis < 3; ++axis)
    text += (axis == 0 ? "" : ", ") + std::string(1, kAxes[axis]) + " " + short_number(box[axis]) +
            " to " + short_number(box[axis + 3]);
  return text;
}

std::string times_text(const std::vector<double>& times) {
  constexpr std::size_t kShown = 8, kBefore = 3;
  std::string text = plural(times.size(), "step", "steps") + ", times ";
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (times.size() > kShown && i == kBefore) {
      text += ", ...";
      i = times.size() - 1;
    }
    text += (i == 0 ? "" : ", ") + number_text(times[i]);
  }
  return text;
}

// Lists the first 100 items, one per line. If there are more than 100 items, the last line states
// how many items are not listed.
template <class List, class Line>
std::string first_of(const List& list, Line&& line) {
  constexpr std::size_t kShown = 100;
  std::string text;
  for (std::size_t i = 0; i < std::min(list.size(), kShown); ++i) text += "  " + line(i) + "\n";
  if (list.size() > kShown)
    text += "  and " + std::to_string(list.size() - kShown) + " more (--json lists all)\n";
  return text;
}

// Returns the text ", order p" if the cells of a block have an order above 1, with their node
// scheme unless it is lagrange.
std::string order_text(const BlockInfo& block) {
  const std::uint32_t order = cell_order(block);
  if (order <= 1) return {};
  const std::string text = ", order " + std::to_string(order);
  return block.scheme == NodeScheme::lagrange
             ? text
             : text + ", " + std::string(scheme_name(block.scheme));
}

std::string block_text(const BlockInfo& block, std::uint64_t cells) {
  return "id " + std::to_string(block.id) + (block.name.empty() ? "" : " " + quoted(block.name)) +
         ": " + plural(cells, "cell", "cells") + ", " + std::string(shape_name(block.shape)) +
         " of " +
         (block.nodes_per_cell == 0 ? "any number of nodes"
                                    : plural(block.nodes_per_cell, "node", "nodes")) +
         order_text(block);
}

// Returns the bounds of blocks of an array as text. `bounds` is empty if the array has none.
std::string block_bounds_text(const Schema& schema, const std::vector<double>& bounds) {
  if (bounds.empty()) return {};
  std::vector<std::size_t> blocks(bounds.size());
  std::iota(blocks.begin(), blocks.end(), std::size_t{0});
  return ", rounded, error at most " + listed(blocks, [&](std::size_t b) {
           return number_text(bounds[b]) + " in block " +
                  with_name(schema.blocks[b].id, schema.blocks[b].name);
         });
}

std::string array_text(const ArrayInfo& array, const std::string& bounds, const FoundRange* range) {
  std::string location(location_name(array.location));
  std::replace(location.begin(), location.end(), '_', ' ');
  std::string text = quoted(array.name) + ": " + location + " data, " +
                     std::to_string(array.components) + " x " +
                     std::string(scalar_name(array.type)) + (array.per_step ? ", each step" : "");
  const bool on_mesh = is_on_mesh(array.location);
  if (!array.blocks.empty())
    text += ", on " + (on_mesh ? plural(array.blocks.size(), "block", "blocks")
                               : plural(array.blocks.size(), "set", "sets"));
  if (!on_mesh && array.location != Location::global)
    text += ", " + plural(array.elements, "member", "members");
  if (!array.role.empty()) text += ", " + array.role;
  text += quantization_text(array.quantization, array.type) + bounds;
  for (const double fill : array.fills) text += ", fill value " + number_text(fill);
  if (range == nullptr) return text;
  text += range->is_empty ? ", no finite value"
                          : ", " + short_number(range->least) + " to " + short_number(range->most);
  if (range->not_finite > 0) text += ", " + std::to_string(range->not_finite) + " not finite";
  return text;
}

std::string_view ranges_hint(const InfoExtent& extent) {
  if (extent.is_unreadable) return " (not all values can be read: see shm verify)";
  return extent.ranges.empty() ? " (--ranges reads their values)" : "";
}

std::string set_text(const NamedGroup& set) {
  return set.kind + " " + set.id + (set.name.empty() ? "" : " " + quoted(set.name)) +
         (set.members ? ": " + plural(*set.members, "member", "members") : std::string());
}

std::string coder_text(const MeshInfo& info, const Totals& totals) {
  const Schema& schema = info.schema;
  std::string text = "order        " + std::string(order_name(schema.order));
  if (schema.delay > 0) text += ", delay buffer of " + plural(schema.delay, "cell", "cells");
  if (!schema.corner_order) text += ", corners may come back rotated";
  if (totals.digest) text += "\ndigest       " + hexadecimal(*totals.digest);
  text += "\ncodec        " + codecs_text(totals.segment_connectivity);
  text += "\nwidth        " + plural(totals.max_active_vertices, "vertex", "vertices") +
          " active at most";
  if (info.vertices > 0)
    text += ", " +
            fixed(100.0 * static_cast<double>(totals.max_active_vertices) /
                      static_cast<double>(info.vertices),
                  2) +
            " %";
  text += "\nsegments     " + std::to_string(totals.segment_starts.size());
  if (totals.segment_starts.size() > 1)
    text += ", " + plural(totals.imported_vertices, "vertex", "vertices") + " imported, " +
            fixed(100.0 * static_cast<double>(totals.imported_vertices) /
                      static_cast<double>(info.vertices),
                  2) +
            " %";
  text += "\n";
  text += "\nstreams" + padded("bytes", 41, true) + padded("bits per element", 24, true) + "\n";
  const auto arrays = arrays_by_stream(info.schema);
  for (const auto& [name, bytes] : totals.streams) {
    const auto [element, count] = element_of(name, arrays, info, totals);
    text += "  " + padded(name, 30) + " " + padded(std::to_string(bytes), 15, true);
    if (count > 0) text += padded(fixed(bits_each(bytes, count), 3), 15, true) + " / " + element;
    text += "\n";
  }
  return text + "  " + padded("all", 30) + " " +
         padded(std::to_string(totals.total_bytes), 15, true) + "\n";
}

// Extends a range so that it includes all finite numbers in `values`.
void widen(FoundRange& range, const std::byte* values, std::size_t count, ScalarType type) {
  with_scalar(type, [&](auto zero) {
    using T = decltype(zero);
    for (std::size_t i = 0; i < count; ++i) {
      const double value = static_cast<double>(load<T>(values + i * sizeof(T)));
      if (!std::isfinite(value)) {
        ++range.not_finite;
        continue;
      }
      range.least = range.is_empty ? value : std::min(range.least, value);
      range.most = range.is_empty ? value : std::max(range.most, value);
      range.is_empty = false;
    }
  });
}

}  // namespace

std::optional<Box> box_of_index(const std::string& path, std::uint64_t trailing_bytes) {
  const auto file = unwrap(FileRandomSource::open(path), path);
  SectionSource mesh(*file, 0, file->size() - trailing_bytes);
  const auto reader = SegmentReader::open(mesh);
  if (!reader) return std::nullopt;
  Box box = kNoBox;
  for (const SegmentInfo& segment : reader->segments())
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box[axis] = std::min(box[axis], segment.box[axis]);
      box[axis + 3] = std::max(box[axis + 3], segment.box[axis + 3]);
    }
  if (!(box[0] <= box[3])) return std::nullopt;
  return box;
}

InfoExtent measure_extent(MeshSource& mesh, bool ranges, const Progress& progress) {
  constexpr std::uint64_t kElements = 1 << 14;
  WatchedMesh watched(mesh, progress, "measuring");
  const MeshInfo& info = mesh.info();
  InfoExtent extent;
  const ScalarType type = info.schema.coordinate_type;
  std::vector<std::byte> values(kElements * 3 * scalar_bytes(type));
  std::array<FoundRange, 3> axes;
  for (std::uint64_t first = 0; first < info.vertices; first += kElements) {
    const std::uint64_t count = std::min(kElements, info.vertices - first);
    watched.read_points(first, count, values.data());
    for (std::uint64_t i = 0; i < 3 * count; ++i)
      widen(axes[i % 3], values.data() + i * scalar_bytes(type), 1, type);
  }
  if (std::none_of(axes.begin(), axes.end(), [](const FoundRange& axis) { return axis.is_empty; }))
    extent.box = {axes[0].least, axes[1].least, axes[2].least,
                  axes[0].most,  axes[1].most,  axes[2].most};
  for (std::size_t a = 0; ranges && a < info.schema.arrays.size(); ++a) {
    const ArrayInfo& array = info.schema.arrays[a];
    FoundRange& range = extent.ranges.emplace_back();
    const std::uint64_t elements = info.array_elements(a), stride = info.array_stride(a);
    const std::uint64_t at_once = std::max<std::uint64_t>(1, values.size() / stride);
    values.resize(std::max<std::size_t>(values.size(), at_once * stride));
    const std::uint64_t steps = array.per_step ? info.step_times.size() : 1;
    for (std::uint64_t step = 0; step < steps; ++step)
      for (std::uint64_t first = 0; first < elements; first += at_once) {
        const std::uint64_t count = std::min(at_once, elements - first);
        watched.read_array(a, step, first, count, values.data());
        widen(range, values.data(), count * array.components, array.type);
      }
  }
  return extent;
}

std::string info_json(const InfoReport& report) { return dump(info_fields(report)); }

std::string info_text(const InfoReport& report, bool verbose) {
  const MeshInfo& info = report.info;
  const Schema& schema = info.schema;
  std::string text = report.path + ": " + counts_text(info) + "\n";
  if (const std::string title = title_of(info); !title.empty())
    text += "title        " + quoted(title) + "\n";
  text +=
      "source       " + (schema.source_format.empty() ? "unknown" : schema.source_format) + "\n";
  const std::uint64_t numbers = bytes_of_mesh(info).all();
  text += "size         ";
  text += report.totals != nullptr
              ? ratio_text(report.totals->total_bytes, numbers, " of numbers in memory") + "\n"
              : megabytes(numbers) + " of numbers in memory\n";
  if (report.extent.box) text += "box          " + box_text(*report.extent.box) + "\n";
  text += "coordinates  " + std::string(scalar_name(schema.coordinate_type)) +
          quantization_text(schema.coordinate_quantization, schema.coordinate_type) + "\n";
  if (!info.step_times.empty()) text += "time         " + times_text(info.step_times) + "\n";
  text += "\nblocks\n" + first_of(schema.blocks, [&](std::size_t b) {
            return block_text(schema.blocks[b], info.block_cells[b]);
          });
  const auto& ranges = report.extent.ranges;
  const BlockBounds bounds = block_bounds_in(info);
  if (!schema.arrays.empty())
    text += "\narrays" + std::string(ranges_hint(report.extent)) + "\n" +
            first_of(schema.arrays, [&](std::size_t a) {
              return array_text(schema.arrays[a], block_bounds_text(schema, bounds[a]),
                                ranges.empty() ? nullptr : &ranges[a]);
            });
  const std::vector<NamedGroup> sets = named_groups_of(info);
  if (!sets.empty())
    text += "\nsets\n" + first_of(sets, [&](std::size_t s) { return set_text(sets[s]); });
  if (verbose && report.totals != nullptr) text += "\n" + coder_text(info, *report.totals);
  return text;
}

std::string archive_json(const std::string& path, const std::vector<MemberSummary>& members) {
  Json json = {{"file", path}, {"members", Json::array()}};
  for (const MemberSummary& member : members)
    json["members"].push_back(
        info_fields({member.name, member.file.info, &member.file.totals, {}}));
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

}  // namespace shm::converters
