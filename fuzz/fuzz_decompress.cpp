// Converts a hostile .shm file to every format. The writers of these formats use data that a
// hostile file can contain: extras that describe the keywords and the layout of the source file,
// and roles, sets and names. Each conversion must write a complete file or throw Failure.
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "base/failure.h"
#include "base/output_file.h"
#include "base/spool.h"
#include "compression/decompress.h"
#include "damaged_file.h"
#include "files/mesh_files.h"
#include "formats/formats.h"
#include "transfer/translate.h"

namespace {

using namespace shm::converters;

/// Does the same as `shm decompress`, except that the output file is a temporary file, which is
/// removed.
void decompress(std::span<const std::byte> file, const Format& format,
                std::optional<StepRange> steps) {
  static const std::string folder = std::filesystem::temp_directory_path().string();
  static const std::string path = folder + "/shm-fuzz-" + std::to_string(::getpid());
  Spool spool(folder);
  shm::MemorySource source(file);
  StagedMesh mesh(source, "hostile.shm", spool, shm_fuzz::small_limits());
  // Ignore steps that the file does not contain. The tool itself refuses such steps before this
  // code runs.
  if (steps && steps->end > mesh.info().step_times.size()) steps.reset();
  std::optional<Translation> translation;
  if (is_foreign(mesh.info(), format))
    translation.emplace(mesh, std::string(format.name), format.capabilities, steps, spool);
  OutputFile output(path, folder, format.temporary);
  write_mesh(translation ? translation->mesh() : mesh, output, format, spool);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto& all = formats();
  const std::size_t choice = data[0];
  std::optional<StepRange> steps;
  if (const std::size_t step = choice / all.size() % 4; step != 0)
    steps = StepRange{step - 1, step};
  try {
    decompress(std::as_bytes(std::span(data + 1, size - 1)), all[choice % all.size()], steps);
  } catch (const Failure&) {
  }
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  return shm_fuzz::mutate_input(data, size, max_size, seed);
}
