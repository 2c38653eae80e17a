// Writes an Exodus file with at least one example of each kind of data that libexodusii can write.
// Also describes the contents of an Exodus file as a list of sentences. The sentences refer to
// nodes and elements by their ids. Two files that differ only in the order of nodes and elements
// therefore have the same sentences.
#pragma once

#include <exodusII.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <functional>
#include <numeric>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace shm::exodus_files {

struct Options {
  int mode = EX_LARGE_MODEL;
  int real_bytes = 8;  // size in bytes of a floating-point number in the file
  int name_length = 32;
  int deflate_level = 0;
  bool shuffle = false;
  int steps = 3;
};

inline constexpr std::size_t kSide = 4;  // number of hexahedra along each edge of the grid
inline constexpr std::size_t kNodes = (kSide + 1) * (kSide + 1) * (kSide + 1);
inline constexpr std::size_t kFaces = 20 + 10 + 12, kEdges = 14 + 6;

struct ElementKind {
  const char* topology;
  int nodes, elements, edges, faces, attributes;
};
// The blocks of the file. The first two blocks contain the hexahedra of the grid. The number of
// nodes or faces of NSIDED and NFACED elements varies from element to element. A block of 0
// elements is a null block.
inline constexpr std::array<ElementKind, 30> kKinds{
    {{"HEX8", 8, 40, 12, 6, 3},     {"hex", 8, 24, 0, 0, 0},     {"HEX20", 20, 3, 0, 0, 1},
     {"HEX27", 27, 3, 0, 0, 0},     {"HEX9", 9, 2, 0, 0, 0},     {"TETRA4", 4, 5, 0, 0, 0},
     {"TETRA10", 10, 4, 0, 0, 0},   {"TETRA14", 14, 2, 0, 0, 0}, {"WEDGE6", 6, 3, 0, 0, 0},
     {"WEDGE15", 15, 3, 0, 0, 0},   {"WEDGE18", 18, 3, 0, 0, 0}, {"PYRAMID5", 5, 3, 0, 0, 0},
     {"PYRAMID13", 13, 3, 0, 0, 0}, {"QUAD4", 4, 3, 0, 0, 2},    {"QUAD8", 8, 3, 0, 0, 0},
     {"QUAD9", 9, 3, 0, 0, 0},      {"SHELL4", 4, 3, 0, 0, 1},   {"SHELL8", 8, 2, 0, 0, 1},
     {"SHELL3", 3, 3, 0, 0, 1},     {"TRI3", 3, 4, 0, 0, 0},     {"TRI6", 6, 4, 0, 0, 0},
     {"BAR2", 2, 4, 0, 0, 1},       {"BEAM3", 3, 4, 0, 0, 7},    {"TRUSS", 2, 2, 0, 0, 1},
     {"SPHERE", 1, 5, 0, 0, 2},     {"SUPER", 40, 2, 0, 0, 0},   {"NULL", 0, 0, 0, 0, 0},
     {"nsided", 0, 9, 0, 0, 1},     {"nfaced", 0, 7, 0, 0, 2},   {"NFACED", 0, 5, 0, 0, 0}}};

// Writes the file. Reports errors as failures of the test.
class Maker {
 public:
  Maker(const std::string& path, const Options& options) : options_(options), random_(7) {
    wide_ = (options.mode & EX_ALL_INT64_DB) != 0;
    write(path);
  }
  // Returns the id of block or set number i; `base` differs from kind to kind. If the file stores
  // 64-bit integers, every second id needs more than 32 bits.
  std::int64_t id(std::int64_t i, std::int64_t base) const {
    return base + i * 3 + (wide_ && i % 2 == 0 ? std::int64_t{1} << 40 : 0);
  }

 private:
  using Numbers = std::vector<std::int64_t>;
  void good(int status, const char* what) {
    if (status < 0) ADD_FAILURE() << what << " fails: " << status;
  }
#define SHM_EX(call) good((call), #call)

