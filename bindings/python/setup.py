"""Puts the C library and its header into the package. One wheel is enough for all Python versions of a platform:

    SHMFORMAT_LIBRARY=build/release/bindings/c/libshmformat_c.so python3 -m build --no-isolation --wheel bindings/python

The environment variable SHMFORMAT_LIBRARY names the library. Without it, the library in the release build of the
source tree is used. If neither exists, the package contains no library, and uses the library that the system's
loader finds.
"""
import os
import re
import runpy
import shutil
from pathlib import Path

from setuptools import Distribution, setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist
from wheel.bdist_wheel import bdist_wheel

HERE = Path(__file__).resolve().parent
NAMED = os.environ.get("SHMFORMAT_LIBRARY")
LIBRARY = Path(NAMED or HERE.parents[1] / "build" / "release" / "bindings" / "c" / "libshmformat_c.so.1")
# In a source distribution, the C header is in the package folder.
HEADER = next(path for path in (HERE / "shmformat" / "shmformat.h", HERE.parent / "c" / "include" / "shmformat.h")
              if path.exists())


def version():
    text = HEADER.read_text(encoding="utf-8")
    return ".".join(re.search(rf"#define SHMF_VERSION_{part} (\d+)", text)[1] for part in ("MAJOR", "MINOR", "PATCH"))


class WithLibrary(build_py):
    def run(self):
        super().run()
        into = Path(self.build_lib) / "shmformat"
        shutil.copyfile(HEADER, into / HEADER.name)
        runpy.run_path(str(HERE / "shmformat" / "_declarations.py"))["write_table"](HEADER, into / "_table.py")
        if NAMED or LIBRARY.exists():
            shutil.copyfile(LIBRARY, into / "libshmformat_c.so.1")


class WithHeader(sdist):
    def make_release_tree(self, base_dir, files):
        super().make_release_tree(base_dir, files)
        shutil.copyfile(HEADER, Path(base_dir) / "shmformat" / HEADER.name)


class OfThePlatform(bdist_wheel):
    def finalize_options(self):
        super().finalize_options()
        self.root_is_pure = False

    def get_tag(self):
        return "py3", "none", super().get_tag()[2]


class Binary(Distribution):
    def has_ext_modules(self):
        return True


setup(version=version(), distclass=Binary,
      cmdclass={"build_py": WithLibrary, "sdist": WithHeader, "bdist_wheel": OfThePlatform})
