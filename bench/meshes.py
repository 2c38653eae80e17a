"""Generates meshes and fields for the benchmarks as NumPy arrays, and writes VTK files. The results are
deterministic."""
import numpy as np

VTK_HEXAHEDRON = 12
VTK_TYPES = {"float32": "float", "float64": "double", "int32": "int"}


def big_endian(values):
    return np.ascontiguousarray(values).astype(values.dtype.newbyteorder(">")).tobytes()


def write_vtk(path, points, corners, point_arrays=None, cell_arrays=None):
    """Writes hexahedra. point_arrays and cell_arrays are the same as in write_cells()."""
    write_cells(path, points, [(VTK_HEXAHEDRON, corners)], point_arrays, cell_arrays)


def write_cells(path, points, cells, point_arrays=None, cell_arrays=None):
    """Writes binary legacy VTK 4.2. `cells` is a list of pairs: a VTK cell type, and an array with one row of corners
    per cell. point_arrays and cell_arrays map names to arrays with one value, or one row of values, per element."""
    count = sum(len(corners) for _, corners in cells)
    words = sum(corners.size + len(corners) for _, corners in cells)
    with open(path, "wb") as file:
        file.write(f"# vtk DataFile Version 4.2\nmesh\nBINARY\nDATASET UNSTRUCTURED_GRID\n"
                   f"POINTS {len(points)} {VTK_TYPES[points.dtype.name]}\n".encode())
        file.write(big_endian(points))
        file.write(f"\nCELLS {count} {words}\n".encode())
        for _, corners in cells:
            rows = np.empty((len(corners), corners.shape[1] + 1), ">i4")
            rows[:, 0], rows[:, 1:] = corners.shape[1], corners
            file.write(rows.tobytes())
        file.write(f"\nCELL_TYPES {count}\n".encode())
        for kind, corners in cells:
            file.write(np.full(len(corners), kind, ">i4").tobytes())
        file.write(b"\n")
        for section, elements, arrays in (("CELL_DATA", count, cell_arrays),
                                          ("POINT_DATA", len(points), point_arrays)):
            if not arrays:
                continue
            file.write(f"{section} {elements}\nFIELD FieldData {len(arrays)}\n".encode())
            for name, values in arrays.items():
                components = 1 if values.ndim == 1 else values.shape[1]
                file.write(f"{name} {components} {elements} "
                           f"{VTK_TYPES[values.dtype.name]}\n".encode())
                file.write(big_endian(values))
                file.write(b"\n")


def lattice(ni, nj, nk, closed=False):
    """Returns the corners of ni * nj * nk hexahedra; the index i varies fastest. If `closed` is true, the last cells
    along i are connected to the first cells."""
    across = ni if closed else ni + 1
    k, j, i = np.meshgrid(np.arange(nk), np.arange(nj), np.arange(ni), indexing="ij")

    def vertex(a, b, c):
        return ((i + a) % across + across * ((j + b) + (nj + 1) * (k + c))).ravel()

    return np.stack([vertex(0, 0, 0), vertex(1, 0, 0), vertex(1, 1, 0), vertex(0, 1, 0),
                     vertex(0, 0, 1), vertex(1, 0, 1), vertex(1, 1, 1), vertex(0, 1, 1)], 1)


def unit_lattice(n):
    a = np.arange(n + 1) / n
    z, y, x = np.meshgrid(a, a, a, indexing="ij")
    return x.ravel(), y.ravel(), z.ravel()


def grid(n):
    """Returns points and corners of a grid of n * n * n hexahedra. For n = 15, this is the mesh "grid" of the paper."""
    return np.stack(unit_lattice(n), 1), lattice(n, n, n)


def warped_block(n):
    x, y, z = unit_lattice(n)
    points = np.stack([x + .05 * np.sin(5 * y + 3 * z) + .03 * np.sin(4 * x * z),
                       y + .06 * np.sin(4 * x + 2 * z) * np.cos(3 * y),
                       z + .04 * np.cos(3 * x + 5 * y) + .02 * np.exp(x * y)], 1)
    return points, lattice(n, n, n)


def annulus(ni, nj, nk):
    k, j, i = np.meshgrid(np.linspace(0, 1, nk + 1), np.linspace(0, 1, nj + 1), np.arange(ni) / ni,
                          indexing="ij")
    radius = 1 + .8 * j**1.2 + .1 * np.sin(6 * np.pi * i) * j
    angle = 2 * np.pi * i + .4 * k
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle),
                       2 * k + .1 * np.cos(4 * np.pi * j) * k], -1)
    return points.reshape(-1, 3), lattice(ni, nj, nk, closed=True)


def straight_annulus(ni, nj, nk):
    """Returns points and corners of an annulus. All its layers along z are identical."""
    z, radius, angle = np.meshgrid(np.linspace(0, 2, nk + 1), np.linspace(1, 1.8, nj + 1),
                                   np.arange(ni) * 2 * np.pi / ni, indexing="ij")
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], -1)
    return points.reshape(-1, 3), lattice(ni, nj, nk, closed=True)


CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0],
                    [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
SIDES = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (0, 3, 7, 4)]
EDGES = [(0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6),
         (6, 7)]


