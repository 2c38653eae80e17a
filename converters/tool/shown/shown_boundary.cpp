#include "tool/shown/shown_boundary.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <tuple>
#include <utility>

#include "archive/archive_files.h"
#include "base/failure.h"
#include "compression/decompress.h"
#include "shm/mesh.h"
#include "shm/mesh_extract.h"

namespace shm::converters {
namespace {

// A RandomSource that reports as progress how much of a file has been read.
class WatchedSource final : public RandomSource {
 public:
  WatchedSource(RandomSource& source, Progress progress)
      : source_(&source), progress_(std::move(progress)) {}
  std::uint64_t size() const override { return source_->size(); }
  Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) override {
    read_ += into.size();
    if (progress_) progress_("reading", std::min(read_, size()), size());
    return source_->read_at(offset, into);
  }
  void prefetch(std::span<const ByteRange> ranges) override { source_->prefetch(ranges); }

 private:
  RandomSource* source_;
  Progress progress_;
  std::uint64_t read_ = 0;
};

std::vector<BoundaryArray> wanted_arrays(const std::optional<ArrayChoice>& choice) {
  std::vector<BoundaryArray> wanted;
  if (!choice) return wanted;
  for (const auto& layer : choice->layers)
    for (const std::uint32_t array : layer) wanted.push_back({array, choice->step.value_or(0)});
  return wanted;
}

class ShownReader {
 public:
  ShownReader(const CommonOptions& options, ToolInput& in, Spool& spool, ProgressLine& line,
              const ShownRequest& request)
      : options_(options), in_(in), spool_(spool), line_(line), request_(request) {}

  ShownBoundary shown() {
    const std::optional<HalfSpace>& kept = request_.kept;
    // If a .shm file supports random access, its boundary is found without temporary files.
    if (in_.is_shm() && !in_.is_stream() && !kept) return of_file();
    line_.expect(
        {{"decoding", 4}, {"finding last uses", 1}, {"streaming cells", 4}, {request_.next, 1}},
        in_.bytes());
    const auto mesh = in_.open(spool_, line_.callback(), request_.threads);
    ShownBoundary shown;
    shown.schema = mesh->info().schema;
    choose_array(mesh->info().step_times.size(), shown);
    shown.boundary =
        boundary_of_mesh(*mesh, wanted_arrays(shown.array), kept, spool_, line_.callback());
    show_points(*mesh, kept, shown);
    return shown;
  }

 private:
  void choose_array(std::uint64_t steps, ShownBoundary& shown) const {
    if (!request_.array.empty())
      shown.array = array_named(request_.array, "--array", shown.schema, steps);
  }

  // If the boundary has no faces, and the caller asked for vertices in this case, replaces the
  // boundary with the vertices of the mesh.
  void show_points(MeshSource& mesh, const std::optional<HalfSpace>& kept,
                   ShownBoundary& shown) const {
    if (!request_.points_instead || shown.boundary.face_count() > 0) return;
    const std::uint64_t left_out = shown.boundary.left_out;
    shown.boundary = points_of_mesh(mesh, wanted_arrays(shown.array), kept, spool_);
    shown.boundary.left_out = left_out;
    shown.only_points = true;
  }

  ShownBoundary of_file() {
    line_.expect({{"reading", 9}, {request_.next, 1}}, in_.bytes());
    const std::string& path = in_.path();
    const auto file = unwrap(FileRandomSource::open(path), path);
    RandomSource* source = file.get();
    std::optional<SectionSource> member;
    if (is_archive(path)) {
      const ArchiveReader archive = unwrap(ArchiveReader::open(*file), path);
      const ArchiveMember& one = part_of(archive.members(), options_.part, options_.input);
      member.emplace(*file, one.offset, one.bytes);
      source = &*member;
    } else if (!options_.part.empty()) {
      wrong_use("--part needs an archive; " + options_.input + " is none");
    }
    WatchedSource watched(*source, line_.callback());
    const ReadLimits limits = read_limits(spool_);
    ShownBoundary shown;
    {
      const MeshExtractor opened = unwrap(MeshExtractor::open(watched, limits), path);
      shown.schema = opened.schema();
      choose_array(opened.step_count(), shown);
    }
    BoundaryOptions options;
    options.arrays = wanted_arrays(shown.array);
    ReadOptions reading;
    reading.threads = request_.threads;
    reading.max_ahead_bytes = std::uint64_t{64} << 20;
    options.subdivide = true;
    shown.boundary = unwrap(read_boundary(watched, options, limits, reading), path);
    if (request_.points_instead && shown.boundary.face_count() == 0)
      show_points(*in_.open(spool_, line_.callback(), request_.threads), std::nullopt, shown);
    return shown;
  }

