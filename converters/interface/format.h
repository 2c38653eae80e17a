// Format: the description of one mesh file format. Code outside of the format folders accesses
// formats only through this interface. Each format folder defines a Format in its format.cpp;
// formats/formats.cpp lists all formats.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/output_file.h"
#include "base/spool.h"
#include "interface/losses.h"
#include "mesh/appended_extras.h"
#include "mesh/chosen_steps.h"
#include "mesh/mesh_source.h"
#include "sets/transfer_sets.h"

namespace shm::converters {

// Names and roles of number maps. A number map is an array that contains, for each vertex or cell
// of a mesh, its number in another numbering, e.g. its global number in the whole mesh. The numbers
// in the map start at 1.
struct NumberMaps {
  // Names of the two arrays, e.g. "node_num_map" and "elem_num_map".
  std::string_view vertices, cells;
  std::string_view vertices_role, cells_role;
  // Role, in a part of a decomposed mesh, of the number maps that the whole mesh already had. The
  // part also has new number maps, with the two roles above, which contain global numbers (numbers
  // in the whole mesh).
  std::string_view original_role;
};

// The features that a format can represent. When a mesh of another format is written in this
// format, these features are kept. All other features are lost, and the tool reports them.
struct Capabilities {
  // Representation of node sets, side sets and groups of elements: as sets, as arrays (see
  // set_arrays.h), or as separate cells (see set_cells.h).
  enum class Sets { sets, arrays, cells };
  Sets sets = Sets::arrays;
  // True if a file may contain all time steps. If false, a file contains only one time step.
  bool every_step = false;
  // True if arrays may have several components. If false, each component becomes a separate array,
  // such as v_x, v_y, v_z.
  bool vectors = true;
  // True if the format allows only certain numbers of components. Arrays are then padded with zeros
  // to the next allowed number.
  bool padded_vectors = false;
  bool unique_names = false;  // true: array names must be unique; the second "v" becomes "v (2)"

  // True if arrays may have integer values. If false, all values are floating-point.
  bool integers = true;
  // True if cell arrays may cover only some blocks. If false, the values in the other blocks are
  // NaN (floats) or 0 (integers).
  bool partial_arrays = false;
  // True if files contain blocks that have numbers. If false, the block numbers are stored as an
  // array.
  bool block_numbers = false;
  bool blocks_by_type = false;  // true: the number of a block is the number of its cell type
  bool positive_numbers = false, unique_numbers = false;
  // Arrays beside those on points and cells that the format can represent: none, those of the whole
  // mesh, or those of the whole mesh and of sets.
  enum class BesideMesh { none, global, global_and_sets };
  BesideMesh beside_mesh = BesideMesh::none;
  bool has_arrays_at(Location location) const {
    return is_on_mesh(location) || beside_mesh == BesideMesh::global_and_sets ||
           (beside_mesh == BesideMesh::global && location == Location::global);
  }
  // Largest block number and largest set number that the format allows. If most_numbers is null,
  // these numbers are not limited.
  struct MostNumbers {
    std::int64_t block, set;
  };
  MostNumbers (*most_numbers)(const MeshInfo& info) = nullptr;
  bool times = true;  // true: the times of time steps are stored even if no array has time steps
  std::size_t title_bytes = ~std::size_t{0};  // maximum length of the title in bytes
  // The number maps of this format; null if it has none.
  const NumberMaps* maps = nullptr;

  // Returns true if the format can represent the cells of the block. A null pointer means that the
  // format can represent all cells.
  bool (*block)(const BlockInfo& block) = nullptr;
  // Returns true if the format can store the name unchanged. A null pointer means that it can store
  // every name unchanged.
  bool (*name)(const std::string& name) = nullptr;
  // Name of the sibling: another format whose extras the writer of this format understands, so that
  // it can write meshes of that format directly. Empty if the format has no sibling. For example,
  // VTK legacy and VTU are siblings. losses_of_sibling() describes the data that is lost when a
  // mesh of the sibling is written in this format.
  std::string_view sibling = {};
  LossList (*losses_of_sibling)(const MeshInfo& info) = nullptr;
};

// Properties of all arrays with a certain role. Each format defines its own roles.
struct Role {
  std::string_view name;       // role of the arrays: "format:..."
  bool is_numbered = false;    // a number follows the name: "format:name3"
  bool is_number_map = false;  // true: the values are numbers of vertices or cells

