#include "segment/shift_segment_decoder.h"

#include <algorithm>
#include <bit>

#include "segment/difference_columns.h"
#include "segment/mesh_streams.h"

namespace shm {

using container::StreamKind;

namespace {

/// Whether values of the static arrays there, or coordinates, are.
bool wants(const WantedValues& wanted, const Schema& schema, Location location) {
  if (location == Location::point && wanted.geometry) return true;
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a)
    if (schema.arrays[a].location == location && !schema.arrays[a].per_step &&
        wanted.includes_array(a))
      return true;
  return false;
}

}  // namespace

ShiftSegmentDecoder::ShiftSegmentDecoder(const Schema& schema, const SegmentStart& start,
                                         const WantedValues& wanted)
    : schema_(&schema),
      wanted_(wanted),
      may_import_(start.segment > 0),
      numbered_by_birth_(schema.order != Order::keep),
      shifts_(schema, may_import_),
      columns_(difference_columns(schema)),
      neighbours_(schema, wants(wanted_, schema, Location::point),
                  wants(wanted_, schema, Location::cell)),
      vertex_bytes_(3 * scalar_bytes(schema.coordinate_type) + point_data_bytes(schema)),
      cell_bytes_(cell_data_bytes(schema)),
      first_own_(start.first_vertex),
      next_own_(start.first_vertex) {
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a)
    if (!schema.arrays[a].per_step) arrays_.push_back(a);
  for (std::size_t b = 0; b < schema.blocks.size(); ++b)
    most_cell_bytes_ = std::max(
        most_cell_bytes_, cell_bytes_[b] + schema.blocks[b].nodes_per_cell * (8 + vertex_bytes_));
}

void ShiftSegmentDecoder::begin_group(const container::GroupHeader& header) {
  header_ = &header;
  next_column_ = 0;
  import_coder_ = RangeDecoder(std::span<const std::byte>());
  for (DifferenceColumn& column : columns_) column.begin_empty_group();
  is_predicted_.assign(columns_.size(), 0);
}

/// The column of a stream of values; the number of columns where there is none.
std::size_t ShiftSegmentDecoder::column_of(const container::StreamEntry& entry) const {
  if (entry.kind == StreamKind::geometry) return 0;
  if (entry.kind != StreamKind::array) return columns_.size();
  const auto at = std::lower_bound(arrays_.begin(), arrays_.end(), entry.array);
  return at != arrays_.end() && *at == entry.array
             ? static_cast<std::size_t>(at - arrays_.begin()) + 1
             : columns_.size();
}

bool ShiftSegmentDecoder::expects(const container::StreamEntry& entry) const {
  if (entry.kind == StreamKind::connectivity) return &entry == header_->streams.data();
  if (entry.kind == StreamKind::vertex_numbers)
    return numbered_by_birth_ && may_import_ && &entry == header_->streams.data() + 1;
  const std::size_t column = column_of(entry);
  return column < columns_.size() && column >= next_column_;
}

bool ShiftSegmentDecoder::takes(const container::StreamEntry& entry) const {
  if (entry.kind == StreamKind::connectivity) return entry.codec == container::Codec::shifts;
  if (entry.kind == StreamKind::vertex_numbers) return entry.codec == container::Codec::predictive;
  const std::size_t column = column_of(entry);
  if (const auto codec = bulk_codec(entry.codec)) return columns_[column].takes(*codec);
  const auto codec = column_codec(entry.codec);
  return codec && has_neighbours_ && predicted_[column] != nullptr &&
         predicted_[column]->takes(*codec);
}

auto ShiftSegmentDecoder::take(const container::StreamEntry& entry,
                               std::span<const std::byte> bytes) -> Complaint {
  // No caller's limit lets counts of bytes wrap.
  const std::uint64_t decoded_bytes = std::min(header_->decoded_bytes, std::uint64_t{1} << 56);
  if (entry.kind == StreamKind::connectivity) return take_connectivity(bytes, decoded_bytes);
  if (entry.kind == StreamKind::vertex_numbers) {
    import_coder_ = RangeDecoder(bytes);
    return {};
  }
  const std::size_t column = column_of(entry);
  next_column_ = column + 1;
  const auto bulk = bulk_codec(entry.codec);
  is_predicted_[column] = bulk ? 0 : 1;
  if (!bulk) predicted_[column]->make_room(neighbours_.slots());
  if (bulk ? columns_[column].begin_group(*bulk, bytes, decoded_bytes, scratch_.zstd)
           : predicted_[column]->begin_group(*column_codec(entry.codec), bytes, decoded_bytes))
    return {};
  return (column == 0 ? "geometry" : array_stream_name(*schema_, entry.array)) +
         std::string(": cannot be unpacked");
}

