"""Resolution of Gazebo and ROS URIs: the paths at which a file may be found."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

PACKAGE_SCHEMES = ("package://", "model://")
"""Schemes of ROS and Gazebo for a folder of a package or model."""
SCHEMES = (*PACKAGE_SCHEMES, "file://")
_FUEL = re.compile(
    r"https?://(?P<server>(?:fuel|app|api)\.(?:gazebosim|ignitionrobotics)\.org)/(?:\d+\.\d+/)?"
    r"(?P<owner>[^/]+)/(?P<kind>models|worlds)/(?P<name>[^/]+)(?:/(?P<version>\d+|tip))?(?:/(?:files/)?(?P<rest>.*))?"
)
_BUILTIN_MODELS = {"sun", "ground_plane"}


@dataclass(frozen=True)
class FuelUri:
    """URI of a model on Gazebo Fuel. Only local copies are used; simscen never connects to the server."""

    server: str
    owner: str
    kind: str
    name: str
    version: str
    rest: str

    def candidate_paths_in(self, folder: Path) -> Iterator[Path]:
        """Yield its possible paths in a folder: as in Fuel's cache (~/.gz/fuel), newest version first, or by name."""
        spellings = [self.name, self.name.lower()]
        for name in dict.fromkeys([*spellings, *(name.replace(" ", "_") for name in spellings)]):
            for owner in dict.fromkeys((self.owner, self.owner.lower())):
                cached = folder / self.server / owner / self.kind / name
                yield from (version / self.rest for version in self._versions(cached))
            yield folder / name / self.rest

    def _versions(self, cached: Path) -> list[Path]:
        if self.version not in ("", "tip"):
            return [cached / self.version]
        try:
            numbers = sorted(int(entry.name) for entry in cached.iterdir() if entry.name.isdecimal())
        except OSError:
            return []
        return [cached / str(number) for number in reversed(numbers)]


def parse_fuel_uri(uri: str) -> FuelUri | None:
    """Return the Fuel address of a URI, or None if it is not one."""
    match = _FUEL.fullmatch(uri.rstrip("/"))
    if match is None:
        return None
    parts = {key: unquote(value or "") for key, value in match.groupdict().items()}
    return None if any(unsafe in parts.values() for unsafe in (".", "..")) else FuelUri(**parts)


def builtin_model_name(uri: str) -> str | None:
    """Return the name of a built-in model of Gazebo (`sun` or `ground_plane`) that a URI refers to, or None."""
    address = parse_fuel_uri(uri)
    if address is None:
        name = uri.removeprefix("model://").strip("/") if uri.startswith("model://") else ""
    else:
        name = address.name if address.owner.lower().replace(" ", "") == "openrobotics" and not address.rest else ""
    name = name.lower().replace(" ", "_")
    return name if name in _BUILTIN_MODELS else None


def candidate_paths(
    uri: str, base: Path, roots: Sequence[Path], packages: Mapping[str, Path]
) -> Iterator[tuple[Path, Path]]:
    """Yield pairs of an allowed folder and a path in it, in the order in which they are tried for a URI.

    `base` is the folder of the file that refers to the URI. model:// and package:// refer to one of `packages`;
    otherwise to all `roots` but the first, and then to possible packages of this name around `base` or below the roots.
    file:// and bare paths are relative to `base`, then to the roots but the first, whose own name may come first
    (`file://models/crate` in a folder called `models`).
    """
    address, search = parse_fuel_uri(uri), roots[1:]
    if address is not None:
        for folder in search:
            yield from ((folder, place) for place in address.candidate_paths_in(folder))
        return
    scheme = next((scheme for scheme in SCHEMES if uri.startswith(scheme)), "")
    rest = uri.removeprefix(scheme)
    if scheme in PACKAGE_SCHEMES:
        yield from _in_packages(rest.lstrip("/"), base, roots, packages)
        return
    yield base, base / rest
    first, _, below = rest.partition("/")
    for folder in search:
        yield folder, folder / rest
        if scheme and below and folder.name == first:
            yield folder, folder / below


def _in_packages(
    path: str, base: Path, roots: Sequence[Path], packages: Mapping[str, Path]
) -> Iterator[tuple[Path, Path]]:
    name, _, below = path.partition("/")
    if name in packages:
        yield packages[name], packages[name] / below.lstrip("/")
        return
    yield from ((folder, folder / path) for folder in roots[1:])
    if is_package_name(name):
        yield from ((folder, folder / below.lstrip("/")) for folder in package_folder_candidates(name, base, roots))


MAX_MANIFEST_BYTES = 1 << 16
"""Bytes of a package.xml that are read to find its `<name>`."""


def is_package_name(name: str) -> bool:
    """Return whether this is a valid name of a ROS package (REP 144) and therefore not a path."""
    return name.replace("_", "").replace("-", "").isalnum()


def package_folder_candidates(name: str, near: Path, roots: Sequence[Path]) -> Iterator[Path]:
    """Yield possible folders of a package, for a file in `near`: around it, in the roots, and up to two levels below.

    A workspace contains repositories, which contain packages, possibly in a folder that groups them.
    """
    for folder in (near, *near.parents):
        if folder.name == name:
            yield folder
        yield folder / name
        if folder in roots:
            break
    yield from (root if root.name == name else root / name for root in roots)
    for pattern in (f"*/{name}", f"*/*/{name}"):
        for root in roots:
            yield from sorted(root.glob(pattern))
    yield from _folders_by_manifest(name, near, roots)


def _folders_by_manifest(name: str, near: Path, roots: Sequence[Path]) -> Iterator[Path]:
    """Yield folders whose package.xml contains this package name; the folder name may differ."""
    for folder in (near, *near.parents):
        if not any(folder.is_relative_to(root) for root in roots):
            break
        if _manifest_name(folder / "package.xml") == name:
            yield folder
    for pattern in ("package.xml", "*/package.xml", "*/*/package.xml"):
        for root in roots:
            yield from (path.parent for path in sorted(root.glob(pattern)) if _manifest_name(path) == name)


def _manifest_name(path: Path) -> str:
    """Return the package name in a package.xml; "" for symbolic links and unreadable files."""
    if path.is_symlink() or path.parent.is_symlink() or not path.is_file():
        return ""
    try:
        with path.open("rb") as file:
            text = file.read(MAX_MANIFEST_BYTES).decode("utf-8", "replace")
    except OSError:
        return ""
    match = re.search(r"<name>\s*([^\s<]+)\s*</name>", re.sub(r"<!--.*?(?:-->|\Z)", "", text, flags=re.DOTALL))
    return match[1] if match else ""
