// Schema: the description of a mesh that is stored before its first vertex. It consists of scalar
// types, cell shapes, element blocks, data arrays and the order. This header also declares extras.
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

/// Type of one number. The values of the enumerators are the bytes that files contain (spec "Scalar
/// types").
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

/// Returns the size of one scalar in bytes: 1, 2, 4 or 8. Returns 0 for a value outside the
/// enumeration.
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
/// Returns the scalar type that corresponds to T, an integer or floating-point type of 1, 2, 4 or 8
/// bytes.
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
/// Returns the name of a type: "int8", ..., "float64".
SHM_API std::string_view scalar_name(ScalarType type);

/// Geometric kind of a cell. `nodes_per_cell` determines the order of the element: a hexahedron
/// with 20 nodes is the serendipity element, a hexahedron with 27 nodes the full quadratic element.
/// Nodes are in VTK's order for the shape, corners first. Corners 0..3 of a hexahedron are the
/// bottom, 4..7 the top, with corner 4 above corner 0. If a format orders the nodes differently,
/// its converter permutes them. The values of the enumerators are the bytes that files contain
/// (spec "Cell shapes").
enum class CellShape : std::uint8_t {
  other = 0,  ///< a list of vertices; the library does not know the shape that they form
  vertex = 1,
  line = 2,
  triangle = 3,
  quad = 4,
  polygon = 5,
  tetrahedron = 6,
  pyramid = 7,
  wedge = 8,
  hexahedron = 9,
  polyhedron = 10,  ///< a list of the vertices of the faces of a polyhedron, face after face; the
                    ///< face sizes are stored separately
  faces = 11,  ///< a polyhedron, stored face by face; each face ends with its first vertex again
};
SHM_API std::string_view shape_name(CellShape shape);

/// Meaning of the nodes of a cell that are not corners. The values of the enumerators are part of
/// the bytes that files contain (spec "Cell shapes").
enum class NodeScheme : std::uint8_t {
  lagrange = 0,     ///< nodes on the cell. This includes all cells of orders 1 and 2, except Bezier
                    ///< cells of order 2.
  serendipity = 1,  ///< nodes on the cell, of order 3 or higher, at corners and on edges only
  bezier = 2,       ///< control points of order 2 or higher; the corners are on the cell, the
                    ///< others are not. Rational weights, if any, are a point array.
};
SHM_API std::string_view scheme_name(NodeScheme scheme);

/// A set of cells that share a shape (Exodus element block, Gmsh entity, VTK cell type).
struct BlockInfo {
  std::int64_t id = 0;  ///< id of the block in the source; the id need not be unique or positive
  std::string name;
  CellShape shape = CellShape::hexahedron;
  /// Number of nodes of each cell, or 0 if the cells have different numbers of nodes.
  std::uint32_t nodes_per_cell = 8;
  NodeScheme scheme = NodeScheme::lagrange;
  bool operator==(const BlockInfo&) const = default;
};

/// Largest number of nodes of a cell.
inline constexpr std::uint32_t kMaxNodesPerCell = 1 << 16;

/// The elements for which an array has values. The values of the enumerators are the bytes that
/// files contain (spec "Schema").
enum class Location : std::uint8_t {
  point = 0,        ///< vertices
  cell = 1,         ///< cells
  global = 2,       ///< the mesh as a whole, e.g. its kinetic energy
  node_set = 3,     ///< members of node sets (sets.h)
  side_set = 4,     ///< members of side sets
  element_set = 5,  ///< members of element sets
};
/// Returns true if arrays at this location have values for vertices or cells. Other arrays are
/// stepped, and state their number of elements.
constexpr bool is_on_mesh(Location location) { return location <= Location::cell; }
/// Returns "point", "cell", "global", "node_set", "side_set" or "element_set".
SHM_API std::string_view location_name(Location location);

/// Quantization of floating-point values. There are three kinds.
/// - N bits: a value v of component c is stored as the integer k nearest to (v - minimum[c]) /
///   step(). It is restored as minimum[c] + k * step(), rounded to the stored type. The step is
///   (largest side of the box from `minimum` to `maximum`) / (2^N - 1).
/// - An absolute error bound: as above, but the step is given explicitly, see `absolute()`.
/// - A relative error bound: the error of a value is at most its magnitude times `max_rel`, see
///   `relative()`.
/// A value is stored exactly if it is not finite, or if its restored value would differ from it by
/// more than the bound. -0.0 may be restored as 0.0. With an absolute or a relative bound, zeros
/// remain zeros.
struct Quantization {
  static constexpr std::uint32_t kAbsolute = 64;  ///< value of `bits` for an absolute bound
  static constexpr std::uint32_t kRelative = 65;  ///< value of `bits` for a relative bound

