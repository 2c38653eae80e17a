#include "tool/running/options.h"

#include <algorithm>

#include "base/text_input.h"
#include "formats/formats.h"

namespace shm::converters {

namespace {

// CLI11's own words are those of programmers: "x unit not recognized", and a list of 26.
const CLI::Validator kSize(
    [](std::string& word) {
      constexpr std::uint64_t kLeast = 1 << 20;
      const std::string given = word;
      const std::string wrong = "'" + given + "' is no size, such as 512M or 2G";
      if (given.starts_with('-')) return wrong;
      try {
        CLI::AsSizeValue(false)(word);
      } catch (const CLI::ValidationError&) {
        return wrong;
      }
      return std::stoull(word) < kLeast ? word + " bytes are too few; at least 1M" : std::string();
    },
    "");

}  // namespace

CLI::Validator whole_number(std::uint64_t least, std::uint64_t most) {
  return {
      [least, most](const std::string& word) {
        std::uint64_t number = 0;
        if (TextInput::parse(std::string_view(word), number) && number >= least && number <= most)
          return std::string();
        return "'" + word + "' is no whole number from " + std::to_string(least) +
               (most < ~std::uint32_t{0} ? " to " + std::to_string(most) : " on");
      },
      ""};
}

CLI::Validator one_of(std::vector<std::string> words) {
  return {[words = std::move(words)](const std::string& word) {
            if (std::find(words.begin(), words.end(), word) != words.end()) return std::string();
            std::string list;
            for (std::size_t i = 0; i < words.size(); ++i)
              list += (i == 0 ? "" : i + 1 < words.size() ? ", " : " or ") + words[i];
            return "'" + word + "' is not " + list;
          },
          ""};
}

CLI::App* add_command(CLI::App& tool, CommonOptions& options, const std::string& name,
                      const std::string& description, const std::string& examples) {
  CLI::App* command = tool.add_subcommand(name, description);
  command->footer("Examples:\n" + examples);
  command->add_option("--temp", options.temp, "Directory for temporary files")
      ->check(CLI::Validator(CLI::ExistingDirectory).description(""))
      ->type_name("DIR");
  command
      ->add_option(
          "--memory", options.memory,
          "What tables of vertices, cells and values may take of it, such as 512M; the "
          "rest is on disk\n(default: 256M; 1G for what needs them in any order); more also allows "
          ".shm files\nthat need more active vertices than they may have for their size")
      ->transform(kSize)
      ->type_name("SIZE");
  command
      ->add_option("--max-output", options.max_output,
                   "Refuse a mesh whose numbers take more than SIZE, with exit code 5")
      ->transform(kSize)
      ->type_name("SIZE");
  command
      ->add_option("--max-cells", options.max_cells,
                   "Refuse a mesh of more than N cells, or of more than N vertices")
      ->check(whole_number(1, ~std::uint64_t{0}))
      ->type_name("N");
  command->add_flag("-q,--quiet", options.quiet, "No progress, and no summary at the end");
  return command;
}

void add_files(CLI::App& command, FileCommand& options, const std::string& what) {
  command.add_option("IN", options.files, what)->required()->type_name("");
  command.add_flag("-r,--recursive", options.recursive,
                   "Of a folder the files in it and in the folders below, links left out");
  command
      .add_option("-T,--threads", options.threads,
                  "Work with N threads (default: one a core); of several files, small ones (32 MB) "
                  "side by\nside")
      ->check(whole_number(1, 1024))
      ->type_name("N");
}

void add_output(CLI::App& command, FileCommand& options, const std::string& output,
                const std::string& type) {
  command.add_option("-o,--output", options.output, output)->type_name(type);
  command.add_flag("-c,--stdout", options.to_stdout, "Write to standard output, as -o - does");
  add_force(command, options);
}

void add_removal(CLI::App& command, FileCommand& options) {
  CLI::Option* const remove = command.add_flag(
      "--rm", options.remove,
      "Remove IN once what was written of it has been read back and found to be the same mesh");
  command.add_flag("-k,--keep", options.keep, "Keep IN, as without --rm")->excludes(remove);
}

void add_part(CLI::App& command, CommonOptions& options) {
  command.add_option("--part", options.part, "Of an archive this file")->type_name("NAME");
}

void add_force(CLI::App& command, CommonOptions& options) {
  command.add_flag("-f,--force", options.force,
                   "Write over a file that is there (default: ask on a terminal, else exit code "
                   "4); never\nover what is read");
}

void add_threads(CLI::App& command, unsigned& threads, const std::string& what) {
  command.add_option("-T,--threads", threads, what + " with N threads (default: one a core)")
      ->check(whole_number(1, 1024))
      ->type_name("N");
}

void add_order(CLI::App& command, std::string& order) {
  command
      .add_option(
          "--order", order,
          "keep: all numbers come back (default); stream: vertices numbered by first use;\n"
          "free: the same mesh, its cells in whatever order is smallest (needs memory or disk)")
      ->check(one_of({"keep", "stream", "free"}))
      ->type_name("keep|stream|free");
}

void add_level(CLI::App& command, std::string& level) {
  command
      .add_option("--level", level,
                  "fast: little work for each cell; default; best: the smallest file, slower. Also "
                  "--fast,\n"
                  "--best, and -1 to -9: up to -3 fast, from -7 best")
      ->check(one_of({"fast", "default", "best"}))
      ->type_name("fast|default|best");
}

void add_format(CLI::App& command, std::string& format) {
  std::string names;
  for (const Format& one : formats()) names += (names.empty() ? "" : "|") + std::string(one.name);
  command
      .add_option("--format", format,
                  "Of OUT (default: by its name). Refused where the name is that of a format which "
                  "would hold\nwhat this one loses")
      ->type_name(names);
}

void add_strict(CLI::App& command, bool& strict) {
  command.add_flag("--strict", strict,
                   "Write nothing when OUT, of another format than the mesh came from, would lack "
                   "something\n(which is named on standard error in any case): exit code 6");
}

void add_steps(CLI::App& command, StepChoice& steps) {
  auto* step = command
                   .add_option("--step", steps.words,
                               "Time step N, from 0, first or last, or the steps A, A + 1, ..., B "
                               "- 1 alone\n(default: all; the last where a file holds one)")
                   ->type_name("N|first|last|A:B");
  command.add_option("--time", steps.time, "The time step of this time alone")
      ->excludes(step)
      ->type_name("T");
}

Order order_of(const std::string& name) {
  for (const Order order : {Order::stream, Order::free})
    if (name == order_name(order)) return order;
  return Order::keep;
}

Level level_of(const std::string& name) {
  return name == "fast" ? Level::fast : name == "best" ? Level::best : Level::standard;
}

std::vector<std::string> codec_names() {
  std::vector<std::string> names = {"auto"};
  for (std::uint8_t number = 1;; ++number) {
    const std::string_view name = codec_name(static_cast<ConnectivityCodec>(number));
    if (name == codec_name(static_cast<ConnectivityCodec>(std::uint8_t{255}))) return names;
    names.emplace_back(name);
  }
}

ConnectivityCodec codec_of(const std::string& name) {
  const std::vector<std::string> names = codec_names();
  const auto at = std::find(names.begin(), names.end(), name);
  return at == names.end() ? ConnectivityCodec::automatic
                           : static_cast<ConnectivityCodec>(at - names.begin());
}

std::string format_names() {
  std::string names;
  const auto& all = formats();
  for (std::size_t f = 0; f < all.size(); ++f)
    names += (f == 0 ? "" : f + 1 < all.size() ? ", " : " or ") + std::string(all[f].name);
  return names;
}

std::string mesh_file_text() { return "File of format " + format_names(); }

std::string output_text() {
  return "File to write; a name such as out_%04d.vtu is a file for each time step, with its "
         "number,\n"
         "out.pvd a collection of such files in a folder out, for ParaView";
}

}  // namespace shm::converters
