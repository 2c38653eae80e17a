// Internals of the Gmsh reader: the mesh that it builds, and the data that all parts of the reader
// share.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/spool.h"
#include "base/text_input.h"
#include "gmsh/groups.h"
#include "gmsh/scan.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// A mesh whose large arrays are in the spool (temporary storage, on disk if large).
class GmshMesh final : public MeshSource {
 public:
  explicit GmshMesh(Spool& spool);
  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override;
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override;
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

  MeshInfo info_;
  PagedArray points_;       // 3 doubles per point
  PagedArray cell_blocks_;  // uint32, block of each cell

  // Node counts (uint32) of the cells in blocks whose cells have different numbers of nodes, in
  // cell order.
  PagedArray cell_sizes_;
  PagedArray corners_;                           // uint64
  std::vector<std::vector<PagedArray>> values_;  // [array][step], one scalar per element

 private:
  std::uint64_t next_cell_ = 0, next_size_ = 0, next_corner_ = 0;
};

// Maps the tags of nodes or elements to indices in the mesh. Needs memory only if the tags are not
// consecutive. If several nodes or elements have the same tag, find() returns the first of them.
class GmshTags {
 public:
  explicit GmshTags(Spool& spool) : tags_(spool, 8), places_(spool, 8) {}
  void append(std::int64_t tag);
  void finish();  // must be called after the last append() and before find()
  std::optional<std::uint64_t> find(std::int64_t tag);
  std::uint64_t size() const { return size_; }
  // Returns the first tag if each tag is one more than the previous tag. Otherwise returns nothing.
  std::optional<std::int64_t> first_of_run() const {
    return run_ ? std::optional(first_) : std::nullopt;
  }
  // Returns the tags of all nodes or elements as int64, in mesh order. find() still works
  // afterwards.
  PagedArray take_listed();

 private:
  std::uint64_t size_ = 0;
  bool run_ = true;
  std::int64_t first_ = 1, lowest_ = 0, highest_ = 0;
  PagedArray tags_;
  // places_[i] is 1 + the index of the node or element with the tag lowest_ + i, or 0 if there is
  // no node or element with this tag.
  PagedArray places_;
  bool dense_ = false;
  std::vector<std::pair<std::int64_t, std::uint64_t>> sparse_;  // sorted by tag
};

// A line of the extra "gmsh/sections".
struct GmshSection {
  std::string name;  // "Nodes"
  std::string kind = "raw";
  std::uint64_t step = 0;
  std::string array;
};

// A data section that becomes part of an array, because it has exactly one entry for each node, or
// for each element of some blocks.
struct GmshView {
  std::size_t section = 0;
  std::string array_name, group;  // data sections with the same `group` are time steps of one view
  std::int64_t step = 0;          // step number in the file
  double time = 0;
  std::uint32_t components = 1;       // components of the array
  std::vector<std::uint32_t> blocks;  // covered blocks; empty: all
  std::optional<PagedArray> values;   // doubles, in mesh order
};

// The data that all parts of the reader share.
struct GmshReading {
  GmshReading(const std::string& path, Spool& shared_spool)
      : input(path),
        scan(input),
        spool(shared_spool),
        mesh(std::make_unique<GmshMesh>(spool)),
        nodes(spool),
        elements(spool) {}

  TextInput input;
  GmshScan scan;
  Spool& spool;
  std::unique_ptr<GmshMesh> mesh;
  int version = 10;  // result of gmsh_version()
  bool have_nodes = false, have_elements = false;
  // True if parts of the file that the reader does not parse may refer to nodes or elements by tag.
  // If so, arrays store the tags of all nodes and elements, even if the tags are consecutive.
  bool tags_are_referred_to = false;
  GmshTags nodes, elements;
  std::vector<std::int32_t> block_table;  // the extra gmsh/elements/blocks
  std::vector<GmshSection> sections;
  std::vector<GmshView> views;
  GmshNaming naming;  // contains the names of blocks

  std::size_t block_table_width() const { return version >= 40 ? 3 : 4; }
  std::string section_key() const { return "gmsh/section/" + std::to_string(sections.size() - 1); }
  void add_extra(std::string key, ScalarType type, std::vector<std::uint64_t> shape,
                 const void* data, Reference refers = Reference::nothing);
  void add_text(std::string key, std::string_view text);
  // Adds a static array that has a role.
  void add_role_array(const std::string& role, Location location, ScalarType type,
                      std::uint32_t components, PagedArray values,
                      std::vector<std::uint32_t> blocks = {});
};

// Checks that the next line is the end marker of the current section. Throws Failure otherwise.
void expect_section_end(GmshReading& reading);

// Functions that read sections. The functions named read_*() throw Failure if the section is
// damaged.
void read_gmsh_nodes(GmshReading& reading, bool parametric_section);
void read_gmsh_elements(GmshReading& reading);
void keep_gmsh_tags(GmshReading& reading);  // must be called after all sections have been read

// Reads a data section. Returns false if the header of the section has an unknown form; the caller
// then reads the section again as raw text.
bool read_gmsh_data(GmshReading& reading);
// Converts the views that were read to arrays. Must be called after all sections have been read.
void finish_gmsh_data(GmshReading& reading);
// The next two functions parse a section whose content is in memory. They return false if the
// section has an unexpected form, or refers to nodes or elements that are not in the mesh.
bool parse_gmsh_periodic(GmshReading& reading, std::string_view content);
bool parse_gmsh_ghosts(GmshReading& reading, std::string_view content);

}  // namespace shm::converters
