// ArrayLoader: finds and reads the arrays that the tree of a VTU file lists. Marks each array in
// the tree with a word that names the mesh array or the extra in which its numbers are stored.
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
  // Reads the head of the document. Borrows all arguments. Throws Failure if the head is invalid.
  ArrayLoader(std::string path, Document& document, MeshInfo& info);

  std::optional<ArrayType> type_of(const Node& array) const;
  std::uint64_t components_of(const Node& array) const;
  // Returns the value of an attribute. Throws Failure unless the attribute exists and is a
  // non-negative integer.
  std::uint64_t count_attribute(const Node& node, std::string_view key) const;

  // Reads at most `most` numbers of an array, and passes them to `take` in pieces. Returns the
  // count of numbers that were read.
  std::uint64_t read(Node& array, const ArrayType& type, std::uint64_t most,
                     const PayloadReader::Take& take);
  // Reads exactly `count` numbers of an array and appends them to `out`.
  void load(Node& array, const ArrayType& type, std::uint64_t count, PagedArray& out);
  // Returns true if the values of both arrays are the same bytes of the file. The arrays of several
  // time steps share their bytes if the values do not change.
  static bool same_place(const Node& a, const Node& b);
  // Returns true if both arrays have the same values, even if their encodings differ.
  bool same_values(Node& a, Node& b, Spool& spool);
  // Reads the numbers of an array as 64-bit integers, and passes them to `take` in pieces. Returns
  // the count of numbers that were read.
  std::uint64_t read_integers(Node& array, std::uint64_t most,
                              const std::function<void(std::span<const std::int64_t>)>& take);
  // Stores all numbers of an array as an extra. Throws Failure if there are more than `most`.
  void keep_as_extra(Node& array, std::uint64_t most);
  // Marks an array with the word that replaces its numbers in the skeleton (see vtu.h). A caller
  // that needs the numbers must read them before it calls mark().
  void mark(Node& array, const std::string& word);
  // Marks an array with `text`, which is the mark of another array that has the same numbers.
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
  // Maps the position of appended data in the file to the key of the extra that contains these
  // data.
  std::map<std::string, std::string> kept_;
  std::uint64_t extras_ = 0, extra_bytes_ = 0;
  // Block size in bytes of each array that has been read.
  std::map<const Node*, std::uint64_t> block_bytes_;
};

}  // namespace shm::converters::vtu
