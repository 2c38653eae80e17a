// Document: the XML of a VTU file as a tree. The tree does not contain the values of arrays: for
// each array, a node of kind `values` is the placeholder for them. Parsing stops at the
// beginning of appended data, which is not XML.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace shm::converters::vtu {

enum class NodeKind : std::uint8_t { element, text, comment, instruction, values };

struct Node {
  NodeKind kind = NodeKind::element;
  std::string name{};  // name of an element, or target of an instruction

  // The contents of a text, comment or instruction. For a node of kind `values`: a word that
  // identifies the stored numbers of the array (see vtu.h).
  std::string text{};
  std::vector<std::pair<std::string, std::string>> attributes{};  // attributes in file order
  std::vector<Node> children{};
  std::uint64_t begin = 0,
                end = 0;  // byte range of the values in the file; used for values inside the XML

  bool is(std::string_view element) const { return kind == NodeKind::element && name == element; }
  bool is_array() const { return is("DataArray") || is("Array"); }
  // Returns the value of an attribute, or null if the node has no such attribute.
  const std::string* attribute(std::string_view key) const;
  std::string attribute_or(std::string_view key, std::string_view otherwise) const;
  void set_attribute(std::string_view key, std::string value);
  void remove_attribute(std::string_view key);
  Node* child(std::string_view element);
  // Returns the child of kind `values`, the placeholder for the numbers of an array, or null if no
  // such child exists.
  Node* values();
};

Node element(std::string name, std::vector<std::pair<std::string, std::string>> attributes = {});

// Returns a node of kind `values`. `word` identifies the stored numbers of the array (see vtu.h).
Node values_node(std::string word);
// Returns a <DataArray> element. `type` is the VTK name of a numeric type, e.g. "Float64". `word`
// identifies the stored numbers of the array (see vtu.h).
Node array_element(std::string type, std::string name, std::uint64_t components, std::string format,
                   std::string word);

struct Document {
  std::vector<Node> nodes;  // the root element, and the nodes before and after the root element

  // Offset in the file of the byte after the '_' of appended data; 0 if the file has no appended
  // data.
  std::uint64_t appended_begin = 0;
  Node& root();  // returns the root element, which always exists
};

// Parses a file. Throws Failure. Its code is `corrupt` or `truncated` if the XML is damaged, and
// `unsupported` if the file has a DOCTYPE, an encoding other than UTF-8, ASCII and Latin-1, or
// markup of more than a million nodes or 64 MiB.
Document read_document(const std::string& path);

// to_text() converts a tree to XML (UTF-8), and parse_skeleton() parses the result of to_text(). In
// this XML, each array has an instruction <?shm-values ...?> instead of its numbers.
std::string to_text(const Document& document);
std::optional<Document> parse_skeleton(std::string_view text);

// start_tag() returns a tag `<Name key="value">`, or `<Name key="value"/>` if `empty` is true.
// escaped_text() replaces special characters with XML entities, e.g. & with &amp;.
std::string start_tag(const Node& node, bool empty);
std::string escaped_text(std::string_view text);
// Converts any byte string, e.g. an array name from another format, to a name that XML can contain:
// replaces each byte that XML does not allow with %XX.
std::string valid_name(std::string_view name);

}  // namespace shm::converters::vtu
