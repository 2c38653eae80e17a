"""Reads byte ranges of remote files, with a cache of recently fetched bytes.

The library announces the ranges that it will read. Ranges with a gap of less than 64 KB between them are fetched as
one range. One request fetches several ranges if the server supports this. http and https use Python's own client and
a single connection. Other protocols need the package fsspec.
"""
from __future__ import annotations

import http.client
import re
import urllib.parse
from bisect import bisect_right
from collections.abc import Sequence
from typing import Protocol

from ._library import Error

_NEAR = 1 << 16  # Maximum gap in bytes: ranges with a smaller gap between them are fetched as one range.
_MOST_AT_ONCE = 16 << 20  # Maximum total size, in bytes, of the ranges in one request.
_MOST_RANGES = 64  # Maximum number of ranges in one request.
_MOST_OF_HEADERS = 1 << 12  # Maximum size in bytes of the headers of each part of a response.
_MOST_KEPT = 64 << 20  # Maximum size of the cache in bytes.
_MOST_PIECES = 1 << 12  # Maximum number of pieces in the cache.
_MOST_REDIRECTS = 5

Range = tuple[int, int]  # offset of the first byte of the range, and offset of the byte after its final byte


def _error(url: str, sentence: str) -> Error:
    return Error("io", sentence, message=f"{url}: {sentence}")


class Ranges(Protocol):
    """A source of byte ranges."""

    size: int

    def fetch(self, ranges: Sequence[Range]) -> list[bytes]:
        """Returns the bytes of each range. The ranges must be in ascending order and must not touch each other."""

    def close(self) -> None: ...


