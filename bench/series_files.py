"""Generates series of fields on a curved block of hexahedra, for bench/bounded: waves, heat, elastic and turbulence."""
import numpy as np

import meshes


def block(side):
    """Returns the points and corners of a curved block of side^3 hexahedra."""
    z, y, x = (a.ravel() for a in np.meshgrid(*(np.arange(side + 1.) / side,) * 3, indexing="ij"))
    points = np.stack([x + .05 * np.sin(5 * y + 3 * z), y + .06 * np.sin(4 * x + 2 * z), z + .04 * np.cos(3 * x)], 1)
    return points, meshes.lattice(side, side, side)


def directions(random, count):
    found = random.normal(size=(count, 3))
    return found / np.linalg.norm(found, axis=1)[:, None]


def waves(points, time, random):
    """Five travelling waves with lengths from a third of the block to a tenth of it."""
    total = np.zeros(len(points))
    for number, direction in enumerate(directions(random, 5)):
        vector = 2 * np.pi * direction * (3 + 1.7 * number)
        total += np.sin(points @ vector - time * (2 + number) * 2 + random.random() * 7) / (1 + number)
    return {"pressure": 1e5 + 400 * total, "density": 1.2 + .004 * total}


def heat(points, time, random):
    """A source that moves on a circle over a block with a linear gradient, and the flux in x."""
    centre = np.array([.5 + .3 * np.cos(2 * time), .5 + .3 * np.sin(2 * time), .9])
    distance = np.sum((points - centre) ** 2, axis=1)
    spot = sum(np.exp(-distance / width) for width in (.01, .04, .2))
    flux = sum(2 * (points[:, 0] - centre[0]) / width * np.exp(-distance / width) for width in (.01, .04, .2))
    return {"temperature": 293 + 20 * points[:, 2] + 400 * spot, "flux_x": -45 * flux}


def elastic(points, time, random):
    """Displacements of a pressure wave and a shear wave from a point, and a stress."""
    offset = points - [.2, .3, .1]
    radius = np.sqrt(np.sum(offset**2, axis=1)) + .02
    out = np.zeros((len(points), 3))
    stress = np.zeros(len(points))
    for speed, length, across in ((1., .08, False), (.58, .05, True)):
        phase = (radius - speed * (time + .15)) / length
        shape = (1 - 2 * phase**2) * np.exp(-phase**2) / (1 + 8 * radius)
        way = offset / radius[:, None]
        if across:
            way = np.cross(way, [0., 0., 1.])
        out += 1e-4 * shape[:, None] * way
        stress += 2e6 * phase * (3 - 2 * phase**2) * np.exp(-phase**2) / (1 + 8 * radius) * (1 - across)
    return {"disp_x": out[:, 0], "disp_z": out[:, 2], "stress_xx": stress}


def turbulence(points, time, random):
    """A sum of random modes with the spectrum of turbulence. Short modes change faster than long ones."""
    total = np.zeros(len(points))
    for number, direction in enumerate(directions(random, 60)):
        waves_per_side = 1.5 * 1.055**number
        speed = random.normal() * waves_per_side**(2 / 3) * 6
        total += waves_per_side**(-5 / 6) * np.sin(points @ (2 * np.pi * waves_per_side * direction) - speed * time
                                                   + random.random() * 7)
    return {"vel_x": 10 + 2 * total}


FAMILIES = {"waves": waves, "heat": heat, "elastic": elastic, "turbulence": turbulence}


def series(family, points, steps):
    """Returns a dict of arrays by name. Shape of each: steps, points."""
    found = [FAMILIES[family](points, .05 * step, np.random.default_rng(7)) for step in range(steps)]
    return {name: np.stack([values[name] for values in found]) for name in found[0]}
