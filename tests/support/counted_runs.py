"""Counts the instructions that a program's function counted_run() executes, with callgrind. The count is the
same in every run, however busy the machine is."""
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

COUNTED, PREFIX = "counted_run", "counted,"


def counted_runs(program, *arguments):
    """Runs the program with these arguments. After each call to counted_run(), the program prints a line
    "counted,...". For each call, yields the rest of this line and the path of the callgrind profile of the
    call. If valgrind is missing, ends the test with exit code 77 (skipped)."""
    if not shutil.which("valgrind"):
        print("no valgrind")
        sys.exit(77)
    with tempfile.TemporaryDirectory() as folder:
        profile = f"{folder}/profile"
        run = subprocess.run(
            ["valgrind", "--quiet", "--tool=callgrind", f"--callgrind-out-file={profile}",
             "--compress-strings=no", "--compress-pos=no",
             f"--toggle-collect={COUNTED}", f"--dump-after={COUNTED}", program, *arguments],
            stdout=subprocess.PIPE, text=True, check=False)
        if run.returncode:
            sys.exit(f"{run.stdout}\n{program}: exit code {run.returncode}")
        lines = [line[len(PREFIX):] for line in run.stdout.splitlines() if line.startswith(PREFIX)]
        for place, line in enumerate(lines, 1):
            yield line, f"{profile}.{place}"


def instructions_of(profile):
    """Returns the number of instructions of a callgrind profile."""
    return int(re.search(r"^totals: (\d+)", Path(profile).read_text(encoding="utf-8"), re.MULTILINE)[1])
