#include "openmesh/surface_file.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "openmesh/polygons.h"

#ifdef SHM_HAS_OPENMESH
#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/Observer.hh>
#include <locale>
#include <ostream>
#include <streambuf>

#include "openmesh/decimation.h"
#endif

namespace shm::converters {

std::optional<SurfaceFormat> surface_format(std::string_view word) {
  if (word == "ply") return SurfaceFormat::ply;
  if (word == "stl") return SurfaceFormat::stl;
  if (word == "obj") return SurfaceFormat::obj;
  return std::nullopt;
}

#ifdef SHM_HAS_OPENMESH

namespace {

struct SurfaceTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
  using Color = OpenMesh::Vec3uc;
};
using PolygonMesh = OpenMesh::PolyMesh_ArrayKernelT<SurfaceTraits>;
using TriangleMesh = OpenMesh::TriMesh_ArrayKernelT<SurfaceTraits>;

// Stream buffer to which OpenMesh's writers write. The writers do not check for errors, so this
// class stores the first error.
class SinkBuffer final : public std::streambuf {
 public:
  explicit SinkBuffer(ByteSink& sink) : sink_(&sink), buffer_(std::size_t{1} << 16) { empty(); }
  Result<void> finish() {
    flush();
    return result_;
  }

 protected:
  int_type overflow(int_type letter) override {
    flush();
    if (traits_type::eq_int_type(letter, traits_type::eof())) return traits_type::not_eof(letter);
    *pptr() = traits_type::to_char_type(letter);
    pbump(1);
    return letter;
  }
  int sync() override { return 0; }  // OpenMesh's writers flush too often

 private:
  void empty() { setp(buffer_.data(), buffer_.data() + buffer_.size()); }
  void flush() {
    if (result_)
      result_ = sink_->write(
          std::as_bytes(std::span(pbase(), static_cast<std::size_t>(pptr() - pbase()))));
    empty();
  }

  ByteSink* sink_;
  std::vector<char> buffer_;
  Result<void> result_;
};

// Stops OpenMesh from printing messages to the standard streams.
class SilentOpenMesh {
 public:
  SilentOpenMesh() {
    omlog().disable();
    omout().disable();
    omerr().disable();
  }
};

class DecimationProgress final : public OpenMesh::Decimater::Observer {
 public:
  DecimationProgress(const Progress& progress, std::uint64_t collapses)
      : Observer(kCollapsesAtOnce), progress_(progress), collapses_(collapses) {}
  void notify(std::size_t collapse) override {
    if (progress_)
      progress_("decimating", std::min<std::uint64_t>(collapse, collapses_), collapses_);
  }

 private:
  static constexpr std::size_t kCollapsesAtOnce = 4096;
  const Progress& progress_;
  std::uint64_t collapses_;
};

template <class MeshType>
class SurfaceMesh {
 public:
  SurfaceMesh(const Surface& surface, const Polygons& polygons)
      : surface_(surface), polygons_(polygons) {
    mesh_.add_property(block_, "block");
    // The property must be persistent, because OpenMesh's writers store no other properties.
    mesh_.property(block_).set_persistent(true);
    mesh_.add_property(vertex_of_);
    mesh_.add_property(face_of_);
  }

  // Adds the polygons to the mesh. Returns ErrorCode::unsupported if OpenMesh does not accept a
  // polygon.
  Result<void> fill(const Progress& progress) {
    const std::size_t faces = polygons_.face_count(), sides = polygons_.corners.size();
    mesh_.reserve(polygons_.vertices.size(), sides / 2 + sides / 4, faces);
    for (const std::uint32_t vertex : polygons_.vertices) {
      const auto added = mesh_.add_vertex(place_of_vertex(vertex));
      mesh_.property(vertex_of_, added) = vertex;
    }
    std::vector<OpenMesh::VertexHandle> ring;
    for (std::size_t f = 0; f < faces; ++f) {
      ring.clear();
      for (const std::uint32_t corner : polygons_.face(f))
        ring.emplace_back(static_cast<int>(corner));
      const auto added = mesh_.add_face(ring);
      const std::uint32_t face = polygons_.faces[f];
      if (!added.is_valid())
        return Error{
            .code = ErrorCode::unsupported,
            .detail = "OpenMesh does not accept face " + std::to_string(face) + " of the surface"};
      mesh_.property(face_of_, added) = face;
      mesh_.property(block_, added) = static_cast<int>(surface_.blocks[face]);
      if (progress && f % kFacesAtOnce == 0) progress("joining faces", f, faces);
    }
    return {};
  }

  // Decimates the mesh until it has at most `left` triangles, or until no further edge can be
  // collapsed. The mesh must consist of triangles.
  void decimate(std::uint64_t left, const Progress& progress) {
    using Module = OutlineQuadrics<MeshType>;
    const std::uint64_t before = mesh_.n_faces();
    if (before <= left) return;
    to_unit_places();
    {
      OpenMesh::Decimater::DecimaterT<MeshType> decimater(mesh_);
      typename Module::Handle module;
      decimater.add(module);
      decimater.initialize();
      DecimationProgress observer(progress, (before - left) / 2);
      decimater.set_observer(&observer);
      decimater.decimate_to_faces(0, static_cast<std::size_t>(left));
      mesh_.delete_isolated_vertices();
      mesh_.garbage_collection();
    }
    for (const auto vertex : mesh_.vertices())
      mesh_.set_point(vertex, place_of_vertex(mesh_.property(vertex_of_, vertex)));
  }

