// Schema: what a mesh file is made of, stored before its first vertex.
// Scalars, cell shapes, element blocks, data arrays, order promise, extras.
// spec: "Schema", "Extras"
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "shm/result.h"

namespace shm {

/// Type of one number. The values are the bytes of the format (spec "Scalar types").
enum class ScalarType : std::uint8_t {
  int8 = 1,
  uint8 = 2,
  int16 = 3,
  uint16 = 4,
  int32 = 5,
  uint32 = 6,
  int64 = 7,
  uint64 = 8,
  float32 = 9,
  float64 = 10,
};

/// Bytes of one scalar: 1, 2, 4 or 8; 0 for a value outside the enumeration.
constexpr std::size_t scalar_bytes(ScalarType type) {
  switch (type) {
    case ScalarType::int8:
    case ScalarType::uint8: return 1;
    case ScalarType::int16:
    case ScalarType::uint16: return 2;
    case ScalarType::int32:
    case ScalarType::uint32:
    case ScalarType::float32: return 4;
    case ScalarType::int64:
    case ScalarType::uint64:
    case ScalarType::float64: return 8;
  }
  return 0;
}
/// The scalar type of T: an integer or a floating-point number of 1, 2, 4 or 8 bytes.
template <class T>
constexpr ScalarType scalar_type_of() {
  static_assert(std::is_arithmetic_v<T> && !std::is_same_v<T, bool> && sizeof(T) <= 8);
  if constexpr (std::is_floating_point_v<T>)
    return sizeof(T) == 4 ? ScalarType::float32 : ScalarType::float64;
  constexpr int kUnsigned = std::is_unsigned_v<T> ? 1 : 0;
  constexpr int kLog = sizeof(T) == 1 ? 0 : sizeof(T) == 2 ? 1 : sizeof(T) == 4 ? 2 : 3;
  return static_cast<ScalarType>(1 + 2 * kLog + kUnsigned);
}
constexpr bool is_float(ScalarType type) {
  return type == ScalarType::float32 || type == ScalarType::float64;
}
constexpr bool is_signed_integer(ScalarType type) {
  return type == ScalarType::int8 || type == ScalarType::int16 || type == ScalarType::int32 ||
         type == ScalarType::int64;
}
/// "int8" .. "float64".
SHM_API std::string_view scalar_name(ScalarType type);

/// Geometric kind of a cell. Together with `nodes_per_cell` it says the order of the
/// element: a hexahedron with 20 nodes is the serendipity one, with 27 the full quadratic one.
/// Nodes stand in VTK's order for that cell (corners first; hexahedron corners 0..3 bottom,
/// 4..7 top, 4 above 0); converters permute where their format differs.
/// The values are the bytes of the format (spec "Cell shapes").
enum class CellShape : std::uint8_t {
  other = 0,  ///< the library knows no geometry for it: a list of vertices
  vertex = 1,
  line = 2,
  triangle = 3,
  quad = 4,
  polygon = 5,
  tetrahedron = 6,
  pyramid = 7,
  wedge = 8,
  hexahedron = 9,
  polyhedron = 10,  ///< all vertices of all faces in turn; face sizes travel beside
  faces = 11,       ///< a polyhedron, face by face, each face closed by its first vertex again
};
SHM_API std::string_view shape_name(CellShape shape);

/// A set of cells that share a shape (Exodus element block, Gmsh entity, VTK cell type).
struct BlockInfo {
  std::int64_t id = 0;  ///< the source's own number; need not be unique or positive
  std::string name;
  CellShape shape = CellShape::hexahedron;
  std::uint32_t nodes_per_cell = 8;  ///< 0: varies from cell to cell
  bool operator==(const BlockInfo&) const = default;
};

/// Most nodes of one cell.
inline constexpr std::uint32_t kMaxNodesPerCell = 1 << 16;

enum class Location : std::uint8_t { point = 0, cell = 1 };

/// Uniform quantization of floating-point values. Value v of component c is kept as the integer k
/// nearest to (v - minimum[c]) / step() and comes back as minimum[c] + k * step(), rounded to the
/// stored type. Non-finite values, and finite ones whose restored value would miss `max_error()`,
/// are kept exactly; -0.0 may come back as 0.0.
/// Two kinds say the step: N bits of a box, step = (largest side of the box) / (2^N - 1); or an
/// absolute bound, the step beside it. Make the second with `absolute()`.
struct Quantization {
  static constexpr std::uint32_t kAbsolute = 64;  ///< `bits` of an absolute bound

  std::uint32_t bits = 0;       ///< 0 (lossless), 1..52 (of the box) or kAbsolute
  std::vector<double> minimum;  ///< per component, finite; absolute: where 0 steps are
  std::vector<double> maximum;  ///< per component, finite, >= minimum; absolute: empty
  double max_abs = 0;           ///< absolute: the bound; else 0
  double spacing = 0;           ///< absolute: the step; else 0
  bool operator==(const Quantization&) const = default;

