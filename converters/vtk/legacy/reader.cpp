#include "vtk/legacy/reader.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "base/failure.h"
#include "base/stored_value.h"
#include "mesh/mesh_source.h"
#include "vtk/legacy/vtk.h"

namespace shm::converters {
namespace vtk {
namespace {

constexpr std::string_view kMagic = "# vtk datafile version";
constexpr std::uint64_t kPointsAtOnce = 8192;
// Maximum number of points of a structured data set that has no array of point values. A limit is
// needed because a small file of this kind may declare any number of points.
constexpr std::uint64_t kMostPointsWithoutValues = std::uint64_t{1} << 30;

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
  // Integer coordinates are converted to double, so they are read into a separate buffer.
  std::vector<std::byte> piece(kPointsAtOnce * scalar_bytes(points_.type()));
  std::uint64_t next = first * 3;
  const std::uint64_t end = (first + count) * 3;
  while (next < end) {
    const std::uint64_t n = std::min(end - next, kPointsAtOnce);
    points_.read(next, n, piece.data());
    with_scalar(points_.type(), [&](auto zero) {
      for (std::uint64_t i = 0; i < n; ++i, out += sizeof(double)) {
        auto value = zero;
        std::memcpy(&value, piece.data() + i * sizeof value, sizeof value);
        const auto wide = static_cast<double>(value);
        std::memcpy(out, &wide, sizeof wide);
      }
    });
    next += n;
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
                "'" + word.substr(0, 40) + "' is not a keyword that is allowed here");
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
    input_.fail(ErrorCode::unsupported, "the file has only a FIELD, and no mesh");
  if (keyword != "dataset") input_.fail(ErrorCode::corrupt, "expected DATASET");
  const std::string word = upper_case(input_.word());
  const auto dataset = dataset_of_word(word);
  if (!dataset)
    input_.fail(ErrorCode::unsupported,
                "the data set is '" + word.substr(0, 40) +
                    "', which is not supported; supported are UNSTRUCTURED_GRID, STRUCTURED_GRID, "
                    "RECTILINEAR_GRID, STRUCTURED_POINTS and POLYDATA");
  skeleton_.dataset = *dataset;
  info_.schema.source_format = "vtk";
}

bool Parser::section_keyword(const std::string& word) {
  if (word == "cell_data" || word == "point_data") {
    begin_section(word == "cell_data" ? EntryKind::cell_data : EntryKind::point_data);
  } else if (word == "metadata") {
    std::string ignored;  // VTK, too, ignores metadata that does not follow an array
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

// Reads the next `count` numbers of the file as a column (see Values). If `count` is 0, stays
// before the newline of the current line, as VTK does.
Values Parser::column(ScalarType type, std::uint64_t count) {
  if (count > 0) next_line_is_binary();
  return Values(input_, binary_file_, spool_, type, count);
}

// If a METADATA section follows, reads it up to the empty line that ends it. Some empty lines do
// not end the section: empty component names, empty strings, and empty lines before the information
// keys.
void Parser::metadata(std::uint64_t components, std::string& out) {
  if (lower_case(input_.peek_word()) != "metadata") return;
  input_.skip_line();
  read_metadata(components, out);
}

void Parser::read_metadata(std::uint64_t components, std::string& out) {
  std::uint64_t keys = 0, strings = 0;
  while (!input_.at_end()) {
    const std::string line = input_.line();
    const std::string lower = lower_case(line);
    if (line.empty()) {
      if (keys > 0 && input_.peek_word() == "NAME") continue;
      return;
    }
    out.append(line).append("\n");
    // A single number after DATA is either the value of the information key, or the number of
    // strings that follow. Some of these strings may be empty.
    if (strings > 0 && !line.starts_with("NAME ")) {
      for (; strings > 1; --strings) out.append(input_.line()).append("\n");
      strings = 0;
      continue;
    }
    strings = 0;
    if (line.starts_with("DATA ")) TextInput::parse(std::string_view(line).substr(5), strings);
    if (lower.starts_with("component_names")) {
      for (std::uint64_t i = 0; i < components; ++i) out.append(input_.line()).append("\n");
    } else if (lower.starts_with("information ")) {
      const std::string_view count = std::string_view(line).substr(12);
      TextInput::parse(count.substr(0, count.find(' ')), keys);
    } else if (line.starts_with("NAME ") && keys > 0) {
      --keys;
    }
  }
}

// --- Sections before POINT_DATA and CELL_DATA. They contain the points and cells, or the
// dimensions and axes that determine the points and cells.

// Reads a section of points or cells. Returns false if the data set cannot have such a section.
bool Parser::geometry_keyword(EntryKind kind) {
  const Dataset dataset = skeleton_.dataset;
  const bool lattice = is_lattice(dataset);
  const bool makes_points =
      dataset == Dataset::structured_points || dataset == Dataset::rectilinear_grid;
  input_.enter(std::string(keyword(kind)));
  const auto once = [&](bool allowed) {
    bool& seen = seen_[static_cast<std::size_t>(kind)];
    if (allowed && std::exchange(seen, true))
      input_.fail(ErrorCode::corrupt, std::string(keyword(kind)) + " occurs twice");
    return allowed;
  };
  switch (kind) {
    case EntryKind::points: return once(!makes_points) && (points(), true);
    case EntryKind::cells:
      return once(dataset == Dataset::unstructured_grid) && (cells(kind), true);
    case EntryKind::vertices:
    case EntryKind::lines:
    case EntryKind::polygons:
    case EntryKind::triangle_strips:
      return once(dataset == Dataset::polydata) && (cells(kind), true);
    case EntryKind::dimensions:
    case EntryKind::extent: return once(lattice) && (dimensions(kind), true);
    case EntryKind::spacing:
    case EntryKind::aspect_ratio:
    case EntryKind::origin:
      return once(dataset == Dataset::structured_points) && (spacing(kind), true);
    case EntryKind::x_coordinates:
    case EntryKind::y_coordinates:
    case EntryKind::z_coordinates:
      return once(dataset == Dataset::rectilinear_grid) && (coordinates(kind), true);
    case EntryKind::blanking:
      return once(dataset == Dataset::structured_grid) && (blanking(), true);
    default: return false;
  }
}

void Parser::points() {
  const auto count = input_.number<std::uint64_t>();
  Entry entry{.kind = EntryKind::points, .type = std::string(input_.word())};
  const auto type = scalar_of_word(entry.type, skeleton_.binary);
  if (!type)
    input_.fail(ErrorCode::unsupported, "coordinates of type '" + entry.type + "' are not read");
  source_.points_ = column(*type, product(count, 3));
  info_.vertices = count;
  info_.schema.coordinate_type =
      *type == ScalarType::float32 ? ScalarType::float32 : ScalarType::float64;
  metadata(3, entry.metadata);
  skeleton_.entries.push_back(std::move(entry));
}

void Parser::cells(EntryKind kind) {
  const bool listed = kind != EntryKind::cells;
  const std::size_t place =
      listed ? static_cast<std::size_t>(kind) - static_cast<std::size_t>(EntryKind::vertices) : 0;
  CellTable& table = source_.lists_[place];
  const auto count = input_.number<std::uint64_t>();
  const auto size = input_.number<std::uint64_t>();
  Entry entry{.kind = kind};
  table.set_list(kind);
  if (skeleton_.major_version() < 5) {
    const ScalarType type = skeleton_.binary ? ScalarType::int32 : ScalarType::int64;
    table.set_rows(count, column(type, size));
  } else if (count > 0) {
    Values offsets = cell_numbers("offsets", entry.type, count);
    table.set_offsets(std::move(offsets), cell_numbers("connectivity", entry.second, size));
  }
  if (listed) entry.tuples = table.cells();
  skeleton_.entries.push_back(std::move(entry));
}

// Reads the values of OFFSETS or CONNECTIVITY in a file of version 5.
Values Parser::cell_numbers(const char* keyword, std::string& word, std::uint64_t count) {
  input_.enter(std::string("CELLS, ") + keyword);
  if (lower_case(input_.word()) != keyword)
    input_.fail(ErrorCode::corrupt, std::string("expected '") + keyword + "'");
  word = input_.word();
  const auto type = scalar_of_word(word, skeleton_.binary);
  if (!type || is_float(*type))
    input_.fail(ErrorCode::corrupt, "'" + word.substr(0, 40) + "' is not an integer type");
  Values result = column(*type, count);
  std::string ignored;  // value ranges; VTK computes them when it writes a file
  metadata(1, ignored);
  return result;
}

void Parser::cell_types() {
  input_.enter("CELL_TYPES");
  if (saw_types_) input_.fail(ErrorCode::corrupt, "CELL_TYPES occurs twice");
  saw_types_ = true;
  const auto count = input_.number<std::uint64_t>();
  source_.lists_[0].set_types(column(ScalarType::int32, count));
}

// Returns the words that follow the keyword of `kind`, separated by single spaces.
std::string Parser::plain_words_of(EntryKind kind) {
  std::string words;
  for (std::size_t i = 0; i < plain_words(kind); ++i) {
    const std::string_view word = input_.word();
    double number = 0;
    if (!TextInput::parse(word, number))
      input_.fail(ErrorCode::corrupt, "'" + std::string(word.substr(0, 40)) + "' is not a number");
    words.append(i > 0 ? " " : "").append(word);
  }
  return words;
}

// Reads DIMENSIONS nx ny nz, or EXTENT with the first and the last point number along each axis.
void Parser::dimensions(EntryKind kind) {
  if (source_.lattice_) input_.fail(ErrorCode::corrupt, "the dimensions occur twice");
  Entry entry{.kind = kind, .type = plain_words_of(kind)};
  const auto lattice = lattice_of(entry);
  if (!lattice)
    input_.fail(ErrorCode::corrupt, std::string(keyword(kind)) + " " + entry.type.substr(0, 200) +
                                        " is not the size of a data set");
  source_.lattice_ = *lattice;
  if (skeleton_.dataset != Dataset::structured_grid) info_.vertices = lattice->points();
  skeleton_.entries.push_back(std::move(entry));
}

// Reads the spacing or the origin of image data. These numbers are text even in binary files. Their
// words are kept verbatim, so that nothing is rounded.
void Parser::spacing(EntryKind kind) {
  skeleton_.entries.push_back(Entry{.kind = kind, .type = plain_words_of(kind)});
}

void Parser::coordinates(EntryKind kind) {
  Entry entry{.kind = kind, .name = std::string(keyword(kind)), .components = 1};
  entry.tuples = input_.number<std::uint64_t>();
  entry.type = input_.word();
  if (!scalar_of_word(entry.type, skeleton_.binary))
    input_.fail(ErrorCode::unsupported,
                "coordinates of type '" + entry.type.substr(0, 40) + "' are not read");
  values(std::move(entry));
}

// Reads BLANKING, a section of versions before 4.0. It has one value per point; the value of
// blanked points is 0.
void Parser::blanking() {
  Entry entry{.kind = EntryKind::blanking, .name = "BLANKING", .components = 1};
  entry.tuples = input_.number<std::uint64_t>();
  entry.type = input_.word();
  if (!scalar_of_word(entry.type, skeleton_.binary))
    input_.fail(ErrorCode::corrupt,
                "'" + entry.type.substr(0, 40) + "' is not a known number type");
  if (!source_.lattice_ || source_.lattice_->points() != entry.tuples)
    input_.fail(ErrorCode::corrupt,
                "does not have one value for each point; the number of "
                "points is stated by DIMENSIONS, which must come first");
  values(std::move(entry));
}

void Parser::finish_lattice() {
  if (!source_.lattice_) input_.fail(ErrorCode::truncated, "the file has no DIMENSIONS");
  const Lattice& lattice = *source_.lattice_;
  if (skeleton_.dataset == Dataset::structured_grid) {
    if (!seen(EntryKind::points)) input_.fail(ErrorCode::truncated, "the file has no POINTS");
    if (info_.vertices != lattice.points())
      input_.fail(ErrorCode::corrupt, "there are " + std::to_string(info_.vertices) +
                                          " points, but the dimensions state " +
                                          std::to_string(lattice.points()));
  } else {
    finish_axes();
  }
  if (lattice.cells() == 0) return;
  info_.schema.blocks.push_back(lattice.block());
  info_.block_cells.push_back(lattice.cells());
}

void Parser::finish_axes() {
  if (skeleton_.dataset == Dataset::rectilinear_grid)
    for (const EntryKind kind :
         {EntryKind::x_coordinates, EntryKind::y_coordinates, EntryKind::z_coordinates})
      if (!seen(kind))
        input_.fail(ErrorCode::truncated, "the file has no " + std::string(keyword(kind)));
  const Lattice& lattice = *source_.lattice_;
  if (info_.schema.arrays.empty() && lattice.points() > kMostPointsWithoutValues)
    input_.fail(ErrorCode::corrupt, "the dimensions state " + std::to_string(lattice.points()) +
                                        " points, but no array has values for them");
  std::string problem;
  auto made = lattice_points_of(
      skeleton_,
      [&](const std::string& key) {
        for (const Extra& extra : info_.extras)
          if (extra.key == key) return &extra;
        return static_cast<const Extra*>(nullptr);
      },
      problem);
  if (!made) input_.fail(ErrorCode::corrupt, problem);
  source_.lattice_points_ = std::move(*made);
  source_.makes_points_ = true;
  info_.schema.coordinate_type = source_.lattice_points_.type;
}

void Parser::finish_cells() {
  if (!seen(EntryKind::points)) input_.fail(ErrorCode::truncated, "the file has no POINTS");
  if (seen(EntryKind::cells) && !saw_types_)
    input_.fail(ErrorCode::truncated, "the file has no CELL_TYPES");
  const auto types_place = static_cast<std::ptrdiff_t>(info_.extras.size());
  for (CellTable& list : source_.lists_) {
    list.set_old_numbering(skeleton_.version < kNewNumberingInLegacy);
    list.find_blocks(info_, path_);
  }
  if (info_.cells() > 0)
    info_.extras.insert(info_.extras.begin() + types_place, cell_types_extra(info_));
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
