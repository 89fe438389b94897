"""Names of variations, such as `speed=0.5,mass=10`: unique, and valid as names of folders."""

import re
from collections import Counter
from collections.abc import Sequence

from simscen.loading.schema.messages import quoted
from simscen.loading.variations.options import Change
from simscen.loading.variations.paths import Target, split_path
from simscen.loading.yaml.tree import MappingNode, Node, ScalarNode, SequenceNode

MAX_NAME_CHARS = 100
"""Maximum number of characters of a name."""
MAX_NAME_BYTES = 180
"""Maximum length of a name in UTF-8. Names of folders, which also contain seed and stack, have at most 255 bytes."""
_MAX_VALUE_CHARS = 40
"""Maximum number of characters of a value in a name."""
_VALID_NAME_PATTERN = re.compile(r"[^\W][\w.,=+%-]*")
_NUMBERED_NAME_PATTERN = re.compile(r"variation-([1-9][0-9]{0,8})")
_INVALID_CHARS_PATTERN = re.compile(r"[^\w.+%-]+")


def name_error(name: str) -> str | None:
    """Return the reason why a name of a variation is invalid; None if it is valid."""
    is_short = len(name) <= MAX_NAME_CHARS and len(name.encode(errors="replace")) <= MAX_NAME_BYTES
    is_valid = is_short and _VALID_NAME_PATTERN.fullmatch(name)
    return None if is_valid else f"{quoted(name)} is not a valid name of a variation"


NAME_HINT = f"up to {MAX_NAME_CHARS} letters, digits, and `_.,=+-%`; start with a letter or digit"


def short_names(targets: Sequence[Target]) -> dict[str, str]:
    """Return a short unique name for each path, e.g. `std` or `noise.std` for the path `faults.lidar.noise.std`."""
    parts = {target.path: split_path(target.path) for target in targets}
    part_counts = dict.fromkeys(parts, 1)
    while True:
        short = {path: ".".join(parts[path][-count:]) for path, count in part_counts.items()}
        occurrences = Counter(short.values())
        longer = {path for path, count in part_counts.items() if count < len(parts[path])}
        ambiguous = [path for path, name in short.items() if occurrences[name] > 1 and path in longer]
        if not ambiguous:
            return {path: _sanitize(name) for path, name in short.items()}
        part_counts |= {path: part_counts[path] + 1 for path in ambiguous}


def derive_name(keys: dict[str, str], changes: Sequence[Change], number: int) -> str:
    """Return a name such as `speed=0.5,mass=10`; `variation-<number>` if the name would be too long.

    `keys` are the short names by path. A value that is too long is replaced by its number in the list of its path, such
    as `no3`.
    """
    values = {keys[change.target.path]: _value_text(change.value) or f"no{change.number}" for change in changes}
    name = ",".join(f"{key}={value}" for key, value in values.items())
    name = name if name[:1].isalnum() else f"x{name}"
    return name if len(name) <= MAX_NAME_CHARS else numbered_name(number)


def numbered_name(number: int) -> str:
    """Return the name of the variation with this number, e.g. `variation-7`."""
    return f"variation-{number}"


def number_of(name: str) -> int | None:
    """Return the number in a name such as `variation-7`; None for other names."""
    match = _NUMBERED_NAME_PATTERN.fullmatch(name)
    return int(match[1]) if match else None


def make_unique(names: Sequence[str], is_fixed: Sequence[bool]) -> list[str]:
    """Return the names with `+2`, `+3`, … added to repeated names, ignoring case.

    Names for which `is_fixed` is true are not changed.
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


def _value_text(node: Node) -> str:
    """Return a value as text in a name; "" if it is too long or has nested values."""
    match node:
        case ScalarNode(value=bool(value)):
            text = str(value).lower()
        case ScalarNode(value=float(value)):
            text = f"{value:.6g}"
        case ScalarNode(value=value):
            text = str(value)
        case SequenceNode(items=items) if all(isinstance(item, ScalarNode) for item in items):
            text = "_".join(map(_value_text, items))
        case MappingNode(entries=entries) if all(isinstance(entry.value, ScalarNode) for entry in entries.values()):
            text = "_".join(_value_text(entry.value) for entry in entries.values())
        case _:
            return ""
    return text if len(text := _sanitize(text)) <= _MAX_VALUE_CHARS else ""


def _sanitize(text: str) -> str:
    """Return the text without spaces, and with `_` instead of other characters that are invalid in names."""
    return _INVALID_CHARS_PATTERN.sub("_", text.replace(" ", "")).strip("_")
