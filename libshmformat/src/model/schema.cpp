#include "shm/schema.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

namespace shm {

std::string_view scalar_name(ScalarType type) {
  switch (type) {
    case ScalarType::int8: return "int8";
    case ScalarType::uint8: return "uint8";
    case ScalarType::int16: return "int16";
    case ScalarType::uint16: return "uint16";
    case ScalarType::int32: return "int32";
    case ScalarType::uint32: return "uint32";
    case ScalarType::int64: return "int64";
    case ScalarType::uint64: return "uint64";
    case ScalarType::float32: return "float32";
    case ScalarType::float64: return "float64";
  }
  return "unknown";
}

std::string_view shape_name(CellShape shape) {
  switch (shape) {
    case CellShape::other: return "other";
    case CellShape::vertex: return "vertex";
    case CellShape::line: return "line";
    case CellShape::triangle: return "triangle";
    case CellShape::quad: return "quad";
    case CellShape::polygon: return "polygon";
    case CellShape::tetrahedron: return "tetrahedron";
    case CellShape::pyramid: return "pyramid";
    case CellShape::wedge: return "wedge";
    case CellShape::hexahedron: return "hexahedron";
    case CellShape::polyhedron: return "polyhedron";
  }
  return "unknown";
}

std::string_view order_name(Order order) {
  switch (order) {
    case Order::keep: return "keep";
    case Order::stream: return "stream";
    case Order::free: return "free";
  }
  return "unknown";
}

std::string_view codec_name(ConnectivityCodec codec) {
  switch (codec) {
    case ConnectivityCodec::automatic: return "automatic";
    case ConnectivityCodec::paper: return "paper";
    case ConnectivityCodec::rows: return "rows";
    case ConnectivityCodec::replay: return "replay";
    case ConnectivityCodec::mixed: return "mixed";
    case ConnectivityCodec::shifts: return "shifts";
  }
  return "unknown";
}

namespace {

/// Of the array that is the `same`th of its name.
std::string stream_name(const ArrayInfo& info, std::size_t same) {
  std::string name = info.location == Location::point ? "array:point/" : "array:cell/";
  name += info.name;
  if (same > 1) name += "#" + std::to_string(same);
  return name;
}

}  // namespace

std::string array_stream_name(const Schema& schema, std::size_t array) {
  const ArrayInfo& info = schema.arrays[array];
  std::size_t same = 1;
  for (std::size_t a = 0; a < array; ++a)
    if (schema.arrays[a].name == info.name && schema.arrays[a].location == info.location) ++same;
  return stream_name(info, same);
}

std::vector<std::string> array_stream_names(const Schema& schema) {
  std::map<std::pair<Location, std::string_view>, std::size_t> seen;
  std::vector<std::string> names;
  for (const ArrayInfo& info : schema.arrays)
    names.push_back(stream_name(info, ++seen[{info.location, info.name}]));
  return names;
}

Quantization Quantization::absolute(double max_abs, std::uint32_t components) {
  constexpr double kShade = 0x1p-6;  // costs .02 bits a value
  Quantization quantization;
  quantization.bits = kAbsolute;
  quantization.minimum.assign(components, 0.0);
  quantization.max_abs = max_abs;
  quantization.spacing = 2 * max_abs * (1 - kShade);
  return quantization;
}

double Quantization::step() const {
  if (bits == kAbsolute) return spacing;
  double side = 0;
  for (std::size_t c = 0; c < minimum.size() && c < maximum.size(); ++c)
    side = std::max(side, maximum[c] - minimum[c]);
  const double intervals = static_cast<double>((std::uint64_t{1} << bits) - 1);
  return side > 0 && bits > 0 ? side / intervals : 1.0;
}

double Quantization::max_error(ScalarType type) const {
  if (bits == kAbsolute) return max_abs;
  double magnitude = 0;
  for (double v : minimum) magnitude = std::max(magnitude, std::fabs(v));
  for (double v : maximum) magnitude = std::max(magnitude, std::fabs(v));
  // Twice the half-ulp of the stored type: once for the restored value, once for the arithmetic.
  const double ulp = type == ScalarType::float32 ? 0x1p-23 : 0x1p-51;
  return step() / 2 + magnitude * ulp;
}

std::string Error::message() const {
  std::string text;
  const auto add = [&](const std::string& part, const char* separator) {
    if (part.empty()) return;
    if (!text.empty()) text += separator;
    text += part;
  };
  add(file, ": ");
  add(section, ": ");
  if (offset != kNoOffset) add("at byte " + std::to_string(offset), text == file ? ": " : ", ");
  add(detail, ": ");
  return text;
}

}  // namespace shm
