"""What becomes of a parameter of Nav2 in the reference stack."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

Path = tuple[str, ...]
"""Keys below `stack:`."""
Parameters = Mapping[str, Any]
"""`obstacle_layer.scan.topic` → value, of one node."""
Known = Mapping[str, Sequence[str]]
"""Our parameters by section, or by the type of what is in it; `a.b` is `b` in the mapping `a`."""


@dataclass(frozen=True)
class Found:
    """A parameter of Nav2, and where it belongs in a stack.

    `why` is what there is to tell of it; without a path and a reason it is as it is here, and no word is lost on it.
    What begins with `covers` has the same fate.
    """

    node: str
    parameter: str
    path: Path
    value: Any
    why: str = ""
    covers: str | None = None


def same(node: str, name: str, value: Any, section: Path, known: Sequence[str], own: str = "") -> Iterator[Found]:
    """A parameter that is called here as there, or `own`, if there is one; `a.b` is `b` in the mapping `a`."""
    here = own or name
    if here in known:
        yield Found(node, name, (*section, *here.split(".")), value)


def strings(value: Any) -> list[str]:
    """The names in a list, of which there are none where it is no list."""
    return [str(one) for one in value] if isinstance(value, list) else []


def below(parameters: Parameters, name: str) -> Iterator[tuple[str, Any]]:
    """What stands below a name, called from there."""
    for key, value in parameters.items():
        if name and key.startswith(f"{name}."):
            yield key.removeprefix(f"{name}."), value
