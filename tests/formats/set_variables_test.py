#!/usr/bin/env python3
"""Tests variables of the whole mesh and of sets in Exodus files: compression, conversion, pieces, differences,
appended steps and bounds.

Usage: set_variables_test.py PATH_OF_SHM     (exit code 77, skipped, if NumPy or netCDF4 is missing)
"""
import json
import os
import sys
import unittest

try:
    import netCDF4
    import numpy
except ImportError as missing:
    print(missing)
    sys.exit(77)

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from folder_test import FolderTest

SIDE = 6  # cells along each edge
STEPS = 7
NAME = 33


def write_exodus(path, steps=range(STEPS), change=0.0, sets=True, cells=True):
    """Writes a cube of hexahedra with three global variables and variables of node, side and element sets. Not every
    set has every variable. `change` is added to one value of a side set."""
    out = netCDF4.Dataset(path, "w", format="NETCDF3_64BIT_OFFSET")
    out.setncatts({"api_version": numpy.float32(8), "version": numpy.float32(8),
                   "floating_point_word_size": numpy.int32(8), "file_size": numpy.int32(1), "title": "sets"})
    out.createDimension("len_name", NAME)
    out.createDimension("time_step", None)
    out.createDimension("num_dim", 3)
    n = SIDE + 1
    nodes = n**3 if cells else 0
    if cells:
        out.createDimension("num_nodes", nodes)
        out.createDimension("num_elem", SIDE**3)
        out.createDimension("num_el_blk", 1)
        out.createDimension("num_el_in_blk1", SIDE**3)
        out.createDimension("num_nod_per_el1", 8)
        for axis, values in zip("xyz", numpy.meshgrid(*[numpy.arange(n) / 8] * 3, indexing="ij")):
            out.createVariable("coord" + axis, "f8", ("num_nodes",))[:] = values.ravel()
        first = numpy.arange(nodes).reshape(n, n, n)[:-1, :-1, :-1].ravel()
        corners = numpy.stack([first + i * n * n + j * n + k for i, j, k in (
            (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))], axis=1) + 1
        connect = out.createVariable("connect1", "i4", ("num_el_in_blk1", "num_nod_per_el1"))
        connect.elem_type = "HEX8"
        connect[:] = corners
        u = out.createVariable("vals_nod_var1", "f8", ("time_step", "num_nodes"))
        out.createDimension("num_nod_var", 1)
        write_names(out, "name_nod_var", "num_nod_var", ["u"])
        for s, step in enumerate(steps):
            u[s] = numpy.sin(numpy.arange(nodes) / 50 + step)
    write_globals(out, steps)
    if sets:
        write_sets(out, steps, change)
    time = out.createVariable("time_whole", "f8", ("time_step",))
    time[:] = [step / 4 for step in steps]
    out.close()


def write_names(out, table, dimension, names):
    values = numpy.zeros((len(names), NAME), "S1")
    for row, name in zip(values, names):
        row[:len(name)] = list(name)
    out.createVariable(table, "S1", (dimension, "len_name"))[:] = values


def write_globals(out, steps):
    out.createDimension("num_glo_var", 3)
    write_names(out, "name_glo_var", "num_glo_var", ["energy", "mass", "energy"])
    values = out.createVariable("vals_glo_var", "f8", ("time_step", "num_glo_var"))
    for s, step in enumerate(steps):
        values[s] = [numpy.exp(-step / 3), 12.5, -numpy.exp(-step / 3)]


# Of each kind: prefix of its variables, suffix, dimension of members, dimension of sets, members, sizes of the
# sets, and the numbers of the sets (from 1) that have each variable.
KINDS = (("nset", "ns", "num_nod_ns", "num_node_sets", "node_ns", (10, 1, 4), {"force": (1, 2, 3), "hot": (3,)}),
         ("sset", "ss", "num_side_ss", "num_side_sets", "elem_ss", (5, 8), {"flux": (1, 2), "wet": (2,)}),
         ("elset", "els", "num_ele_els", "num_elem_sets", "elem_els", (6,), {"damage": (1,)}))


def value_of(kind, field, number, step, count):
    return numpy.cos(numpy.arange(count) * (number + 1) / 7 + step) + 10 * field + len(kind)


