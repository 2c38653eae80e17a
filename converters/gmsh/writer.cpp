// The Gmsh writer: writes the sections of a GmshPlan.
#include <algorithm>

#include "gmsh/gmsh.h"
#include "gmsh/writing.h"

namespace shm::converters {
namespace {

using Kind = GmshPlannedSection::Kind;

std::string folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == std::string::npos ? "." : path.substr(0, slash + 1);
}

class SectionWriter {
 public:
  explicit SectionWriter(GmshWriting& writing) : w_(writing) {}

  void write(const GmshPlannedSection& section) {
    if (section.kind == Kind::between) return w_.out.text(section.content);
    w_.section = "$" + section.name;
    w_.out.text("$" + section.name + "\n");
    switch (section.kind) {
      case Kind::format: write_format(); break;
      case Kind::raw:
      case Kind::between: w_.out.text(section.content); break;
      case Kind::nodes: write_gmsh_nodes(w_, section.name); break;
      case Kind::elements: write_gmsh_elements(w_); break;
      case Kind::array: write_gmsh_view(w_, section); break;
      case Kind::list: write_gmsh_list(w_, section); break;
      case Kind::links: write_links(section.key); break;
      case Kind::ghosts: write_ghosts(section.key); break;
    }
    const bool old = section.name == "NOD" || section.name == "ELM";
    w_.out.text((old ? "$END" : "$End") + section.name + "\n");
  }

 private:
  void write_format() {
    w_.out.text(w_.plan.format_line + "\n");
    if (!w_.plan.encoding.binary) return;
    w_.out.integer32(1);
    w_.out.end_of_data();
  }

  void write_links(const std::string& key) {
    const auto links = w_.extras.integers(key + "/links", 5);
    const auto affine = w_.extras.reals(key + "/affine");
    const auto nodes = w_.extras.integers(key + "/nodes", 2);
    w_.out.write_numbers_as_text(!w_.v4());
    w_.out.count(links.size() / 5, w_.v41());
    w_.out.end_line();
    std::size_t next_affine = 0, next_node = 0;
    for (std::size_t i = 0; i < links.size(); i += 5) {
      for (std::size_t k = 0; k < 3; ++k) w_.out.integer32(links[i + k]);
      w_.out.end_line();
      const auto affine_count = static_cast<std::uint64_t>(links[i + 3]);
      const auto pairs = static_cast<std::uint64_t>(links[i + 4]);
      if (affine_count > affine.size() - next_affine || pairs > (nodes.size() - next_node) / 2)
        w_.extras.fail(key + "/links",
                       "states more affine values or nodes than the mesh's extras contain");
      if (w_.v41()) w_.out.count(affine_count);
      if (!w_.v41() && affine_count > 0) begin_old_affine(key, affine_count);
      for (std::uint64_t k = 0; k < affine_count; ++k) w_.out.real(affine[next_affine++]);
      if (w_.v41() || affine_count > 0) w_.out.end_line();
      w_.out.count(pairs);
      w_.out.end_line();
      for (std::uint64_t k = 0; k < pairs; ++k) {
        w_.out.tag(w_.node_tag(nodes[next_node++]), w_.v41());
        w_.out.tag(w_.node_tag(nodes[next_node++]), w_.v41());
        w_.out.end_line();
      }
    }
    w_.out.end_of_data();
    w_.out.write_numbers_as_text(false);
  }

  // Writes the marker that precedes affine values in versions before 4.1. The marker is a node
  // count of -1 in a binary file of version 4.0, and the word "Affine" in all other files.
  void begin_old_affine(const std::string& key, std::uint64_t values) {
    if (values != 16) w_.extras.fail(key + "/links", "lacks an affine transformation of 16 values");
    if (w_.v4() && w_.plan.encoding.binary)
      w_.out.integer64(-1);
    else
      w_.out.text("Affine ");
  }

