"""A sample of the corpus: of the files, one in SHM_SHARE (all, if it is not set), by a hash of name and SHM_SEED."""
import os
import zlib

SHARE = int(os.environ.get("SHM_SHARE") or 1)
SEED = os.environ.get("SHM_SEED", "")


def sample_of(paths):
    """Returns the paths that belong to this run's sample. Every path is in the sample of some seeds."""
    return [path for path in paths if is_sampled(path)]


def is_sampled(path):
    folder_and_name = "/".join(str(path).split(os.sep)[-2:])
    return zlib.crc32(f"{SEED} {folder_and_name}".encode()) % SHARE == 0
