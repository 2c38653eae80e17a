"""Generates source files for bench/whole, by family. The output is deterministic.

    bench/whole_files.py FOLDER [FAMILY ...]     writes the files, with a folder for each family

    discontinuous   meshes in which no two cells share a node, as spectral and discontinuous Galerkin codes write
    symmetric       meshes and solutions mirrored about x = 0: exactly, up to rounding, or with both halves numbered
                    in the same order

    extruded        solutions constant along z, numbered layer by layer or column by column
    periodic        solutions with four identical periods along x
    tiny            meshes of 1 to 10,000 hexahedra with up to 50 sets and 3 arrays, as Exodus, VTK text and Gmsh
    polyhedra       truncated octahedra and hexagonal prisms, as VTU and Exodus NFACED; polygons, as Exodus NSIDED

Repeated values are exactly equal, including their noise, except in files named "rounded". A dictionary compressor finds
such repetitions, but a prediction from neighbours does not.
"""
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Callable

import numpy as np

import meshes
from mesh_writers import (HEX_SIDES, VTK_POLYGON, VTK_POLYHEDRON, Exodus, write_ascii_vtk, write_msh,
                          write_vtu)

# Corners (x, y) of a hexagon. The unit of x is half its width; the unit of y is half the length of a side.
HEXAGON = [(0, -2), (1, -1), (1, 1), (0, 2), (-1, 1), (-1, -1)]
NOISE = 1e-5  # amplitude of the noise in a field, relative to the magnitude of the field
STEP_SIZES = [(1, (20, 18, 16), 8, 3), (2, (20, 18, 16), 6, 3), (11, (16, 12, 10), 5, 2),
              # each entry: number of steps, cells along each axis, number of nodal variables, number of cell variables
              (100, (12, 6, 6), 4, 2)]
NODE_VARIABLES = ("disp_x", "disp_y", "temp", "pressure", "vel_x", "vel_y", "vel_z", "concentration")
CELL_VARIABLES = ("stress_xx", "von_mises", "damage")
ODD = ("disp_x", "vel_x")  # variables whose sign changes if the mesh is mirrored
TINY_CELLS = {1: (1, 1, 1), 8: (2, 2, 2), 27: (3, 3, 3), 192: (8, 6, 4), 1000: (10, 10, 10),
              10000: (25, 20, 20)}
SIDE_NAMES = ("front", "right", "back", "left", "bottom", "top")
MESHER_QA = [["cubit", "13.2", "05/14/2024", "09:12:40"]]
SOLVER_QA = [*MESHER_QA, ["solver", "2.7.1", "05/14/2024", "10:31:07"]]
DECK = """\
# heat in a block
begin mesh
  file       = block.g
  blocks     = block_1
end
begin material steel
  density      = 7850.0
  conductivity = 43.0
  specific_heat = 490.0
end
begin boundary
  temperature left  = 300.0
  flux        right = 1200.0
end
begin solve
  method    = implicit_euler
  time_step = 0.1
  end_time  = 10.0
  tolerance = 1.0e-8
end
begin output
  file      = block.e
  variables = temperature material heat_flux
end""".splitlines()


@dataclass
class Source:
    family: str
    name: str
    cells: int
    steps: int
    write: Callable[[Path], None]


class Waves:
    """A smooth field that moves: the mean of `count` random waves."""

    def __init__(self, random, count=10):
        self.vectors = random.normal(size=(count, 3)) * 4
        self.phases = random.random(count) * 2 * np.pi
        self.speeds = random.normal(size=count)
        self.mean = random.random() * 3

    def at(self, places, time):
        waves = np.cos(places @ self.vectors.T + self.phases + self.speeds * time)
        return self.mean + waves.sum(axis=1) / len(self.phases)


# ---- Discontinuous meshes

def curved_block(cells):
    """Returns the points and corners of a curved block of nx * ny * nz hexahedra."""
    nx, ny, nz = cells
    z, y, x = np.meshgrid(*(np.arange(n + 1) / nx for n in (nz, ny, nx)), indexing="ij")
    x, y, z = x.ravel(), y.ravel(), z.ravel()
    points = np.stack([x + .05 * np.sin(5 * y + 3 * z), y + .06 * np.sin(4 * x + 2 * z),
                       z + .04 * np.cos(3 * x + 5 * y)], 1)
    return points, meshes.lattice(nx, ny, nz)


