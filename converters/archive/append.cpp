#include "archive/append.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "accuracy/block_bounds.h"
#include "archive/appended_extras.h"
#include "archive/damage_report.h"
#include "archive/foreign_steps.h"
#include "base/failure.h"
#include "compare/compare.h"
#include "compression/decompress.h"
#include "compression/step_feeder.h"
#include "formats/formats.h"
#include "mesh/coding_order.h"

namespace shm::converters {
namespace {

constexpr std::size_t kCacheBytes = std::size_t{32} << 20;

[[noreturn]] void refuse(ErrorCode code, const std::string& detail) { throw Failure(code, detail); }

class Appending {
 public:
  Appending(const std::string& path, MeshSource& source, ByteSink& sink, const AppendHow& how,
            Spool& spool)
      : path_(path),
        how_(how),
        spool_(spool),
        file_(unwrap(FileRandomSource::open(path), path)),
        appender_(unwrap(Appender::open(*file_, sink, how.options), path)),
        steps_(&source) {}

  AppendOutcome run() {
    const auto bare = unwrap(appender_.without_steps(), path_);
    mesh_ = stage_shm(*bare, path_, 0, spool_, how_.progress, how_.threads);
    expect_steps();
    compare();
    if (!outcome_.differences.empty()) return std::move(outcome_);
    choose_steps();
    if (outcome_.steps.empty()) return std::move(outcome_);
    AppendedExtras extras = join_extras();
    outcome_.losses = std::move(extras.losses);
    if (how_.strict && !outcome_.losses.empty()) return std::move(outcome_);
    if (extras.changed) unwrap(appender_.drop_extras(), path_);
    write_values();
    unwrap(appender_.set_step_times(outcome_.times), path_);
    if (extras.changed)
      for (const Extra& extra : extras.extras) unwrap(appender_.add_extra(extra), path_);
    outcome_.sizes = unwrap(appender_.finish(), path_);
    return std::move(outcome_);
  }

 private:
  const MeshInfo& old() const { return mesh_->info(); }
  bool keeps_numbers() const { return old().schema.order == Order::keep; }

  void expect_steps() const {
    const auto& arrays = old().schema.arrays;
    const bool stepped = std::any_of(arrays.begin(), arrays.end(),
                                     [](const ArrayInfo& array) { return array.per_step; });
    if (!stepped && old().step_times.empty())
      refuse(ErrorCode::unsupported, "has neither time steps nor arrays that change with time");
    if (appender_.steps() > old().step_times.size())
      refuse(ErrorCode::unsupported, "has time steps without times");
  }

  // Compares the mesh and the arrays of the old file with those of the source. Stores the
  // differences in outcome_.differences.
  void compare() {
    MeshSource& source = *steps_;
    if (source.info().schema.source_format == old().schema.source_format) {
      if (how_.time)
        refuse(ErrorCode::misuse,
               "--time needs a SOURCE without time steps, in a different format from FILE");
      const CompareReport report =
          compare_without_steps(source, *mesh_, spool_, how_.progress, how_.cell_order, numbering_);
      outcome_.differences = report.first;
      if (report.differences > report.first.size())
        outcome_.differences.push_back("and " +
                                       std::to_string(report.differences - report.first.size()) +
                                       " more differences");
      return;
    }
    if (how_.time && !source.info().step_times.empty())
      refuse(ErrorCode::misuse, "--time needs a SOURCE without time steps; SOURCE has " +
                                    counted(source.info().step_times.size(), "time step"));
    foreign_ = std::make_unique<ForeignSteps>(*mesh_, source, how_.time, spool_);
    outcome_.differences = foreign_->differences(how_.progress);
    steps_ = foreign_.get();
  }

