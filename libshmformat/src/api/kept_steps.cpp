#include "api/kept_steps.h"

#include <memory>
#include <utility>

#include "shm/io.h"

namespace shm {

#ifdef __wasm__  // WebAssembly has no files.

KeptSteps kept_steps(std::uint64_t memory, const std::string&) { return {memory, {}}; }

#else

namespace {

class TemporaryFile final : public StepSpace {
 public:
  static Result<std::unique_ptr<StepSpace>> create(const std::string& folder) {
    auto sink = FileSink::create_scratch(folder, "steps");
    if (!sink) return sink.error();
    auto source = FileRandomSource::open((*sink)->temporary());
    if (!source) return source.error();
    std::unique_ptr<StepSpace> file(new TemporaryFile(std::move(*sink), std::move(*source)));
    return file;
  }
  Result<void> write(std::uint64_t offset, std::span<const std::byte> bytes) override {
    return sink_->write_at(offset, bytes);
  }
  Result<void> read(std::uint64_t offset, std::span<std::byte> into) override {
    return source_->read_at(offset, into);
  }

 private:
  TemporaryFile(std::unique_ptr<FileSink> sink, std::unique_ptr<FileRandomSource> source)
      : sink_(std::move(sink)), source_(std::move(source)) {}

  std::unique_ptr<FileSink> sink_;
  std::unique_ptr<FileRandomSource> source_;
};

}  // namespace

KeptSteps kept_steps(std::uint64_t memory, const std::string& folder) {
  return {memory, [folder] { return TemporaryFile::create(folder); }};
}

#endif

}  // namespace shm
