// Checks that the generated meshes (support/coded_meshes.h) use every registered codec at least
// once, and that the library agrees with spec/registry.md.
#include "support/coded_meshes.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "support/sanitized.h"

namespace shm {
namespace {

/// Returns the codecs that occur in the generated files, even if the writer chose a codec other
/// than the requested one.
const CodecUses& written_uses() {
  static const CodecUses all = [] {
    CodecUses uses;
    for (const auto& files : {coded_files(), feature_files()})
      for (const FeatureFile& file : files) add_uses(file.bytes, uses);
    return uses;
  }();
  return all;
}

std::map<int, std::string> codecs_of_the_library() {
  std::map<int, std::string> codecs;
  for (int number = 0; number < 256; ++number)
    if (const auto name = registered_name(static_cast<Codec>(number)); !name.empty())
      codecs.emplace(number, name);
  return codecs;
}

struct Registered {
  std::map<int, std::string> names;
  CodecUses uses;
};
/// Returns the table of codecs in spec/registry.md, without the codec numbers that are withdrawn,
/// reserved or not assigned.
Registered registered_codecs() {
  std::ifstream in(SHM_SOURCE_DIR "/spec/registry.md");
  Registered all;
  std::string line;
  while (std::getline(in, line) && line != "## Codecs (u8)") continue;
  while (std::getline(in, line) && !line.starts_with("##")) {
    std::istringstream cells(line);
    std::string cell, number, name, uses, state;
    std::getline(cells, cell, '|');
    for (std::string* to : {&number, &name, &uses, &state}) {
      std::getline(cells, *to, '|');
      to->erase(0, to->find_first_not_of(' '));
      to->erase(to->find_last_not_of(' ') + 1);
    }
    if (state.empty() || state.find_first_not_of("0123456789.") != state.npos) continue;
    all.names.emplace(std::stoi(number), name);
    for (const char c : uses)
      if (c >= '0' && c <= '9') all.uses.emplace(name, std::string(1, c));
    if (uses.find("step_values") != uses.npos) all.uses.emplace(name, "step_values");
  }
  return all;
}

TEST(CodedMeshes, AreInEveryCodecThereIs) {
  std::set<std::string> written;
  for (const auto& [name, what] : written_uses()) written.insert(name);
  for (const auto& [number, name] : codecs_of_the_library())
    EXPECT_TRUE(written.contains(name)) << "no file uses codec " << number << ", " << name;
  EXPECT_EQ(written.size(), codecs_of_the_library().size());
}

// The library and spec/registry.md agree on the number and name of each codec and on the kind of
// data that it encodes.
TEST(CodedMeshes, AreInTheCodecsThatAreRegistered) {
  const Registered registered = registered_codecs();
  EXPECT_EQ(codecs_of_the_library(), registered.names);
  EXPECT_EQ(written_uses(), registered.uses);
}

// Every codec for cells has a public name, and no two codecs have the same name.
TEST(CodedMeshes, AreInEveryCodecThatCallersName) {
  std::set<std::string> named, of_cells;
  for (const CellCodec& it : cell_codecs()) {
    EXPECT_EQ(registered_name(it.id), it.word);
    EXPECT_EQ(codec_name(it.name), it.word);
    EXPECT_TRUE(named.emplace(it.word).second) << it.word;
  }
  for (const auto& [name, what] : written_uses())
    if (what == "1") of_cells.insert(name);
  EXPECT_EQ(named, of_cells);
}

}  // namespace
}  // namespace shm
