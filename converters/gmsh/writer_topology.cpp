// Writes the sections $Nodes and $Elements of a Gmsh file.
#include <algorithm>
#include <array>

#include "gmsh/writing.h"

namespace shm::converters {
namespace {

class NodeWriter {
 public:
  explicit NodeWriter(GmshWriting& writing) : w_(writing), vertex_order_(writing.spool, 8) {}

  void write_flat(bool parametric) {
    w_.out.text(std::to_string(w_.info.vertices) + "\n");
    std::vector<std::uint64_t> vertices;
    std::vector<std::int32_t> rows;
    for (std::uint64_t first = 0; first < w_.info.vertices; first += vertices.size()) {
      vertices.resize(std::min<std::uint64_t>(kGmshPiece, w_.info.vertices - first));
      for (std::size_t i = 0; i < vertices.size(); ++i) vertices[i] = first + i;
      load_points(vertices);
      if (parametric) {
        load_parameters(vertices);
        load_entities(first, vertices.size(), rows);
      }
      for (std::size_t i = 0; i < vertices.size(); ++i) {
        w_.out.integer32(w_.node_tags[first + i]);
        for (std::size_t k = 0; k < 3; ++k) w_.out.real(points_[3 * i + k]);
        if (parametric) {
          const auto& entity = w_.plan.node_entities[static_cast<std::size_t>(rows[i])];
          if (w_.plan.version == 30) {
            w_.out.integer32(entity[1]);
            if (entity[1] != 0) w_.out.integer32(entity[0]);
          } else {
            w_.out.integer32(entity[0]);
            w_.out.integer32(entity[1]);
          }
          const std::size_t parameters = gmsh_parameters(entity[0], true, false);
          for (std::size_t k = 0; k < parameters; ++k) w_.out.real(parameters_[3 * i + k]);
        }
        w_.out.end_line();
      }
    }
    w_.out.end_of_data();
  }

  void write_blocks() {
    const std::vector<std::uint64_t> counts = sort_vertices();
    w_.out.count(counts.size());
    w_.out.count(w_.info.vertices);
    if (w_.v41()) {
      w_.out.integer64(w_.node_tags.lowest());
      w_.out.integer64(w_.node_tags.highest());
    }
    w_.out.end_line();
    std::uint64_t first = 0;
    for (std::size_t e = 0; e < counts.size(); ++e) {
      const auto& [dimension, tag, parametric] = w_.plan.node_entities[e];
      w_.out.integer32(w_.v41() ? dimension : tag);
      w_.out.integer32(w_.v41() ? tag : dimension);
      w_.out.integer32(parametric);
      w_.out.count(counts[e]);
      w_.out.end_line();
      if (w_.v41()) write_block_tags(first, counts[e]);
      write_block_points(first, counts[e], gmsh_parameters(dimension, parametric != 0, w_.v41()));
      first += counts[e];
    }
    w_.out.end_of_data();
  }

 private:
  // Reads data of the vertices with the indices `places`, which may be in any order, into `out`.
  // Calls read() once for each run of consecutive indices.
  template <class Read>
  static void gather(const std::vector<std::uint64_t>& places, std::size_t bytes_each,
                     std::byte* out, Read read) {
    for (std::size_t i = 0; i < places.size();) {
      std::size_t run = 1;
      while (i + run < places.size() && places[i + run] == places[i] + run) ++run;
      read(places[i], run, out + i * bytes_each);
      i += run;
    }
  }

  void load_points(const std::vector<std::uint64_t>& vertices) {
    points_.resize(3 * vertices.size());
    const ScalarType type = w_.info.schema.coordinate_type;
    const std::size_t bytes_each = 3 * scalar_bytes(type);
    raw_.resize(bytes_each * vertices.size());
    gather(vertices, bytes_each, raw_.data(),
           [&](auto first, auto count, std::byte* out) { w_.mesh.read_points(first, count, out); });
    widen_numbers(type, raw_, points_);
  }

  void load_parameters(const std::vector<std::uint64_t>& vertices) {
    parameters_.assign(3 * vertices.size(), 0.0);
    if (!w_.plan.node_parameters) return;
    gather(vertices, 24, reinterpret_cast<std::byte*>(parameters_.data()),
           [&](auto first, auto count, std::byte* out) {
             w_.mesh.read_array(*w_.plan.node_parameters, 0, first, count, out);
           });
  }

  // For each of `count` vertices, starting at vertex `first`, reads the entity to which it belongs.
  // Entities are identified by their row in the table plan.node_entities.
  void load_entities(std::uint64_t first, std::uint64_t count, std::vector<std::int32_t>& rows) {
    rows.assign(count, 0);
    if (w_.plan.node_entity)
      w_.mesh.read_array(*w_.plan.node_entity, 0, first, count,
                         reinterpret_cast<std::byte*>(rows.data()));
    for (const std::int32_t row : rows)
      if (row < 0 || static_cast<std::size_t>(row) >= w_.plan.node_entities.size())
        w_.fail(ErrorCode::corrupt, "a node belongs to an entity that does not exist");
  }

