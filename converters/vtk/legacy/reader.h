// Reads VTK legacy files. The Parser reads the file once, front to back. It records the position of
// every column of numbers in a VtkSource, which reads the numbers later, on demand. Sections may be
// in any order that VTK's own readers accept.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/spool.h"
#include "base/text_input.h"
#include "mesh/mesh_source.h"
#include "vtk/cells.h"
#include "vtk/legacy/lattice.h"
#include "vtk/values.h"
#include "vtk/words.h"

namespace shm::converters::vtk {

class VtkSource : public MeshSource {
 public:
  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override;
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override;
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

 private:
  friend class Parser;
  // Maximum number of cell lists in a data set. Polygonal data has four lists, in the order in
  // which VTK numbers their cells; all other data sets have one list.
  static constexpr std::size_t kLists = 4;

  MeshInfo info_;
  Values points_;
  LatticePoints lattice_points_;  // points of a data set without a POINTS section
  std::array<CellTable, kLists> lists_;
  std::optional<Lattice> lattice_;
  // Index of the cell that next_cells() returns next; used only for structured data.
  std::uint64_t lattice_cell_ = 0;
  bool makes_points_ = false;
  std::vector<Values> arrays_;
};

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
  void finish();
  Values column(ScalarType type, std::uint64_t count);
  std::uint64_t product(std::uint64_t a, std::uint64_t b);
  void next_line_is_binary() {
    if (skeleton_.binary) input_.skip_line();
  }
  void metadata(std::uint64_t components, std::string& out);
  void read_metadata(std::uint64_t components, std::string& out);

  // Reads a section that contains points or cells, or the dimensions or axes that determine them.
  bool geometry_keyword(EntryKind kind);
  void points();
  void cells(EntryKind kind);
  void cell_types();
  Values cell_numbers(const char* keyword, std::string& word, std::uint64_t count);
  void dimensions(EntryKind kind);
  void spacing(EntryKind kind);
  void coordinates(EntryKind kind);
  void blanking();
  bool seen(EntryKind kind) const { return seen_[static_cast<std::size_t>(kind)]; }
  std::string plain_words_of(EntryKind kind);
  void finish_lattice();
  void finish_axes();
  void finish_cells();

  // The following functions read arrays. They are defined in attributes.cpp.
  void begin_section(EntryKind kind);
  void field();
  void field_array();
  void attribute(EntryKind kind);
  void lookup_table();
  void values(Entry entry);
  void numbers(Entry& entry, ScalarType type);
  bool is_per_element(const Entry& entry) const;
  void add_array(Entry& entry, Values values, std::string_view role);
  std::optional<std::size_t> written_before(EntryKind kind, const ArrayInfo& array, Values& values);
  void other_values(Entry& entry, ValueForm form);
  void bits(Entry& entry, std::uint64_t count);
  void listed_strings(Entry& entry, ValueForm form, std::uint64_t count);
  void one_string(ValueForm form, std::string& out);
  std::uint64_t section_size() const;

  std::string path_;
  Spool& spool_;
  VtkSource& source_;
  MeshInfo& info_;
  TextInput input_;
  std::shared_ptr<RandomFile> binary_file_;
  Skeleton skeleton_;
  Section section_ = Section::dataset;
  // seen_[kind] is true if a section of this kind has occurred; some kinds may occur only once.
  std::array<bool, kEntryKinds> seen_{};
  bool saw_types_ = false;
  std::size_t data_count_ = 0;
  // Pairs (array, role) that the reader has found so far.
  std::set<std::pair<std::size_t, EntryKind>> roles_;

  // Indices of the first few arrays with each name. The key is (location, name).
  std::map<std::pair<Location, std::string>, std::vector<std::size_t>> named_;
};

}  // namespace shm::converters::vtk
