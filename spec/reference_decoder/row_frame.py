"""Section 29: the frame of row hexahedra, and orientations."""

from .surface import CORNER_BITS, FACE_CORNERS, odd

SIDE_AXIS = (4, 1, 2, 1, 2, 4)
SIDE_HIGH = (0, 0, 0, 1, 1, 1)
FACE_BITS = [[CORNER_BITS[c] for c in corners] for corners in FACE_CORNERS]
AXES = ((1, 2, 4), (2, 4, 1), (4, 1, 2), (2, 1, 4), (1, 4, 2), (4, 2, 1))


def holds(side, corner):
    return bool(corner & SIDE_AXIS[side]) == bool(SIDE_HIGH[side])


ADJACENT_FACE = [[next(s for s in range(6)
                       if s != k and holds(s, FACE_BITS[k][i]) and holds(s, FACE_BITS[k][(i + 1) % 4]))
                  for i in range(4)] for k in range(6)]
_SIDE_ALONG = {(SIDE_AXIS[s], SIDE_HIGH[s]): s for s in range(6)}


def side_along(a, b):
    return _SIDE_ALONG[a ^ b, int(bool(b & (a ^ b)))]


def _stored(o, b):
    x, y, z = AXES[o % 6]
    return o // 6 ^ (x if b & 1 else 0) ^ (y if b & 2 else 0) ^ (z if b & 4 else 0)


STORED = [[_stored(o, b) for b in range(8)] for o in range(48)]


def is_mirrored(o):
    return odd(o // 6) != (o % 6 >= 3)


def stored_side(o, k):
    corners = {STORED[o][b] for b in FACE_BITS[k]}
    return next(s for s in range(6) if corners == set(FACE_BITS[s]))
