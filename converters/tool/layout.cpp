#include "tool/layout.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "mesh/vertex_compaction.h"
#include "tool/support.h"

namespace shm::converters {
namespace {

// Counts the line segments that pass through each bin of the diagram. Each segment represents a
// vertex. Uses a difference array for each row of bins.
class SegmentCounter {
 public:
  SegmentCounter(std::uint64_t vertices, std::uint64_t cells)
      : vertices_(vertices),
        cells_(cells),
        rows_(std::min<std::uint64_t>(vertices, kLayoutBins)),
        columns_(std::min<std::uint64_t>(cells, kLayoutBins)),
        change_(rows_ * (columns_ + 1)),
        in_row_(rows_) {}

  void add(std::uint64_t vertex, std::uint64_t first_cell, std::uint64_t last_cell) {
    const std::size_t row = bin(vertex, vertices_, rows_);
    std::int64_t* line = change_.data() + row * (columns_ + 1);
    ++line[bin(first_cell, cells_, columns_)];
    --line[bin(last_cell, cells_, columns_) + 1];
    ++in_row_[row];
  }

  LayoutRaster raster() const {
    LayoutRaster out{rows_, columns_, std::vector<std::uint8_t>(rows_ * columns_)};
    for (std::size_t row = 0; row < rows_; ++row) {
      std::int64_t passing = 0;
      for (std::size_t column = 0; column < columns_; ++column) {
        passing += change_[row * (columns_ + 1) + column];
        out.level[row * columns_ + column] = level(passing, in_row_[row]);
      }
    }
    return out;
  }

 private:
  static std::size_t bin(std::uint64_t index, std::uint64_t of, std::size_t bins) {
    return static_cast<std::size_t>(static_cast<double>(index) / static_cast<double>(of) *
                                    static_cast<double>(bins));
  }
  static std::uint8_t level(std::int64_t passing, std::int64_t all) {
    if (passing <= 0) return 0;
    const double share = static_cast<double>(passing) / static_cast<double>(all);
    return share > 0.7 ? 4 : share > 0.35 ? 3 : share > 0.1 ? 2 : 1;
  }

  std::uint64_t vertices_, cells_;
  std::size_t rows_, columns_;
  std::vector<std::int64_t> change_;
  std::vector<std::int64_t> in_row_;
};

class LayoutMeter final : public CompactedMesh {
 public:
  explicit LayoutMeter(const MeshInfo& info)
      : stored_(info.vertices, info.cells()), compacted_(info.vertices, info.cells()) {
    layout_.vertices = info.vertices;
    layout_.cells = info.cells();
  }
  void begin_batch(const CellBatch&, std::uint64_t) override {}
  void vertex(std::uint64_t number, std::uint64_t last_cell) override {
    if (last_cell == kNeverUsed) return;
    stored_.add(number, cell_, last_cell);
    compacted_.add(rank_++, cell_, last_cell);
    ++active_;
  }
  void cell(const CellBatch&, std::size_t, std::uint64_t last_use,
            std::span<const std::uint64_t> other_last_uses) override {
    if (active_ > layout_.width) {
      layout_.width = active_;
      layout_.width_at_cell = cell_;
    }
    active_ -= static_cast<std::uint64_t>(std::popcount(last_use)) + other_last_uses.size();
    ++cell_;
  }
  Layout finish() {
    layout_.stored = stored_.raster();
    layout_.compacted = compacted_.raster();
    return std::move(layout_);
  }

