// Calls the public classes for a damaged file, in any order. Some calls are invalid. The caller
// meets only the conditions that the documentation marks as "Precondition:". A call must return a
// value or an error. It must never crash, and its memory must be in proportion to the size of the
// input. An input consists of a byte, a file, and a script that chooses the calls; the byte is the
// length of the script.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "choices.h"
#include "damaged_file.h"
#include "shm/appender.h"
#include "shm/archive.h"
#include "shm/mesh.h"
#include "shm/mesh_extract.h"
#include "shm/part_writer.h"
#include "shm/segment_reader.h"
#include "shm/sets.h"
#include "shm/step_reader.h"
#include "shm/summary.h"

namespace {

using shm_fuzz::Bytes;

/// Returns a number that is usually small, but sometimes a large power of two.
std::uint64_t number(Choices& in) {
  return in.below(16) == 0 ? std::uint64_t{1} << in.below(64) : in.below(12);
}
std::vector<std::uint64_t> numbers(Choices& in) {
  std::vector<std::uint64_t> out(in.below(6));
  for (std::uint64_t& value : out) value = number(in);
  if (in.below(4) != 0) std::sort(out.begin(), out.end());
  return out;
}

/// Makes the calls that a script chooses, for one file. Its members are objects of all public
/// classes that a caller can use with a file.
class Caller {
 public:
  Caller(std::span<const std::byte> file, Choices in)
      : file_(file), in_(in), source_(file), front_(file) {}

  ~Caller() {
    if (!path_.empty()) std::filesystem::remove(path_);
  }

  void run() {
    for (int calls = 0; calls < 200 && !in_.empty(); ++calls) switch (in_.below(9)) {
        case 0: call_decoder(); break;
        case 1: call_reader(); break;
        case 2: call_segments(); break;
        case 3: call_steps(); break;
        case 4: call_extractor(); break;
        case 5: call_appender(); break;
        case 6: call_part(); break;
        case 7: call_joiner(); break;
        default: call_functions();
      }
  }

 private:
  std::span<const std::byte> some() {
    const std::uint64_t begin = std::min<std::uint64_t>(fed_, file_.size());
    const std::size_t size =
        std::min<std::size_t>(in_.flag() ? file_.size() : in_.below(3000), file_.size() - begin);
    fed_ += size;
    return file_.subspan(static_cast<std::size_t>(begin), size);
  }

  void call_decoder() {
    if (!decoder_) {
      decoder_.emplace(shm_fuzz::small_limits());
      fed_ = 0;
    }
    switch (in_.below(6)) {
      case 0: decoder_->end_of_input(); break;
      case 1: decoder_.reset(); break;
      case 2: (void)decoder_->schema(); break;
      case 3: {
        shm::Decoder other(std::move(*decoder_));
        decoder_.emplace(std::move(other));
        break;
      }
      case 4: {
        const auto progress = decoder_->advance();
        if (progress && *progress == shm::Decoder::Progress::item_ready) (void)decoder_->take();
        break;
      }
      default: (void)decoder_->feed(some());
    }
  }

  void call_reader() {
    if (!reader_) {
      shm::ReadOptions options;
      options.threads = 1 + in_.below(8) / 7;
      options.max_ahead_bytes = in_.below(1000);
      options.kept_topology_bytes = in_.flag() ? 0 : 1 << 20;
      front_ = shm::MemorySource(file_);
      auto reader = shm::Reader::open(front_, shm_fuzz::small_limits(), options);
      if (reader) reader_.emplace(std::move(*reader));
      return;
    }
    if (in_.below(16) == 0) return reader_.reset();
    (void)reader_->schema();
    (void)reader_->next();
  }

  void call_segments() {
    if (!segments_) {
      auto reader = shm::SegmentReader::open(source_, shm_fuzz::small_limits());
      if (reader) segments_.emplace(std::move(*reader));
      return;
    }
    (void)segments_->segments();
    (void)segments_->read(static_cast<std::size_t>(number(in_)));
  }

  void call_steps() {
    if (!steps_) {
      auto reader = shm::StepReader::open(source_, shm_fuzz::small_limits());
      if (reader) steps_.emplace(std::move(*reader));
      return;
    }
    const auto array = static_cast<std::uint32_t>(number(in_));
    switch (in_.below(4)) {
      case 0:
        (void)steps_->elements(array);
        (void)steps_->steps(array);
        (void)steps_->step_times();
        break;
      case 1: (void)steps_->next(); break;
      default:
        shm::StepRequest request;
        request.array = array;
        request.step = number(in_);
        if (in_.flag()) request.segment = static_cast<std::size_t>(number(in_));
        request.numbers = in_.flag();
        if (in_.flag())
          (void)steps_->read(request);
        else
          (void)steps_->begin(request);
    }
  }

