#include "compare/field_pairs.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <set>
#include <tuple>

#include "formats/formats.h"
#include "interface/format.h"
#include "mesh/cell_cursor.h"

namespace shm::converters {
namespace {

// Usual name of an array that contains block ids.
constexpr std::string_view kBlockIds = "BlockId";

std::vector<std::string> paths_of(const Schema& schema) {
  constexpr std::string_view kPrefix = "array:";
  std::vector<std::string> paths = array_stream_names(schema);
  for (std::string& path : paths) path.erase(0, kPrefix.size());
  return paths;
}

FieldSide whole_side(const ArrayInfo& array, std::size_t index) {
  FieldSide side{{}, array.type, array.per_step, array.blocks};
  for (std::uint32_t c = 0; c < array.components; ++c) side.parts.push_back({index, c});
  return side;
}

class Pairing {
 public:
  Pairing(const MeshInfo& a, const MeshInfo& b, bool one_format, bool with_roles)
      : a_(a),
        b_(b),
        paths_a_(paths_of(a.schema)),
        paths_b_(paths_of(b.schema)),
        one_format_(one_format),
        with_roles_(with_roles) {}

  FieldPairs run() {
    left_a_ = candidates(a_);
    left_b_ = candidates(b_);
    pair_by_name();
    if (!one_format_) {
      pair_numbered(a_, left_a_, b_, left_b_, false);
      pair_numbered(b_, left_b_, a_, left_a_, true);
      pair_components(a_, left_a_, b_, left_b_, false);
      pair_components(b_, left_b_, a_, left_a_, true);
      pair_block_ids(a_, left_a_, b_, false);
      pair_block_ids(b_, left_b_, a_, true);
    }
    for (const std::size_t array : left_a_) found_.only_a.push_back(path_of(a_, array));
    for (const std::size_t array : left_b_) found_.only_b.push_back(path_of(b_, array));
    return std::move(found_);
  }

 private:
  using Arrays = std::set<std::size_t>;  // a set, because removals must be fast even if there are
                                         // very many arrays
  using Name = std::tuple<std::string, Location, std::string>;
  using ByName = std::map<std::pair<std::string, Location>, Arrays>;

  const std::string& path_of(const MeshInfo& info, std::size_t array) const {
    return (&info == &a_ ? paths_a_ : paths_b_)[array];
  }
  static ByName by_name(const MeshInfo& info, const Arrays& arrays) {
    ByName list;
    for (const std::size_t index : arrays) {
      const ArrayInfo& array = info.schema.arrays[index];
      list[{array.name, array.location}].insert(index);
    }
    return list;
  }

  // Returns the arrays of one mesh that are to be paired with arrays of the other. If the formats
  // differ, omits arrays without values, because the other format may not store such arrays, and
  // arrays of the whole mesh and of sets, unless both formats have them.
  Arrays candidates(const MeshInfo& info) const {
    Arrays list;
    for (std::size_t i = 0; i < info.schema.arrays.size(); ++i) {
      const ArrayInfo& array = info.schema.arrays[i];
      const bool empty = info.array_elements(i) == 0 || (array.per_step && info.step_times.empty());
      const bool is_field = (array.role.empty() || (with_roles_ && has_strings(array))) &&
                            (is_on_mesh(array.location) || both_have_sets());
      if (one_format_ ? array.role.empty() || with_roles_ : is_field && !empty)
        list.insert(list.end(), i);
    }
    return list;
  }

  bool both_have_sets() const {
    constexpr auto kAll = Capabilities::BesideMesh::global_and_sets;
    return format_of(a_).capabilities.beside_mesh == kAll &&
           format_of(b_).capabilities.beside_mesh == kAll;
  }
  // Returns true if both formats treat the values of the array as strings.
  bool has_strings(const ArrayInfo& array) const {
    return source_format(a_).has_strings(array) && source_format(b_).has_strings(array);
  }

  static Name name_of(const ArrayInfo& array) { return {array.name, array.location, array.role}; }

  // Pairs arrays by name. If several arrays have the same name, pairs the k-th of them in A with
  // the k-th in B.
  void pair_by_name() {
    std::map<Name, Arrays> same;
    for (const std::size_t b : left_b_) same[name_of(b_.schema.arrays[b])].insert(b);
    Arrays alone;
    for (const std::size_t a : left_a_) {
      auto& list = same[name_of(a_.schema.arrays[a])];
      if (list.empty()) {
        alone.insert(a);
        continue;
      }
      pair(a, *list.begin());
      left_b_.erase(*list.begin());
      list.erase(list.begin());
    }
    left_a_ = std::move(alone);
  }

