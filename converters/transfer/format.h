// Format: one kind of files that meshes come from and go to, for code that knows none of them. Each
// folder of a format describes its own, in the unit format.cpp; formats/formats.cpp lists them.
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
#include "base/progress.h"
#include "base/spool.h"
#include "mesh/appended_extras.h"
#include "mesh/chosen_steps.h"
#include "mesh/mesh_source.h"
#include "sets/transfer_sets.h"
#include "transfer/losses.h"

namespace shm::converters {

// Maps of the numbers that vertices and cells have elsewhere, counted from 1: their names and
// roles.
struct NumberMaps {
  std::string_view vertices, cells;  // names
  std::string_view vertices_role, cells_role;
  std::string_view original_role;  // of numbers in the whole mesh, in a part of a decomposed one
};

// What a format can hold of meshes from other formats.
struct Capabilities {
  // Node sets, side sets, groups of elements: as such, as arrays (see set_arrays.h), or as cells of
  // their own (set_cells.h).
  enum class Sets { sets, arrays, cells };
  Sets sets = Sets::arrays;
  bool every_step = false;      // else one time step a file
  bool vectors = true;          // arrays with components; else columns
  bool integers = true;         // else all values are floating-point
  bool partial_arrays = false;  // cell arrays on some blocks; else NaN or 0 on the others
  bool block_numbers = false;   // blocks of its own; else their numbers are an array
  bool positive_numbers = false, unique_numbers = false;
  // What blocks and sets may have at most; null: any.
  struct MostNumbers {
    std::int64_t block, set;
  };
  MostNumbers (*most_numbers)(const MeshInfo& info) = nullptr;
  bool times = true;                                // of steps, even when no array has any
  std::size_t title_bytes = ~std::size_t{0};        // most
  const NumberMaps* maps = nullptr;                 // that are maps there, too
  bool (*block)(const BlockInfo& block) = nullptr;  // whether it has such cells; null: all
  bool (*name)(const std::string& name) = nullptr;  // whether it is written as it is; null: yes
  // A format whose meshes the writer takes as they are, extras and all, and what it cannot hold of
  // them. Empty: none.
  std::string_view sibling = {};
  LossList (*losses_of_sibling)(const MeshInfo& info) = nullptr;
};

// A named group of a mesh, for people to look at.
struct NamedGroup {
  std::string kind;  // "node set", "side set", "physical volume", ...
  std::string id;
  std::string name;
  std::optional<std::uint64_t> members;
};

// What the extras and roles of a mesh mean that came from a file of a format. A format that has
// nothing to add overrides nothing.
class SourceFormat {
 public:
  SourceFormat(const SourceFormat&) = delete;
  SourceFormat& operator=(const SourceFormat&) = delete;

  // Out of the extras of a mesh, beside those of shm/sets.h; `used` gets the keys of those whose
  // content the result has.
  virtual std::vector<MeshSet> sets(const MeshInfo&, Keys& /*used*/) const { return {}; }
  // Groups that are no node sets, side sets or sets of elements.
  virtual std::vector<NamedGroup> named_groups(const MeshInfo&) const { return {}; }
  virtual std::optional<double> time(const MeshInfo&, Keys& /*used*/) const { return {}; }
  virtual std::string title(const MeshInfo&, Keys& /*used*/) const { return {}; }
  virtual std::map<std::int64_t, std::string> block_names(const MeshInfo&, Keys& /*used*/) const {
    return {};
  }

  // Whether extras of a mesh with time steps say where the values of each stand. False where they
  // are those of one of several files that hold one step each.
  virtual bool describes_steps(const MeshInfo&) const { return true; }
  // The extras of the mesh at some of its steps; nothing where it is not known which those are.
  virtual std::optional<std::vector<Extra>> extras_of_steps(const MeshInfo& info,
                                                            StepRange /*steps*/) const {
    return info.extras;
  }
  // Of a mesh that is one of several files with a step each: its extras without what is about the
  // step (the time, ranges of values), so that they are those of all; whether one is about its file
  // and may be another one in the others.
  virtual std::vector<Extra> extras_of_series(const MeshInfo& info) const { return info.extras; }
  virtual bool is_about_file(std::string_view /*key*/) const { return false; }
  // The array that has the points at a time step; nothing where those of the mesh are meant.
  virtual std::optional<std::size_t> points_of_step(const MeshInfo&, std::uint64_t /*step*/) const {
    return {};
  }
  // Whether the mesh is one of two dimensions, so that sides of its triangles and quads are edges.
  virtual bool is_flat(const MeshInfo&) const { return false; }
  // Whether extras or blocks count on the position of corners within a cell.
  virtual bool needs_corner_order(const MeshInfo&) const { return false; }
  // Whether vectors are an array for each component: v_x, v_y, v_z.
  virtual bool has_vectors_as_columns() const { return false; }
  // Whether vectors are as long as the format can show them, with zeros behind.
  virtual bool has_padded_vectors() const { return false; }
  // Whether arrays have names of their own: the second "v" is "v (2)".
  virtual bool has_unique_names() const { return false; }
  // Whether the number of a block is that of a type of cells.
  virtual bool has_blocks_by_type() const { return false; }

