"""A line of text, piece by piece with the role of each piece."""

from dataclasses import dataclass
from typing import Literal

Role = Literal["plain", "name", "good", "bad", "odd", "quiet"]


@dataclass(frozen=True)
class Piece:
    """Text of one role; a reporter chooses how the role looks."""

    text: str
    role: Role = "plain"


Line = tuple[Piece, ...]