  // Returns the number of vertices of each entity. If the vertices of the mesh are not sorted by
  // entity, also fills vertex_order_.
  std::vector<std::uint64_t> sort_vertices() {
    std::vector<std::uint64_t> counts(w_.plan.node_entities.size());
    std::vector<std::int32_t> rows;
    std::int32_t last = 0;
    bool sorted = true;
    const auto for_each_row = [&](auto&& use) {
      for (std::uint64_t first = 0; first < w_.info.vertices; first += rows.size()) {
        load_entities(first, std::min<std::uint64_t>(kGmshPiece, w_.info.vertices - first), rows);
        for (std::size_t i = 0; i < rows.size(); ++i) use(first + i, rows[i]);
      }
    };
    for_each_row([&](std::uint64_t, std::int32_t row) {
      ++counts[static_cast<std::size_t>(row)];
      sorted &= row >= last;
      last = row;
    });
    if (sorted) return counts;
    std::vector<std::uint64_t> next(counts.size());
    for (std::size_t i = 1; i < next.size(); ++i) next[i] = next[i - 1] + counts[i - 1];
    for_each_row([&](std::uint64_t vertex, std::int32_t row) {
      vertex_order_.set(next[static_cast<std::size_t>(row)]++, vertex);
    });
    return counts;
  }

  void load_vertices(std::uint64_t first, std::uint64_t count, std::vector<std::uint64_t>& out) {
    out.resize(count);
    if (vertex_order_.size() > 0)
      vertex_order_.read(first, count, reinterpret_cast<std::byte*>(out.data()));
    else
      for (std::size_t i = 0; i < count; ++i) out[i] = first + i;
  }

  void write_block_tags(std::uint64_t begin, std::uint64_t count) {
    std::vector<std::uint64_t> vertices;
    for (std::uint64_t done = 0; done < count; done += vertices.size()) {
      load_vertices(begin + done, std::min<std::uint64_t>(kGmshPiece, count - done), vertices);
      for (const std::uint64_t vertex : vertices) {
        w_.out.integer64(w_.node_tags[vertex]);
        w_.out.end_line();
      }
    }
  }

  void write_block_points(std::uint64_t begin, std::uint64_t count, std::size_t parameters) {
    std::vector<std::uint64_t> vertices;
    for (std::uint64_t done = 0; done < count; done += vertices.size()) {
      load_vertices(begin + done, std::min<std::uint64_t>(kGmshPiece, count - done), vertices);
      load_points(vertices);
      if (parameters > 0) load_parameters(vertices);
      for (std::size_t i = 0; i < vertices.size(); ++i) {
        if (!w_.v41()) w_.out.integer32(w_.node_tags[vertices[i]]);
        for (std::size_t k = 0; k < 3; ++k) w_.out.real(points_[3 * i + k]);
        for (std::size_t k = 0; k < parameters; ++k) w_.out.real(parameters_[3 * i + k]);
        w_.out.end_line();
      }
    }
  }

  GmshWriting& w_;
  PagedArray vertex_order_;  // vertices sorted by entity; empty if the vertices of the mesh are
                             // already sorted
  std::vector<std::byte> raw_;
  std::vector<double> points_, parameters_;
};

class ElementWriter {
 public:
  explicit ElementWriter(GmshWriting& writing) : w_(writing) {}

  void write_blocks() {
    std::uint64_t used = 0;
    for (const GmshElementGroup& group : w_.plan.groups) used += group.type != 0 ? 1 : 0;
    w_.out.count(used);
    w_.out.count(w_.info.cells());
    if (w_.v41()) {
      w_.out.integer64(w_.element_tags.lowest());
      w_.out.integer64(w_.element_tags.highest());
    }
    w_.out.end_line();
    if (w_.cells_in_turn)
      write_cells_in_turn();
    else
      write_cells_sorted();
    w_.out.end_of_data();
  }

