#include "tool/options.h"

#include <charconv>
#include <system_error>

namespace shm::converters {
namespace {

CLI::App* add_command(CLI::App& app, Options& options, const std::string& name,
                      const std::string& description, const std::string& examples) {
  CLI::App* command = app.add_subcommand(name, description);
  command->footer("Examples:\n" + examples);
  command->add_option("--temp", options.temp, "Directory for temporary files")
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""))
      ->type_name("DIR");
  command
      ->add_option("--memory", options.memory,
                   "What tables of vertices, cells and values may take of it, such as 512M; the "
                   "rest is on disk\n(default: 256M; 1G for what needs them in any order)")
      ->transform(CLI::AsSizeValue(false).description(""))
      ->type_name("SIZE");
  command->add_flag("-q,--quiet", options.quiet, "No progress, and no summary at the end");
  return command;
}

void add_threads(CLI::App& command, Options& options, const std::string& what) {
  command.add_option("--threads", options.threads, what + " with N threads (default: one a core)")
      ->check(CLI::Range(1u, 1024u).description(""))
      ->type_name("N");
}

void add_order_and_level(CLI::App& command, Options& options) {
  command
      .add_option(
          "--order", options.order,
          "keep: all numbers come back (default); stream: vertices numbered by first use;\n"
          "free: the same mesh, its cells in whatever order is smallest (needs memory or disk)")
      ->check(CLI::IsMember({"keep", "stream", "free"}).description(""))
      ->type_name("keep|stream|free");
  command
      .add_option("--level", options.level,
                  "fast: little work for each cell; default; best: the smallest file, slower")
      ->check(CLI::IsMember({"fast", "default", "best"}).description(""))
      ->type_name("fast|default|best");
}

void add_format(CLI::App& command, Options& options) {
  command
      .add_option("--format", options.format,
                  "exodus, vtk, vtu, gmsh, ucd or shm; default: by name")
      ->type_name("F");
}

// What another format than the mesh's own cannot hold.
void add_translation(CLI::App& command, Options& options) {
  command.add_flag("--strict", options.strict,
                   "Write nothing when OUT, of another format than the mesh came from, would lack "
                   "something\n(which is named on standard error in any case): exit code 6");
  command
      .add_option("--step", options.step,
                  "Of a mesh that goes to another format: time step N alone, from 0 (default: all; "
                  "the last\nwhere a file holds one)")
      ->type_name("N");
}

// "5%", or "5": above 0, 100 at most.
double percent_of(const std::string& text) {
  double percent = 0;
  const char* const end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, percent);
  if (error != std::errc() || (at != end && (*at != '%' || at + 1 != end)) ||
      !(percent > 0 && percent <= 100))
    throw CLI::ValidationError("--parity", "'" + text + "' is no share above 0 and up to 100%");
  return percent;
}

}  // namespace

Order order_of(const std::string& name) {
  for (const Order order : {Order::stream, Order::free})
    if (name == order_name(order)) return order;
  return Order::keep;
}

Level level_of(const std::string& name) {
  return name == "fast" ? Level::fast : name == "best" ? Level::best : Level::standard;
}

ConnectivityCodec codec_of(const std::string& name) {
  for (const auto codec :
       {ConnectivityCodec::paper, ConnectivityCodec::rows, ConnectivityCodec::replay,
        ConnectivityCodec::mixed, ConnectivityCodec::shifts})
    if (name == codec_name(codec)) return codec;
  return ConnectivityCodec::automatic;
}