  /// Number of bits N (1..52) if values are quantized to N bits; kAbsolute or kRelative if an error
  /// bound defines the step; 0 for lossless storage.
  std::uint32_t bits = 0;
  /// For N bits: the lower corner of the box of values. For an absolute error bound: the value that
  /// k = 0 represents. One finite number per component. Empty for a relative error bound.
  std::vector<double> minimum;
  /// For N bits: the upper corner of the box of values, with one finite number per component, each
  /// not less than that of `minimum`. Empty for an error bound.
  std::vector<double> maximum;
  double max_abs = 0;  ///< maximum error for an absolute bound; otherwise 0
  /// Quantization step for an absolute bound. For a relative bound: the distance between restored
  /// values, counted in numbers of the stored type; a whole number. Otherwise 0.
  double spacing = 0;
  double max_rel = 0;  ///< maximum error relative to the value for a relative bound; otherwise 0
  bool operator==(const Quantization&) const = default;

  /// Returns a quantization that guarantees |restored - v| <= max_abs for every finite value.
  /// Precondition: 0 < max_abs < 1e300. Restored values are multiples of a step slightly smaller
  /// than 2 * max_abs. If rounding to the stored type would make the error of a value exceed
  /// max_abs, the value is stored exactly. Few values need this, because the step is smaller than 2
  /// * max_abs. A caller who knows the values may change `spacing`, because the bound holds for any
  /// step.
  SHM_API static Quantization absolute(double max_abs, std::uint32_t components);
  /// Returns a quantization that guarantees |restored - v| <= max_rel * |v| for every finite value,
  /// and therefore keeps zeros and signs. Restored values are evenly spaced among the numbers of
  /// the stored type: every n-th number is one. Precondition: 0 < max_rel <= 0.5, and `type` is
  /// float32 or float64. Returns lossless storage if the bound is smaller than 2^-24 (float32) or
  /// 2^-43 (float64), because rounding would hardly save space.
  SHM_API static Quantization relative(double max_rel, ScalarType type);
  bool lossy() const { return bits != 0; }
  /// Returns the quantization step, or `spacing` for a relative bound.
  SHM_API double step() const;
  /// Returns the guaranteed bound on |restored - v| for a value stored as `type`. For an absolute
  /// bound this is max_abs for every type. For N bits, it is half a step plus the rounding error of
  /// the stored type at the largest magnitude in the box. For a relative bound it is infinite,
  /// because it depends on the value: max_rel * |v|.
  SHM_API double max_error(ScalarType type) const;
};

/// Largest number of fill values of an array.
inline constexpr std::size_t kMaxFills = 16;

/// One data array.
struct ArrayInfo {
  std::string name;
  Location location = Location::point;
  ScalarType type = ScalarType::float64;
  std::uint32_t components = 1;  ///< 1..65535
  /// True if the array has one set of values per time step, false if it is static.
  bool per_step = false;
  /// Cell arrays: indices of the blocks whose cells have values, ascending. If empty, all blocks
  /// have values. Arrays on sets: numbers of the sets whose members have values, ascending; number
  /// I is that of the set's keys, e.g. "mesh/node_set/I/members". If empty, all sets of the kind
  /// have values. Otherwise empty.
  std::vector<std::uint32_t> blocks;
  /// Role of the array in its source format, e.g. "exodus:node_num_map"; empty for field data. When
  /// a file is converted to another format, arrays with a role may be omitted.
  std::string role;
  Quantization quantization;
  /// Fill values: numbers that mark missing data, such as 9.97e36 (floating-point arrays only; each
  /// is a finite number of type `type`; at most kMaxFills). They are restored exactly, even if the
  /// array is quantized, and cost few bits.
  std::vector<double> fills;
  /// Number of elements of an array that is neither on points nor on cells; otherwise 0. An array
  /// on sets has one element for each member of its sets, set after set.
  std::uint64_t elements = 0;
  bool operator==(const ArrayInfo&) const = default;
};

/// Order in which a Reader returns vertices and cells (spec "Order").
enum class Order : std::uint8_t {
  keep = 0,    ///< vertex numbers, cell order and corner order are exactly as in the source
  stream = 1,  ///< cells are in input order, except that a delay buffer may reorder them; vertices
               ///< are numbered by first use
  free = 2,  ///< cells may have been reordered before they were passed to the Writer; vertices are
             ///< numbered by first use
};
/// Returns "keep", "stream" or "free".
SHM_API std::string_view order_name(Order order);

