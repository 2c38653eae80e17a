// Writes VTK legacy files: goes once through the skeleton of a FilePlan (the file without its
// numbers) and inserts the numbers.
#include <algorithm>
#include <cstring>
#include <span>
#include <utility>

#include "base/output_file.h"
#include "base/stored_value.h"
#include "vtk/legacy/plan.h"
#include "vtk/legacy/vtk.h"
#include "vtk/strings.h"
#include "vtk/values.h"
#include "vtk/words.h"

namespace shm::converters {
namespace vtk {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 18;
constexpr std::size_t kNumbersPerLine = 9;

class Writer {
 public:
  Writer(MeshSource& mesh, const std::string& path)
      : mesh_(mesh),
        info_(mesh.info()),
        plan_(mesh),
        skeleton_(plan_.skeleton()),
        out_(path, skeleton_.binary) {}
  void write();

 private:
  void entry(std::size_t index);
  void field_head(std::size_t index);
  void values_head(const Entry& entry);
  void values(const Entry& entry);
  void extra_values(const Entry& entry);
  template <class Take>
  void for_each_piece(std::size_t array, Take&& take);
  void whole_array(std::size_t array);
  void bit_array(std::size_t array);
  void string_array(const Entry& entry, ValueForm form);
  void partial_array(std::size_t array);
  void block_ids(ScalarType type);
  void points(const Entry& entry);
  void cells(const Entry& entry);
  void rows(const FilePlan::CellList& list);
  void offsets_and_connectivity(const Entry& entry, const FilePlan::CellList& list);
  void cell_types();
  void metadata(const Entry& entry);
  void integers_out(ScalarType type, const std::vector<std::uint64_t>& numbers,
                    std::size_t per_line);

