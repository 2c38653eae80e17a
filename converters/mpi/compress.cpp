#include "mpi/compress.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "base/spool.h"
#include "compression/compress.h"
#include "exodus/parts/owners.h"
#include "mesh/coding_order.h"
#include "mpi/uses.h"
#include "shm/part_writer.h"

namespace shm::converters {
namespace {

// Number of elements whose values at a time step are read and coded together.
constexpr std::uint64_t kPieceElements = 65536;
constexpr std::uint64_t kNoBasis = ~std::uint64_t{0};

// Divides the segments of a mesh among the ranks. Each rank gets a share of consecutive segments.
// The sizes of the shares differ by at most one segment.
class Shares {
 public:
  Shares(std::uint64_t cells, std::uint64_t segment_cells, std::size_t ranks)
      : cells_(cells),
        segment_cells_(segment_cells),
        segments_(cells == 0 ? 0 : (cells - 1) / segment_cells + 1),
        ranks_(ranks) {}
  std::uint64_t first_segment(std::size_t rank) const {
    // Divide before multiplying, so that no product overflows. If the division leaves a remainder
    // r, each of the first r ranks gets one more segment.
    const std::uint64_t each = segments_ / ranks_, over = segments_ % ranks_;
    return each * rank + std::min<std::uint64_t>(rank, over);
  }
  CellRange range(std::size_t rank) const {
    return {first_cell(first_segment(rank)), first_cell(first_segment(rank + 1))};
  }
  // Returns the last rank that has cells, or the first rank if the mesh has no cells.
  std::size_t last_rank() const {
    return segments_ == 0
               ? 0
               : static_cast<std::size_t>(std::min<std::uint64_t>(segments_, ranks_) - 1);
  }

 private:
  std::uint64_t first_cell(std::uint64_t segment) const {
    return segment >= segments_ ? cells_ : segment * segment_cells_;
  }
  std::uint64_t cells_, segment_cells_, segments_, ranks_;
};

// The number of a vertex or cell in the mesh (`number`) and in the compressed file (`fresh`).
struct Renamed {
  std::uint64_t number = 0, fresh = 0;
};

// Maps the number of each vertex (or each cell) in the mesh to its new number in the compressed
// file. The table is distributed: the owner of an old number stores the new number.
class FreshNumbers {
 public:
  FreshNumbers(Ranks& ranks, std::uint64_t numbers) : owners_(ranks, numbers) {
    ranks.together([&] { fresh_.resize(owners_.count()); });
  }
  // Collective. `order` lists the numbers that this rank's vertices or cells have in the mesh, in
  // the order of the compressed file. `first` is the new number of the first vertex or cell in
  // `order`.
  void send(NumberList& order, std::uint64_t first, Ranks& ranks) {
    std::vector<Renamed> items;
    ranks.together([&] {
      items.reserve(order.size());
      order.for_each([&](std::uint64_t position, std::uint64_t number) {
        items.push_back({number, first + position});
      });
    });
    owners_.send(items,
                 [&](const Renamed& item) { fresh_[item.number - owners_.first()] = item.fresh; });
  }
  // Collective. Returns the new numbers of `numbers`.
  std::vector<std::uint64_t> ask(const std::vector<std::uint64_t>& numbers) {
    return owners_.ask<std::uint64_t>(
        numbers, [&](std::uint64_t number) { return fresh_[number - owners_.first()]; });
  }