CLI::App* add_compress(CLI::App& app, Options& options) {
  CLI::App* command = add_command(
      app, options, "compress", "Compress a mesh with all its data into a .shm file",
      "  shm compress rotor.e                     writes rotor.e.shm, gives back all as it was\n"
      "  shm compress part.vtk -o part.shm --json sizes of all streams for a program\n"
      "  shm compress part.msh --order stream --delay 100\n"
      "                                           smaller: vertices renumbered, cells reordered\n"
      "  shm compress part.e --order free         the same mesh in the order that is smallest\n"
      "  shm compress scan.vtk --bits 16          coordinates rounded to 16 bits of the box\n"
      "  shm compress flow.e --rel 1e-4           coordinates and fields within 1e-4 of their "
      "range\n"
      "  shm compress flow.e --abs 1e-6 --array coordinates:lossless --array point/T:abs=0.01");
  command->add_option("IN", options.input, "Exodus, VTK legacy, VTU, Gmsh or .shm file")
      ->required()
      ->type_name("");
  command->add_option("-o,--output", options.output, "File to write (default: IN.shm)")
      ->type_name("OUT.shm");
  add_order_and_level(*command, options);
  command
      ->add_option("--delay", options.delay,
                   "Cells in the delay buffer, 0 for none\n"
                   "(default: none; in --order stream what a trial on a sample finds smaller)")
      ->check(CLI::Range(0u, 1u << 20).description(""))
      ->type_name("N");
  command
      ->add_option("--cell-order", options.cell_order,
                   "For --order free: the cells in the order of this file, a number from 0 in each "
                   "line,\ninstead of a search; verify needs the file too")
      ->type_name("FILE");
  command
      ->add_option("--bits", options.bits, "Round coordinates to N bits of the bounding box, 1..52")
      ->check(CLI::Range(1u, 52u).description(""))
      ->type_name("N");
  command
      ->add_option("--abs", options.abs,
                   "Round coordinates and all floating-point fields; no finite value moves by more "
                   "than E,\nand what is not finite stays (--bits, if given, is for coordinates)")
      ->type_name("E");
  command
      ->add_option("--rel", options.rel,
                   "The same, with a bound for each array: E times its range over all components, "
                   "blocks and\nsteps; for coordinates the largest side of their box")
      ->type_name("E");
  command
      ->add_option("--array", options.arrays,
                   "For one array, whatever the options above say: NAME:abs=E, NAME:rel=E, "
                   "NAME:bits=N or\nNAME:lossless; NAME is coordinates or an array's, as "
                   "point/NAME or cell/NAME where there are\nseveral. May be repeated")
      ->allow_extra_args(false)
      ->type_name("NAME:HOW");
  command
      ->add_option(
          "--codec", options.codec,
          "Connectivity: auto, what the level tries (default); paper, the published scheme; rows; "
          "replay, fast on regular layouts; mixed, smallest, half as fast as rows; shifts, many "
          "times faster\nwhere numbers run in rows and layers, coordinates and arrays too, which "
          "may take "
          "more room\n(no delay)")
      ->check(CLI::IsMember({"auto", "paper", "rows", "replay", "mixed", "shifts"}).description(""))
      ->type_name("auto|paper|rows|replay|mixed|shifts");
  command
      ->add_option_function<std::string>(
          "--parity", [&options](const std::string& text) { options.parity = percent_of(text); },
          "Add so much of the file again as parity, such as 5%: shm repair then heals what is "
          "lost\n"
          "of it, wherever that is, while it is less")
      ->type_name("P%");
  command
      ->add_option("--segment-cells", options.segment_cells,
                   "Start afresh every N cells, for random access and threads (default: by budget)")
      ->check(CLI::Range(std::uint64_t{1}, ~std::uint64_t{0}).description(""))
      ->type_name("N");
  command
      ->add_option("--restart-budget", options.restart_budget,
                   "Start afresh where at most P percent of the vertices have to be said again\n"
                   "(default: 0.2; 0: never)")
      ->check(CLI::Range(0.0, 100.0).description(""))
      ->type_name("P");
  command
      ->add_option(
          "--key-steps", options.key_steps,
          "Of N time steps in turn at least one refers to no other, so that reading can\n"
          "begin there (default: 8; 1: all, so for a mesh of one step: say 8 where shm append is\n"
          "to put more behind it)")
      ->check(CLI::Range(std::uint32_t{1}, ~std::uint32_t{0}).description(""))
      ->type_name("N");
  add_threads(*command, options, "Encode segments");
  command->add_flag("--json", options.json, "Print the sizes as JSON");
  return command;
}

