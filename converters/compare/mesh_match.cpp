#include "compare/mesh_match.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <unordered_map>
#include <utility>

#include "base/failure.h"
#include "compare/coincident_vertices.h"
#include "mesh/cell_keys.h"
#include "mesh/cell_rotations.h"
#include "mesh/cell_table.h"

namespace shm::converters {
namespace {

constexpr std::uint32_t kNone = MeshMatch::kNone;

CellTable table_of(MeshSource& mesh, const Progress& progress) {
  std::optional<CellTable> table = CellTable::read(mesh, progress);
  if (!table) throw Failure(ErrorCode::over_limit, "has too many vertices or cells to be matched");
  return std::move(*table);
}

// Key and number of a cell.
struct Keyed {
  std::uint64_t key;
  std::uint32_t cell;
  bool operator<(const Keyed& other) const {
    return key != other.key ? key < other.key : cell < other.cell;
  }
};

// One of the two meshes.
struct Side {
  Side(MeshSource& mesh, const std::vector<std::uint32_t>& classes, const Progress& progress)
      : info(mesh.info()), cells(table_of(mesh, progress)), class_of_block(classes) {}

  CellShape shape(std::uint32_t cell) const { return info.schema.blocks[cells.block(cell)].shape; }

  const MeshInfo& info;
  const CellTable cells;
  const std::vector<std::uint32_t>& class_of_block;
  std::vector<std::uint32_t> site;           // site (point in space) of each vertex
  std::vector<std::uint32_t> left_at;        // number of unmatched vertices at each site
  std::vector<std::uint32_t>* to = nullptr;  // counterpart of each vertex, or kNone
  std::vector<std::uint32_t>* cell_to = nullptr;
  // Data about the unmatched cells and vertices: the cells that use each vertex, the vertices at
  // each site (point in space), and the key (hash) of each cell.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> users;    // (vertex, cell), ascending
  std::vector<std::pair<std::uint32_t, std::uint32_t>> waiting;  // (site, vertex), ascending
  std::unordered_map<std::uint32_t, std::uint64_t> key_of;       // key of each cell
};

class Matcher {
 public:
  Matcher(MeshSource& a, MeshSource& b, const MatchRules& rules, const Progress& progress)
      : progress_(progress), a_(a, rules.class_a, progress), b_(b, rules.class_b, progress) {
    result_.vertex.assign(a_.info.vertices, kNone);
    result_.vertex_of_b.assign(b_.info.vertices, kNone);
    result_.cell.assign(a_.cells.size(), kNone);
    result_.cell_of_b.assign(b_.cells.size(), kNone);
    a_.to = &result_.vertex;
    b_.to = &result_.vertex_of_b;
    a_.cell_to = &result_.cell;
    b_.cell_to = &result_.cell_of_b;
    show("finding vertices at the same place");
    CoincidentVertices sites = find_coincident(a, b, rules.tolerance);
    a_.site = std::move(sites.of_a);
    b_.site = std::move(sites.of_b);
    one_sided_.assign(sites.count, false);
    for (Side* side : {&a_, &b_}) {
      side->left_at.assign(sites.count, 0);
      for (const std::uint32_t site : side->site) ++side->left_at[site];
    }
  }

  MeshMatch run() {
    match_lone_vertices();
    show("matching cells");
    match_all_cells();
    match_rest_by_cells();
    match_rest_in_order();
    match_cells_of_same_vertices();
    return std::move(result_);
  }

 private:
  // Returns the "name" of a vertex: a number from which keys (hashes) of cells are computed. The
  // name of a matched vertex is its number in A. The name of an unmatched vertex is derived from
  // its site. If the other mesh has no unmatched vertex at that site, the name is kNowhere.
  static constexpr std::uint64_t kNowhere = ~std::uint64_t{0};
  std::uint64_t name_of(const Side& side, std::uint32_t vertex) const {
    const std::uint32_t other = (*side.to)[vertex];
    if (other != kNone) return &side == &a_ ? vertex : other;  // the number of the vertex in A
    const std::uint32_t site = side.site[vertex];
    if (is_one_sided(site)) return kNowhere;
    return (std::uint64_t{1} << 32) + site;
  }
  bool is_one_sided(std::uint32_t site) const {
    return a_.left_at[site] == 0 || b_.left_at[site] == 0;
  }
  void name_nodes(const Side& side, std::uint32_t cell, std::vector<std::uint64_t>& names) const {
    names.clear();
    for (const std::uint32_t vertex : side.cells.cell(cell)) names.push_back(name_of(side, vertex));
  }
  std::uint64_t key_of(const Side& side, std::uint32_t cell) {
    name_nodes(side, cell, names_);
    make_canonical(side.shape(cell), names_);
    return hash_of(side.class_of_block[side.cells.block(cell)], names_);
  }

