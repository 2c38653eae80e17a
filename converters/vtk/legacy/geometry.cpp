// Reads what comes before POINT_DATA and CELL_DATA in VTK legacy files: points and cells, or the
// dimensions and axes that they follow from.
#include <utility>

#include "vtk/legacy/parser.h"

namespace shm::converters::vtk {
namespace {

// Of a data set that has no value for any of them: nothing else in the file speaks for so many.
constexpr std::uint64_t kMostPointsWithoutValues = std::uint64_t{1} << 30;

}  // namespace

// False when a section of this kind cannot stand in the data set.
bool Parser::geometry_keyword(EntryKind kind) {
  const Dataset dataset = skeleton_.dataset;
  const bool lattice = is_lattice(dataset);
  const bool makes_points =
      dataset == Dataset::structured_points || dataset == Dataset::rectilinear_grid;
  input_.enter(std::string(keyword(kind)));
  const auto once = [&](bool may_stand) {
    bool& seen = seen_[static_cast<std::size_t>(kind)];
    if (may_stand && std::exchange(seen, true))
      input_.fail(ErrorCode::corrupt, std::string(keyword(kind)) + " stands here a second time");
    return may_stand;
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

// OFFSETS or CONNECTIVITY of version 5.
Values Parser::cell_numbers(const char* keyword, std::string& word, std::uint64_t count) {
  input_.enter(std::string("CELLS, ") + keyword);
  if (lower_case(input_.word()) != keyword)
    input_.fail(ErrorCode::corrupt, std::string("'") + keyword + "' should stand here");
  word = input_.word();
  const auto type = scalar_of_word(word, skeleton_.binary);
  if (!type || is_float(*type))
    input_.fail(ErrorCode::corrupt, "'" + word.substr(0, 40) + "' is no type of cell numbers");
  Values result = column(*type, count);
  std::string ignored;  // ranges of the numbers, which VTK finds by itself
  metadata(1, ignored);
  return result;
}

void Parser::cell_types() {
  input_.enter("CELL_TYPES");
  if (saw_types_) input_.fail(ErrorCode::corrupt, "CELL_TYPES stands here a second time");
  saw_types_ = true;
  const auto count = input_.number<std::uint64_t>();
  source_.lists_[0].set_types(column(ScalarType::int32, count));
}

// The words behind a keyword, one blank between them.
std::string Parser::plain_words_of(EntryKind kind) {
  std::string words;
  for (std::size_t i = 0; i < plain_words(kind); ++i) {
    const std::string_view word = input_.word();
    double number = 0;
    if (!TextInput::parse(word, number))
      input_.fail(ErrorCode::corrupt, "'" + std::string(word.substr(0, 40)) +
                                          "' is not the number that should stand "
                                          "here");
    words.append(i > 0 ? " " : "").append(word);
  }
  return words;
}

// DIMENSIONS nx ny nz, or EXTENT with the first and last number along each axis.
void Parser::dimensions(EntryKind kind) {
  if (source_.lattice_) input_.fail(ErrorCode::corrupt, "the dimensions stand here a second time");
  Entry entry{.kind = kind, .type = plain_words_of(kind)};
  const auto lattice = lattice_of(entry);
  if (!lattice)
    input_.fail(ErrorCode::corrupt, std::string(keyword(kind)) + " " + entry.type.substr(0, 200) +
                                        " is not the size of a data set");
  source_.lattice_ = *lattice;
  if (skeleton_.dataset != Dataset::structured_grid) info_.vertices = lattice->points();
  skeleton_.entries.push_back(std::move(entry));
}

// Words stand here even in binary files: kept as they are, nothing is rounded.
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

// Before version 4.0: one value for each point, 0 for those that are not there.
void Parser::blanking() {
  Entry entry{.kind = EntryKind::blanking, .name = "BLANKING", .components = 1};
  entry.tuples = input_.number<std::uint64_t>();
  entry.type = input_.word();
  if (!scalar_of_word(entry.type, skeleton_.binary))
    input_.fail(ErrorCode::corrupt, "'" + entry.type.substr(0, 40) + "' is no type of numbers");
  if (!source_.lattice_ || source_.lattice_->points() != entry.tuples)
    input_.fail(ErrorCode::corrupt,
                "does not have one value for each of the points that "
                "DIMENSIONS, which comes first, states");
  values(std::move(entry));
}

void Parser::finish_lattice() {
  if (!source_.lattice_) input_.fail(ErrorCode::truncated, "the file has no DIMENSIONS");
  const Lattice& lattice = *source_.lattice_;
  if (skeleton_.dataset == Dataset::structured_grid) {
    if (!seen(EntryKind::points)) input_.fail(ErrorCode::truncated, "the file has no POINTS");
    if (info_.vertices != lattice.points())
      input_.fail(ErrorCode::corrupt, "there are " + std::to_string(info_.vertices) +
                                          " points, but the dimensions make " +
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
    input_.fail(ErrorCode::corrupt, "the dimensions make " + std::to_string(lattice.points()) +
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
  for (CellTable& list : source_.lists_) list.find_blocks(info_, path_);
  if (info_.cells() > 0)
    info_.extras.insert(info_.extras.begin() + types_place, cell_types_extra(info_));
}

}  // namespace shm::converters::vtk