  shm::ExtractRequest piece() {
    shm::ExtractRequest request;
    if (in_.below(3) == 0) request.cells.range = {number(in_), number(in_)};
    if (in_.below(4) == 0) request.cells.numbers = numbers(in_);
    if (in_.below(4) == 0) {
      request.cells.blocks.emplace();
      for (std::uint64_t block : numbers(in_))
        request.cells.blocks->push_back(static_cast<std::uint32_t>(block));
    }
    if (in_.below(4) == 0) {
      request.cells.box.emplace();
      for (double& bound : *request.cells.box) bound = (in_.byte() - 64) / 32.;
    }
    if (in_.below(4) == 0) request.vertices = numbers(in_);
    if (in_.below(3) == 0) {
      request.arrays.emplace();
      for (std::uint64_t array : numbers(in_))
        request.arrays->push_back(static_cast<std::uint32_t>(array));
    }
    request.unused_vertices = in_.flag();
    return request;
  }

  void call_extractor() {
    if (!extractor_) {
      auto extractor = shm::MeshExtractor::open(source_, shm_fuzz::small_limits());
      if (extractor) extractor_.emplace(std::move(*extractor));
      return;
    }
    switch (in_.below(10)) {
      case 0: (void)extractor_->extras(); break;
      case 1: (void)extractor_->step_times(); break;
      case 2: (void)extractor_->steps(static_cast<std::uint32_t>(number(in_))); break;
      case 3:
        (void)extractor_->vertex_numbers();
        (void)extractor_->cell_numbers();
        (void)extractor_->block_cells();
        break;
      case 4:
        (void)extractor_->begin_values(static_cast<std::uint32_t>(number(in_)), number(in_));
        break;
      case 5: (void)extractor_->next_values(); break;
      case 6:
      case 7: (void)extractor_->begin(piece()); break;
      case 8:  // takes all parts of the piece
        while (true) {
          const auto part = extractor_->next();
          if (!part || *part == nullptr) break;
        }
        break;
      default: (void)extractor_->next();
    }
  }

  void call_appender() {
    if (!appender_) {
      shm::AppendOptions options;
      options.level = static_cast<shm::Level>(in_.below(3));
      options.key_steps = in_.below(5);
      auto appender = shm::Appender::open(source_, appended_, options, shm_fuzz::small_limits());
      if (appender) appender_.emplace(std::move(*appender));
      return;
    }
    const std::uint64_t array = number(in_);
    switch (in_.below(9)) {
      case 0: (void)appender_->drop_extras(); break;
      case 1: {
        auto rest = appender_->without_steps();
        if (rest) {
          Bytes bytes(1 + in_.below(4000));
          while (true) {
            const auto size = (*rest)->read(bytes);
            if (!size || *size == 0) break;
          }
        }
        break;
      }
      case 2: {
        std::vector<double> times = appender_->step_times();
        if (times.size() < 100) times.resize(times.size() + in_.below(3), in_.byte());
        (void)appender_->set_step_times(times);
        break;
      }
      case 3: (void)appender_->add_extra(extra()); break;
      case 4:
        if (in_.flag()) {
          (void)appender_->finish();
          (void)appender_->finish();
          appender_.reset();
        }
        break;
      default: {
        const auto a = static_cast<std::uint32_t>(array);
        const auto& arrays = appender_->schema().arrays;
        std::uint64_t size = number(in_);
        if (a < arrays.size() && in_.flag())
          size = appender_->elements(a) * arrays[a].components * shm::scalar_bytes(arrays[a].type);
        const std::uint64_t step = in_.flag() ? appender_->steps() : number(in_);
        const Bytes values(static_cast<std::size_t>(std::min<std::uint64_t>(size, 1 << 16)),
                           std::byte{in_.byte()});
        (void)appender_->add_step_values(a, step, values);
      }
    }
  }

  shm::Extra extra() {
    shm::Extra extra;
    extra.key = std::string(in_.below(4), 'k');
    extra.type = static_cast<shm::ScalarType>(in_.below(12));
    extra.refers = static_cast<shm::Reference>(in_.below(4));
    for (std::uint64_t length : numbers(in_)) extra.shape.push_back(length);
    extra.data.resize(in_.below(64));
    return extra;
  }

