#include "order/cell_orders.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <limits>
#include <string>

#include "base/external_sorter.h"

namespace shm::converters {
namespace {

constexpr Frame kPlainFrame = {1, 3, 5};

// Packs a frame into a byte.
std::uint8_t packed(const Frame& frame) {
  return static_cast<std::uint8_t>(frame[0] + 6 * frame[1] + 36 * frame[2]);
}
constexpr auto kUnpacked = [] {
  std::array<Frame, 216> table{};
  for (std::size_t i = 0; i < table.size(); ++i)
    table[i] = {static_cast<std::uint8_t>(i % 6), static_cast<std::uint8_t>(i / 6 % 6),
                static_cast<std::uint8_t>(i / 36)};
  return table;
}();

// Records the hexahedra in the order in which they are visited, each with its frame (the local
// directions ahead, beside and above).
class Traversal {
 public:
  Traversal(const CellGraph& graph, Spool* spool)
      : graph_(&graph),
        visited_(graph.cells().size(), false),
        frames_(spool, graph.cells().size()),
        passed_(spool, graph.cells().size()),
        order_(spool) {}

  bool visited(std::uint32_t cell) const { return visited_[cell]; }
  const Frame& frame(std::uint32_t cell) const { return kUnpacked[frames_[cell]]; }
  CellList& order() { return order_; }

  void visit(std::uint32_t cell, const Frame& frame) {
    visited_[cell] = true;
    frames_.set(cell, packed(frame));
    order_.push_back(cell);
  }

  struct Step {
    std::uint32_t cell;
    Frame frame;
  };
  // Finds the next cell in direction `axis` (ahead, beside or above) of the frame of `from`, or in
  // the opposite direction if `back` is true. Returns false if that cell does not exist or has been
  // visited.
  bool step(const Step& from, std::size_t axis, bool back, Step& to) const {
    const std::uint32_t face = from.frame[axis] ^ (back ? 1u : 0u);
    const CellFace across = graph_->across(from.cell, face);
    if (!across || visited_[across.cell()]) return false;
    to = {across.cell(), graph_->carried(from.cell, from.frame, face, across)};
    return true;
  }
  bool step(std::uint32_t from, std::size_t axis, bool back, Step& to) const {
    return step(Step{from, frame(from)}, axis, back, to);
  }
  // Returns the last cell of a straight walk. The walk stops at a boundary, at a visited cell, and
  // at a cell that this walk has already passed, because a row may be a ring or cross itself.
  // Stores the number of steps in `length`, unless it is null.
  Step farthest(const Step& from, std::size_t axis, bool back, std::uint32_t* length = nullptr) {
    ++walk_;
    Step current = from, next;
    std::uint32_t count = 0;
    passed_.set(current.cell, walk_);
    for (; step(current, axis, back, next) && passed_[next.cell] != walk_; ++count) {
      current = next;
      passed_.set(current.cell, walk_);
    }
    if (length != nullptr) *length = count;
    return current;
  }

 private:
  const CellGraph* graph_;
  std::vector<bool> visited_;
  BigArray<std::uint8_t> frames_;  // frame of each visited cell
  BigArray<std::uint32_t>
      passed_;  // for each cell, the number of the most recent walk that passed it
  std::uint32_t walk_ = 0;
  CellList order_;
};

// Finds a cell at the rim of the component that contains `first`: the last cell of a breadth-first
// search.
class RimFinder {
 public:
  RimFinder(const CellGraph& graph, Spool* spool)
      : graph_(&graph), reached_(graph.cells().size(), false), queue_(spool) {}
  // Returns a cell at the rim of the component of `first`. Call this at most once for each
  // component.
  std::uint32_t operator()(std::uint32_t first) {
    std::uint64_t position = queue_.size();
    queue_.push_back(first);
    reached_[first] = true;
    std::uint32_t cell = first;
    for (; position < queue_.size(); ++position) {
      cell = queue_[position];
      for (std::uint32_t face = 0; face < 6; ++face) {
        const CellFace to = graph_->across(cell, face);
        if (!to || reached_[to.cell()]) continue;
        reached_[to.cell()] = true;
        queue_.push_back(to.cell());
      }
    }
    return cell;
  }

