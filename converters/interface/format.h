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

// Names and roles of the arrays that map the vertices and cells of a mesh to their numbers in
// another mesh or file, counted from 1.
struct NumberMaps {
  // Names of the two arrays, e.g. "node_num_map" and "elem_num_map".
  std::string_view vertices, cells;
  std::string_view vertices_role, cells_role;
  // Role of an array in a part of a decomposed mesh: the array contains the numbers that the part's
  // vertices or cells have in the whole mesh.
  std::string_view original_role;
};

// The features that a format can represent. When a mesh of another format is written, these
// features are kept; all other features are losses.
struct Capabilities {
  // How node sets, side sets and groups of elements are represented: as sets, as arrays (see
  // set_arrays.h), or as separate cells (see set_cells.h).
  enum class Sets { sets, arrays, cells };
  Sets sets = Sets::arrays;
  // Whether a file may contain all time steps; if false, a file contains one time step.
  bool every_step = false;
  // Whether arrays may have several components; if false, each component becomes a separate array,
  // such as v_x, v_y, v_z.
  bool vectors = true;
  // True: vectors are padded with zeros to an allowed number of components.
  bool padded_vectors = false;
  bool unique_names = false;  // true: array names are unique, so the second "v" becomes "v (2)"

  // Whether arrays may have integer values; if false, all values are floating-point.
  bool integers = true;
  // Whether cell arrays may cover only some blocks; if false, the other blocks are filled with NaN
  // (floats) or 0 (integers).
  bool partial_arrays = false;
  // Whether files have blocks; if false, block numbers are stored as an array.
  bool block_numbers = false;
  bool blocks_by_type = false;  // true: the number of a block is the number of a cell type
  bool positive_numbers = false, unique_numbers = false;
  // Largest numbers that blocks and sets may have. If no limit exists, the function pointer
  // most_numbers is null.
  struct MostNumbers {
    std::int64_t block, set;
  };
  MostNumbers (*most_numbers)(const MeshInfo& info) = nullptr;
  bool times = true;  // true: step times are stored even if no array has steps
  std::size_t title_bytes = ~std::size_t{0};  // maximum length of the title in bytes
  // The arrays that are number maps in this format; null if none exist.
  const NumberMaps* maps = nullptr;

  // Returns true if the format can represent the cells of the block. A null pointer means that the
  // format can represent all cells.
  bool (*block)(const BlockInfo& block) = nullptr;
  // Returns true if the name is written unchanged. A null pointer means that every name is written
  // unchanged.
  bool (*name)(const std::string& name) = nullptr;
  // Name of a format whose meshes the writer accepts unchanged, with their extras; empty if there
  // is no such format. losses_of_sibling() returns the data that is lost nevertheless.
  std::string_view sibling = {};
  LossList (*losses_of_sibling)(const MeshInfo& info) = nullptr;
};

// The meaning of the arrays that have a certain role. Formats define such roles.
struct Role {
  std::string_view name;       // role of the arrays: "format:..."
  bool is_numbered = false;    // a number follows the name: "format:name3"
  bool is_number_map = false;  // the values are numbers of vertices or cells

  // Whether the array has one value for each corner, edge or face of a cell, in the order of the
  // cell's corners, edges or faces.
  bool is_by_place = false;
  bool is_private = false;  // the array has no meaning in other formats

  // Returns text that describes the loss of a private array with this name. A null pointer means
  // that nothing is lost.
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

  // sets(), time(), title() and block_names() return data that is stored in the extras of a mesh;
  // sets() returns sets in addition to those of shm/sets.h. The functions add the keys of the
  // extras from which they took data to `used`.
  virtual std::vector<MeshSet> sets(const MeshInfo&, Keys& /*used*/) const { return {}; }

  // Returns groups other than node sets, side sets and element sets.
  virtual std::vector<NamedGroup> named_groups(const MeshInfo&) const { return {}; }
  virtual std::optional<double> time(const MeshInfo&, Keys& /*used*/) const { return {}; }
  virtual std::string title(const MeshInfo&, Keys& /*used*/) const { return {}; }
  virtual std::map<std::int64_t, std::string> block_names(const MeshInfo&, Keys& /*used*/) const {
    return {};
  }

  // Returns true if the extras of a mesh with time steps describe where the values of each step are
  // stored. Returns false if the extras come from one of several files, each of which contains one
  // step.
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

  // Returns descriptions of the extras that no other format can represent. Leaves out extras whose
  // key is in `used`.
  virtual LossList losses(const MeshInfo& info, const Keys& used) const {
    return losses_by_key(info, used);
  }
  // Returns true if an extra can be derived from the blocks of the mesh.
  virtual bool follows_from_blocks(const Extra&) const { return false; }

  // The next three functions determine the extras of a mesh (`old`) to which the time steps of
  // another file (`more`) are appended.
  //
  // counts_steps() returns true if the extras contain the number of steps. joined_extras() is for
  // files of the same format. It returns the extras of the result, or nothing; in the latter case,
  // each extra of `more` must also be in `old`. Its parameter `extras` contains the extras of
  // `more` in the numbering of `old`, and `steps` lists the steps of `more` to append.
  // lengthened_extras() returns the extras of the result if `more` has another format; `steps` is
  // the number of steps that are appended. Both throw Failure (unsupported) if the steps cannot be
  // appended.
  virtual bool counts_steps(const MeshInfo&) const { return false; }
  virtual std::optional<AppendedExtras> joined_extras(
      const MeshInfo& /*old*/, const MeshInfo& /*more*/, const std::vector<Extra>& /*extras*/,
      std::span<const std::uint64_t> /*steps*/) const {
    return {};
  }
  virtual AppendedExtras lengthened_extras(const MeshInfo& /*old*/, std::uint64_t /*steps*/) const {
    return {};
  }

  // Adds information about the whole mesh to the extras of a piece (some cells of the mesh), if the
  // writer of the piece needs this information.
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
  // extras of its format.
  bool holds_everything = false;
  Capabilities capabilities = {};
  std::span<const Role> roles = {};
  const SourceFormat* source = nullptr;  // null: the default implementations of SourceFormat apply

  // Converts extras that older versions of shm wrote to the extras that the format's reader creates
  // now. A null pointer means that the extras have not changed.
  void (*translate_old_extras)(MeshInfo& info) = nullptr;
  FileSink::Temporary temporary = FileSink::Temporary::unnamed;  // how temporary files are created

  // Loads the libraries that the format needs. open() and write() also load them, but a program
  // that forks calls this function before it forks. A null pointer means that the program is linked
  // to all libraries that the format needs. Throws Failure.
  void (*load)() = nullptr;
};

}  // namespace shm::converters