  /// Returns the schema of the file if it can be read, otherwise a small schema that does not match
  /// the file.
  shm::Schema schema() const {
    if (segments_) return segments_->schema();
    shm::Schema schema;
    schema.blocks.resize(1);
    schema.arrays.resize(1);
    schema.arrays[0].per_step = true;
    return schema;
  }
  shm::WriteOptions write_options() {
    shm::WriteOptions options;
    options.level = static_cast<shm::Level>(in_.below(3));
    options.connectivity = any_codec(in_);
    options.group_cells = 1 + in_.below(4);
    options.segment_cells = in_.below(5);
    if (in_.flag()) options.restart_budget = 0;
    if (in_.below(4) == 0) options.segment_starts = numbers(in_);
    return options;
  }

  void call_part() {
    if (!part_) {
      shm::PartStart start;
      if (in_.flag()) {
        start.segment = static_cast<std::uint32_t>(number(in_));
        start.first_cell = number(in_);
        start.first_vertex = number(in_);
      }
      auto part = shm::PartWriter::create(schema(), write_options(), start);
      if (part) part_.emplace(std::move(*part));
      return;
    }
    const Bytes bytes(in_.flag() ? 24 : in_.below(100), std::byte{in_.byte()});
    const auto array = static_cast<std::uint32_t>(number(in_));
    switch (in_.below(14)) {
      case 0: (void)part_->add_imported_vertex(number(in_), bytes); break;
      case 1: (void)part_->add_unused_vertex(number(in_), bytes); break;
      case 2: (void)part_->end_mesh(); break;
      case 3: (void)part_->set_imported_numbers(numbers(in_)); break;
      case 4: keep(part_->mesh_chunks()); break;
      case 5: {
        shm::PartSteps steps;
        steps.first_group = static_cast<std::uint32_t>(number(in_));
        steps.first_elements.assign(schema().arrays.size() + in_.below(8) / 7, number(in_));
        steps.elements.assign(steps.first_elements.size(), number(in_));
        (void)part_->begin_steps(steps);
        break;
      }
      case 6: {
        std::optional<shm::StepBasis> basis;
        if (!part_->chooses(array)) basis = static_cast<shm::StepBasis>(in_.below(64));
        (void)part_->begin_step(array, number(in_), basis);
        break;
      }
      case 7: (void)part_->add_step_values(bytes); break;
      case 8: (void)part_->step_basis(); break;
      case 9: keep(part_->end_step()); break;
      case 10:
        if (in_.flag()) part_.reset();
        break;
      case 11: {
        std::vector<std::uint64_t> corners(8);
        for (std::size_t i = 0; i < corners.size(); ++i) corners[i] = i;
        if (in_.below(4) == 0) corners = numbers(in_);
        (void)part_->add_cell(in_.below(8) / 7, corners, in_.byte(), {});
        break;
      }
      default: (void)part_->add_vertex(number(in_), bytes);
    }
  }
  void keep(shm::Result<shm::PartChunks> chunks) {
    if (chunks) chunks_ = std::move(*chunks);
  }

  void call_joiner() {
    if (!joiner_) {
      auto joiner = shm::PartJoiner::create(joined_, schema(), write_options());
      if (joiner) joiner_.emplace(std::move(*joiner));
      return;
    }
    switch (in_.below(7)) {
      case 0: {
        const std::vector<double> times(in_.below(4), 1.5);
        (void)joiner_->set_step_times(times);
        break;
      }
      case 1: (void)joiner_->add_extra(extra()); break;
      case 2:
        (void)joiner_->finish();
        joiner_.reset();
        break;
      case 3: (void)shm::place(chunks_, joiner_->chunks()); break;
      case 4: {  // pass invalid parts: truncated chunks, or data that does not consist of chunks
        shm::PartChunks wrong = chunks_;
        if (!wrong.bytes.empty()) wrong.bytes.pop_back();
        if (in_.flag()) wrong.bytes.assign(file_.begin(), file_.end());
        (void)shm::place(wrong, 0);
        if (!wrong.index.empty())
          wrong.index[in_.byte() % wrong.index.size()] ^= std::byte{in_.byte()};
        (void)joiner_->add(wrong.index, number(in_));
        break;
      }
      case 5: (void)joiner_->offset(); break;
      default: (void)joiner_->add(chunks_.index, chunks_.bytes.size());
    }
  }

