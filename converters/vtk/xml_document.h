// The XML of a VTU file as a tree without its numbers. Where the numbers of an array stand, the
// tree has a node of kind `values`; parsing stops where appended data, which is not XML, begins.
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
  std::string name{};  // of an element, or target of an instruction
  // Characters of a text, comment or instruction; of values: what they are (see vtu.h).
  std::string text{};
  std::vector<std::pair<std::string, std::string>> attributes{};  // in file order
  std::vector<Node> children{};
  std::uint64_t begin = 0, end = 0;  // values that stand inline: their bytes in the file

  bool is(std::string_view element) const { return kind == NodeKind::element && name == element; }
  bool is_array() const { return is("DataArray") || is("Array"); }
  // Null when absent.
  const std::string* attribute(std::string_view key) const;
  std::string attribute_or(std::string_view key, std::string_view otherwise) const;
  void set_attribute(std::string_view key, std::string value);
  void remove_attribute(std::string_view key);
  Node* child(std::string_view element);
  // The child that stands for the numbers of an array; null when there is none.
  Node* values();
};

Node element(std::string name, std::vector<std::pair<std::string, std::string>> attributes = {});

// What stands for the numbers of an array.
Node values_node(std::string word);
// <DataArray> of numbers: type is "Float64", ...
Node array_element(std::string type, std::string name, std::uint64_t components, std::string format,
                   std::string word);

struct Document {
  std::vector<Node> nodes;           // the root and what stands before and after it
  std::uint64_t appended_begin = 0;  // in the file, behind the '_'; 0: no appended data
  Node& root();                      // there is always one
};

// Parses a file. Throws Failure: corrupt or truncated XML; unsupported for a DOCTYPE, encodings
// other than UTF-8, ASCII and Latin-1, and more markup than a million nodes or 64 MiB.
Document read_document(const std::string& path);

// The tree as XML (UTF-8), values as instructions <?shm-values ...?>; and back.
std::string to_text(const Document& document);
std::optional<Document> parse_skeleton(std::string_view text);

// Pieces of XML: `<Name key="value">`, or `<Name key="value"/>` when `empty`; escaped characters.
std::string start_tag(const Node& node, bool empty);
std::string escaped_text(std::string_view text);
// A name of another format as one that XML can hold: other bytes become %XX.
std::string valid_name(std::string_view name);

}  // namespace shm::converters::vtu