  MeshSource& mesh_;
  const MeshInfo& info_;
  FilePlan plan_;
  const Skeleton& skeleton_;
  NumberOutput out_;
  std::vector<std::byte> raw_;  // buffer of integers_out()
};

void Writer::write() {
  out_.line("# vtk DataFile Version " + skeleton_.version);
  out_.line(skeleton_.title);
  out_.line(skeleton_.binary ? "BINARY" : "ASCII");
  out_.line("DATASET " + std::string(dataset_word(skeleton_.dataset)));
  for (std::size_t i = 0; i < skeleton_.entries.size(); ++i) entry(i);
  out_.finish();
}

void Writer::entry(std::size_t index) {
  const Entry& current = skeleton_.entries[index];
  switch (current.kind) {
    case EntryKind::field: field_head(index); break;
    case EntryKind::points: points(current); break;
    case EntryKind::cells:
    case EntryKind::vertices:
    case EntryKind::lines:
    case EntryKind::polygons:
    case EntryKind::triangle_strips: cells(current); break;
    case EntryKind::dimensions:
    case EntryKind::extent:
    case EntryKind::spacing:
    case EntryKind::aspect_ratio:
    case EntryKind::origin:
      out_.line(std::string(keyword(current.kind)) + ' ' + current.type);
      break;
    case EntryKind::cell_data: out_.line("CELL_DATA " + std::to_string(info_.cells())); break;
    case EntryKind::point_data: out_.line("POINT_DATA " + std::to_string(info_.vertices)); break;
    case EntryKind::null_array: out_.line("NULL_ARRAY"); break;
    default:
      values_head(current);
      values(current);
      break;
  }
  metadata(current);
}

void Writer::field_head(std::size_t index) {
  std::size_t end = index + 1;
  const auto& entries = skeleton_.entries;
  while (end < entries.size() &&
         (entries[end].kind == EntryKind::array || entries[end].kind == EntryKind::null_array))
    ++end;
  out_.line("FIELD " + entries[index].name + ' ' + std::to_string(end - index - 1));
}

void Writer::metadata(const Entry& entry) {
  if (entry.metadata.empty()) return;
  out_.line("METADATA");
  out_.line(entry.metadata);
}

void Writer::values_head(const Entry& entry) {
  const std::string components = std::to_string(entry.components);
  const std::string tuples = std::to_string(entry.tuples);
  const std::string kind(keyword(entry.kind));
  switch (entry.kind) {
    case EntryKind::array:
      return out_.line(entry.name + ' ' + components + ' ' + tuples + ' ' + entry.type);
    case EntryKind::scalars:
      out_.line(kind + ' ' + entry.name + ' ' + entry.type +
                (entry.components == 1 ? "" : ' ' + components));
      return out_.line("LOOKUP_TABLE " + entry.second);
    case EntryKind::color_scalars: return out_.line(kind + ' ' + entry.name + ' ' + components);
    case EntryKind::lookup_table: return out_.line(kind + ' ' + entry.name + ' ' + tuples);
    case EntryKind::x_coordinates:
    case EntryKind::y_coordinates:
    case EntryKind::z_coordinates:
    case EntryKind::blanking: return out_.line(kind + ' ' + tuples + ' ' + entry.type);
    case EntryKind::texture_coordinates:
      return out_.line(kind + ' ' + entry.name + ' ' + components + ' ' + entry.type);
    default: return out_.line(kind + ' ' + entry.name + ' ' + entry.type);
  }
}

void Writer::values(const Entry& entry) {
  if (entry.origin == Origin::extra) return extra_values(entry);
  const ValueForm form = form_of_word(entry.type);
  if (form == ValueForm::bit) return bit_array(entry.index);
  if (form != ValueForm::number) return string_array(entry, form);
  if (entry.origin == Origin::block_ids) {
    block_ids(*scalar_of_word(entry.type, skeleton_.binary));
  } else if (info_.schema.arrays[entry.index].blocks.empty()) {
    whole_array(entry.index);
  } else {
    partial_array(entry.index);
  }
  out_.end_column();
}

void Writer::extra_values(const Entry& entry) {
  const std::string key = data_key(entry.index);
  const Extra* found = plan_.extra(key);
  if (found == nullptr) fail_extra(key, "is missing");
  std::uint64_t count = 0;
  if (__builtin_mul_overflow(entry.components, entry.tuples, &count))
    fail_extra(key, "states an impossible size");
  const ValueForm form = form_of_word(entry.type);
  const std::string_view raw(reinterpret_cast<const char*>(found->data.data()), found->data.size());
  if (form == ValueForm::number) {
    const ScalarType type = *scalar_of_word(entry.type, skeleton_.binary);
    if (found->type != type || raw.size() % scalar_bytes(type) != 0 ||
        raw.size() / scalar_bytes(type) != count)
      fail_extra(
          key,
          "the type or the number of the values differs from the stored structure of the VTK file");
    const std::uint64_t per_line = entry.components > 1 ? entry.components : kNumbersPerLine;
    out_.numbers(type, found->data.data(), count, per_line);
    out_.end_column();
  } else if (form == ValueForm::bit && !skeleton_.binary) {
    std::string digits;
    for (char bit : raw) digits.append(bit != 0 ? "1\n" : "0\n");
    out_.text(digits);
  } else {
    out_.text(raw);
    if (skeleton_.binary && form != ValueForm::variant) out_.text("\n");
  }
}

// Reads an array in pieces and calls take(bytes, elements) for each piece. `elements` is the number
// of elements in the piece. It is a multiple of 8, except in the last call.
template <class Take>
void Writer::for_each_piece(std::size_t array, Take&& take) {
  const ArrayInfo& info = info_.schema.arrays[array];
  const std::size_t stride = info_.array_stride(array);
  const std::uint64_t total = info_.array_elements(array);
  const std::uint64_t step = info.per_step ? info_.step_times.size() - 1 : 0;
  const std::uint64_t at_once = std::max<std::uint64_t>(kPieceBytes / stride / 8 * 8, 8);
  std::vector<std::byte> piece(std::min(at_once, total) * stride);
  for (std::uint64_t first = 0; first < total; first += at_once) {
    const std::uint64_t n = std::min(at_once, total - first);
    mesh_.read_array(array, step, first, n, piece.data());
    take(piece.data(), n);
  }
}

void Writer::whole_array(std::size_t array) {
  const ArrayInfo& info = info_.schema.arrays[array];
  const std::size_t per_line = info.components > 1 ? info.components : kNumbersPerLine;
  for_each_piece(array, [&](const std::byte* values, std::uint64_t n) {
    out_.numbers(info.type, values, n * info.components, per_line);
  });
}

void Writer::bit_array(std::size_t array) {
  const std::uint32_t components = info_.schema.arrays[array].components;
  std::string text;
  for_each_piece(array, [&](const std::byte* values, std::uint64_t n) {
    text.clear();
    if (skeleton_.binary) text.resize((n * components + 7) / 8);
    for (std::uint64_t i = 0; i < n * components; ++i) {
      const bool bit = values[i] != std::byte{};
      if (!skeleton_.binary) text.append(bit ? "1\n" : "0\n");
      if (skeleton_.binary && bit)
        text[i / 8] = static_cast<char>(static_cast<unsigned char>(text[i / 8]) | 0x80U >> i % 8);
    }
    out_.text(text);
  });
  if (skeleton_.binary) out_.text("\n");
}

void Writer::string_array(const Entry& entry, ValueForm form) {
  const std::string key = strings_key(entry.index);
  const Extra* found = plan_.extra(key);
  if (found == nullptr) fail_extra(key, "is missing");
  const auto strings =
      split_strings({reinterpret_cast<const char*>(found->data.data()), found->data.size()},
                    string_form(form, skeleton_.binary));
  if (!strings) fail_extra(key, "ends within a string");
  for_each_piece(entry.index, [&](const std::byte* values, std::uint64_t n) {
    for (std::uint64_t i = 0; i < n * entry.components; ++i) {
      std::uint32_t place = 0;
      std::memcpy(&place, values + i * sizeof place, sizeof place);
      if (place >= strings->size()) fail_extra(key, "lacks string " + std::to_string(place));
      out_.text((*strings)[place]);
    }
  });
  if (skeleton_.binary && form == ValueForm::string) out_.text("\n");
}

void Writer::partial_array(std::size_t array) {
  const ArrayInfo& info = info_.schema.arrays[array];
  const std::size_t per_line = info.components > 1 ? info.components : kNumbersPerLine;
  const std::uint64_t step = info.per_step ? info_.step_times.size() - 1 : 0;
  plan_.for_each_filled(array, step, [&](std::span<const std::byte> values) {
    out_.numbers(info.type, values.data(), values.size() / scalar_bytes(info.type), per_line);
  });
}

void Writer::block_ids(ScalarType type) {
  std::vector<std::uint64_t> ids;
  plan_.for_each_batch([&](const CellBatch& batch) {
    ids.clear();
    for (const std::uint32_t block : batch.blocks)
      ids.push_back(static_cast<std::uint64_t>(info_.schema.blocks[block].id));
    integers_out(type, ids, kNumbersPerLine);
  });
}

void Writer::points(const Entry& entry) {
  const ScalarType from = info_.schema.coordinate_type;
  const auto known = scalar_of_word(entry.type, skeleton_.binary);
  const ScalarType to = known.value_or(from);
  out_.line("POINTS " + std::to_string(info_.vertices) + ' ' +
            (known ? entry.type : std::string(word_of_scalar(from))));
  constexpr std::uint64_t kAtOnce = kPieceBytes / (3 * sizeof(double));
  std::vector<std::byte> piece(kPieceBytes), converted(kPieceBytes);
  for (std::uint64_t first = 0; first < info_.vertices; first += kAtOnce) {
    const std::uint64_t n = std::min(kAtOnce, info_.vertices - first);
    mesh_.read_points(first, n, piece.data());
    if (to != from) convert_numbers(from, piece.data(), n * 3, to, converted.data());
    out_.numbers(to, to == from ? piece.data() : converted.data(), n * 3, 3);
  }
  out_.end_column();
}

void Writer::integers_out(ScalarType type, const std::vector<std::uint64_t>& numbers,
                          std::size_t per_line) {
  raw_.resize(numbers.size() * scalar_bytes(type));
  with_scalar(type, [&](auto value) {
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      value = static_cast<decltype(value)>(numbers[i]);
      std::memcpy(raw_.data() + i * sizeof value, &value, sizeof value);
    }
  });
  out_.numbers(type, raw_.data(), numbers.size(), per_line);
}

void Writer::cells(const Entry& entry) {
  const FilePlan::CellList& list = plan_.cell_list(entry.kind);
  out_.text(std::string(keyword(entry.kind)) + ' ');
  if (skeleton_.major_version() < 5) {
    rows(list);
  } else {
    offsets_and_connectivity(entry, list);
  }
  if (entry.kind != EntryKind::cells) return;
  out_.line("CELL_TYPES " + std::to_string(info_.cells()));
  cell_types();
  out_.end_column();
}

void Writer::rows(const FilePlan::CellList& list) {
  out_.line(std::to_string(list.cells) + ' ' + std::to_string(list.numbers + list.cells));
  const ScalarType type = skeleton_.binary ? ScalarType::int32 : ScalarType::int64;
  std::vector<std::uint64_t> row;
  plan_.for_each_cell_of(list, [&](const auto& numbers) {
    row.assign(1, numbers.size());
    row.insert(row.end(), numbers.begin(), numbers.end());
    integers_out(type, row, row.size());
  });
  out_.end_column();
}

void Writer::offsets_and_connectivity(const Entry& entry, const FilePlan::CellList& list) {
  const std::uint64_t offsets = list.cells > 0 ? list.cells + 1 : 0;
  out_.line(std::to_string(offsets) + ' ' + std::to_string(list.numbers));
  if (offsets == 0) return;
  const auto column = [&](const char* head, const std::string& word, auto&& fill) {
    out_.line(head + word);
    fill(*scalar_of_word(word, skeleton_.binary));
    out_.end_column();
  };
  column("OFFSETS ", entry.type, [&](ScalarType type) {
    std::vector<std::uint64_t> ends(1, 0);
    std::uint64_t end = 0;
    plan_.for_each_cell_of(list, [&](const auto& numbers) {
      ends.push_back(end += numbers.size());
      if (ends.size() < kBatchCells) return;
      integers_out(type, ends, kNumbersPerLine);
      ends.clear();
    });
    integers_out(type, ends, kNumbersPerLine);
  });
  column("CONNECTIVITY ", entry.second, [&](ScalarType type) {
    plan_.for_each_cell_of(
        list, [&](const auto& numbers) { integers_out(type, numbers, kNumbersPerLine); });
  });
}

void Writer::cell_types() {
  std::vector<std::uint64_t> types;
  plan_.for_each_batch([&](const CellBatch& batch) {
    types.clear();
    for (const std::uint32_t block : batch.blocks)
      types.push_back(static_cast<std::uint64_t>(plan_.block_type(block)));
    integers_out(ScalarType::int32, types, kNumbersPerLine);
  });
}

}  // namespace
}  // namespace vtk

void write_vtk(MeshSource& mesh, const std::string& path, Spool&) {
  vtk::Writer(mesh, path).write();
}

}  // namespace shm::converters