  void write_flat() {
    check_tag_arrays();
    w_.out.text(std::to_string(w_.info.cells()) + "\n");
    CellBatch batch;
    std::uint64_t cell = 0;
    w_.mesh.rewind_cells();
    while (w_.mesh.next_cells(batch, kGmshPiece)) {
      load_tags(batch);
      std::size_t run_end = 0;
      for (std::size_t i = 0; i < batch.size(); ++i, ++cell) {
        const GmshElementGroup& group = w_.plan.groups[batch.blocks[i]];
        if (w_.plan.encoding.binary && i == run_end) run_end = begin_run(batch, i);
        w_.out.integer32(w_.element_tags[cell]);
        if (!w_.plan.encoding.binary) w_.out.integer32(group.type);
        if (!w_.plan.encoding.binary && w_.plan.version == 20) w_.out.integer32(group.tag_count);
        tags_.clear();
        for (std::size_t slot = 0; slot < static_cast<std::size_t>(group.tag_count); ++slot)
          tags_.push_back(w_.plan.tag_arrays[slot] ? tag_values_[slot][tag_place_[slot]++]
                          : slot == 0              ? group.physical
                                                   : group.elementary);
        write_tags_and_nodes(w_.types[batch.blocks[i]], batch.cell(i));
        w_.out.end_line();
      }
    }
    w_.out.end_of_data();
  }

 private:
  // Writes the rest of an element of MSH 1 to 3. Version 3 has no physical tag, and its other tags
  // follow the nodes.
  void write_tags_and_nodes(const GmshType& type, std::span<const std::uint64_t> corners) {
    const std::span<const std::int32_t> tags(tags_);
    if (w_.plan.version != 30) {
      for (const std::int32_t tag : tags) w_.out.integer32(tag);
      if (w_.plan.version < 20 || type.nodes == 0) w_.out.count(corners.size());
      return write_nodes_of(type, corners, false);
    }
    w_.out.integer32(tags.size() > 1 ? tags[1] : 0);
    const auto more = tags.subspan(std::min<std::size_t>(tags.size(), 2));
    w_.out.count(corners.size() + more.size());
    write_nodes_of(type, corners, false);
    for (const std::int32_t tag : more) w_.out.integer32(tag);
  }

  void write_nodes_of(const GmshType& type, std::span<const std::uint64_t> corners, bool wide) {
    in_file_.assign(corners.begin(), corners.end());
    for (std::size_t k = 0; k < type.permutation.size(); ++k)
      in_file_[type.permutation[k]] = corners[k];
    for (const std::uint64_t vertex : in_file_) {
      if (vertex >= w_.info.vertices) w_.fail(ErrorCode::corrupt, "a cell uses an unknown vertex");
      w_.out.tag(w_.node_tags[vertex], wide);
    }
  }

  void begin_group(std::size_t g) {
    const GmshElementGroup& group = w_.plan.groups[g];
    if (group.type == 0) return;  // a group without cells has no type
    w_.out.integer32(w_.v41() ? group.dimension : group.entity);
    w_.out.integer32(w_.v41() ? group.entity : group.dimension);
    w_.out.integer32(group.type);
    w_.out.count(w_.group_cells[g]);
    w_.out.end_line();
  }

  void write_cell(std::size_t group, std::uint64_t cell, std::span<const std::uint64_t> corners) {
    w_.out.tag(w_.element_tags[cell], w_.v41());
    write_nodes_of(w_.types[group], corners, w_.v41());
    w_.out.end_line();
  }

  void write_cells_in_turn() {
    CellBatch batch;
    std::uint64_t cell = 0;
    std::size_t begun = 0;
    w_.mesh.rewind_cells();
    while (w_.mesh.next_cells(batch, kGmshPiece)) {
      for (std::size_t i = 0; i < batch.size(); ++i) {
        const std::uint32_t group = w_.plan.group_of(batch.blocks[i], batch.cell(i).size());
        while (begun <= group) begin_group(begun++);
        write_cell(group, cell++, batch.cell(i));
      }
    }
    while (begun < w_.plan.groups.size()) begin_group(begun++);
  }

  // Sorts the cells by group: stores the number and the corners of each cell in temporary storage
  // (the spool), and then writes the cells group by group.
  void write_cells_sorted() {
    std::vector<PagedArray> of_group;
    for (std::size_t g = 0; g < w_.plan.groups.size(); ++g) of_group.emplace_back(w_.spool, 8);
    CellBatch batch;
    std::uint64_t cell = 0;
    w_.mesh.rewind_cells();
    while (w_.mesh.next_cells(batch, kGmshPiece)) {
      for (std::size_t i = 0; i < batch.size(); ++i, ++cell) {
        const auto corners = batch.cell(i);
        PagedArray& numbers = of_group[w_.plan.group_of(batch.blocks[i], corners.size())];
        numbers.append(1, reinterpret_cast<const std::byte*>(&cell));
        numbers.append(corners.size(), reinterpret_cast<const std::byte*>(corners.data()));
      }
    }
    std::vector<std::uint64_t> numbers;
    for (std::size_t g = 0; g < of_group.size(); ++g) {
      begin_group(g);
      numbers.resize(1 + w_.types[g].nodes);
      for (std::uint64_t i = 0; i < w_.group_cells[g]; ++i) {
        of_group[g].read(i * numbers.size(), numbers.size(),
                         reinterpret_cast<std::byte*>(numbers.data()));
        write_cell(g, numbers[0], std::span(numbers).subspan(1));
      }
    }
  }