  void show(const char* phase) const {
    if (progress_) progress_(phase, 0, 1);
  }

  void match_vertices(std::uint32_t a, std::uint32_t b) {
    result_.vertex[a] = b;
    result_.vertex_of_b[b] = a;
    --a_.left_at[a_.site[a]];
    --b_.left_at[b_.site[b]];
    ++result_.matched_vertices;
  }
  void match_lone_vertices() {
    // If each mesh has exactly one unmatched vertex at site s, lone[s] is that vertex of A.
    // Otherwise lone[s] is kNone.
    std::vector<std::uint32_t> lone(a_.left_at.size(), kNone);
    for (std::uint32_t v = 0; v < a_.site.size(); ++v)
      if (a_.left_at[a_.site[v]] == 1 && b_.left_at[a_.site[v]] == 1) lone[a_.site[v]] = v;
    for (std::uint32_t v = 0; v < b_.site.size(); ++v)
      if (lone[b_.site[v]] != kNone) match_vertices(lone[b_.site[v]], v);
  }

  template <class KeyOf>
  std::vector<Keyed> keys_of_unmatched(const Side& side, KeyOf&& key) {
    std::vector<Keyed> keys;
    for (std::uint32_t cell = 0; cell < side.cells.size(); ++cell)
      if ((*side.cell_to)[cell] == kNone) keys.push_back({key(side, cell), cell});
    std::sort(keys.begin(), keys.end());
    return keys;
  }

  // Calls visit(a, b) for each key that occurs among the unmatched cells of both meshes: `a` and
  // `b` are the unmatched cells of A and of B with this key.
  template <class KeyOf, class Visit>
  void join(KeyOf&& key, Visit&& visit) {
    const std::vector<Keyed> a = keys_of_unmatched(a_, key), b = keys_of_unmatched(b_, key);
    const auto end_of = [](const std::vector<Keyed>& list, std::size_t begin) {
      std::size_t end = begin;
      while (end < list.size() && list[end].key == list[begin].key) ++end;
      return end;
    };
    for (std::size_t i = 0, k = 0; i < a.size() && k < b.size();) {
      const std::size_t end_a = end_of(a, i), end_b = end_of(b, k);
      if (a[i].key == b[k].key)
        visit(std::span(a).subspan(i, end_a - i), std::span(b).subspan(k, end_b - k));
      if (a[i].key <= b[k].key) {
        if (a[i].key == b[k].key) k = end_b;
        i = end_a;
      } else {
        k = end_b;
      }
    }
  }

  void match_all_cells() {
    join([this](const Side& side, std::uint32_t cell) { return key_of(side, cell); },
         [this](std::span<const Keyed> a, std::span<const Keyed> b) {
           const bool alone = a.size() == 1 && b.size() == 1;
           if (!alone && !all_matched(a_, a.front().cell)) return;
           for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
             match_cells(a[i].cell, b[i].cell, false);
         });
  }
  bool all_matched(const Side& side, std::uint32_t cell) const {
    const auto nodes = side.cells.cell(cell);
    return std::all_of(nodes.begin(), nodes.end(),
                       [&](std::uint32_t v) { return (*side.to)[v] != kNone; });
  }

  // `names` contains the names of the vertices of a cell. Returns true if at least half of them are
  // known (not kNowhere). Cells with fewer known names cannot be matched.
  bool is_known(std::span<const std::uint64_t> names) const {
    const auto nowhere = std::count(names.begin(), names.end(), kNowhere);
    return 2 * static_cast<std::size_t>(nowhere) <= names.size();
  }