 private:
  Layout layout_;
  SegmentCounter stored_, compacted_;
  std::uint64_t cell_ = 0, rank_ = 0, active_ = 0;
};

// Formats 1234567 as "1 234 567", with narrow no-break spaces.
std::string grouped(std::uint64_t number) {
  std::string text = std::to_string(number);
  for (std::size_t position = text.size(); position > 3;) text.insert(position -= 3, "\u202f");
  return text;
}

std::string percent(std::uint64_t part, std::uint64_t whole) {
  if (whole == 0) return "0 %";
  const double share = 100.0 * static_cast<double>(part) / static_cast<double>(whole);
  char text[32];
  const int digits = share >= 10 ? 1 : 2;
  return std::string(text,
                     std::to_chars(text, text + 32, share, std::chars_format::fixed, digits).ptr) +
         " %";
}

constexpr std::string_view kGreens[] = {"", "#c9ead3", "#8fd0a5", "#46ad6d", "#137a3e"};

// Returns an SVG path that draws all bins of one level as rectangles. Runs of bins that cover the
// same columns in consecutive rows become one rectangle.
std::string level_path(const LayoutRaster& raster, std::uint8_t level) {
  struct Run {
    std::size_t begin, end, top;
  };
  std::string path;
  std::vector<Run> open, next;
  const auto draw = [&](const Run& run, std::size_t bottom) {
    path += "M" + std::to_string(run.begin) + " " + std::to_string(run.top) + "H" +
            std::to_string(run.end) + "V" + std::to_string(bottom) + "H" +
            std::to_string(run.begin) + "Z";
  };
  for (std::size_t row = 0; row <= raster.rows; ++row) {
    next.clear();
    for (std::size_t column = 0; row < raster.rows && column < raster.columns;) {
      const std::size_t begin = column;
      while (column < raster.columns && raster.level[row * raster.columns + column] == level)
        ++column;
      if (column > begin)
        next.push_back({begin, column, row});
      else
        ++column;
    }
    for (const Run& run : open) {
      const auto same = std::find_if(next.begin(), next.end(), [&](const Run& other) {
        return other.begin == run.begin && other.end == run.end;
      });
      if (same != next.end())
        same->top = run.top;
      else
        draw(run, row);
    }
    open.swap(next);
  }
  return path;
}

constexpr int kSide = 500, kLeft = 92, kTop = 112, kGap = 116;

void add_text(std::string& svg, int x, int y, std::string_view style, const std::string& text) {
  svg += "<text x=\"" + std::to_string(x) + "\" y=\"" + std::to_string(y) + "\" " +
         std::string(style) + ">" + text + "</text>\n";
}

void add_diagram(std::string& svg, const Layout& layout, const LayoutRaster& raster, int left,
                 const std::string& heading, const std::string& note, const std::string& vertical) {
  const auto scale = [](std::size_t bins) {
    char text[32];
    const double factor = bins > 0 ? static_cast<double>(kSide) / static_cast<double>(bins) : 1;
    return std::string(text, std::to_chars(text, text + 32, factor).ptr);
  };
  add_text(svg, left, kTop - 16, "class=\"h\"", heading);
  add_text(svg, left + kSide, kTop - 16, "class=\"l\" text-anchor=\"end\"", note);
  svg += "<rect x=\"" + std::to_string(left) + "\" y=\"" + std::to_string(kTop) +
         "\" width=\"500\" height=\"500\" fill=\"#fff\"/>\n<g transform=\"translate(" +
         std::to_string(left) + " " + std::to_string(kTop) + ") scale(" + scale(raster.columns) +
         " " + scale(raster.rows) + ")\">\n";
  for (std::uint8_t level = 1; level <= LayoutRaster::kLevels; ++level) {
    const std::string path = level_path(raster, level);
    if (!path.empty())
      svg += "<path fill=\"" + std::string(kGreens[level]) + "\" d=\"" + path + "\"/>\n";
  }
  svg += "</g>\n<rect x=\"" + std::to_string(left) + "\" y=\"" + std::to_string(kTop) +
         "\" width=\"500\" height=\"500\" fill=\"none\" stroke=\"#8a949e\"/>\n";
  const int bottom = kTop + kSide;
  add_text(svg, left, bottom + 20, "class=\"n\"", "0");
  add_text(svg, left + kSide, bottom + 20, "class=\"n\" text-anchor=\"end\"",
           grouped(layout.cells));
  add_text(svg, left + kSide / 2, bottom + 20, "class=\"l\" text-anchor=\"middle\"",
           "cells, in file order");
  add_text(svg, left - 8, kTop + 11, "class=\"n\" text-anchor=\"end\"", "0");
  add_text(svg, left - 8, bottom, "class=\"n\" text-anchor=\"end\"", grouped(layout.vertices));
  svg += "<text class=\"l\" text-anchor=\"middle\" transform=\"translate(" +
         std::to_string(left - 14) + " " + std::to_string(kTop + kSide / 2) + ") rotate(-90)\">" +
         vertical + "</text>\n";
}

}  // namespace

bool is_scattered(const Layout& layout) {
  // A mesh is scattered if it has many more active vertices than a cube of n^3 cells that is
  // traversed in layers. In this cube, about n^2 vertices are active. The factor 4 allows for
  // meshes that consist of several parts.
  const double front = std::cbrt(static_cast<double>(layout.vertices));
  const double ideal = 4 * front * front;
  return static_cast<double>(layout.width) >
         std::max(ideal, static_cast<double>(layout.vertices) / 16);
}

std::string layout_verdict(const Layout& layout, std::optional<double> saved) {
  constexpr double kWorthAWord = .05;
  if (layout.cells == 0) return "there are no cells";
  if (!is_scattered(layout)) return "cells that share vertices are stored close together";
  const std::string words = "cells that share vertices are scattered over the file";
  if (!saved) return words + ": --order free may make the file much smaller";
  if (*saved < kWorthAWord) return words + ", but --order free would save less than 5 %";
  return words + ": --order free would save about " +
         std::to_string(static_cast<int>(std::lround(100 * *saved))) + " %";
}

Layout measure_layout(MeshSource& mesh, Spool& spool, const Progress& progress) {
  LayoutMeter meter(mesh.info());
  stream_compacted(mesh, spool, meter, progress);
  return meter.finish();
}

std::string layout_svg(const Layout& layout, const std::string& title) {
  const int right = kLeft + kSide + kGap;
  std::string svg =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 1240 664\" width=\"1240\" "
      "height=\"664\" font-family=\"system-ui, 'DejaVu Sans', Helvetica, Arial, sans-serif\" "
      "shape-rendering=\"crispEdges\">\n"
      "<style>.t{font-size:20px;font-weight:600;fill:#1d2730}.s{font-size:14px;fill:#46525e}"
      ".h{font-size:15px;font-weight:600;fill:#1d2730}.l{font-size:13px;fill:#46525e}"
      ".n{font-size:12px;fill:#6a7682}</style>\n"
      "<rect width=\"1240\" height=\"664\" fill=\"#fbfcfd\"/>\n";
  add_text(svg, kLeft, 38, "class=\"t\"", escaped_markup(title));
  add_text(svg, kLeft, 62, "class=\"s\"",
           grouped(layout.vertices) + " vertices, " + grouped(layout.cells) +
               " cells; the line of a vertex runs from the first to the last cell that uses it "
               "(darker where the lines of more vertices overlap)");
  add_diagram(svg, layout, layout.stored, kLeft, "As stored",
              "all " + grouped(layout.vertices) + " vertices before the first cell",
              "vertices, as numbered in the file");
  add_diagram(
      svg, layout, layout.compacted, right, "After vertex compaction",
      "width " + grouped(layout.width) + " vertices, " + percent(layout.width, layout.vertices),
      "vertices, in order of first use");
  return svg + "</svg>\n";
}

}  // namespace shm::converters