  const CommonOptions& options_;
  ToolInput& in_;
  Spool& spool_;
  ProgressLine& line_;
  const ShownRequest& request_;
};

// Returns the length of a vector. Scales the components first, so that the squares of very large or
// very small components neither overflow nor underflow.
double length_of(const std::vector<double>& parts) {
  if (parts.size() == 1) return parts[0];
  double most = 0, sum = 0;
  for (const double part : parts) {
    if (!std::isfinite(part)) return std::numeric_limits<double>::quiet_NaN();
    most = std::max(most, std::fabs(part));
  }
  if (most == 0) return 0;
  for (const double part : parts) sum += part / most * (part / most);
  return most * std::sqrt(sum);
}

}  // namespace

Surface ShownBoundary::surface() const {
  Surface surface;
  surface.coordinate_type = boundary.coordinate_type;
  surface.xyz = boundary.xyz;
  surface.face_begin = boundary.face_begin;
  surface.corners = boundary.corners;
  surface.blocks = boundary.blocks;
  surface.inner_edges = inner_edges;
  return surface;
}

void ShownBoundary::find_inner_edges() {
  struct Edge {
    std::uint32_t low, high;
    std::size_t corner;  // index in boundary.corners
    bool is_same(const Edge& other) const { return low == other.low && high == other.high; }
  };
  inner_edges.assign(boundary.corners.size(), 0);
  std::vector<Edge> edges;  // edges of the faces of one side
  for (std::size_t first = 0, end = 0; first < boundary.face_count(); first = end) {
    const auto is_of_side = [&](std::size_t f) {
      return boundary.cell_numbers[f] == boundary.cell_numbers[first] &&
             boundary.sides[f] == boundary.sides[first];
    };
    for (end = first + 1; end < boundary.face_count() && is_of_side(end);) ++end;
    if (end == first + 1) continue;
    edges.clear();
    for (std::size_t f = first; f < end; ++f) {
      const auto begin = static_cast<std::size_t>(boundary.face_begin[f]),
                 stop = static_cast<std::size_t>(boundary.face_begin[f + 1]);
      for (std::size_t c = begin; c < stop; ++c) {
        const auto [low, high] =
            std::minmax(boundary.corners[c], boundary.corners[c + 1 < stop ? c + 1 : begin]);
        edges.push_back({low, high, c});
      }
    }
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
      return std::tie(a.low, a.high, a.corner) < std::tie(b.low, b.high, b.corner);
    });
    for (std::size_t e = 0; e + 1 < edges.size(); ++e)
      if (edges[e].is_same(edges[e + 1]))
        inner_edges[edges[e].corner] = inner_edges[edges[e + 1].corner] = 1;
  }
}

ShownBoundary shown_boundary(const CommonOptions& options, ToolInput& in, Spool& spool,
                             ProgressLine& line, const ShownRequest& request) {
  return ShownReader(options, in, spool, line, request).shown();
}