  Result<void> write(const SurfaceFileOptions& options, ByteSink& out) {
    using OpenMesh::IO::Options;
    Options how = Options::Binary;
    how += Options::LSB;
    how += Options::Custom;
    const char* extension = ".ply";
    if (options.format == SurfaceFormat::stl) {
      how = Options::Binary;
      extension = ".stl";
    } else if (options.format == SurfaceFormat::obj) {
      how = Options::Default;
      extension = ".obj";
    } else if (options.colours != nullptr) {
      how += options.colours->of_points ? Options::VertexColor : Options::FaceColor;
      set_colours(*options.colours);
    }
    SinkBuffer buffer(out);
    std::ostream stream(&buffer);
    stream.imbue(std::locale::classic());
    constexpr std::streamsize kDigits = std::numeric_limits<float>::max_digits10;
    const bool done = OpenMesh::IO::write_mesh(mesh_, stream, extension, how, kDigits);
    if (auto written = buffer.finish(); !written) return written;
    if (!done)
      return Error{.code = ErrorCode::output, .detail = "OpenMesh did not write the surface"};
    return {};
  }

  std::uint64_t vertices() const { return mesh_.n_vertices(); }
  std::uint64_t faces() const { return mesh_.n_faces(); }
  std::uint64_t rounded() const {
    std::uint64_t count = 0;
    for (const auto vertex : mesh_.vertices()) {
      const auto& place = mesh_.point(vertex);
      count += std::any_of(place.begin(), place.end(), [](double x) {
        return static_cast<double>(static_cast<float>(x)) != x;
      });
    }
    return count;
  }

 private:
  static constexpr std::size_t kFacesAtOnce = 4096;

  OpenMesh::Vec3d place_of_vertex(std::uint32_t vertex) const {
    return {surface_.coordinate(vertex, 0), surface_.coordinate(vertex, 1),
            surface_.coordinate(vertex, 2)};
  }

  // Moves the centre of the mesh to the origin, and scales it so that the longest side of its
  // bounding box extends from -1 to 1. Even the fourth powers of such coordinates cannot overflow.
  void to_unit_places() {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    OpenMesh::Vec3d least(kFar, kFar, kFar), most(-kFar, -kFar, -kFar);
    for (const auto vertex : mesh_.vertices()) {
      least.minimize(mesh_.point(vertex));
      most.maximize(mesh_.point(vertex));
    }
    const OpenMesh::Vec3d middle = (least + most) * .5;
    const double half = (most - least).max() * .5;
    for (const auto vertex : mesh_.vertices())
      mesh_.set_point(vertex,
                      half > 0 ? (mesh_.point(vertex) - middle) / half : OpenMesh::Vec3d(0, 0, 0));
  }

  void set_colours(const SurfaceColours& colours) {
    const auto colour = [&](std::uint32_t of) {
      const Rgb one = colours.colours[of];
      return OpenMesh::Vec3uc(one.red, one.green, one.blue);
    };
    if (colours.of_points) {
      mesh_.request_vertex_colors();
      for (const auto vertex : mesh_.vertices())
        mesh_.set_color(vertex, colour(mesh_.property(vertex_of_, vertex)));
    } else {
      mesh_.request_face_colors();
      for (const auto face : mesh_.faces())
        mesh_.set_color(face, colour(mesh_.property(face_of_, face)));
    }
  }

  const Surface& surface_;
  const Polygons& polygons_;
  MeshType mesh_;
  OpenMesh::FPropHandleT<int> block_;
  OpenMesh::VPropHandleT<std::uint32_t> vertex_of_;  // vertex number in the surface
  OpenMesh::FPropHandleT<std::uint32_t> face_of_;
};

template <class MeshType>
Result<void> write_polygons(const Surface& surface, const Polygons& polygons,
                            const SurfaceFileOptions& options, ByteSink& out,
                            const Progress& progress, WrittenSurface& written) {
  SurfaceMesh<MeshType> mesh(surface, polygons);
  if (auto filled = mesh.fill(progress); !filled) return filled;
  if constexpr (MeshType::is_trimesh()) {
    written.triangles_before = mesh.faces();
    mesh.decimate(*options.decimate, progress);
  }
  written.vertices = mesh.vertices();
  written.faces = mesh.faces();
  written.rounded = mesh.rounded();
  return mesh.write(options, out);
}

}  // namespace

bool can_write_surfaces() { return true; }

Result<WrittenSurface> write_surface(const Surface& surface, const SurfaceFileOptions& options,
                                     ByteSink& out, const Progress& progress) {
  if (options.colours != nullptr && options.format != SurfaceFormat::ply)
    return Error{.code = ErrorCode::misuse, .detail = "colours need a .ply file"};
  static const SilentOpenMesh silent;
  const bool triangles = options.format == SurfaceFormat::stl || options.decimate;
  const auto polygons = polygons_of(surface, {triangles});
  if (!polygons) return polygons.error();
  WrittenSurface written;
  written.copies = polygons->copies;
  written.lines_and_points = polygons->lines_and_points;
  written.collapsed = polygons->collapsed;
  written.not_finite = polygons->not_finite;
  const auto write = options.decimate ? write_polygons<TriangleMesh> : write_polygons<PolygonMesh>;
  if (auto done = write(surface, *polygons, options, out, progress, written); !done)
    return done.error();
  return written;
}

#else

bool can_write_surfaces() { return false; }

Result<WrittenSurface> write_surface(const Surface& /*surface*/,
                                     const SurfaceFileOptions& /*options*/, ByteSink& /*out*/,
                                     const Progress& /*progress*/) {
  return Error{.code = ErrorCode::unsupported, .detail = "this build has no OpenMesh"};
}

#endif

}  // namespace shm::converters