  std::string name(const std::string& stem) const {
    std::string text = stem;
    while (text.size() + 12 < static_cast<std::size_t>(options_.name_length) && text.size() < 200)
      text += "_and_more";
    return text;
  }
  // Calls `use` with an array of `count` generated names, in the form that libexodusii expects.
  void with_names(const std::string& stem, std::size_t count,
                  const std::function<void(char**)>& use) const {
    std::vector<std::string> names;
    std::vector<char*> pointers;
    for (std::size_t i = 0; i < count; ++i) names.push_back(name(stem + std::to_string(i + 1)));
    for (std::string& text : names) pointers.push_back(text.data());
    use(pointers.data());
  }
  std::vector<double> reals(std::size_t count) {
    std::vector<double> values(count);
    for (double& value : values) value = std::uniform_real_distribution<double>(-1e3, 1e3)(random_);
    return values;
  }
  Numbers any_of(std::size_t count, std::size_t most, bool distinct = true) {
    Numbers all(most);
    std::iota(all.begin(), all.end(), 1);
    std::shuffle(all.begin(), all.end(), random_);
    if (!distinct)
      for (std::int64_t& number : all)
        number = std::uniform_int_distribution<std::int64_t>(
            1, static_cast<std::int64_t>(most))(random_);
    all.resize(count);
    return all;
  }

  void write(const std::string& path) {
    ex_opts(0);  // otherwise the library prints errors
    int memory = 8, file = options_.real_bytes;
    exoid_ = ex_create(path.c_str(), EX_CLOBBER | options_.mode, &memory, &file);
    ASSERT_GE(exoid_, 0);
    ex_set_int64_status(exoid_, EX_ALL_INT64_API | (options_.mode & EX_ALL_INT64_DB));
    ex_set_max_name_length(exoid_, options_.name_length);
    if (options_.deflate_level > 0)
      ex_set_option(exoid_, EX_OPT_COMPRESSION_LEVEL, options_.deflate_level);
    if (options_.shuffle) ex_set_option(exoid_, EX_OPT_COMPRESSION_SHUFFLE, 1);
    for (const ElementKind& kind : kKinds) elements_ += static_cast<std::size_t>(kind.elements);
    put_sizes();
    put_nodes();
    put_edge_and_face_blocks();
    put_element_blocks();
    put_sets();
    put_maps();
    put_records();
    put_variables();
    SHM_EX(ex_close(exoid_));
  }

  void put_sizes() {
    ex_init_params init{};
    std::strcpy(init.title, "everything, at once");
    init.num_dim = 3;
    init.num_nodes = kNodes;
    init.num_elem = static_cast<std::int64_t>(elements_);
    init.num_elem_blk = kKinds.size();
    init.num_edge = kEdges;
    init.num_edge_blk = 2;
    init.num_face = kFaces;
    init.num_face_blk = 3;
    init.num_node_sets = init.num_side_sets = init.num_elem_sets = 3;
    init.num_edge_sets = init.num_face_sets = 3;
    init.num_node_maps = init.num_elem_maps = init.num_edge_maps = init.num_face_maps = 2;
    SHM_EX(ex_put_init_ext(exoid_, &init));
  }

  // Writes the nodes of the grid in random order.
  void put_nodes() {
    node_at_.resize(kNodes);
    std::iota(node_at_.begin(), node_at_.end(), 0);
    std::shuffle(node_at_.begin(), node_at_.end(), random_);
    std::array<std::vector<double>, 3> xyz;
    for (auto& axis : xyz) axis.resize(kNodes);
    for (std::size_t i = 0; i < kNodes; ++i) {
      const std::array<std::size_t, 3> at{i % (kSide + 1), i / (kSide + 1) % (kSide + 1),
                                          i / (kSide + 1) / (kSide + 1)};
      for (std::size_t c = 0; c < 3; ++c) xyz[c][node_at_[i]] = static_cast<double>(at[c]) / 3;
    }
    SHM_EX(ex_put_coord(exoid_, xyz[0].data(), xyz[1].data(), xyz[2].data()));
    with_names("axis", 3, [&](char** names) { SHM_EX(ex_put_coord_names(exoid_, names)); });
    put_attributes(EX_NODAL, 0, kNodes, 2, "nodal");
  }

