"""Hexahedral meshes in .shm files, as NumPy arrays.

    import shmformat

    with shmformat.open("run.shm") as mesh:
        mesh.points                      # float64 or float32, (vertices, 3)
        mesh.cells.connectivity          # vertex numbers, cell after cell, in VTK's order
        mesh.point_data["u"][4]          # the array "u" at time step 4; decoded on access
        part = mesh.select(box=(0, 0, 0, 1, 1, 1))
        mesh.boundary(cell_data=["p"], step=4)  # the faces that belong to exactly one cell

    shmformat.write("cube.shm", points, hexahedra)

    with shmformat.Writer("run.shm", points, hexahedra, point_data={"u": float}, live=True) as writer:
        writer.write_step(0.1, point_data={"u": u})
        writer.commit()              # the step is readable now

All arrays are NumPy arrays. The library fills them directly, while other Python threads can run.
Failures raise Error, with a code, a section and an offset.
"""
from ._library import Error, library_version
from ._mesh import Archive, Arrays, Block, Boundary, Cells, Data, Extra, Mesh, Segment, Set, Steps, open
from ._write import Writer, append, write

__version__ = library_version()
__all__ = ["Archive", "Arrays", "Block", "Boundary", "Cells", "Data", "Error", "Extra", "Mesh", "Segment",
           "Set", "Steps", "Writer", "append", "open", "write"]
