"""Replacements of parts of a text."""

from collections.abc import Sequence
from typing import NamedTuple

from simscen.loading.yaml.tree import Key, dotted_path


class EditRefused(Exception):
    """An edit is impossible without changing other parts of the text; the message says why."""


class Splice(NamedTuple):
    """Replacement of `text[start:end]`."""

    start: int
    end: int
    text: str


def spliced(text: str, splices: Sequence[Splice]) -> str:
    """Return a text with all splices, which are indices of the old text and do not overlap."""
    for splice in sorted(splices, reverse=True):
        text = text[: splice.start] + splice.text + text[splice.end :]
    return text


def path_text(keys: Sequence[Key]) -> str:
    """Return keys as messages show them."""
    return f"`{dotted_path(keys)}`"


def line_start(text: str, index: int) -> int:
    """Return the index of the first character of a line."""
    return text.rfind("\n", 0, index) + 1


def line_end(text: str, index: int) -> int:
    """Return the index of the line break of a line, or the end of the text."""
    found = text.find("\n", index)
    return len(text) if found < 0 else found


def column(text: str, index: int) -> int:
    """Return the number of characters before `index` in its line."""
    return index - line_start(text, index)