class _Http:
    """A file on a server, read over one connection. The first request fetches the end of the file; the response also
    contains the size of the file."""

    def __init__(self, url: str):
        self._url = self._first_url = url
        self._connection: http.client.HTTPConnection | None = None
        self._version: str | None = None  # ETag or Last-Modified of the first response
        self._gives_many = True  # true until the server ignores a request for several ranges
        try:
            status, headers, self.tail = self._follow(f"bytes=-{_NEAR}")
            if status == 416 or (status == 200 and headers.get("Content-Length") == "0"):
                raise _error(url, "the file is empty")
            self.size = self._total(status, headers)
        except Error:
            self.close()
            raise
        self._version = self._version_of(headers)

    def _total(self, status: int, headers: http.client.HTTPMessage) -> int:
        if status == 200 and self.tail:
            return len(self.tail)  # the response contains the whole file, which is small
        if status == 200:
            raise _error(self._url, "the server does not support byte ranges")
        found = re.fullmatch(r"bytes (\d+)-(\d+)/(\d+)", headers.get("Content-Range", ""))
        if status != 206 or found is None:
            raise _error(self._url, f"the server answers {status} {http.client.responses.get(status, '')}".rstrip())
        first, last, total = map(int, found.groups())
        if last - first + 1 != len(self.tail) or last + 1 != total:
            raise _error(self._url, "the server did not return the requested bytes")
        return total

    @staticmethod
    def _version_of(headers: http.client.HTTPMessage) -> str | None:
        return headers.get("ETag") or headers.get("Last-Modified")

    def _follow(self, wanted: str, most: int = _NEAR) -> tuple[int, http.client.HTTPMessage, bytes]:
        for _ in range(_MOST_REDIRECTS):
            status, headers, body = self._request(wanted, most)
            if status not in (301, 302, 303, 307, 308) or not headers.get("Location"):
                return status, headers, body
            self.close()
            self._url = urllib.parse.urljoin(self._url, headers["Location"])
        raise _error(self._url, "the server redirects without end")

    def _request(self, wanted: str, most: int = _NEAR) -> tuple[int, http.client.HTTPMessage, bytes]:
        """Sends a request, and returns the status, headers and body of the response. Reads at most `most` + 1 bytes
        of the body."""
        parts = urllib.parse.urlsplit(self._url)
        if parts.scheme not in ("http", "https") or not parts.netloc:
            raise _error(self._url, "without fsspec only http and https can be read")
        target = urllib.parse.urlunsplit(("", "", parts.path or "/", parts.query, ""))
        for fresh in (self._connection is None, True):
            if self._connection is None:
                kind = http.client.HTTPSConnection if parts.scheme == "https" else http.client.HTTPConnection
                self._connection = kind(parts.netloc, timeout=60)
            try:
                self._connection.request("GET", target, headers={"Range": wanted, "Accept-Encoding": "identity"})
                answer = self._connection.getresponse()
                if answer.status == 200 and int(answer.headers.get("Content-Length") or _NEAR + 1) > _NEAR:
                    self.close()  # the server ignored the range and sends the whole large file
                    return answer.status, answer.headers, b""
                body = answer.read(most + 1)
                if len(body) > most:
                    self.close()
                elif answer.length:
                    raise http.client.IncompleteRead(body, answer.length)
                return answer.status, answer.headers, body
            except (OSError, ValueError, http.client.HTTPException) as why:
                self.close()
                # if a reused connection fails, try a new connection: the server may have closed the idle connection
                if fresh:
                    raise _error(self._url, f"the connection failed: {why or type(why).__name__}") from why
        raise AssertionError("unreachable")

    def fetch(self, ranges: Sequence[Range]) -> list[bytes]:
        if len(ranges) > 1 and self._gives_many:
            bodies = self._fetch_many(ranges)
            if bodies is not None:
                return bodies
            self._gives_many = False
        return [self._fetch(first, end) for first, end in ranges]

    def _answer(self, wanted: str, most: int) -> tuple[int, http.client.HTTPMessage, bytes]:
        status, headers, body = self._request(wanted, most)
        if status in (301, 302, 303, 307, 308, 401, 403) and self._url != self._first_url:
            self.close()  # the redirected URL may have expired: start again from the original URL
            self._url = self._first_url
            status, headers, body = self._follow(wanted, most)
        if status in (206, 412, 416) and self._version_of(headers) not in (None, self._version):
            raise _error(self._url, "the file on the server has changed")
        return status, headers, body

    def _fetch(self, first: int, end: int) -> bytes:
        status, headers, body = self._answer(f"bytes={first}-{end - 1}", end - first)
        if status == 200:
            raise _error(self._url, "the server no longer supports byte ranges")
        if status != 206:
            raise _error(self._url, f"the server answers {status} {http.client.responses.get(status, '')}".rstrip())
        if headers.get("Content-Range") != f"bytes {first}-{end - 1}/{self.size}" or len(body) != end - first:
            raise _error(self._url, "the server did not return the requested bytes")
        return body

    def _fetch_many(self, ranges: Sequence[Range]) -> list[bytes] | None:
        """Fetches several ranges in one request. Returns None if the server does not support this."""
        most = sum(end - first + _MOST_OF_HEADERS for first, end in ranges) + _MOST_OF_HEADERS
        status, headers, body = self._answer("bytes=" + ",".join(f"{first}-{end - 1}" for first, end in ranges), most)
        if status != 206 or headers.get_content_type() != "multipart/byteranges":
            return None
        bodies, position = [], 0
        # each part of the response consists of headers, an empty line and the bytes of one range
        for first, end in ranges:
            begin = body.find(b"\r\n\r\n", position) + 4
            wanted = rb"(?i)content-range:\s*bytes %d-%d/%d\s" % (first, end - 1, self.size)
            if begin < 4 or not re.search(wanted, body[position:begin]) or len(body) - begin < end - first:
                return None
            position = begin + end - first
            bodies.append(body[begin:position])
        return bodies

    def close(self) -> None:
        if self._connection is not None:
            self._connection.close()
        self._connection = None


class _Fsspec:
    """A file of any protocol that fsspec supports."""

    tail = b""

    def __init__(self, url: str, fsspec: object):
        self._url = url
        try:
            self._system, self._path = fsspec.core.url_to_fs(url)  # type: ignore[attr-defined]
            self.size = int(self._system.info(self._path)["size"])
        except Exception as why:  # catches all exceptions, because their types depend on the protocol
            raise _error(url, f"cannot be opened: {why or type(why).__name__}") from why

    def fetch(self, ranges: Sequence[Range]) -> list[bytes]:
        firsts, ends = zip(*ranges)
        bodies = self._system.cat_ranges([self._path] * len(ranges), list(firsts), list(ends), on_error="raise")
        if any(len(body) != end - first for body, (first, end) in zip(bodies, ranges)):
            raise _error(self._url, "the server did not return the requested bytes")
        return bodies

    def close(self) -> None:
        pass


