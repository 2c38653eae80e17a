"""Generates result files for bench/results: Exodus files with few elements, and many arrays or time steps; and files of
14,000 hexahedra with one array whose values are hard to predict (HARD).

    bench/result_files.py FOLDER [--count N] [--seed S]

Each file has 1 to 1,000 cells, 1 to 300 arrays and 1 to 500 time steps. All three are drawn on a logarithmic scale; one
file in three has an extreme value of one or two of them. No file is larger than MOST bytes. The kind of mesh and the
kinds of arrays (KINDS) are drawn, too. The output is deterministic: a file depends only on the seed and its number.
"""
import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import meshes
from mesh_writers import Exodus

MOST = 20_000_000  # bytes of the values of a file
COUNT = 160
NAMES = ("temperature", "disp_x", "disp_y", "disp_z", "stress_xx", "stress_yy", "stress_zz", "stress_xy", "vonmises",
         "eqps", "pressure", "density", "phi", "flux_x", "flux_y", "status", "grain_id", "slip_resistance",
         "rotation", "energy", "c_h2o", "porosity", "saturation", "damage", "vel_x", "vel_y", "accl_x", "bounds")


class Places:
    """The elements for which an array has values, and the times of the steps."""

    def __init__(self, random, points, times):
        self.random, self.points, self.times = random, points, times
        self.shape = len(times), len(points)

    def wave(self, waves=4):
        """Returns a smooth field that moves. Shape: steps, elements."""
        total = np.zeros(self.shape)
        for _ in range(waves):
            vector = self.random.normal(size=3) * 3
            total += self.random.normal() * np.cos(self.points @ vector + self.random.random() * 7
                                                   + self.times[:, None] * self.random.normal() * 3)
        return total

    def noise(self):
        return self.random.normal(size=self.shape)

    def scale(self):
        return 10. ** self.random.integers(-6, 9)


def accumulated(at, _):
    """A quantity that only grows, such as a plastic strain. It is zero until a threshold is exceeded."""
    return np.maximum.accumulate(np.maximum(at.wave(), 0), axis=0) * at.scale()


def plateaus(at, _):
    """A field that changes only at some steps."""
    wave = at.wave() * at.scale()
    return wave[np.maximum.accumulate(np.where(at.random.random(at.shape[0]) < .15, np.arange(at.shape[0]), 0))]


def walk(at, _):
    """Independent random walks of all elements, as integrated quantities of single crystals."""
    return np.cumsum(at.noise(), axis=0) * at.scale()


def hardening(at, _):
    """A saturating curve of each element, with its own rate."""
    rate = 1 + at.random.random(at.shape[1])
    return at.scale() * (30 + 20 * (1 - np.exp(-np.outer(at.times, rate))))


def copied(at, earlier):
    return earlier[at.random.integers(len(earlier))].copy() if earlier else at.wave()


def negated(at, earlier):
    return -earlier[at.random.integers(len(earlier))] if earlier else at.wave()


def scaled(at, earlier):
    return 1.5 * earlier[at.random.integers(len(earlier))] if earlier else at.wave()


def invariant(_, earlier):
    """A norm of up to three earlier arrays, such as a von Mises stress."""
    return np.sqrt(sum(values ** 2 for values in earlier[-3:])) if earlier else np.zeros(1)


def with_fill(at, _):
    """A field that is undefined in some elements: a fill value marks these elements."""
    values = at.wave() * at.scale()
    values[:, at.random.random(at.shape[1]) < .3] = at.random.choice([9.969209968386869e36, -9999., np.nan])
    return values


def dying(at, _):
    """1 for each element that is alive. Elements die and stay dead."""
    return 1. * (at.random.random(at.shape[1]) * 1.5 > at.times[:, None])


def noisy(at, _):
    return at.wave() * at.scale() * (1 + 10. ** -at.random.integers(2, 15) * at.noise())


