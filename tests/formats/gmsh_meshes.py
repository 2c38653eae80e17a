"""Straight meshes of any order, which Gmsh makes. Its elements of order 3 and higher without inner nodes are called
incomplete."""
import gmsh
import numpy as np


def write_prisms(path, order, incomplete=False):
    """Writes a Gmsh file with prisms of an order, and with the cells of their surface. Returns the number of cells,
    except for points."""
    gmsh.initialize(["gmsh", "-v", "0"])
    try:
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", int(incomplete))
        geo = gmsh.model.geo
        points = [geo.addPoint(*at) for at in ((0, 0, 0), (2.25, 0, 0), (0, 1.5, 0))]
        lines = [geo.addLine(points[i], points[(i + 1) % 3]) for i in range(3)]
        for line in lines:
            geo.mesh.setTransfiniteCurve(line, 2)
        surface = geo.addPlaneSurface([geo.addCurveLoop(lines)])
        geo.extrude([(2, surface)], 0, 0, 1.75, [2], recombine=True)
        geo.synchronize()
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        gmsh.write(path)
        return sum(len(tags) for dim in (1, 2, 3) for tags in gmsh.model.mesh.getElements(dim)[1])
    finally:
        gmsh.finalize()


def write_box(path, order, simplices=False, incomplete=False):
    """Writes a Gmsh file with a box of six hexahedra or of tetrahedra of an order, and with the cells of its surface
    and edges. Returns the number of cells, except for points."""
    gmsh.initialize(["gmsh", "-v", "0"])
    try:
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", int(incomplete))
        box = gmsh.model.occ.addBox(0, 0, 0, 2.25, 3.5, 1.25)
        gmsh.model.occ.synchronize()
        for _, curve in gmsh.model.getEntities(1):
            length = max(np.ptp(np.reshape(gmsh.model.getBoundingBox(1, curve), (2, 3)), axis=0))
            gmsh.model.mesh.setTransfiniteCurve(curve, int(length) + 1)
        for _, surface in gmsh.model.getEntities(2):
            gmsh.model.mesh.setTransfiniteSurface(surface)
            if not simplices:
                gmsh.model.mesh.setRecombine(2, surface)
        gmsh.model.mesh.setTransfiniteVolume(box)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        gmsh.option.setNumber("Mesh.Binary", 1)
        gmsh.write(path)
        return sum(len(tags) for dim in (1, 2, 3) for tags in gmsh.model.mesh.getElements(dim)[1])
    finally:
        gmsh.finalize()


def write_pyramids(path, order, incomplete=False):
    """Writes a Gmsh file with a box that consists of six pyramids of an order."""
    gmsh.initialize(["gmsh", "-v", "0"])
    try:
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", int(incomplete))
        gmsh.model.addDiscreteEntity(3, 1)
        corners = [(0, 0, 0), (2, 0, 0), (2, 3, 0), (0, 3, 0), (0, 0, 4), (2, 0, 4), (2, 3, 4), (0, 3, 4), (1, 1.5, 2)]
        gmsh.model.mesh.addNodes(3, 1, list(range(1, 10)), [x for point in corners for x in point])
        bases = [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)]
        gmsh.model.mesh.addElementsByType(1, 7, list(range(1, 7)), [n + 1 for base in bases for n in (*base, 8)])
        gmsh.model.mesh.setOrder(order)
        gmsh.write(path)
    finally:
        gmsh.finalize()
