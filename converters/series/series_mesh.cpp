#include "series/series_mesh.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include "archive/foreign_steps.h"
#include "base/failure.h"
#include "files/mesh_files.h"
#include "formats/formats.h"
#include "interface/format.h"

namespace shm::converters {
namespace {

constexpr std::uint64_t kPieceElements = 65536;

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw Failure(ErrorCode::unsupported, what, path);
}

// Counts the arrays of each kind. Arrays of the same kind have the same name, location, number of
// components and type. The keys of the resulting map describe these properties and appear in
// messages.
std::map<std::string, std::size_t> kinds_of_arrays(const Schema& schema) {
  std::map<std::string, std::size_t> kinds;
  for (const ArrayInfo& array : schema.arrays)
    ++kinds["array '" + array.name + "' on " +
            (array.location == Location::point ? "points" : "cells") + ", " +
            std::to_string(array.components) + " x " + std::string(scalar_name(array.type))];
  return kinds;
}

class SeriesMesh final : public MeshSource {
 public:
  SeriesMesh(std::unique_ptr<MeshSource> first, const SeriesFile& file, Spool& spool)
      : first_(std::move(first)), file_(file), spool_(spool), info_(first_->info()) {
    check_format(info_, file.path);
    info_.extras = source_format(info_).extras_of_series(info_);
    info_.step_times.clear();
    values_.resize(info_.schema.arrays.size());
    changes_.resize(info_.schema.arrays.size());
    for (ArrayInfo& array : info_.schema.arrays) array.per_step = array.role.empty();
    add_time(first_->info(), file);
  }

  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override {
    first_->read_points(first, count, out);
  }
  bool next_cells(CellBatch& out, std::size_t max_cells) override {
    return first_->next_cells(out, max_cells);
  }
  void rewind_cells() override { first_->rewind_cells(); }
  void seek_cells(std::uint64_t first) override { first_->seek_cells(first); }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override {
    if (step == 0 || !info_.schema.arrays[array].per_step)
      first_->read_array(array, 0, first, count, out);
    else
      values_[array][step - 1].read(first, count, out);
  }

  bool has_time() const { return has_time_; }

  // Adds the time step that another file of the series contains.
  void add(MeshSource& mesh, const SeriesFile& file, Spool& spool, const Remark& remark) {
    check_format(mesh.info(), file.path);
    if (mesh.info().schema.source_format != info_.schema.source_format)
      refuse(file.path, "has a different format from " + file_.path);
    check_arrays(mesh.info(), file.path);
    add_time(mesh.info(), file);
    ForeignSteps steps(*this, mesh, info_.step_times.back(), spool);
    const std::vector<std::string> differences = steps.differences({});
    if (!differences.empty())
      differ(file.path, differences.front() + (differences.front().starts_with("coordinates")
                                                   ? "; points that move are not read as a series"
                                                   : ""));
    compare_extras(mesh.info(), file.path, remark);
    for (std::size_t a = 0; a < values_.size(); ++a)
      if (info_.schema.arrays[a].per_step) copy(steps, a);
  }

  // Call this after the last file has been added. Makes integer arrays static if they are the same
  // in all files.
  void finish() {
    for (std::size_t a = 0; a < values_.size(); ++a) {
      ArrayInfo& array = info_.schema.arrays[a];
      array.per_step = array.per_step && (is_float(array.type) || changes_[a]);
    }
  }

 private:
  [[noreturn]] void differ(const std::string& path, const std::string& what) const {
    refuse(path, "does not belong to the same series as " + file_.path + ": " + what);
  }

  static void check_format(const MeshInfo& info, const std::string& path) {
    const Format* format = format_named(info.schema.source_format);
    if (format == nullptr || format->capabilities.every_step || !info.step_times.empty())
      refuse(path,
             "contains time steps itself, so it cannot be a file of a series; shm append joins the "
             "steps of such files");
  }

  void check_arrays(const MeshInfo& info, const std::string& path) const {
    auto kinds = kinds_of_arrays(info_.schema);
    for (const auto& [kind, count] : kinds_of_arrays(info.schema))
      if (kinds[kind] != count) differ(path, "it has " + kind + ", which the other file lacks");
    for (const auto& [kind, count] : kinds)
      if (kinds_of_arrays(info.schema)[kind] != count) differ(path, "it lacks " + kind);
  }

  void add_time(const MeshInfo& info, const SeriesFile& file) {
    Keys used;
    const auto time = file.time ? file.time : source_format(info).time(info, used);
    if (info_.step_times.empty()) has_time_ = time.has_value();
    if (time.has_value() != has_time_)
      differ(file.path, has_time_ ? "it has no time value, but the other file has one"
                                  : "it has a time value, but the other file has none");
    info_.step_times.push_back(time.value_or(static_cast<double>(info_.step_times.size())));
  }

