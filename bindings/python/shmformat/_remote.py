"""Files that are far away: bytes by ranges, of a URL, with what was fetched kept for a while.

Reads that are near each other become one request: blocks of 64 KB are fetched, and more of them ahead
where reading goes on front to back. Through fsspec where it is installed, which knows many protocols;
else http and https with what Python has, over one connection.
"""
from __future__ import annotations

import http.client
import re
import urllib.parse
from collections import OrderedDict
from typing import Protocol

from ._library import Error

_BLOCK = 1 << 16
_MOST_AHEAD = 64  # blocks
_MOST_KEPT = 1024  # blocks
_MOST_REDIRECTS = 5


def _error(url: str, sentence: str) -> Error:
    return Error("io", sentence, message=f"{url}: {sentence}")


class Ranges(Protocol):
    """What gives bytes by ranges."""

    size: int

    def fetch(self, first: int, end: int) -> bytes:
        """Bytes first to end, end left out."""

    def close(self) -> None: ...


class _Http:
    """A file on a server, over one connection. The first request fetches its end, and tells its size."""

    def __init__(self, url: str):
        self._url = self._first_url = url
        self._connection: http.client.HTTPConnection | None = None
        self._version: str | None = None  # that the first answer told of
        try:
            status, headers, self.tail = self._follow(f"bytes=-{_BLOCK}")
            if status == 416 or (status == 200 and headers.get("Content-Length") == "0"):
                raise _error(url, "the file is empty")
            self.size = self._total(status, headers)
        except Error:
            self.close()
            raise
        self._version = self._version_of(headers)

    def _total(self, status: int, headers: http.client.HTTPMessage) -> int:
        if status == 200 and self.tail:
            return len(self.tail)  # all of a small file
        if status == 200:
            raise _error(self._url, "the server gives no ranges of files")
        found = re.fullmatch(r"bytes (\d+)-(\d+)/(\d+)", headers.get("Content-Range", ""))
        if status != 206 or found is None:
            raise _error(self._url, f"the server answers {status} {http.client.responses.get(status, '')}".rstrip())
        first, last, total = map(int, found.groups())
        if last - first + 1 != len(self.tail) or last + 1 != total:
            raise _error(self._url, "the server gives other bytes than it was asked for")
        return total

    @staticmethod
    def _version_of(headers: http.client.HTTPMessage) -> str | None:
        return headers.get("ETag") or headers.get("Last-Modified")

    def _follow(self, wanted: str) -> tuple[int, http.client.HTTPMessage, bytes]:
        for _ in range(_MOST_REDIRECTS):
            status, headers, body = self._request(wanted)
            if status not in (301, 302, 303, 307, 308) or not headers.get("Location"):
                return status, headers, body
            self.close()
            self._url = urllib.parse.urljoin(self._url, headers["Location"])
        raise _error(self._url, "the server sends from one place to another without end")

    def _request(self, wanted: str) -> tuple[int, http.client.HTTPMessage, bytes]:
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
                if answer.status == 200 and int(answer.headers.get("Content-Length") or _BLOCK + 1) > _BLOCK:
                    self.close()  # all of a large file
                    return answer.status, answer.headers, b""
                return answer.status, answer.headers, answer.read()
            except (OSError, ValueError, http.client.HTTPException) as why:
                self.close()
                if fresh:  # else the server had closed a connection that was idle
                    raise _error(self._url, f"the connection failed: {why or type(why).__name__}") from why
        raise AssertionError("unreachable")

    def fetch(self, first: int, end: int) -> bytes:
        wanted = f"bytes={first}-{end - 1}"
        status, headers, body = self._request(wanted)
        if status in (301, 302, 303, 307, 308, 401, 403) and self._url != self._first_url:
            self.close()  # where it was sent to may be for a while only
            self._url = self._first_url
            status, headers, body = self._follow(wanted)
        if status == 200:
            raise _error(self._url, "the server gives no ranges of files any more")
        if status in (206, 412, 416) and self._version_of(headers) not in (None, self._version):
            raise _error(self._url, "the file on the server has changed")
        if status != 206:
            raise _error(self._url, f"the server answers {status} {http.client.responses.get(status, '')}".rstrip())
        if headers.get("Content-Range") != f"bytes {first}-{end - 1}/{self.size}" or len(body) != end - first:
            raise _error(self._url, "the server gives other bytes than it was asked for")
        return body

    def close(self) -> None:
        if self._connection is not None:
            self._connection.close()
        self._connection = None


