#include "programs/mesh_fields.h"

namespace make_mesh {

namespace {

// Converts positions to coordinates 0..1 in the mesh's bounding cube.
class Box {
 public:
  explicit Box(const std::vector<Point3>& points) : low_(points.front()) {
    Point3 high = low_;
    for (const Point3& p : points) {
      low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y), std::min(low_.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    const Point3 size = high - low_;
    scale_ = 1 / std::max({size.x, size.y, size.z});
  }
  Point3 at(const Point3& p) const { return (p - low_) * scale_; }

 private:
  Point3 low_;
  double scale_;
};

double smooth(const Point3& p) {
  return 300 + 50 * std::sin(3 * p.x + 1) * std::cos(4 * p.y) * std::exp(-p.z);
}

// A function of position that resembles turbulence: a sum of waves over five octaves, plus some
// noise.
class Turbulence {
 public:
  Turbulence() {
    for (Wave& wave : waves_) {
      const double number = 2 * kPi * std::exp2(random_.uniform() * 5.5);
      const double height = 2 * random_.uniform() - 1, turn = 2 * kPi * random_.uniform();
      const double flat = std::sqrt(1 - height * height);
      wave = {Point3{flat * std::cos(turn), flat * std::sin(turn), height} * number,
              std::pow(number, -1.0 / 3), 2 * kPi * random_.uniform()};
    }
  }
  double operator()(const Point3& p) {
    double sum = 1e-3 * (random_.uniform() - 0.5);
    for (const Wave& wave : waves_) sum += wave.height * std::cos(dot(wave.vector, p) + wave.phase);
    return sum;
  }

 private:
  struct Wave {
    Point3 vector;
    double height = 0, phase = 0;
  };
  Random random_{11};
  std::array<Wave, 48> waves_;
};

std::vector<Point3> random_sites(std::size_t count) {
  Random random(7);
  std::vector<Point3> sites(count);
  for (Point3& site : sites) site = {random.uniform(), random.uniform(), random.uniform()};
  return sites;
}

std::size_t nearest(const Point3& p, const std::vector<Point3>& sites) {
  std::size_t best = 0;
  double best_distance = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < sites.size(); ++i) {
    const double distance = dot(p - sites[i], p - sites[i]);
    if (distance < best_distance) best_distance = distance, best = i;
  }
  return best;
}

}  // namespace

std::vector<Field> cell_fields(const Mesh& mesh, std::string_view fields) {
  const bool full = fields == "full";
  const Box box(mesh.points);
  const std::vector<Point3> sites = random_sites(12);
  Turbulence turbulence;
  Field temperature{"temperature", "float", 1, {}}, material{"material", "int", 1, {}};
  Field velocity{"velocity", "float", 3, {}}, turbulent{"turbulence", "float", 1, {}};
  for (const Hexahedron& cell : mesh.cells) {
    Point3 sum;
    for (const Id corner : cell) sum = sum + mesh.points[corner];
    const Point3 p = box.at(sum * 0.125);
    temperature.values.push_back(smooth(p));
    if (fields == "one") continue;
    material.values.push_back(static_cast<double>(nearest(p, sites) + 1));
    if (!full) continue;
    velocity.values.insert(
        velocity.values.end(),
        {std::sin(5 * p.y) * std::cos(3 * p.z), std::sin(5 * p.z + p.x), std::cos(4 * p.x) * p.y});
    turbulent.values.push_back(turbulence(p));
  }
  if (fields == "one") return {temperature};
  if (!full) return {temperature, material};
  return {temperature, material, velocity, turbulent};
}

std::vector<Field> point_fields(const Mesh& mesh, std::string_view fields) {
  if (fields != "full") return {};
  const Box box(mesh.points);
  Field pressure{"pressure", "float", 1, {}};
  for (const Point3& point : mesh.points) {
    const Point3 p = box.at(point);
    const double from_front = std::hypot(p.x - 0.3, p.y - 0.4, p.z - 0.2) - 0.45;
    pressure.values.push_back((from_front < 0 ? 1 + 0.2 * p.x : 0.125 + 0.02 * p.y) +
                              0.3 * std::tanh(from_front / 0.003));
  }
  return {pressure};
}

}  // namespace make_mesh