  void compare_extras(const MeshInfo& info, const std::string& path, const Remark& remark) {
    const SourceFormat& format = source_format(info_);
    std::map<std::string, Extra> others;
    for (Extra& extra : format.extras_of_series(info)) others.emplace(extra.key, std::move(extra));
    const auto other = [&](const std::string& key) {
      if (format.is_list_of_strings(key)) return;  // lists of strings have been compared already
      if (!format.is_about_file(key)) differ(path, "extra '" + key + "' differs");
      if (remarked_.insert(key).second && remark)
        remark(path + ": '" + key + "' differs from the one in " + file_.path +
               ", which is used for all files");
    };
    for (const Extra& extra : info_.extras) {
      const auto found = others.find(extra.key);
      if (found == others.end() || found->second != extra) other(extra.key);
      if (found != others.end()) others.erase(found);
    }
    for (const auto& [key, extra] : others) other(key);
  }

  void copy(MeshSource& steps, std::size_t array) {
    const std::size_t stride = info_.array_stride(array);
    const std::uint64_t elements = info_.array_elements(array);
    PagedArray& values = values_[array].emplace_back(spool_, stride);
    std::vector<std::byte> piece, before;
    for (std::uint64_t first = 0; first < elements; first += kPieceElements) {
      const std::uint64_t count = std::min(kPieceElements, elements - first);
      piece.resize(count * stride);
      steps.read_array(array, 0, first, count, piece.data());
      values.append(count, piece.data());
      if (changes_[array] || is_float(info_.schema.arrays[array].type)) continue;
      before.resize(piece.size());
      first_->read_array(array, 0, first, count, before.data());
      changes_[array] = piece != before;
    }
  }

  std::unique_ptr<MeshSource> first_;
  const SeriesFile file_;  // first file of the series
  Spool& spool_;
  MeshInfo info_;
  bool has_time_ = false;
  // values_[a][s - 1] contains the values of array a at step s. The values at step 0 are read from
  // the first file.
  std::vector<std::vector<PagedArray>> values_;
  std::vector<bool> changes_;  // true for each integer array that changes with time
  std::set<std::string> remarked_;
};

class SteppedLike final : public MeshSource {
 public:
  SteppedLike(std::unique_ptr<MeshSource> mesh, const MeshInfo& like)
      : mesh_(std::move(mesh)), info_(mesh_->info()) {
    std::set<std::pair<Location, std::string>> stepped;
    for (const ArrayInfo& array : like.schema.arrays)
      if (array.per_step) stepped.emplace(array.location, array.name);
    for (ArrayInfo& array : info_.schema.arrays)
      array.per_step |= stepped.contains({array.location, array.name});
  }
  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override {
    mesh_->read_points(first, count, out);
  }
  bool next_cells(CellBatch& out, std::size_t max_cells) override {
    return mesh_->next_cells(out, max_cells);
  }
  void rewind_cells() override { mesh_->rewind_cells(); }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override {
    mesh_->read_array(array, mesh_->info().schema.arrays[array].per_step ? step : 0, first, count,
                      out);
  }

 private:
  std::unique_ptr<MeshSource> mesh_;
  MeshInfo info_;
};

std::unique_ptr<MeshSource> opened(const SeriesFile& file, Spool& spool) {
  std::error_code none;
  const auto status = std::filesystem::status(file.path, none);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
    refuse(file.path, "is not a regular file, so it cannot be part of a series");
  try {
    return open_mesh(file.path, spool);
  } catch (const Failure& failure) {
    Error error = failure.error();
    if (error.file.empty()) error.file = file.path;
    throw Failure(std::move(error));
  }
}

}  // namespace

std::unique_ptr<MeshSource> open_series(std::span<const SeriesFile> files, Spool& spool,
                                        const Progress& progress, const Remark& remark) {
  auto series = std::make_unique<SeriesMesh>(opened(files.front(), spool), files.front(), spool);
  for (std::size_t i = 1; i < files.size(); ++i) {
    if (progress) progress("reading the series", i, files.size());
    Spool own(spool.directory(), spool.memory_budget(), spool.limits());
    const auto mesh = opened(files[i], own);
    series->add(*mesh, files[i], own, remark);
  }
  series->finish();
  return series;
}

std::unique_ptr<MeshSource> series_of_one(std::unique_ptr<MeshSource> mesh, const SeriesFile& file,
                                          Spool& spool) {
  auto series = std::make_unique<SeriesMesh>(std::move(mesh), file, spool);
  if (!series->has_time())
    wrong_use("SOURCE has no time steps and no time in its field data; use --time T");
  series->finish();
  return series;
}

std::unique_ptr<MeshSource> stepped_like(std::unique_ptr<MeshSource> mesh, const MeshInfo& like) {
  return std::make_unique<SteppedLike>(std::move(mesh), like);
}

}  // namespace shm::converters
