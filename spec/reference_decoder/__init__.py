"""A second decoder of the .shm format, written from shm_format.md alone: see ../reference_decoder.py."""

from .basics import ShmError
from .file import File, is_archive, read_archive
from .text import text_of

__all__ = ["File", "ShmError", "is_archive", "read_archive", "text_of"]