 private:
  NumberOwners owners_;
  std::vector<std::uint64_t> fresh_;
};

// Returns the vertex or cell numbers below `limit` that an extra contains, ascending, without
// repetitions.
std::vector<std::uint64_t> references(const Extra& extra, std::uint64_t limit) {
  std::vector<std::uint64_t> numbers;
  const auto collect = [&]<class Integer>(Integer) {
    for (std::size_t offset = 0; offset + sizeof(Integer) <= extra.data.size();
         offset += sizeof(Integer)) {
      Integer value;
      std::memcpy(&value, extra.data.data() + offset, sizeof value);
      if (value >= 0 && static_cast<std::uint64_t>(value) < limit)
        numbers.push_back(static_cast<std::uint64_t>(value));
    }
  };
  if (extra.type == ScalarType::int32) collect(std::int32_t{});
  if (extra.type == ScalarType::int64) collect(std::int64_t{});
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  return numbers;
}

class PartCompression {
 public:
  PartCompression(Ranks& ranks, MeshSource& mesh, SharedOutput& output, Schema schema,
                  const CompressOptions& options, Spool& spool, JoinedMesh* joined)
      : ranks_(&ranks),
        mesh_(&mesh),
        joined_(joined),
        output_(&output),
        schema_(std::move(schema)),
        options_(write_options_for(mesh, options)),
        spool_(&spool),
        shares_(mesh.info().cells(), options.segment_cells, ranks.size()),
        range_(shares_.range(ranks.rank())),
        log_(spool, schema_.delay > 0) {}

  SizeReport run() {
    find_places();
    code_mesh();
    write_mesh();
    write_steps();
    return write_rest();
  }

 private:
  bool idle() const { return range_.empty() && ranks_->rank() != shares_.last_rank(); }
  bool renumbers() const { return schema_.order != Order::keep; }
  bool moves_cells() const { return schema_.delay > 0; }
  const MeshInfo& info() const { return mesh_->info(); }

  void find_places();
  void code_mesh();
  void feed_cells();
  void number_imported();
  void write_mesh();
  void append(PartChunks& chunks);
  void write_steps();
  void write_step(std::uint32_t array, std::uint64_t step, std::size_t chooser);
  void feed_step(std::uint32_t array, std::uint64_t step, const std::function<void()>& fed);
  std::uint64_t own_elements(std::uint32_t array) const;
  NumberList& moved_elements(std::uint32_t array);
  SizeReport write_rest();
  // The vertex or cell numbers that an extra contains: ascending in `numbers`, and the
  // corresponding new numbers in `fresh`.
  struct FreshReferences {
    std::vector<std::uint64_t> numbers, fresh;
  };
  FreshReferences fresh_references(const Extra& extra);
  Extra in_new_numbers(const Extra& extra, const FreshReferences& references) const;

  Ranks* ranks_;
  MeshSource* mesh_;
  JoinedMesh* joined_;  // same object as mesh_ if the mesh is read from parts; otherwise null
  SharedOutput* output_;
  Schema schema_;
  WriteOptions options_;
  Spool* spool_;
  Shares shares_;
  CellRange range_;
  CodingOrderLog log_;

  PartUses uses_;
  // Numbers of the vertices that this rank's cells use but lower ranks own, in coding order.
  std::vector<std::uint64_t> imported_;
  std::vector<std::uint64_t> block_cells_before_;  // for each block, number of cells on lower ranks
  // New number of the first vertex of this rank that no lower rank uses.
  std::uint64_t first_vertex_ = 0;
  std::optional<PartWriter> writer_;  // writer of this rank's segments; empty without segments
  std::optional<FreshNumbers> vertices_, cells_;  // set only if numbers change

