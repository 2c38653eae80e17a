// Writes VTU files: traverses the tree of a VtuPlan once and inserts the numbers. Appended data is
// written last. Its offsets are then written into the space that was reserved for them in the tags
// of the arrays.
#include <algorithm>
#include <cstring>
#include <map>
#include <span>
#include <utility>

#include "base/failure.h"
#include "base/output_file.h"
#include "base/stored_value.h"
#include "vtk/strings.h"
#include "vtk/values.h"
#include "vtk/words.h"
#include "vtk/xml/loader.h"
#include "vtk/xml/payload_writer.h"
#include "vtk/xml/plan.h"
#include "vtk/xml/staged_cells.h"
#include "vtk/xml/vtu.h"

namespace shm::converters {
namespace vtu {
namespace {

constexpr std::size_t kWrittenBytes = std::size_t{1} << 18;
// Size in bytes of the space that is reserved in a tag for an offset. The space is later filled
// with the digits of the offset, the closing quote, and blanks.
constexpr std::size_t kOffsetRoom = 22;

class Writer {
 public:
  Writer(MeshSource& mesh, const std::string& path, Spool& spool)
      : mesh_(mesh),
        info_(mesh.info()),
        plan_(mesh),
        cells_(plan_, spool),
        out_(path, false),
        payload_(out_, plan_.form()) {}
  void write();

 private:
  // An array whose numbers will be appended, and the position in the file of the space reserved for
  // its offset.
  struct Waiting {
    Node* array;
    PieceRange piece;
    bool in_piece;
    std::uint64_t offset_at;
  };

  void node(Node& node, int depth);
  void element_node(Node& node, int depth);
  void array_node(Node& array, int depth);
  void appended(Node& node, int depth);
  void indent(int depth) { out_.text(std::string(2 * static_cast<std::size_t>(depth), ' ')); }
  void payload(Node& array, Style style, const PieceRange& piece, bool in_piece);
  void array_values(const ValuesWord& word, PayloadWriter::Head head, const PieceRange& piece,
                    bool in_piece);
  void string_values(std::size_t array, PayloadWriter::Head head, std::uint64_t begin,
                     std::uint64_t total);
  void extra_values(const ValuesWord& word, PayloadWriter::Head head);
  void point_values(PayloadWriter::Head head, const PieceRange& piece);
  void cell_values(const ValuesWord& word, PayloadWriter::Head head, const PieceRange& piece);
  void block_ids(PayloadWriter::Head head);
  void integers(ScalarType type, std::span<const std::int64_t> numbers);

