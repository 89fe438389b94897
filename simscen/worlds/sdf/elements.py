"""XML elements of SDF files, and the values in them. Functions raise UnusableElement if a value is invalid."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from typing_extensions import Self

from simscen.assets import markup
from simscen.core.geometry import Pose3
from simscen.worlds.sdf.report import OutOfReach, SourceLocation, UnusableElement

MAX_NAME_LENGTH = 120
"""Maximum number of characters of the name of a model, link or frame. In messages, longer tags and names are cut."""
STAGE_HINT = "an SDF world is XML; a world of Stage is not, so use its floor plan as a ROS map instead"
"""Hint for a file without XML tags."""
MAX_COORDINATE_M = 1e4
"""Maximum absolute value of coordinates and sizes."""


@dataclass(eq=False, slots=True)
class Element(markup.Element):
    """An element of an SDF file or of a file that it includes."""

    @property
    def text(self) -> str:
        """Text of the element, without the text of its children."""
        return "".join(self.text_parts).strip()

    @property
    def path(self) -> str:
        """Path without the root element, for example world[default]/model[shelf]/link[link]."""
        segment = f"{_printable(self.tag)}[{_printable(self.name)}]" if self.name else _printable(self.tag)
        return f"{self.parent.path}/{segment}" if self.parent and self.parent.parent else segment

    @property
    def location(self) -> SourceLocation:
        """Position in the file, for messages."""
        return SourceLocation(self.source.name, self.line, self.col, self.path, self.source.line(self.line))

    def descendants(self) -> Iterator[Self]:
        """Yield all elements below this one, in document order."""
        for child in self.children:
            yield child
            yield from child.descendants()

    def unusable(self, message: str, hint: str = "") -> UnusableElement:
        """Return an error about this element."""
        return UnusableElement(self.location, message, hint)


def parse(data: bytes, file: str, folder: str) -> Element:
    """Return the root element of an XML text. Raises UnusableElement if the text is not well-formed or not allowed.

    `file` is the name of the file for messages, `folder` the folder to which its relative paths refer.
    """
    try:
        return markup.parse(data, markup.Source.of(data, file, folder), Element)
    except markup.MalformedXml as error:
        location = SourceLocation(file, error.line, error.col, source=error.source)
        is_text_without_tags = bool(data.strip()) and b"<" not in data and b"\0" not in data
        raise UnusableElement(location, error.message, STAGE_HINT if is_text_without_tags else error.hint) from error


def _printable(name: str) -> str:
    """Return a name with control characters escaped and at most MAX_NAME_LENGTH characters."""
    printable = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in name)
    return printable if len(printable) <= MAX_NAME_LENGTH else f"{printable[:MAX_NAME_LENGTH]}…"


def read_numbers(element: Element, *counts: int) -> tuple[float, ...]:
    """Return the finite numbers in the text of an element. `counts` are the allowed numbers of numbers."""
    words = element.text.split()
    if len(words) not in counts:
        raise element.unusable(f"expected {' or '.join(map(str, counts))} numbers, got {len(words)}")
    try:
        return tuple(_number(word) for word in words)
    except ValueError as error:
        hint = "xacro expressions are not expanded: run xacro first" if "$" in element.text else ""
        raise element.unusable(str(error), hint) from error


def _number(word: str) -> float:
    """Return a finite number. Raises ValueError for other words."""
    try:
        value = math.nan if "_" in word else float(word)
    except ValueError as error:
        raise ValueError(f"expected a number, got {word[:40]!r}") from error
    if not math.isfinite(value):
        raise ValueError(f"must be a finite number, got {word[:40]!r}")
    return value


def read_sizes(
    parent: Element,
    tag: str,
    count: int,
    default: Sequence[float] | None = None,
    max_size: float = MAX_COORDINATE_M,
) -> tuple[float, ...]:
    """Return `count` positive lengths in m, each at most `max_size`, from the child `tag`.

    Without such a child, returns `default`, or raises UnusableElement if there is no default.
    """
    element = parent.child(tag)
    if element is None:
        if default is None:
            raise parent.unusable(f"<{tag}> is missing")
        return tuple(default)
    sizes = read_numbers(element, count)
    if any(size <= 0 for size in sizes):
        raise element.unusable(f"must be positive, got {element.text}")
    if any(size > max_size for size in sizes):
        raise element.unusable(f"larger than {max_size:g} m")
    return sizes


def read_size(parent: Element, tag: str) -> float:
    """Return one positive length in m from the required child `tag`."""
    return read_sizes(parent, tag, 1)[0]


def read_positive(parent: Element, tag: str) -> float:
    """Return one positive number of any unit from the required child `tag`."""
    return read_sizes(parent, tag, 1, max_size=math.inf)[0]


def read_bool(element: Element | None, default: bool = False) -> bool:
    """Return the boolean in the text of an element, see `parse_bool`; `default` without an element."""
    return default if element is None else parse_bool(element.text, element)


def parse_bool(word: str, element: Element) -> bool:
    """Return the boolean in the text or an attribute of `element`: 1, 0, true, or false in any capitalization."""
    word = word.strip().lower()
    if word not in ("0", "1", "true", "false"):
        raise element.unusable(f"expected true or false, got {word[:40]!r}")
    return word in ("1", "true")


def checked_name(element: Element, name: str | None = None) -> str:
    """Return the `name` attribute of an element, or `name` if given. Raises UnusableElement for an invalid name."""
    name = element.name if name is None else name
    if not name:
        raise element.unusable(f"<{element.tag}> has no name")
    if len(name) > MAX_NAME_LENGTH:
        raise element.unusable(f"the name is longer than {MAX_NAME_LENGTH} characters")
    if not name.isprintable():
        raise element.unusable("control character in the name")
    return name


def reference_frame(pose: Element | None) -> str:
    """Return the attribute `relative_to` (before SDF 1.7: `frame`) of a `<pose>`; "" if it is missing."""
    if pose is None:
        return ""
    return pose.attributes.get("relative_to", pose.attributes.get("frame", ""))


def read_pose(element: Element | None) -> Pose3:
    """Return the pose in a `<pose>`: x y z and roll pitch yaw, or x y z and a quaternion x y z w.

    Returns the identity if there is no `<pose>`, or if it is empty.

    As in Gazebo Classic, the yaw may be missing if roll and pitch are 0; published worlds contain such poses. Source:
    SDF specification, "Specifying pose in SDFormat". Raises OutOfReach if a coordinate exceeds MAX_COORDINATE_M.
    """
    if element is None or not element.text:
        return Pose3()
    rotation_format = element.attributes.get("rotation_format", "euler_rpy")
    in_degrees = parse_bool(element.attributes.get("degrees", "false"), element)
    if rotation_format == "quat_xyzw":
        if in_degrees:
            raise element.unusable("degrees and quat_xyzw exclude each other")
        x, y, z, *quaternion = read_numbers(element, 7)
        norm = math.hypot(*quaternion)
        if norm < 1e-9:
            raise element.unusable("zero quaternion")
        pose = Pose3(x, y, z, *(part / norm for part in quaternion))
    elif rotation_format == "euler_rpy":
        words = element.text.split()
        is_yaw_missing = len(words) == 5 and not any(word.strip("-.0") for word in words[3:])
        x, y, z, *angles = (*read_numbers(element, 5), 0.0) if is_yaw_missing else read_numbers(element, 6)
        roll, pitch, yaw = (math.radians(angle) if in_degrees else angle for angle in angles)
        pose = Pose3.from_rpy(x, y, z, roll, pitch, yaw)
    else:
        raise element.unusable(f"unknown rotation_format {rotation_format[:40]!r}: expected euler_rpy or quat_xyzw")
    if any(abs(coordinate) > MAX_COORDINATE_M for coordinate in pose.position):
        raise OutOfReach(element.location, f"farther than {MAX_COORDINATE_M:g} m from its frame")
    return pose