  // Cached results of moved_elements(). The key is the list of blocks that an array covers.
  std::map<std::vector<std::uint32_t>, NumberList> moved_;
  std::vector<std::uint64_t> first_elements_;  // for each array, index of this rank's first element
  MemorySink head_;
  std::optional<PartJoiner> joiner_;  // used on rank 0 only
  std::uint32_t chunks_before_ = 0;   // number of chunks that lower ranks have written
};

void PartCompression::find_places() {
  if (joined_ != nullptr) joined_->read_alone();
  uses_ = find_uses(*ranks_, *mesh_, range_, shares_.last_rank());
  if (joined_ != nullptr) {
    std::vector<std::uint64_t> vertices;
    ranks_->together([&] {
      vertices = uses_.vertices.numbers();
      vertices.insert(vertices.end(), uses_.unused.begin(), uses_.unused.end());
    });
    joined_->hold_vertices(vertices);
  }
  block_cells_before_ = ranks_->sums(uses_.block_cells).before;
  first_vertex_ = ranks_->sums({uses_.own}).before[0];
}

// --- the mesh

void PartCompression::code_mesh() {
  ranks_->together([&] {
    if (idle()) return;
    WriteOptions options = options_;
    options.coding_order = &log_;
    options.kept_topology_bytes = kept_topology_bytes(*spool_);
    options.kept_steps_bytes = kept_steps_bytes(*spool_);
    options.temporary_folder = spool_->directory();
    PartStart start;
    start.segment = static_cast<std::uint32_t>(shares_.first_segment(ranks_->rank()));
    start.first_cell = range_.first;
    start.first_vertex = first_vertex_;
    // If the user chose the codec, an error of create() means that this codec cannot encode the
    // mesh, and is reported as misuse. Otherwise the mesh is the cause, and the error is reported
    // as unsupported. compress_mesh() does the same.
    auto writer = PartWriter::create(schema_, options, start);
    writer_ = options.connectivity == ConnectivityCodec::automatic ? checked(std::move(writer))
                                                                   : unwrap(std::move(writer));
    feed_cells();
    checked(writer_->end_mesh());
    log_.check();
  });
  if (!renumbers()) return;
  vertices_.emplace(*ranks_, info().vertices);
  vertices_->send(log_.vertices(), first_vertex_, *ranks_);
  if (moves_cells()) {
    cells_.emplace(*ranks_, info().cells());
    cells_->send(log_.cells(), range_.first, *ranks_);
  }
  const std::vector<std::uint64_t> numbers = vertices_->ask(imported_);
  ranks_->together([&] {
    if (writer_) checked(writer_->set_imported_numbers(numbers));
  });
}

// Does the same as stream_compacted(), but only for the cells of this rank.
void PartCompression::feed_cells() {
  MeshFeeder<PartWriter> feeder(*mesh_, schema_, *writer_, spool_->memory_budget() / 4);
  feeder.skip_cells(block_cells_before_);
  std::vector<bool> given(uses_.last.size());
  std::vector<std::uint64_t>& last = uses_.last;
  std::vector<std::uint64_t> other_last_uses;
  for_cells(*mesh_, range_, [&](const CellBatch& batch, std::uint64_t first_cell) {
    feeder.begin_batch(batch, first_cell);
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const auto corners = batch.cell(i);
      std::uint64_t last_use = 0;
      other_last_uses.clear();
      for (const std::uint64_t v : corners) {
        const std::uint32_t index = uses_.vertices.find(v);
        if (given[index]) continue;
        given[index] = true;
        if (uses_.imported[index]) {
          if (renumbers()) imported_.push_back(v);
          feeder.imported_vertex(v);
        } else {
          feeder.vertex(v, last[index]);
        }
      }
      for (std::size_t c = 0; c < corners.size(); ++c) {
        std::uint64_t& cell = last[uses_.vertices.find(corners[c])];
        if (cell != first_cell + i) continue;
        cell = kNeverUsed;  // marks a use that has been sent
        if (c < 64)
          last_use |= std::uint64_t{1} << c;
        else
          other_last_uses.push_back(corners[c]);
      }
      feeder.cell(batch, i, last_use, other_last_uses);
    }
  });
  for (const std::uint64_t v : uses_.unused) feeder.vertex(v, kNeverUsed);
}

void PartCompression::write_mesh() {
  PartChunks chunks;
  ranks_->together([&] {
    if (ranks_->first()) {
      joiner_ = checked(PartJoiner::create(head_, schema_, options_));
      output_->write(0, head_.bytes);
    }
    if (writer_) chunks = checked(writer_->mesh_chunks());
  });
  chunks_before_ = static_cast<std::uint32_t>(ranks_->sums({chunks.count}).before[0]);
  append(chunks);
}

// Collective. Appends the chunks of all ranks to the file: those of rank 0 first, then those of
// rank 1, and so on.
void PartCompression::append(PartChunks& chunks) {
  const std::uint64_t offset = ranks_->broadcast(joiner_ ? joiner_->offset() : 0);
  const std::uint64_t number = ranks_->broadcast(joiner_ ? joiner_->chunks() : 0);
  const auto sums = ranks_->sums({chunks.bytes.size(), chunks.count});
  ranks_->together([&] {
    checked(place(chunks, static_cast<std::uint32_t>(number + sums.before[1])));
    output_->write(offset + sums.before[0], chunks.bytes);
  });
  // Each rank sends rank 0 the total size of its chunks, followed by their index entries.
  const std::uint64_t size = chunks.bytes.size();
  std::vector<std::byte> mine(sizeof size);
  std::memcpy(mine.data(), &size, sizeof size);
  mine.insert(mine.end(), chunks.index.begin(), chunks.index.end());
  std::optional<Error> error;
  ranks_->gather(mine, [&](std::size_t, std::vector<std::byte> part) {
    std::uint64_t bytes = 0;
    std::memcpy(&bytes, part.data(), sizeof bytes);
    if (error || part.size() == sizeof bytes) return;  // an idle rank sends no chunks
    const auto status = joiner_->add(std::span(part).subspan(sizeof bytes), bytes);
    if (!status) error = status.error();
  });
  ranks_->agree(error);
}

// --- time steps

// Returns the number of elements that this rank writes for an array. For a cell array, the elements
// are the rank's cells that the array covers. For a point array, they are the vertices that the
// rank owns. The rank with the first cells writes all elements of other arrays.
std::uint64_t PartCompression::own_elements(std::uint32_t array) const {
  const ArrayInfo& array_info = schema_.arrays[array];
  if (array_info.location == Location::point) return uses_.own + uses_.unused.size();
  if (!is_on_mesh(array_info.location))
    return writer_ && range_.first == 0 ? array_info.elements : 0;
  std::uint64_t sum = 0;
  for (std::uint32_t b = 0; b < uses_.block_cells.size(); ++b)
    if (schema_.array_covers(array, b)) sum += uses_.block_cells[b];
  return sum;
}

void PartCompression::write_steps() {
  const std::size_t arrays = schema_.arrays.size();
  if (std::none_of(schema_.arrays.begin(), schema_.arrays.end(),
                   [](const ArrayInfo& array) { return array.per_step; }))
    return;
  std::vector<std::uint64_t> own(arrays);
  for (std::uint32_t a = 0; a < arrays; ++a) own[a] = own_elements(a);
  const auto sums = ranks_->sums(own);
  first_elements_ = sums.before;
  ranks_->together([&] {
    if (writer_) checked(writer_->begin_steps({chunks_before_, sums.before, sums.all}));
  });
  for (std::uint32_t a = 0; a < arrays; ++a) {
    if (!schema_.arrays[a].per_step || sums.all[a] == 0) continue;
    const std::size_t chooser = ranks_->smallest(own[a] > 0 ? ranks_->rank() : ranks_->size());
    for (std::uint64_t step = 0; step < info().step_times.size(); ++step) {
      if (joined_ != nullptr) joined_->hold_step(a, step);
      write_step(a, step, chooser);
    }
  }
  PartChunks chunks;
  ranks_->together([&] {
    if (writer_) chunks = checked(writer_->end_steps());
  });
  append(chunks);
}

// Writes one time step of an array. Rank `chooser`, which has the first element of the array,
// chooses the reference of the step (the data from which it is predicted). It broadcasts the
// reference as soon as it is known, because the other ranks wait for it.
void PartCompression::write_step(std::uint32_t array, std::uint64_t step, std::size_t chooser) {
  const bool chooses = ranks_->rank() == chooser;
  std::uint64_t basis = kNoBasis;
  if (!chooses) basis = ranks_->broadcast(basis, chooser);
  PartChunks chunks;
  bool sent = false;
  std::optional<Error> error;
  try {
    if (writer_ && (chooses || basis != kNoBasis)) {
      checked(writer_->begin_step(
          array, step, chooses ? std::nullopt : std::optional(static_cast<StepBasis>(basis))));
      feed_step(array, step, [&] {
        const auto chosen = writer_->step_basis();
        if (!chooses || sent || !chosen) return;
        sent = true;
        ranks_->broadcast(static_cast<std::uint64_t>(*chosen), chooser);
      });
      chunks = checked(writer_->end_step());
    }
  } catch (...) {
    error = current_error();
  }
  if (chooses && !sent) ranks_->broadcast(kNoBasis, chooser);
  ranks_->agree(error);
  append(chunks);
}

void PartCompression::feed_step(std::uint32_t array, std::uint64_t step,
                                const std::function<void()>& fed) {
  const bool of_points = schema_.arrays[array].location == Location::point;
  const std::uint64_t own = own_elements(array);
  const std::size_t stride = info().array_stride(array);
  const bool of_cells = schema_.arrays[array].location == Location::cell;
  NumberList* order = of_points                   ? &log_.vertices()
                      : of_cells && moves_cells() ? &moved_elements(array)
                                                  : nullptr;
  PageCache cache(info().array_elements(array), stride, spool_->memory_budget() / 4,
                  [&](std::uint64_t first, std::uint64_t count, std::byte* out) {
                    mesh_->read_array(array, step, first, count, out);
                  });
  std::vector<std::byte> values;
  std::vector<std::uint64_t> numbers;
  for (std::uint64_t first = 0; first < own; first += kPieceElements) {
    const std::uint64_t count = std::min(kPieceElements, own - first);
    values.resize(count * stride);
    if (order == nullptr) {
      mesh_->read_array(array, step, first_elements_[array] + first, count, values.data());
    } else {
      order->read(first, count, numbers);
      for (std::uint64_t i = 0; i < count; ++i)
        std::memcpy(values.data() + i * stride, cache[numbers[i]], stride);
    }
    checked(writer_->add_step_values(values));
    fed();
  }
}

// Returns the element indices of this rank's cells in a cell array, in the order in which this rank
// has coded the cells. Does the same as CoveredOrder, but only for the cells of this rank. Needed
// only if the compressor has changed the order of cells.
NumberList& PartCompression::moved_elements(std::uint32_t array) {
  const auto [found, fresh] = moved_.try_emplace(schema_.arrays[array].blocks, *spool_);
  NumberList& list = found->second;
  if (!fresh) return list;
  constexpr std::uint64_t kNotCovered = ~std::uint64_t{0};
  std::vector<std::uint64_t> element(range_.end - range_.first, kNotCovered);
  std::uint64_t next = first_elements_[array];
  for_cells(*mesh_, range_, [&](const CellBatch& batch, std::uint64_t first_cell) {
    for (std::size_t i = 0; i < batch.size(); ++i)
      if (schema_.array_covers(array, batch.blocks[i]))
        element[first_cell + i - range_.first] = next++;
  });
  log_.cells().for_each([&](std::uint64_t, std::uint64_t cell) {
    const std::uint64_t number = element[cell - range_.first];
    if (number != kNotCovered) list.push_back(number);
  });
  return list;
}

// --- data after the mesh

// Collective. Returns the vertex or cell numbers in an extra of rank 0, with their new numbers. The
// result is empty if the extra does not need to be renumbered.
PartCompression::FreshReferences PartCompression::fresh_references(const Extra& extra) {
  FreshReferences out;
  const bool of_cells = extra.refers == Reference::cell;
  auto& fresh = of_cells ? cells_ : vertices_;
  if (extra.refers == Reference::nothing || !fresh) return out;
  const std::uint64_t limit = of_cells ? info().cells() : info().vertices;
  ranks_->together([&] {
    if (ranks_->first()) out.numbers = references(extra, limit);
  });
  out.fresh = fresh->ask(out.numbers);
  return out;
}

Extra PartCompression::in_new_numbers(const Extra& extra, const FreshReferences& references) const {
  Renumbering to;
  to.vertices = info().vertices;
  to.cells = info().cells();
  const auto fresh = [&](std::uint64_t number) {
    const auto& numbers = references.numbers;
    const auto position =
        std::lower_bound(numbers.begin(), numbers.end(), number) - numbers.begin();
    return references.fresh[static_cast<std::size_t>(position)];
  };
  if (extra.refers == Reference::cell && cells_) to.cell = fresh;
  if (extra.refers == Reference::vertex && vertices_) to.vertex = fresh;
  return renumbered(extra, to);
}

SizeReport PartCompression::write_rest() {
  const std::uint64_t offset = joiner_ ? joiner_->offset() : 0;
  std::uint64_t written = 0;
  // Writes the bytes collected in head_.
  const auto flush = [&] {
    output_->write(offset + written, head_.bytes);
    written += head_.bytes.size();
    head_.bytes.clear();
  };
  head_.bytes.clear();
  ranks_->together([&] {
    if (!ranks_->first()) return;
    checked(joiner_->set_step_times(info().step_times));
    flush();
  });
  for (const Extra& extra : info().extras) {
    const FreshReferences references = fresh_references(extra);
    ranks_->together([&] {
      if (!ranks_->first()) return;
      checked(joiner_->add_extra(in_new_numbers(extra, references)));
      flush();
    });
  }
  SizeReport sizes;
  ranks_->together([&] {
    if (!ranks_->first()) return;
    sizes = checked(joiner_->finish());
    flush();
  });
  return sizes;
}

// Collective. Gives the schema of every rank the results of the trials that only rank 0 has run:
// the size of the delay buffer, and the arrays that need no rounding.
void take_trials_of_first_rank(Ranks& ranks, Schema& schema) {
  schema.delay = static_cast<std::uint32_t>(ranks.broadcast(schema.delay));
  std::vector<Quantization*> all{&schema.coordinate_quantization};
  for (ArrayInfo& array : schema.arrays) all.push_back(&array.quantization);
  std::vector<std::byte> rounds(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) rounds[i] = std::byte{all[i]->lossy()};
  rounds = ranks.broadcast(std::move(rounds));
  for (std::size_t i = 0; i < all.size(); ++i)
    if (rounds[i] == std::byte{0}) *all[i] = {};
}

}  // namespace

SizeReport compress_with_ranks(Ranks& ranks, MeshSource& mesh, SharedOutput& output,
                               const CompressOptions& options, Spool& spool) {
  Schema schema;
  ranks.together([&] {
    schema = ranks.first() ? schema_to_write(mesh, options, spool) : schema_for(mesh, options);
  });
  take_trials_of_first_rank(ranks, schema);
  return PartCompression(ranks, mesh, output, std::move(schema), options, spool, nullptr).run();
}

SizeReport compress_with_ranks(Ranks& ranks, JoinedMesh& mesh, SharedOutput& output,
                               const CompressOptions& options, Spool& spool) {
  mesh.hold_cells(
      Shares(mesh.info().cells(), options.segment_cells, ranks.size()).range(ranks.rank()));
  Schema schema;
  // All ranks must take part in each read from a JoinedMesh. Therefore every rank runs the same
  // trials, not only rank 0.
  ranks.together([&] { schema = schema_to_write(mesh, options, spool); });
  return PartCompression(ranks, mesh, output, std::move(schema), options, spool, &mesh).run();
}

}  // namespace shm::converters