  void put_attributes(ex_entity_type kind, std::int64_t of, std::size_t entries, int count,
                      const std::string& stem) {
    if (count == 0 || entries == 0) return;
    if (kind == EX_NODAL || kind == EX_NODE_SET || kind == EX_SIDE_SET || kind == EX_ELEM_SET ||
        kind == EX_EDGE_SET || kind == EX_FACE_SET)
      SHM_EX(ex_put_attr_param(exoid_, kind, of, count));
    SHM_EX(ex_put_attr(exoid_, kind, of, reals(entries * static_cast<std::size_t>(count)).data()));
    with_names(stem + "_attribute", static_cast<std::size_t>(count),
               [&](char** names) { SHM_EX(ex_put_attr_names(exoid_, kind, of, names)); });
  }

  void put_edge_and_face_blocks() {
    for (int b = 0; b < 2; ++b) {
      const std::size_t edges = b == 0 ? 14 : 6, nodes = b == 0 ? 2 : 3;
      SHM_EX(ex_put_block(exoid_, EX_EDGE_BLOCK, id(b, 500), b == 0 ? "EDGE2" : "EDGE3",
                          static_cast<std::int64_t>(edges), static_cast<std::int64_t>(nodes), 0, 0,
                          b + 1));
      SHM_EX(ex_put_conn(exoid_, EX_EDGE_BLOCK, id(b, 500),
                         any_of(edges * nodes, kNodes, false).data(), nullptr, nullptr));
      put_attributes(EX_EDGE_BLOCK, id(b, 500), edges, b + 1, "edge");
    }
    const std::array<std::size_t, 3> faces{20, 10, 12}, nodes{4, 3, 0};
    for (std::size_t b = 0; b < 3; ++b) {
      const std::int64_t block = id(static_cast<std::int64_t>(b), 600);
      std::vector<int> sizes(faces[b]);
      for (std::size_t i = 0; i < faces[b]; ++i) sizes[i] = 3 + static_cast<int>(i % 4);
      const bool varies = nodes[b] == 0;
      const std::size_t total =
          varies ? static_cast<std::size_t>(std::accumulate(sizes.begin(), sizes.end(), 0))
                 : faces[b] * nodes[b];
      SHM_EX(ex_put_block(exoid_, EX_FACE_BLOCK, block,
                          varies ? "nsided" : (nodes[b] == 4 ? "QUAD4" : "TRI3"),
                          static_cast<std::int64_t>(faces[b]),
                          static_cast<std::int64_t>(varies ? total : nodes[b]), 0, 0, 1));
      SHM_EX(ex_put_conn(exoid_, EX_FACE_BLOCK, block, any_of(total, kNodes).data(), nullptr,
                         nullptr));
      if (varies)
        SHM_EX(ex_put_entity_count_per_polyhedra(exoid_, EX_FACE_BLOCK, block, sizes.data()));
      put_attributes(EX_FACE_BLOCK, block, faces[b], 1, "face");
    }
    with_names("edges", 2, [&](char** n) { SHM_EX(ex_put_names(exoid_, EX_EDGE_BLOCK, n)); });
    with_names("faces", 3, [&](char** n) { SHM_EX(ex_put_names(exoid_, EX_FACE_BLOCK, n)); });
  }

  Numbers grid_hexahedra() {
    std::vector<std::array<std::int64_t, 8>> cells;
    const std::size_t row = kSide + 1, layer = row * row;
    for (std::size_t i = 0; i < kSide * kSide * kSide; ++i) {
      const std::size_t a = i % kSide + i / kSide % kSide * row + i / kSide / kSide * layer;
      const std::array<std::size_t, 8> at{
          a,         a + 1,         a + row + 1,         a + row,
          a + layer, a + layer + 1, a + layer + row + 1, a + layer + row};
      std::array<std::int64_t, 8> cell{};
      for (std::size_t c = 0; c < 8; ++c) cell[c] = static_cast<std::int64_t>(node_at_[at[c]]) + 1;
      cells.push_back(cell);
    }
    std::shuffle(cells.begin(), cells.end(), random_);
    Numbers nodes;
    for (const auto& cell : cells) nodes.insert(nodes.end(), cell.begin(), cell.end());
    return nodes;
  }

