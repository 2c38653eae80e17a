// Main program of shm_mpi, in which all ranks of an MPI program compress or decompress one mesh
// together. The exit codes are those of shm.
#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>

#include "base/failure.h"
#include "files/mesh_files.h"
#include "mpi/compress.h"
#include "mpi/decompress.h"
#include "mpi/mpi_ranks.h"
#include "mpi/output.h"
#include "tool/commands/compress.h"
#include "tool/commands/convert.h"
#include "tool/report.h"

namespace shm::converters {
namespace {

struct Commands {
  CompressCommand compress;
  DecompressCommand decompress;
  const Command* chosen = &compress;
};

ExitCode run_compress(Ranks& ranks, CompressCommand& command) {
  if (command.output.empty()) command.output = command.input + ".shm";
  CompressOptions how;
  ranks.together([&] {
    if (command.input == "-" || command.output == "-")
      wrong_use("shm_mpi cannot use standard input or standard output: IN and OUT must be files");
    if (command.order == "free" || !command.cell_order.empty())
      wrong_use("--order free needs the whole mesh in the memory of one process: use shm compress");
    if (command.segment_cells == 0)
      wrong_use("--segment-cells N is required, because each rank codes whole segments");
    how = command.how();
  });
  const auto start = std::chrono::steady_clock::now();
  std::optional<Spool> own_spool;
  ranks.together([&] { own_spool.emplace(spool_directory(command), spool_memory(command)); });
  Spool& spool = *own_spool;
  std::size_t parts = 0;
  ranks.together([&] {
    if (ranks.first()) parts = count_of_parts(command.input);
  });
  parts = static_cast<std::size_t>(ranks.broadcast(parts));
  const std::vector<std::string> files =
      parts > 0 ? part_files(command.input, parts) : std::vector{command.input};
  ranks.together([&] {
    if (ranks.first()) check_places({files, command.output, true}, command.force);
  });
  std::unique_ptr<MeshSource> mesh;
  CompressRun run;
  const auto compress = [&](auto& source) {
    SharedOutput output(ranks, command.output);
    run.sizes = compress_with_ranks(ranks, source, output, how, spool);
    output.commit();
  };
  if (parts > 0) {
    auto joined = std::make_unique<JoinedMesh>(ranks, files, spool);
    compress(*joined);
    mesh = std::move(joined);
  } else {
    ranks.together([&] { mesh = open_mesh(command.input, spool); });
    compress(*mesh);
  }
  if (!ranks.first()) return kDone;
  run.input = command.input;
  run.output = command.output;
  for (const std::string& file : files) run.input_bytes += file_bytes(file);
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (command.json)
    std::fputs(compress_json(run, mesh->info()).c_str(), stdout);
  else
    print(command, compress_text(run, mesh->info()));
  return kDone;
}

// Removes the options that are not meaningful for shm_mpi: --recursive and --stdout, because it
// processes exactly one file, and --rm and --keep, because it never removes this file.
void leave_out_many_files(CLI::App& command) {
  for (const char* const option : {"--recursive", "--stdout", "--rm", "--keep"})
    command.remove_option(command.get_option(option));
}
void take_one_file(FileCommand& command) {
  if (command.files.size() != 1)
    wrong_use("shm_mpi processes one file, but several input files are given");
  command.input = command.files.front();
}

int run(Ranks& ranks, int argc, char** argv, Commands& commands) {
  CLI::App app{
      "shm_mpi compresses and decompresses a mesh with the ranks of an MPI program.\n"
      "All ranks must see the same files."};
  app.name("shm_mpi");
  app.require_subcommand(1);
  commands.compress.threads = commands.decompress.threads = 1;
  CLI::App* compress = commands.compress.add_to(app);
  compress->description(
      "Compress one mesh with all ranks. The output is identical to that of shm compress with the\n"
      "same options. --segment-cells must be given, because the segments are divided among the\n"
      "ranks. --order is keep or stream. --threads is the number of threads per rank (default: 1)");
  compress->footer(
      "Examples:\n"
      "  mpirun -n 4 shm_mpi compress rotor.e --segment-cells 262144\n"
      "  mpirun -n 4 shm_mpi compress rotor.e.8 --segment-cells 262144   reads rotor.e.8.0 to .7\n"
      "  mpirun -n 4 shm_mpi compress rotor.e -o rotor.shm --order stream --segment-cells 262144");
  CLI::App* decompress = commands.decompress.add_to(app);
  decompress->description(
      "Write the mesh of a .shm file as a decomposed Exodus mesh with one part per rank: 4 ranks\n"
      "write OUT.4.0 to OUT.4.3. Each rank decodes its share of the cells. The number\n"
      "maps contain the global number of each node and element");
  decompress->remove_option(decompress->get_option("--threads"));
  leave_out_many_files(*compress);
  leave_out_many_files(*decompress);
  decompress->footer(
      "Examples:\n"
      "  mpirun -n 4 shm_mpi decompress rotor.shm -o rotor.e     writes rotor.e.4.0 to "
      "rotor.e.4.3");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return ranks.first() ? app.exit(error) : kDone;
    if (ranks.first()) std::fprintf(stderr, "shm_mpi: %s (see shm_mpi --help)\n", error.what());
    return kWrongUse;
  }
  if (!decompress->parsed()) {
    ranks.together([&] { take_one_file(commands.compress); });
    return run_compress(ranks, commands.compress);
  }
  commands.chosen = &commands.decompress;
  ranks.together([&] {
    take_one_file(commands.decompress);
    if (commands.decompress.output.empty()) wrong_use("-o names the parts to write");
  });
  return decompress_with_ranks(ranks, commands.decompress);
}

int complain(const Commands& commands, Error error) {
  if (error.file.empty() && error.code != ErrorCode::misuse) error.file = commands.chosen->input;
  std::fprintf(stderr, "shm_mpi: %s\n", error.message().c_str());
  return exit_code(error.code);
}

int guarded_run(int argc, char** argv) {
  MpiRanks ranks(&argc, &argv);
  // Call this after MPI_Init(), because MPI installs signal handlers of its own.
  remove_outputs_on_signals();
  Commands commands;
  try {
    return run(ranks, argc, argv, commands);
  } catch (const SharedFailure& failure) {
    if (ranks.first()) complain(commands, failure.error());
    return exit_code(failure.error().code);
  } catch (...) {
    // The error occurred on this rank only. The other ranks wait in collective calls, so all ranks
    // must be ended.
    MpiRanks::abort_with([&] { return complain(commands, current_error()); });
  }
}

}  // namespace
}  // namespace shm::converters

int main(int argc, char** argv) {
  // SIGXFSZ is ignored, so that a write beyond the file size limit returns an error instead of
  // ending the process.
  std::signal(SIGXFSZ, SIG_IGN);
  return shm::converters::guarded_run(argc, argv);
}
