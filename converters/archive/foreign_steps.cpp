#include "archive/foreign_steps.h"

#include <algorithm>
#include <cstring>
#include <set>
#include <string_view>
#include <utility>

#include "base/failure.h"
#include "compare/mesh_diff.h"
#include "formats/formats.h"
#include "interface/format.h"

namespace shm::converters {
namespace {

// A view of a mesh that omits its time steps and some of its arrays.
class SomeArrays final : public ForwardingMesh {
 public:
  SomeArrays(MeshSource& source, const std::set<std::size_t>& left_out) : ForwardingMesh(source) {
    info_ = source.info();
    info_.step_times.clear();
    info_.schema.arrays.clear();
    for (std::size_t a = 0; a < source.info().schema.arrays.size(); ++a) {
      if (left_out.contains(a)) continue;
      info_.schema.arrays.push_back(source.info().schema.arrays[a]);
      arrays_.push_back(a);
    }
  }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override {
    source_.read_array(arrays_[array], step, first, count, out);
  }

 private:
  std::vector<std::size_t> arrays_;
};

std::string words(const Finding& finding) {
  std::string text = finding.what;
  if (finding.different > 0)
    return text + ": " + std::to_string(finding.different) + " of " +
           std::to_string(finding.compared) + " differ";
  if (!finding.a.empty() || !finding.b.empty()) return text + ": " + finding.a + ", " + finding.b;
  return text + ": " + finding.kind;
}

}  // namespace

ForeignSteps::ForeignSteps(MeshSource& mesh, MeshSource& source, std::optional<double> time,
                           Spool& spool)
    : ForwardingMesh(mesh), other_(source), spool_(spool) {
  info_ = mesh.info();
  info_.extras = {};
  info_.step_times = source.info().step_times;
  if (info_.step_times.empty()) {
    Keys used;
    if (!time) time = source_format(source.info()).time(source.info(), used);
    if (!time)
      throw Failure(ErrorCode::misuse,
                    "SOURCE has no time steps and no time in its field data; use --time T");
    info_.step_times = {*time};
  }
  fields_ = pair_fields(info_, source.info(), false, false);
  mesh_readers_.resize(fields_.pairs.size());
  other_readers_.resize(fields_.pairs.size());
  pair_arrays();
}

void ForeignSteps::pair_arrays() {
  const Schema& schema = info_.schema;
  parts_.resize(schema.arrays.size());
  for (std::size_t p = 0; p < fields_.pairs.size(); ++p) {
    const FieldPair& pair = fields_.pairs[p];
    for (std::uint32_t c = 0; c < pair.a.parts.size(); ++c) {
      const FieldSide::Part& part = pair.a.parts[c];
      if (part.array == FieldSide::kZeros || pair.a.type != pair.b.type) continue;
      auto& of_array = parts_[part.array];
      of_array.resize(schema.arrays[part.array].components, {fields_.pairs.size(), 0});
      of_array[part.component] = {p, c};
    }
  }
  for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
    if (!schema.arrays[a].per_step) continue;
    const auto& parts = parts_[a];
    if (parts.empty() || std::any_of(parts.begin(), parts.end(), [&](const Part& part) {
          return part.pair == fields_.pairs.size();
        }))
      missing_.push_back("array '" + schema.arrays[a].name +
                         "': SOURCE has no array of this name and type");
  }
}

FieldReader& ForeignSteps::reader(std::size_t pair, bool of_mesh) {
  auto& found = (of_mesh ? mesh_readers_ : other_readers_)[pair];
  const FieldPair& field = fields_.pairs[pair];
  if (!found)
    found = of_mesh ? std::make_unique<FieldReader>(source_, field, field.a, spool_)
                    : std::make_unique<FieldReader>(other_, field, field.b, spool_);
  return *found;
}

void ForeignSteps::read_array(std::size_t array, std::uint64_t step, std::uint64_t first,
                              std::uint64_t count, std::byte* out) {
  const ArrayInfo& info = info_.schema.arrays[array];
  if (!info.per_step) return source_.read_array(array, step, first, count, out);
  const std::size_t bytes = scalar_bytes(info.type), stride = bytes * info.components;
  std::vector<std::uint64_t> entities;
  std::vector<std::byte> values;
  for (std::uint32_t c = 0; c < info.components; ++c) {
    const Part& part = parts_[array][c];
    FieldReader& from = reader(part.pair, false);
    reader(part.pair, true).entities(first, count, entities);
    const std::size_t other_stride = from.stride();
    for (std::uint64_t i = 0; i < count;) {
      const auto element = from.element_of(entities[i]);
      if (!element)
        throw Failure(Error{.code = ErrorCode::unsupported,
                            .detail = "SOURCE has no value of cell " + std::to_string(entities[i]),
                            .section = "array '" + info.name + "'"});
      // length of the run of elements, starting with element i, that are consecutive in both files
      std::uint64_t run = 1;
      while (i + run < count && entities[i + run] == entities[i] + run &&
             from.element_of(entities[i + run]) == *element + run)
        ++run;
      values.resize(run * other_stride);
      from.read(step, *element, run, values.data());
      for (std::uint64_t k = 0; k < run; ++k)
        std::memcpy(out + (i + k) * stride + c * bytes,
                    values.data() + k * other_stride + part.component * bytes, bytes);
      i += run;
    }
  }
}

std::vector<std::string> ForeignSteps::differences(const Progress& progress) {
  std::set<std::size_t> stepped, their_values;
  for (std::size_t a = 0; a < info_.schema.arrays.size(); ++a)
    if (info_.schema.arrays[a].per_step) stepped.insert(a);
  for (const FieldPair& pair : fields_.pairs)
    if (pair.a.per_step)
      for (const FieldSide::Part& part : pair.b.parts) their_values.insert(part.array);
  const Schema& theirs = other_.info().schema;
  for (std::size_t a = 0; a < theirs.arrays.size(); ++a)
    if (theirs.arrays[a].per_step) their_values.insert(a);
  DiffOptions options;
  options.with_extras = false;
  // Arrays with a role (a purpose in the source format, such as Exodus node numbers) are compared
  // only if both meshes have the same source format. In that case, no array may be removed from the
  // meshes, because some roles refer to other arrays by index. Arrays that change with time are
  // excluded by `ignored` instead.
  options.with_roles = info_.schema.source_format == theirs.source_format;
  if (options.with_roles) {
    constexpr std::size_t kPrefix = std::string_view("array:").size();
    const std::vector<std::string> names = array_stream_names(info_.schema);
    for (const std::size_t a : stepped) options.ignored.push_back(names[a].substr(kPrefix));
    stepped.clear();
    their_values.clear();
  }
  SomeArrays mesh(source_, stepped), other(other_, their_values);
  std::vector<std::string> differences = missing_;
  for (const Finding& finding : diff_meshes(mesh, other, options, spool_, progress).differences)
    if (finding.kind != "only_in_b") differences.push_back(words(finding));
  return differences;
}

}  // namespace shm::converters