  // Matches two cells that have the same key, and their vertices. To do so, searches for a rotation
  // of cell `a` after which the names of its vertices equal those of cell `b`. Returns false if no
  // such rotation exists. If several rotations are possible and would match different vertices,
  // uses the first one if `any` is true, and returns false otherwise.
  bool match_cells(std::uint32_t a, std::uint32_t b, bool any) {
    std::vector<std::uint64_t> names_a, names_b;
    name_nodes(a_, a, names_a);
    name_nodes(b_, b, names_b);
    if (names_a.size() != names_b.size() || !is_known(names_a)) return false;
    std::vector<std::uint32_t> chosen, nodes;  // vertices of A in the order of B's corners
    const auto consider = [&](auto&& node) {   // returns false if another rotation fits too
      nodes.clear();
      const auto corners = a_.cells.cell(a);
      for (std::size_t i = 0; i < names_b.size(); ++i) {
        if (names_a[node(i)] != names_b[i]) return true;
        nodes.push_back(corners[node(i)]);
      }
      if (!chosen.empty()) return chosen == nodes;
      chosen = nodes;
      return true;
    };
    const CellShape shape = a_.shape(a);
    if (rotates_by_counting(shape)) {
      const std::size_t n = names_a.size();
      const std::size_t by = n == 0 ? 0 : least_rotation(names_a) + n - least_rotation(names_b);
      consider([&](std::size_t i) { return (i + by) % n; });
    } else {
      bool single = consider([](std::size_t i) { return i; });
      for (const Rotation& turn : rotations_of(shape, names_a.size())) {
        if (any && !chosen.empty()) break;
        single = single && consider([&](std::size_t i) { return turn[i]; });
      }
      if (!single && !any) return false;
    }
    if (chosen.empty() && !names_a.empty()) return false;
    take(a, b, chosen);
    return true;
  }

  void take(std::uint32_t a, std::uint32_t b, const std::vector<std::uint32_t>& nodes) {
    link_cells(a, b);
    const auto corners = b_.cells.cell(b);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      if (result_.vertex[nodes[i]] != kNone || result_.vertex_of_b[corners[i]] != kNone) continue;
      match_vertices(nodes[i], corners[i]);
      fresh_.emplace_back(nodes[i], corners[i]);
    }
  }
  void link_cells(std::uint32_t a, std::uint32_t b) {
    result_.cell[a] = b;
    result_.cell_of_b[b] = a;
    ++result_.matched_cells;
  }

  // Matches the remaining cells one by one, together with their vertices. If a key (a hash computed
  // from the names of the vertices of a cell) belongs to exactly one cell of each mesh, these two
  // cells are matched. Their newly matched vertices change the keys of neighbouring cells, so that
  // more cells can be matched. If no such key is left, matches the first cell of A and the first
  // cell of B that have the same key. Several cells of one mesh share a key only if they are copies
  // of each other at the same place, or if the meshes differ.
  void match_rest_by_cells() {
    for (std::uint32_t site = 0; site < one_sided_.size(); ++site)
      one_sided_[site] = is_one_sided(site);
    for (Side* side : {&a_, &b_}) gather_rest(*side);
    fresh_.clear();
    settle();
    for (bool more = true; more;) {
      more = false;
      for (std::uint32_t cell = 0; cell < a_.cells.size(); ++cell) {
        if (result_.cell[cell] != kNone || !a_.key_of.contains(cell)) continue;
        const auto found = buckets_.find(a_.key_of[cell]);
        if (found == buckets_.end() || found->second.b.empty()) continue;
        const std::uint32_t other = *found->second.b.begin();
        if (!match_cells(cell, other, true)) continue;
        forget(cell, other);
        settle();
        more = true;
      }
    }
  }

  void gather_rest(Side& side) {
    for (std::uint32_t cell = 0; cell < side.cells.size(); ++cell) {
      if ((*side.cell_to)[cell] != kNone) continue;
      for (const std::uint32_t v : side.cells.cell(cell)) {
        if ((*side.to)[v] != kNone) continue;
        side.users.emplace_back(v, cell);
        side.waiting.emplace_back(side.site[v], v);
      }
      put(side, cell);
    }
    for (auto* list : {&side.users, &side.waiting}) {
      std::sort(list->begin(), list->end());
      list->erase(std::unique(list->begin(), list->end()), list->end());
    }
  }

  struct Bucket {
    std::set<std::uint32_t> a, b;
  };
  void put(Side& side, std::uint32_t cell) {
    name_nodes(side, cell, names_);
    if (!is_known(names_)) return;
    const std::uint64_t key = key_of(side, cell);
    side.key_of[cell] = key;
    Bucket& bucket = buckets_[key];
    (&side == &a_ ? bucket.a : bucket.b).insert(cell);
    if (bucket.a.size() == 1 && bucket.b.size() == 1) due_.push_back(key);
  }
  void drop(Side& side, std::uint32_t cell) {
    const auto key = side.key_of.find(cell);
    if (key == side.key_of.end()) return;
    Bucket& bucket = buckets_[key->second];
    (&side == &a_ ? bucket.a : bucket.b).erase(cell);
    if (bucket.a.size() == 1 && bucket.b.size() == 1) due_.push_back(key->second);
    if (bucket.a.empty() && bucket.b.empty()) buckets_.erase(key->second);
    side.key_of.erase(key);
  }
  void forget(std::uint32_t a, std::uint32_t b) {
    drop(a_, a);
    drop(b_, b);
  }