  void choose_steps() {
    const auto& times = steps_->info().step_times;
    const auto& known = old().step_times;
    for (const std::uint64_t step : how_.steps)
      if (step >= times.size())
        refuse(ErrorCode::misuse, "there is no step " + std::to_string(step) + ": SOURCE has " +
                                      std::to_string(times.size()) + ", counted from 0");
    outcome_.steps = how_.steps;
    for (std::uint64_t step = 0; step < times.size() && how_.steps.empty(); ++step)
      if (how_.all || known.empty() || times[step] > known.back()) outcome_.steps.push_back(step);
    outcome_.times = known;
    for (const std::uint64_t step : outcome_.steps) outcome_.times.push_back(times[step]);
  }

  // Return the source's vertex ids and cell ids in coding order. Null means that the coding order
  // is the order in the source.
  NumberList* vertex_order() {
    return keeps_numbers() ? &mesh_->vertex_order() : numbering_.vertices.get();
  }
  NumberList* cell_order() {
    return keeps_numbers() && old().schema.delay > 0 ? &mesh_->cell_order()
                                                     : numbering_.cells.get();
  }

  AppendedExtras join_extras() {
    if (foreign_) return source_format(old()).lengthened_extras(old(), outcome_.steps.size());
    const MeshInfo& info = steps_->info();
    Renumbering to{{}, {}, info.vertices, info.cells()};
    std::optional<NumberTable> vertices, cells;
    if (numbering_.vertices) {
      vertices = invert(*numbering_.vertices, info.vertices, "vertex", spool_);
      to.vertex = [&](std::uint64_t v) { return vertices->get(v); };
    }
    if (numbering_.cells) {
      cells = invert(*numbering_.cells, info.cells(), "cell", spool_);
      to.cell = [&](std::uint64_t c) { return cells->get(c); };
    }
    std::vector<Extra> extras;
    for (const Extra& extra : info.extras) extras.push_back(renumbered(extra, to));
    return appended_extras(old(), info, extras, outcome_.steps);
  }

  void write_values() {
    const Schema& schema = old().schema;
    std::optional<CoveredOrder> covered;
    if (cell_order() != nullptr) covered.emplace(*steps_, *cell_order(), spool_);
    // Values are rounded in the same way as those of the old steps.
    std::unique_ptr<RoundedMesh> rounded;
    if (BlockBounds bounds = block_bounds_in(old()); has_any(bounds))
      rounded = std::make_unique<RoundedMesh>(*steps_, std::move(bounds), schema);
    MeshSource& steps = rounded ? *rounded : *steps_;
    for (std::uint32_t a = 0; a < schema.arrays.size(); ++a) {
      if (!schema.arrays[a].per_step) continue;
      const Location location = schema.arrays[a].location;
      NumberList* order = location == Location::point             ? vertex_order()
                          : location == Location::cell && covered ? &covered->elements(a)
                                                                  : nullptr;
      for (std::size_t i = 0; i < outcome_.steps.size(); ++i) {
        const std::uint64_t to = old().step_times.size() + i;
        feed_step(steps, a, outcome_.steps[i], order, kCacheBytes,
                  [&](std::span<const std::byte> values) {
                    unwrap(appender_.add_step_values(a, to, values), path_);
                  });
        if (how_.progress) how_.progress(schema.arrays[a].name, i + 1, outcome_.steps.size());
      }
    }
  }

  const std::string& path_;
  const AppendHow& how_;
  Spool& spool_;
  std::unique_ptr<FileRandomSource> file_;
  Appender appender_;
  std::unique_ptr<StagedMesh> mesh_;  // mesh of the old file, without its time steps
  std::unique_ptr<ForeignSteps> foreign_;
  MeshSource* steps_;  // source of the new steps
  Numbering numbering_;
  AppendOutcome outcome_;
};

}  // namespace

AppendOutcome append_steps(const std::string& path, MeshSource& source, ByteSink& sink,
                           const AppendHow& how, Spool& spool) {
  return Appending(path, source, sink, how, spool).run();
}

}  // namespace shm::converters
