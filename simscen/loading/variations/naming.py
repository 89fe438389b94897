"""What variations are called: by the values that differ, short, unique, and safe as the name of a folder."""

import re
from collections import Counter
from collections.abc import Sequence

from simscen.loading.schema.messages import quoted
from simscen.loading.variations.paths import Target, split_path
from simscen.loading.yaml.tree import MappingNode, Node, ScalarNode, SequenceNode

MAX_NAME_CHARS, _LONGEST_VALUE = 100, 40
_GIVEN = re.compile(r"[^\W][\w.,=+%-]*")
_UNSAFE = re.compile(r"[^\w.+%-]+")


def name_error(name: str) -> str | None:
    """Why a name that was given to a variation cannot be one; None for a good one."""
    if len(name) <= MAX_NAME_CHARS and _GIVEN.fullmatch(name):
        return None
    return f"{quoted(name)} cannot be the name of a variation"


NAME_HINT = (
    f"up to {MAX_NAME_CHARS} letters, digits, `_`, `.`, `,`, `=`, `+`, `-` and `%`, with a letter or digit first"
)


def short_names(targets: Sequence[Target]) -> dict[str, str]:
    """A short name for each path as written: its last part, and as many more before it as tell it from the others."""
    parts = {target.path: split_path(target.path) for target in targets}
    named = dict.fromkeys(parts, 1)
    while True:
        short = {path: ".".join(parts[path][-count:]) for path, count in named.items()}
        times = Counter(short.values())
        again = [path for path, name in short.items() if times[name] > 1 and named[path] < len(parts[path])]
        if not again:
            return {path: _safe(name) for path, name in short.items()}
        named |= {path: named[path] + 1 for path in again}


def derive_name(keys: dict[str, str], values: dict[str, Node], numbers: dict[str, int], number: int) -> str:
    """The name of a variation that was given none: `speed=0.5,mass=10`.

    `numbers` are those of the values in their lists, for what cannot be told in short; `number` is the variation's.
    """
    name = ",".join(f"{keys[path]}={_value(value) or f'no{numbers[path]}'}" for path, value in values.items())
    name = name if name[:1].isalnum() else f"x{name}"
    return name if len(name) <= MAX_NAME_CHARS else f"variation-{number}"


def make_unique(names: Sequence[str], given: Sequence[bool]) -> list[str]:
    """The names, those that were derived with a number behind them where another differs by case at most."""
    taken = {name.casefold() for name, fixed in zip(names, given, strict=True) if fixed}
    found = []
    for name, fixed in zip(names, given, strict=True):
        candidate, number = name, 2
        while not fixed and candidate.casefold() in taken:
            candidate, number = f"{name}+{number}", number + 1
        taken.add(candidate.casefold())
        found.append(candidate)
    return found


def _value(node: Node) -> str:
    """A value in short; "" where that cannot be."""
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
    return text if len(text := _safe(text)) <= _LONGEST_VALUE else ""


def _safe(text: str) -> str:
    return _UNSAFE.sub("_", text.replace(" ", "")).strip("_")
