#include "vtk/xml_document.h"

#include <expat.h>

#include <algorithm>
#include <exception>
#include <memory>
#include <random>

#include "base/failure.h"
#include "base/text_input.h"
#include "vtk/words.h"

namespace shm::converters::vtu {
namespace {

constexpr std::string_view kValuesTarget = "shm-values";
constexpr std::size_t kChunkBytes = std::size_t{1} << 16;
// Limits on the number of nodes and the size of the markup. They are needed because the tree is in
// memory. Real files have only a few hundred arrays.
constexpr std::uint64_t kMostNodes = std::uint64_t{1} << 20;
constexpr std::uint64_t kMostMarkupBytes = std::uint64_t{64} << 20;
constexpr std::uint64_t kLongestTag = std::uint64_t{4} << 20;
constexpr std::size_t kDeepest = 64;

bool is_blank(std::string_view text) {
  return text.find_first_not_of(" \t\r\n") == std::string_view::npos;
}

struct FreeParser {
  void operator()(XML_Parser parser) const { XML_ParserFree(parser); }
};

// Builds the tree from the callbacks of expat. Exceptions must not pass through expat, so a
// callback stores the exception and stops the parser.
class TreeBuilder {
 public:
  TreeBuilder(std::string path, bool skeleton);
  // Parses the next bytes of the file. Returns false when parsing is complete. Throws Failure.
  bool feed(std::string_view bytes, bool last);
  Document take() { return std::move(document_); }
  // Returns the offset in the file of the first byte after the start tag of the appended data, or 0
  // if no such tag exists.
  std::uint64_t appended_tag_end() const { return appended_tag_end_; }

 private:
  template <class Body>
  static void guarded(void* self, Body&& body) {
    auto& builder = *static_cast<TreeBuilder*>(self);
    if (builder.failure_ != nullptr) return;
    try {
      builder.last_event_ = builder.position();
      body(builder);
    } catch (...) {
      builder.failure_ = std::current_exception();
      XML_StopParser(builder.parser_.get(), XML_FALSE);
    }
  }
  void set_handlers();
  std::uint64_t position() const {
    return static_cast<std::uint64_t>(XML_GetCurrentByteIndex(parser_.get()));
  }
  [[noreturn]] void fail(ErrorCode code, std::string detail) const;
  [[noreturn]] void fail_parse() const;
  std::vector<Node>& siblings() { return open_.empty() ? document_.nodes : open_.back()->children; }
  void count(std::size_t bytes);
  void end_text();
  Node& add(Node node);
  void start(const char* name, const char** attributes);
  void end();
  void characters(std::string_view text);
  void value_characters(std::string_view text);
  void comment(std::string_view text);
  void instruction(std::string_view target, std::string_view data);
  void declaration(const char* encoding);