class Remote:
    """Random access to a remote file, with a cache of the most recently fetched bytes."""

    def __init__(self, ranges: Ranges, tail: bytes = b""):
        self._ranges = ranges
        self.size = ranges.size
        # pieces in the cache, from the oldest to the newest: offset in the file, and bytes
        self._kept: list[tuple[int, bytes]] = []
        self._kept_bytes = len(tail)
        self._told: list[Range] = []  # announced ranges, ascending and disjoint
        if tail:
            self._kept.append((self.size - len(tail), tail))

    def tell(self, ranges: Sequence[Range]) -> None:
        """Announces the ranges that will be read next."""
        runs: list[Range] = []
        for first, end in sorted(ranges):
            end = min(end, self.size)
            if runs and first < runs[-1][1] + _NEAR:
                runs[-1] = (runs[-1][0], max(runs[-1][1], end))
            elif first < end:
                runs.append((first, end))
        self._told = [(first, end) for first, end in runs if not self._find(first, end - first)]

    def read_into(self, offset: int, into: memoryview) -> None:
        kept = self._find(offset, len(into))
        if kept is None:
            self._fetch(offset, offset + len(into))
            kept = self._find(offset, len(into))
            assert kept is not None
        first, body = kept
        into[:] = body[offset - first:offset - first + len(into)]

    def _find(self, offset: int, count: int) -> tuple[int, bytes] | None:
        for first, body in reversed(self._kept):
            if first <= offset and offset + count <= first + len(body):
                return first, body
        return None

    def _fetch(self, first: int, end: int) -> None:
        """Fetches the bytes from `first` to `end` - 1. The same request also fetches announced ranges that come after
        these bytes."""
        index = bisect_right(self._told, first, key=lambda told: told[0]) - 1
        told_end = self._told[index][1] if index >= 0 else 0
        ranges = [(first, max(end, min(told_end, first + _MOST_AT_ONCE)))]
        room = _MOST_AT_ONCE - (ranges[0][1] - ranges[0][0])
        for told in self._told[index + 1:]:
            if self._find(told[0], told[1] - told[0]):
                continue
            room -= told[1] - told[0]
            if room < 0 or told[0] <= ranges[-1][1] or len(ranges) == _MOST_RANGES:
                break
            ranges.append(told)
        if len(ranges) == 1:  # fetch at least _NEAR bytes, because a smaller request takes just as long
            ranges = [(first, max(ranges[0][1], min(first + _NEAR, self.size)))]
        bodies = self._ranges.fetch(ranges)
        self._kept += zip((begin for begin, _ in ranges), bodies)
        self._kept_bytes += sum(map(len, bodies))
        while self._kept_bytes > _MOST_KEPT or len(self._kept) > _MOST_PIECES:
            if len(self._kept) == len(ranges):
                break
            self._kept_bytes -= len(self._kept.pop(0)[1])
        self._told = [left for told in self._told for left in self._without(told, ranges[0])]

    @staticmethod
    def _without(told: Range, fetched: Range) -> list[Range]:
        """Returns the parts of the range `told` that are not in the range `fetched`."""
        parts = (told[0], min(told[1], fetched[0])), (max(told[0], fetched[1]), told[1])
        return [(first, end) for first, end in parts if first < end]

    def close(self) -> None:
        self._ranges.close()


def open_url(url: str) -> Remote:
    """Opens a URL. http and https are read directly; other protocols need the package fsspec."""
    try:
        import fsspec
    except ImportError:
        fsspec = None
    scheme = urllib.parse.urlsplit(url).scheme
    if fsspec is not None and scheme not in ("http", "https"):
        return Remote(_Fsspec(url, fsspec))
    ranges = _Http(url)
    return Remote(ranges, ranges.tail)