def broken_arrays(points, corners, time=0):
    """Returns three point fields and a cell field. Two of the point fields have equal values on coincident nodes."""
    random = np.random.default_rng(5)
    waves = [Waves(random) for _ in range(3)]
    random = np.random.default_rng([6, int(time * 10)])

    def noisy(which, places):
        return waves[which].at(places, time) + NOISE * random.normal(size=len(places))

    broken = corners.ravel()
    jumps = noisy(2, points[broken]) + .01 * np.repeat(random.normal(size=len(corners)), 8)
    return ({"velocity": noisy(0, points)[broken], "pressure": noisy(1, points)[broken],
             "indicator": jumps}, {"error": noisy(2, points[corners].mean(axis=1))})


def discontinuous():
    for count, cells in ((100, (5, 5, 4)), (1000, (10, 10, 10)), (10000, (25, 20, 20))):
        for steps in (0, 1) + ((11,) if count == 1000 else ()):
            kind = ("mesh", "fields")[steps > 0] + (f"_steps{steps}" if steps > 1 else "")
            yield Source("discontinuous", f"{kind}_{count}.e", count, steps,
                         lambda path, cells=cells, steps=steps: write_broken_exodus(path, cells, steps))
            if steps <= 1:
                yield Source("discontinuous", f"{kind}_{count}.vtk", count, steps,
                             lambda path, cells=cells, steps=steps: write_broken_vtk(path, cells, steps))
    yield Source("discontinuous", "mesh_shuffled_1000.e", 1000, 0,
                 lambda path: write_broken_exodus(path, (10, 10, 10), 0, shuffled=True))
    yield Source("discontinuous", "mesh_float32_1000.vtk", 1000, 0,
                 lambda path: write_broken_vtk(path, (10, 10, 10), 0, np.float32))


def write_broken_exodus(path, cells, steps, shuffled=False):
    points, corners = curved_block(cells)
    if shuffled:
        corners = np.random.default_rng(3).permutation(corners)
    own = np.arange(corners.size).reshape(-1, 8)
    times = [step / 10 for step in range(steps)]
    names = broken_arrays(points, corners) if steps else ((), ())
    file = Exodus(path, "discontinuous", points[corners.ravel()], [(1, "fluid", own)], times=times,
                  node_names=list(names[0]), cell_names=list(names[1]), qa=MESHER_QA)
    for step, time in enumerate(times):
        file.put_step(step, *broken_arrays(points, corners, time))
    file.close()


def write_broken_vtk(path, cells, steps, kind=np.float64):
    points, corners = curved_block(cells)
    own = np.arange(corners.size, dtype=np.int32).reshape(-1, 8)
    arrays = broken_arrays(points, corners) if steps else ({}, {})
    meshes.write_vtk(path, points[corners.ravel()].astype(kind), own, *arrays)


# ---- Solutions that repeat

@dataclass
class Repeating:
    """A mesh whose values repeat. For each node and cell, node_like and cell_like contain the number of the node or
    cell that has the same values."""
    points: np.ndarray
    corners: np.ndarray
    node_like: np.ndarray
    cell_like: np.ndarray
    # For each node: the sign by which the variables in ODD are multiplied.
    node_sign: np.ndarray
    # Mask of the nodes whose values are repeated except for their last bits; None: no nodes.
    rounded: np.ndarray = None


def lattice_indices(cells):
    """Yields the lattice indices (i, j, k) of all nodes, and then those of all cells; i varies fastest."""
    for more in (1, 0):
        k, j, i = np.meshgrid(*(np.arange(n + more) for n in cells[::-1]), indexing="ij")
        yield i.ravel(), j.ravel(), k.ravel()