  void put_element_blocks() {
    const Numbers grid = grid_hexahedra();
    for (std::size_t b = 0; b < kKinds.size(); ++b) {
      const ElementKind& kind = kKinds[b];
      const std::int64_t block = id(static_cast<std::int64_t>(b), 10);
      const auto elements = static_cast<std::size_t>(kind.elements);
      const bool polygons = std::strcmp(kind.topology, "nsided") == 0;
      const bool polyhedra = !polygons && kind.nodes == 0 && elements > 0;
      std::vector<int> sizes(elements);
      for (std::size_t i = 0; i < elements; ++i) sizes[i] = 3 + static_cast<int>(i * 5 % 4);
      const int total = std::accumulate(sizes.begin(), sizes.end(), 0);
      SHM_EX(ex_put_block(exoid_, EX_ELEM_BLOCK, block, kind.topology, kind.elements,
                          polygons ? total : kind.nodes, kind.edges, polyhedra ? total : kind.faces,
                          kind.attributes));
      if (elements == 0) continue;
      Numbers nodes, edges, faces;
      if (b < 2)
        nodes.assign(grid.begin() + (b == 0 ? 0 : 40 * 8),
                     b == 0 ? grid.begin() + 40 * 8 : grid.end());
      for (std::size_t i = 0; i < elements && b >= 2; ++i)
        for (const std::int64_t node :
             any_of(static_cast<std::size_t>(polygons ? sizes[i] : kind.nodes), kNodes))
          nodes.push_back(node);
      for (int i = 0; i < kind.elements * kind.edges; ++i) edges.push_back(any_of(1, kEdges)[0]);
      for (int i = 0; i < (polyhedra ? total : kind.elements * kind.faces); ++i)
        faces.push_back(any_of(1, kFaces)[0]);
      SHM_EX(ex_put_conn(exoid_, EX_ELEM_BLOCK, block, nodes.empty() ? nullptr : nodes.data(),
                         edges.empty() ? nullptr : edges.data(),
                         faces.empty() ? nullptr : faces.data()));
      if (polygons || polyhedra)
        SHM_EX(ex_put_entity_count_per_polyhedra(exoid_, EX_ELEM_BLOCK, block, sizes.data()));
      put_attributes(EX_ELEM_BLOCK, block, elements, kind.attributes, "element");
    }
    with_names("block", kKinds.size(),
               [&](char** n) { SHM_EX(ex_put_names(exoid_, EX_ELEM_BLOCK, n)); });
    for (std::size_t b = 0; b < kKinds.size(); b += 2)
      SHM_EX(ex_put_prop(exoid_, EX_ELEM_BLOCK, id(static_cast<std::int64_t>(b), 10), "MATERIAL",
                         static_cast<std::int64_t>(b + 1)));
  }

