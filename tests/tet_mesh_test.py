#!/usr/bin/python3
"""Irregular meshes, tetrahedra split in four hexahedra, through the tool in every mode.

tet_mesh_test.py SHM          shm_make_tet_mesh stands beside SHM
Exit code 77 (skipped) where it was not built, for want of TetGen.
"""
import json
import os
import subprocess
import sys
import tempfile


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=600).stdout


def main():
    shm = sys.argv[1]
    make = os.path.join(os.path.dirname(os.path.abspath(shm)), "shm_make_tet_mesh")
    if not os.path.exists(make):
        print("skipped: shm_make_tet_mesh was not built; it wants TetGen (libtet1.5-dev)")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        mesh, packed = os.path.join(folder, "mesh.vtk"), os.path.join(folder, "mesh.shm")
        print(run(make, "1500", mesh).strip())
        for order in ("keep", "stream"):
            for delay in ("0", "1", "50", "1000"):
                for bits in ((), ("--bits", "16")):
                    report = json.loads(run(shm, "compress", mesh, "-o", packed, "--order", order,
                                            "--delay", delay, "--json", *bits))
                    run(shm, "verify", packed, "--against", mesh)
                    print(f"{order}, delay {delay}, {'16 bits' if bits else 'lossless'}: "
                          f"{report['connectivity_bits_per_hex']:.2f} bits a hexahedron, "
                          f"{report['geometry_bits_per_vertex']:.2f} bits a vertex")
    return 0


if __name__ == "__main__":
    sys.exit(main())
