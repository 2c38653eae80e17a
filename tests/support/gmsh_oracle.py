#!/usr/bin/python3
"""Compares two MSH files with Gmsh. Exit code: 0 if they are equal, 1 if they differ, 2 if one of them cannot
be read.

    gmsh_oracle.py [--renumbered] A.msh B.msh

Needs Debian's python3-gmsh. The script does not use this project's reader: Gmsh loads both files. The script
compares all data that the API of Gmsh returns:
- nodes by tag, with their entities, coordinates and parameters,
- elements by tag, with their types, entities and nodes,
- entities, partitions, physical groups and names, periodic links,
- views with all steps.
Gmsh also saves both meshes as MSH 4.1 in ASCII. The saved files are compared line by line, which covers items
that the API does not return (ghost elements). Sections that Gmsh ignores are compared as text. With
--renumbered, nodes are identified by their coordinates and elements by their nodes, so that tags and the order
of items may differ.
"""
import os
import re
import struct
import sys
import tempfile

import gmsh


def key(value):
    """Converts a float to its bits, so that -0.0 and NaN are distinguished. Returns other values
    unchanged."""
    if isinstance(value, float):
        return struct.pack("<d", value)
    if isinstance(value, (list, tuple)) or hasattr(value, "tolist"):
        return tuple(key(v) for v in (value.tolist() if hasattr(value, "tolist") else value))
    return value


def nodes(found):
    for dim, tag in [(-1, -1)] + gmsh.model.getEntities():
        if dim < 0:
            continue
        tags, xyz, uvw = gmsh.model.mesh.getNodes(dim, tag, False, False)
        try:
            with_uvw = gmsh.model.mesh.getNodes(dim, tag, False, True)[2]
        except Exception:
            with_uvw = []
        per_node = len(with_uvw) // len(tags) if len(tags) else 0
        for i, node in enumerate(tags):
            found["node", int(node)] = key((dim, tag, xyz[3 * i:3 * i + 3],
                                            with_uvw[per_node * i:per_node * (i + 1)]))


def elements(found):
    for dim, tag in gmsh.model.getEntities():
        order = 0
        ghosts = "Ghost" in gmsh.model.getType(dim, tag)  # Gmsh sorts ghost cells by address
        for kind, tags, corners in zip(*gmsh.model.mesh.getElements(dim, tag)):
            width = len(corners) // len(tags) if len(tags) else 0
            for i, element in enumerate(tags):
                order += 0 if ghosts else 1
                where = ("element", int(element), dim, tag)
                found[where] = key((int(kind), order, corners[width * i:width * (i + 1)]))


def model(found):
    for dim, tag in gmsh.model.getEntities():
        entry = [gmsh.model.getType(dim, tag), gmsh.model.getPhysicalGroupsForEntity(dim, tag)]
        for call in (gmsh.model.getParent, gmsh.model.getPartitions):
            try:
                entry.append(call(dim, tag))
            except Exception:
                entry.append(None)
        try:
            entry.append(gmsh.model.getBoundary([(dim, tag)], False, True))
        except Exception:
            entry.append(None)
        found["entity", dim, tag] = key(entry)
        try:
            master, slaves, masters, affine = gmsh.model.mesh.getPeriodicNodes(dim, tag)
            pairs = sorted(zip(slaves.tolist(), masters.tolist()))  # Gmsh sorts the pairs by address
            found["periodic", dim, tag] = key((master, pairs, affine))
        except Exception:
            pass
    for dim, tag in gmsh.model.getPhysicalGroups():
        found["group", dim, tag] = (gmsh.model.getPhysicalName(dim, tag),
                                    key(gmsh.model.getEntitiesForPhysicalGroup(dim, tag)))


def views(found):
    for number, view in enumerate(gmsh.view.getTags()):
        name = gmsh.option.getString(f"View[{number}].Name")
        steps = int(gmsh.option.getNumber(f"View[{number}].NbTimeStep"))
        found["view", number] = (name, steps)
        for step in range(steps):
            try:
                kind, tags, data, time, components = gmsh.view.getModelData(view, step)
            except Exception as error:
                found["view", number, step] = str(error)
                continue
            values = {int(t): key(d) for t, d in zip(tags, data)}
            found["view", number, step] = (kind, key(float(time)), components, values)


def other_sections(path):
    """Returns the name and text of each section that Gmsh ignores, and of each section that contains
    names."""
    known = ("MeshFormat", "Entities", "PartitionedEntities", "Nodes", "ParametricNodes",
             "Elements", "Periodic", "GhostElements", "NodeData", "ElementData",
             "ElementNodeData", "NOD", "ELM")
    with open(path, "rb") as file:
        content = file.read()
    found = []
    for match in re.finditer(rb"^\$([A-Za-z]\w*)[ \r]*\n(.*?)^\$End\1", content, re.S | re.M):
        if match.group(1).decode() not in known:
            found.append((match.group(1), match.group(2)))
    return found


