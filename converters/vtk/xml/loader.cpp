#include "vtk/xml/loader.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <utility>

#include "base/failure.h"
#include "base/stored_value.h"
#include "base/text_input.h"

namespace shm::converters::vtu {
namespace {

// Limit on the total size of the extras, which are held in memory: the size of the file times
// kMostExtraExpansion, but at least kFewExtraBytes and at most kMostExtraBytes.
constexpr std::uint64_t kMostExtraBytes = std::uint64_t{1} << 30;
constexpr std::uint64_t kFewExtraBytes = std::uint64_t{64} << 20;
constexpr std::uint64_t kMostExtraExpansion = 64;

std::string title_of(const Node& node) {
  const std::string* name = node.attribute("Name");
  return name == nullptr ? node.name : node.name + " '" + name->substr(0, 80) + "'";
}

}  // namespace

ArrayLoader::ArrayLoader(std::string path, Document& document, MeshInfo& info)
    : path_(std::move(path)),
      document_(document),
      info_(info),
      file_(std::make_shared<vtk::RandomFile>(path_)),
      file_bytes_(TextInput(path_).size()) {
  read_head(document_.root());
}

void ArrayLoader::fail(ErrorCode code, const Node& node, std::string detail) const {
  throw Failure(
      Error{.code = code, .detail = std::move(detail), .section = title_of(node), .file = path_});
}

void ArrayLoader::read_head(Node& root) {
  if (!root.is("VTKFile")) fail(ErrorCode::corrupt, root, "is not a VTK XML file");
  const std::string type = root.attribute_or("type", "");
  if (type != "UnstructuredGrid")
    fail(ErrorCode::unsupported, root,
         "the data set is '" + type.substr(0, 40) + "'; only UnstructuredGrid is read");
  double version = 0;
  const std::string version_word = root.attribute_or("version", "0.1");
  if (!TextInput::parse(version_word, version) || !(version >= 0))
    fail(ErrorCode::corrupt, root, "'" + version_word.substr(0, 40) + "' is not a version");
  if (version >= 3) fail(ErrorCode::unsupported, root, "versions beyond 2 are not known");
  ByteForm form;
  const std::string order = root.attribute_or("byte_order", "LittleEndian");
  const std::string header = root.attribute_or("header_type", "UInt32");
  if (order != "LittleEndian" && order != "BigEndian")
    fail(ErrorCode::corrupt, root, "'" + order.substr(0, 40) + "' is not a byte order");
  if (header != "UInt32" && header != "UInt64")
    fail(ErrorCode::corrupt, root, "'" + header.substr(0, 40) + "' is not a header type");
  form.big_endian = order == "BigEndian";
  form.header_bytes = header == "UInt64" ? 8 : 4;
  const std::string compressor = root.attribute_or("compressor", "");
  const auto known = compressor_of_name(compressor);
  if (!known)
    fail(ErrorCode::unsupported, root,
         "the compressor '" + compressor.substr(0, 40) + "' is not known");
  form.compressor = *known;
  if (Node* appended = root.child("AppendedData"))
    appended_style_ =
        appended->attribute_or("encoding", "base64") == "raw" ? Style::raw : Style::base64;
  payload_.emplace(file_, path_, form, file_bytes_);
}

std::optional<ArrayType> ArrayLoader::type_of(const Node& array) const {
  return type_of_word(array.attribute_or("type", ""));
}

std::uint64_t ArrayLoader::count_attribute(const Node& node, std::string_view key) const {
  const std::string* text = node.attribute(key);
  if (text == nullptr) fail(ErrorCode::corrupt, node, "lacks the attribute " + std::string(key));
  const auto count = parse_count(*text);
  if (!count)
    fail(ErrorCode::corrupt, node,
         "'" + text->substr(0, 40) + "' is not a valid value of the attribute " + std::string(key));
  return *count;
}

std::uint64_t ArrayLoader::components_of(const Node& array) const {
  if (array.attribute("NumberOfComponents") == nullptr) return 1;
  return std::max<std::uint64_t>(count_attribute(array, "NumberOfComponents"), 1);
}

PayloadPlace ArrayLoader::place_of(Node& array) const {
  const std::string format = array.attribute_or("format", "ascii");
  PayloadPlace place;
  place.array = title_of(array);
  if (format == "appended") {
    place.style = appended_style_;
    if (document_.appended_begin == 0)
      fail(ErrorCode::truncated, array,
           "the values of the array are appended data, but the file has no appended data");
    const std::uint64_t offset = count_attribute(array, "offset");
    if (offset >= file_bytes_ - document_.appended_begin)
      fail(ErrorCode::truncated, array, "the values of the array begin after the end of the file");
    place.begin = document_.appended_begin + offset;
    place.end = file_bytes_;
    return place;
  }
  place.style = format == "binary" ? Style::base64 : Style::ascii;
  if (const Node* values = array.values()) {
    place.begin = values->begin;
    place.end = values->end;
  }
  return place;
}

std::uint64_t ArrayLoader::read(Node& array, const ArrayType& type, std::uint64_t most,
                                const PayloadReader::Take& take) {
  block_bytes_.erase(&array);
  if (most == 0) return 0;
  const PayloadPlace place = place_of(array);
  if (place.style == Style::base64 && place.begin == place.end) return 0;
  // In ASCII arrays, VTK writes each character of a string as a signed number.
  const bool text = type.kind == ArrayKind::string && place.style == Style::ascii;
  const std::uint64_t found = payload_->read(place, text ? ScalarType::int8 : type.stored,
                                             type.kind == ArrayKind::bit, most, take);
  block_bytes_[&array] = payload_->block_bytes();
  return found;
}

void ArrayLoader::load(Node& array, const ArrayType& type, std::uint64_t count, PagedArray& out) {
  const std::size_t width = scalar_bytes(type.stored);
  const std::uint64_t found = read(array, type, count, [&](std::span<const std::byte> values) {
    out.append(values.size() / width, values.data());
  });
  if (found != count)
    fail(
        ErrorCode::truncated, array,
        "has " + std::to_string(found) + " values, but " + std::to_string(count) + " are expected");
}

bool ArrayLoader::same_place(const Node& a, const Node& b) {
  const auto appended = [](const Node& node) {
    return node.attribute_or("format", "") == "appended";
  };
  return appended(a) && appended(b) &&
         a.attribute_or("offset", "") == b.attribute_or("offset", "") &&
         a.attribute_or("type", "") == b.attribute_or("type", "");
}

bool ArrayLoader::same_values(Node& a, Node& b, Spool& spool) {
  if (same_place(a, b)) return true;
  const auto type = type_of(a);
  if (!type || type != type_of(b)) return false;
  // Read all n values of `b`, and then at most n + 1 values of `a`, which is enough to find any
  // difference. Reading all of `a` could take long, because `a` may be much longer than `b`, and
  // may be compared with many arrays.
  const std::size_t width = scalar_bytes(type->stored);
  PagedArray second(spool, width);
  read(b, *type, kNoLimit, [&](std::span<const std::byte> values) {
    second.append(values.size() / width, values.data());
  });
  bool same = true;
  std::uint64_t position = 0;
  std::vector<std::byte> other;
  read(a, *type, second.size() + 1, [&](std::span<const std::byte> values) {
    const std::uint64_t n = values.size() / width;
    same = same && n <= second.size() - position;
    if (!same) return;
    other.resize(values.size());
    second.read(position, n, other.data());
    same = std::equal(other.begin(), other.end(), values.begin());
    position += n;
  });
  return same && position == second.size();
}

std::uint64_t ArrayLoader::read_integers(
    Node& array, std::uint64_t most,
    const std::function<void(std::span<const std::int64_t>)>& take) {
  const auto type = type_of(array);
  if (!type || type->kind != ArrayKind::number || is_float(type->stored))
    fail(ErrorCode::unsupported, array,
         "'" + array.attribute_or("type", "").substr(0, 40) + "' is not an integer type");
  std::vector<std::int64_t> wide;
  return read(array, *type, most, [&](std::span<const std::byte> values) {
    with_scalar(type->stored, [&](auto value) {
      wide.clear();
      for (std::size_t offset = 0; offset < values.size(); offset += sizeof value) {
        std::memcpy(&value, values.data() + offset, sizeof value);
        if constexpr (std::is_integral_v<decltype(value)>)
          wide.push_back(static_cast<std::int64_t>(value));
      }
    });
    take(wide);
  });
}

void ArrayLoader::keep_as_extra(Node& array, std::uint64_t most) {
  const auto type = type_of(array);
  if (!type) return mark(array, "none");  // VTK ignores arrays of unknown types, too
  std::string place;
  if (array.attribute_or("format", "") == "appended")
    place = array.attribute_or("offset", "") + ' ' + array.attribute_or("type", "") + ' ' +
            std::to_string(most);
  if (const auto known = kept_.find(place); known != kept_.end()) {
    return mark_like(array, known->second);
  }
  Extra extra{data_key(extras_), type->stored, Reference::nothing, {}, {}};
  const std::uint64_t found = read(array, *type, most, [&](std::span<const std::byte> values) {
    extra_bytes_ += values.size();
    const std::uint64_t most_extra =
        std::min(kMostExtraBytes, std::max(kFewExtraBytes, file_bytes_ * kMostExtraExpansion));
    if (extra_bytes_ > most_extra)
      fail(ErrorCode::over_limit, array,
           "more than " + std::to_string(most_extra) +
               " bytes of values that belong to no point or cell");
    extra.data.insert(extra.data.end(), values.begin(), values.end());
  });
  if (most != kNoLimit && type->kind != ArrayKind::string && found != most)
    fail(ErrorCode::truncated, array,
         "has " + std::to_string(found) + " values, but " + std::to_string(most) + " are expected");
  extra.shape = {found};
  info_.extras.push_back(std::move(extra));
  mark(array, 'x' + std::to_string(extras_++));
  if (!place.empty()) kept_[place] = array.values()->text;
}

void ArrayLoader::mark_like(Node& array, const std::string& text) {
  block_bytes_.erase(&array);
  mark(array, text);
}

void ArrayLoader::mark(Node& array, const std::string& word) {
  Node* values = array.values();
  if (values == nullptr)
    values =
        &*array.children.insert(array.children.begin(), Node{.kind = NodeKind::values, .name = {}});
  values->text = word;
  const auto block = block_bytes_.find(&array);
  if (block != block_bytes_.end() && block->second > 0 && block->second != kUsualBlockBytes)
    values->text += " b" + std::to_string(block->second);
}

}  // namespace shm::converters::vtu