def mirrored(cells, rounded=False, copied=False):
    nx, ny, _ = cells
    half = nx // 2
    (i, j, k), (ci, cj, ck) = lattice_indices(cells)
    away, side = abs(i - half), np.sign(i - half)
    x = (away / half) ** 1.2
    points = np.stack([side * (x + .05 * np.sin(3 * x + j)), j / ny + .1 * np.cos(2 * x) * k / 7,
                       k / 9 + .05 * np.sin(4 * x) * j / ny], 1)
    points[away == 0, 0] = 0
    at = (nx + 1) * (j + (ny + 1) * k)
    cell_at = nx * (cj + ny * ck)
    mesh = Repeating(points, meshes.lattice(*cells), at + half + away,
                     cell_at + np.where(ci < half, nx - 1 - ci, ci), side)
    if rounded:
        mesh.rounded = i < half
    if copied:  # the nodes at x >= 0 come first, then their mirror images in the same order
        nodes = np.concatenate([np.flatnonzero(i >= half), mesh_copy(i, half, at)])
        order = np.concatenate([np.flatnonzero(ci >= half), nx - 1 - ci[ci >= half] + cell_at[ci >= half]])
        # Mirrored cells would have negative volumes, so the order of the nodes around their faces is reversed.
        mesh.corners[ci < half] = mesh.corners[ci < half][:, [1, 2, 3, 0, 5, 6, 7, 4]]
        renumber(mesh, nodes, order)
    return mesh


def mesh_copy(i, half, at):
    """Returns the nodes at x < 0, in the order of their mirror images."""
    ahead = np.flatnonzero(i > half)
    return at[ahead] + 2 * half - i[ahead]


def renumber(mesh, nodes, cells):
    """Renumbers the nodes and cells of a mesh. `nodes` and `cells` contain the old number for each new number."""
    new_node, new_cell = np.argsort(nodes), np.argsort(cells)
    mesh.points, mesh.node_sign = mesh.points[nodes], mesh.node_sign[nodes]
    mesh.node_like, mesh.cell_like = new_node[mesh.node_like[nodes]], new_cell[mesh.cell_like[cells]]
    mesh.corners = new_node[mesh.corners[cells]]


def extruded(cells, columns=False):
    nx, ny, nz = cells
    (i, j, k), (ci, cj, ck) = lattice_indices(cells)
    angle = 2 * i / nx + .02 * np.sin(9 * i + 5 * j)
    radius = 1 + j / ny + .01 * np.cos(7 * i + 11 * j)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), .05 * k], 1)
    mesh = Repeating(points, meshes.lattice(*cells), i + (nx + 1) * j, ci + nx * cj,
                     np.ones(len(points), int))
    if columns:
        renumber(mesh, np.lexsort((k, i, j)), np.lexsort((ck, ci, cj)))
    return mesh


def periodic(cells, periods=4):
    nx, ny, _ = cells
    period = nx // periods
    (i, j, k), (ci, cj, ck) = lattice_indices(cells)
    of = i % period
    phase = 2 * np.pi * of / period
    points = np.stack([i // period + of / period + .03 * np.sin(phase + j), j / ny + .02 * np.cos(phase + k),
                       k / 9 + .02 * np.sin(phase) * j], 1)
    return Repeating(points, meshes.lattice(*cells), of + (nx + 1) * (j + (ny + 1) * k),
                     ci % period + nx * (cj + ny * ck), np.ones(len(points), int))


def repeated_step(mesh, names, waves, time, step):
    """Returns the values of all variables at one time step. Values are first computed for all nodes and cells. Then the
    value at each repeated node or cell is replaced with that of the node or cell that it repeats."""
    random = np.random.default_rng([9, step])
    places = mesh.points, mesh.points[mesh.corners].mean(axis=1)
    found = []
    for kind, like in enumerate((mesh.node_like, mesh.cell_like)):
        values = {}
        for name in names[kind]:
            made = waves[name].at(places[kind], time) + NOISE * random.normal(size=len(places[kind]))
            values[name] = made[like]
            if kind == 0 and mesh.rounded is not None:
                last = random.integers(-2, 3, len(made)) * np.finfo(float).eps
                values[name] = np.where(mesh.rounded, values[name] * (1 + last), values[name])
            if kind == 0 and name in ODD:
                values[name] = values[name] * mesh.node_sign
        found.append(values)
    return found


def write_repeating(path, make, steps, cells, counts):
    mesh = make(cells)
    names = NODE_VARIABLES[:counts[0]], CELL_VARIABLES[:counts[1]]
    random = np.random.default_rng(8)
    waves = {name: Waves(random) for some in names for name in some}
    times = [step / 20 for step in range(steps)]
    file = Exodus(path, "repeating", mesh.points, [(1, "solid", mesh.corners)], times=times,
                  node_names=names[0], cell_names=names[1], qa=SOLVER_QA, maps=True)
    for step, time in enumerate(times):
        file.put_step(step, *repeated_step(mesh, names, waves, time, step))
    file.close()


