// Reads VTK legacy files: one walk through the file records where everything stands; numbers are
// fetched later.
#include <algorithm>
#include <cstring>
#include <utility>

#include "base/failure.h"
#include "base/stored_value.h"
#include "mesh/extras.h"
#include "vtk/legacy/parser.h"
#include "vtk/legacy/vtk.h"

namespace shm::converters {
namespace vtk {
namespace {

constexpr std::string_view kMagic = "# vtk datafile version";
constexpr std::uint64_t kPointsAtOnce = 8192;

std::string upper_case(std::string_view text) {
  std::string upper(text);
  for (char& c : upper)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return upper;
}

}  // namespace

bool VtkSource::next_cells(CellBatch& out, std::size_t max_cells) {
  out.clear();
  if (!lattice_) {
    for (CellTable& list : lists_) list.next_cells(out, max_cells - out.size());
    return out.size() > 0;
  }
  for (; out.size() < max_cells && lattice_cell_ < lattice_->cells(); ++lattice_cell_) {
    const auto corners = lattice_->corners(lattice_cell_);
    out.blocks.push_back(0);
    out.corners.insert(out.corners.end(), corners.begin(), corners.end());
    out.corner_begin.push_back(out.corners.size());
  }
  return out.size() > 0;
}

void VtkSource::rewind_cells() {
  lattice_cell_ = 0;
  for (CellTable& list : lists_) list.rewind();
}

void VtkSource::read_array(std::size_t array, std::uint64_t, std::uint64_t first,
                           std::uint64_t count, std::byte* out) {
  const std::uint64_t components = info_.schema.arrays[array].components;
  arrays_[array].read(first * components, count * components, out);
}

void VtkSource::read_points(std::uint64_t first, std::uint64_t count, std::byte* out) {
  if (makes_points_) return lattice_points_.read(*lattice_, first, count, out);
  if (is_float(points_.type())) return points_.read(first * 3, count * 3, out);
  // Integer coordinates go out as double.
  std::vector<std::byte> piece(kPointsAtOnce * scalar_bytes(points_.type()));
  std::uint64_t at = first * 3;
  const std::uint64_t end = (first + count) * 3;
  while (at < end) {
    const std::uint64_t n = std::min(end - at, kPointsAtOnce);
    points_.read(at, n, piece.data());
    with_scalar(points_.type(), [&](auto zero) {
      for (std::uint64_t i = 0; i < n; ++i, out += sizeof(double)) {
        auto value = zero;
        std::memcpy(&value, piece.data() + i * sizeof value, sizeof value);
        const auto wide = static_cast<double>(value);
        std::memcpy(out, &wide, sizeof wide);
      }
    });
    at += n;
  }
}

void Parser::parse() {
  header();
  dataset();
  while (true) {
    const std::string word = lower_case(input_.word_or_end());
    if (word.empty()) break;
    if (section_keyword(word) || attribute_keyword(word)) continue;
    input_.fail(ErrorCode::corrupt,
                "'" + word.substr(0, 40) + "' is not a keyword that can stand here");
  }
  finish();
}

void Parser::finish() {
  input_.enter("");
  if (is_lattice(skeleton_.dataset)) finish_lattice();
  info_.extras.push_back(text_extra("vtk/skeleton", to_text(skeleton_)));
  if (!is_lattice(skeleton_.dataset)) finish_cells();
}

void Parser::header() {
  input_.enter("header");
  const std::string first = input_.line();
  if (lower_case(first.substr(0, kMagic.size())) != kMagic)
    input_.fail(ErrorCode::corrupt, "is not a VTK legacy file");
  std::string version = first.substr(kMagic.size());
  version.erase(0, version.find_first_not_of(" \t"));
  version.erase(version.find_last_not_of(" \t") + 1);
  double number = 0;
  if (!TextInput::parse(version, number) || version.size() < 3 || version.size() > 8 ||
      version[1] != '.' || !(number >= 1))
    input_.fail(ErrorCode::corrupt, "the version is not one of 1.0 to 5.1");
  if (number >= 5.2) input_.fail(ErrorCode::unsupported, "versions beyond 5.1 are not known");
  skeleton_.version = version;
  skeleton_.title = input_.line();
  const std::string encoding = lower_case(input_.word());
  if (encoding != "ascii" && encoding != "binary")
    input_.fail(ErrorCode::corrupt, "the third line is neither ASCII nor BINARY");
  skeleton_.binary = encoding == "binary";
  if (skeleton_.binary) binary_file_ = std::make_shared<RandomFile>(path_);
}

void Parser::dataset() {
  input_.enter("DATASET");
  const std::string keyword = lower_case(input_.word());
  if (keyword == "field")
    input_.fail(ErrorCode::unsupported, "the file has a FIELD only, and no mesh");
  if (keyword != "dataset") input_.fail(ErrorCode::corrupt, "DATASET should stand here");
  const std::string word = upper_case(input_.word());
  const auto dataset = dataset_of_word(word);
  if (!dataset)
    input_.fail(ErrorCode::unsupported,
                "the data set is '" + word.substr(0, 40) +
                    "', which is not read; UNSTRUCTURED_GRID, STRUCTURED_GRID, RECTILINEAR_GRID, "
                    "STRUCTURED_POINTS and POLYDATA are");
  skeleton_.dataset = *dataset;
  info_.schema.source_format = "vtk";
}

bool Parser::section_keyword(const std::string& word) {
  if (word == "cell_data" || word == "point_data") {
    begin_section(word == "cell_data" ? EntryKind::cell_data : EntryKind::point_data);
  } else if (word == "metadata") {
    std::string ignored;  // of nothing that VTK knows
    input_.skip_line();
    read_metadata(0, ignored);
  } else if (word == "field") {
    field();
  } else if (section_ != Section::dataset) {
    return false;
  } else if (word == "cell_types" && skeleton_.dataset == Dataset::unstructured_grid) {
    cell_types();
  } else {
    const auto kind = kind_of_keyword(upper_case(word));
    return kind && geometry_keyword(*kind);
  }
  return true;
}

bool Parser::attribute_keyword(const std::string& word) {
  if (section_ == Section::dataset) return false;
  const auto kind = kind_of_keyword(upper_case(word));
  if (!kind || !is_attribute(*kind)) return false;
  input_.enter(std::string(keyword(*kind)));
  if (*kind == EntryKind::lookup_table) {
    lookup_table();
  } else {
    attribute(*kind);
  }
  return true;
}

std::uint64_t Parser::product(std::uint64_t a, std::uint64_t b) {
  std::uint64_t result = 0;
  if (__builtin_mul_overflow(a, b, &result))
    input_.fail(ErrorCode::corrupt, "states more values than a file can hold");
  return result;
}

// VTK reads no line end behind the announcement of an empty array.
Values Parser::column(ScalarType type, std::uint64_t count) {
  if (count > 0) next_line_is_binary();
  return Values(input_, binary_file_, spool_, type, count);
}

}  // namespace vtk

bool looks_like_vtk(std::span<const std::byte> head) {
  if (head.size() < vtk::kMagic.size()) return false;
  const auto* text = reinterpret_cast<const char*>(head.data());
  return vtk::lower_case({text, vtk::kMagic.size()}) == vtk::kMagic;
}

std::unique_ptr<MeshSource> open_vtk(const std::string& path, Spool& spool) {
  auto source = std::make_unique<vtk::VtkSource>();
  vtk::Parser(path, spool, *source).parse();
  return source;
}

}  // namespace shm::converters