  void put_sets() {
    struct Kind {
      ex_entity_type type;
      std::int64_t base;
      std::size_t most;
      bool second;  // true if each entry of the set also has a side number or an orientation
      const char* stem;
    };
    const std::array<Kind, 5> kinds{{{EX_NODE_SET, 1000, kNodes, false, "nodes"},
                                     {EX_SIDE_SET, 2000, elements_, true, "sides"},
                                     {EX_ELEM_SET, 3000, elements_, false, "elements"},
                                     {EX_EDGE_SET, 4000, kEdges, true, "edge_set"},
                                     {EX_FACE_SET, 5000, kFaces, true, "face_set"}}};
    for (const Kind& kind : kinds) {
      for (int i = 0; i < 3; ++i) {
        const std::int64_t set = id(i, kind.base);
        const std::size_t entries = i == 1 ? 0 : 5 + static_cast<std::size_t>(i) * 3;
        const std::size_t factors = i == 0 ? entries : 0;
        SHM_EX(ex_put_set_param(exoid_, kind.type, set, static_cast<std::int64_t>(entries),
                                static_cast<std::int64_t>(factors)));
        if (entries == 0) continue;
        Numbers second(entries);
        for (std::size_t k = 0; k < entries; ++k) second[k] = 1 + static_cast<std::int64_t>(k % 6);
        SHM_EX(ex_put_set(exoid_, kind.type, set, any_of(entries, kind.most).data(),
                          kind.second ? second.data() : nullptr));
        if (factors > 0)
          SHM_EX(ex_put_set_dist_fact(exoid_, kind.type, set, reals(factors).data()));
        put_attributes(kind.type, set, entries, 1 + i / 2, kind.stem);
        SHM_EX(ex_put_prop(exoid_, kind.type, set, "COLOUR", 40 + i));
      }
      with_names(kind.stem, 3, [&](char** n) { SHM_EX(ex_put_names(exoid_, kind.type, n)); });
    }
  }

  void put_maps() {
    struct Kind {
      ex_entity_type type;
      std::size_t entries;
      const char* stem;
    };
    const std::array<Kind, 4> kinds{{{EX_NODE_MAP, kNodes, "node_map"},
                                     {EX_ELEM_MAP, elements_, "elem_map"},
                                     {EX_EDGE_MAP, kEdges, "edge_map"},
                                     {EX_FACE_MAP, kFaces, "face_map"}}};
    for (const Kind& kind : kinds) {
      Numbers map(kind.entries);
      std::iota(map.begin(), map.end(), wide_ ? std::int64_t{1} << 33 : 70000);
      SHM_EX(ex_put_id_map(exoid_, kind.type, map.data()));
      for (std::int64_t i = 0; i < 2; ++i) {
        std::reverse(map.begin(), map.end());
        SHM_EX(ex_put_num_map(exoid_, kind.type, 30 + i, map.data()));
      }
      with_names(kind.stem, 2, [&](char** n) { SHM_EX(ex_put_names(exoid_, kind.type, n)); });
    }
  }

  void put_records() {
    char code[] = "maker", version[] = "1.0", date[] = "today", hour[] = "noon", code2[] = "other";
    char* qa[2][4] = {{code, version, date, hour}, {code2, version, date, hour}};
    SHM_EX(ex_put_qa(exoid_, 2, qa));
    with_names("information", 3, [&](char** lines) { SHM_EX(ex_put_info(exoid_, 3, lines)); });
    const Numbers frames{7, 9};
    SHM_EX(ex_put_coordinate_frames(exoid_, 2, frames.data(), reals(18).data(), "rc"));
  }