  std::string path_;
  bool skeleton_;
  std::unique_ptr<std::remove_pointer_t<XML_Parser>, FreeParser> parser_;
  Document document_;
  // The elements that contain the current position, from the root down. The pointers remain valid,
  // because children are added only to the innermost element.
  std::vector<Node*> open_;
  std::uint64_t nodes_ = 0, markup_ = 0, fed_ = 0, last_event_ = 0, appended_tag_end_ = 0;
  std::exception_ptr failure_;
};

TreeBuilder::TreeBuilder(std::string path, bool skeleton)
    : path_(std::move(path)), skeleton_(skeleton), parser_(XML_ParserCreate(nullptr)) {
  if (parser_ == nullptr) throw std::bad_alloc();
  std::random_device device;
  XML_SetHashSalt(parser_.get(), static_cast<unsigned long>(device()) | 1UL);
  XML_SetUserData(parser_.get(), this);
  set_handlers();
}

void TreeBuilder::set_handlers() {
  XML_SetElementHandler(
      parser_.get(),
      [](void* self, const char* name, const char** attributes) {
        guarded(self, [&](TreeBuilder& b) { b.start(name, attributes); });
      },
      [](void* self, const char*) { guarded(self, [](TreeBuilder& b) { b.end(); }); });
  XML_SetCharacterDataHandler(parser_.get(), [](void* self, const char* text, int size) {
    guarded(self, [&](TreeBuilder& b) { b.characters({text, static_cast<std::size_t>(size)}); });
  });
  XML_SetCommentHandler(parser_.get(), [](void* self, const char* text) {
    guarded(self, [&](TreeBuilder& b) { b.comment(text); });
  });
  XML_SetProcessingInstructionHandler(
      parser_.get(), [](void* self, const char* target, const char* data) {
        guarded(self, [&](TreeBuilder& b) { b.instruction(target, data); });
      });
  XML_SetXmlDeclHandler(parser_.get(), [](void* self, const char*, const char* encoding, int) {
    guarded(self, [&](TreeBuilder& b) { b.declaration(encoding); });
  });
  // Refuse a DOCTYPE, because only a DOCTYPE can declare entities. A file without a DOCTYPE
  // contains only the predefined entities, such as &lt;.
  XML_SetStartDoctypeDeclHandler(
      parser_.get(), [](void* self, const char*, const char*, const char*, int) {
        guarded(self, [](TreeBuilder& b) {
          b.fail(ErrorCode::unsupported, "has a DOCTYPE; entities are not resolved");
        });
      });
  XML_SetDefaultHandler(parser_.get(),
                        [](void* self, const char*, int) { guarded(self, [](TreeBuilder&) {}); });
}

void TreeBuilder::fail(ErrorCode code, std::string detail) const {
  throw Failure(Error{code, std::move(detail), "XML", position(), path_});
}

void TreeBuilder::fail_parse() const {
  const XML_Error error = XML_GetErrorCode(parser_.get());
  if (error == XML_ERROR_NO_MEMORY) throw std::bad_alloc();
  const bool ended = error == XML_ERROR_NO_ELEMENTS || error == XML_ERROR_UNCLOSED_TOKEN ||
                     error == XML_ERROR_UNCLOSED_CDATA_SECTION || error == XML_ERROR_PARTIAL_CHAR;
  if (ended || position() >= fed_) fail(ErrorCode::truncated, "the file ends within its XML");
  fail(ErrorCode::corrupt, std::string("is not XML: ") + XML_ErrorString(error));
}

bool TreeBuilder::feed(std::string_view bytes, bool last) {
  fed_ += bytes.size();
  const XML_Status status =
      XML_Parse(parser_.get(), bytes.data(), static_cast<int>(bytes.size()), last ? 1 : 0);
  if (failure_ != nullptr) std::rethrow_exception(failure_);
  if (appended_tag_end_ > 0) return false;
  if (status != XML_STATUS_OK) fail_parse();
  if (fed_ - std::min(fed_, last_event_) > kLongestTag + kChunkBytes)
    fail(ErrorCode::unsupported, "a tag or comment is longer than 4 MiB");
  return true;
}

void TreeBuilder::count(std::size_t bytes) {
  markup_ += bytes;
  if (nodes_ > kMostNodes || markup_ > kMostMarkupBytes)
    fail(ErrorCode::unsupported,
         "has more than a million elements or more than 64 MiB of markup, not counting its arrays");
}

// Completes the most recent sibling before a node other than text is added. If this sibling is the
// placeholder for the values of an array, sets its end in the file. If it is text that consists
// only of white space, removes it.
void TreeBuilder::end_text() {
  if (siblings().empty()) return;
  Node& last = siblings().back();
  if (last.kind == NodeKind::values && last.end == 0) last.end = position();
  if (last.kind == NodeKind::text && is_blank(last.text)) siblings().pop_back();
}

Node& TreeBuilder::add(Node node) {
  ++nodes_;
  std::size_t bytes = node.name.size() + node.text.size();
  for (const auto& [key, value] : node.attributes) bytes += key.size() + value.size() + 16;
  count(bytes);
  return siblings().emplace_back(std::move(node));
}

void TreeBuilder::start(const char* name, const char** attributes) {
  end_text();
  if (open_.size() == kDeepest)
    fail(ErrorCode::unsupported, "elements are nested more than 64 deep");
  Node node = element(name);
  for (; attributes[0] != nullptr; attributes += 2)
    node.attributes.emplace_back(attributes[0], attributes[1]);
  open_.push_back(&add(std::move(node)));
  if (skeleton_ || !open_.back()->is("AppendedData")) return;
  appended_tag_end_ =
      position() + static_cast<std::uint64_t>(XML_GetCurrentByteCount(parser_.get()));
  XML_StopParser(parser_.get(), XML_FALSE);
}

void TreeBuilder::end() {
  end_text();
  open_.pop_back();
}

void TreeBuilder::characters(std::string_view text) {
  if (open_.empty()) return;
  if (!skeleton_ && open_.back()->is_array()) return value_characters(text);
  auto& nodes = siblings();
  if (nodes.empty() || nodes.back().kind != NodeKind::text)
    add(Node{.kind = NodeKind::text, .name = {}});
  nodes.back().text.append(text);
  count(text.size());
}

void TreeBuilder::value_characters(std::string_view text) {
  if (is_blank(text)) return;
  Node* before = open_.back()->values();
  if (before == nullptr) {
    add(Node{.kind = NodeKind::values, .name = {}}).begin = position();
  } else if (before->end != 0) {
    fail(ErrorCode::corrupt, "other markup interrupts the values of an array");
  }
}

void TreeBuilder::comment(std::string_view text) {
  end_text();
  add(Node{.kind = NodeKind::comment, .name = {}, .text = std::string(text)});
}

void TreeBuilder::instruction(std::string_view target, std::string_view data) {
  end_text();
  const bool values = target == kValuesTarget;
  if (values && !skeleton_)
    fail(ErrorCode::unsupported, "the instruction shm-values is reserved for skeletons");
  add(Node{.kind = values ? NodeKind::values : NodeKind::instruction,
           .name = std::string(target),
           .text = std::string(data)});
}

void TreeBuilder::declaration(const char* encoding) {
  const std::string word = vtk::lower_case(encoding == nullptr ? "utf-8" : encoding);
  if (word != "utf-8" && word != "us-ascii" && word != "ascii" && word != "iso-8859-1")
    fail(ErrorCode::unsupported, "is encoded in '" + word.substr(0, 40) + "', not in UTF-8");
}

void append_escaped(std::string& out, std::string_view text, bool attribute) {
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '\r': out += "&#13;"; break;
      case '"': out += attribute ? "&quot;" : "\""; break;
      case '\n': out += attribute ? "&#10;" : "\n"; break;
      case '\t': out += attribute ? "&#9;" : "\t"; break;
      default: out += c;
    }
  }
}