  /// |restored - v| <= max_abs for every finite value, 0 < max_abs < 1e300. Steps are counted from
  /// 0 and a shade smaller than 2 * max_abs, so that few values break the bound when they are
  /// rounded to the stored type, and have to be kept exactly. Who knows the values may change
  /// `spacing`: any step keeps the bound.
  SHM_API static Quantization absolute(double max_abs, std::uint32_t components);
  bool lossy() const { return bits != 0; }
  SHM_API double step() const;
  /// Promise about |restored - v| for a value stored as `type`. Absolute: max_abs, whatever the
  /// type. Of a box: half a step plus the rounding to the stored type at the box's largest
  /// magnitude.
  SHM_API double max_error(ScalarType type) const;
};

/// One data array on vertices or cells.
struct ArrayInfo {
  std::string name;
  Location location = Location::point;
  ScalarType type = ScalarType::float64;
  std::uint32_t components = 1;  ///< 1..65535
  bool per_step = false;         ///< one value set for each time step; else static
  /// Cell arrays: indices of the blocks that carry it, ascending; empty: every block.
  std::vector<std::uint32_t> blocks;
  /// Empty for field data. Otherwise what the source calls this array, e.g.
  /// "exodus:node_num_map"; another format's writer may leave such an array out.
  std::string role;
  Quantization quantization;
  bool operator==(const ArrayInfo&) const = default;
};

/// What comes back (spec "Order").
enum class Order : std::uint8_t {
  keep = 0,    ///< vertex numbers, cell order and corner order exactly as they were
  stream = 1,  ///< cells in input order up to the delay buffer, vertices numbered by first use
  free = 2,    ///< the same mesh: as stream, but cells were put in any order before they came
};
/// "keep", "stream", "free".
SHM_API std::string_view order_name(Order order);

/// How hexahedra are encoded. A Reader takes any.
enum class ConnectivityCodec : std::uint8_t {
  automatic = 0,  ///< what the Writer's level tries
  paper = 1,      ///< the published scheme, as a baseline (spec "Connectivity stream")
  rows = 2,       ///< predicted from the neighbouring row (spec "Row hexahedra")
  replay = 3,     ///< repeated from cells before, numbers and all (spec "Replay hexahedra")
  mixed = 4,      ///< as rows, smaller and slower (spec "Mixed rows")
  /// The cell before, moved: many times faster where numbers run in rows and layers, and so are the
  /// values, which take more room (spec "Shifts"). Any order without delay, cells of 1 to 64
  /// nodes, no stepped array of more than 32 components.
  shifts = 5,
  /// Where in the cells before its vertices stand: for speed on meshes of any kind (spec
  /// "Patterns"). Any order without delay, cells of 1 to 64 nodes.
  patterns = 6,
};
/// "automatic", "paper", "rows", "replay", "mixed", "shifts", "patterns".
SHM_API std::string_view codec_name(ConnectivityCodec codec);

/// How much work a Writer puts into small files. No level needs a Reader of its own: every
/// bitstream names its codec.
enum class Level : std::uint8_t {
  fast = 0,      ///< shifts where they do; else patterns, or rows where there can be none
  standard = 1,  ///< replay or rows: what is smallest, or nearly so and faster
  best = 2,      ///< the smallest of these and mixed, at half the speed of rows or less
};

/// What the values of a stepped array at one step may refer to.
enum class StepReference : std::uint8_t {
  nothing = 0,
  before = 1,  ///< the step before
  trend = 2,   ///< what the two steps before lead to
};

/// Everything a file says about itself before its first vertex.
struct Schema {
  Order order = Order::keep;
  bool corner_order = true;  ///< false: corners may come back rotated (not in Order::keep)
  std::uint32_t delay = 0;   ///< cells in the delay buffer, 0 = off
  ScalarType coordinate_type = ScalarType::float64;  ///< float32 or float64
  Quantization coordinate_quantization;
  std::vector<BlockInfo> blocks;
  std::vector<ArrayInfo> arrays;
  std::string source_format;  ///< "exodus", "vtk", "gmsh", or whatever made the mesh; may be empty
  /// The most that step values refer to; both sides hold so many steps of all stepped arrays. A
  /// Writer says less where WriteOptions::key_steps lets nothing refer to so much.
  StepReference step_references = StepReference::trend;
  /// Whether values may be coded by earlier ones, and what else came with them: not in files of
  /// versions 0.9 and 0.1. Readers set it; a Writer sets it for each new file, whatever it is here.
  bool earlier_values = true;
  bool operator==(const Schema&) const = default;

  bool array_covers(std::size_t array, std::uint32_t block) const {
    const auto& covered = arrays[array].blocks;
    return covered.empty() || std::binary_search(covered.begin(), covered.end(), block);
  }
};

/// Under which name reports count the bytes of an array: "array:point/NAME" or "array:cell/NAME",
/// with "#2", "#3", ... where a name stands again at the same location.
SHM_API std::string array_stream_name(const Schema& schema, std::size_t array);
/// Those of all arrays. One alone takes a look at all arrays before it.
SHM_API std::vector<std::string> array_stream_names(const Schema& schema);

/// What the numbers of an Extra mean; they follow a renumbering of the mesh.
enum class Reference : std::uint8_t {
  nothing = 0,
  vertex = 1,  ///< vertex numbers, from 0
  cell = 2,    ///< cell numbers, from 0
};

/// A typed key/value pair for what the model has no word for: sets, names, maps of the source.
/// Text is carried as uint8. References must be int32 or int64; negative ones are left alone.
struct Extra {
  /// Slash-separated path, first part is the format: "exodus/skeleton"; "mesh" for what belongs to
  /// none (sets.h).
  std::string key;
  ScalarType type = ScalarType::uint8;
  Reference refers = Reference::nothing;
  std::vector<std::uint64_t> shape;  ///< row-major; the product is the number of values
  std::vector<std::byte> data;       ///< values in host byte order
  bool operator==(const Extra&) const = default;
};

}  // namespace shm