def write_sets(out, steps, change):
    for kind, suffix, count, places, members, sizes, fields in KINDS:
        out.createDimension(places, len(sizes))
        for number, size in enumerate(sizes, 1):
            out.createDimension(f"{count}{number}", size)
            out.createVariable(f"{members}{number}", "i4", (f"{count}{number}",))[:] = (
                numpy.arange(size)[::-1] * 20 + number)
            if kind == "sset":
                out.createVariable(f"side_ss{number}", "i4", (f"{count}{number}",))[:] = numpy.arange(size) % 6 + 1
        out.createVariable(f"{suffix}_prop1", "i4", (places,))[:] = [100 + i for i in range(len(sizes))]
        out.createDimension(f"num_{kind}_var", len(fields))
        write_names(out, f"name_{kind}_var", f"num_{kind}_var", list(fields))
        table = numpy.zeros((len(sizes), len(fields)), "i4")
        for field, covered in enumerate(fields.values()):
            for number in covered:
                table[number - 1, field] = 1
                one = out.createVariable(f"vals_{kind}_var{field + 1}{suffix}{number}", "f8",
                                         ("time_step", f"{count}{number}"))
                for s, step in enumerate(steps):
                    values = value_of(kind, field, number, step, sizes[number - 1])
                    if kind == "sset" and field == 0 and number == 2 and step == 3:
                        values[5] += change
                    one[s] = values
        out.createVariable(f"{kind}_var_tab", "i4", (places, f"num_{kind}_var"))[:] = table