void append_node(std::string& out, const Node& node) {
  switch (node.kind) {
    case NodeKind::text: append_escaped(out, node.text, false); return;
    case NodeKind::comment: out += "<!--" + node.text + "-->"; return;
    case NodeKind::instruction: out += "<?" + node.name + ' ' + node.text + "?>"; return;
    case NodeKind::values:
      out.append("<?").append(kValuesTarget).append(" ").append(node.text).append("?>");
      return;
    case NodeKind::element: break;
  }
  out += start_tag(node, node.children.empty());
  for (const Node& child : node.children) append_node(out, child);
  if (!node.children.empty()) out += "</" + node.name + '>';
  out += '\n';
}

// Returns the size in bytes of the UTF-8 character at the start of `text`. Returns 0 if XML does
// not allow this character.
std::size_t character_bytes(std::string_view text) {
  const auto first = static_cast<unsigned char>(text[0]);
  if (first < 0x80) return first >= 0x20 && first != 0x7f ? 1 : 0;
  const std::size_t size = first >= 0xf0 && first < 0xf5   ? 4
                           : first >= 0xe0 && first < 0xf0 ? 3
                           : first >= 0xc2 && first < 0xe0 ? 2
                                                           : 0;
  if (size == 0 || text.size() < size) return 0;
  std::uint32_t code = first & (0xffU >> (size + 1));
  for (std::size_t i = 1; i < size; ++i) {
    const auto next = static_cast<unsigned char>(text[i]);
    if ((next & 0xc0) != 0x80) return 0;
    code = code << 6 | (next & 0x3f);
  }
  constexpr std::uint32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool allowed = code >= kLeast[size] && code <= 0x10ffff &&
                       (code < 0xd800 || code > 0xdfff) && code != 0xfffe && code != 0xffff;
  return allowed ? size : 0;
}