CLI::App* add_decompress(CLI::App& app, Options& options) {
  CLI::App* command =
      add_command(app, options, "decompress", "Write the mesh of a .shm file in another format",
                  "  shm decompress rotor.e.shm -o rotor.e\n"
                  "  shm decompress part.shm -o part.out --format vtk");
  command->add_option("IN", options.input, ".shm file, - for standard input")
      ->required()
      ->type_name("");
  command->add_option("-o,--output", options.output, "File to write")->required()->type_name("OUT");
  add_format(*command, options);
  add_translation(*command, options);
  add_threads(*command, options, "Decode segments");
  return command;
}

CLI::App* add_append(CLI::App& app, Options& options) {
  CLI::App* command = add_command(
      app, options, "append",
      "Put more time steps of the same mesh behind those of a .shm file. The file is the old one "
      "or\n"
      "the new one at every instant; what stands in it is copied, not coded again",
      "  shm append run.shm run.e                  the steps of run.e after the last one in "
      "run.shm\n"
      "  shm append run.shm run.e-s002             restarted: its steps go behind\n"
      "  shm append run.shm run.e --step 4 --step 5\n"
      "  shm append run.shm state7.vtu --time 0.7  one step, of a file that tells no time");
  command->add_option("FILE", options.input, ".shm file with time steps")
      ->required()
      ->type_name("");
  command
      ->add_option("SOURCE", options.against,
                   "Exodus, VTK legacy, VTU, Gmsh, UCD or .shm file with the same vertices and "
                   "cells, in\nthe same numbers (or those that FILE was made of), and the same "
                   "arrays")
      ->required()
      ->type_name("");
  command->add_option("-o,--output", options.output, "File to write (default: FILE)")
      ->type_name("OUT.shm");
  auto* steps = command
                    ->add_option("--step", options.steps,
                                 "Step N of SOURCE, from 0, whatever its time; may be repeated\n"
                                 "(default: all that are later than the last one in FILE)")
                    ->type_name("N");
  command->add_flag("--all", options.all, "All steps of SOURCE, whatever their times")
      ->excludes(steps);
  command
      ->add_option(
          "--time", options.time,
          "Time of a SOURCE without time steps (default: its field data TIME or TimeValue)")
      ->type_name("T");
  command
      ->add_option("--key-steps", options.append_key_steps,
                   "As in compress (default: the most that FILE has from one key step to the next, "
                   "at least 8)")
      ->check(CLI::Range(std::uint32_t{1}, ~std::uint32_t{0}).description(""))
      ->type_name("N");
  command->add_option("--level", options.level, "As in compress")
      ->check(CLI::IsMember({"fast", "default", "best"}).description(""))
      ->type_name("fast|default|best");
  command
      ->add_option("--cell-order", options.cell_order,
                   "The file with which FILE was made in --order free")
      ->type_name("FILE");
  command->add_flag("--strict", options.strict,
                    "Write nothing where something of SOURCE would be left out beside the steps "
                    "(which is\nnamed on standard error in any case): exit code 6");
  add_threads(*command, options, "Decode segments");
  command->add_flag("--json", options.json, "Print steps and sizes as JSON");
  return command;
}

CLI::App* add_convert(CLI::App& app, Options& options) {
  CLI::App* command =
      add_command(app, options, "convert", "Write a mesh of any known format in another one",
                  "  shm convert part.msh part.e\n"
                  "  shm convert part.e part.dat --format vtk");
  command->add_option("IN", options.input, "Exodus, VTK legacy, VTU, Gmsh or .shm file")
      ->required()
      ->type_name("");
  command->add_option("OUT", options.output, "File to write")->required()->type_name("");
  add_format(*command, options);
  add_translation(*command, options);
  return command;
}