  // Of an array with a role of this format: whether no other one can make something of it, what is
  // lost then (empty: nothing), whether it is a map of the numbers of vertices or cells.
  virtual bool is_private(const ArrayInfo&) const { return false; }
  virtual std::string loss_of_private(const ArrayInfo&) const { return {}; }
  virtual bool is_number_map(const ArrayInfo&) const { return false; }

  // Whether the values of an array are places in a list of strings; the list.
  virtual bool has_strings(const ArrayInfo&) const { return false; }
  virtual std::vector<std::string> strings(const MeshInfo&, std::size_t /*array*/) const {
    return {};
  }
  // Whether an extra is the list of an array.
  virtual bool is_list_of_strings(std::string_view /*key*/) const { return false; }

  // What no other format can hold of the extras, but for those that are in `used`.
  virtual LossList losses(const MeshInfo& info, const Keys& used) const {
    return losses_by_key(info, used);
  }
  // Whether an extra follows from the blocks of the mesh.
  virtual bool follows_from_blocks(const Extra&) const { return false; }

  // Where steps of another file go behind those of a mesh: whether extras have the number of steps;
  // the extras then (nothing: only those of the old file that are the same there), and those where
  // the other file is of another format. `extras`: of `more`, in the numbers of `old`; `steps`: of
  // `more`. The latter throw Failure (unsupported) where that cannot be.
  virtual bool counts_steps(const MeshInfo&) const { return false; }
  virtual std::optional<AppendedExtras> joined_extras(
      const MeshInfo& /*old*/, const MeshInfo& /*more*/, const std::vector<Extra>& /*extras*/,
      std::span<const std::uint64_t> /*steps*/) const {
    return {};
  }
  virtual AppendedExtras lengthened_extras(const MeshInfo& /*old*/, std::uint64_t /*steps*/) const {
    return {};
  }

  // Adds to the extras of a piece what its writer must know of the whole mesh.
  virtual void mark_piece(const MeshInfo& /*whole*/, MeshInfo& /*piece*/) const {}

 protected:
  constexpr SourceFormat() = default;
  ~SourceFormat() = default;
};

struct Format {
  std::string_view name;                       // as in --format, and the source_format of meshes
  std::string_view title;                      // in messages
  std::array<std::string_view, 6> extensions;  // with the dot; the rest is empty
  bool (*looks_like)(std::span<const std::byte> head);  // up to 4096 bytes
  std::unique_ptr<MeshSource> (*open)(const std::string& path, Spool& spool,
                                      const Progress& progress);
  // Null: .shm, which write_mesh() gives out as it comes.
  void (*write)(MeshSource& mesh, const std::string& path, Spool& spool);
  const Capabilities* capabilities = nullptr;  // null: it holds everything
  const SourceFormat* source = nullptr;        // null: its meshes have nothing to add
  // Extras as older versions of shm wrote them become those that the reader of the format gives
  // now. Null: they are the same.
  void (*translate_old_extras)(MeshInfo& info) = nullptr;
  FileSink::Temporary temporary = FileSink::Temporary::unnamed;  // of its files
  // Opens the libraries that its files need, as open() and write() do anyway; for who forks. Null:
  // it needs none but those that the program is linked to. Throws Failure.
  void (*load)() = nullptr;
};

// Of the format that a mesh came from, or that a role "format:..." belongs to; one that has nothing
// to add where the list has none. They ask the list, which stands above all formats:
// formats/formats.cpp.
const SourceFormat& source_format(const MeshInfo& info);
const SourceFormat& format_of_role(std::string_view role);
// Extras out of a .shm file of any version, as this one writes them. Wants the whole MeshInfo.
void translate_old_extras(MeshInfo& info);

// The sets of a mesh: those of shm/sets.h, but for blocks that have their name, and those of its
// format.
std::vector<MeshSet> transfer_sets(const MeshInfo& info, Keys& used);

}  // namespace shm::converters
