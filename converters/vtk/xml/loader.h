// ArrayLoader: finds and reads the arrays that the tree of a VTU file lists. Notes in the tree
// which array or extra stores the numbers of each array.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "base/spool.h"
#include "mesh/mesh_source.h"
#include "vtk/xml/payload.h"
#include "vtk/xml_document.h"
#include "vtk/xml_words.h"

namespace shm::converters::vtu {

inline constexpr std::uint64_t kNoLimit = ~std::uint64_t{0};

class ArrayLoader {
 public:
  // Borrows all arguments. Throws Failure if the head of the document is invalid.
  ArrayLoader(std::string path, Document& document, MeshInfo& info);

  std::optional<ArrayType> type_of(const Node& array) const;
  std::uint64_t components_of(const Node& array) const;
  // Returns the value of an attribute that must be a count. Throws Failure otherwise.
  std::uint64_t count_attribute(const Node& node, std::string_view key) const;

  // Reads at most `most` numbers in pieces. Returns the count of numbers read.
  std::uint64_t read(Node& array, const ArrayType& type, std::uint64_t most,
                     const PayloadReader::Take& take);
  // Reads exactly `count` numbers and appends them to `out`.
  void load(Node& array, const ArrayType& type, std::uint64_t count, PagedArray& out);
  // Returns true if both arrays have the same place in the file. Arrays that do not change from
  // step to step share their place.
  static bool same_place(const Node& a, const Node& b);
  // Returns true if both arrays have the same values. Their encodings may differ.
  bool same_values(Node& a, Node& b, Spool& spool);
  // Reads numbers as 64-bit integers, in pieces. Returns the count of numbers read.
  std::uint64_t read_integers(Node& array, std::uint64_t most,
                              const std::function<void(std::span<const std::int64_t>)>& take);
  // Stores all numbers of an array, at most `most`, as an extra.
  void keep_as_extra(Node& array, std::uint64_t most);
  // Notes the word that replaces the numbers of an array (see vtu.h). If the array is read, call
  // this after reading it.
  void mark(Node& array, const std::string& word);
  // `text`: mark of the array with the same numbers.
  void mark_like(Node& array, const std::string& text);

  [[noreturn]] void fail(ErrorCode code, const Node& node, std::string detail) const;

 private:
  void read_head(Node& root);
  PayloadPlace place_of(Node& array) const;

  std::string path_;
  Document& document_;
  MeshInfo& info_;
  std::shared_ptr<vtk::RandomFile> file_;
  std::uint64_t file_bytes_ = 0;
  Style appended_style_ = Style::base64;
  std::optional<PayloadReader> payload_;
  std::map<std::string, std::string> kept_;  // keys of appended extras, by their place in the file
  std::uint64_t extras_ = 0, extra_bytes_ = 0;
  std::map<const Node*, std::uint64_t> block_bytes_;  // block size of each array read so far
};

}  // namespace shm::converters::vtu