  void put_variables() {
    struct Kind {
      ex_entity_type type;
      std::int64_t base;
      std::vector<std::size_t> entries;  // number of entries of each block or set
      const char* stem;
    };
    std::vector<std::size_t> blocks;
    for (const ElementKind& kind : kKinds)
      blocks.push_back(static_cast<std::size_t>(kind.elements));
    const std::vector<Kind> kinds{
        {EX_ELEM_BLOCK, 10, blocks, "element"},     {EX_EDGE_BLOCK, 500, {14, 6}, "edge"},
        {EX_FACE_BLOCK, 600, {20, 10, 12}, "face"}, {EX_NODE_SET, 1000, {5, 0, 11}, "nset"},
        {EX_SIDE_SET, 2000, {5, 0, 11}, "sset"},    {EX_ELEM_SET, 3000, {5, 0, 11}, "elset"},
        {EX_EDGE_SET, 4000, {5, 0, 11}, "eset"},    {EX_FACE_SET, 5000, {5, 0, 11}, "fset"}};
    const auto covers = [](const Kind& kind, std::size_t block, int variable) {
      return kind.entries[block] > 0 && (variable == 1 || block % 2 == 0);
    };
    const auto define = [&](ex_entity_type type, int count, const std::string& stem) {
      SHM_EX(ex_put_variable_param(exoid_, type, count));
      with_names(stem + "_variable", static_cast<std::size_t>(count),
                 [&](char** n) { SHM_EX(ex_put_variable_names(exoid_, type, count, n)); });
    };
    define(EX_GLOBAL, 4, "global");
    define(EX_NODAL, 3, "nodal");
    for (const Kind& kind : kinds) {
      define(kind.type, 2, kind.stem);
      std::vector<int> table;
      for (std::size_t b = 0; b < kind.entries.size(); ++b)
        for (int v = 1; v <= 2; ++v) table.push_back(covers(kind, b, v));
      SHM_EX(ex_put_truth_table(exoid_, kind.type, static_cast<int>(kind.entries.size()), 2,
                                table.data()));
    }
    for (int step = 1; step <= options_.steps; ++step) {
      const double time = step / 3.0;
      SHM_EX(ex_put_time(exoid_, step, &time));
      SHM_EX(ex_put_var(exoid_, step, EX_GLOBAL, 1, 1, 4, reals(4).data()));
      for (int v = 1; v <= 3; ++v)
        SHM_EX(ex_put_var(exoid_, step, EX_NODAL, v, 1, kNodes, reals(kNodes).data()));
      for (const Kind& kind : kinds)
        for (std::size_t b = 0; b < kind.entries.size(); ++b)
          for (int v = 1; v <= 2; ++v)
            if (covers(kind, b, v))
              SHM_EX(ex_put_var(
                  exoid_, step, kind.type, v, id(static_cast<std::int64_t>(b), kind.base),
                  static_cast<std::int64_t>(kind.entries[b]), reals(kind.entries[b]).data()));
    }
  }
#undef SHM_EX

  Options options_;
  std::mt19937 random_;
  bool wide_ = false;
  int exoid_ = -1;
  std::size_t elements_ = 0;
  std::vector<std::size_t> node_at_;  // for each node of the grid: its index in the file
};

// Describes the contents of an Exodus file as libexodusII reads it, with one sentence per item. The
// sentences refer to nodes and elements by the ids in the maps of the file. They refer to faces,
// edges and sets by position, because the order of these items must not change.
class Teller {
 public:
  explicit Teller(const std::string& path) {
    int memory = 8, file = 0;
    float version = 0;
    exoid_ = ex_open(path.c_str(), EX_READ, &memory, &file, &version);
    if (exoid_ < 0) {
      ADD_FAILURE() << "libexodusII cannot open " << path;
      return;
    }
    ex_set_int64_status(exoid_, EX_ALL_INT64_API);
    tell();
    ex_close(exoid_);
  }
  std::multiset<std::string> sentences;

 private:
  using Numbers = std::vector<std::int64_t>;
  template <class... Parts>
  void say(const Parts&... parts) {
    std::ostringstream text;
    text.precision(17);
    ((text << parts << ' '), ...);
    sentences.insert(text.str());
  }
  template <class T>
  static std::string list(const std::vector<T>& values, std::size_t first, std::size_t count) {
    std::ostringstream text;
    text.precision(17);
    for (std::size_t i = first; i < first + count; ++i) text << ' ' << values.at(i);
    return text.str();
  }
  std::string nodes_of(const Numbers& nodes, std::size_t first, std::size_t count) const {
    Numbers ids;
    for (std::size_t i = first; i < first + count; ++i)
      ids.push_back(node_ids_.at(static_cast<std::size_t>(nodes.at(i) - 1)));
    return list(ids, 0, count);
  }
  Numbers ids_of(ex_entity_type kind, ex_inquiry count) const {
    Numbers ids(static_cast<std::size_t>(ex_inquire_int(exoid_, count)));
    if (!ids.empty()) ex_get_ids(exoid_, kind, ids.data());
    return ids;
  }
  std::vector<double> values_of(ex_entity_type kind, int step, int variable, std::int64_t of,
                                std::size_t count) const {
    std::vector<double> values(count, -12345);
    ex_get_var(exoid_, step, kind, variable, of, static_cast<std::int64_t>(count), values.data());
    return values;
  }