auto ShiftSegmentDecoder::take_connectivity(std::span<const std::byte> bytes,
                                            std::uint64_t decoded_bytes) -> Complaint {
  ByteReader in(bytes);
  const std::uint8_t bits = in.get_u8();
  has_neighbours_ = bits > 0;
  if (!in.ok() || !neighbours_.begin_group(bits, header_->cells) ||
      (!has_neighbours_ && needs_ring(*schema_)))
    return "connectivity: what it remembers makes no sense";
  if (predicted_.empty() && has_neighbours_)
    predicted_ = predicted_columns<SplitDecoder>(*schema_, columns_);
  // A shift says each node of a new cell, a loose vertex its number, in at most ten bytes, of
  // which they count for eight and twelve.
  const std::uint64_t most = 3 * decoded_bytes + 64 * std::uint64_t{header_->cells};
  return shifts_.begin_group(in.get_bytes(in.left()), header_->cells, most, scratch_.zstd)
             ? ""
             : "connectivity: cannot be unpacked";
}

bool ShiftSegmentDecoder::at_end() const {
  return shifts_.at_end() && std::all_of(columns_.begin(), columns_.end(),
                                         [](const auto& column) { return column.at_end(); });
}

// --- blocks

auto ShiftSegmentDecoder::next_block(DecodedBlock& decoded, GroupProgress& done,
                                     bool yields_imports) -> Complaint {
  MeshBlock& block = decoded.mesh;
  yields_imports_ = yields_imports;
  born_.clear();
  left_out_.clear();
  vertex_items_.clear();
  cell_items_.clear();
  const std::uint64_t bytes_before = done.bytes;
  if (auto complaint = next_cells(decoded, done); !complaint.empty()) return complaint;
  while (done.cells == header_->cells && done.own < header_->vertices &&
         done.bytes - bytes_before < kTileBytes) {
    const auto number = numbered_by_birth_ ? std::optional(next_own_) : shifts_.next_isolated();
    if (!number || done.loose == header_->loose_vertices || !bear(*number, false, decoded, done))
      return "a vertex that no cell uses makes no sense";
    ++done.loose;
    if (has_neighbours_) neighbours_.add_isolated(*number, vertex_items_);
    done.active = std::max(done.active, live_.count());
    live_.remove(*number);
  }
  return next_values(block);
}

auto ShiftSegmentDecoder::next_cells(DecodedBlock& decoded, GroupProgress& done) -> Complaint {
  MeshBlock& block = decoded.mesh;
  const auto most =
      static_cast<std::size_t>(std::min<std::uint64_t>(header_->cells - done.cells, kTileCells));
  const std::uint64_t bytes_before = done.bytes;
  block.corners.resize(most * shifts_.most_nodes());
  std::size_t corners = 0;
  for (auto* it : {&block.vertices_before_cell, &block.cell_numbers, &block.last_use})
    it->resize(most);
  block.cell_blocks.resize(most);
  block.corner_begin.resize(most + 1);
  std::size_t cell = 0;
  if (most > 0 && schema_->blocks.empty()) return "connectivity: a cell of no block";
  while (cell < most && done.bytes - bytes_before < kTileBytes) {
    std::uint64_t* const numbers = block.corners.data() + corners;
    // So many that the tile does not end among them.
    const std::uint64_t left = kTileBytes - (done.bytes - bytes_before);
    const auto fit = static_cast<std::size_t>(std::max<std::uint64_t>(left / most_cell_bytes_, 1));
    const auto [marks, count] =
        shifts_.next_cells(numbers, std::min({most - cell, kShiftedCellsAtOnce, fit}));
    const std::size_t nodes = marks == nullptr ? 0 : shifts_.nodes(marks->block);
    if (has_neighbours_ && marks != nullptr)
      neighbours_.add_cells(*marks, {numbers, count * nodes}, count, vertex_items_, cell_items_);
    const std::size_t vertices_before = block.vertex_numbers.size();
    const bool at_once =
        count > 1 && run_at_once(*marks, {numbers, count * nodes}, count, decoded, done);
    const std::size_t births =
        at_once ? (block.vertex_numbers.size() - vertices_before) / count : 0;
    for (std::size_t i = 0; i < std::max<std::size_t>(count, 1); ++i, ++cell) {
      if (marks == nullptr ||
          (!at_once && !bear_and_finalize(*marks, {numbers + i * nodes, nodes}, decoded, done)))
        return "connectivity: cell " + std::to_string(block.first_cell + cell) + " makes no sense";
      block.vertices_before_cell[cell] =
          at_once ? vertices_before + (i + 1) * births : block.vertex_numbers.size();
      block.cell_numbers[cell] = block.first_cell + cell;
      block.cell_blocks[cell] = marks->block;
      block.last_use[cell] = marks->last_use;
      corners += nodes;
      block.corner_begin[cell + 1] = corners;
    }
    done.bytes += count * (8 * nodes + cell_bytes_[marks->block]);
    done.cells += count;
  }
  for (auto* it : {&block.vertices_before_cell, &block.cell_numbers, &block.last_use})
    it->resize(cell);
  block.cell_blocks.resize(cell);
  block.corner_begin.resize(cell + 1);
  block.corners.resize(corners);
  if (!imports_.empty()) name_imports(block.corners);
  return done.bytes > header_->decoded_bytes ? "unpacks to more than stated" : "";
}

