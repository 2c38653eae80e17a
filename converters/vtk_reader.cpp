// Reads VTK legacy files: one walk through the file records where everything stands; numbers are
// fetched later. Sections come in any order that VTK's own reader takes.
#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

#include "failure.h"
#include "text_input.h"
#include "vtk.h"
#include "vtk_cells.h"
#include "vtk_values.h"
#include "vtk_words.h"

namespace shm::converters {
namespace vtk {
namespace {

constexpr std::string_view kMagic = "# vtk datafile version";
constexpr std::uint64_t kMostComponents = 65535;
constexpr std::uint64_t kPieceValues = 8192;

class VtkSource : public MeshSource {
 public:
  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override;
  bool next_cells(CellBatch& out, std::size_t max_cells) override {
    return cells_.next_cells(out, max_cells);
  }
  void rewind_cells() override { cells_.rewind(); }
  void read_array(std::size_t array, std::uint64_t, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override {
    const std::uint64_t components = info_.schema.arrays[array].components;
    arrays_[array].read(first * components, count * components, out);
  }

 private:
  friend class Parser;
  MeshInfo info_;
  Values points_;
  CellTable cells_;
  std::vector<Values> arrays_;
};

void VtkSource::read_points(std::uint64_t first, std::uint64_t count, std::byte* out) {
  if (is_float(points_.type())) return points_.read(first * 3, count * 3, out);
  // Integer coordinates go out as double.
  std::vector<std::byte> piece(kPieceValues * scalar_bytes(points_.type()));
  std::uint64_t at = first * 3;
  const std::uint64_t end = (first + count) * 3;
  while (at < end) {
    const std::uint64_t n = std::min(end - at, kPieceValues);
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

class Parser {
 public:
  Parser(const std::string& path, Spool& spool, VtkSource& source)
      : path_(path), spool_(spool), source_(source), info_(source.info_), input_(path) {}
  void parse();

 private:
  enum class Section { dataset, cell_data, point_data };

  void header();
  void dataset();
  bool section_keyword(const std::string& word);
  bool attribute_keyword(const std::string& word);
  void points();
  void cells();
  void cell_types();
  void begin_section(EntryKind kind);
  void field();
  void field_array();
  void attribute(EntryKind kind);
  void lookup_table();
  void values(Entry entry);
  void numbers(Entry& entry, ScalarType type);
  void odd_values(Entry& entry, ValueForm form);
  void strings(std::uint64_t count, std::string& out);
  void metadata(std::uint64_t components, std::string& out);
  void read_metadata(std::uint64_t components, std::string& out);
  Values column(ScalarType type, std::uint64_t count);
  std::uint64_t product(std::uint64_t a, std::uint64_t b);
  std::uint64_t section_size() const {
    return section_ == Section::cell_data ? source_.cells_.cells() : info_.vertices;
  }
  void next_line_is_binary() {
    if (skeleton_.binary) input_.skip_line();
  }
  void add_text_extra(std::string key, const std::string& text);

  std::string path_;
  Spool& spool_;
  VtkSource& source_;
  MeshInfo& info_;
  TextInput input_;
  std::shared_ptr<RandomFile> binary_file_;
  Skeleton skeleton_;
  Section section_ = Section::dataset;
  bool saw_points_ = false, saw_cells_ = false, saw_types_ = false;
  std::size_t data_count_ = 0;
};

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
  input_.enter("");
  if (!saw_points_) input_.fail(ErrorCode::truncated, "the file has no POINTS");
  if (saw_cells_ && !saw_types_) input_.fail(ErrorCode::truncated, "the file has no CELL_TYPES");
  add_text_extra("vtk/skeleton", to_text(skeleton_));
  source_.cells_.find_blocks(info_, path_);
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
  if (lower_case(input_.word()) != "dataset")
    input_.fail(ErrorCode::corrupt, "DATASET should stand here");
  const std::string kind = lower_case(input_.word());
  if (kind == "structured_points" || kind == "structured_grid" || kind == "rectilinear_grid" ||
      kind == "polydata" || kind == "field")
    input_.fail(ErrorCode::unsupported,
                "the data set is '" + kind + "'; only UNSTRUCTURED_GRID is read");
  if (kind != "unstructured_grid")
    input_.fail(ErrorCode::corrupt, "'" + kind.substr(0, 40) + "' is not a kind of data set");
  info_.schema.source_format = "vtk";
}

bool Parser::section_keyword(const std::string& word) {
  if (word == "cell_data" || word == "point_data") {
    begin_section(word == "cell_data" ? EntryKind::cell_data : EntryKind::point_data);
    return true;
  }
  if (word == "metadata") {
    std::string ignored;  // of nothing that VTK knows
    input_.skip_line();
    read_metadata(0, ignored);
    return true;
  }
  if (word == "field") {
    field();
    return true;
  }
  if (section_ != Section::dataset) return false;
  if (word == "points") {
    points();
  } else if (word == "cells") {
    cells();
  } else if (word == "cell_types") {
    cell_types();
  } else {
    return false;
  }
  return true;
}

bool Parser::attribute_keyword(const std::string& word) {
  if (section_ == Section::dataset) return false;
  std::string upper = word;
  for (char& c : upper)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  const auto kind = kind_of_keyword(upper);
  if (!kind || !holds_values(*kind) || *kind == EntryKind::array) return false;
  input_.enter(upper);
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

void Parser::points() {
  input_.enter("POINTS");
  if (saw_points_) input_.fail(ErrorCode::corrupt, "POINTS stands here a second time");
  saw_points_ = true;
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

void Parser::cells() {
  input_.enter("CELLS");
  if (saw_cells_) input_.fail(ErrorCode::corrupt, "CELLS stands here a second time");
  saw_cells_ = true;
  const auto count = input_.number<std::uint64_t>();
  const auto size = input_.number<std::uint64_t>();
  Entry entry{.kind = EntryKind::cells};
  if (skeleton_.major_version() < 5) {
    const ScalarType type = skeleton_.binary ? ScalarType::int32 : ScalarType::int64;
    source_.cells_.set_rows(count, column(type, size));
  } else if (count > 0) {
    const auto part = [&](const char* keyword, std::string& word, std::uint64_t values) {
      input_.enter(std::string("CELLS, ") + keyword);
      if (lower_case(input_.word()) != keyword)
        input_.fail(ErrorCode::corrupt, std::string("'") + keyword + "' should stand here");
      word = input_.word();
      const auto type = scalar_of_word(word, skeleton_.binary);
      if (!type || is_float(*type))
        input_.fail(ErrorCode::corrupt, "'" + word.substr(0, 40) + "' is no type of cell numbers");
      Values result = column(*type, values);
      std::string ignored;  // ranges of the numbers, which VTK finds by itself
      metadata(1, ignored);
      return result;
    };
    Values offsets = part("offsets", entry.type, count);
    source_.cells_.set_offsets(std::move(offsets), part("connectivity", entry.second, size));
  }
  skeleton_.entries.push_back(std::move(entry));
}

void Parser::cell_types() {
  input_.enter("CELL_TYPES");
  if (saw_types_) input_.fail(ErrorCode::corrupt, "CELL_TYPES stands here a second time");
  saw_types_ = true;
  const auto count = input_.number<std::uint64_t>();
  source_.cells_.set_types(column(ScalarType::int32, count));
}

void Parser::begin_section(EntryKind kind) {
  input_.enter(std::string(keyword(kind)));
  const bool of_cells = kind == EntryKind::cell_data;
  const auto count = input_.number<std::uint64_t>();
  section_ = of_cells ? Section::cell_data : Section::point_data;
  if (count != section_size())
    input_.fail(ErrorCode::corrupt, "states " + std::to_string(count) + " values an array for " +
                                        std::to_string(section_size()) +
                                        (of_cells ? " cells" : " points"));
  skeleton_.entries.push_back(Entry{.kind = kind});
}

void Parser::field() {
  input_.enter("FIELD");
  Entry entry{.kind = EntryKind::field, .name = std::string(input_.word())};
  entry.tuples = input_.number<std::uint64_t>();
  const std::uint64_t arrays = entry.tuples;
  skeleton_.entries.push_back(std::move(entry));
  for (std::uint64_t i = 0; i < arrays; ++i) field_array();
}

void Parser::field_array() {
  input_.enter("FIELD");
  std::string name(input_.word());
  if (name == "NULL_ARRAY") {
    skeleton_.entries.push_back(Entry{.kind = EntryKind::null_array});
    return;
  }
  input_.enter("FIELD, array '" + name.substr(0, 80) + "'");
  Entry entry{.kind = EntryKind::array, .name = std::move(name)};
  entry.components = input_.number<std::uint64_t>();
  entry.tuples = input_.number<std::uint64_t>();
  entry.type = input_.word();
  values(std::move(entry));
}

void Parser::attribute(EntryKind kind) {
  Entry entry{.kind = kind, .name = std::string(input_.word()), .components = 1};
  entry.tuples = section_size();
  input_.enter(std::string(keyword(kind)) + " '" + entry.name.substr(0, 80) + "'");
  if (kind == EntryKind::texture_coordinates || kind == EntryKind::color_scalars)
    entry.components = input_.number<std::uint64_t>();
  if (kind == EntryKind::color_scalars) {
    entry.type = skeleton_.binary ? "unsigned_char" : "float";
  } else {
    entry.type = input_.word();
  }
  if (const std::uint64_t fixed = fixed_components(kind); fixed > 0) entry.components = fixed;
  if (kind == EntryKind::scalars) {
    std::string word = lower_case(input_.word());
    if (word != "lookup_table") {
      if (!TextInput::parse(word, entry.components))
        input_.fail(ErrorCode::corrupt,
                    "the number of components or LOOKUP_TABLE should stand here");
      word = lower_case(input_.word());
    }
    if (word != "lookup_table") input_.fail(ErrorCode::corrupt, "LOOKUP_TABLE should stand here");
    entry.second = input_.word();
  }
  values(std::move(entry));
}

void Parser::lookup_table() {
  Entry entry{.kind = EntryKind::lookup_table,
              .name = std::string(input_.word()),
              .type = skeleton_.binary ? "unsigned_char" : "float",
              .components = 4};
  entry.tuples = input_.number<std::uint64_t>();
  values(std::move(entry));
}

// The values that `entry` announces, where the input stands behind the announcement.
void Parser::values(Entry entry) {
  const ValueForm form = form_of_word(entry.type);
  if (form == ValueForm::unknown)
    input_.fail(ErrorCode::corrupt, "'" + entry.type.substr(0, 40) + "' is no type of values");
  if (form == ValueForm::number) {
    numbers(entry, *scalar_of_word(entry.type, skeleton_.binary));
  } else {
    odd_values(entry, form);
  }
  if (entry.kind != EntryKind::lookup_table) metadata(entry.components, entry.metadata);
  skeleton_.entries.push_back(std::move(entry));
}

void Parser::numbers(Entry& entry, ScalarType type) {
  Values column_values = column(type, product(entry.tuples, entry.components));
  const bool per_element = section_ != Section::dataset && entry.kind != EntryKind::lookup_table &&
                           entry.tuples == section_size() && entry.components >= 1 &&
                           entry.components <= kMostComponents;
  if (per_element) {
    entry.origin = Origin::array;
    entry.index = source_.arrays_.size();
    source_.arrays_.push_back(std::move(column_values));
    ArrayInfo array;
    array.name = decode_name(entry.name);
    array.location = section_ == Section::cell_data ? Location::cell : Location::point;
    array.type = type;
    array.components = static_cast<std::uint32_t>(entry.components);
    info_.schema.arrays.push_back(std::move(array));
    return;
  }
  entry.origin = Origin::extra;
  entry.index = data_count_++;
  Extra extra{
      data_key(entry.index), type, Reference::nothing, {entry.tuples, entry.components}, {}};
  extra.data.resize(column_values.size() * scalar_bytes(type));
  column_values.read(0, column_values.size(), extra.data.data());
  info_.extras.push_back(std::move(extra));
}

// Strings, variants and bits: kept as the bytes or words that the file has.
void Parser::odd_values(Entry& entry, ValueForm form) {
  std::string data;
  const std::uint64_t count = product(entry.tuples, entry.components);
  if (form == ValueForm::string) {
    input_.skip_line();
    strings(count, data);
  } else if (form == ValueForm::variant) {
    for (std::uint64_t i = 0; i < count; ++i) {
      data.append(input_.word()).append(" ");
      data.append(input_.word()).append("\n");
    }
  } else if (skeleton_.binary) {
    const std::uint64_t bytes = count / 8 + (count % 8 != 0);
    if (count > 0) next_line_is_binary();
    if (bytes > input_.left()) input_.fail(ErrorCode::truncated, "the file ends within the bits");
    data.resize(bytes);
    input_.bytes(reinterpret_cast<std::byte*>(data.data()), bytes);
  } else {
    for (std::uint64_t i = 0; i < count; ++i)
      data += static_cast<char>(input_.number<std::int64_t>() != 0);
  }
  entry.origin = Origin::extra;
  entry.index = data_count_++;
  add_text_extra(data_key(entry.index), data);
}

// Text: one %-encoded line a string. Binary: a length in 1, 2, 4 or 8 bytes, whose first two bits
// say which (3, 2, 1, 0), then the characters.
void Parser::strings(std::uint64_t count, std::string& out) {
  for (std::uint64_t i = 0; i < count; ++i) {
    if (!skeleton_.binary) {
      out.append(input_.line()).append("\n");
      continue;
    }
    std::byte head[8] = {};
    input_.bytes(head, 1);
    const std::size_t head_bytes = std::size_t{8} >> (static_cast<unsigned>(head[0]) >> 6);
    input_.bytes(head + 1, head_bytes - 1);
    std::uint64_t length = static_cast<unsigned>(head[0]) & 63U;
    for (std::size_t b = 1; b < head_bytes; ++b)
      length = length << 8 | static_cast<std::uint64_t>(head[b]);
    if (length > input_.left()) input_.fail(ErrorCode::truncated, "the file ends within a string");
    out.append(reinterpret_cast<const char*>(head), head_bytes);
    const std::size_t old_size = out.size();
    out.resize(old_size + length);
    input_.bytes(reinterpret_cast<std::byte*>(out.data() + old_size), length);
  }
}

// METADATA, when it stands here, up to the empty line that ends it. Component names may be empty
// lines themselves, and empty lines may stand before the keys of an INFORMATION.
void Parser::metadata(std::uint64_t components, std::string& out) {
  if (lower_case(input_.peek_word()) != "metadata") return;
  input_.skip_line();
  read_metadata(components, out);
}

void Parser::read_metadata(std::uint64_t components, std::string& out) {
  std::uint64_t keys = 0;
  while (!input_.at_end()) {
    const std::string line = input_.line();
    const std::string lower = lower_case(line);
    if (line.empty()) {
      if (keys > 0 && input_.peek_word() == "NAME") continue;
      return;
    }
    out.append(line).append("\n");
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

void Parser::add_text_extra(std::string key, const std::string& text) {
  Extra extra{std::move(key), ScalarType::uint8, Reference::nothing, {text.size()}, {}};
  extra.data.resize(text.size());
  if (!text.empty()) std::memcpy(extra.data.data(), text.data(), text.size());
  info_.extras.push_back(std::move(extra));
}

}  // namespace
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
