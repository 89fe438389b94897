"""A polygon cut into convex pieces."""

from collections.abc import Sequence
from itertools import pairwise

from simscen.core.polygons import Corner, distinct, turn

Piece = tuple[Corner, ...]


def convex_pieces(ring: Sequence[Corner]) -> list[Piece]:
    """Convex anticlockwise polygons that cover a ring without a flaw exactly once; a convex one stays whole.

    Ears are clipped, then diagonals that no piece needs are taken out (Hertel and Mehlhorn, 1983): at most four times
    as many pieces as needed. Raises ValueError for a ring that crosses itself.
    """
    corners = distinct(ring)
    if sum(turn(corners[0], a, b) for a, b in pairwise(corners)) < 0:
        corners = corners[::-1]
    if _convex(corners):
        return [corners]
    return _merged(_triangles(list(corners)))


def _triangles(corners: list[Corner]) -> list[Piece]:
    """Ear clipping (Meisters, 1975)."""
    found: list[Piece] = []
    while len(corners) > 2:
        k = next((k for k in range(len(corners)) if _flat(corners, k) or _ear(corners, k)), None)
        if k is None:
            raise ValueError("the polygon crosses itself")
        if not _flat(corners, k):
            found.append(_around(corners, k))
        del corners[k]
    return found


def _around(corners: Sequence[Corner], k: int) -> tuple[Corner, Corner, Corner]:
    return corners[k - 1], corners[k], corners[(k + 1) % len(corners)]


def _flat(corners: Sequence[Corner], k: int) -> bool:
    return turn(*_around(corners, k)) == 0


def _ear(corners: Sequence[Corner], k: int) -> bool:
    """Whether the triangle at corner k lies inside, with no other corner in it."""
    a, b, c = _around(corners, k)
    if turn(a, b, c) <= 0:
        return False
    others = (corner for corner in corners if corner not in (a, b, c))
    return not any(turn(a, b, p) >= 0 and turn(b, c, p) >= 0 and turn(c, a, p) >= 0 for p in others)


def _merged(triangles: Sequence[Piece]) -> list[Piece]:
    pieces = dict(enumerate(triangles))
    owner = {edge: number for number, piece in pieces.items() for edge in _edges(piece)}
    for a, b in list(owner):
        one, other = owner.get((a, b)), owner.get((b, a))
        if one is None or other is None or one == other:
            continue
        joined = (*_from(pieces[one], b)[:-1], *_from(pieces[other], a)[:-1])
        if _convex(joined):
            pieces[one] = joined
            owner |= dict.fromkeys(_edges(pieces.pop(other)), one)
            del owner[a, b], owner[b, a]
    return list(pieces.values())


def _edges(piece: Piece) -> list[tuple[Corner, Corner]]:
    return list(zip(piece, (*piece[1:], piece[0]), strict=True))


def _from(piece: Piece, corner: Corner) -> Piece:
    """The same polygon, beginning at a corner."""
    k = piece.index(corner)
    return (*piece[k:], *piece[:k])


def _convex(corners: Sequence[Corner]) -> bool:
    """Whether an anticlockwise ring without a flaw never turns right."""
    return all(turn(*_around(corners, k)) >= 0 for k in range(len(corners)))