/// Imported vertices take their stream numbers.
void ShiftSegmentDecoder::name_imports(std::vector<std::uint64_t>& corners) {
  for (std::uint64_t& number : corners)
    if (number >= kFirstImport) number = imports_[number];
  for (const std::uint64_t number : dead_imports_) imports_.remove(number);
  dead_imports_.clear();
}

/// The same for `count` cells, 2 to 64, whose numbers go on by one, none of them imported: as runs
/// of numbers. False, and nothing happens, where it is not as simple as that, or not right.
bool ShiftSegmentDecoder::run_at_once(const CellMarks& marks,
                                      std::span<const std::uint64_t> numbers, std::size_t count,
                                      DecodedBlock& decoded, GroupProgress& done) {
  const std::size_t nodes = numbers.size() / count;
  const auto first = numbers.first(nodes);
  const auto length = static_cast<std::uint32_t>(count);
  const std::uint64_t all = count == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1;
  const auto has = [](std::uint64_t mask, std::size_t i) { return (mask >> i & 1) != 0; };
  if (marks.imports != 0) return false;
  std::uint64_t born = 0, dead = 0;  // in each cell
  for (std::size_t i = 0; i < nodes; ++i) {
    if (numbers[nodes + i] != first[i] + 1 || first[i] > ~std::uint64_t{0} - 64) return false;
    LiveNumbers::Run run = live_.run(first[i], length);
    bool again = false;  // an earlier node of the cell is the same vertex, used last there, too
    for (std::size_t j = 0; j < nodes; ++j) {
      const std::uint64_t ahead = first[j] - first[i];  // cells after which node i is there, too
      if (ahead >= count) continue;
      if (has(marks.introduced, j)) {
        if (j != i && has(marks.introduced, i)) return false;  // born twice
        run.live |= j == i ? 0 : all << ahead;
      }
      if (has(marks.last_use, j)) {
        if (ahead > 0) return false;  // used when it is gone
        again = again || (j < i && has(marks.last_use, i));
      }
    }
    if (has(marks.introduced, i) ? run.live != 0 : (run.live & all) != all) return false;
    if (has(marks.last_use, i) && run.imported != 0) return false;
    if (numbered_by_birth_ && has(marks.introduced, i) &&
        (born > 0 || first[i] != next_own_ || first[i] >= kFirstImport - 64))
      return false;
    born += has(marks.introduced, i) ? 1 : 0;
    dead += has(marks.last_use, i) && !again ? 1 : 0;
  }
  const std::uint64_t active =
      live_.count() + born + (born > dead ? (born - dead) * (count - 1) : 0);
  if (active > header_->max_active_vertices || done.own + born * count > header_->vertices ||
      done.bytes + born * count * vertex_bytes_ > header_->decoded_bytes)
    return false;
  done.active = std::max(done.active, active);
  done.own += born * count;
  next_own_ += born * count;
  done.bytes += born * count * vertex_bytes_;
  for (std::size_t i = 0; i < nodes; ++i)
    if (has(marks.introduced, i)) live_.add_run(first[i], length);
  for (std::size_t i = 0; i < nodes; ++i)
    if (has(marks.last_use, i)) live_.remove_run(first[i], length);
  if (born == 0) return true;
  for (std::size_t c = 0; c < count; ++c)
    for (std::uint64_t left = marks.introduced; left != 0; left &= left - 1)
      born_.push_back(first[static_cast<std::size_t>(std::countr_zero(left))] + c);
  const auto new_ones = static_cast<std::size_t>(born * count);
  const auto from = born_.end() - static_cast<std::ptrdiff_t>(new_ones);
  decoded.mesh.vertex_numbers.insert(decoded.mesh.vertex_numbers.end(), from, born_.end());
  if (yields_imports_)
    decoded.mesh.imported.resize(decoded.mesh.imported.size() + new_ones);
  else if (may_import_)
    left_out_.resize(left_out_.size() + new_ones);
  return true;
}

