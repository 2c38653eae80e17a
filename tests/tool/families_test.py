#!/usr/bin/python3
"""Runs families of generated meshes through the tool, in all orders, with and without delay buffers, lossless and quantized.

families_test.py SHM          shm_make_mesh (and shm_make_tet_mesh, with TetGen) are in the folder of SHM

Compresses each mesh in every mode, checks it with `verify --against`, and prints the compression rates.
"""
import json
import os
import subprocess
import sys
import tempfile

FAMILIES = ("grid", "ogrid", "shell", "voxel", "swept", "blocks", "shuffled")
DELAYS = ("0", "1", "50", "1000")


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=600).stdout


def check(shm, name, mesh, packed):
    for order in ("keep", "stream", "free"):
        for delay in DELAYS if order != "free" else ("0",):
            for bits in ((), ("--bits", "16")):
                if bits and delay in ("1", "1000"):
                    # Quantized coordinates are not tested with every delay. The delay changes only the order
                    # of the cells, and the coding of quantized coordinates does not depend on how that order
                    # was obtained.
                    continue
                report = json.loads(run(shm, "compress", "-f", mesh, "-o", packed, "--order", order,
                                        "--delay", delay, "--json", *bits))
                run(shm, "verify", packed, "--against", mesh)
                print(f"{name}, {order}, delay {delay}, {'16 bits' if bits else 'lossless'}: "
                      f"{report['connectivity_bits_per_hex']:.3f} bits a hexahedron, "
                      f"{report['geometry_bits_per_vertex']:.2f} bits a vertex")


def main():
    shm = sys.argv[1]
    folder = os.path.dirname(os.path.abspath(shm))
    make_mesh = os.path.join(folder, "shm_make_mesh")
    make_tets = os.path.join(folder, "shm_make_tet_mesh")
    with tempfile.TemporaryDirectory() as scratch:
        mesh, packed = os.path.join(scratch, "mesh.vtk"), os.path.join(scratch, "mesh.shm")
        for family in FAMILIES:
            run(make_mesh, family, "4000", mesh)
            check(shm, family, mesh, packed)
        if os.path.exists(make_tets):
            run(make_tets, "300", mesh)
            check(shm, "tetrahedra split in four", mesh, packed)
        else:
            print("tetrahedra: not tested, because shm_make_tet_mesh was not built (TetGen is missing)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
