#include "compare/names.h"

#include <algorithm>
#include <string_view>

#include "base/failure.h"

namespace shm::converters {
namespace {

constexpr std::string_view kCoordinates = "coordinates";

// Returns true if `name` is the whole path or its last part. For example, "T" matches "point/T" and
// "cell/T".
bool fits(const std::string& name, const std::string& path) {
  if (name == path) return true;
  const std::size_t slash = path.find('/');
  return slash != path.npos && path.compare(slash + 1, path.npos, name) == 0;
}

// Returns true if `name` is the key of the extra, or a parent path of the key ("vtk" for the key
// "vtk/skeleton").
bool fits_extra(const std::string& name, const std::string& key) {
  return key.compare(0, name.size(), name) == 0 &&
         (key.size() == name.size() || key[name.size()] == '/');
}

bool is_array(const std::string& name, const MeshInfo& info) {
  constexpr std::string_view kPrefix = "array:";
  for (std::size_t a = 0; a < info.schema.arrays.size(); ++a)
    if (fits(name, array_stream_name(info.schema, a).substr(kPrefix.size()))) return true;
  return false;
}

bool is_extra(const std::string& name, const MeshInfo& info) {
  return std::any_of(info.extras.begin(), info.extras.end(),
                     [&](const Extra& extra) { return fits_extra(name, extra.key); });
}

void check_accuracy(const Accuracy& accuracy, const std::string& option) {
  using enum Accuracy::Kind;
  if (accuracy.kind == bits || accuracy.kind == rms || accuracy.kind == psnr)
    wrong_use(option + ": bits, rms and psnr are not tolerances; use abs=E, rel=E or lossless");
}

}  // namespace

DiffNames::DiffNames(const DiffOptions& options, const MeshInfo& a, const MeshInfo& b)
    : options_(options) {
  const auto require_array = [&](const std::string& name, const char* option) {
    if (!is_array(name, a) && !is_array(name, b))
      wrong_use(std::string(option) + ": neither mesh has an array '" + name + "'");
  };
  check_accuracy(options.tolerance.coordinates, "tolerance");
  check_accuracy(options.tolerance.fields, "tolerance");
  for (const auto& [name, accuracy] : options.tolerance.named) {
    check_accuracy(accuracy, "--array");
    if (name != kCoordinates) require_array(name, "--array");
  }
  for (const std::string& name : options.only) require_array(name, "--only");
  for (const std::string& name : options.ignored)
    if (name != kCoordinates && !is_extra(name, a) && !is_extra(name, b))
      require_array(name, "--ignore");
}

bool DiffNames::is_ignored(const std::string& path) const {
  return std::any_of(options_.ignored.begin(), options_.ignored.end(),
                     [&](const std::string& name) { return fits(name, path); });
}

bool DiffNames::is_wanted(const std::string& path) const {
  if (is_ignored(path)) return false;
  return options_.only.empty() ||
         std::any_of(options_.only.begin(), options_.only.end(),
                     [&](const std::string& name) { return fits(name, path); });
}

bool DiffNames::is_ignored_extra(const std::string& key) const {
  return std::any_of(options_.ignored.begin(), options_.ignored.end(),
                     [&](const std::string& name) { return fits_extra(name, key); });
}

Accuracy DiffNames::accuracy_of(const std::string& path) const {
  for (const auto& [name, accuracy] : options_.tolerance.named)
    if (fits(name, path)) return accuracy;
  return options_.tolerance.fields;
}

Accuracy DiffNames::accuracy_of_coordinates() const {
  for (const auto& [name, accuracy] : options_.tolerance.named)
    if (name == kCoordinates) return accuracy;
  return options_.tolerance.coordinates;
}

}  // namespace shm::converters