  /// Calls the functions of FileSink, FileSource and FileRandomSource. Precondition: the temporary
  /// folder of the system exists.
  void call_files() {
    const std::filesystem::path folder = std::filesystem::temp_directory_path();
    path_ = (folder / ("fuzz_calls." + std::to_string(::getpid()))).string();
    const std::string& path = path_;
    const auto how =
        in_.flag() ? shm::FileSink::Temporary::named : shm::FileSink::Temporary::unnamed;
    auto sink = in_.below(4) == 0 ? shm::FileSink::create_scratch(folder.string(), "fuzz", how)
                                  : shm::FileSink::create(path, how);
    if (!sink) return;
    (void)(*sink)->write(file_.first(std::min<std::size_t>(file_.size(), in_.below(5000))));
    (void)(*sink)->copy(source_, number(in_), number(in_));
    if (auto old = shm::FileRandomSource::open(path)) {
      (void)(*sink)->copy(**old, 0, (*old)->size());
      (void)(*sink)->copy(**old, number(in_), number(in_));
    }
    if (in_.flag()) (void)(*sink)->commit();
    if (in_.flag()) (void)(*sink)->write(file_.first(std::min<std::size_t>(file_.size(), 10)));
    sink = shm::Error{};
    Bytes bytes(in_.below(3000));
    if (auto front = shm::FileSource::open(path)) {
      (void)(*front)->read(bytes);
      auto reader = shm::Reader::open(**front, shm_fuzz::small_limits());
      if (reader) (void)reader->next();
    }
    if (auto random = shm::FileRandomSource::open(path)) {
      (void)(*random)->read_at(number(in_), bytes);
      auto segments = shm::SegmentReader::open(**random, shm_fuzz::small_limits());
      if (segments) (void)segments->read(0);
    }
    (void)shm::FileSource::open(path + "/not there");
    (void)shm::FileRandomSource::open(folder.string());
    (void)shm::FileSink::create(path + "/not there/either");
  }

  void call_functions() {
    switch (in_.below(16) == 0 ? 6 : in_.below(6)) {
      case 6: call_files(); break;
      case 5: {
        const std::uint8_t value = in_.byte();
        (void)shm::scalar_name(static_cast<shm::ScalarType>(value));
        (void)shm::shape_name(static_cast<shm::CellShape>(value));
        (void)shm::order_name(static_cast<shm::Order>(value));
        (void)shm::codec_name(static_cast<shm::ConnectivityCodec>(value));
        (void)shm::array_stream_names(schema());
        break;
      }
      case 0: {
        shm::MemorySource source(file_);
        auto mesh = shm::read_mesh(source, shm_fuzz::small_limits());
        if (!mesh) break;
        if (const auto sets = shm::sets_of(*mesh)) (void)shm::extras_of_sets(*sets);
        // Writing the mesh must succeed or fail with an error; it must fail if the arrays of the
        // mesh have wrong sizes.
        if (in_.flag() && !mesh->xyz.empty()) mesh->xyz.pop_back();
        if (in_.flag() && !mesh->corners.empty()) mesh->corners[0] = number(in_);
        shm::NullSink sink;
        (void)shm::write_mesh(sink, *mesh);
        break;
      }
      case 1: (void)shm::read_summary(source_, shm_fuzz::small_limits()); break;
      case 2: (void)shm::ArchiveReader::open(source_, shm_fuzz::small_limits()); break;
      case 3: {
        shm::SectionSource section(source_, number(in_), number(in_));
        Bytes bytes(in_.below(20));
        (void)section.read(bytes);
        (void)section.read_at(number(in_), bytes);
        (void)source_.read_at(number(in_), bytes);
        break;
      }
      default:
        (void)shm::looks_like_archive(
            file_.first(std::min<std::size_t>(file_.size(), in_.below(20))));
    }
  }

  std::span<const std::byte> file_;
  Choices in_;
  shm::MemoryRandomSource source_;
  shm::MemorySource front_;
  std::string path_;  // path of the file on disk; empty before call_files() is called
  std::uint64_t fed_ = 0;
  shm::NullSink appended_, joined_;
  shm::PartChunks chunks_;
  std::optional<shm::Decoder> decoder_;
  std::optional<shm::Reader> reader_;
  std::optional<shm::SegmentReader> segments_;
  std::optional<shm::StepReader> steps_;
  std::optional<shm::MeshExtractor> extractor_;
  std::optional<shm::Appender> appender_;
  std::optional<shm::PartWriter> part_;
  std::optional<shm::PartJoiner> joiner_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::size_t script = std::min<std::size_t>(data[0], size - 1);
  // Copies the file into a buffer of exactly its size, so that a read beyond its end is detected.
  const auto all = std::as_bytes(std::span(data, size)).subspan(1);
  const Bytes file(all.begin(), all.end() - static_cast<std::ptrdiff_t>(script));
  Caller(file, Choices(std::span(data, size).last(script))).run();
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  return shm_fuzz::mutate_input(data, size, max_size, seed, size > 0 ? data[0] : 0);
}