CLI::App* add_verify(CLI::App& app, Options& options) {
  CLI::App* command =
      add_command(app, options, "verify",
                  "Decode all of a .shm file; with --against, prove that it holds the same mesh;\n"
                  "of what was rounded, tell the largest error, and prove that it keeps its bound",
                  "  shm verify rotor.e.shm\n"
                  "  shm verify rotor.e.shm --against rotor.e   exit code 1 when they differ");
  command->add_option("IN", options.input, ".shm file")->required()->type_name("");
  add_threads(*command, options, "Decode segments");
  command->add_option("--against", options.against, "Mesh that IN was made of")
      ->type_name("SOURCE");
  command
      ->add_option("--cell-order", options.cell_order,
                   "The file with which IN was made in --order free")
      ->type_name("FILE");
  command->add_flag(
      "--json", options.json,
      "Print as JSON whether they are equal, how many differences there are, and counts");
  return command;
}

CLI::App* add_repair(CLI::App& app, Options& options) {
  CLI::App* command = add_command(
      app, options, "repair",
      "Give a damaged .shm file back as it was, by the parity behind it, or write what of it is\n"
      "whole: every segment that no damage touched. What is missing then is listed, and the exit\n"
      "code is 7.",
      "  shm repair rotor.e.shm                  in place\n"
      "  shm repair rotor.e.shm -o healed.shm\n"
      "  shm repair rotor.e.shm -o rest.shm --json | jq .missing");
  command->add_option("IN", options.input, ".shm file")->required()->type_name("");
  command
      ->add_option("-o,--output", options.output,
                   "File to write (default: IN, where\n"
                   "nothing of it is lost)")
      ->type_name("OUT.shm");
  command->add_flag("--json", options.json, "Print as JSON what was healed, and what is missing");
  return command;
}

CLI::App* add_diff(CLI::App& app, Options& options) {
  CLI::App* command = add_command(app, options, "diff", kDiffDescription, kDiffExamples);
  options.diff.add_options(*command);
  return command;
}

CLI::App* add_info(CLI::App& app, Options& options) {
  CLI::App* command =
      add_command(app, options, "info",
                  "Tell what a mesh holds and where the bytes of a .shm file go.\n"
                  "Of a .shm file heads alone are read; shm verify reads all of it.",
                  "  shm info rotor.e.shm\n"
                  "  shm info rotor.e.shm --json | jq .streams");
  command->add_option("IN", options.input, ".shm file (or any mesh, without sizes)")
      ->required()
      ->type_name("");
  command->add_flag("--json", options.json, "Print as JSON");
  return command;
}

