#include "transfer/translate.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <utility>

#include "accuracy/block_bounds.h"
#include "base/failure.h"
#include "formats/formats.h"
#include "mesh/array_names.h"
#include "mesh/blocks_by_id.h"
#include "mesh/chosen_steps.h"
#include "mesh/forwarding_mesh.h"
#include "mesh/mesh_source.h"
#include "sets/set_arrays.h"
#include "sets/set_cells.h"
#include "sets/transfer_sets.h"
#include "transfer/joined_arrays.h"
#include "transfer/mesh_sets.h"
#include "transfer/own_steps.h"

namespace shm::converters {
namespace {

constexpr std::uint64_t kPieceElements = 16384;

// Converts a mesh without time steps, whose time is stored in an extra of the source format, to a
// mesh with one time step. All arrays without a role become stepped arrays.
class AtTime final : public ForwardingMesh {
 public:
  AtTime(MeshSource& source, double time) : ForwardingMesh(source) {
    info_ = source.info();
    info_.step_times = {time};
    for (ArrayInfo& array : info_.schema.arrays) array.per_step |= array.role.empty();
  }
};

class WithExtras final : public ForwardingMesh {
 public:
  WithExtras(MeshSource& source, std::vector<Extra> extras) : ForwardingMesh(source) {
    info_ = source.info();
    info_.extras = std::move(extras);
  }
};

// Gives the shape `other` to blocks whose nodes do not have the order of the mesh model.
class WithKnownShapes final : public ForwardingMesh {
 public:
  WithKnownShapes(MeshSource& source, const SourceFormat& format) : ForwardingMesh(source) {
    info_ = source.info();
    for (const std::size_t block : format.blocks_with_own_nodes(source)) {
      info_.schema.blocks[block].shape = CellShape::other;
      info_.schema.blocks[block].scheme = NodeScheme::lagrange;
    }
  }
};

// Returns true if the array contains a 64-bit integer beyond 2^53, which a double cannot represent
// exactly.
bool beyond_doubles(MeshSource& mesh, std::size_t a) {
  constexpr std::int64_t kMost = std::int64_t{1} << 53;
  const MeshInfo& info = mesh.info();
  const ArrayInfo& array = info.schema.arrays[a];
  if (array.type != ScalarType::int64 && array.type != ScalarType::uint64) return false;
  std::vector<std::int64_t> values(kPieceElements * array.components);
  const std::uint64_t steps = array.per_step ? info.step_times.size() : 1;
  const std::uint64_t elements = info.array_elements(a);
  for (std::uint64_t step = 0; step < steps; ++step) {
    for (std::uint64_t first = 0; first < elements; first += kPieceElements) {
      const std::uint64_t count = std::min(kPieceElements, elements - first);
      mesh.read_array(a, step, first, count, reinterpret_cast<std::byte*>(values.data()));
      const auto end = values.begin() + static_cast<std::ptrdiff_t>(count * array.components);
      if (std::any_of(values.begin(), end, [](std::int64_t v) { return v > kMost || v < -kMost; }))
        return true;
    }
  }
  return false;
}

// Call this if the target format requires that cell arrays cover all cells. Throws Failure
// (over_limit) if arrays that cover only a few of very many blocks would become too large when they
// are extended to all cells.
void check_filling(const MeshInfo& info) {
  constexpr std::uint64_t kAlwaysAllowed = std::uint64_t{1} << 30, kMostGrowth = 64;
  std::uint64_t held = 0, filled = 0;
  for (std::size_t a = 0; a < info.schema.arrays.size(); ++a) {
    if (info.schema.arrays[a].location != Location::cell) continue;
    const std::uint64_t stride = info.array_stride(a);
    held += stride * info.array_elements(a);
    filled += stride * info.cells();
  }
  if (filled > std::max(kAlwaysAllowed, kMostGrowth * held))
    throw Failure(
        Error{.code = ErrorCode::over_limit,
              .detail = "cell arrays on only a few of many blocks would become more than " +
                        std::to_string(kMostGrowth) + " times as large if they covered all blocks",
              .section = "arrays"});
}

std::string block_label(const BlockInfo& block) {
  std::string text = "block " + std::to_string(block.id);
  return block.name.empty() ? text : text + " '" + block.name + "'";
}

}  // namespace

template <class Layer>
Layer& Translation::add(std::unique_ptr<Layer> layer) {
  Layer& added = *layer;
  mesh_ = layer.get();
  layers_.push_back(std::move(layer));
  return added;
}

Translation::Translation(MeshSource& source, const std::string& format, const Capabilities& target,
                         std::optional<StepRange> steps, Spool& spool,
                         const std::vector<BlocksById::Key>& blocks_elsewhere)
    : from_(source.info()),
      source_(source_format(source.info())),
      format_(format),
      target_(target),
      mesh_(&source) {
  if (is_sibling()) {
    choose_steps(steps);
    for (std::string& loss : target_.losses_of_sibling(mesh_->info()))
      losses_.push_back(std::move(loss));
    return;
  }
  const bool is_own = format_ == from_.schema.source_format;
  if (!is_own) add(std::make_unique<WithKnownShapes>(*mesh_, source_));
  if (target_.block_numbers) split_blocks(blocks_elsewhere);
  choose_steps(steps);
  const std::vector<BlockInfo> blocks = mesh_->info().schema.blocks;
  add(std::make_unique<JoinedArrays>(
      *mesh_, !format_of(from_).capabilities.vectors && target.vectors, target));
  report_numbers(blocks);
  report_arrays();
  report_blocks();
  carry_title();
  carry_sets(spool);
  // Bounds of blocks describe the .shm file, and are not data of the mesh.
  for (const Extra& extra : from_.extras)
    if (is_block_bounds(extra.key)) used_.insert(extra.key);
  add(std::make_unique<WithExtras>(*mesh_, std::move(extras_)));
  for (std::string& loss : source_.losses(from_, used_)) losses_.push_back(std::move(loss));
}

void Translation::choose_steps(std::optional<StepRange> steps) {
  const std::size_t count = from_.step_times.size();
  if (!steps && !target_.every_step && count > 1) {
    steps = StepRange{count - 1, count};
    losses_.push_back(lost_steps(count, *steps, format_));
  }
  if (steps) {
    take_steps(*steps);
  } else if (count == 0 && !is_sibling()) {
    if (const auto time = source_.time(from_, used_)) add(std::make_unique<AtTime>(*mesh_, *time));
  }
  // Call time() only to mark the extra that stores the time as used; its result is not needed.
  // Files of a series have this extra, too.
  if (count > 0 && !source_.describes_steps(from_)) source_.time(from_, used_);
}

void Translation::take_steps(StepRange steps) {
  if (is_sibling() && !source_.describes_steps(from_))
    if (auto own = OwnSteps::of(*mesh_, steps)) {
      add(std::move(own));
      return;
    }
  const auto points = steps.size() == 1 ? source_.points_of_step(from_, steps.first) : std::nullopt;
  if (points && from_.schema.arrays[*points].type == from_.schema.coordinate_type) {
    add(std::make_unique<PointsOfStep>(*mesh_, *points));
  } else if (points) {
    losses_.push_back("points of time step " + std::to_string(steps.first) +
                      " (their type differs from the type of the first points)");
  }
  add(std::make_unique<ChosenSteps>(*mesh_, steps));
}

void Translation::split_blocks(const std::vector<BlocksById::Key>& first) {
  const std::size_t array = BlocksById::array_of_ids(mesh_->info());
  const auto names = source_.block_names(from_, used_);
  if (array == mesh_->info().schema.arrays.size()) return;
  auto split = std::make_unique<BlocksById>(*mesh_, array, names, first);
  if (split->useful()) add(std::move(split));
}

void Translation::report_arrays() {
  for (const ArrayInfo& array : from_.schema.arrays)
    if (const Role& role = role_of(array); role.loss != nullptr)
      losses_.push_back(role.loss(array.name));
    else if (!target_.has_arrays_at(array.location))
      losses_.push_back("array" + quoted(array_label(array)));
  const MeshInfo& info = mesh_->info();
  bool any_stepped = false;
  if (!target_.partial_arrays) check_filling(info);
  for (std::size_t a = 0; a < info.schema.arrays.size(); ++a) {
    const ArrayInfo& array = info.schema.arrays[a];
    any_stepped |= array.per_step;
    const std::string label = "array '" + array.name + "'";
    report_name(array.name, label);
    if (!target_.partial_arrays && array.location == Location::cell &&
        info.array_elements(a) != info.cells())
      losses_.push_back("blocks that " + label + " covers (" +
                        (is_float(array.type) ? "NaN" : "0") + " on all other blocks)");
    if (!target_.integers && beyond_doubles(*mesh_, a))
      losses_.push_back("exact values of " + label + " (integers beyond 2^53)");
  }
  if (!target_.times && !info.step_times.empty() && !any_stepped)
    losses_.push_back("step times, since no array changes with time (" +
                      std::to_string(info.step_times.size()) + ")");
}

// Reports the blocks whose number was changed because another block had the same number. A format
// that stores block numbers as an array could not distinguish blocks with equal numbers.
void Translation::report_numbers(const std::vector<BlockInfo>& before) {
  const auto& now = mesh_->info().schema.blocks;
  for (std::size_t b = 0; b < now.size(); ++b)
    if (now[b].id != before[b].id)
      losses_.push_back("number of " + block_label(before[b]) + ", which another block has (" +
                        std::to_string(now[b].id) + " there)");
}

void Translation::report_blocks() {
  const MeshInfo& info = mesh_->info();
  std::set<std::int64_t> used;
  std::optional<std::int64_t> most;
  if (target_.most_numbers != nullptr) most = target_.most_numbers(info).block;
  bool fit = true;
  for (std::size_t b = 0; b < info.schema.blocks.size(); ++b) {
    const BlockInfo& block = info.schema.blocks[b];
    fit &= !target_.positive_numbers || block.id > 0;
    fit &= !target_.unique_numbers || used.insert(block.id).second;
    report_name(block.name, block_label(block));
    if (most && block.id > *most)
      losses_.push_back("number of " + block_label(block) + ", which is above " +
                        std::to_string(*most));
    const bool is_own = format_ == from_.schema.source_format;
    if (!is_own && target_.block != nullptr && info.block_cells[b] > 0 && !target_.block(block))
      losses_.push_back("cell type of " + block_label(block) + " (" + kind_of_cells(block) +
                        " with " +
                        (block.nodes_per_cell == 0 ? std::string("any number of")
                                                   : std::to_string(block.nodes_per_cell)) +
                        " nodes)");
  }
  const bool numbered = !format_of(from_).capabilities.blocks_by_type ||
                        BlocksById::array_of_ids(from_) < from_.schema.arrays.size();
  if (numbered && !fit)
    losses_.push_back(std::string("numbers of blocks (each must be above 0") +
                      (target_.unique_numbers ? " and unique)" : ")"));
}

void Translation::report_name(const std::string& name, const std::string& label) {
  if (target_.name != nullptr && !target_.name(name)) losses_.push_back("spelling of " + label);
}

void Translation::carry_title() {
  std::string title;
  if (const Extra* given = find_extra(from_, "mesh/title")) {
    title = text_of_extra(*given);
    used_.insert(given->key);
  } else {
    title = source_.title(from_, used_);
  }
  if (title.empty()) return;
  if (title.size() > target_.title_bytes)
    losses_.push_back(target_.title_bytes == 0
                          ? "title" + quoted(title.substr(0, title.find('\0')))
                          : "title beyond " + std::to_string(target_.title_bytes) + " bytes");
  extras_.push_back(text_extra("mesh/title", title));
}

void Translation::carry_sets(Spool& spool) {
  std::vector<MeshSet> sets = transfer_sets(from_, used_);
  for (const MeshSet& set : sets) {
    report_name(set.name, label_of(set));
    if (target_.most_numbers == nullptr) continue;
    const std::int64_t most = target_.most_numbers(mesh_->info()).set;
    if (set.id > most)
      losses_.push_back("number of " + label_of(set) + ", which is above " + std::to_string(most));
  }
  for (MeshSet& set : sets) {
    if (set.factors.empty()) continue;
    if (target_.sets == Capabilities::Sets::sets && has_usual_factors(set)) continue;
    losses_.push_back("distribution factors of " + label_of(set));
    set.factors.clear();
  }
  if (sets.empty()) return;
  LossList left_out;
  if (target_.sets == Capabilities::Sets::sets) {
    list_members(*mesh_, sets);
    for (Extra& extra : set_extras(sets)) extras_.push_back(std::move(extra));
  } else if (target_.sets == Capabilities::Sets::arrays) {
    left_out = add(std::make_unique<SetArrays>(*mesh_, sets, spool)).left_out();
  } else if (!mesh_->info().schema.blocks.empty()) {
    left_out =
        add(std::make_unique<SetCells>(*mesh_, sets, source_.is_flat(from_), spool)).left_out();
    for (const MeshSet& set : sets)
      if (set.kind == MeshSet::Kind::elements) left_out.push_back(label_of(set));
  } else {
    for (const MeshSet& set : sets) left_out.push_back(label_of(set));
  }
  losses_.insert(losses_.end(), left_out.begin(), left_out.end());
}

}  // namespace shm::converters