  void write_ghosts(const std::string& key) {
    const auto cells = w_.extras.integers(key + "/cells");
    const auto partitions = w_.extras.integers(key + "/partitions", 2);
    const auto ghosts = w_.extras.integers(key + "/ghosts");
    if (partitions.size() != 2 * cells.size())
      w_.extras.fail(key + "/partitions", "does not have one row for each ghost element");
    w_.out.count(cells.size(), w_.v41());
    w_.out.end_line();
    std::size_t next = 0;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const auto count = static_cast<std::uint64_t>(partitions[2 * i + 1]);
      if (count > ghosts.size() - next) w_.extras.fail(key + "/ghosts", "is too short");
      w_.out.tag(w_.element_tag(cells[i]), w_.v41());
      w_.out.integer32(partitions[2 * i]);
      w_.out.count(count, w_.v41());
      for (std::uint64_t k = 0; k < count; ++k) w_.out.integer32(ghosts[next++]);
      w_.out.end_line();
    }
    w_.out.end_of_data();
  }

  GmshWriting& w_;
};

}  // namespace

GmshTagValues::GmshTagValues(Spool& spool, std::uint64_t count, std::int64_t first)
    : count_(count),
      first_(first),
      copy_(spool, 8),
      lowest_(count > 0 ? first : 0),
      highest_(count > 0 ? static_cast<std::int64_t>(static_cast<std::uint64_t>(first) + count - 1)
                         : 0) {}

void GmshTagValues::copy(MeshSource& mesh, std::size_t array) {
  std::vector<std::int64_t> tags;
  for (std::uint64_t first = 0; first < count_; first += tags.size()) {
    tags.resize(std::min<std::uint64_t>(kGmshPiece, count_ - first));
    auto* bytes = reinterpret_cast<std::byte*>(tags.data());
    mesh.read_array(array, 0, first, tags.size(), bytes);
    copy_.append(tags.size(), bytes);
    if (first == 0) lowest_ = highest_ = tags[0];
    const auto [low, high] = std::minmax_element(tags.begin(), tags.end());
    lowest_ = std::min(lowest_, *low);
    highest_ = std::max(highest_, *high);
  }
}

GmshWriting::GmshWriting(MeshSource& source, const std::string& file)
    : mesh(source),
      info(source.info()),
      path(file),
      plan(plan_gmsh(source, file)),
      extras(info, file),
      spool(folder_of(file)),
      node_tags(spool, info.vertices, plan.first_node_tag),
      element_tags(spool, info.cells(), plan.first_element_tag),
      cell_blocks(spool, 4),
      out(file, plan.encoding) {
  if (plan.node_tags) node_tags.copy(mesh, *plan.node_tags);
  if (plan.element_tags) element_tags.copy(mesh, *plan.element_tags);
}

void GmshWriting::fail(ErrorCode code, const std::string& detail) const {
  throw Failure(Error{.code = code, .detail = detail, .section = section, .file = path});
}

std::int64_t GmshWriting::node_tag(std::int64_t place) {
  if (place < 0 || static_cast<std::uint64_t>(place) >= info.vertices)
    fail(ErrorCode::corrupt, "a reference to a vertex points outside the mesh");
  return node_tags[static_cast<std::uint64_t>(place)];
}

std::int64_t GmshWriting::element_tag(std::int64_t place) {
  if (place < 0 || static_cast<std::uint64_t>(place) >= cell_blocks.size())
    fail(ErrorCode::corrupt, "a reference to a cell points outside the mesh");
  return element_tags[static_cast<std::uint64_t>(place)];
}

void write_gmsh(MeshSource& mesh, const std::string& path) {
  GmshWriting writing(mesh, path);
  look_at_gmsh_cells(writing);
  SectionWriter writer(writing);
  for (const GmshPlannedSection& section : writing.plan.sections) writer.write(section);
  writing.out.close();
}

}  // namespace shm::converters
