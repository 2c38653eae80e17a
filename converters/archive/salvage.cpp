#include "archive/salvage.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "archive/damage_report.h"
#include "base/failure.h"
#include "compression/compress.h"
#include "compression/decompress.h"
#include "compression/piece_mesh.h"
#include "formats/formats.h"
#include "mesh/mesh_source.h"
#include "shm/mesh_extract.h"
#include "transfer/piece_output.h"
#include "transfer/translate.h"

namespace shm::converters {
namespace {

// A damaged index may state far too many steps. If the arrays together have values at N steps, at
// most kMostStepsForEach * (N + 1) steps are allowed.
constexpr std::uint64_t kMostStepsForEach = 1000;

class Salvage {
 public:
  Salvage(RandomSource& file, const DamageReport& damage, const std::string& name, Spool& spool)
      : damage_(damage),
        name_(name),
        spool_(spool),
        file_(unwrap(MeshExtractor::open_damaged(file, read_limits(spool)), name)) {}

  SalvageReport run(ByteSink& sink, const Progress& progress);

 private:
  void read_whole();
  bool lost_times() const;
  std::vector<double> step_times();
  void tell_cells(const PieceMesh& piece);
  void tell_static_arrays();
  void tell_steps(const PieceMesh& piece);
  void tell_others();
  void tell_words(const Translation& translation);
  void report_missing(std::string sentence, nlohmann::json json);
  std::string label(std::uint32_t array) const { return array_label(damage_.schema, array); }