  void tell() {
    node_ids_.resize(kNodes);
    element_ids_.resize(static_cast<std::size_t>(ex_inquire_int(exoid_, EX_INQ_ELEM)));
    ex_get_id_map(exoid_, EX_NODE_MAP, node_ids_.data());
    ex_get_id_map(exoid_, EX_ELEM_MAP, element_ids_.data());
    steps_ = static_cast<int>(ex_inquire_int(exoid_, EX_INQ_TIME));
    tell_nodes();
    tell_elements();
    tell_entities(EX_EDGE_BLOCK, EX_INQ_EDGE_BLK);
    tell_entities(EX_FACE_BLOCK, EX_INQ_FACE_BLK);
    tell_sets(EX_NODE_SET, EX_INQ_NODE_SETS);
    tell_sets(EX_SIDE_SET, EX_INQ_SIDE_SETS);
    tell_sets(EX_ELEM_SET, EX_INQ_ELEM_SETS);
    tell_sets(EX_EDGE_SET, EX_INQ_EDGE_SETS);
    tell_sets(EX_FACE_SET, EX_INQ_FACE_SETS);
  }

  void tell_nodes() {
    std::array<std::vector<double>, 3> xyz;
    for (auto& axis : xyz) axis.resize(kNodes);
    ex_get_coord(exoid_, xyz[0].data(), xyz[1].data(), xyz[2].data());
    std::vector<double> attributes(2 * kNodes);
    ex_get_attr(exoid_, EX_NODAL, 0, attributes.data());
    Numbers map(kNodes);
    ex_get_num_map(exoid_, EX_NODE_MAP, 31, map.data());
    for (std::size_t i = 0; i < kNodes; ++i)
      say("node", node_ids_[i], xyz[0][i], xyz[1][i], xyz[2][i], list(attributes, 2 * i, 2),
          map[i]);
    for (int step = 1; step <= steps_; ++step)
      for (int v = 1; v <= 3; ++v) {
        const auto values = values_of(EX_NODAL, step, v, 1, kNodes);
        for (std::size_t i = 0; i < kNodes; ++i) say("nodal", step, v, node_ids_[i], values[i]);
      }
  }

  void tell_elements() {
    std::size_t first = 0;
    Numbers map(element_ids_.size());
    ex_get_num_map(exoid_, EX_ELEM_MAP, 30, map.data());
    for (const std::int64_t id : ids_of(EX_ELEM_BLOCK, EX_INQ_ELEM_BLK)) {
      ex_block block{};
      block.id = id;
      block.type = EX_ELEM_BLOCK;
      ex_get_block_param(exoid_, &block);
      const auto elements = static_cast<std::size_t>(block.num_entry);
      if (elements > 0) tell_block(block, first);
      for (std::size_t i = 0; i < elements; ++i)
        say("element", element_ids_[first + i], "of", id, "map", map[first + i]);
      first += elements;
    }
  }
  void tell_block(const ex_block& block, std::size_t first) {
    const auto elements = static_cast<std::size_t>(block.num_entry);
    const std::string type = block.topology;
    const bool polygons = type == "nsided", polyhedra = type == "nfaced" || type == "NFACED";
    std::vector<int> sizes(elements, static_cast<int>(block.num_nodes_per_entry));
    std::vector<int> face_sizes(elements, static_cast<int>(block.num_faces_per_entry));
    if (polygons) ex_get_entity_count_per_polyhedra(exoid_, EX_ELEM_BLOCK, block.id, sizes.data());
    if (polyhedra)
      ex_get_entity_count_per_polyhedra(exoid_, EX_ELEM_BLOCK, block.id, face_sizes.data());
    const auto total = [](const std::vector<int>& list) {
      return static_cast<std::size_t>(std::accumulate(list.begin(), list.end(), 0));
    };
    const auto edges = static_cast<std::size_t>(block.num_edges_per_entry);
    const auto attributes = static_cast<std::size_t>(block.num_attribute);
    Numbers nodes(polyhedra ? 0 : total(sizes)), edge(elements * edges), face(total(face_sizes));
    ex_get_conn(exoid_, EX_ELEM_BLOCK, block.id, nodes.empty() ? nullptr : nodes.data(),
                edge.empty() ? nullptr : edge.data(), face.empty() ? nullptr : face.data());
    std::vector<double> attribute(elements * attributes);
    if (attributes > 0) ex_get_attr(exoid_, EX_ELEM_BLOCK, block.id, attribute.data());
    std::size_t node_at = 0, face_at = 0;
    for (std::size_t i = 0; i < elements; ++i) {
      const auto size = static_cast<std::size_t>(polyhedra ? 0 : sizes[i]);
      const auto faces = static_cast<std::size_t>(face_sizes[i]);
      say("element", element_ids_[first + i], "nodes", nodes_of(nodes, node_at, size), "edges",
          list(edge, i * edges, edges), "faces", list(face, face_at, faces), "attributes",
          list(attribute, i * attributes, attributes));
      node_at += size;
      face_at += faces;
    }
    for (int step = 1; step <= steps_; ++step)
      for (int v = 1; v <= 2; ++v) {
        const auto values = values_of(EX_ELEM_BLOCK, step, v, block.id, elements);
        for (std::size_t i = 0; i < elements; ++i)
          say("elemental", step, v, element_ids_[first + i], values[i]);
      }
  }

