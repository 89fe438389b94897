"""A line of text, piece by piece with the role of each piece."""

from dataclasses import dataclass
from typing import Literal

Role = Literal["plain", "name", "good", "bad", "odd", "quiet"]


@dataclass(frozen=True)
class Piece:
    """Text of one role; a reporter chooses how the role looks.

    `file` is what a terminal that can opens when the text is clicked; a `shell` command goes on in the next line only
    in a way that a shell understands.
    """

    text: str
    role: Role = "plain"
    file: str = ""
    shell: bool = False


Line = tuple[Piece, ...]


def text_of(line: Line) -> str:
    """The line without its roles."""
    return "".join(piece.text for piece in line).rstrip()