CLI::App* add_extract(CLI::App& app, Options& options) {
  CLI::App* command = add_command(
      app, options, "extract",
      "Write a piece of a .shm file as a mesh of its own, in any format. Only the bytes that the\n"
      "piece needs are read. Conditions for cells are met all together; without any, all cells "
      "go.\n"
      "Vertices and cells are numbered anew, in their old order; shm_vertex_number and\n"
      "shm_cell_number (in Exodus the number maps) say what they were. Sets are cut to what is "
      "left",
      "  shm extract rotor.e.shm part.vtu --box 0,0,0,1,1,0.5 --array temperature --step 12\n"
      "  shm extract rotor.e.shm casing.e --block casing\n"
      "  shm extract rotor.e.shm inlet.vtk --set inlet     its sides, as quads and triangles\n"
      "  shm extract rotor.e.shm first.shm --cells 0:100000\n"
      "  shm extract pieces.shm box.vtu --part rotor.e.4.0 --box 0,0,0,1,1,1");
  command->add_option("IN", options.input, ".shm file that can be read anywhere")
      ->required()
      ->type_name("");
  command->add_option("OUT", options.output, "File to write")->required()->type_name("");
  add_format(*command, options);
  command
      ->add_option(
          "--cells", options.cells,
          "Cells A, A + 1, ..., B - 1, from 0 in the order of IN (in order keep that of the "
          "source)")
      ->type_name("A:B");
  command
      ->add_option("--block", options.blocks,
                   "Cells of the blocks with this name, or this number if no name is so; may be "
                   "repeated")
      ->allow_extra_args(false)
      ->type_name("ID");
  command
      ->add_option("--box", options.box,
                   "Cells with a vertex in this box, or on its faces: "
                   "xmin,ymin,zmin,xmax,ymax,zmax")
      ->type_name("BOX");
  command
      ->add_option(
          "--set", options.set,
          "A set by name or number, or side_set_N, node_set_N, element_set_N. Element set "
          "or physical\ngroup: its cells; side set: its sides as cells with the values of "
          "their points;\nnode set: its points, each a cell (of the conditions only --box)")
      ->type_name("NAME");
  command
      ->add_option(
          "--array", options.arrays,
          "This array alone, and number maps; NAME, point/NAME or cell/NAME, v for v_x, v_y, "
          "v_z. May be\nrepeated")
      ->allow_extra_args(false)
      ->type_name("NAME");
  command
      ->add_option("--step", options.step,
                   "Time step N alone, from 0 (default: all; the last where a file holds one)")
      ->type_name("N");
  command->add_option("--part", options.part, "Which file of an archive")->type_name("NAME");
  command->add_flag("--strict", options.strict,
                    "Write nothing when OUT would lack something of the piece (which is named on "
                    "standard error\nin any case): exit code 6");
  return command;
}

CLI::App* add_layout(CLI::App& app, Options& options) {
  CLI::App* command = add_command(
      app, options, "layout",
      "Draw how coherently a mesh is stored: vertices down, cells across, a green line\n"
      "from the first to the last use of each vertex",
      "  shm layout rotor.e -o rotor.svg");
  command->add_option("IN", options.input, "Exodus, VTK legacy, VTU, Gmsh or .shm file")
      ->required()
      ->type_name("");
  command->add_option("-o,--output", options.output, "Picture to write")
      ->required()
      ->type_name("OUT.svg");
  return command;
}

CLI::App* add_join(CLI::App& app, Options& options) {
  CLI::App* command = add_command(
      app, options, "join",
      "Put several meshes into one .shm file: the pieces of a decomposed mesh, the files of a\n"
      "restarted run. .shm files go in as they are, others are compressed",
      "  shm join -o rotor.shm rotor.e.4.0 rotor.e.4.1 rotor.e.4.2 rotor.e.4.3\n"
      "  shm join -o run.shm run.e run.e-s002 run.e-s003\n"
      "  shm join -o rounded.shm a.e.shm b.e.shm     made by shm compress, with its options");
  command->add_option("IN", options.inputs, "Exodus, VTK, VTU, Gmsh, UCD or .shm files")
      ->required()
      ->type_name("");
  command->add_option("-o,--output", options.output, "File to write")
      ->required()
      ->type_name("OUT.shm");
  add_order_and_level(*command, options);
  add_threads(*command, options, "Encode segments");
  command->add_flag("--json", options.json, "Print the sizes as JSON");
  return command;
}

CLI::App* add_split(CLI::App& app, Options& options) {
  CLI::App* command =
      add_command(app, options, "split",
                  "Give back the files of which shm join made an archive, each in its own format",
                  "  shm split rotor.shm -d pieces\n"
                  "  shm split run.shm run.e-s002               only this one, here\n"
                  "  shm split run.shm --packed                 .shm files, one for each");
  command->add_option("IN", options.input, "Archive that shm join made")->required()->type_name("");
  command->add_option("NAME", options.members, "Members to give back; default: all")->type_name("");
  command->add_option("-d,--directory", options.directory, "Directory to write to; default: here")
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""))
      ->type_name("DIR");
  command->add_flag("--packed", options.packed, "As .shm files, without decompressing");
  add_threads(*command, options, "Decode segments");
  return command;
}

}  // namespace shm::converters