class SetVariables(FolderTest):
    def path(self, name):
        return os.path.join(self.directory.name, name)

    def made(self, name, **how):
        write_exodus(self.path(name), **how)
        return name

    def bytes_of(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()

    def arrays(self, name):
        info = json.loads(self.shm("info", name, "--json"))
        return {f"{array['location']}/{array['name']}": array for array in info["arrays"]}, info

    def test_the_same_file_comes_back(self):
        source = self.made("run.e")
        for words in ([], ["--level", "fast"], ["--level", "best"], ["--order", "stream"], ["--order", "free"],
                      ["--order", "stream", "--delay", "40"]):
            self.shm("compress", source, "-o", "run.shm", "-f", "-q", *words)
            self.shm("verify", "run.shm", "--against", source, "-q")
            self.shm("decompress", "run.shm", "-o", "back.e", "-f", "-q")
            if "--order" not in words:
                self.assertEqual(self.bytes_of("back.e"), self.bytes_of(source), words)
            for variable in ("vals_glo_var", "vals_nset_var1ns1", "vals_nset_var2ns3", "vals_sset_var2ss2",
                             "vals_elset_var1els1"):
                with netCDF4.Dataset(self.path("back.e")) as back, netCDF4.Dataset(self.path(source)) as own:
                    self.assertTrue((back[variable][:] == own[variable][:]).all(), (words, variable))

    def test_info(self):
        self.made("run.e")
        self.shm("compress", "run.e", "-o", "run.shm", "-q")
        for name in ("run.e", "run.shm"):
            arrays, info = self.arrays(name)
            self.assertFalse([extra for extra in info.get("extras", []) if "_var" in str(extra)])
            self.assertEqual(arrays["global/energy"]["elements"], 1)
            self.assertEqual(arrays["node_set/force"]["elements"], 15)
            self.assertEqual((arrays["node_set/hot"]["elements"], arrays["node_set/hot"]["sets"]), (4, [2]))
            self.assertEqual(arrays["side_set/flux"]["sets"], [])
            self.assertTrue(arrays["element_set/damage"]["per_step"])
        text = self.shm("info", "run.shm").decode()
        self.assertIn("'hot': node set data, 1 x float64, each step, on 1 set, 4 members", text)

    def test_meshes_without_nodes_keep_their_variables(self):
        self.made("history.e", sets=False, cells=False)
        self.shm("compress", "history.e", "-o", "history.shm", "-q")
        self.shm("verify", "history.shm", "--against", "history.e", "-q")
        self.shm("decompress", "history.shm", "-o", "back.e", "-q")
        self.assertEqual(self.bytes_of("back.e"), self.bytes_of("history.e"))

    def test_differences(self):
        self.made("a.e")
        self.made("b.e", change=.25)
        self.shm("diff", "a.e", "a.e")
        self.shm("compress", "b.e", "-o", "b.shm", "-q")
        for other in ("b.e", "b.shm"):
            found = json.loads(self.shm("diff", "a.e", other, "--json", code=1))
            found = [each for each in found["differences"] if each["kind"] == "values"]
            self.assertEqual([each["what"] for each in found], ["array 'side_set/flux'"])
            self.assertEqual(found[0]["places"][0]["a"], 10)
            self.shm("diff", "a.e", other, "--abs", ".3")

    def test_bounds(self):
        """A bound for all fields does not hold for global variables; one for an array does."""
        self.made("run.e")
        self.shm("compress", "run.e", "-o", "run.shm", "-q", "--abs", ".01", "--array", "global/energy#2:abs=.001")
        arrays = json.loads(self.shm("info", "run.shm", "--json"))["arrays"]
        bounds = [array["max_error"] for array in arrays if array["location"] == "global"]
        self.assertEqual(bounds, [None, None, .001])
        arrays, _ = self.arrays("run.shm")
        self.assertEqual(arrays["node_set/force"]["max_error"], .01)
        self.shm("verify", "run.shm", "--against", "run.e", "-q")
        self.shm("decompress", "run.shm", "-o", "back.e", "-q")
        with netCDF4.Dataset(self.path("run.e")) as own, netCDF4.Dataset(self.path("back.e")) as back:
            self.assertTrue((back["vals_glo_var"][:, :2] == own["vals_glo_var"][:, :2]).all())
            for variable, bound in (("vals_glo_var", .001), ("vals_nset_var1ns1", .01), ("vals_sset_var1ss2", .01)):
                self.assertLessEqual(abs(back[variable][:] - own[variable][:]).max(), bound)

    def test_appended_steps(self):
        self.made("first.e", steps=range(4))
        self.made("more.e", steps=range(4, STEPS))
        self.made("all.e")
        self.shm("compress", "first.e", "-o", "first.shm", "-q")
        self.shm("append", "first.shm", "more.e", "-q")
        self.shm("decompress", "first.shm", "-o", "back.e", "-q")
        self.assertEqual(self.bytes_of("back.e"), self.bytes_of("all.e"))

    def test_steps_of_a_file(self):
        self.made("run.e")
        self.made("some.e", steps=range(2, 5))
        self.shm("compress", "run.e", "-o", "run.shm", "-q")
        self.shm("decompress", "run.shm", "-o", "back.e", "-q", "--step", "2:5")
        self.assertEqual(self.bytes_of("back.e"), self.bytes_of("some.e"))

    def test_pieces(self):
        """A piece has the global variables, and the values of those members of sets that belong to it."""
        self.made("run.e")
        self.shm("compress", "run.e", "-o", "run.shm", "-q")
        self.shm("extract", "run.shm", "piece.e", "-q", "--box", "0,0,0,.375,1,1")
        with netCDF4.Dataset(self.path("run.e")) as whole, netCDF4.Dataset(self.path("piece.e")) as piece:
            self.assertTrue((piece["vals_glo_var"][:] == whole["vals_glo_var"][:]).all())
            of_map = piece["node_num_map"][:]
            ids = list(piece["ns_prop1"][:])
            names = [b"".join(row.compressed()).rstrip(b"\0").decode()
                     for row in numpy.ma.masked_equal(piece["name_nset_var"][:], b"")]
            for number in (1, 2, 3):
                members = whole[f"node_ns{number}"][:]
                kept = numpy.isin(members, of_map)
                if not kept.any():
                    continue
                here = ids.index(99 + number) + 1
                self.assertTrue((of_map[piece[f"node_ns{here}"][:] - 1] == members[kept]).all())
                field = names.index("force") + 1
                self.assertTrue((piece[f"vals_nset_var{field}ns{here}"][:]
                                 == whole[f"vals_nset_var1ns{number}"][:][:, kept]).all())

    def test_other_formats(self):
        self.made("run.e")
        out = self.shm("convert", "run.e", "out.vtu", "--strict", code=6).decode()
        self.assertIn("node_set/force", out)
        self.assertNotIn("global/energy", out)
        for name in ("out.vtu", "out.vtk"):
            self.shm("convert", "run.e", name, "-q")
            self.shm("compress", name, "-o", "vtk.shm", "-q", "-f")
            self.shm("verify", "vtk.shm", "--against", name, "-q")
        try:
            import vtk
        except ImportError:
            return
        reader = vtk.vtkXMLUnstructuredGridReader()
        reader.SetFileName(self.path("out.vtu"))
        reader.Update()
        field = reader.GetOutput().GetFieldData()
        self.assertEqual(field.GetArray("energy").GetTuple1(0), numpy.exp(-(STEPS - 1) / 3))
        self.assertEqual(field.GetArray("mass").GetTuple1(0), 12.5)
        reader = vtk.vtkUnstructuredGridReader()
        reader.SetFileName(self.path("out.vtk"))
        reader.Update()
        self.assertEqual(reader.GetOutput().GetFieldData().GetArray("mass").GetTuple1(0), 12.5)


if __name__ == "__main__":
    FolderTest.tool = os.path.abspath(sys.argv.pop(1))
    unittest.main()
