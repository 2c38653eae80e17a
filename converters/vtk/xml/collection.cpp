#include "vtk/xml/collection.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "base/failure.h"
#include "base/stored_value.h"
#include "base/text_input.h"
#include "vtk/xml/vtu.h"
#include "vtk/xml_document.h"

namespace shm::converters {

bool looks_like_collection(std::span<const std::byte> head) {
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  const std::size_t root = text.find("<VTKFile");
  if (!looks_like_vtu(head) || root == std::string_view::npos) return false;
  const std::string_view tag = text.substr(root, text.find('>', root) - root);
  return tag.find("\"Collection\"") != std::string_view::npos ||
         tag.find("'Collection'") != std::string_view::npos;
}

std::vector<CollectedFile> read_collection(const std::string& path) {
  const auto fail = [&](ErrorCode code, const std::string& what) {
    throw Failure(Error{.code = code, .detail = what, .section = "collection", .file = path});
  };
  vtu::Document document = vtu::read_document(path);
  vtu::Node* collection = document.root().child("Collection");
  if (collection == nullptr) fail(ErrorCode::corrupt, "has no element Collection");
  std::vector<CollectedFile> files;
  for (vtu::Node& each : collection->children) {
    if (!each.is("DataSet")) continue;
    CollectedFile& file = files.emplace_back();
    file.file = each.attribute_or("file", "");
    const std::string time = each.attribute_or("timestep", "");
    if (file.file.empty()) fail(ErrorCode::corrupt, "has a DataSet without a file");
    if (!TextInput::parse(time, file.time) || !std::isfinite(file.time))
      fail(ErrorCode::corrupt, "has a DataSet whose timestep is '" + time + "'");
  }
  if (files.empty()) fail(ErrorCode::unsupported, "lists no files");
  std::stable_sort(files.begin(), files.end(),
                   [](const CollectedFile& a, const CollectedFile& b) { return a.time < b.time; });
  for (std::size_t i = 1; i < files.size(); ++i)
    if (files[i].time == files[i - 1].time)
      fail(ErrorCode::unsupported, "lists " + files[i - 1].file + " and " + files[i].file +
                                       " at time " + number_text(files[i].time) +
                                       "; meshes of several parts are not read");
  return files;
}

std::string collection_text(std::span<const CollectedFile> files) {
  using vtu::element, vtu::start_tag;
  std::string text =
      "<?xml version=\"1.0\"?>\n" +
      start_tag(
          element("VTKFile",
                  {{"type", "Collection"}, {"version", "0.1"}, {"byte_order", "LittleEndian"}}),
          false) +
      "\n  <Collection>\n";
  for (const CollectedFile& each : files)
    text += "    " +
            start_tag(element("DataSet", {{"timestep", number_text(each.time)},
                                          {"group", ""},
                                          {"part", "0"},
                                          {"file", each.file}}),
                      true) +
            "\n";
  return text + "  </Collection>\n</VTKFile>\n";
}

}  // namespace shm::converters