 private:
  const CellGraph* graph_;
  std::vector<bool> reached_;
  CellList queue_;  // cells of all components searched so far
};

// Returns a frame (directions ahead, beside and above) for a cell at the rim of the mesh. The
// directions point into the mesh. `layers_along` selects the axis along which layers are stacked: 0
// is the shortest axis of the mesh at this cell, 1 the middle axis, and 2 the longest axis. Rows
// are parallel to the longer of the other two axes.
Frame frame_at(const CellGraph& graph, Traversal& traversal, std::uint32_t cell,
               std::size_t layers_along) {
  Frame frame = kPlainFrame;
  std::array<std::uint32_t, 3> length{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!graph.across(cell, frame[axis]) && graph.across(cell, frame[axis] ^ 1u)) frame[axis] ^= 1;
    traversal.farthest({cell, frame}, axis, false, &length[axis]);
  }
  std::array<std::size_t, 3> axes = {0, 1, 2};
  std::stable_sort(axes.begin(), axes.end(),
                   [&](std::size_t a, std::size_t b) { return length[a] < length[b]; });
  const std::size_t above = axes[layers_along];
  const std::size_t beside = axes[layers_along == 0 ? 1 : 0];
  return {frame[3 - above - beside], frame[beside], frame[above]};
}

// Calls start(cell, frame) for one cell at the rim of each connected component. Components are
// visited in the order of their first cells in the mesh. `start` must visit all cells of the
// component.
template <class Start>
void for_each_component(const CellGraph& graph, Traversal& traversal, std::size_t layers_along,
                        Spool* spool, Start&& start) {
  RimFinder rim(graph, spool);
  for (std::uint32_t number = 0; number < graph.cells().size(); ++number) {
    const std::uint32_t cell = graph.cells().with_number(number);
    if (traversal.visited(cell) || !graph.cells().is_hexahedron(cell)) continue;
    const std::uint32_t first = rim(cell);
    start(first, frame_at(graph, traversal, first, layers_along));
  }
}

constexpr std::size_t kAhead = 0, kBeside = 1, kAbove = 2;

class Sweep {
 public:
  Sweep(const CellGraph& graph, std::size_t layers_along, Spool* spool) : walk_(graph, spool) {
    for_each_component(graph, walk_, layers_along, spool,
                       [&](std::uint32_t cell, const Frame& frame) {
                         sweep({cell, frame});
                       });
  }
  CellList take() { return std::move(walk_.order()); }

 private:
  using Step = Traversal::Step;
  CellList& order() { return walk_.order(); }

  // Visits all cells of a component: the layer of `seed`, then the layers above, then the layers
  // below. If any cells remain, the sweep then continues at the unvisited cells on the four sides
  // of visited cells: in the directions beside and ahead, and in the opposite directions.
  void sweep(const Step& seed) {
    std::uint64_t above = order().size(), below = above, aside = above;
    row(walk_.farthest(seed, kBeside, true));
    complete_layer(above);
    Step next;
    for (;;) {
      if (above < order().size()) {
        above = image_of_layer(above, false);
      } else if (below < order().size()) {
        below = image_of_layer(below, true);
      } else if (aside < order().size()) {
        const std::uint32_t cell = order()[aside++];
        for (const std::size_t axis : {kBeside, kAhead})
          for (const bool back : {false, true}) {
            if (!walk_.step(cell, axis, back, next)) continue;
            const std::uint64_t begin = order().size();
            row(next);
            complete_layer(begin);
          }
      } else {
        return;
      }
    }
  }

  // Visits the layer above a visited layer (the layer below it if `down` is true). `begin` is the
  // index of the first cell of the visited layer. Returns the index of the first cell of the new
  // layer.
  std::uint64_t image_of_layer(std::uint64_t begin, bool down) {
    const std::uint64_t end = order().size();
    Step next;
    for (std::uint64_t position = begin; position < end; ++position)
      if (walk_.step(order()[position], kAbove, down, next)) row(next);
    complete_layer(end);
    return end;
  }

  // Completes a layer. `begin` is the index of the first visited cell of the layer. Visits the rows
  // beside visited cells of the layer until no unvisited row is found.
  void complete_layer(std::uint64_t begin) {
    std::uint64_t scan = begin, scan_back = begin;
    Step next;
    for (;;) {
      if (scan < order().size()) {
        if (walk_.step(order()[scan++], kBeside, false, next)) row(next);
      } else if (scan_back < order().size()) {
        const std::uint32_t cell = order()[scan_back++];
        if (walk_.step(cell, kBeside, true, next)) row(next);
        for (const bool back : {false, true})
          if (walk_.step(cell, kAhead, back, next)) row(next);
      } else {
        return;
      }
    }
  }

  void row(const Step& seed) {
    Step current = walk_.farthest(seed, kAhead, true);
    do walk_.visit(current.cell, current.frame);
    while (walk_.step(Step(current), kAhead, false, current));
  }

  Traversal walk_;
};

}  // namespace

