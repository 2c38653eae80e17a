#include "format/schema.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "base/errors.h"
#include "base/packing.h"
#include "format/format.h"
#include "shm/cell_nodes.h"

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
    case CellShape::faces: return "faces";
  }
  return "unknown";
}

std::string_view scheme_name(NodeScheme scheme) {
  switch (scheme) {
    case NodeScheme::lagrange: return "lagrange";
    case NodeScheme::serendipity: return "serendipity";
    case NodeScheme::bezier: return "bezier";
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

std::string_view location_name(Location location) {
  switch (location) {
    case Location::point: return "point";
    case Location::cell: return "cell";
    case Location::global: return "global";
    case Location::node_set: return "node_set";
    case Location::side_set: return "side_set";
    case Location::element_set: return "element_set";
  }
  return "unknown";
}

namespace {

/// Number of bits of a block's byte `shape` that contain the cell shape. The other bits contain the
/// node scheme.
constexpr std::uint32_t kShapeBits = 4;

/// Returns the name of the stream of an array. `same` is the position of the array among the arrays
/// with the same name and location, counted from 1.
std::string stream_name(const ArrayInfo& info, std::size_t same) {
  std::string name = "array:" + std::string(location_name(info.location)) + "/" + info.name;
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

namespace {

/// Smallest and largest `spacing` of a relative bound. Indices of values are then at most 2^53.
double least_spacing(ScalarType type) { return type == ScalarType::float32 ? 2 : 1024; }
double most_spacing(ScalarType type) { return type == ScalarType::float32 ? 0x1p23 : 0x1p52; }

}  // namespace

Quantization Quantization::absolute(double max_abs, std::uint32_t components) {
  // Relative safety margin by which the quantization step is reduced. The smaller step costs 0.02
  // bits per value.
  constexpr double kShade = 0x1p-6;
  Quantization quantization;
  quantization.bits = kAbsolute;
  quantization.minimum.assign(components, 0.0);
  quantization.max_abs = max_abs;
  quantization.spacing = 2 * max_abs * (1 - kShade);
  return quantization;
}

Quantization Quantization::relative(double max_rel, ScalarType type) {
  // Numbers of the type are most dense, relative to their size, just below a power of two, and
  // least dense just above it: there, their distance is 2^-23 or 2^-52 of the number. The bound is
  // half the distance between restored values.
  constexpr double kShade = 0x1p-20;
  const double numbers = type == ScalarType::float32 ? 0x1p24 : 0x1p53;
  Quantization quantization;
  const double spacing = std::floor(max_rel * numbers * (1 - kShade));
  if (!(spacing >= least_spacing(type))) return quantization;
  quantization.bits = kRelative;
  quantization.max_rel = max_rel;
  quantization.spacing = std::min(spacing, most_spacing(type));
  return quantization;
}

double Quantization::step() const {
  if (bits == kAbsolute || bits == kRelative) return spacing;
  double side = 0;
  for (std::size_t c = 0; c < minimum.size() && c < maximum.size(); ++c)
    side = std::max(side, maximum[c] - minimum[c]);
  const double intervals = static_cast<double>((std::uint64_t{1} << bits) - 1);
  return side > 0 && bits > 0 ? side / intervals : 1.0;
}

double Quantization::max_error(ScalarType type) const {
  if (bits == kAbsolute) return max_abs;
  if (bits == kRelative) return std::numeric_limits<double>::infinity();
  double magnitude = 0;
  for (double v : minimum) magnitude = std::max(magnitude, std::fabs(v));
  for (double v : maximum) magnitude = std::max(magnitude, std::fabs(v));
  // Rounding to a step causes an error of at most half a step. The bound adds at least two
  // half-ulps of the stored type: one for rounding the restored value, one for the arithmetic.
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

bool has_steps(const Schema& schema) {
  return std::any_of(schema.arrays.begin(), schema.arrays.end(),
                     [](const ArrayInfo& info) { return info.per_step; });
}

// --- encoding, decoding and checks

namespace {

bool is_scalar(ScalarType type) { return scalar_bytes(type) != 0; }

void put(ByteWriter& out, const Quantization& q) {
  out.put_u8(static_cast<std::uint8_t>(q.bits));
  if (!q.lossy()) return;
  const bool absolute = q.bits == Quantization::kAbsolute;
  if (q.bits == Quantization::kRelative) {
    out.put_f64(q.max_rel);
    out.put_varint(static_cast<std::uint64_t>(q.spacing));
    return;
  }
  if (absolute) {
    out.put_f64(q.max_abs);
    out.put_f64(q.spacing);
  }
  out.put_varint(q.minimum.size());
  for (std::size_t c = 0; c < q.minimum.size(); ++c) {
    out.put_f64(q.minimum[c]);
    if (!absolute) out.put_f64(q.maximum[c]);
  }
}
void get(ByteReader& in, Quantization& q) {
  q.bits = in.get_u8();
  if (!q.lossy()) return;
  const bool absolute = q.bits == Quantization::kAbsolute;
  if (q.bits == Quantization::kRelative) {
    q.max_rel = in.get_f64();
    q.spacing = static_cast<double>(in.get_varint());
    return;
  }
  if (absolute) {
    q.max_abs = in.get_f64();
    q.spacing = in.get_f64();
  }
  for (std::uint64_t n = in.get_count(absolute ? 8 : 16); n > 0 && in.ok(); --n) {
    q.minimum.push_back(in.get_f64());
    if (!absolute) q.maximum.push_back(in.get_f64());
  }
}

Error wrong(std::string detail, ErrorCode code = ErrorCode::misuse) {
  return Error{code, std::move(detail), "schema"};
}

constexpr double kTooLarge = 1e300;  // largest number that the computations of quantization accept

Result<void> check_bound(const Quantization& q, std::size_t components, const std::string& what) {
  if (!(q.max_abs > 0 && q.max_abs < kTooLarge))
    return wrong(what + ": the error bound is not a positive number");
  if (!(q.spacing > 0 && q.spacing < 2 * kTooLarge))
    return wrong(what + ": the quantization step of the error bound is not a positive number");
  if (q.minimum.size() != components || !q.maximum.empty())
    return wrong(what + ": an error bound needs one anchor per component, and no range");
  for (double anchor : q.minimum)
    if (!(std::fabs(anchor) < kTooLarge)) return wrong(what + ": an anchor is not finite");
  return {};
}

Result<void> check_relative(const Quantization& q, ScalarType type, const std::string& what) {
  if (!(q.max_rel > 0 && q.max_rel <= 0.5))
    return wrong(what + ": the relative error bound is not a positive number of at most 0.5");
  if (!(q.spacing >= least_spacing(type) && q.spacing <= most_spacing(type) &&
        std::floor(q.spacing) == q.spacing))
    return wrong(what + ": the spacing of the relative error bound is out of range");
  if (!q.minimum.empty() || !q.maximum.empty() || q.max_abs != 0)
    return wrong(what + ": a relative error bound has neither anchors, nor a range, nor max_abs");
  return {};
}

Result<void> check_quantization(const Quantization& q, ScalarType type, std::size_t components,
                                const std::string& what) {
  if (q.lossy() && !is_float(type))
    return wrong(what + ": only floating-point values can be quantized");
  if (q.bits == Quantization::kRelative) return check_relative(q, type, what);
  if (q.max_rel != 0)
    return wrong(what + ": max_rel must be 0 unless bits is Quantization::kRelative");
  if (q.bits == Quantization::kAbsolute) return check_bound(q, components, what);
  if (q.max_abs != 0 || q.spacing != 0)
    return wrong(what + ": max_abs and spacing must be 0 unless bits is Quantization::kAbsolute");
  if (q.bits == 0) return {};
  if (q.bits > 52) return wrong(what + ": quantization must have 1 to 52 bits");
  if (q.minimum.size() != components || q.maximum.size() != components)
    return wrong(what + ": quantization needs a range for each component");
  for (std::size_t c = 0; c < components; ++c)
    if (!(std::fabs(q.minimum[c]) < kTooLarge && std::fabs(q.maximum[c]) < kTooLarge &&
          q.minimum[c] <= q.maximum[c]))
      return wrong(what + ": quantization range is not finite or is reversed");
  return {};
}

/// Checks the location of an array, and the blocks and sets that it covers.
Result<void> check_location(const Schema& schema, const ArrayInfo& array, const std::string& what,
                            const ReadLimits& limits) {
  if (array.location > Location::element_set) return wrong(what + ": unknown location");
  if (array.location == Location::point && !array.blocks.empty())
    return wrong(what + ": point arrays cover every vertex");
  if (array.location == Location::global && !array.blocks.empty())
    return wrong(what + ": global arrays have neither blocks nor sets");
  for (std::size_t i = 0; i < array.blocks.size(); ++i)
    if ((array.location == Location::cell && array.blocks[i] >= schema.blocks.size()) ||
        (i > 0 && array.blocks[i] <= array.blocks[i - 1]))
      return wrong(what + ": block indices must ascend and exist");
  if (is_on_mesh(array.location))
    return array.elements == 0 ? Result<void>()
                               : wrong(what + ": the mesh determines the number of elements");
  if (!array.per_step)
    return wrong(what + ": an array that is neither on points nor on cells must have time steps");
  if (array.elements > limits.max_group_bytes / (scalar_bytes(array.type) * array.components))
    return wrong(what + ": a step has more bytes than the limit of " +
                     std::to_string(limits.max_group_bytes),
                 ErrorCode::over_limit);
  return {};
}

Result<void> check_array(const Schema& schema, const ArrayInfo& array, const ReadLimits& limits) {
  const std::string what = "array '" + array.name + "'";
  if (!is_scalar(array.type)) return wrong(what + ": unknown scalar type");
  if (array.components < 1 || array.components > 65535)
    return wrong(what + ": the number of components must be 1 to 65535");
  if (auto status = check_location(schema, array, what, limits); !status) return status;
  if (!array.fills.empty() && !is_float(array.type))
    return wrong(what + ": only floating-point arrays have fill values");
  if (array.fills.size() > kMaxFills)
    return wrong(what + ": an array has at most " + std::to_string(kMaxFills) + " fill values");
  for (const double fill : array.fills)
    if (!std::isfinite(fill) || (array.type == ScalarType::float32 &&
                                 static_cast<double>(static_cast<float>(fill)) != fill))
      return wrong(what + ": a fill value is not a finite number of the array's type");
  return check_quantization(array.quantization, array.type, array.components, what);
}

}  // namespace

namespace {

/// Returns true if the schema states the number of elements of arrays at this location. False for a
/// location that does not exist.
bool states_elements(Location location) {
  return !is_on_mesh(location) && location <= Location::element_set;
}

}  // namespace

void put(ByteWriter& out, const Schema& schema) {
  out.put_u8(static_cast<std::uint8_t>(schema.order));
  out.put_u8(schema.corner_order ? 1 : 0);
  out.put_varint(schema.delay);
  out.put_u8(static_cast<std::uint8_t>(schema.coordinate_type));
  put(out, schema.coordinate_quantization);
  out.put_text(schema.source_format);
  out.put_varint(schema.blocks.size());
  for (const BlockInfo& block : schema.blocks) {
    out.put_signed(block.id);
    out.put_text(block.name);
    out.put_u8(static_cast<std::uint8_t>(static_cast<unsigned>(block.shape) |
                                         static_cast<unsigned>(block.scheme) << kShapeBits));
    out.put_varint(block.nodes_per_cell);
  }
  out.put_varint(schema.arrays.size());
  for (const ArrayInfo& array : schema.arrays) {
    out.put_text(array.name);
    out.put_u8(static_cast<std::uint8_t>(array.location));
    out.put_u8(static_cast<std::uint8_t>(array.type));
    out.put_varint(array.components);
    out.put_u8(array.per_step ? 1 : 0);
    out.put_varint(array.blocks.size());
    for (std::uint32_t block : array.blocks) out.put_varint(block);
    if (states_elements(array.location)) out.put_varint(array.elements);
    out.put_text(array.role);
    put(out, array.quantization);
  }
  std::vector<std::pair<std::size_t, double>> fills;
  for (std::size_t a = 0; a < schema.arrays.size(); ++a)
    for (const double fill : schema.arrays[a].fills) fills.emplace_back(a, fill);
  if (schema.step_references != StepReference::base || !fills.empty())
    out.put_u8(static_cast<std::uint8_t>(schema.step_references));
  if (fills.empty()) return;
  out.put_varint(fills.size());
  for (const auto& [array, fill] : fills) {
    out.put_varint(array);
    out.put_f64(fill);
  }
}
std::uint32_t checksum_of(const Schema& schema) {
  ByteWriter out;
  put(out, schema);
  return checksum(out.bytes);
}

namespace {

// Memory in bytes that an object of each type uses of the memory limit, in addition to its lists
// and strings. The sizes are rounded up and do not depend on the machine, so that all machines
// refuse the same files.
constexpr std::uint64_t kSchemaBytes = 256, kBlockBytes = 64, kArrayBytes = 256, kExtraBytes = 128;
static_assert(sizeof(Schema) <= kSchemaBytes && sizeof(BlockInfo) <= kBlockBytes &&
              sizeof(ArrayInfo) <= kArrayBytes && sizeof(Extra) <= kExtraBytes);

std::uint64_t bytes_of(const BlockInfo& block) { return kBlockBytes + block.name.size(); }
std::uint64_t bytes_of(const ArrayInfo& array) {
  return kArrayBytes + array.name.size() + array.role.size() +
         array.blocks.size() * sizeof array.blocks[0] + array.fills.size() * sizeof(double) +
         (array.quantization.minimum.size() + array.quantization.maximum.size()) * sizeof(double);
}

Error too_many_blocks(const ReadLimits& limits) {
  return wrong(
      "there are more element blocks than the limit of " + std::to_string(limits.max_blocks),
      ErrorCode::over_limit);
}
Error too_many_arrays(const ReadLimits& limits) {
  return wrong("there are more arrays than the limit of " + std::to_string(limits.max_arrays),
               ErrorCode::over_limit);
}

}  // namespace

std::uint64_t bytes_of(const Schema& schema) {
  std::uint64_t bytes = kSchemaBytes + schema.source_format.size();
  for (const BlockInfo& block : schema.blocks) bytes += bytes_of(block);
  for (const ArrayInfo& array : schema.arrays) bytes += bytes_of(array);
  return bytes;
}

namespace {

/// Reads the fill values of all arrays. Returns false if they are invalid. Each takes nine bytes of
/// the schema, so they need no memory limit of their own.
bool get_fills(ByteReader& in, Schema& schema) {
  const std::uint64_t count = in.get_count(9);
  std::uint32_t last = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint32_t array = in.get_varint32();
    if (array >= schema.arrays.size() || array < last) return false;
    last = array;
    schema.arrays[array].fills.push_back(in.get_f64());
  }
  return count > 0 && in.ok();
}

}  // namespace

Result<void> get(ByteReader& in, Schema& schema, const ReadLimits& limits) {
  schema = {};
  const Error invalid = wrong("is invalid", ErrorCode::corrupt);
  std::uint64_t room = limits.max_unpacked_bytes;
  const auto takes = [&](std::uint64_t bytes) {
    if (bytes > room) return false;
    room -= bytes;
    return true;
  };
  const Error too_large = wrong("takes more than the limit of " + std::to_string(room) + " bytes",
                                ErrorCode::over_limit);
  schema.order = static_cast<Order>(in.get_u8());
  schema.corner_order = in.get_flag();
  schema.delay = in.get_varint32();
  schema.coordinate_type = static_cast<ScalarType>(in.get_u8());
  get(in, schema.coordinate_quantization);
  schema.source_format = in.get_text();
  const std::uint64_t blocks = in.get_count(4);
  if (blocks > limits.max_blocks) return too_many_blocks(limits);
  // The strings and lists of one block or array are read before they are checked against the limit,
  // since they need little more memory than their bytes in the file.
  if (!takes(kSchemaBytes + schema.source_format.size() + blocks * kBlockBytes)) return too_large;
  schema.blocks.reserve(static_cast<std::size_t>(blocks));
  for (std::uint64_t n = blocks; n > 0 && in.ok(); --n) {
    BlockInfo block;
    block.id = in.get_signed();
    block.name = in.get_text();
    const std::uint8_t shape = in.get_u8();
    block.shape = static_cast<CellShape>(shape & ((1u << kShapeBits) - 1));
    block.scheme = static_cast<NodeScheme>(shape >> kShapeBits);
    block.nodes_per_cell = in.get_varint32();
    if (!takes(bytes_of(block) - kBlockBytes)) return too_large;
    schema.blocks.push_back(std::move(block));
  }
  const std::uint64_t arrays = in.get_count(8);
  if (arrays > limits.max_arrays) return too_many_arrays(limits);
  if (!takes(arrays * kArrayBytes)) return too_large;
  schema.arrays.reserve(static_cast<std::size_t>(arrays));
  for (std::uint64_t n = arrays; n > 0 && in.ok(); --n) {
    ArrayInfo array;
    array.name = in.get_text();
    array.location = static_cast<Location>(in.get_u8());
    array.type = static_cast<ScalarType>(in.get_u8());
    array.components = in.get_varint32();
    array.per_step = in.get_flag();
    const std::uint64_t covered = in.get_count(1);
    if (covered > room / sizeof array.blocks[0]) return too_large;
    array.blocks.reserve(static_cast<std::size_t>(covered));
    for (std::uint64_t b = covered; b > 0 && in.ok(); --b)
      array.blocks.push_back(in.get_varint32());
    if (states_elements(array.location)) array.elements = in.get_varint();
    array.role = in.get_text();
    get(in, array.quantization);
    if (!takes(bytes_of(array) - kArrayBytes)) return too_large;
    schema.arrays.push_back(std::move(array));
  }
  if (in.ok() && in.left() > 0) {
    const std::uint8_t references = in.get_u8();
    const auto most = static_cast<std::uint8_t>(StepReference::base);
    const bool has_fills = in.left() > 0;
    if (references > most || (references == most && !has_fills)) return invalid;
    schema.step_references = static_cast<StepReference>(references);
    if (has_fills && !get_fills(in, schema)) return invalid;
  }
  return in.ok() && in.left() == 0 ? Result<void>() : Result<void>(invalid);
}

Result<void> check_schema(const Schema& schema, const ReadLimits& limits) {
  if (schema.blocks.size() > limits.max_blocks) return too_many_blocks(limits);
  if (schema.arrays.size() > limits.max_arrays) return too_many_arrays(limits);
  if (schema.order > Order::free) return wrong("unknown order");
  if (schema.order == Order::keep && !schema.corner_order)
    return wrong("order keep requires corner_order");
  if (schema.step_references > StepReference::base) return wrong("unknown step references");
  if (!is_float(schema.coordinate_type)) return wrong("coordinates must be float32 or float64");
  if (schema.coordinate_quantization.bits == Quantization::kRelative)
    return wrong("coordinates cannot have a relative error bound");
  if (auto status = check_quantization(schema.coordinate_quantization, schema.coordinate_type, 3,
                                       "coordinates");
      !status)
    return status;
  for (const BlockInfo& block : schema.blocks) {
    if (block.shape > CellShape::faces) return wrong("unknown cell shape");
    if (block.scheme > NodeScheme::bezier) return wrong("unknown node scheme");
    if (block.scheme != NodeScheme::lagrange && cell_order(block) == 0)
      return wrong("no cell has the shape, node scheme and number of nodes of a block");
    if (block.nodes_per_cell > kMaxNodesPerCell)
      return wrong("a cell has at most " + std::to_string(kMaxNodesPerCell) + " nodes");
  }
  std::uint64_t components = 0;
  for (const ArrayInfo& array : schema.arrays) {
    if (auto status = check_array(schema, array, limits); !status) return status;
    components += array.per_step ? 0 : array.components;
  }
  if (components > limits.max_static_components)
    return wrong("the static arrays have more components than the limit of " +
                     std::to_string(limits.max_static_components),
                 ErrorCode::over_limit);
  return {};
}

namespace {

template <class T>
ValueRange range_as(const std::byte* values, std::size_t count, std::size_t stride) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  ValueRange range{kInfinity, -kInfinity};
  for (std::size_t i = 0; i < count; ++i, values += stride) {
    T value;
    std::memcpy(&value, values, sizeof value);
    const auto v = static_cast<double>(value);
    if (!std::isfinite(v)) continue;
    range.minimum = std::min(range.minimum, v);
    range.maximum = std::max(range.maximum, v);
  }
  return range;
}

}  // namespace

ValueRange range_of(ScalarType type, const std::byte* values, std::size_t count,
                    std::size_t stride) {
  switch (type) {
    case ScalarType::int8: return range_as<std::int8_t>(values, count, stride);
    case ScalarType::uint8: return range_as<std::uint8_t>(values, count, stride);
    case ScalarType::int16: return range_as<std::int16_t>(values, count, stride);
    case ScalarType::uint16: return range_as<std::uint16_t>(values, count, stride);
    case ScalarType::int32: return range_as<std::int32_t>(values, count, stride);
    case ScalarType::uint32: return range_as<std::uint32_t>(values, count, stride);
    case ScalarType::int64: return range_as<std::int64_t>(values, count, stride);
    case ScalarType::uint64: return range_as<std::uint64_t>(values, count, stride);
    case ScalarType::float32: return range_as<float>(values, count, stride);
    case ScalarType::float64: return range_as<double>(values, count, stride);
  }
  return range_as<std::uint8_t>(values, 0, stride);
}

// --- extras
namespace {

// Maximum distance for coding by differences. With distance d, an integer is stored as the
// difference from the integer d positions before it. With distance 0, the integers are stored
// unchanged.
constexpr std::uint64_t kMostDistance = 65535;
constexpr std::size_t kMostSides = 255;

bool is_wide_integer(ScalarType type) {
  return type >= ScalarType::int16 && type <= ScalarType::uint64;
}

/// Writes the key and the type of an Extra record, and the kind of objects to which its values
/// refer.
void put_name(ByteWriter& out, const Extra& extra) {
  out.put_text(extra.key);
  out.put_u8(static_cast<std::uint8_t>(extra.type));
  out.put_u8(static_cast<std::uint8_t>(extra.refers));
}
bool get_name(ByteReader& in, Extra& extra) {
  extra.key = in.get_text();
  extra.type = static_cast<ScalarType>(in.get_u8());
  extra.refers = static_cast<Reference>(in.get_u8());
  return scalar_bytes(extra.type) != 0 && extra.refers <= Reference::cell &&
         (extra.refers == Reference::nothing || extra.type == ScalarType::int32 ||
          extra.type == ScalarType::int64);
}

void put_shape(ByteWriter& out, const Extra& extra) {
  out.put_varint(extra.shape.size());
  for (std::uint64_t side : extra.shape) out.put_varint(side);
}
/// Reads the dimensions of an extra, and stores their product, the number of values, in `values`.
/// Returns false if that number is too large for any file.
bool get_shape(ByteReader& in, Extra& extra, std::uint64_t& values) {
  values = 1;
  for (std::uint64_t n = in.get_count(1); n > 0 && in.ok(); --n) {
    extra.shape.push_back(in.get_varint());
    const std::uint64_t side = extra.shape.back();
    if (side != 0 && values > ~std::uint64_t{0} / 8 / side) return false;
    values *= side;
  }
  return in.ok();
}

/// Returns integer `i` of `data`, sign-extended from `width` bytes.
std::int64_t integer_at(const std::vector<std::byte>& data, std::size_t i, std::size_t width) {
  const auto as = [&]<class T>(T value) {
    std::memcpy(&value, data.data() + i * sizeof value, sizeof value);
    return static_cast<std::int64_t>(value);
  };
  return width == 2 ? as(std::int16_t{}) : width == 4 ? as(std::int32_t{}) : as(std::int64_t{});
}
void set_integer(std::vector<std::byte>& data, std::size_t i, std::size_t width,
                 std::int64_t number) {
  const auto as = [&]<class T>(T) {
    const auto value = static_cast<T>(number);
    std::memcpy(data.data() + i * sizeof value, &value, sizeof value);
  };
  if (width == 2)
    as(std::uint16_t{});
  else if (width == 4)
    as(std::uint32_t{});
  else
    as(std::uint64_t{});
}

std::int64_t difference(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}
std::int64_t sum(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}

std::vector<std::byte> as_they_are(const Extra& extra) {
  const std::size_t width = scalar_bytes(extra.type);
  std::vector<std::byte> little(extra.data.size());
  copy_little_endian(little.data(), extra.data.data(), extra.data.size() / width, width);
  return little;
}
std::vector<std::byte> as_differences(const Extra& extra, std::size_t distance) {
  const std::size_t width = scalar_bytes(extra.type), count = extra.data.size() / width;
  ByteWriter out;
  for (std::size_t i = 0; i < count; ++i)
    out.put_signed(difference(integer_at(extra.data, i, width),
                              i < distance ? 0 : integer_at(extra.data, i - distance, width)));
  return std::move(out.bytes);
}

struct WrittenValues {
  std::size_t distance = 0;
  std::vector<std::byte> bytes;
};

/// Encodes the values of an extra. Integers may be stored as differences from the previous integer
/// or from the integer one row earlier (distance 1 or the row length), or unchanged (distance 0).
/// The function chooses the distance whose result zstd compresses best.
WrittenValues written(const Extra& extra) {
  constexpr int kLevel = 3;
  constexpr std::uint64_t kMostColumns = 64;
  WrittenValues best{0, as_they_are(extra)};
  if (!is_wide_integer(extra.type) || extra.data.empty()) return best;
  const std::uint64_t columns = extra.shape.empty() ? 1 : extra.shape.back();
  std::size_t least = zstd_compress(best.bytes, kLevel).size();
  const auto take = [&](std::size_t distance) {
    std::vector<std::byte> bytes = as_differences(extra, distance);
    const std::size_t size = zstd_compress(bytes, kLevel).size();
    if (size >= least) return;
    least = size;
    best = {distance, std::move(bytes)};
  };
  take(1);
  if (columns > 1 && columns <= kMostColumns) take(static_cast<std::size_t>(columns));
  return best;
}

/// Reads the values of an extra into `extra.data`. Precondition: `extra.data` has its final size.
bool read_values(ByteReader& in, Extra& extra, std::uint64_t distance) {
  const std::size_t width = scalar_bytes(extra.type), count = extra.data.size() / width;
  if (distance == 0) {
    const auto bytes = in.get_bytes(extra.data.size());
    copy_little_endian(extra.data.data(), bytes.data(), bytes.size() / width, width);
    return in.ok();
  }
  for (std::size_t i = 0; i < count && in.ok(); ++i)
    set_integer(
        extra.data, i, width,
        sum(in.get_signed(),
            i < distance ? 0
                         : integer_at(extra.data, i - static_cast<std::size_t>(distance), width)));
  return in.ok();
}

/// Reads the extras of an unpacked chunk of version 1. The chunk contains the headers of all extras
/// first, and then the values of each extra.
Result<std::vector<Extra>> get_many(ByteReader& in, std::uint64_t limit) {
  const Error invalid = corrupt("is invalid");
  const Error too_large =
      over_limit("takes more than the limit of " + std::to_string(limit) + " bytes");
  const std::uint64_t count = in.get_count(5);
  if (!in.ok() || count > kMostExtras) return invalid;
  if (count > limit / kExtraBytes) return too_large;
  std::vector<Extra> extras(static_cast<std::size_t>(count));
  std::vector<std::uint64_t> values(extras.size()), distances(extras.size());
  for (std::size_t i = 0; i < extras.size(); ++i) {
    if (!get_name(in, extras[i])) return invalid;
    distances[i] = in.get_varint();
    if (!get_shape(in, extras[i], values[i])) return invalid;
    if (distances[i] > (is_wide_integer(extras[i].type) ? kMostDistance : 0) ||
        extras[i].shape.size() > kMostSides)
      return invalid;
    if (bytes_of(extras[i]) > limit) return too_large;
    limit -= bytes_of(extras[i]);
  }
  for (std::size_t i = 0; i < extras.size(); ++i) {
    const std::size_t width = scalar_bytes(extras[i].type);
    if (values[i] > in.left() / (distances[i] == 0 ? width : 1)) return invalid;
    if (values[i] > limit / width) return too_large;
    limit -= values[i] * width;
    extras[i].data.resize(static_cast<std::size_t>(values[i]) * width);
    if (!read_values(in, extras[i], distances[i])) return invalid;
  }
  if (in.left() != 0) return invalid;
  return extras;
}

}  // namespace

std::uint64_t bytes_of(const Extra& extra) {
  return kExtraBytes + extra.key.size() + extra.shape.size() * sizeof extra.shape[0] +
         extra.data.size();
}

void put(ByteWriter& out, const Extra& extra) {
  put_name(out, extra);
  put_shape(out, extra);
  out.put_bytes(as_they_are(extra));
}

bool get(ByteReader& in, Extra& extra) {
  std::uint64_t values = 0;
  if (!get_name(in, extra) || !get_shape(in, extra, values)) return false;
  const std::size_t width = scalar_bytes(extra.type);
  if (in.left() % width != 0 || in.left() / width != values) return false;
  extra.data.resize(in.left());
  return read_values(in, extra, 0);
}

std::vector<std::byte> extra_payload(const Extra& extra) {
  ByteWriter blob, payload;
  put(blob, extra);
  put_packed(payload, blob.bytes);
  return std::move(payload.bytes);
}

std::vector<std::byte> extras_payload(std::span<const Extra> extras, Packing packing) {
  ByteWriter blob, values, payload;
  blob.put_varint(extras.size());
  for (const Extra& extra : extras) {
    const WrittenValues encoded =
        packing == Packing::bounded ? WrittenValues{0, as_they_are(extra)} : written(extra);
    put_name(blob, extra);
    blob.put_varint(encoded.distance);
    put_shape(blob, extra);
    values.put_bytes(encoded.bytes);
  }
  blob.put_bytes(values.bytes);
  put_packed(payload, blob.bytes, packing);
  return std::move(payload.bytes);
}

Result<std::vector<Extra>> get_extras(std::span<const std::byte> payload, std::uint8_t version,
                                      std::uint64_t limit) {
  ByteReader in(payload);
  const std::uint64_t size = stated_packed_size(in);
  if (version > 0 && size > most_unpacked(payload.size()))
    return corrupt("unpacks to more bytes than its packed size permits");
  if (size > limit)
    return over_limit("unpacks to " + std::to_string(size) + " bytes, but the limit is " +
                      std::to_string(limit));
  const auto blob = get_packed(in, limit);
  if (!blob) return corrupt("cannot be unpacked");
  ByteReader fields(*blob);
  if (version > 0) return get_many(fields, limit);
  std::vector<Extra> one(1);
  if (!get(fields, one[0])) return corrupt("is invalid");
  return one;
}

namespace {

/// Finds the bounding box of finite coordinates in one pass over all points. Returns nullopt if a
/// coordinate is infinite, since a ValueRange describes only finite values.
template <class T>
std::optional<std::array<ValueRange, 3>> finite_box(const std::byte* points, std::size_t count,
                                                    std::size_t stride) {
  constexpr T kInfinity = std::numeric_limits<T>::infinity();
  std::array<T, 3> least, most;
  least.fill(kInfinity);
  most.fill(-kInfinity);
  for (std::size_t i = 0; i < count; ++i, points += stride) {
    std::array<T, 3> point;
    std::memcpy(point.data(), points, sizeof point);
    for (std::size_t c = 0; c < 3;
         ++c) {  // NaN changes nothing, since all comparisons with NaN are false.
      least[c] = point[c] < least[c] ? point[c] : least[c];
      most[c] = point[c] > most[c] ? point[c] : most[c];
    }
  }
  std::array<ValueRange, 3> box{};
  for (std::size_t c = 0; c < 3; ++c) {
    if (least[c] == -kInfinity || most[c] == kInfinity) return std::nullopt;
    box[c] = {static_cast<double>(least[c]), static_cast<double>(most[c])};
  }
  return box;
}

}  // namespace

std::array<ValueRange, 3> box_of(ScalarType type, const std::byte* points, std::size_t count,
                                 std::size_t stride) {
  if (const auto box = type == ScalarType::float32 ? finite_box<float>(points, count, stride)
                                                   : finite_box<double>(points, count, stride))
    return *box;
  std::array<ValueRange, 3> box{};
  for (std::size_t c = 0; c < 3; ++c)
    box[c] = range_of(type, points + c * scalar_bytes(type), count, stride);
  return box;
}

std::size_t point_data_bytes(const Schema& schema) {
  std::size_t bytes = 0;
  for (const ArrayInfo& info : schema.arrays)
    if (info.location == Location::point && !info.per_step)
      bytes += scalar_bytes(info.type) * info.components;
  return bytes;
}

std::vector<std::size_t> cell_data_bytes(const Schema& schema) {
  std::vector<std::size_t> bytes(schema.blocks.size());
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a) {
    const ArrayInfo& info = schema.arrays[a];
    if (info.per_step || info.location != Location::cell) continue;
    for (std::uint32_t b = 0; b < bytes.size(); ++b)
      if (schema.array_covers(a, b)) bytes[b] += scalar_bytes(info.type) * info.components;
  }
  return bytes;
}

std::vector<bool> DecodedParts::columns(const Schema& schema) const {
  std::vector<bool> included{geometry};
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a)
    if (!schema.arrays[a].per_step) included.push_back(includes_array(a));
  return included;
}

bool DecodedParts::includes_values_of(const Schema& schema, Location location) const {
  if (location == Location::point && geometry) return true;
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a)
    if (schema.arrays[a].location == location && !schema.arrays[a].per_step && includes_array(a))
      return true;
  return false;
}

ArrayInfo coordinates_info(const Schema& schema) {
  ArrayInfo info;
  info.type = schema.coordinate_type;
  info.components = 3;
  info.quantization = schema.coordinate_quantization;
  return info;
}

}  // namespace shm
