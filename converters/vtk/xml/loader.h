// ArrayLoader: finds and reads the arrays of a VTU file as its tree lists them, and notes in the
// tree what became of their numbers.
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
  // Borrows all. Throws Failure when the head of the document makes no sense.
  ArrayLoader(std::string path, Document& document, MeshInfo& info);

  std::optional<ArrayType> type_of(const Node& array) const;
  std::uint64_t components_of(const Node& array) const;
  // An attribute that must be a count.
  std::uint64_t count_attribute(const Node& node, std::string_view key) const;

  // At most `most` numbers, in pieces; returns how many there were.
  std::uint64_t read(Node& array, const ArrayType& type, std::uint64_t most,
                     const PayloadReader::Take& take);
  // Exactly `count` numbers, which `out` gets appended.
  void load(Node& array, const ArrayType& type, std::uint64_t count, PagedArray& out);
  // Whether both stand at the same place in the file, as arrays that do not change from step to
  // step do.
  static bool same_place(const Node& a, const Node& b);
  // Whether they have the same values, however they stand.
  bool same_values(Node& a, Node& b, Spool& spool);
  // As integers of 64 bits, in pieces.
  std::uint64_t read_integers(Node& array, std::uint64_t most,
                              const std::function<void(std::span<const std::int64_t>)>& take);
  // All numbers, at most `most`, become an extra of their own.
  void keep_as_extra(Node& array, std::uint64_t most);
  // Notes what the numbers of an array are (see vtu.h). After reading them, when they are read.
  void mark(Node& array, const std::string& what);
  void mark_like(Node& array, const std::string& text);  // `text`: of another array's mark

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
  std::map<std::string, std::string> kept_;  // appended extras by their place
  std::uint64_t extras_ = 0, extra_bytes_ = 0;
  std::map<const Node*, std::uint64_t> block_bytes_;  // of each array that was read
};

}  // namespace shm::converters::vtu