REPEATING = [("symmetric", "exact", mirrored),
             ("symmetric", "rounded", lambda cells: mirrored(cells, rounded=True)),
             ("symmetric", "copied", lambda cells: mirrored(cells, copied=True)),
             ("extruded", "layers", extruded),
             ("extruded", "columns", lambda cells: extruded(cells, columns=True)),
             ("periodic", "shifted", periodic)]


def repeating():
    for family, kind, make in REPEATING:
        for steps, cells, *counts in STEP_SIZES:
            yield Source(family, f"{kind}_steps{steps}.e", int(np.prod(cells)), steps,
                         lambda path, make=make, of=(steps, cells, counts): write_repeating(path, make, *of))


# ---- Tiny files

def box(cells):
    (i, j, k), _ = lattice_indices(cells)
    return np.stack([i, j, k], 1) * .1, meshes.lattice(*cells)


def sides_of_box(cells):
    """Returns the numbers (from 0) of the cells at each of the six sides of a box."""
    _, (i, j, k) = lattice_indices(cells)
    nx, ny, nz = cells
    return [np.flatnonzero(at) for at in (j == 0, i == nx - 1, j == ny - 1, i == 0, k == 0, k == nz - 1)]


def some_sets(cells, corners, count):
    """Returns node sets and side sets, `count` sets in total. The first sets are whole sides of a box; all later sets
    are parts of its sides."""
    sides = sides_of_box(cells)
    node_sets, side_sets = [], []
    for number in range(count):
        side, patch = number // 2 % 6, number // 12
        its = sides[side]
        size = len(its) if patch == 0 else -(-len(its) // 3)
        begin = 0 if patch == 0 else (patch - 1) * len(its) // 5 % max(1, len(its) - size + 1)
        chosen = its[begin:begin + size]
        name = SIDE_NAMES[side] + (f"_patch_{patch}" if patch else "")
        if number % 2 == 0:
            side_sets.append((name, chosen, np.full(len(chosen), side)))
        else:
            node_sets.append((f"{name}_nodes", np.unique(corners[chosen][:, HEX_SIDES[side]])))
    return node_sets, side_sets


def tiny_arrays(points, corners, time=0):
    middle = points[corners].mean(axis=1)
    x, y, z = points.T
    return ({"temperature": 300 + 40 * np.sin(3 * x + time) * np.cos(2 * y) + 5 * z**2},
            {"material": 1. + (middle[:, 2] > middle[:, 2].mean()),
             "heat_flux": 1200 * np.exp(-middle[:, 0] - time) * (1 + .1 * middle[:, 1]**2)})


def write_tiny_exodus(path, cells, sets, steps):
    points, corners = box(cells)
    node_sets, side_sets = some_sets(cells, corners, sets)
    names = tiny_arrays(points, corners) if steps else ((), ())
    times = [step / 10 for step in range(steps)]
    file = Exodus(path, path.name, points, [(1, "block_1", corners)], node_sets=node_sets,
                  side_sets=side_sets, times=times, node_names=list(names[0]), cell_names=list(names[1]),
                  qa=SOLVER_QA if steps else MESHER_QA, info=DECK if steps else (), maps=True,
                  factors=sets == 10, kind="NETCDF3_CLASSIC")
    for step, time in enumerate(times):
        file.put_step(step, *tiny_arrays(points, corners, time))
    file.close()


def write_tiny_vtk(path, cells, arrays):
    points, corners = box(cells)
    values = tiny_arrays(points, corners) if arrays else ({}, {})
    if arrays:
        values[1]["material"] = values[1]["material"].astype(np.int32)
    write_ascii_vtk(path, "a mesh", points, corners, *values)


def write_tiny_msh(path, cells):
    points, corners = box(cells)
    sides = [(SIDE_NAMES[side], corners[its][:, HEX_SIDES[side]])
             for side, its in enumerate(sides_of_box(cells))]
    write_msh(path, points, corners, sides)


def tiny():
    for count, cells in TINY_CELLS.items():
        for sets in (0, 3, 10, 50):
            for arrays in (0, 3):
                yield Source("tiny", f"hex{count}_sets{sets}_arrays{arrays}.e", count, arrays // 3,
                             lambda path, of=(cells, sets, arrays // 3): write_tiny_exodus(path, *of))
    yield Source("tiny", "hex27_sets3_arrays3_steps11.e", 27, 11,
                 lambda path: write_tiny_exodus(path, TINY_CELLS[27], 3, 11))
    for count, arrays in ((1, 0), (27, 3), (1000, 3)):
        yield Source("tiny", f"hex{count}_arrays{arrays}.vtk", count, 0,
                     lambda path, of=(TINY_CELLS[count], arrays): write_tiny_vtk(path, *of))
    for count in (1, 27, 1000):
        yield Source("tiny", f"hex{count}_groups6.msh", count, 0,
                     lambda path, cells=TINY_CELLS[count]: write_tiny_msh(path, cells))


# ---- Polyhedra and polygons

def around(nodes, normal):
    """Sorts the nodes (rows) of a flat face by their angle around its normal."""
    middle = nodes.mean(axis=0)
    first = nodes[0] - middle
    second = np.cross(normal, first)
    angles = [np.arctan2((node - middle) @ second / np.linalg.norm(second),
                         (node - middle) @ first / np.linalg.norm(first)) for node in nodes]
    return [nodes[at] for at in np.argsort(np.round(angles, 9), kind="stable")]


def truncated_octahedron():
    """Returns the faces of a truncated octahedron. Each face is a list of the coordinates of its nodes, in lattice
    steps."""
    signed = {tuple(np.array(order) * signs) for order in
              ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0))
              for signs in np.ndindex(2, 2, 2) for signs in [2 * np.array(signs) - 1]}
    nodes = np.array(sorted(signed))
    faces = []
    for axis in range(3):
        for sign in (-1, 1):
            faces.append(around(nodes[nodes[:, axis] == 2 * sign], sign * np.eye(3)[axis]))
    for signs in np.ndindex(2, 2, 2):
        normal = 2 * np.array(signs) - 1
        faces.append(around(nodes[nodes @ normal == 3], normal))
    return faces


def cells_of_lattice(shape, centres):
    """Places a copy of `shape` at each of `centres`. Returns points (in lattice steps) and, for each cell, the node
    numbers of each of its faces, which are oriented outwards."""
    number, cells = {}, []
    for centre in centres:
        cells.append([np.array([number.setdefault(tuple(node + centre), len(number)) for node in face])
                      for face in shape])
    return np.array(list(number), float), cells


def octahedra(count):
    side = max(1, round((count / 4)**(1 / 3)))
    places = [4 * np.array([i, j, k]) + 2 * half for k in range(count) for half in (0, 1)
              for j in range(side) for i in range(2 * side) if k * 4 * side * side < count]
    points, cells = cells_of_lattice(truncated_octahedron(), places[:count])
    random = np.random.default_rng(4)
    points += .1 * random.random(points.shape)  # random displacements, so that no two edges are equal
    return .25 * points, cells


def honeycomb(columns, rows):
    return [(2 * q + r % 2, 3 * r) for r in range(rows) for q in range(columns)]


def to_plane(points):
    return points * (3**.5 / 2, .5) + .05 * np.sin(points[:, ::-1] * .7)


def prisms(count):
    side = max(1, round((count / 2)**(1 / 3)))
    low, high = [(x, y, 0) for x, y in HEXAGON], [(x, y, 1) for x, y in HEXAGON]
    shape = [np.array(low[::-1]), np.array(high)] + [
        np.array([low[at - 1], low[at], high[at], high[at - 1]]) for at in range(6)]
    centres = [np.array([x, y, k]) for k in range(-(-count // (2 * side * side)))
               for x, y in honeycomb(2 * side, side)]
    points, cells = cells_of_lattice(shape, centres[:count])
    return np.column_stack([to_plane(points[:, :2]), .8 * points[:, 2] + .02 * np.sin(points[:, 0])]), cells


def polygons(count):
    """Returns points and cells of a honeycomb. Among every three hexagons, one is unchanged, one is cut into two
    quadrilaterals, and one is cut into a triangle and a pentagon."""
    number, cells = {}, []
    for at, (x, y) in enumerate(honeycomb(max(1, round(count**.5)), count)):
        ring = np.array([number.setdefault((x + dx, y + dy), len(number)) for dx, dy in HEXAGON])
        cells += ([ring], [ring[:4], ring[[3, 4, 5, 0]]], [ring[:3], ring[[2, 3, 4, 5, 0]]])[at % 3]
        if len(cells) >= count:
            break
    flat = to_plane(np.array(list(number), float))
    cells = cells[:count]
    points = np.column_stack([flat, .1 * np.cos(flat[:, 0])])
    return points[:max(map(max, cells)) + 1], cells


def poly_arrays(points, middle):
    random = np.random.default_rng(2)
    return [{name: Waves(random).at(.2 * places, 0) + NOISE * random.normal(size=len(places))}
            for name, places in (("pressure", points), ("volume_fraction", middle))]


def write_polyhedra_vtu(path, make, count, form):
    points, cells = make(count)
    own = [np.unique(np.concatenate(faces)) for faces in cells]
    rows = [np.concatenate([[len(faces)], *([len(face), *face] for face in faces)]) for faces in cells]
    middle = np.array([points[some].mean(axis=0) for some in own])
    arrays = poly_arrays(points, middle) if count > 10 else ({}, {})
    write_vtu(path, points, own, VTK_POLYHEDRON, rows, *arrays, form=form)


def write_polyhedra_exodus(path, make, count):
    points, cells = make(count)
    number, faces, of_cells = {}, [], []
    for its in cells:
        of_cells.append(np.array([number.setdefault(tuple(sorted(face)), len(number)) for face in its]))
        for face, at in zip(its, of_cells[-1]):
            if at == len(faces):
                faces.append(face)
    middle = np.array([points[np.unique(np.concatenate(its))].mean(axis=0) for its in cells])
    write_stepless(path, points, [(1, "cells", of_cells)], middle, count > 10, faces)


def write_stepless(path, points, blocks, middle, with_arrays, faces=()):
    arrays = poly_arrays(points, middle) if with_arrays else ({}, {})
    file = Exodus(path, "polyhedra", points, blocks, faces, times=[0.] if with_arrays else (),
                  node_names=list(arrays[0]), cell_names=list(arrays[1]), qa=MESHER_QA)
    if with_arrays:
        file.put_step(0, *arrays)
    file.close()


def write_polygons_exodus(path, count):
    points, cells = polygons(count)
    middle = np.array([points[cell].mean(axis=0) for cell in cells])
    write_stepless(path, points, [(1, "cells", cells)], middle, count > 10)


def write_polygons_vtu(path, count, form):
    points, cells = polygons(count)
    write_vtu(path, points, cells, VTK_POLYGON, form=form)


def polyhedra():
    for count, form in ((10, "ascii"), (500, "raw"), (500, "zlib"), (5000, "raw")):
        for name, make in (("octahedra", octahedra), ("prisms", prisms)):
            if form != "zlib":
                yield Source("polyhedra", f"{name}_{count}.e", count, 0,
                             lambda path, of=(make, count): write_polyhedra_exodus(path, *of))
            yield Source("polyhedra", f"{name}_{count}_{form}.vtu", count, 0,
                         lambda path, of=(make, count, form): write_polyhedra_vtu(path, *of))
        if form != "zlib":
            yield Source("polyhedra", f"polygons_{count}.e", count, 0,
                         lambda path, count=count: write_polygons_exodus(path, count))
            yield Source("polyhedra", f"polygons_{count}_{form}.vtu", count, 0,
                         lambda path, of=(count, form): write_polygons_vtu(path, *of))


def sources():
    """Returns a Source for each file. The files themselves are written by write()."""
    return [source for some in (discontinuous, repeating, tiny, polyhedra) for source in some()]


def write(some, folder):
    """Writes the files, and returns their paths."""
    paths = []
    for source in some:
        path = folder / source.family / source.name
        path.parent.mkdir(parents=True, exist_ok=True)
        source.write(path)
        paths.append(path)
    return paths


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    write([source for source in sources() if not sys.argv[2:] or source.family in sys.argv[2:]],
          Path(sys.argv[1]))