class _Fsspec:
    """A file of any protocol that fsspec knows."""

    tail = b""

    def __init__(self, url: str, fsspec: object):
        self._url = url
        try:
            self._system, self._path = fsspec.core.url_to_fs(url)  # type: ignore[attr-defined]
            self.size = int(self._system.info(self._path)["size"])
        except Exception as why:  # of any protocol, of any kind
            raise _error(url, f"cannot be opened: {why or type(why).__name__}") from why

    def fetch(self, first: int, end: int) -> bytes:
        (body,) = self._system.cat_ranges([self._path], [first], [end], on_error="raise")
        if len(body) != end - first:
            raise _error(self._url, "gives other bytes than it was asked for")
        return body

    def close(self) -> None:
        pass


class Remote:
    """Reads anywhere, and keeps the blocks that were read last."""

    def __init__(self, ranges: Ranges, tail: bytes = b""):
        self._ranges = ranges
        self.size = ranges.size
        self._blocks: OrderedDict[int, bytes] = OrderedDict()
        self._next = -1  # block behind the last that was read
        self._ahead = 0
        first = self.size - len(tail)
        for block in range(-(-first // _BLOCK), -(-self.size // _BLOCK) if tail else 0):
            self._blocks[block] = tail[block * _BLOCK - first:(block + 1) * _BLOCK - first]
        self._tail, self._tail_first = tail, first

    def read_into(self, offset: int, into: memoryview) -> None:
        if offset >= self._tail_first and self._tail:  # of a block whose beginning was not fetched, too
            into[:] = self._tail[offset - self._tail_first:offset - self._tail_first + len(into)]
            return
        first, end = offset // _BLOCK, -(-(offset + len(into)) // _BLOCK)
        self._fetch(first, end)
        for block in range(first, end):
            begin = max(offset, block * _BLOCK)
            until = min(offset + len(into), (block + 1) * _BLOCK)
            into[begin - offset:until - offset] = self._blocks[block][begin - block * _BLOCK:until - block * _BLOCK]
        while len(self._blocks) > max(_MOST_KEPT, end - first):
            self._blocks.popitem(last=False)

    def _fetch(self, first: int, end: int) -> None:
        """Blocks that are missing, and more of them where reading goes on."""
        missing = [block for block in range(first, end) if block not in self._blocks]
        goes_on = first in (self._next, self._next - 1)
        self._ahead = min(max(2 * self._ahead, 1), _MOST_AHEAD) if goes_on and missing else (self._ahead if goes_on else 0)
        self._next = end
        if missing:
            last = missing[-1] + 1
            for _ in range(self._ahead):
                if last * _BLOCK >= self.size or last in self._blocks:
                    break
                last += 1
            begin, until = missing[0] * _BLOCK, min(last * _BLOCK, self.size)
            body = self._ranges.fetch(begin, until)
            for block in range(missing[0], last):
                at = (block - missing[0]) * _BLOCK
                self._blocks[block] = body[at:at + _BLOCK]
        for block in range(first, end):
            self._blocks.move_to_end(block)

    def close(self) -> None:
        self._ranges.close()


def open_url(url: str) -> Remote:
    """Through fsspec, if it is there and knows the protocol; http and https without it, too."""
    try:
        import fsspec
    except ImportError:
        fsspec = None
    scheme = urllib.parse.urlsplit(url).scheme
    if fsspec is not None and scheme not in ("http", "https"):
        return Remote(_Fsspec(url, fsspec))
    ranges = _Http(url)
    return Remote(ranges, ranges.tail)