  void tell_entities(ex_entity_type kind, ex_inquiry inquiry) {
    for (const std::int64_t id : ids_of(kind, inquiry)) {
      ex_block block{};
      block.id = id;
      block.type = kind;
      ex_get_block_param(exoid_, &block);
      const auto entries = static_cast<std::size_t>(block.num_entry);
      std::vector<int> sizes(entries, static_cast<int>(block.num_nodes_per_entry));
      if (std::string(block.topology) == "nsided")
        ex_get_entity_count_per_polyhedra(exoid_, kind, id, sizes.data());
      Numbers nodes(static_cast<std::size_t>(std::accumulate(sizes.begin(), sizes.end(), 0)));
      ex_get_conn(exoid_, kind, id, nodes.data(), nullptr, nullptr);
      say("block", int(kind), id, nodes_of(nodes, 0, nodes.size()), list(sizes, 0, entries),
          list(values_of(kind, 1, 1, id, entries), 0, entries));
    }
  }
  void tell_sets(ex_entity_type kind, ex_inquiry inquiry) {
    for (const std::int64_t id : ids_of(kind, inquiry)) {
      std::int64_t entries = 0, factors = 0;
      ex_get_set_param(exoid_, kind, id, &entries, &factors);
      Numbers members(static_cast<std::size_t>(entries)), second(members.size());
      std::vector<double> factor(static_cast<std::size_t>(factors));
      const bool pairs = kind != EX_NODE_SET && kind != EX_ELEM_SET;
      if (entries > 0)
        ex_get_set(exoid_, kind, id, members.data(), pairs ? second.data() : nullptr);
      if (factors > 0) ex_get_set_dist_fact(exoid_, kind, id, factor.data());
      for (std::int64_t& member : members)
        if (kind == EX_NODE_SET || kind == EX_SIDE_SET || kind == EX_ELEM_SET)
          member = (kind == EX_NODE_SET ? node_ids_ : element_ids_)
                       .at(static_cast<std::size_t>(member - 1));
      say("set", int(kind), id, list(members, 0, members.size()), list(second, 0, second.size()),
          list(factor, 0, factor.size()),
          entries > 0 ? list(values_of(kind, 1, 1, id, members.size()), 0, members.size()) : "");
    }
  }

  int exoid_ = -1, steps_ = 0;
  Numbers node_ids_, element_ids_;
};

}  // namespace shm::exodus_files
