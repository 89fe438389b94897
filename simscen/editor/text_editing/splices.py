"""Splices (replacements of parts of a text), and positions of lines in a text."""

from collections.abc import Sequence
from typing import NamedTuple

from simscen.loading.yaml.tree import Key, dotted_path


class EditRefused(Exception):
    """The edit is invalid, or changes other parts of the text. The message states the reason."""


class Splice(NamedTuple):
    """Replacement of the characters from `start` to `end` (exclusive) by `text`."""

    start: int
    end: int
    text: str


def apply_splices(text: str, splices: Sequence[Splice]) -> str:
    """Return a text after all splices. Splices must not overlap. The indices of all splices refer to `text`."""
    for splice in sorted(splices, reverse=True):
        text = text[: splice.start] + splice.text + text[splice.end :]
    return text


def path_text(keys: Sequence[Key]) -> str:
    """Return the path to a value for messages, e.g. "`goals[0].pose`" including backquotes."""
    return f"`{dotted_path(keys)}`"


def line_start(text: str, index: int) -> int:
    """Return the index of the first character of the line that contains `index`."""
    return text.rfind("\n", 0, index) + 1


def line_end(text: str, index: int) -> int:
    """Return the index of the line break at the end of the line that contains `index`, or the end of the text."""
    line_break = text.find("\n", index)
    return len(text) if line_break < 0 else line_break


def column(text: str, index: int) -> int:
    """Return the number of characters between the start of the line and `index`."""
    return index - line_start(text, index)