  // Matches cells whose key is unique in each mesh, until no such cells are left.
  void settle() {
    while (!due_.empty() || !fresh_.empty()) {
      while (!fresh_.empty()) {
        const auto [a, b] = fresh_.back();
        fresh_.pop_back();
        rename(a_, a);
        rename(b_, b);
        // When at most one mesh still has unmatched vertices at a site, the site becomes one-sided:
        // the name of these vertices is now kNowhere. Recompute the keys of the cells that use
        // them, once per site.
        for (const std::uint32_t site : {a_.site[a], b_.site[b]}) {
          if (one_sided_[site] || !is_one_sided(site)) continue;
          one_sided_[site] = true;
          for (Side* side : {&a_, &b_}) rename_site(*side, site);
        }
      }
      if (due_.empty()) return;
      const std::uint64_t key = due_.back();
      due_.pop_back();
      const auto found = buckets_.find(key);
      if (found == buckets_.end() || found->second.a.size() != 1 || found->second.b.size() != 1)
        continue;
      const std::uint32_t a = *found->second.a.begin(), b = *found->second.b.begin();
      if (match_cells(a, b, false)) forget(a, b);
    }
  }
  // Recomputes the keys of the unmatched cells that use `vertex`.
  void rename(Side& side, std::uint32_t vertex) {
    auto user = std::lower_bound(side.users.begin(), side.users.end(),
                                 std::pair<std::uint32_t, std::uint32_t>(vertex, 0));
    for (; user != side.users.end() && user->first == vertex; ++user) {
      if ((*side.cell_to)[user->second] != kNone) continue;
      drop(side, user->second);
      put(side, user->second);
    }
  }
  void rename_site(Side& side, std::uint32_t site) {
    auto each = std::lower_bound(side.waiting.begin(), side.waiting.end(),
                                 std::pair<std::uint32_t, std::uint32_t>(site, 0));
    for (; each != side.waiting.end() && each->first == site; ++each)
      if ((*side.to)[each->second] == kNone) rename(side, each->second);
  }

  // At each site, matches the remaining vertices of A and B in ascending order. Any order would do,
  // because these vertices cannot be distinguished by their cells.
  void match_rest_in_order() {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> left;  // (site, vertex of A)
    for (std::uint32_t v = 0; v < a_.site.size(); ++v)
      if (result_.vertex[v] == kNone && b_.left_at[a_.site[v]] > 0)
        left.emplace_back(a_.site[v], v);
    std::sort(left.begin(), left.end(), std::greater<>());
    // Unmatched vertices of A at each site, in descending order.
    std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> at_site;
    for (const auto& [site, vertex] : left) at_site[site].push_back(vertex);
    for (std::uint32_t v = 0; v < b_.site.size(); ++v) {
      if (result_.vertex_of_b[v] != kNone) continue;
      const auto found = at_site.find(b_.site[v]);
      if (found == at_site.end() || found->second.empty()) continue;
      match_vertices(found->second.back(), v);
      found->second.pop_back();
    }
  }

  // Matches cells that have the same vertices, but in another order or in another block. Such cells
  // are reported as changed.
  void match_cells_of_same_vertices() {
    join(
        [this](const Side& side, std::uint32_t cell) {
          name_nodes(side, cell, names_);
          std::sort(names_.begin(), names_.end());
          // If the name of any vertex is unknown, the cell gets a unique key, so that no other cell
          // matches it.
          const bool known = std::find(names_.begin(), names_.end(), kNowhere) == names_.end();
          return hash_of(known ? 0 : 1 + 2 * std::uint64_t{cell} + (&side == &a_ ? 0 : 1), names_);
        },
        [this](std::span<const Keyed> a, std::span<const Keyed> b) {
          for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
            link_cells(a[i].cell, b[i].cell);
        });
  }

  const Progress& progress_;
  MeshMatch result_;
  Side a_, b_;
  // True for each site at which at most one mesh has unmatched vertices. The keys of cells depend
  // on these flags.
  std::vector<bool> one_sided_;
  std::unordered_map<std::uint64_t, Bucket> buckets_;
  // keys that may now belong to exactly one cell of each mesh, and must still be examined
  std::vector<std::uint64_t> due_;

  // Pairs of vertices that were matched recently.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> fresh_;
  std::vector<std::uint64_t> names_;
};

}  // namespace

MeshMatch match_meshes(MeshSource& a, MeshSource& b, const MatchRules& rules,
                       const Progress& progress) {
  return Matcher(a, b, rules, progress).run();
}

}  // namespace shm::converters