  MeshSource& mesh_;
  const MeshInfo& info_;
  VtuPlan plan_;
  StagedCells cells_;
  NumberOutput out_;
  PayloadWriter payload_;
  PieceRange piece_;
  bool in_piece_ = false;
  std::vector<Waiting> waiting_;
  std::vector<std::byte> raw_;
};

void Writer::write() {
  out_.line("<?xml version=\"1.0\"?>");
  for (Node& each : plan_.document().nodes) node(each, 0);
  out_.finish();
}

void Writer::node(Node& node, int depth) {
  switch (node.kind) {
    case NodeKind::text: return out_.text(escaped_text(node.text));
    case NodeKind::values: return;  // array_node() writes the values
    case NodeKind::comment: indent(depth); return out_.line("<!--" + node.text + "-->");
    case NodeKind::instruction:
      indent(depth);
      return out_.line("<?" + node.name + ' ' + node.text + "?>");
    case NodeKind::element: break;
  }
  const PieceRange* piece = plan_.piece_of(node);
  if (piece != nullptr) {
    piece_ = *piece;
    in_piece_ = true;
  }
  if (node.is_array()) {
    array_node(node, depth);
  } else if (node.is("AppendedData")) {
    appended(node, depth);
  } else {
    element_node(node, depth);
  }
  if (piece != nullptr) in_piece_ = false;
}

// Writes an element. Elements that contain text are written without added white space, so that the
// text does not change.
void Writer::element_node(Node& node_to_write, int depth) {
  const auto is_text = [](const Node& each) { return each.kind == NodeKind::text; };
  auto& children = node_to_write.children;
  const bool verbatim = std::any_of(children.begin(), children.end(), is_text);
  indent(depth);
  out_.text(start_tag(node_to_write, children.empty()));
  if (!verbatim) out_.text("\n");
  for (Node& child : children) node(child, depth + 1);
  if (children.empty()) return;
  if (!verbatim) indent(depth);
  out_.line("</" + node_to_write.name + '>');
}

void Writer::array_node(Node& array, int depth) {
  const bool is_appended = array.attribute_or("format", "ascii") == "appended";
  indent(depth);
  if (is_appended) {
    array.remove_attribute("offset");
    std::string tag = start_tag(array, false);
    tag.pop_back();
    out_.text(tag + " offset=\"");
    waiting_.push_back({&array, piece_, in_piece_, out_.position()});
    out_.line(std::string(kOffsetRoom, ' ') + '>');
  } else {
    out_.line(start_tag(array, false));
  }
  const bool text = array.attribute_or("format", "ascii") != "binary";
  for (Node& child : array.children) {
    if (child.kind != NodeKind::values) {
      node(child, depth + 1);
    } else if (!is_appended) {
      payload(array, text ? Style::ascii : Style::base64, piece_, in_piece_);
      out_.text("\n");
    }
  }
  indent(depth);
  out_.line("</" + array.name + '>');
}

void Writer::appended(Node& node_to_write, int depth) {
  indent(depth);
  out_.line(start_tag(node_to_write, false));
  indent(depth);
  out_.text(" _");
  const std::uint64_t begin = out_.position();
  // An array that is the same at several time steps is written once, and all of these steps refer
  // to the same bytes. Strings are written again for each step, because VTK 9.1 crashes if several
  // steps refer to the same strings.
  std::map<std::string, std::string> places;
  for (const Waiting& each : waiting_) {
    const Node* values = each.array->values();
    std::string same =
        (values == nullptr ? "" : values->text) + ' ' + each.array->attribute_or("type", "") + ' ' +
        std::to_string(each.piece.first_point) + ' ' + std::to_string(each.piece.first_cell) + ' ' +
        std::to_string(each.piece.points) + ' ' + std::to_string(each.piece.cells);
    if (each.array->attribute_or("type", "") == "String") same += std::to_string(each.offset_at);
    std::string offset = std::to_string(out_.position() - begin) + '"';
    offset.resize(kOffsetRoom, ' ');
    const auto [place, is_new] = places.emplace(same, offset);
    out_.patch(each.offset_at, place->second);
    if (!is_new) continue;
    payload(*each.array, plan_.raw_appended() ? Style::raw : Style::base64, each.piece,
            each.in_piece);
  }
  waiting_.clear();
  out_.text("\n");
  indent(depth);
  out_.line("</" + node_to_write.name + '>');
}

void Writer::payload(Node& array, Style style, const PieceRange& piece, bool in_piece) {
  const Node* node = array.values();
  const auto word = parse_values_word(node == nullptr ? "none" : node->text);
  const auto type = type_of_word(array.attribute_or("type", ""));
  PayloadWriter::Head head;
  head.array = array.name + " '" + array.attribute_or("Name", "") + "'";
  head.style = style;
  if (!word) vtk::fail_extra("vtu/skeleton", "has an unknown word for " + head.array);
  head.block_bytes = word->block_bytes;
  if (type) {
    head.type = type->stored;
    head.bits = type->kind == ArrayKind::bit;
  }
  if (word->kind == ValuesWord::Kind::array) return array_values(*word, head, piece, in_piece);
  if (word->kind == ValuesWord::Kind::extra) return extra_values(*word, head);
  if (word->word == "points") return point_values(head, in_piece ? piece : PieceRange());
  if (word->word == "block_ids") return block_ids(head);
  if (word->word == "time" && head.type == ScalarType::float64 && !info_.step_times.empty()) {
    head.count = 1;
    payload_.begin(head);
    payload_.numbers(reinterpret_cast<const std::byte*>(&info_.step_times.back()), 1);
    return payload_.end();
  }
  if (word->word != "none" && word->word != "time" && in_piece)
    return cell_values(*word, head, piece);
  payload_.begin(head);
  payload_.end();
}

void Writer::array_values(const ValuesWord& word, PayloadWriter::Head head, const PieceRange& piece,
                          bool in_piece) {
  if (word.index >= info_.schema.arrays.size() ||
      (!in_piece && info_.schema.arrays[word.index].location != Location::global))
    vtk::fail_extra("vtu/skeleton",
                    "has " + head.array + " outside a piece, or for an array that does not exist");
  const ArrayInfo& info = info_.schema.arrays[word.index];
  const bool strings = info.role == vtk::kStringRole;
  if ((head.type != info.type && !strings) || info.per_step != word.step.has_value() ||
      (word.step && *word.step >= info_.step_times.size()))
    vtk::fail_extra("vtu/skeleton", "does not define " + head.array);
  const bool of_points = info.location == Location::point;
  const bool of_cells = info.location == Location::cell;
  const std::uint64_t begin = of_points ? piece.first_point : of_cells ? piece.first_cell : 0;
  const std::uint64_t total = of_points ? piece.points : of_cells ? piece.cells : info.elements;
  const std::uint64_t step = word.step.value_or(0);
  const std::size_t stride = info_.array_stride(word.index);
  if (strings) return string_values(word.index, head, begin, total);
  head.count = total * info.components;
  payload_.begin(head);
  if (!info.blocks.empty()) {
    plan_.for_each_filled(word.index, step, [&](std::span<const std::byte> values) {
      payload_.numbers(values.data(), values.size() / scalar_bytes(info.type));
    });
    return payload_.end();
  }
  const std::uint64_t at_once = std::max<std::uint64_t>(kWrittenBytes / stride, 1);
  raw_.resize(std::min(at_once, total) * stride);
  for (std::uint64_t done = 0; done < total; done += at_once) {
    const std::uint64_t n = std::min(at_once, total - done);
    mesh_.read_array(word.index, step, begin + done, n, raw_.data());
    payload_.numbers(raw_.data(), n * info.components);
  }
  payload_.end();
}

// Writes the strings of an array. The indices are read twice: the first pass computes the total
// size of the strings in bytes.
void Writer::string_values(std::size_t array, PayloadWriter::Head head, std::uint64_t begin,
                           std::uint64_t total) {
  const std::string key = vtk::strings_key(array);
  const Extra* found = plan_.extra(key);
  if (found == nullptr) vtk::fail_extra(key, "is missing");
  const auto list =
      vtk::split_strings({reinterpret_cast<const char*>(found->data.data()), found->data.size()},
                         vtk::StringForm::zeros);
  if (!list || head.type != ScalarType::uint8) vtk::fail_extra(key, "is not a list of strings");
  const std::uint32_t components = info_.schema.arrays[array].components;
  const std::uint64_t at_once = std::max<std::uint64_t>(kWrittenBytes / (components * 4ULL), 1);
  std::vector<std::uint32_t> places(std::min(at_once, total) * components);
  const auto for_each_string = [&](const auto& take) {
    for (std::uint64_t done = 0; done < total; done += at_once) {
      const std::uint64_t n = std::min(at_once, total - done);
      mesh_.read_array(array, 0, begin + done, n, reinterpret_cast<std::byte*>(places.data()));
      for (std::uint64_t i = 0; i < n * components; ++i) {
        if (places[i] >= list->size())
          vtk::fail_extra(key, "lacks string " + std::to_string(places[i]));
        take((*list)[places[i]]);
      }
    }
  };
  for_each_string([&](std::string_view each) { head.count += each.size(); });
  payload_.begin(head);
  for_each_string([&](std::string_view each) {
    payload_.numbers(reinterpret_cast<const std::byte*>(each.data()), each.size());
  });
  payload_.end();
}

void Writer::extra_values(const ValuesWord& word, PayloadWriter::Head head) {
  const std::string key = data_key(word.index);
  const Extra* found = plan_.extra(key);
  if (found == nullptr) vtk::fail_extra(key, "is missing");
  const std::size_t width = scalar_bytes(head.type);
  if (found->type != head.type || found->data.size() % width != 0)
    vtk::fail_extra(key,
                    "the type of the values differs from the stored structure of the VTU file");
  head.count = found->data.size() / width;
  payload_.begin(head);
  payload_.numbers(found->data.data(), head.count);
  payload_.end();
}

void Writer::point_values(PayloadWriter::Head head, const PieceRange& piece) {
  const ScalarType from = info_.schema.coordinate_type;
  head.count = piece.points * 3;
  payload_.begin(head);
  constexpr std::uint64_t kAtOnce = kWrittenBytes / (3 * sizeof(double));
  std::vector<std::byte> coordinates(kWrittenBytes), converted(kWrittenBytes);
  for (std::uint64_t done = 0; done < piece.points; done += kAtOnce) {
    const std::uint64_t n = std::min(kAtOnce, piece.points - done);
    mesh_.read_points(piece.first_point + done, n, coordinates.data());
    if (head.type != from)
      vtk::convert_numbers(from, coordinates.data(), n * 3, head.type, converted.data());
    payload_.numbers(head.type == from ? coordinates.data() : converted.data(), n * 3);
  }
  payload_.end();
}

void Writer::cell_values(const ValuesWord& word, PayloadWriter::Head head,
                         const PieceRange& piece) {
  head.count = cells_.count(word.word, piece);
  payload_.begin(head);
  cells_.numbers(word.word, piece,
                 [&](std::span<const std::int64_t> numbers) { integers(head.type, numbers); });
  payload_.end();
}

void Writer::block_ids(PayloadWriter::Head head) {
  head.count = info_.cells();
  payload_.begin(head);
  std::vector<std::int64_t> ids;
  plan_.for_each_batch([&](const CellBatch& batch) {
    ids.clear();
    for (const std::uint32_t block : batch.blocks) ids.push_back(info_.schema.blocks[block].id);
    integers(head.type, ids);
  });
  payload_.end();
}

void Writer::integers(ScalarType type, std::span<const std::int64_t> numbers) {
  raw_.resize(numbers.size() * scalar_bytes(type));
  with_scalar(type, [&](auto value) {
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      value = static_cast<decltype(value)>(numbers[i]);
      if (static_cast<std::int64_t>(value) != numbers[i])
        throw Failure(
            Error{.code = ErrorCode::unsupported,
                  .detail = std::to_string(numbers[i]) + " does not fit into the type of the array",
                  .section = "Cells"});
      std::memcpy(raw_.data() + i * sizeof value, &value, sizeof value);
    }
  });
  payload_.numbers(raw_.data(), numbers.size());
}

}  // namespace
}  // namespace vtu

void write_vtu(MeshSource& mesh, const std::string& path, Spool& spool) {
  vtu::Writer(mesh, path, spool).write();
}

}  // namespace shm::converters