def cut_into_eight(n, levels, with_cut=False):
    """Returns points and corners of a grid of n * n * n hexahedra, in which cells near two planes are divided into
    eight, `levels` times. As in LaGriT, new cells come after all other cells. Each divided cell has 19 new vertices:
    the midpoints of the cell, of its sides and of its edges. Coincident new vertices of neighbouring cells are not
    merged. If `with_cut` is true, the result also contains the divided cells, which LaGriT keeps until a user removes
    them."""
    size = 1 << levels
    points = np.rint(grid(n)[0] * n * size).astype(np.int64)
    corners = lattice(n, n, n)
    whole = np.ones(len(corners), bool)
    first = 0  # only the cells from this index on may be cut
    middles = np.array([np.mean(CORNERS[list(of)], 0) * 2 for of in (range(8), *SIDES, *EDGES)])
    local = np.concatenate([CORNERS * 2, middles.astype(np.int64)])
    place = {tuple(at): i for i, at in enumerate(local)}
    eight = [[place[tuple(at)] for at in CORNERS + child]
             for child in CORNERS[[0, 1, 3, 2, 4, 5, 7, 6]]]
    for _ in range(levels):
        centre = points[corners[first:]].mean(1) / size
        near = np.zeros(len(centre), bool)
        for normal, distance in (((1, .3, .2), .41 * n), ((.2, 1, -.4), .3 * n)):
            normal = np.array(normal) / np.linalg.norm(normal)
            edge = (points[corners[first:, 1]] - points[corners[first:, 0]])[:, 0] / size
            near |= np.abs(centre @ normal - distance) < .87 * edge
        cut = first + np.flatnonzero(near)
        whole[cut] = False
        low = points[corners[cut, 0]]
        half = (points[corners[cut, 1]] - low)[:, :1] // 2
        new = len(points) + np.arange(19 * len(cut)).reshape(-1, 19)
        points = np.concatenate([points, (low[:, None] + half[:, None] * local[8:]).reshape(-1, 3)])
        made = np.concatenate([corners[cut], new], 1)[:, eight].reshape(-1, 8)
        first = len(corners)
        corners = np.concatenate([corners, made])
        whole = np.concatenate([whole, np.ones(len(made), bool)])
    corners = corners if with_cut else corners[whole]
    used, numbers = np.unique(corners, return_inverse=True)
    return points[used] / (n * size), numbers.reshape(-1, 8)


def text_born(values, digits=8):
    """Rounds values to `digits` significant decimal digits, as if they had been written as text and read again."""
    text = np.char.mod(f"%.{digits}g", values.ravel())
    return text.astype(np.float64).reshape(values.shape)


def centres(points, corners):
    return points[corners].mean(axis=1)


def normalized(places):
    low = places.min(axis=0)
    return (places - low) / (places.max(axis=0) - low).max()


def float_fields(places):
    """Returns a dict that maps the names of four fields to their float64 values: a smooth field, a shock, turbulence
    with a little noise, and a velocity."""
    u = normalized(places)
    x, y, z = u.T
    random = np.random.default_rng(11)
    turbulence = np.zeros(len(u))
    for _ in range(48):
        wave = 2 * np.pi * 2**(random.random() * 5.5)
        direction = random.normal(size=3)
        direction /= np.linalg.norm(direction)
        turbulence += wave**(-1 / 3) * np.cos(wave * (u @ direction) + 6.28 * random.random())
    turbulence += 1e-3 * turbulence.std() * random.normal(size=len(u))
    front = np.sqrt((x - .3)**2 + (y - .4)**2 + (z - .2)**2) - .45
    return {
        "smooth": smooth(x, y, z, 0),
        "shock": np.where(front < 0, 1 + .2 * x, .125 + .02 * y) + .3 * np.tanh(front / .003),
        "turbulence": turbulence,
        "velocity": np.stack([np.sin(5 * y) * np.cos(3 * z), np.sin(5 * z + x),
                              np.cos(4 * x) * y], 1),
    }


def smooth(x, y, z, time):
    return 300 + 50 * np.sin(3 * x + 1 + .02 * time) * np.cos(4 * y - .01 * time) * np.exp(-z)


def moving_steps(places, steps):
    """Returns the values of a smooth field that moves slowly, for each time step."""
    x, y, z = normalized(places).T
    return [smooth(x, y, z, time) for time in range(steps)]


def bisected(places, levels):
    """Divides points into 2^levels parts by recursive coordinate bisection. Returns the part number of each point."""
    part = np.zeros(len(places), np.int32)
    for _ in range(levels):
        split = 2 * part
        for p in range(part.max() + 1):
            inside = np.flatnonzero(part == p)
            axis = np.ptp(places[inside], axis=0).argmax()
            order = inside[np.argsort(places[inside, axis], kind="stable")]
            split[order[len(order) // 2:]] += 1
        part = split
    return part


def integer_fields(places):
    """Returns a dict that maps the names of three integer fields to their int32 values: block number (12 blocks), part
    number (64 parts), and element number."""
    u = normalized(places)
    sites = np.random.default_rng(7).random((12, 3)) * u.max(axis=0)
    nearest = ((u[:, None, :] - sites[None])**2).sum(axis=2).argmin(axis=1)
    return {"block": (nearest + 1).astype(np.int32), "part": bisected(u, 6),
            "number": np.arange(1, len(u) + 1, dtype=np.int32)}
