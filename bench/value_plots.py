"""Draws compression ratio against speed, as SVG and PNG: for coordinates and fields of bench/values, and for other
benchmarks."""
import statistics

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

OURS, DICTIONARY, FLOATS = "#c8102e", "#5f6b76", "#1f6fb4"
# Possible positions of a label relative to its mark: offset to the right and upwards in points, and horizontal and
# vertical alignment.
PLACES = [(7, 0, "left", "center"), (-7, 0, "right", "center"), (0, 7, "center", "bottom"),
          (0, -7, "center", "top"), (6, 6, "left", "bottom"), (6, -6, "left", "top"),
          (-6, 6, "right", "bottom"), (-6, -6, "right", "top"), (10, 13, "left", "bottom"),
          (10, -13, "left", "top"), (-10, 13, "right", "bottom"), (-10, -13, "right", "top")]
STYLE = {"svg.hashsalt": "shm", "font.size": 10, "axes.spines.top": False,
         "axes.spines.right": False, "axes.edgecolor": "#888888", "xtick.color": "#444444",
         "ytick.color": "#444444"}


def colour(coder):
    if coder.startswith("shm"):
        return OURS
    return FLOATS if coder == "fpzip" else DICTIONARY


def reached(rows, key):
    """Returns a dict that maps each coder to a pair: its MB/s across all rows, and the geometric mean of its ratios.
    Coders that do not have a row for every subject are omitted."""
    subjects = {row["subject"] for row in rows}
    found = {}
    for coder in dict.fromkeys(row["coder"] for row in rows):
        its = [row for row in rows if row["coder"] == coder]
        if len(its) == len(subjects):
            found[coder] = (sum(row["raw_bytes"] for row in its) / 1e6
                            / max(sum(row[key] for row in its), 1e-9),
                            statistics.geometric_mean(row["ratio"] for row in its))
    return found


def put_labels(figure, axes, points):
    """Positions each label so that, if possible, it covers no mark and no other label."""
    renderer = figure.canvas.get_renderer()
    marks = [axes.transData.transform(place) for place in points.values()]
    taken = []

    def cost(box):
        covered = sum(box.x0 - 5 < x < box.x1 + 5 and box.y0 - 5 < y < box.y1 + 5
                      for x, y in marks)
        crossed = sum(box.overlaps(other) for other in taken)
        outside = not (axes.bbox.x0 <= box.x0 and box.x1 <= axes.bbox.x1)
        return 3 * crossed + 2 * covered + 4 * outside

    for coder, place in points.items():
        tried = []
        for order, (right, up, across, along) in enumerate(PLACES):
            label = axes.annotate(coder, place, (right, up), textcoords="offset points", ha=across,
                                  va=along, color=colour(coder), fontsize=9)
            box = label.get_window_extent(renderer)
            tried.append((cost(box), order, label, box))
        tried.sort(key=lambda one: one[:2])
        taken.append(tried[0][3])
        for _, _, label, _ in tried[1:]:
            label.remove()


def round_numbers(low, high):
    if high > 100 * low:
        digits = (1, 3)
    else:
        digits = (1, 2, 5) if high > 10 * low else (1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8)
    steps = [m * 10**e for e in range(-3, 7) for m in digits]
    return [n for n in steps if low <= n <= high]


def panel(axes, points, limits, title):
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(*limits[0])
    axes.set_ylim(*limits[1])
    for axis, (low, high) in ((axes.xaxis, limits[0]), (axes.yaxis, limits[1])):
        axis.set_major_locator(FixedLocator(round_numbers(low, high)))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.grid(True, color="#e4e4e4", linewidth=.8)
    axes.set_axisbelow(True)
    ours = [points[coder] for coder in points if coder.startswith("shm")]
    axes.plot(*zip(*sorted(ours)), color=OURS, linewidth=1.2, alpha=.5)
    for coder, place in points.items():
        axes.plot(*place, "o", color=colour(coder), markersize=6)
    axes.set_title(title, fontsize=11, loc="left")
    axes.set_xlabel("MB/s of processor time, one thread")


def figure_of(rows, title, path):
    both = {"encode": reached(rows, "encode_s"), "decode": reached(rows, "decode_s")}
    x, y = zip(*(place for points in both.values() for place in points.values()))
    limits = (min(x) / 2, max(x) * 2), (min(min(y) / 1.1, .95), max(y) * 1.25)
    figure, panels = plt.subplots(1, 2, figsize=(10, 4.4), sharey=True)
    for axes, (name, points) in zip(panels, both.items()):
        panel(axes, points, limits, name)
    panels[0].set_ylabel("times smaller (geometric mean)")
    figure.suptitle(title, fontsize=12, x=.01, ha="left")
    figure.tight_layout()
    figure.canvas.draw()
    for axes, points in zip(panels, both.values()):
        put_labels(figure, axes, points)
    figure.savefig(path.with_suffix(".svg"), metadata={"Date": None})
    figure.savefig(path.with_suffix(".png"), dpi=110)
    plt.close(figure)


def draw_one(rows, title, path):
    """Draws one figure. `path` is the path of the files without extension."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with plt.rc_context(STYLE):
        figure_of(rows, title, path)


def draw(rows, folder):
    for table, what in (("coordinates", "Coordinates, lossless"),
                        ("fields", "Fields of floating-point numbers, lossless")):
        its = [row for row in rows if row["table"] == table and "integers" not in row["group"]]
        if its:
            subjects = len({row["subject"] for row in its})
            draw_one(its, f"{what}: {subjects} arrays of bench/values", folder / table)