  // True if the array has one value for each corner, edge or face of a cell, in the order of the
  // cell's corners, edges or faces.
  bool is_by_place = false;
  bool is_private = false;  // true: the array has no meaning in other formats

  // Returns text that describes the loss of a private array (see is_private) with the name `array`.
  // A null pointer means that leaving the array out is not a loss.
  std::string (*loss)(const std::string& array) = nullptr;
};

// A named group of vertices, sides or cells of a mesh, in the form in which reports display it.
struct NamedGroup {
  std::string kind;  // "node set", "side set", "physical volume", ...
  std::string id;
  std::string name;
  std::optional<std::uint64_t> members;
};

// Interprets the extras of meshes that came from files of one format. A format without extras uses
// the default implementation of each function.
class SourceFormat {
 public:
  SourceFormat(const SourceFormat&) = delete;
  SourceFormat& operator=(const SourceFormat&) = delete;

  // sets(), time(), title() and block_names() return data that is stored in the extras of a mesh.
  // They add the keys of the extras that they read to `used`. sets() returns only sets that are
  // stored in a form of this format, not those stored as described in shm/sets.h.
  virtual std::vector<MeshSet> sets(const MeshInfo&, Keys& /*used*/) const { return {}; }

  // Returns groups other than node sets, side sets and element sets.
  virtual std::vector<NamedGroup> named_groups(const MeshInfo&) const { return {}; }
  virtual std::optional<double> time(const MeshInfo&, Keys& /*used*/) const { return {}; }
  virtual std::string title(const MeshInfo&, Keys& /*used*/) const { return {}; }
  virtual std::map<std::int64_t, std::string> block_names(const MeshInfo&, Keys& /*used*/) const {
    return {};
  }

  // Returns true if the extras of a mesh with time steps describe where the values of each step are
  // stored. Returns false if each step was read from a file of its own, and the extras come from
  // one of these files.
  virtual bool describes_steps(const MeshInfo&) const { return true; }
  // Returns the extras for a mesh that is reduced to some of its steps. Returns nothing if these
  // extras cannot be determined.
  virtual std::optional<std::vector<Extra>> extras_of_steps(const MeshInfo& info,
                                                            StepRange /*steps*/) const {
    return info.extras;
  }

  // The next two functions are for meshes of a series of files, each of which contains one step.
  // extras_of_series() returns the extras without data about the step (its time, ranges of values),
  // so that the result is valid for all files of the series. is_about_file() returns true if an
  // extra describes one file and may differ in the other files.
  virtual std::vector<Extra> extras_of_series(const MeshInfo& info) const { return info.extras; }
  virtual bool is_about_file(std::string_view /*key*/) const { return false; }

  // Returns the index of the array that contains the points at a time step. Returns nothing if the
  // mesh has the same points at every step.
  virtual std::optional<std::size_t> points_of_step(const MeshInfo&, std::uint64_t /*step*/) const {
    return {};
  }

  // Returns the indices of the blocks whose cells have nodes of another meaning or in another order
  // than the mesh model defines for their shape and number of nodes. Other formats cannot name the
  // type of these cells.
  virtual std::vector<std::size_t> blocks_with_own_nodes(MeshSource&) const { return {}; }

  // Returns true if the mesh is two-dimensional, so that the sides of its triangles and quads are
  // edges.
  virtual bool is_flat(const MeshInfo&) const { return false; }
  // Returns true if the meaning of blocks, or of extras other than side sets, depends on the order
  // of the corners in a cell.
  virtual bool needs_corner_order(const MeshInfo&) const { return false; }

