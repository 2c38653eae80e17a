"""Sections 1 to 4: conventions, checksums, packed blobs; and the one error of this decoder."""

import ctypes
import ctypes.util
import os
import struct

MASK32 = 2**32 - 1
MASK64 = 2**64 - 1


class ShmError(Exception):
    """What is wrong with a file: the cause, the section of the file, and the byte where it is."""

    def __init__(self, cause, section="", offset=None):
        super().__init__(cause)
        self.cause, self.section, self.offset = cause, section, offset

    def __str__(self):
        where = f" in {self.section}" if self.section else ""
        if self.offset is not None:
            where += f" at byte {self.offset}"
        return f"{self.cause}{where}"


def reject(cause):
    raise ShmError(cause)


def reject_unless(condition, cause):
    if not condition:
        raise ShmError(cause)


# ---------------------------------------------------------------------------- 1 Conventions


def signed64(value):
    """An integer modulo 2^64, as a signed number."""
    value &= MASK64
    return value - 2**64 if value >> 63 else value


def towards_zero(a, b):
    """a / b on integers; b above 0."""
    return -(-a // b) if a < 0 else a // b


def unzigzag(value):
    return (value >> 1) ^ -(value & 1)


class Cursor:
    """Reads the fields of a payload, one after the other. `base` is where the payload begins in the file."""

    def __init__(self, data, base=0, section=""):
        self.data, self.at, self.base, self.section = data, 0, base, section

    def fail(self, cause):
        raise ShmError(cause, self.section, self.base + self.at)

    def left(self):
        return len(self.data) - self.at

    def take(self, count):
        if count > self.left():
            self.fail("bytes are missing")
        self.at += count
        return self.data[self.at - count : self.at]

    def rest(self):
        return self.take(self.left())

    def end(self):
        if self.left():
            self.fail("bytes are left over")

    def u8(self):
        return self.take(1)[0]

    def u32(self):
        return int.from_bytes(self.take(4), "little")

    def f64(self):
        return struct.unpack("<d", self.take(8))[0]

    def short_number(self):
        count = self.u8()
        if count > 8:
            self.fail("a number of more than 8 bytes")
        return struct.unpack(">d", bytes(self.take(count)) + bytes(8 - count))[0]

    def varint(self):
        value = 0
        for place in range(10):
            byte = self.u8()
            value |= (byte & 127) << (7 * place)
            if byte < 128:
                if value > MASK64:
                    self.fail("a varint of more than 64 bits")
                return value
        self.fail("a varint of more than ten bytes")

    def varint32(self):
        value = self.varint()
        if value > MASK32:
            self.fail("a number of more than 32 bits")
        return value

    def svarint(self):
        return unzigzag(self.varint())

    def text(self):
        return bytes(self.take(self.varint()))

    def list_of(self, read):
        count = self.varint()
        if count > self.left():
            self.fail("a list of more entries than there are bytes")
        return [read() for _ in range(count)]


# The scalar types: their names, and the letters of `struct`.
SCALAR_NAMES = (None, "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64")
SCALAR_CODES = (None, "b", "B", "h", "H", "i", "I", "q", "Q", "f", "d")
SCALAR_BYTES = (None, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8)
FLOAT32, FLOAT64 = 9, 10

(OTHER, VERTEX, LINE, TRIANGLE, QUAD, POLYGON, TETRAHEDRON, PYRAMID, WEDGE, HEXAHEDRON, POLYHEDRON,
 FACES) = range(12)
SHAPE_NAMES = ("other", "vertex", "line", "triangle", "quad", "polygon", "tetrahedron", "pyramid", "wedge",
               "hexahedron", "polyhedron", "faces")
(LAGRANGE, SERENDIPITY, BEZIER) = range(3)
SCHEME_NAMES = ("lagrange", "serendipity", "bezier")

# ---------------------------------------------------------------------------- 3 Checksums


def _library(name, file_name):
    """zstd and xxHash are not described in the text but in RFC 8878 and in xxHash's own specification, so that the
    libraries, which libshmformat needs too, are taken as they are."""
    try:
        return ctypes.CDLL(file_name)
    except OSError:
        found = ctypes.util.find_library(name)
        if not found:
            raise SystemExit(f"reference_decoder: lib{name} is missing") from None
        return ctypes.CDLL(found)


_xxhash = _library("xxhash", "libxxhash.so.0")
_xxhash.XXH64.restype = ctypes.c_uint64
_xxhash.XXH64.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_uint64]


def xxh64(data):
    return _xxhash.XXH64(bytes(data), len(data), 0)


def checksum(data):
    return xxh64(data) & MASK32


# ---------------------------------------------------------------------------- 4 Packed blobs


