// Format: describes one file format of meshes, for code that knows no format. Each folder of a
// format defines its own Format in the unit format.cpp; formats/formats.cpp lists them all.
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

// Names and roles of the arrays that map vertices and cells to their numbers elsewhere, counted
// from 1.
struct NumberMaps {
  std::string_view vertices, cells;  // names
  std::string_view vertices_role, cells_role;
  // Role of a map to the numbers that the original whole mesh had, in a part of a decomposed mesh.
  std::string_view original_role;
};

// The features that the meshes of a format can have. A writer keeps these features of meshes from
// other formats.
struct Capabilities {
  // How node sets, side sets and groups of elements are represented: as sets, as arrays (see
  // set_arrays.h), or as cells of their own (see set_cells.h).
  enum class Sets { sets, arrays, cells };
  Sets sets = Sets::arrays;
  bool every_step = false;  // false: one time step per file
  // Arrays with several components; false: one array per component, v_x, v_y, v_z.
  bool vectors = true;
  bool padded_vectors = false;  // vectors are padded with zeros to an allowed number of components
  bool unique_names = false;    // array names are unique: the second "v" becomes "v (2)"
  bool integers = true;         // false: all values are floating-point
  bool partial_arrays = false;  // cell arrays on some blocks; false: the other blocks get NaN or 0
  bool block_numbers = false;   // has blocks; false: block numbers are an array
  bool blocks_by_type = false;  // the number of a block is the number of a cell type
  bool positive_numbers = false, unique_numbers = false;
  // Largest numbers that blocks and sets may have; null: no limit.
  struct MostNumbers {
    std::int64_t block, set;
  };
  MostNumbers (*most_numbers)(const MeshInfo& info) = nullptr;
  bool times = true;                          // step times, even if no array has steps
  std::size_t title_bytes = ~std::size_t{0};  // maximum length of the title
  const NumberMaps* maps = nullptr;           // arrays that are number maps in this format too
  bool (*block)(const BlockInfo& block) = nullptr;  // true if the format has such cells; null: all
  // True if the name is written unchanged; null: always.
  bool (*name)(const std::string& name) = nullptr;
  // A format whose meshes the writer accepts unchanged, with their extras, and the losses that
  // occur in that case. Empty: there is none.
  std::string_view sibling = {};
  LossList (*losses_of_sibling)(const MeshInfo& info) = nullptr;
};

// The meaning of the arrays that have a role of a format.
struct Role {
  std::string_view name;       // "format:..."
  bool is_numbered = false;    // a number follows the name: "format:name3"
  bool is_number_map = false;  // the values are numbers of vertices or cells
  bool is_by_place = false;    // a value for each corner, edge or face of a cell, in its order
  bool is_private = false;     // the array has no meaning in other formats
  // Names the loss of a private array, from the name of the array. Null: nothing is lost.
  std::string (*loss)(const std::string& array) = nullptr;
};

// A named group of a mesh, for display.
struct NamedGroup {
  std::string kind;  // "node set", "side set", "physical volume", ...
  std::string id;
  std::string name;
  std::optional<std::uint64_t> members;
};

// Interprets the extras of a mesh that came from a file of a certain format. A format without
// extras of its own overrides nothing.
class SourceFormat {
 public:
  SourceFormat(const SourceFormat&) = delete;
  SourceFormat& operator=(const SourceFormat&) = delete;

  // Return data that is stored in the extras of a mesh, in addition to the sets of shm/sets.h.
  // `used` receives the keys of all extras whose content the result includes.
  virtual std::vector<MeshSet> sets(const MeshInfo&, Keys& /*used*/) const { return {}; }
  // Returns groups other than node sets, side sets and element sets.
  virtual std::vector<NamedGroup> named_groups(const MeshInfo&) const { return {}; }
  virtual std::optional<double> time(const MeshInfo&, Keys& /*used*/) const { return {}; }
  virtual std::string title(const MeshInfo&, Keys& /*used*/) const { return {}; }
  virtual std::map<std::int64_t, std::string> block_names(const MeshInfo&, Keys& /*used*/) const {
    return {};
  }

