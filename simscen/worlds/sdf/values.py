"""Numbers, truth values and poses as SDF writes them; every wrong one is Unusable at its element."""

import math
from collections.abc import Sequence

from simscen.core.geometry import Pose3
from simscen.worlds.sdf.markup import Element
from simscen.worlds.sdf.report import OutOfReach

FARTHEST = 1e4
"""Meters: no coordinate and no size may be larger."""
LONGEST_NAME = 120


def numbers(element: Element, *counts: int) -> tuple[float, ...]:
    """The finite numbers in an element's text; how many there may be is told by `counts`."""
    words = element.text.split()
    if len(words) not in counts:
        raise element.unusable(f"expected {' or '.join(map(str, counts))} numbers, got {len(words)}")
    try:
        values = tuple(_number(word) for word in words)
    except ValueError as error:
        raise element.unusable(str(error), _expression_hint(element.text)) from error
    return values


def _number(word: str) -> float:
    try:
        value = math.nan if "_" in word else float(word)
    except ValueError as error:
        raise ValueError(f"expected a number, got {word[:40]!r}") from error
    if not math.isfinite(value):
        raise ValueError(f"must be a finite number, got {word[:40]!r}")
    return value


def _expression_hint(text: str) -> str:
    return "xacro expressions are not expanded: run xacro first" if "$" in text else ""


def sizes(parent: Element, tag: str, count: int, default: Sequence[float] | None = None) -> tuple[float, ...]:
    """`count` positive lengths in meters from the child `tag`."""
    element = parent.child(tag)
    if element is None:
        if default is None:
            raise parent.unusable(f"<{tag}> is missing")
        return tuple(default)
    values = numbers(element, count)
    if any(value <= 0 for value in values):
        raise element.unusable(f"must be positive, got {element.text}")
    if any(value > FARTHEST for value in values):
        raise element.unusable(f"larger than {FARTHEST:g} m")
    return values


def size(parent: Element, tag: str) -> float:
    """One positive length in meters from the child `tag`."""
    return sizes(parent, tag, 1)[0]


def positive(parent: Element, tag: str) -> float:
    """One positive number from the child `tag`, whatever its unit."""
    element = parent.child(tag)
    if element is None:
        raise parent.unusable(f"<{tag}> is missing")
    value = numbers(element, 1)[0]
    if value <= 0:
        raise element.unusable(f"must be positive, got {element.text}")
    return value


def truth(element: Element | None, default: bool = False) -> bool:
    """The truth value of an element: 1, true, True, TRUE (or 0, false, …)."""
    if element is None:
        return default
    return truth_of(element.text, element)


def truth_of(word: str, element: Element) -> bool:
    """The truth value of a word that stands at `element`."""
    word = word.strip().lower()
    if word not in ("0", "1", "true", "false"):
        raise element.unusable(f"expected true or false, got {word[:40]!r}")
    return word in ("1", "true")


def name_of(element: Element, name: str | None = None) -> str:
    """The name of an element that must have one: its attribute, or `name` where that stands elsewhere."""
    name = element.name if name is None else name
    if not name:
        raise element.unusable(f"<{element.tag}> has no name")
    if len(name) > LONGEST_NAME:
        raise element.unusable(f"the name is longer than {LONGEST_NAME} characters")
    if not name.isprintable():
        raise element.unusable("control character in the name")
    return name


def relative_to(element: Element | None) -> str:
    """The frame that a `<pose>` is given in; SDF before 1.7 called the attribute `frame`."""
    if element is None:
        return ""
    return element.attributes.get("relative_to", element.attributes.get("frame", ""))


def pose(element: Element | None) -> Pose3:
    """The pose an element holds: x y z roll pitch yaw, in degrees if it says so, or x y z and a quaternion x y z w.

    Source: SDF specification, "Specifying pose in SDFormat"; `rotation_format` and `degrees` came with 1.9.
    """
    if element is None or not element.text:
        return Pose3()
    kind = element.attributes.get("rotation_format", "euler_rpy")
    degrees = truth_of(element.attributes.get("degrees", "false"), element)
    if kind == "quat_xyzw":
        result = _quaternion(element, degrees)
    elif kind == "euler_rpy":
        x, y, z, *angles = numbers(element, 6)
        roll, pitch, yaw = (math.radians(angle) if degrees else angle for angle in angles)
        result = Pose3.from_rpy(x, y, z, roll, pitch, yaw)
    else:
        raise element.unusable(f"unknown rotation_format {kind[:40]!r}: expected euler_rpy or quat_xyzw")
    if any(abs(coordinate) > FARTHEST for coordinate in result.position):
        raise OutOfReach(element.place, f"farther than {FARTHEST:g} m from its frame")
    return result


def _quaternion(element: Element, degrees: bool) -> Pose3:
    if degrees:
        raise element.unusable("degrees and quat_xyzw exclude each other")
    x, y, z, *quaternion = numbers(element, 7)
    norm = math.hypot(*quaternion)
    if norm < 1e-9:
        raise element.unusable("zero quaternion")
    return Pose3(x, y, z, *(part / norm for part in quaternion))