std::vector<double> values_of(ShownBoundary& shown) {
  const Schema& schema = shown.schema;
  BoundarySurface& boundary = shown.boundary;
  const bool of_points = shown.array->location == Location::point;
  const std::size_t count = of_points ? boundary.vertex_count() : boundary.face_count();
  std::vector<double> values(count, std::numeric_limits<double>::quiet_NaN());
  std::vector<bool> has_value(count);
  std::size_t place = 0;
  for (const auto& layer : shown.array->layers) {
    std::vector<std::vector<double>> numbers;
    for (const std::uint32_t array : layer) {
      auto bytes = std::exchange(boundary.arrays[place++], {});
      numbers.push_back(numbers_as<double>(schema.arrays[array].type, bytes));
    }
    std::vector<double> parts;
    for (std::size_t i = 0; i < count; ++i) {
      if (has_value[i]) continue;
      parts.clear();
      bool is_covered = true;
      for (std::size_t a = 0; a < layer.size(); ++a) {
        is_covered = is_covered && (of_points || schema.array_covers(layer[a], boundary.blocks[i]));
        const std::size_t components = schema.arrays[layer[a]].components;
        for (std::size_t c = 0; c < components && (i + 1) * components <= numbers[a].size(); ++c)
          parts.push_back(numbers[a][i * components + c]);
      }
      if (!is_covered || parts.empty()) continue;
      values[i] = length_of(parts);
      has_value[i] = true;
    }
  }
  return values;
}

void put_in_mesh_order(BoundarySurface& boundary, bool values_of_points,
                       std::vector<double>& values) {
  std::vector<std::uint32_t> vertices(boundary.vertex_count());
  std::iota(vertices.begin(), vertices.end(), 0U);
  std::sort(vertices.begin(), vertices.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(boundary.vertex_numbers[a], a) < std::pair(boundary.vertex_numbers[b], b);
  });
  std::vector<std::uint32_t> faces(boundary.face_count());
  std::iota(faces.begin(), faces.end(), 0U);
  const auto place_of = [&](std::uint32_t f) {
    return std::tuple(boundary.cell_numbers[f], boundary.sides[f], f);
  };
  std::sort(faces.begin(), faces.end(),
            [&](std::uint32_t a, std::uint32_t b) { return place_of(a) < place_of(b); });

  BoundarySurface ordered;
  ordered.coordinate_type = boundary.coordinate_type;
  ordered.left_out = boundary.left_out;
  std::vector<std::uint32_t> numbers(vertices.size());
  const std::size_t stride = 3 * scalar_bytes(boundary.coordinate_type);
  ordered.xyz.reserve(boundary.xyz.size());
  for (const std::uint32_t vertex : vertices) {
    numbers[vertex] = static_cast<std::uint32_t>(ordered.vertex_numbers.size());
    ordered.vertex_numbers.push_back(boundary.vertex_numbers[vertex]);
    const auto* const from = boundary.xyz.data() + vertex * stride;
    ordered.xyz.insert(ordered.xyz.end(), from, from + stride);
  }
  ordered.face_begin.push_back(0);
  ordered.corners.reserve(boundary.corners.size());
  for (const std::uint32_t face : faces) {
    const auto begin = static_cast<std::ptrdiff_t>(ordered.corners.size());
    for (auto c = static_cast<std::size_t>(boundary.face_begin[face]);
         c < boundary.face_begin[face + 1]; ++c)
      ordered.corners.push_back(numbers[boundary.corners[c]]);
    const auto first = ordered.corners.begin() + begin;
    if (boundary.sides[face] > 0)
      std::rotate(first, std::min_element(first, ordered.corners.end()), ordered.corners.end());
    ordered.face_begin.push_back(ordered.corners.size());
    ordered.cell_numbers.push_back(boundary.cell_numbers[face]);
    ordered.blocks.push_back(boundary.blocks[face]);
    ordered.sides.push_back(boundary.sides[face]);
  }
  boundary = std::move(ordered);
  if (values.empty()) return;
  std::vector<double> ordered_values;
  ordered_values.reserve(values.size());
  for (const std::uint32_t of : values_of_points ? vertices : faces)
    ordered_values.push_back(values[of]);
  values = std::move(ordered_values);
}

Json array_json(const ShownBoundary& shown, const std::optional<ShownRange>& range) {
  if (!shown.array) return nullptr;
  Json array = {{"name", shown.array->name},
                {"location", shown.array->location == Location::point ? "point" : "cell"},
                {"step", nullptr},
                {"least", nullptr},
                {"greatest", nullptr}};
  if (shown.array->step) array["step"] = *shown.array->step;
  if (range) array["least"] = range->least;
  if (range) array["greatest"] = range->greatest;
  return array;
}

}  // namespace shm::converters