# Each kind of array: a function of the places and of the earlier arrays of the file at the same location. The result is
# broadcast to the shape (steps, elements).
KINDS = {
    "zeros": lambda at, _: np.zeros(at.shape),
    "constant": lambda at, _: np.full(at.shape, at.random.normal() * at.scale()),
    "fixed": lambda at, _: np.broadcast_to(at.wave()[:1] * at.scale(), at.shape),
    "uniform": lambda at, _: np.broadcast_to(at.wave()[:, :1] * at.scale(), at.shape),
    "ramp": lambda at, _: np.outer(at.times, np.full(at.shape[1], at.scale())),
    "smooth": lambda at, _: at.wave() * at.scale(),
    "single precision": lambda at, _: (at.wave() * at.scale()).astype("f4"),
    "noisy": noisy,
    "noise": lambda at, _: at.noise() * at.scale(),
    "decimals": lambda at, _: np.round(at.wave(), at.random.integers(1, 6)),
    "counter": lambda at, _: np.floor(np.abs(at.wave()) * 20),
    "accumulated": accumulated,
    "plateaus": plateaus,
    "walk": walk,
    "hardening": hardening,
    "copied": copied,
    "negated": negated,
    "scaled": scaled,
    "invariant": invariant,
    "fill": with_fill,
    "dying": dying,
    "multiples": lambda at, _: np.round(at.wave() * 2000) * .1 / 3,
    "rigid": lambda at, _: at.wave(1)[:1] + np.sin(at.times)[:, None],
}


@dataclass
class Source:
    name: str
    seed: tuple
    cells: int
    arrays: int
    steps: int

    def write(self, path):
        write(self, path)


def sources(count=COUNT, seed=1):
    random = np.random.default_rng([seed, 1000])
    made = []
    for number in range(count):
        sizes = [int(round(most ** random.random())) for most in (1000, 300, 500)]
        if number % 3 == 0:  # extreme values
            for which in random.choice(3, random.integers(1, 3), replace=False):
                sizes[which] = (1, (1000, 300, 500)[which])[random.integers(2)]
        cells, arrays, steps = sizes
        # A block of n cells has at most 4 (n + 1) points.
        steps = max(1, min(steps, int(MOST / (8 * arrays * 4 * (cells + 1)))))
        made.append(Source(f"{number:03}_{cells}cells_{arrays}arrays_{steps}steps", (seed, number), cells, arrays, steps))
    return made