  // Returns true if the extras of a mesh with time steps describe where the values of each step are
  // stored. Returns false if the extras come from one of several files with one step each.
  virtual bool describes_steps(const MeshInfo&) const { return true; }
  // Returns the extras for a mesh reduced to some of its steps; nothing if they cannot be
  // determined.
  virtual std::optional<std::vector<Extra>> extras_of_steps(const MeshInfo& info,
                                                            StepRange /*steps*/) const {
    return info.extras;
  }
  // For a mesh that is one of several files with one step each. extras_of_series() returns its
  // extras without those about the step (the time, ranges of values), so that the rest applies to
  // all files. is_about_file() returns true if an extra describes its own file and may differ in
  // the others.
  virtual std::vector<Extra> extras_of_series(const MeshInfo& info) const { return info.extras; }
  virtual bool is_about_file(std::string_view /*key*/) const { return false; }
  // Returns the array that holds the points at a time step; nothing if they are the points of the
  // mesh.
  virtual std::optional<std::size_t> points_of_step(const MeshInfo&, std::uint64_t /*step*/) const {
    return {};
  }
  // Returns true if the mesh is two-dimensional, so that the sides of its triangles and quads are
  // edges.
  virtual bool is_flat(const MeshInfo&) const { return false; }
  // Returns true if extras, other than side sets, or blocks depend on the position of corners
  // within a cell.
  virtual bool needs_corner_order(const MeshInfo&) const { return false; }

  // Returns true if the values of an array are indices into a list of strings; strings() returns
  // this list.
  virtual bool has_strings(const ArrayInfo&) const { return false; }
  virtual std::vector<std::string> strings(const MeshInfo&, std::size_t /*array*/) const {
    return {};
  }
  // Returns true if an extra is such a list.
  virtual bool is_list_of_strings(std::string_view /*key*/) const { return false; }

  // Lists the extras that no other format can represent, except those in `used`.
  virtual LossList losses(const MeshInfo& info, const Keys& used) const {
    return losses_by_key(info, used);
  }
  // Returns true if an extra can be derived from the blocks of the mesh.
  virtual bool follows_from_blocks(const Extra&) const { return false; }

  // These functions are for appending the time steps of another file, `more`, to a mesh, `old`.
  // counts_steps() returns true if the extras contain the number of steps. joined_extras() returns
  // the extras of the result if both files have the same format: `extras` are those of `more` in
  // the numbering of `old`, and `steps` are the steps of `more` to append. If it returns nothing,
  // each extra of `more` must also be in `old`. lengthened_extras() returns the extras if `more`
  // has another format. The last two throw Failure (unsupported) if the steps cannot be appended.
  virtual bool counts_steps(const MeshInfo&) const { return false; }
  virtual std::optional<AppendedExtras> joined_extras(
      const MeshInfo& /*old*/, const MeshInfo& /*more*/, const std::vector<Extra>& /*extras*/,
      std::span<const std::uint64_t> /*steps*/) const {
    return {};
  }
  virtual AppendedExtras lengthened_extras(const MeshInfo& /*old*/, std::uint64_t /*steps*/) const {
    return {};
  }

  // Adds information about the whole mesh that the writer of a piece needs to the extras of the
  // piece.
  virtual void mark_piece(const MeshInfo& /*whole*/, MeshInfo& /*piece*/) const {}

 protected:
  constexpr SourceFormat() = default;
  ~SourceFormat() = default;
};

struct Format {
  std::string_view name;                       // as in --format, and the source_format of meshes
  std::string_view title;                      // name in messages
  std::array<std::string_view, 6> extensions;  // with the dot; unused entries are empty
  // Gets up to 4096 bytes.
  bool (*looks_like)(std::span<const std::byte> head) = nullptr;
  // Null for .shm, which open_mesh() and write_mesh() decode and encode.
  std::unique_ptr<MeshSource> (*open)(const std::string& path, Spool& spool) = nullptr;
  void (*write)(MeshSource& mesh, const std::string& path, Spool& spool) = nullptr;
  // Meshes of all formats are stored unchanged, with their extras, as in .shm files. The
  // capabilities are then those for a mesh without the extras of its format.
  bool holds_everything = false;
  Capabilities capabilities = {};
  std::span<const Role> roles = {};
  const SourceFormat* source = nullptr;  // null: a SourceFormat that overrides nothing
  // Converts extras written by older versions of shm to the extras that the format's reader creates
  // now. Null: they are the same.
  void (*translate_old_extras)(MeshInfo& info) = nullptr;
  FileSink::Temporary temporary = FileSink::Temporary::unnamed;  // how temporary files are created
  // Loads the libraries that the format needs. open() and write() do that anyway; a program that
  // forks calls it beforehand. Null: the format needs only libraries that the program is linked to.
  // Throws Failure.
  void (*load)() = nullptr;
};

}  // namespace shm::converters