/// Codec of the cells of a segment. A Reader accepts all codecs.
enum class ConnectivityCodec : std::uint8_t {
  automatic = 0,  ///< the Writer's level chooses the codec
  paper = 1,   ///< the method of the paper on which the format is based; for comparison only (spec
               ///< "Connectivity stream")
  rows = 2,    ///< hexahedra are predicted from the neighbouring row (spec "Row hexahedra")
  replay = 3,  ///< hexahedra are coded as repeats of earlier ones (spec "Replay hexahedra")
  /// As `rows`, but each coded decision mixes several predictions. Files are smaller, and coding is
  /// slower (spec "Mixed rows").
  mixed = 4,
  /// A cell is coded as the previous cell plus constant offsets (spec "Shifts"). This codec is many
  /// times faster than the others if vertices are numbered in rows and layers. Values are also
  /// coded as differences from earlier values, which makes files larger. The codec requires cells
  /// of 1 to 64 nodes, no delay buffer, and at most 32 components in each stepped array. It
  /// supports any Order.
  shifts = 5,
  /// A cell is coded by the positions of its vertices in earlier cells, which is fast for all kinds
  /// of meshes (spec "Patterns"). The codec requires cells of 1 to 64 nodes and no delay buffer. It
  /// supports any Order.
  patterns = 6,
};
/// Returns "automatic", "paper", "rows", "replay", "mixed", "shifts" or "patterns".
SHM_API std::string_view codec_name(ConnectivityCodec codec);

/// Amount of work that a Writer spends on making files small. A Reader reads the files of all
/// levels, since every bitstream states its codec.
enum class Level : std::uint8_t {
  fast = 0,      ///< the shifts codec if it suits the mesh; otherwise the patterns codec; rows if
                 ///< neither supports the mesh, or if the mesh has few cells
  standard = 1,  ///< of shifts, replay and rows, the codec with the smallest result; shifts if its
                 ///< result is nearly as small
  best = 2,  ///< as `standard`, but with the codec mixed instead of rows. Several predictions of
             ///< each value are mixed, too, which is slower
};

/// The earlier steps that the values of a stepped array at one step refer to.
enum class StepReference : std::uint8_t {
  nothing = 0,
  before = 1,  ///< the previous step
  trend = 2,   ///< extrapolation of the two previous steps
  base = 3,    ///< the most recent step that refers to no other step
};

/// How the values of a step of an array are coded: the earlier steps that they refer to, and their
/// codec. If several PartWriters write an array, the one with its first element chooses this, and
/// the others receive it. Its bits have no meaning for callers.
enum class StepBasis : std::uint64_t {};

/// Description of a mesh, stored before its first vertex.
struct Schema {
  Order order = Order::keep;
  /// If false, a cell may be restored with rotated corners. Order::keep requires true.
  bool corner_order = true;
  /// Capacity of the delay buffer in cells; 0 without a delay buffer.
  std::uint32_t delay = 0;
  ScalarType coordinate_type = ScalarType::float64;  ///< float32 or float64
  Quantization coordinate_quantization;
  std::vector<BlockInfo> blocks;
  std::vector<ArrayInfo> arrays;
  std::string source_format;  ///< format from which the mesh was converted: "exodus", "vtk",
                              ///< "gmsh", ...; may be empty
  /// The highest StepReference that step values may use. For each stepped array, Writer and Reader
  /// keep in memory as many earlier steps as the number of this reference. A Writer lowers this
  /// value if WriteOptions::key_steps rules out such references.
  StepReference step_references = StepReference::base;
  /// True if the file may use the features of format 0.10, such as values that are coded by
  /// reference to earlier values. False in files of versions 0.9 and 0.1. Readers set this member.
  /// A Writer ignores it: in a new file it is always true.
  bool earlier_values = true;
  bool operator==(const Schema&) const = default;

  bool array_covers(std::size_t array, std::uint32_t block) const {
    const auto& covered = arrays[array].blocks;
    return covered.empty() || std::binary_search(covered.begin(), covered.end(), block);
  }
};

/// Returns the name under which reports list the size of an array: "array:LOCATION/NAME", e.g.
/// "array:point/NAME" (see location_name()). If the name occurs again at the same location, "#2",
/// "#3", ... is appended.
SHM_API std::string array_stream_name(const Schema& schema, std::size_t array);
/// Returns the array_stream_name() of each array. This is faster than calling array_stream_name()
/// for each array, since each of these calls scans all earlier arrays.
SHM_API std::vector<std::string> array_stream_names(const Schema& schema);

/// The kind of objects that the numbers in an Extra refer to. If the mesh is renumbered, numbers
/// that refer to vertices or cells are changed too.
enum class Reference : std::uint8_t {
  nothing = 0,
  vertex = 1,  ///< vertex numbers, from 0
  cell = 2,    ///< cell numbers, from 0
};

/// A typed key/value pair for data that the mesh model does not cover, such as sets, names and maps
/// of the source. Text is stored as uint8. Values that refer to vertices or cells must be int32 or
/// int64. Negative numbers are never renumbered.
struct Extra {
  /// Slash-separated path. It begins with the source format, e.g. "exodus/skeleton", or with "mesh"
  /// for data of no particular format (sets.h).
  std::string key;
  ScalarType type = ScalarType::uint8;
  Reference refers = Reference::nothing;
  /// Sizes of the dimensions, row-major; their product is the number of values.
  std::vector<std::uint64_t> shape;
  std::vector<std::byte> data;  ///< values in host byte order
  bool operator==(const Extra&) const = default;
};

}  // namespace shm
