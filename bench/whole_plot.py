"""Draws each file of bench/whole or bench/results as a dot. The vertical axis is the size of .shm divided by the smallest size of the
other compressors; the horizontal axis is the size of the source file."""
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from value_plots import FLOATS, OURS, STYLE, round_numbers

COLOURS = {"corpus": OURS, "generated": FLOATS, "files": OURS, "few elements": FLOATS, "hard to predict": "#e08a00",
           "tests/steps/results": "#222222"}
SIZES = [(1000**3, "GB"), (1000**2, "MB"), (1000, "kB"), (1, "B")]


def size_text(size, _):
    unit, name = next(one for one in SIZES if size >= one[0])
    return f"{size / unit:g} {name}"


def draw(collections, folder, name, title, axis_title):
    """Draws name.svg and name.png. `collections` maps the name of a collection to a list with a pair for each file: the size of the
    source file in bytes, and the .shm size divided by the smallest size of the other compressors."""
    folder.mkdir(parents=True, exist_ok=True)
    sizes, ratios = zip(*(dot for dots in collections.values() for dot in dots))
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(10, 4.8))
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlim(min(sizes) / 1.5, max(sizes) * 1.5)
        axes.set_ylim(min(ratios) / 1.2, max(*ratios, 1) * 1.2)
        axes.xaxis.set_major_locator(FixedLocator([10**e for e in range(10)]))
        axes.yaxis.set_major_locator(FixedLocator(round_numbers(*axes.get_ylim())))
        for axis, form in ((axes.xaxis, size_text), (axes.yaxis, lambda value, _: f"{value:g}")):
            axis.set_minor_locator(NullLocator())
            axis.set_major_formatter(FuncFormatter(form))
            axis.grid(True, color="#e4e4e4", linewidth=.8)
        axes.set_axisbelow(True)
        axes.axhline(1, color="#444444", linewidth=1)
        for collection, dots in collections.items():
            axes.plot(*zip(*dots), "o", color=COLOURS[collection], markersize=5, alpha=.65, markeredgewidth=0,
                      label=f"{collection}, {len(dots)} files")
        axes.legend(frameon=False, loc="best")
        axes.set_xlabel("source file")
        axes.set_ylabel(axis_title)
        axes.set_title(title, fontsize=12, loc="left")
        figure.tight_layout()
        figure.savefig(folder / f"{name}.svg", metadata={"Date": None})
        figure.savefig(folder / f"{name}.png", dpi=110)
        plt.close(figure)
