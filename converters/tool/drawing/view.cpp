#include "tool/drawing/view.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <vector>

#include "archive/archive_files.h"
#include "base/failure.h"
#include "base/output_file.h"
#include "compression/compress.h"
#include "shm/mesh_extract.h"
#include "tool/input.h"
#include "tool/progress_line.h"
#include "tool/report.h"
#include "tool/running/options.h"
#include "tool/shown/page.h"

namespace shm::converters {
namespace {

void copy_bytes(RandomSource& source, const std::string& path, ByteSink& into) {
  constexpr std::uint64_t kPiece = 1 << 20;
  std::vector<std::byte> piece;
  for (std::uint64_t offset = 0; offset < source.size(); offset += piece.size()) {
    piece.resize(static_cast<std::size_t>(std::min(kPiece, source.size() - offset)));
    unwrap(source.read_at(offset, piece), path);
    unwrap(into.write(piece), path);
  }
}

// Copies the bytes of a .shm file after checking that the file can be opened. If `part` is not
// empty, copies only the member `part` of an archive.
void copy_shm(const std::string& path, const std::string& part, const std::string& input,
              ByteSink& into) {
  const auto whole = unwrap(FileRandomSource::open(path), path);
  if (!is_archive(path)) {
    if (!part.empty()) wrong_use("--part needs an archive; " + input + " is not one");
    (void)unwrap(MeshExtractor::open(*whole), path);
    return copy_bytes(*whole, path, into);
  }
  const ArchiveReader archive = unwrap(ArchiveReader::open(*whole), path);
  if (part.empty()) return copy_bytes(*whole, path, into);
  const ArchiveMember& one = part_of(archive.members(), part, input);
  SectionSource member(*whole, one.offset, one.bytes);
  copy_bytes(member, path, into);
}

}  // namespace

CLI::App* ViewCommand::add_to(CLI::App& tool) {
  CLI::App* command =
      add_command(tool, *this, "view",
                  "Write a page that shows a mesh in a browser: a single file that contains the "
                  "mesh and can be\n"
                  "opened or emailed. The page needs no network and no program except the browser",
                  "  shm view rotor.e.shm                     writes rotor.e.shm.html\n"
                  "  shm view rotor.e -o rotor.html           compresses the mesh first");
  add_files(*command, *this, mesh_file_text());
  add_output(*command, *this, "Page to write, or folder for pages (default: IN.html next to IN)",
             "OUT.html");
  add_level(*command, level);
  command
      ->add_option(
          "--page", page,
          "Template page into which the mesh is inserted (default: the page installed with shm)")
      ->type_name("FILE");
  add_part(*command, *this);
  return command;
}

std::string ViewCommand::output_beside(const std::string& path) const {
  return path == "-" ? "-" : path + ".html";
}

Places ViewCommand::places() {
  if (std::filesystem::path(output).extension() == ".shm")
    wrong_use("a page is a .html file; OUT is " + output);
  return {{input, page}, output, true};
}

std::string ViewCommand::shown_name() const {
  if (!part.empty()) return part;
  return input == "-" ? "mesh" : std::filesystem::path(input).filename().string();
}

ExitCode ViewCommand::run() {
  const std::string empty = empty_page(page);
  ProgressLine line(*this);
  Spool spool(spool_directory(*this), spool_memory(*this), mesh_limits(*this));
  line.show("reading " + input);
  ToolInput in(*this);
  OutputFile file(output, spool_directory(*this));
  FileInPage inside(empty, shown_name(), file.sink());
  if (in.is_shm() && !in.is_stream()) {
    copy_shm(in.path(), part, input, inside);
  } else {
    CompressOptions how;
    how.level = level_of(level);
    how.threads = threads;
    how.progress = line.callback();
    line.expect({{"finding last uses", 1}, {"streaming cells", 9}}, in.bytes());
    const auto mesh = in.open(spool, line.callback(), threads);
    (void)compress_mesh(*mesh, inside, how, spool);
  }
  unwrap(inside.finish(), output);
  file.commit();
  line.wipe();
  print(*this, output + ": a page of " + plural(inside.page_bytes(), "byte", "bytes") +
                   ", with a file of " + plural(inside.bytes(), "byte", "bytes") + "\n");
  return kDone;
}

}  // namespace shm::converters