/// The vertices of a cell: the new ones are born, the others must be alive. False where that is
/// not so, or the group has fewer.
bool ShiftSegmentDecoder::bear_and_finalize(const CellMarks& marks,
                                            std::span<const std::uint64_t> numbers,
                                            DecodedBlock& decoded, GroupProgress& done) {
  for (std::uint64_t left = marks.introduced; left != 0; left &= left - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(left));
    if (!bear(numbers[i], (marks.imports >> i & 1) != 0, decoded, done)) return false;
  }
  for (std::size_t i = 0; i < numbers.size(); ++i)
    if ((marks.introduced >> i & 1) == 0 && !live_.is_live(numbers[i], hints_[i])) return false;
  done.active = std::max(done.active, live_.count());
  if (done.active > header_->max_active_vertices) return false;
  for (std::uint64_t left = marks.last_use; left != 0; left &= left - 1) {
    const std::uint64_t number = numbers[static_cast<std::size_t>(std::countr_zero(left))];
    if (live_.remove(number) != LiveNumbers::State::imported) continue;
    decoded.finalized_imports.push_back(numbered_by_birth_ ? imports_[number] : number);
    if (numbered_by_birth_) dead_imports_.push_back(number);
  }
  return true;
}

bool ShiftSegmentDecoder::bear(std::uint64_t number, bool imported, DecodedBlock& decoded,
                               GroupProgress& done) {
  std::uint64_t& count = imported ? done.imported : done.own;
  if (count == (imported ? header_->imported_vertices : header_->vertices) ||
      done.bytes + vertex_bytes_ > header_->decoded_bytes)
    return false;
  std::uint64_t& next = imported ? next_import_ : next_own_;
  if (numbered_by_birth_ && (number != next || (!imported && number >= kFirstImport))) return false;
  if (!live_.add(number, imported)) return false;
  ++next;
  ++count;
  done.bytes += vertex_bytes_;
  born_.push_back(number);
  if (imported && numbered_by_birth_) {
    const std::uint64_t known_as = number;
    number = import_numbers_.code(import_coder_, {}, 0, 0);
    if (number >= first_own_) return false;
    imports_.add(known_as, number);
  }
  if (imported) decoded.imported.push_back(number);
  if (!imported || yields_imports_) decoded.mesh.vertex_numbers.push_back(number);
  if (yields_imports_)
    decoded.mesh.imported.push_back(imported ? 1 : 0);
  else if (may_import_)
    left_out_.push_back(imported ? 1 : 0);
  return true;
}

auto ShiftSegmentDecoder::next_values(MeshBlock& block) -> Complaint {
  const bool leaves_out = std::find(left_out_.begin(), left_out_.end(), 1) != left_out_.end();
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    const bool geometry = c == 0;
    const std::uint32_t array = geometry ? 0 : arrays_[c - 1];
    if (geometry ? !wanted_.geometry : !wanted_.includes_array(array)) continue;
    std::vector<std::byte>& out = geometry ? block.xyz : block.arrays[array];
    if (!(is_predicted_[c] != 0 ? decode_predicted(c, block, out) : decode_bulk(c, block, out)))
      return (geometry ? "geometry" : array_stream_name(*schema_, array)) +
             std::string(is_predicted_[c] != 0 ? ": its values make no sense"
                                               : ": has too few values");
    if (!of_cells(c) && leaves_out) leave_out(out, left_out_, columns_[c].element_bytes());
  }
  return {};
}

bool ShiftSegmentDecoder::decode_predicted(std::size_t column, const MeshBlock& block,
                                           std::vector<std::byte>& out) {
  if (of_cells(column))
    return predicted_[column]->decode_tile({cell_items_, block.cell_blocks}, out);
  return predicted_[column]->decode_tile({vertex_items_, {}}, out);
}

bool ShiftSegmentDecoder::decode_bulk(std::size_t column, const MeshBlock& block,
                                      std::vector<std::byte>& out) {
  if (!of_cells(column)) return columns_[column].decode(born_, out, scratch_);
  cells_.clear();
  for (std::size_t i = 0; i < block.cell_count(); ++i)
    if (schema_->array_covers(arrays_[column - 1], block.cell_blocks[i]))
      cells_.push_back(block.first_cell + i);
  return columns_[column].decode(cells_, out, scratch_);
}

}  // namespace shm
