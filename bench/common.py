"""Functions that several benchmark scripts use: paths, building, meshes and tables."""
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BIN = ROOT / "build" / "release" / "bin"
FAMILIES = ["grid", "ogrid", "shell", "voxel", "swept", "tets", "blocks", "shuffled"]


def under_debians_python():
    """Restarts the script with Debian's Python, which has the modules that scripts/setup installs. Other Python
    installations may not have them."""
    if sys.executable == "/usr/bin/python3" or not os.path.exists("/usr/bin/python3"):
        sys.exit("a Python module is missing: scripts/setup --bench")
    os.execv("/usr/bin/python3", ["/usr/bin/python3", *sys.argv])


def build(*targets, options=()):
    subprocess.run([ROOT / "scripts" / "setup", "--bench"], check=True)
    log = ROOT / "build" / "bench.log"
    log.parent.mkdir(exist_ok=True)
    with open(log, "wb") as out:
        for command in (["cmake", "--preset", "release", *options],
                        ["cmake", "--build", "--preset", "release", "--target", *targets]):
            if subprocess.run(command, cwd=ROOT, stdout=out, stderr=out).returncode != 0:
                sys.exit(f"the build failed: {log}")


def machine():
    model = re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())
    return (f"{model.group(1) if model else 'unknown processor'}, {os.cpu_count()} cores, "
            f"load {os.getloadavg()[0]:.1f}")


def corpus_folder():
    return Path(os.environ.get("SHM_CORPUS") or ROOT.parent / "shared" / "corpus")


def corpus_files(folder):
    """Returns the meshes of the corpus, or nothing if its folder does not exist."""
    return sorted(path for path in folder.rglob("*") if path.is_file() and path.suffix not in (".md", ".tsv"))


def make_mesh(family, cells, path, *options, tools=BIN):
    subprocess.run([tools / "shm_make_mesh", family, str(cells), path, *options], check=True,
                   stdout=subprocess.DEVNULL)


class Cost:
    """The total cost of several processes, which run one after the other: the sum of their CPU times in seconds, and
    the largest of their memory peaks."""

    def __init__(self):
        self.seconds = 0.0
        self.peak = 0

    def run(self, *command, stdout=None):
        # The command is started by the small program time(1) and not by Python, because a child process inherits the
        # peak memory of its parent. If Python started it, the reported peak would be at least the memory of Python.
        with tempfile.NamedTemporaryFile("r") as report:
            process = subprocess.Popen(["/usr/bin/time", "-q", "-o", report.name, "-f", "%M",
                                        *(str(word) for word in command)], stdout=stdout,
                                       stderr=subprocess.PIPE, text=False)
            error = process.stderr.read()
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            self.seconds += usage.ru_utime + usage.ru_stime
            self.peak = max(self.peak, int(report.read() or 0) * 1024)
        process.stderr.close()
        if process.returncode != 0:
            raise RuntimeError(f"{' '.join(map(str, command))}: exit code {process.returncode}: "
                               + error.decode(errors="replace").strip()[-500:])
        return self


def print_table(title, rows, columns, markdown):
    if markdown:
        print(f"\n**{title}**\n\n| | " + " | ".join(columns) + " |")
        print("|---|" + "---:|" * len(columns))
        for name, cells in rows:
            print(f"| {name} | " + " | ".join(cells) + " |")
    else:
        wide = max(24, *(len(name) + 2 for name, _ in rows)) if rows else 24
        print(f"\n{title}\n" + " " * wide + "".join(f"{name:>14}" for name in columns))
        for name, cells in rows:
            print(f"{name:<{wide}}" + "".join(f"{cell:>14}" for cell in cells))
    sys.stdout.flush()
