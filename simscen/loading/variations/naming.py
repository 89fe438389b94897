"""Derive names of variations from the values that differ, such as `speed=0.5,mass=10`, and check given names.

Names are short, unique, and valid as names of folders.
"""

import re
from collections import Counter
from collections.abc import Sequence

from simscen.loading.schema.messages import quoted
from simscen.loading.variations.paths import Target, split_path
from simscen.loading.yaml.tree import MappingNode, Node, ScalarNode, SequenceNode

MAX_NAME_CHARS, _MAX_VALUE_CHARS = 100, 40
"""Largest length of a name, and of a value in it."""
_VALID_NAME = re.compile(r"[^\W][\w.,=+%-]*")
_NUMBERED = re.compile(r"variation-([1-9][0-9]{0,8})")
_UNSAFE_CHARS = re.compile(r"[^\w.+%-]+")


def name_error(name: str) -> str | None:
    """Return why a name of a variation is invalid; None if it is valid."""
    if len(name) <= MAX_NAME_CHARS and _VALID_NAME.fullmatch(name):
        return None
    return f"{quoted(name)} is not a valid name of a variation"


NAME_HINT = (
    f"up to {MAX_NAME_CHARS} letters, digits, `_`, `.`, `,`, `=`, `+`, `-` and `%`, starting with a letter or digit"
)


def short_names(targets: Sequence[Target]) -> dict[str, str]:
    """Return a short unique name for each path: its last part, with as many parts before it as are needed."""
    parts = {target.path: split_path(target.path) for target in targets}
    part_counts = dict.fromkeys(parts, 1)
    while True:
        short = {path: ".".join(parts[path][-count:]) for path, count in part_counts.items()}
        occurrences = Counter(short.values())
        ambiguous = [
            path for path, name in short.items() if occurrences[name] > 1 and part_counts[path] < len(parts[path])
        ]
        if not ambiguous:
            return {path: _safe(name) for path, name in short.items()}
        part_counts |= {path: part_counts[path] + 1 for path in ambiguous}


def derive_name(keys: dict[str, str], values: dict[str, Node], numbers: dict[str, int], number: int) -> str:
    """Return the derived name of the variation with this `number`: `speed=0.5,mass=10`.

    `keys` has the short name of each path, `values` its value, and `numbers` the number of this value among the values
    of the path. A value that is too long is replaced by its number. If the whole name is too long, the number of the
    variation is its name.
    """
    name = ",".join(f"{keys[path]}={_value(value) or f'no{numbers[path]}'}" for path, value in values.items())
    name = name if name[:1].isalnum() else f"x{name}"
    return name if len(name) <= MAX_NAME_CHARS else numbered_name(number)


def numbered_name(number: int) -> str:
    """Return the name of a variation by its number from 1: `variation-7`."""
    return f"variation-{number}"


def number_of(name: str) -> int | None:
    """Return the number of a variation called `variation-7`; None for another name."""
    match = _NUMBERED.fullmatch(name)
    return int(match[1]) if match else None


def make_unique(names: Sequence[str], is_fixed: Sequence[bool]) -> list[str]:
    """Return the names, made unique without regard to case.

    Names for which `is_fixed` is true were given by the author and stay. Another name that is already used gets a
    suffix: `+2`, `+3`, …
    """
    taken = {name.casefold() for name, fixed in zip(names, is_fixed, strict=True) if fixed}
    found = []
    for name, fixed in zip(names, is_fixed, strict=True):
        candidate, number = name, 2
        while not fixed and candidate.casefold() in taken:
            candidate, number = f"{name}+{number}", number + 1
        taken.add(candidate.casefold())
        found.append(candidate)
    return found


def _value(node: Node) -> str:
    """Return a value as part of a name; "" if it is too long or has nested values."""
    match node:
        case ScalarNode(value=value):
            text = (
                str(value).lower()
                if isinstance(value, bool)
                else f"{value:.6g}"
                if isinstance(value, float)
                else str(value)
            )
        case SequenceNode(items=items) if all(isinstance(item, ScalarNode) for item in items):
            text = "_".join(map(_value, items))
        case MappingNode(entries=entries) if all(isinstance(entry.value, ScalarNode) for entry in entries.values()):
            text = "_".join(_value(entry.value) for entry in entries.values())
        case _:
            return ""
    return text if len(text := _safe(text)) <= _MAX_VALUE_CHARS else ""


def _safe(text: str) -> str:
    """Return a text without spaces, and with `_` for characters that are not allowed in names."""
    return _UNSAFE_CHARS.sub("_", text.replace(" ", "")).strip("_")