  void pair(std::size_t index_a, std::size_t index_b) {
    const ArrayInfo &a = a_.schema.arrays[index_a], &b = b_.schema.arrays[index_b];
    FieldPair pair{path_of(a_, index_a), a.location, a.components, whole_side(a, index_a),
                   whole_side(b, index_b)};
    const auto differ = [&](const std::string& text_a, const std::string& text_b, bool is_type) {
      found_.differences.push_back({pair.path, text_a, text_b, is_type});
    };
    if (a.type != b.type)
      differ(std::string(scalar_name(a.type)), std::string(scalar_name(b.type)), true);
    if (one_format_ && a.per_step != b.per_step)
      differ(a.per_step ? "stepped" : "static", b.per_step ? "stepped" : "static", false);
    if (one_format_ && a.blocks != b.blocks) differ(cover(a), cover(b), false);
    if (a.elements != b.elements) {
      const auto text = [](std::uint64_t n) { return std::to_string(n) + " elements"; };
      return differ(text(a.elements), text(b.elements), false);
    }
    if (a.components != b.components && !pad(pair)) {
      const auto text = [](std::uint32_t n) {
        return std::to_string(n) + (n == 1 ? " component" : " components");
      };
      return differ(text(a.components), text(b.components), false);
    }
    found_.pairs.push_back(std::move(pair));
  }

  static std::string cover(const ArrayInfo& array) {
    const std::string what = is_on_mesh(array.location) ? "blocks" : "sets";
    if (array.blocks.empty()) return "on all " + what;
    std::string text = "on " + what;
    for (const std::uint32_t block : array.blocks) text += " " + std::to_string(block);
    return text;
  }

  bool pad(FieldPair& pair) const {
    const bool a_is_short = pair.a.parts.size() < pair.b.parts.size();
    const MeshInfo& wide = a_is_short ? b_ : a_;
    if (one_format_ || !format_of(wide).capabilities.padded_vectors) return false;
    FieldSide& narrow = a_is_short ? pair.a : pair.b;
    pair.components =
        static_cast<std::uint32_t>(std::max(pair.a.parts.size(), pair.b.parts.size()));
    while (narrow.parts.size() < pair.components) narrow.parts.push_back({FieldSide::kZeros, 0});
    return true;
  }

  // Pairs arrays whose names differ only because one format does not allow two arrays of the same
  // name. In that format, the second array "v" is called "v (2)".
  void pair_numbered(const MeshInfo& repeated, Arrays& repeats, const MeshInfo& numbered,
                     Arrays& others, bool swapped) {
    if (!format_of(numbered).capabilities.unique_names) return;
    ByName named = by_name(numbered, others);
    std::erase_if(repeats, [&](std::size_t index) {
      const ArrayInfo& array = repeated.schema.arrays[index];
      const std::string& path = path_of(repeated, index);
      const std::size_t mark = path.rfind('#');
      if (mark == path.npos) return false;
      const std::string name = array.name + " (" + path.substr(mark + 1) + ")";
      const auto other = named.find({name, array.location});
      if (other == named.end() || other->second.empty()) return false;
      const std::size_t found = *other->second.begin();
      other->second.erase(found);
      others.erase(found);
      swapped ? pair(found, index) : pair(index, found);
      return true;
    });
  }

  // Pairs a vector `v` of one mesh with v_x, v_y, v_z, or v_1, v_2, ..., or v [0], v [1], ... of
  // the other mesh.
  void pair_components(const MeshInfo& whole, Arrays& wholes, const MeshInfo& apart, Arrays& parts,
                       bool swapped) {
    ByName named = by_name(apart, parts);
    std::erase_if(wholes, [&](std::size_t index) {
      const ArrayInfo& array = whole.schema.arrays[index];
      for (const auto suffix : {axis_suffix, number_suffix, index_suffix}) {
        const auto found = find_components(array, suffix, apart, named);
        if (!found) continue;
        const ArrayInfo& first = apart.schema.arrays[found->front()];
        FieldPair pair{path_of(whole, index), array.location, array.components,
                       whole_side(array, index),
                       FieldSide{{}, first.type, first.per_step, first.blocks}};
        for (const std::size_t part : *found) {
          pair.b.parts.push_back({part, 0});
          parts.erase(part);
          named[{apart.schema.arrays[part].name, array.location}].erase(part);
        }
        if (swapped) std::swap(pair.a, pair.b);
        if (pair.a.type != pair.b.type)
          found_.differences.push_back({pair.path, std::string(scalar_name(pair.a.type)),
                                        std::string(scalar_name(pair.b.type)), true});
        found_.pairs.push_back(std::move(pair));
        return true;
      }
      return false;
    });
  }

  static std::string axis_suffix(std::uint32_t c) {
    return c < 3 ? std::string("_") + "xyz"[c] : std::string("?");
  }
  static std::string number_suffix(std::uint32_t c) { return "_" + std::to_string(c + 1); }
  static std::string index_suffix(std::uint32_t c) { return " [" + std::to_string(c) + "]"; }

  static std::optional<std::vector<std::size_t>> find_components(
      const ArrayInfo& array, std::string (*suffix)(std::uint32_t), const MeshInfo& apart,
      const ByName& parts) {
    if (array.components < 2) return std::nullopt;
    std::vector<std::size_t> found;
    for (std::uint32_t c = 0; c < array.components; ++c) {
      const auto same = parts.find({array.name + suffix(c), array.location});
      if (same == parts.end()) return std::nullopt;
      const auto part = std::find_if(same->second.begin(), same->second.end(), [&](std::size_t i) {
        const ArrayInfo& other = apart.schema.arrays[i];
        if (other.components != 1) return false;
        if (found.empty()) return true;
        const ArrayInfo& first = apart.schema.arrays[found.front()];
        return other.type == first.type && other.per_step == first.per_step &&
               other.blocks == first.blocks && other.elements == first.elements;
      });
      if (part == same->second.end()) return std::nullopt;
      found.push_back(*part);
    }
    return found;
  }

