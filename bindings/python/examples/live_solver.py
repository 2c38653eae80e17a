"""Writes a bar of hexahedra with a temperature, one time step after the other, as a solver would. Each step is readable
as soon as it is committed, even if the solver is killed later.

    python3 live_solver.py bar.shm 20
"""
import sys

import numpy as np
import shmformat

CELLS = 100


def main(path: str, steps: int) -> None:
    layer = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)
    points = np.array([(0.1 * x, y, z) for x in range(CELLS + 1) for y, z in layer])
    cells = 4 * np.arange(CELLS)[:, None] + np.arange(8)
    with shmformat.Writer(path, points, cells, point_data={"temperature": np.float64}, live=True,
                          replace=True) as writer:
        for step in range(steps):
            time = 0.5 * step
            writer.write_step(time, point_data={"temperature": 300 + points[:, 0] * time})
            writer.commit()
            print(f"step {step} is committed", flush=True)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
