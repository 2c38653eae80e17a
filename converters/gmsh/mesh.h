// Inside of the Gmsh reader: the mesh it builds and what its parts share.
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

// A mesh whose bulk is in the spool.
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
  PagedArray points_;       // 3 doubles each
  PagedArray cell_blocks_;  // uint32, block of each cell
  PagedArray cell_sizes_;   // uint32, nodes of each cell of blocks where it varies, in turn
  PagedArray corners_;      // uint64
  std::vector<std::vector<PagedArray>> values_;  // [array][step], elements of one scalar

 private:
  std::uint64_t next_cell_ = 0, next_size_ = 0, next_corner_ = 0;
};

// From the tags of a file to places in its mesh. Takes memory only for tags that are far from
// dense; the first of equal tags wins.
class GmshTags {
 public:
  explicit GmshTags(Spool& spool) : tags_(spool, 8), places_(spool, 8) {}
  void append(std::int64_t tag);
  void finish();  // after the last append, before the first find
  std::optional<std::uint64_t> find(std::int64_t tag);
  std::uint64_t size() const { return size_; }
  // The first tag, when each next one is one more.
  std::optional<std::int64_t> first_of_run() const {
    return run_ ? std::optional(first_) : std::nullopt;
  }
  PagedArray take_listed();  // int64, one after the other; places are found as before

 private:
  std::uint64_t size_ = 0;
  bool run_ = true;
  std::int64_t first_ = 1, lowest_ = 0, highest_ = 0;
  PagedArray tags_;
  PagedArray places_;  // place + 1 by tag - lowest
  bool dense_ = false;
  std::vector<std::pair<std::int64_t, std::uint64_t>> sparse_;  // sorted by tag
};

// A line of "gmsh/sections".
struct GmshSection {
  std::string name;  // "Nodes"
  std::string kind = "raw";
  std::uint64_t step = 0;
  std::string array;
};

// A data section whose values stand in the file once for each of some elements.
struct GmshView {
  std::size_t section = 0;
  std::string array_name, group;  // sections of one group differ in their time only
  std::int64_t step = 0;          // as the file counts them
  double time = 0;
  std::uint32_t components = 1;       // of the array
  std::vector<std::uint32_t> blocks;  // that it covers, empty: all
  std::optional<PagedArray> values;   // doubles, in the order of the mesh
};

// What the parts of the reader share.
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
  int version = 10;  // 10, 20 (all of 2.x), 40 or 41
  bool have_nodes = false, have_elements = false;
  // Something may name nodes or elements by tags that we do not know as such: each one has to keep
  // its tag, whatever order they get.
  bool tags_are_referred_to = false;
  GmshTags nodes, elements;
  std::vector<std::int32_t> block_table;  // of extra gmsh/elements/blocks
  std::vector<GmshSection> sections;
  std::vector<GmshView> views;
  GmshNaming naming;  // for the names of blocks

  std::size_t block_table_width() const { return version >= 40 ? 3 : 4; }
  std::string section_key() const { return "gmsh/section/" + std::to_string(sections.size() - 1); }
  void add_extra(std::string key, ScalarType type, std::vector<std::uint64_t> shape,
                 const void* data, Reference refers = Reference::nothing);
  void add_text(std::string key, std::string_view text);
  // A static array that the model has no name for.
  void add_role_array(const std::string& role, Location location, ScalarType type,
                      std::uint32_t components, PagedArray values,
                      std::vector<std::uint32_t> blocks = {});
};

// After the data of a section: its end marker, nothing else before it.
void expect_section_end(GmshReading& reading);

// The sections by what they hold. `read_*` throw on what is broken.
void read_gmsh_nodes(GmshReading& reading, bool parametric_section);
void read_gmsh_elements(GmshReading& reading);
void keep_gmsh_tags(GmshReading& reading);  // after all sections
// False (nothing consumed that matters) when the header is not one that we know.
bool read_gmsh_data(GmshReading& reading);
// Turns the views into arrays, once all sections are read.
void finish_gmsh_data(GmshReading& reading);
// Of content in memory. False when it has another form or refers to what is not in the mesh.
bool parse_gmsh_periodic(GmshReading& reading, std::string_view content);
bool parse_gmsh_ghosts(GmshReading& reading, std::string_view content);

}  // namespace shm::converters