  // Reads the tags of the cells of a batch from the arrays of tags. Used only for MSH 1 and 2.
  void load_tags(const CellBatch& batch) {
    for (std::size_t slot = 0; slot < w_.plan.tag_arrays.size(); ++slot) {
      tag_place_[slot] = 0;
      if (!w_.plan.tag_arrays[slot]) continue;
      std::uint64_t count = 0;
      for (const std::uint32_t b : batch.blocks) count += has_tag(b, slot) ? 1 : 0;
      tag_values_[slot].resize(count);
      w_.mesh.read_array(*w_.plan.tag_arrays[slot], 0, tag_first_[slot], count,
                         reinterpret_cast<std::byte*>(tag_values_[slot].data()));
      tag_first_[slot] += count;
    }
  }

  bool has_tag(std::uint32_t block, std::size_t slot) const {
    return static_cast<std::size_t>(w_.plan.groups[block].tag_count) > slot;
  }

  void check_tag_arrays() {
    for (std::size_t slot = 0; slot < w_.plan.tag_arrays.size(); ++slot) {
      for (std::uint32_t b = 0; b < w_.plan.groups.size(); ++b) {
        const bool covered =
            w_.plan.tag_arrays[slot] && w_.info.schema.array_covers(*w_.plan.tag_arrays[slot], b);
        if (has_tag(b, slot) != covered && (slot > 1 || w_.plan.tag_arrays[slot]))
          w_.fail(
              ErrorCode::corrupt,
              "the arrays of tags do not cover exactly the blocks whose elements have these tags");
      }
    }
  }

  // Writes the header of a run of cells in a binary file. The run begins with cell `first` of the
  // batch and contains the following cells that have the same type and number of tags. Returns the
  // index after the last cell of the run.
  std::size_t begin_run(const CellBatch& batch, std::size_t first) {
    const GmshElementGroup& group = w_.plan.groups[batch.blocks[first]];
    std::size_t end = first + 1;
    while (end < batch.size() && w_.plan.groups[batch.blocks[end]].type == group.type &&
           w_.plan.groups[batch.blocks[end]].tag_count == group.tag_count)
      ++end;
    w_.out.integer32(group.type);
    w_.out.integer32(static_cast<std::int64_t>(end - first));
    w_.out.integer32(group.tag_count);
    return end;
  }

  GmshWriting& w_;
  std::vector<std::uint64_t> in_file_;
  // The following members are used only for MSH 1 to 3. They are indexed by the position of a tag
  // in the tag list of an element.
  std::array<std::uint64_t, 64> tag_first_{};  // index of the next value to read from the tag array
  std::array<std::size_t, 64> tag_place_{};    // index of the next value in tag_values_
  std::array<std::vector<std::int32_t>, 64> tag_values_;
  std::vector<std::int32_t> tags_;  // tags of the current element
};

}  // namespace

void look_at_gmsh_cells(GmshWriting& w) {
  w.group_cells.assign(w.plan.groups.size(), 0);
  w.types.reserve(w.plan.groups.size());
  for (const GmshElementGroup& group : w.plan.groups) w.types.push_back(gmsh_type(group.type));
  std::uint32_t last = 0;
  CellBatch batch;
  w.mesh.rewind_cells();
  while (w.mesh.next_cells(batch, kGmshPiece)) {
    w.cell_blocks.append(batch.size(), reinterpret_cast<const std::byte*>(batch.blocks.data()));
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const std::uint64_t nodes = batch.cell(i).size();
      const std::uint32_t group = w.plan.group_of(batch.blocks[i], nodes);
      const GmshType& type = w.types[group];
      if (!type.known() || (type.nodes != 0 && type.nodes != nodes) ||
          (type.nodes == 0 && (w.v4() || w.plan.encoding.binary)))
        w.fail(ErrorCode::unsupported, "a cell with " + std::to_string(nodes) +
                                           " nodes cannot be written as element type " +
                                           std::to_string(w.plan.groups[group].type));
      ++w.group_cells[group];
      w.cells_in_turn &= group >= last;
      last = group;
    }
  }
}

void write_gmsh_nodes(GmshWriting& writing, const std::string& section_name) {
  NodeWriter writer(writing);
  if (writing.v4())
    writer.write_blocks();
  else
    writer.write_flat(section_name == "ParametricNodes" || writing.plan.version == 30);
}

void write_gmsh_elements(GmshWriting& writing) {
  ElementWriter writer(writing);
  if (writing.v4())
    writer.write_blocks();
  else
    writer.write_flat();
}

}  // namespace shm::converters