CellList swept_order(const CellGraph& graph, std::size_t layers_along, Spool* spool) {
  return Sweep(graph, layers_along, spool).take();
}

CellList breadth_first_order(const CellGraph& graph, Spool* spool) {
  Traversal walk(graph, spool);
  for_each_component(graph, walk, 2, spool, [&](std::uint32_t cell, const Frame& frame) {
    std::uint64_t scan = walk.order().size();
    walk.visit(cell, frame);
    Traversal::Step next;
    for (; scan < walk.order().size(); ++scan)
      for (const bool back : {false, true})
        for (const std::size_t axis : {kAhead, kBeside, kAbove})
          if (walk.step(walk.order()[scan], axis, back, next)) walk.visit(next.cell, next.frame);
  });
  return std::move(walk.order());
}

CellList enclosed_first_order(const CellGraph& graph, Spool* spool) {
  Traversal walk(graph, spool);
  BigArray<std::uint8_t> shared(spool, graph.cells().size());
  // waiting[n] lists unvisited cells that share n faces with visited cells. When a cell is added to
  // another list because its n has changed, its old entry is not removed.
  std::vector<BigArray<CellFace>> waiting;
  for (int faces = 0; faces <= 6; ++faces) waiting.emplace_back(spool);
  const auto come = [&](std::uint32_t cell, const Frame& frame) {
    walk.visit(cell, frame);
    for (const bool back : {true, false})
      for (const std::size_t axis : {kAbove, kBeside, kAhead}) {
        const std::uint32_t face = frame[axis] ^ (back ? 1u : 0u);
        const CellFace to = graph.across(cell, face);
        if (!to || walk.visited(to.cell())) continue;
        const auto faces = static_cast<std::uint8_t>(shared[to.cell()] + 1);
        shared.set(to.cell(), faces);
        waiting[faces].push_back(to);
      }
  };
  for_each_component(graph, walk, 2, spool, [&](std::uint32_t first, const Frame& frame) {
    come(first, frame);
    for (;;) {
      std::size_t most = 6;
      while (most > 0 && waiting[most].size() == 0) --most;
      if (most == 0) return;
      const CellFace next = waiting[most].pop_back();
      if (walk.visited(next.cell())) continue;
      const CellFace from = graph.across(next.cell(), next.face());
      come(next.cell(), graph.carried(from.cell(), walk.frame(from.cell()), from.face(), next));
    }
  });
  return std::move(walk.order());
}

CellList with_others_in_place(const Cells& cells, CellList hexahedra, Spool* spool,
                              std::size_t sort_bytes) {
  if (hexahedra.size() == cells.size()) return hexahedra;
  // For each vertex, 1 plus the index in `hexahedra` of the first hexahedron that uses it, or 0 if
  // no hexahedron uses it.
  BigArray<std::uint32_t> birth(spool, cells.vertices());
  for (std::uint64_t position = 0; position < hexahedra.size(); ++position)
    for (const std::uint32_t v : cells.cell(hexahedra[position]))
      if (birth[v] == 0) birth.set(v, static_cast<std::uint32_t>(position + 1));
  // Sorts the cells that are not hexahedra by the hexahedron after which they are inserted. Cells
  // that are inserted after the same hexahedron stay in the mesh's order. Cells with a vertex that
  // no hexahedron uses come last.
  constexpr std::uint32_t kNever = ~std::uint32_t{0};
  ExternalSorter others(spool != nullptr ? spool->directory() : std::string(), sizeof kNever,
                        spool != nullptr ? sort_bytes : std::numeric_limits<std::size_t>::max());
  for (std::uint32_t cell = 0; cell < cells.size(); ++cell) {
    if (cells.is_hexahedron(cell)) continue;
    std::uint32_t last = 0;
    for (const std::uint32_t v : cells.cell(cell)) last = std::max(last, birth[v] - 1);
    others.add(std::uint64_t{last} << 32 | cells.number_of(cell),
               reinterpret_cast<const std::byte*>(&cell));
  }
  CellList order(spool);
  order.reserve(cells.size());
  std::uint64_t key;
  const std::byte* record;
  bool more = others.next(key, record);
  const auto take_other = [&] {
    std::uint32_t cell;
    std::memcpy(&cell, record, sizeof cell);
    order.push_back(cell);
    more = others.next(key, record);
  };
  for (std::uint64_t position = 0; position < hexahedra.size(); ++position) {
    order.push_back(hexahedra[position]);
    while (more && key >> 32 == position) take_other();
  }
  while (more) take_other();
  return order;
}

}  // namespace shm::converters