  // Pairs an array that contains the block ids of one mesh with the block ids of the other mesh.
  void pair_block_ids(const MeshInfo& holder, Arrays& arrays, const MeshInfo& blocks,
                      bool swapped) {
    if (format_of(blocks).capabilities.blocks_by_type) return;
    std::erase_if(arrays, [&](std::size_t index) {
      const ArrayInfo& array = holder.schema.arrays[index];
      if (array.name != kBlockIds || array.location != Location::cell || array.components != 1)
        return false;
      FieldPair pair{path_of(holder, index), array.location, 1, whole_side(array, index),
                     FieldSide{{}, array.type, false, {}}};
      pair.b.type = ScalarType::int64;
      if (swapped) std::swap(pair.a, pair.b);
      found_.pairs.push_back(std::move(pair));
      return true;
    });
  }

  const MeshInfo &a_, &b_;
  const std::vector<std::string> paths_a_, paths_b_;
  bool one_format_, with_roles_;
  Arrays left_a_, left_b_;
  FieldPairs found_;
};

}  // namespace

FieldPairs pair_fields(const MeshInfo& a, const MeshInfo& b, bool one_format, bool with_roles) {
  return Pairing(a, b, one_format, with_roles).run();
}

FieldReader::FieldReader(MeshSource& mesh, const FieldPair& field, const FieldSide& side,
                         Spool& spool)
    : mesh_(&mesh), side_(&side), stride_(field.components * scalar_bytes(side.type)) {
  const MeshInfo& info = mesh.info();
  elements_ = field.location == Location::point ? info.vertices : info.cells();
  if (side.parts.empty()) {
    block_id_.emplace(spool, sizeof(std::int64_t));
    for (CellCursor cells(mesh); cells.next();) {
      const std::int64_t id = info.schema.blocks[cells.block()].id;
      block_id_->append(1, reinterpret_cast<const std::byte*>(&id));
    }
    return;
  }
  const std::size_t first = side.parts.front().array;
  whole_array_ = info.schema.arrays[first].components == side.parts.size() &&
                 std::all_of(side.parts.begin(), side.parts.end(),
                             [&](const FieldSide::Part& part) { return part.array == first; });
  covers_all_ = !is_on_mesh(field.location) || info.array_elements(first) == elements_;
  elements_ = info.array_elements(first);
  if (!covers_all_) index_covered(spool);
}

void FieldReader::index_covered(Spool& spool) {
  const Schema& schema = mesh_->info().schema;
  covered_.emplace(spool);
  rank_.emplace(spool, mesh_->info().cells());
  std::uint64_t cell = 0;
  for (CellCursor cells(*mesh_); cells.next(); ++cell) {
    if (!schema.array_covers(side_->parts.front().array, cells.block())) continue;
    covered_->push_back(cell);
    rank_->set(cell, covered_->size());
  }
}

void FieldReader::read(std::uint64_t step, std::uint64_t first, std::uint64_t count,
                       std::byte* out) {
  if (block_id_) return block_id_->read(first, count, out);
  if (whole_array_) {
    mesh_->read_array(side_->parts.front().array, step, first, count, out);
    if (strings_ != nullptr) strings_->translate(is_a_, out, count * side_->parts.size());
    return;
  }
  const std::size_t bytes = scalar_bytes(side_->type);
  std::memset(out, 0, count * stride_);
  std::size_t held = FieldSide::kZeros;  // index of the array whose values are in `piece_`
  for (std::size_t c = 0; c < side_->parts.size(); ++c) {
    const auto [array, component] = side_->parts[c];
    if (array == FieldSide::kZeros) continue;
    const std::size_t array_stride = mesh_->info().array_stride(array);
    if (array != held) {
      piece_.resize(count * array_stride);
      mesh_->read_array(array, step, first, count, piece_.data());
      held = array;
    }
    for (std::uint64_t i = 0; i < count; ++i)
      std::memcpy(out + i * stride_ + c * bytes,
                  piece_.data() + i * array_stride + component * bytes, bytes);
  }
}

void FieldReader::entities(std::uint64_t first, std::uint64_t count,
                           std::vector<std::uint64_t>& out) {
  if (covered_) return covered_->read(first, count, out);
  out.resize(count);
  for (std::uint64_t i = 0; i < count; ++i) out[i] = first + i;
}

std::optional<std::uint64_t> FieldReader::element_of(std::uint64_t entity) {
  if (!rank_) return entity;
  const std::uint64_t rank = rank_->get(entity);
  if (rank == 0) return std::nullopt;
  return rank - 1;
}

}  // namespace shm::converters