def saved(folder):
    """Saves the loaded mesh with Gmsh as an MSH 4.1 file in ASCII. Returns the contents of the file."""
    path = os.path.join(folder, "saved.msh")
    gmsh.option.setNumber("Mesh.SaveAll", 1)
    gmsh.option.setNumber("Mesh.Binary", 0)
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.option.setNumber("Mesh.SaveParametric", 1)
    gmsh.write(path)
    with open(path, "rb") as file:
        text = file.read()
    # Gmsh sorts periodic links by memory address, so their order in saved files changes from run to run. They
    # are compared through the API instead.
    text = re.sub(rb"\$Periodic\n.*?\$EndPeriodic\n", b"", text, flags=re.S)
    return re.sub(rb"(?<=\$GhostElements\n).*?(?=\$EndGhostElements)",
                  lambda m: b"\n".join(sorted(b" ".join(ghost_line(l)) for l in
                                              m.group(0).splitlines())), text, flags=re.S)


def ghost_line(line):
    words = line.split()
    return words[:3] + sorted(words[3:])


def renumbered(found):
    """Returns the contents of a file in a form without tags: nodes are identified by their coordinates,
    elements by their nodes."""
    place = {k[1]: v[:3] for k, v in found.items() if k[0] == "node"}
    cell, all_cells = {}, []
    for k, (kind, _, corners) in ((k, v) for k, v in found.items() if k[0] == "element"):
        what = (k[2], k[3], kind, tuple(place[int(c)] for c in corners))
        cell[k[1]] = what
        all_cells.append(what)
    seen = {"cells": sorted(map(str, all_cells)),
            "nodes": sorted(str(v) for k, v in found.items() if k[0] == "node")}
    for k, v in found.items():
        if k[0] in ("entity", "group"):
            seen[k] = v
        elif k[0] == "periodic":
            seen[k] = (v[0], sorted(str((place[a], place[b])) for a, b in v[1]), v[2])
        elif k[0] == "view" and len(k) == 3 and not isinstance(v, str):
            where = place if v[0] == "NodeData" else cell
            seen[k] = (*v[:3], sorted(str((where.get(t, t), d)) for t, d in v[3].items()))
        elif k[0] in ("view", "open", "errors"):
            seen[k] = v
    return seen


def load(path, convert_partitions=True):
    """Returns the contents of a file as Gmsh reads it. If `convert_partitions` is true, Gmsh creates entities
    from the partitions of MSH 2. The tags of these entities depend on the order of elements."""
    # The file is loaded twice, because some queries of the API (for parameters) change the mesh that Gmsh
    # saves afterwards.
    found = {}
    for run in ("api", "saved"):
        gmsh.initialize(["gmsh"], False)
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.PartitionConvertMsh2", 1 if convert_partitions else 0)
        gmsh.logger.start()
        try:
            gmsh.open(path)
        except Exception as error:  # Gmsh raises an error, but keeps the data that it has already read
            found["open", run] = str(error)
        errors = [line for line in gmsh.logger.get() if line.startswith("Error")]
        if errors:
            found["errors", run] = tuple(errors)
        if run == "api":
            for part in (nodes, elements, model, views):
                part(found)
        else:
            with tempfile.TemporaryDirectory() as folder:
                found["saved"] = saved(folder)
        gmsh.finalize()
    found["other sections"] = tuple(other_sections(path))
    return found


def compare(first, second):
    """Returns the keys whose values differ between the contents of two files. Each argument is a result of
    load() or renumbered()."""
    return [k for k in sorted(set(first) | set(second), key=str) if first.get(k) != second.get(k)]


def main():
    words = [w for w in sys.argv[1:] if w != "--renumbered"]
    if len(words) != 2:
        print(__doc__)
        return 2
    try:
        first, second = (load(w, "--renumbered" not in sys.argv) for w in words)
    except Exception as error:
        print(f"cannot be read: {error}")
        return 2
    if "--renumbered" in sys.argv:
        first, second = renumbered(first), renumbered(second)
    differences = compare(first, second)
    for k in differences[:10]:
        print(f"{k}: {str(first.get(k))[:200]} != {str(second.get(k))[:200]}")
    if any(k[0] == "errors" for k in first):
        print("note: Gmsh itself complains about the first file:", first.get(("errors", "api")))
    if differences:
        print(f"{len(differences)} differences")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
