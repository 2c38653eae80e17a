#include "programs/mesh_file.h"

#include <bit>
#include <cstdio>
#include <cstring>
#include <string>

#include "programs/mesh_fields.h"

namespace make_mesh {

namespace {

class VtkFile {
 public:
  explicit VtkFile(const char* path) : file_(std::fopen(path, "wb")) {}
  VtkFile(const VtkFile&) = delete;
  VtkFile& operator=(const VtkFile&) = delete;
  ~VtkFile() {
    if (file_ != nullptr) std::fclose(file_);
  }
  void text(const std::string& line) { bytes(line.data(), line.size()); }
  // Writes a number in big-endian order, as VTK requires.
  template <class T>
  void number(T value) {
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), &value, sizeof(T));
    if constexpr (std::endian::native == std::endian::little) std::reverse(raw.begin(), raw.end());
    bytes(raw.data(), raw.size());
  }
  // Closes the file. Returns true if every byte has been written.
  bool close() {
    if (file_ == nullptr) return false;
    const bool closed = std::fclose(std::exchange(file_, nullptr)) == 0;
    return good_ && closed;
  }

 private:
  void bytes(const char* data, std::size_t size) {
    if (file_ == nullptr || std::fwrite(data, 1, size, file_) != size) good_ = false;
  }
  std::FILE* file_;
  bool good_ = true;
};

void write_fields(VtkFile& file, std::string_view section, std::size_t elements,
                  const std::vector<Field>& fields) {
  if (fields.empty()) return;
  file.text(std::string(section) + " " + std::to_string(elements) + "\nFIELD FieldData " +
            std::to_string(fields.size()) + "\n");
  for (const Field& field : fields) {
    file.text(field.name + " " + std::to_string(field.components) + " " + std::to_string(elements) +
              " " + std::string(field.type) + "\n");
    for (const double value : field.values)
      if (field.type == "int")
        file.number(static_cast<std::int32_t>(value));
      else
        file.number(static_cast<float>(value));
    file.text("\n");
  }
}

}  // namespace

bool write_mesh(const Mesh& mesh, const MeshFile& how) {
  VtkFile file(how.path);
  file.text("# vtk DataFile Version 4.2\n" + std::string(how.title) +
            "\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS " + std::to_string(mesh.points.size()) +
            (how.doubles ? " double\n" : " float\n"));
  for (const Point3& p : mesh.points)
    for (const double coordinate : {p.x, p.y, p.z})
      if (how.doubles)
        file.number(coordinate);
      else
        file.number(static_cast<float>(coordinate));
  file.text("\nCELLS " + std::to_string(mesh.cells.size()) + " " +
            std::to_string(9 * mesh.cells.size()) + "\n");
  for (const Hexahedron& cell : mesh.cells) {
    file.number(std::int32_t{8});
    for (const Id corner : cell) file.number(static_cast<std::int32_t>(corner));
  }
  file.text("\nCELL_TYPES " + std::to_string(mesh.cells.size()) + "\n");
  for (std::size_t i = 0; i < mesh.cells.size(); ++i) file.number(std::int32_t{12});
  file.text("\n");
  if (how.fields != "none") {
    write_fields(file, "CELL_DATA", mesh.cells.size(), cell_fields(mesh, how.fields));
    write_fields(file, "POINT_DATA", mesh.points.size(), point_fields(mesh, how.fields));
  }
  return file.close();
}

}  // namespace make_mesh