// Returns the offset in the file of the appended data, or 0 if the file has none. Appended data
// begins after the character '_', which follows the start tag and optional white space.
std::uint64_t find_appended(TextInput& input, std::uint64_t tag_end) {
  input.seek(tag_end);
  while (!input.at_end()) {
    std::byte byte;
    input.bytes(&byte, 1);
    const char c = static_cast<char>(byte);
    if (c == '_') return input.offset();
    if (!is_blank({&c, 1})) break;
  }
  return 0;
}

}  // namespace

const std::string* Node::attribute(std::string_view key) const {
  for (const auto& [name_of, value] : attributes)
    if (name_of == key) return &value;
  return nullptr;
}

std::string Node::attribute_or(std::string_view key, std::string_view otherwise) const {
  const std::string* found = attribute(key);
  return found == nullptr ? std::string(otherwise) : *found;
}

void Node::set_attribute(std::string_view key, std::string value) {
  for (auto& [name_of, old] : attributes) {
    if (name_of != key) continue;
    old = std::move(value);
    return;
  }
  attributes.emplace_back(std::string(key), std::move(value));
}

void Node::remove_attribute(std::string_view key) {
  std::erase_if(attributes, [&](const auto& each) { return each.first == key; });
}

Node* Node::child(std::string_view element_name) {
  for (Node& each : children)
    if (each.is(element_name)) return &each;
  return nullptr;
}

Node* Node::values() {
  for (Node& each : children)
    if (each.kind == NodeKind::values) return &each;
  return nullptr;
}

Node element(std::string name, std::vector<std::pair<std::string, std::string>> attributes) {
  return Node{.name = std::move(name), .attributes = std::move(attributes)};
}

Node values_node(std::string word) {
  return Node{.kind = NodeKind::values, .name = {}, .text = std::move(word)};
}

Node array_element(std::string type, std::string name, std::uint64_t components, std::string format,
                   std::string word) {
  Node node = element("DataArray", {{"type", std::move(type)}, {"Name", std::move(name)}});
  if (components != 1) node.set_attribute("NumberOfComponents", std::to_string(components));
  node.set_attribute("format", std::move(format));
  node.children.push_back(values_node(std::move(word)));
  return node;
}

Node& Document::root() {
  return *std::find_if(nodes.begin(), nodes.end(),
                       [](const Node& node) { return node.kind == NodeKind::element; });
}

Document read_document(const std::string& path) {
  TextInput input(path);
  TreeBuilder builder(path, false);
  std::string chunk;
  bool more = true;
  while (more) {
    chunk.resize(std::min<std::uint64_t>(kChunkBytes, input.left()));
    input.bytes(reinterpret_cast<std::byte*>(chunk.data()), chunk.size());
    const bool last = input.left() == 0;
    more = builder.feed(chunk, last) && !last;
  }
  Document document = builder.take();
  if (builder.appended_tag_end() > 0)
    document.appended_begin = find_appended(input, builder.appended_tag_end());
  return document;
}

std::string to_text(const Document& document) {
  std::string text;
  for (const Node& node : document.nodes) append_node(text, node);
  return text;
}

std::optional<Document> parse_skeleton(std::string_view text) {
  TreeBuilder builder({}, true);
  try {
    for (std::size_t offset = 0; offset < text.size(); offset += kChunkBytes)
      builder.feed(text.substr(offset, kChunkBytes), false);
    builder.feed({}, true);
  } catch (const Failure&) {
    return std::nullopt;
  }
  return builder.take();
}

std::string start_tag(const Node& node, bool empty) {
  std::string out = '<' + node.name;
  for (const auto& [key, value] : node.attributes) {
    out.append(" ").append(key).append("=\"");
    append_escaped(out, value, true);
    out += '"';
  }
  return out + (empty ? "/>" : ">");
}

std::string escaped_text(std::string_view text) {
  std::string out;
  append_escaped(out, text, false);
  return out;
}

std::string valid_name(std::string_view name) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string out;
  while (!name.empty()) {
    const std::size_t size = character_bytes(name);
    const auto first = static_cast<unsigned char>(name[0]);
    if (size > 0) {
      out.append(name.substr(0, size));
    } else {
      out += {'%', kDigits[first >> 4], kDigits[first & 15]};
    }
    name.remove_prefix(std::max<std::size_t>(size, 1));
  }
  return out;
}

}  // namespace shm::converters::vtu