  // has_strings() returns true if the values of an array are indices into a list of strings;
  // strings() returns this list of strings.
  virtual bool has_strings(const ArrayInfo&) const { return false; }
  virtual std::vector<std::string> strings(const MeshInfo&, std::size_t /*array*/) const {
    return {};
  }
  // Returns true if an extra is a list of strings that strings() returns.
  virtual bool is_list_of_strings(std::string_view /*key*/) const { return false; }

  // Returns descriptions of the extras that no other format can represent. Omits extras whose key
  // is in `used`.
  virtual LossList losses(const MeshInfo& info, const Keys& used) const {
    return losses_by_key(info, used);
  }
  // Returns true if an extra can be derived from the blocks of the mesh.
  virtual bool follows_from_blocks(const Extra&) const { return false; }

  // The next three functions determine the extras of a mesh to which the time steps of another file
  // are appended.
  //
  // The time steps of the mesh `more` are appended to the mesh `old`. counts_steps() returns true
  // if the extras contain the number of steps. joined_extras() is called if both files have the
  // same format, and returns the extras of the result. If joined_extras() returns nothing, the
  // caller keeps the extras of `old` and requires that `old` also contains each extra of `more`.
  // `extras` contains the extras of `more` with the vertex and cell numbers of `old`, and `steps`
  // lists the steps of `more` to append. lengthened_extras() is called if the formats differ, and
  // returns the extras of the result; its argument `steps` is the number of steps that are
  // appended. joined_extras() and lengthened_extras() throw Failure (unsupported) if the steps
  // cannot be appended.
  virtual bool counts_steps(const MeshInfo&) const { return false; }
  virtual std::optional<AppendedExtras> joined_extras(
      const MeshInfo& /*old*/, const MeshInfo& /*more*/, const std::vector<Extra>& /*extras*/,
      std::span<const std::uint64_t> /*steps*/) const {
    return {};
  }
  virtual AppendedExtras lengthened_extras(const MeshInfo& /*old*/, std::uint64_t /*steps*/) const {
    return {};
  }

  // Adds information about the whole mesh to the extras of a piece (a mesh that consists of some
  // cells of the whole mesh), if the writer of this format needs it to write a piece.
  virtual void mark_piece(const MeshInfo& /*whole*/, MeshInfo& /*piece*/) const {}

 protected:
  constexpr SourceFormat() = default;
  ~SourceFormat() = default;
};

struct Format {
  std::string_view name;   // the format's name in the option --format and in Schema::source_format
  std::string_view title;  // human-readable name in messages

  // File name extensions of the format, with the dot; unused entries are empty.
  std::array<std::string_view, 6> extensions;
  // Returns true if a file that begins with `head` (at most 4096 bytes) has this format.
  bool (*looks_like)(std::span<const std::byte> head) = nullptr;
  // Opens a file. The pointers open and write are null for .shm files, which open_mesh() and
  // write_mesh() decode and encode themselves.
  std::unique_ptr<MeshSource> (*open)(const std::string& path, Spool& spool) = nullptr;
  void (*write)(MeshSource& mesh, const std::string& path, Spool& spool) = nullptr;
  // True if the format stores meshes of all formats unchanged, with their extras, as .shm files do.
  // `capabilities` then describes the features that remain when a mesh is written without the
  // extras of its source format.
  bool holds_everything = false;
  Capabilities capabilities = {};
  std::span<const Role> roles = {};
  const SourceFormat* source = nullptr;  // null: the default implementations of SourceFormat apply

  // Converts the extras in .shm files from older versions to the form that the format's reader
  // creates now. A null pointer means that this form has not changed.
  void (*translate_old_extras)(MeshInfo& info) = nullptr;
  FileSink::Temporary temporary = FileSink::Temporary::unnamed;  // how temporary files are created

  // Loads the libraries that the format needs. open() and write() also load them, but a program
  // that forks must call this function before it forks. A null pointer means that the program is
  // linked to all libraries that the format needs. Throws Failure.
  void (*load)() = nullptr;
};

}  // namespace shm::converters
