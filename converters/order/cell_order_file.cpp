#include "order/cell_order_file.h"

#include <vector>

#include "base/failure.h"
#include "base/text_input.h"
#include "mesh/cell_table.h"

namespace shm::converters {

CellSequence read_cell_order(const std::string& path, std::uint64_t cells) {
  if (cells >= CellTable::kMostCells)
    throw Failure(ErrorCode::over_limit,
                  "a mesh of " + std::to_string(cells) + " cells has too many to be ordered", path);
  TextInput input(path);
  const auto fail = [&](std::uint64_t line, const std::string& what) {
    const std::string place = "line " + std::to_string(line);
    throw Failure(
        Error{.code = ErrorCode::corrupt, .detail = what, .section = place, .file = path});
  };
  // Each number needs at least two bytes: a digit and a newline.
  const std::uint64_t least_bytes = cells < 2 ? cells : 2 * cells - 1;
  if (input.size() < least_bytes)
    throw Failure(ErrorCode::truncated,
                  "is too short for the numbers of " + std::to_string(cells) + " cells", path);
  CellSequence order;
  order.reserve(cells);
  std::vector<bool> seen(cells, false);
  std::uint64_t line = 1;
  for (; !input.at_end(); ++line) {
    const std::string text = input.line();
    std::uint64_t number = 0;
    if (!TextInput::parse(text, number)) fail(line, "'" + text.substr(0, 40) + "' is not a number");
    if (number >= cells)
      fail(line,
           "cell " + text + " is beyond the last, " + std::to_string(cells) + " cells in all");
    if (seen[number]) fail(line, "cell " + text + " occurs twice");
    seen[number] = true;
    order.push_back(static_cast<std::uint32_t>(number));
  }
  if (order.size() < cells)
    throw Failure(Error{.code = ErrorCode::truncated,
                        .detail = "ends after " + std::to_string(order.size()) + " of " +
                                  std::to_string(cells) + " cells",
                        .section = "line " + std::to_string(line),
                        .file = path});
  return order;
}

}  // namespace shm::converters