def mesh_of(cells, random):
    """Returns the points and corners of a curved block of about `cells` hexahedra."""
    if random.random() < .3:  # a bar
        sizes = (cells, 1, 1)
    elif random.random() < .4:  # a plate
        side = max(1, int(cells ** .5))
        sizes = (side, max(1, cells // side), 1)
    else:
        side = max(1, int(cells ** (1 / 3)))
        sizes = (side, side, max(1, cells // side ** 2))
    z, y, x = (a.ravel() for a in np.meshgrid(*(np.arange(n + 1.) / max(sizes) for n in reversed(sizes)), indexing="ij"))
    points = np.stack([x + .05 * np.sin(5 * y + 3 * z), y + .06 * np.sin(4 * x + 2 * z), z + .04 * np.cos(3 * x)], 1)
    return points, meshes.lattice(*sizes)


def write(source, path):
    random = np.random.default_rng(source.seed)
    points, corners = mesh_of(source.cells, random)
    times = np.arange(source.steps) / max(1, source.steps - 1)
    if random.random() < .3:
        times = np.sort(random.random(source.steps))
    # A file has arrays of some kinds only.
    kinds = random.choice(list(KINDS), random.integers(1, 7), replace=False)
    of_points = random.choice([0, .5, 1], p=[.3, .5, .2])
    places = {"node": Places(random, points, times), "cell": Places(random, points[corners].mean(axis=1), times)}
    arrays = {"node": {}, "cell": {}}
    for number in range(source.arrays):
        where = "node" if random.random() < of_points else "cell"
        earlier = [values for values in arrays[where].values()]
        values = KINDS[random.choice(kinds)](places[where], earlier)
        name = NAMES[number % len(NAMES)] + (f"_{number // len(NAMES)}" if number >= len(NAMES) else "")
        arrays[where][name] = np.broadcast_to(values, places[where].shape)
    half = len(corners) // 2 if len(corners) > 4 and random.random() < .4 else 0
    blocks = [(1, "", corners[:half]), (2, "", corners[half:])] if half else [(1, "", corners)]
    file = Exodus(path, "results", points, blocks, times=times, node_names=list(arrays["node"]),
                  cell_names=list(arrays["cell"]), word=random.choice(["f8", "f4"], p=[.7, .3]))
    for step in range(source.steps):
        file.put_step(step, *({name: values[step] for name, values in arrays[where].items()} for where in ("node", "cell")))
    file.close()


def write_all(folder, count=COUNT, seed=1):
    folder.mkdir(parents=True, exist_ok=True)
    made = []
    for source in sources(count, seed):
        made.append(folder / f"{source.name}.e")
        source.write(made[-1])
    return made


# --- one array on many cells


def with_last_bits(values, most, random):
    """Changes each number other than zero by up to `most` units in the last place."""
    changes = random.integers(-most, most + 1, values.shape) * (values != 0)
    return (values.view("i8") + changes).view("f8")


def multiples(spread, factor, last_bits=0):
    """Returns a kind of array: integers times a factor, with an error in the last bits."""
    return lambda points, random, step: with_last_bits(np.round(random.normal(size=len(points)) * spread) * factor,
                                                       last_bits, random)


def round_off(points, random, step):
    """The gradient of a field that is constant except for rounding errors, times a conductivity."""
    field = 5 * (1 + 2.**-52 * np.round(random.normal(size=(len(points), 8))))
    return (field[:, [1, 2, 5, 6]].sum(1) - field[:, [0, 3, 4, 7]].sum(1)) * .25 * 24 * -58e6


def residual_of_waves(points, random, step):
    """Rounding errors of a computation that would be exact in real numbers."""
    wave = np.cos(points @ [3, 1, 2] + .1 * step) + np.cos(points @ [-2, 4, 1])
    return (((wave * (3.3 + step)) + 1.7) / (3.3 + step) - 1.7 / (3.3 + step) - wave) * 71600


def unchanged(smooth, change=None):
    """Returns a kind of array that is equal at all steps, or changes once."""
    def values(points, random, step):
        random = np.random.default_rng(3 if change is None or step < change else 4)
        noise = random.normal(size=len(points))
        return np.cos(points @ [3, 1, 2]) * (1 + 1e-9 * noise) if smooth else noise
    return values


def velocity(points, random, step):
    """A velocity on a mesh whose cells share no points, with jumps between the cells."""
    cells = np.repeat(random.normal(size=len(points) // 8), 8)
    return 10 + np.sin(points @ [5, 2, 3] - .2 * step) + 1e-3 * cells


# The files: the number of steps, whether cells share points, and the kind of array.
HARD = {
    "integers_times_c": (8, True, multiples(3, 2.**-52 * 1.2345e-3)),
    "many_integers_times_c": (8, True, multiples(300, 2.**-52 * 1.2345e-3)),
    "multiples_one_last_bit": (8, True, multiples(30, 1.2345e-3, 1)),
    "multiples_four_last_bits": (8, True, multiples(30, 1.2345e-3 * 2.**-7, 4)),
    "round_off_of_gradient": (8, True, round_off),
    "round_off_of_waves": (8, True, residual_of_waves),
    "unchanged_20_steps": (20, True, unchanged(False)),
    "unchanged_100_steps": (100, True, unchanged(False)),
    "unchanged_smooth": (20, True, unchanged(True)),
    "changed_once": (40, True, unchanged(False, 20)),
    "velocity_discontinuous": (4, False, velocity),
}


def write_hard(folder):
    """Writes the files of HARD. Returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    points, corners = mesh_of(24**3, np.random.default_rng(0))
    made = []
    for name, (steps, shares_points, values) in HARD.items():
        its, cells, places = points, corners, points[corners].mean(axis=1)
        if not shares_points:
            its = places = points[corners].reshape(-1, 3)
            cells = np.arange(len(its)).reshape(-1, 8)
        made.append(folder / f"{name}.e")
        kind = ("node_names", "cell_names")[shares_points]
        file = Exodus(made[-1], name, its, [(1, "", cells)], times=np.arange(steps) / 7, **{kind: ["v"]})
        random = np.random.default_rng(5)
        for step in range(steps):
            arrays = [{}, {}]
            arrays[shares_points] = {"v": values(places, random, step)}
            file.put_step(step, *arrays)
        file.close()
    return made


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=COUNT)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    write_all(options.folder, options.count, options.seed)
