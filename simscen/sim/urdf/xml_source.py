"""Reads URDF and xacro files as XML elements. Errors contain the line of an element."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from typing_extensions import Self

from simscen.assets import markup
from simscen.assets.folders import AllowedFolders, UnusableFile
from simscen.core.errors import InvalidInput, Problem

URDF_ERROR_CODE = "SC400"
"""Error code of all problems in a robot's URDF."""


class InvalidElement(Exception):
    """Error in an XML element. `problem` contains the reason and the line."""

    def __init__(self, element: "Element", message: str, hint: str = "") -> None:
        self.problem = element.problem(message, hint)
        super().__init__(message)


@dataclass(eq=False, slots=True)
class Element(markup.Element):
    """An element of a URDF or xacro file."""

    def required_child(self, tag: str) -> Self:
        """Return the first child with this tag; raises InvalidElement if there is none."""
        found = self.child(tag)
        if found is None:
            raise InvalidElement(self, f"<{self.tag}> without <{tag}>")
        return found

    def text(self, attribute: str) -> str:
        """Return the text of a required attribute; raises InvalidElement if it is missing or empty."""
        if not self.attributes.get(attribute):
            raise InvalidElement(self, f'<{self.tag}> without {attribute}="…"')
        return self.attributes[attribute]

    def numbers(
        self, attribute: str, count: int, default: tuple[float, ...] | None = None, largest: float = 1e6
    ) -> tuple[float, ...]:
        """Return the numbers in an attribute, or `default` if the attribute is missing.

        Raises InvalidElement if the attribute is missing and `default` is None, or unless the attribute has `count`
        numbers, each from -`largest` to `largest`.
        """
        if attribute not in self.attributes and default is not None:
            return default
        words = self.text(attribute).split()
        try:
            values = tuple(float(word) for word in words)
        except ValueError:
            raise InvalidElement(self, f'{attribute}="{" ".join(words)[:60]}" must consist of numbers') from None
        if len(values) != count:
            raise InvalidElement(self, f"{attribute} has {len(values)} numbers instead of {count}")
        if not all(abs(value) <= largest for value in values):
            outlier = next(word for word, value in zip(words, values, strict=True) if not abs(value) <= largest)
            raise InvalidElement(self, f"{attribute}: must be from {-largest:g} to {largest:g}, got {outlier[:60]}")
        return values

    def positive(self, attribute: str, count: int = 1) -> tuple[float, ...]:
        """Return `count` positive numbers from a required attribute; raises InvalidElement for any other text."""
        values = self.numbers(attribute, count)
        if min(values) <= 0:
            raise InvalidElement(self, f"{attribute} must be greater than 0")
        return values

    def problem(self, message: str, hint: str = "") -> Problem:
        """Return an error that refers to the line of this element."""
        source = self.source.line(self.line)
        return Problem(self.source.name, self.line, self.col, URDF_ERROR_CODE, message, hint, source=source)


def parse_xml(data: bytes, file: str) -> Element:
    """Parse XML text; `file` is the path for error messages. Raises InvalidInput."""
    try:
        return markup.parse(data, markup.Source.of(data, file), Element)
    except markup.MalformedXml as error:
        problem = Problem(file, error.line, error.col, URDF_ERROR_CODE, error.message, error.hint, source=error.source)
        raise InvalidInput([problem]) from error


MAX_URDF_BYTES, MAX_MESH_BYTES = 2 * 2**20, 20 * 2**20
"""Maximum size of a URDF or xacro file, and maximum size of a mesh file."""


@dataclass(frozen=True)
class RobotFiles:
    """Path of the URDF of a `*.robot.yaml`, and the folders of ROS packages by package name."""

    urdf: Path
    packages: Mapping[str, Path]


def read_xml(path: Path, folders: AllowedFolders) -> Element:
    """Read a URDF or xacro file without expanding it. Raises InvalidInput."""
    shown_path = folders.display_path(path)
    try:
        _, data = folders.read_file(path, MAX_URDF_BYTES)
    except UnusableFile as error:
        raise InvalidInput([Problem(shown_path, 0, 0, URDF_ERROR_CODE, str(error))]) from error
    return parse_xml(data, shown_path)