class _Buffer(ctypes.Structure):
    _fields_ = [("place", ctypes.c_void_p), ("size", ctypes.c_size_t), ("at", ctypes.c_size_t)]


_zstd = _library("zstd", "libzstd.so.1")
_zstd.ZSTD_createDCtx.restype = ctypes.c_void_p
_zstd.ZSTD_freeDCtx.argtypes = [ctypes.c_void_p]
_zstd.ZSTD_DCtx_setParameter.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_int]
_zstd.ZSTD_decompressStream.restype = ctypes.c_size_t
_zstd.ZSTD_decompressStream.argtypes = [ctypes.c_void_p, ctypes.POINTER(_Buffer), ctypes.POINTER(_Buffer)]
_zstd.ZSTD_DCtx_loadDictionary.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_size_t]
_zstd.ZSTD_getFrameContentSize.restype = ctypes.c_ulonglong
_zstd.ZSTD_getFrameContentSize.argtypes = [ctypes.c_char_p, ctypes.c_size_t]
_WINDOW_LOG_MAX = 100  # ZSTD_d_windowLogMax
MOST_WITH_DICTIONARY = 2**20
MOST_ANYWAY, MOST_FOR_EACH_BYTE = 2**24, 256


ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"


def dictionary():
    """That of method 3: two files beside this text."""
    folder = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    whole = b""
    for name in ("dictionary_tables.bin", "dictionary.txt"):
        with open(os.path.join(folder, name), "rb") as file:
            whole += file.read()
    return whole


def stated_size(frame):
    """Of the content of a zstd frame; nothing where it states none, or is no frame."""
    size = _zstd.ZSTD_getFrameContentSize(frame, len(frame))
    return size if size < 2**64 - 2 else None


def zstd_frame(data, size, with_=b""):
    """What one zstd frame holds, which must be `size` bytes, and all of `data`. `with_`: a dictionary."""
    data = bytes(data)
    reject_unless(data[:4] == ZSTD_MAGIC, "no zstd frame")  # a skippable one begins otherwise
    context = _zstd.ZSTD_createDCtx()
    try:
        _zstd.ZSTD_DCtx_setParameter(context, _WINDOW_LOG_MAX, 27)
        _zstd.ZSTD_DCtx_loadDictionary(context, with_, len(with_))
        piece = ctypes.create_string_buffer(2**17)
        source = _Buffer(ctypes.cast(ctypes.c_char_p(data), ctypes.c_void_p), len(data), 0)
        unpacked = bytearray()
        while True:
            target = _Buffer(ctypes.cast(piece, ctypes.c_void_p), len(piece), 0)
            before = source.at
            state = _zstd.ZSTD_decompressStream(context, ctypes.byref(target), ctypes.byref(source))
            reject_unless(not _zstd.ZSTD_isError(ctypes.c_size_t(state)), "a damaged zstd frame")
            unpacked += piece.raw[: target.at]
            reject_unless(len(unpacked) <= size, "a zstd frame of more bytes than stated")
            if state == 0:
                break
            reject_unless(target.at or source.at > before, "a zstd frame that was cut")
        reject_unless(source.at == len(data), "bytes behind a zstd frame")
        reject_unless(len(unpacked) == size, "a zstd frame of fewer bytes than stated")
        return bytes(unpacked)
    finally:
        _zstd.ZSTD_freeDCtx(context)


def from_planes(planes, width):
    """Bytes that were dealt out to `width` planes."""
    blob = bytearray(len(planes))
    at = 0
    for plane in range(width):
        count = len(range(plane, len(planes), width))
        if not count:
            break
        blob[plane::width] = planes[at : at + count]
        at += count
    return bytes(blob)


def packed_blob(cursor, bounded=False):
    """`bounded`: whether it may unpack to no more than the format allows."""
    packed = cursor.left()
    method = cursor.u8()
    if method == 3:
        frame = ZSTD_MAGIC + bytes(cursor.rest())
        size = stated_size(frame)
        if size is None or size > MOST_WITH_DICTIONARY:
            cursor.fail("a blob of no size, or too large for the dictionary")
        return zstd_frame(frame, size, dictionary())
    size = cursor.varint()
    if bounded and size > MOST_ANYWAY + MOST_FOR_EACH_BYTE * packed:
        cursor.fail("a blob that unpacks to more than its bytes may")
    if method == 0:
        blob = cursor.rest()
        if len(blob) != size:
            cursor.fail("a blob of another size than stated")
        return blob
    if method not in (1, 2):
        cursor.fail("an unknown method of packing")
    width = cursor.u8() if method == 2 else 1
    if width == 0:
        cursor.fail("planes of no bytes")
    return from_planes(zstd_frame(cursor.rest(), size), width)
