#include "vtk/xml/collection.h"

#include "base/stored_value.h"
#include "vtk/xml_document.h"

namespace shm::converters {

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