  const DamageReport& damage_;
  const std::string& name_;
  Spool& spool_;
  MeshExtractor file_;
  MeshInfo whole_;
  SalvageReport report_;
};

void Salvage::report_missing(std::string sentence, nlohmann::json json) {
  report_.missing.push_back(std::move(sentence));
  report_.missing_json.push_back(std::move(json));
}

// Collects the known properties of the original file. If the index is lost, the largest vertex and
// cell ids in extras are used to compute lower bounds on the vertex and cell counts.
void Salvage::read_whole() {
  whole_.schema = file_.schema();
  whole_.vertices = file_.vertices();
  whole_.block_cells = file_.block_cells();
  whole_.extras = unwrap(file_.extras(), name_);
  translate_old_extras(whole_);
  std::uint64_t cells = file_.cells();
  if (damage_.cells) return;
  for (const Extra& extra : whole_.extras) {
    if (extra.refers == Reference::nothing) continue;
    std::uint64_t& count = extra.refers == Reference::cell ? cells : whole_.vertices;
    for (const std::int64_t number : integers_of_extra(extra))
      if (number >= 0) count = std::max(count, static_cast<std::uint64_t>(number) + 1);
  }
  if (whole_.block_cells.empty()) return;
  std::fill(whole_.block_cells.begin(), whole_.block_cells.end(), 0);
  whole_.block_cells[0] = cells;
}

// Returns true if a chunk that may contain step times is lost.
bool Salvage::lost_times() const {
  return std::any_of(damage_.damages.begin(), damage_.damages.end(), [](auto& damage) {
    return damage.section == "step times" || damage.section == "chunk";
  });
}

// Returns the step times. If step times are lost, the step numbers replace them.
std::vector<double> Salvage::step_times() {
  std::vector<double> times = unwrap(file_.step_times(), name_);
  std::uint64_t steps = 0, with_values = 0;
  for (std::uint32_t a = 0; a < whole_.schema.arrays.size(); ++a)
    if (whole_.schema.arrays[a].per_step)
      if (const auto of_array = unwrap(file_.steps(a), name_); !of_array.empty()) {
        steps = std::max(steps, of_array.back() + 1);
        with_values += of_array.size();
      }
  // Each step needs memory and CPU time, and a damaged index may state far too many steps. The
  // number of steps is therefore limited to a multiple of the number of steps with values.
  const std::uint64_t most = kMostStepsForEach * (with_values + 1);
  steps = std::max(steps, std::min(damage_.steps.value_or(0), most));
  const bool lost_before =
      std::any_of(times.begin(), times.end(), [](double time) { return std::isnan(time); });
  if (times.size() >= steps && !(lost_before && lost_times())) return times;
  if (steps > most)
    throw Failure(Error{.code = ErrorCode::over_limit,
                        .detail = counted(steps, "step") + ", of which " +
                                  std::to_string(with_values) + " have values, and no times",
                        .section = "step times",
                        .file = name_});
  if (lost_times() || !damage_.cells)
    report_missing("the times of " + counted(steps, "step") + "; step numbers are used instead",
                   {{"what", "step times"}, {"steps", steps}});
  for (std::size_t step = 0; step < times.size() && lost_times(); ++step)
    if (std::isnan(times[step])) times[step] = static_cast<double>(step);
  for (std::uint64_t step = times.size(); step < steps; ++step)
    times.push_back(static_cast<double>(step));
  return times;
}

void Salvage::tell_cells(const PieceMesh& piece) {
  report_.vertices = piece.info().vertices;
  report_.cells = piece.info().cells();
  std::vector<std::pair<std::uint64_t, std::uint64_t>> there;
  for (const SegmentInfo& segment : file_.segments())
    if (segment.cells > 0)
      there.emplace_back(segment.first_cell, segment.first_cell + segment.cells);
  std::sort(there.begin(), there.end());
  std::uint64_t end = 0;
  const auto tell_run = [&](std::uint64_t next) {
    if (next > end)
      report_missing(
          "cells " + std::to_string(end) + "-" + std::to_string(next - 1) + " in coding order",
          {{"what", "cells"}, {"first_cell", end}, {"cells", next - end}});
  };
  for (const auto& [first, past_end] : there) {
    tell_run(first);
    end = std::max(end, past_end);
  }
  tell_run(file_.cells());
  if (damage_.vertices && *damage_.vertices > report_.vertices)
    report_missing(std::to_string(*damage_.vertices - report_.vertices) + " vertices" +
                       " that are used only by missing cells, or by no cell",
                   {{"what", "vertices"}, {"count", *damage_.vertices - report_.vertices}});
  if (!damage_.cells && !damage_.complete)
    report_missing(
        "any data after the last cell that was found (without an index, its amount is unknown)",
        {{"what", "unknown"}});
}

void Salvage::tell_static_arrays() {
  for (std::size_t s = 0; s < file_.segments().size(); ++s) {
    const SegmentInfo& segment = file_.segments()[s];
    for (const std::uint32_t array : file_.lost_arrays(s)) {
      report_missing(
          "values of " + label(array) + " in segment " + std::to_string(file_.segment_number(s)) +
              ", cells " + std::to_string(segment.first_cell) + "-" +
              std::to_string(segment.first_cell + std::max<std::uint64_t>(segment.cells, 1) - 1),
          {{"what", "values"},
           {"array", label(array)},
           {"segment", file_.segment_number(s)},
           {"first_cell", segment.first_cell},
           {"cells", segment.cells}});
    }
  }
}

void Salvage::tell_steps(const PieceMesh& piece) {
  struct Lost {
    std::set<std::uint64_t> steps;
    std::uint64_t least = ~std::uint64_t{0}, most = 0;
  };
  // for each array with lost values: the steps at which values were lost, and the smallest and
  // largest number of values lost at such a step
  std::map<std::uint32_t, Lost> lost;
  for (const auto& [key, count] : piece.lost_values()) {
    if (count == 0) continue;
    Lost& of_array = lost[key.first];
    of_array.steps.insert(key.second);
    of_array.least = std::min(of_array.least, count);
    of_array.most = std::max(of_array.most, count);
    report_.missing_json.push_back({{"what", "step values"},
                                    {"array", label(key.first)},
                                    {"step", key.second},
                                    {"count", count}});
  }
  for (const auto& [array, values] : lost) {
    const Location location = whole_.schema.arrays[array].location;
    const std::string least =
        values.least == values.most ? "" : std::to_string(values.least) + " to ";
    report_.missing.push_back("values of " + label(array) + " at " + steps_text(values.steps) +
                              " of " + least + std::to_string(values.most) +
                              (location == Location::point  ? " vertices"
                               : location == Location::cell ? " cells"
                                                            : " elements") +
                              " in the result");
  }
}

void Salvage::tell_others() {
  for (const Damage& damage : damage_.damages)
    if (damage.section == "extra" && damage.kind != DamageKind::repeated &&
        damage.kind != DamageKind::out_of_order)
      report_missing("an extra (a set, a name or other data of the mesh) at byte " +
                         std::to_string(damage.offset),
                     {{"what", "extra"}, {"offset", damage.offset}, {"bytes", damage.bytes}});
}

// Reports the loss of data that only the source format can interpret. The new file does not contain
// this data, because the data describes the whole mesh.
void Salvage::tell_words(const Translation& translation) {
  for (const std::string& loss : translation.losses())
    report_missing(loss, {{"what", "other"}, {"name", loss}});
  const std::vector<ArrayInfo>& kept = translation.info().schema.arrays;
  for (const ArrayInfo& array : whole_.schema.arrays) {
    const auto is_kept = [&](const ArrayInfo& other) {
      return other.location == array.location && other.name == array.name &&
             other.role == array.role;
    };
    if (!array.role.empty() && std::none_of(kept.begin(), kept.end(), is_kept))
      report_missing("role " + array.role + " of array '" + array.name + "'",
                     {{"what", "role"}, {"array", array.name}, {"role", array.role}});
  }
  report_.laid_out = whole_.schema.source_format;
}

SalvageReport Salvage::run(ByteSink& sink, const Progress& progress) {
  read_whole();
  PieceOptions how;
  how.damaged = true;
  how.numbers = !damage_.complete;
  how.step_times = step_times();
  how.flat = source_format(whole_).is_flat(whole_);
  const std::vector<MeshSet> sets = take_sets(whole_);
  PieceMesh piece(file_, how, whole_.extras, sets, name_, spool_);
  for (const std::string& set : piece.without_factors())
    report_missing("distribution factors of " + set, {{"what", "factors"}, {"set", set}});
  for (const std::string& array : piece.without_sets())
    report_missing("array '" + array + "', because members of its sets are missing",
                   {{"what", "array"}, {"array", array}});
  if (piece.info().vertices == 0 && (!damage_.vertices || *damage_.vertices > 0))
    throw Failure(ErrorCode::corrupt, "nothing of the mesh is left", name_);
  tell_cells(piece);
  tell_static_arrays();
  tell_others();
  Translation translation(piece, "shm", format_named("shm")->capabilities, std::nullopt, spool_);
  tell_words(translation);
  FromElsewhere mesh(translation.mesh(), whole_);
  CompressOptions options;
  options.progress = progress;
  compress_mesh(mesh, sink, options, spool_);
  tell_steps(piece);
  return std::move(report_);
}

}  // namespace

SalvageReport salvage(RandomSource& file, const DamageReport& damage, const std::string& name,
                      ByteSink& sink, Spool& spool, const Progress& progress) {
  return Salvage(file, damage, name, spool).run(sink, progress);
}

}  // namespace shm::converters
