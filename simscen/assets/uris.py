"""Candidate paths for the file of a Gazebo or ROS URI (model://, package://, file://, Fuel)."""

import itertools
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from urllib.parse import unquote

from simscen.core.decorators import cached_on_instance

PACKAGE_SCHEMES = ("package://", "model://")
"""Schemes of ROS and Gazebo whose first path component is the name of a package or model."""
SCHEMES = (*PACKAGE_SCHEMES, "file://")
"""Schemes of all supported URIs except Fuel URIs."""
MAX_NAME_CHARS = 255
"""Maximum length of the name of a package: the usual limit of file systems for the name of a folder."""
MAX_MANIFEST_BYTES = 1 << 16
"""Number of bytes at the start of a package.xml in which `<name>` is searched."""
_FUEL = re.compile(
    r"https?://(?P<server>(?:fuel|app|api)\.(?:gazebosim|ignitionrobotics)\.org)/(?:\d+\.\d+/)?"
    r"(?P<owner>[^/]+)/(?P<kind>models|worlds)/(?P<name>[^/]+)(?:/(?P<version>\d+|tip))?(?:/(?:files/)?(?P<rest>.*))?"
)
"""URI of a model or world on Gazebo Fuel (website or API), or of a file in it."""


@dataclass(frozen=True)
class FuelUri:
    """URI of a model or world on Gazebo Fuel. Nothing is downloaded: only local copies are used.

    kind:     "models" or "worlds"
    version:  number, "tip" for the newest version, or "" if the URI has none
    rest:     path of a file in the model or world; "" for the model or world itself
    """

    server: str
    owner: str
    kind: str
    name: str
    version: str
    rest: str

    def candidate_paths_in(self, folder: Path) -> Iterator[Path]:
        """Yield the paths at which `folder` can contain a copy of the model or file, existing or not.

        The folder can be a cache of Fuel (~/.gz/fuel) or contain models by name. The newest version comes first.
        """
        spellings = [self.name, self.name.lower()]
        for name in dict.fromkeys([*spellings, *(name.replace(" ", "_") for name in spellings)]):
            for owner in dict.fromkeys((self.owner, self.owner.lower())):
                model_folder = folder / self.server / owner / self.kind / name
                yield from (version / self.rest for version in self._version_folders(model_folder))
            yield folder / name / self.rest

    def _version_folders(self, model_folder: Path) -> list[Path]:
        """Return the folder of the requested version of a model in a cache of Fuel; otherwise, of all versions."""
        if self.version not in ("", "tip"):
            return [model_folder / self.version]
        try:
            numbers = sorted(int(entry.name) for entry in model_folder.iterdir() if entry.name.isdecimal())
        except OSError:
            return []
        return [model_folder / str(number) for number in reversed(numbers)]


def parse_fuel_uri(uri: str) -> FuelUri | None:
    """Return the parts of a Fuel URI; None for another URI, or if a part is "." or ".."."""
    match = _FUEL.fullmatch(uri.rstrip("/"))
    if match is None:
        return None
    parts = {key: unquote(value or "") for key, value in match.groupdict().items()}
    return None if any(unsafe in parts.values() for unsafe in (".", "..")) else FuelUri(**parts)


class FolderTree:
    """Folders up to two levels below the `roots`, the allowed folders (see `AllowedFolders`).

    The folders are listed only once, at the first search for a package.
    """

    def __init__(self, roots: tuple[Path, ...]) -> None:
        self.roots = roots

    @cached_property
    def _folders(self) -> tuple[Path, ...]:
        """All folders one level below the roots, then all folders two levels below."""
        upper = [_subfolders(root) for root in self.roots]
        lower = [folder for folders in upper for parent in folders for folder in _subfolders(parent)]
        return *itertools.chain.from_iterable(upper), *lower

    @cached_on_instance
    def find(self, name: str) -> tuple[Path, ...]:
        """Return the files and folders called `name` two or three levels below a root, the upper level first."""
        return tuple(folder / name for folder in self._folders if os.path.lexists(f"{folder}/{name}"))

    @cached_property
    def packages(self) -> dict[str, list[Path]]:
        """The roots and lower folders with a package.xml, by name of the package, upper levels first."""
        packages: dict[str, list[Path]] = {}
        for folder in (*self.roots, *self._folders):
            if os.path.lexists(f"{folder}/package.xml"):
                packages.setdefault(_manifest_name(folder / "package.xml"), []).append(folder)
        return packages


def _subfolders(folder: Path) -> list[Path]:
    """Return the subfolders of a folder, sorted; [] if the folder cannot be read."""
    try:
        with os.scandir(folder) as entries:
            # Unlike the methods of `entry` and Path, isdir never raises, for example for a loop of links.
            return sorted(Path(entry.path) for entry in entries if os.path.isdir(entry.path))  # noqa: PTH112
    except OSError:
        return []


def candidate_paths(
    uri: str, base: Path, tree: FolderTree, packages: Mapping[str, Path]
) -> Iterator[tuple[Path, Path]]:
    """Yield (searched folder, path in this folder) of the candidates for the file of a URI, the preferred one first.

    `base` is the folder of the file that contains the URI. The search folders are all roots of the `tree` except the
    first.

    - model:// and package:// with a name in `packages`: only the folder of this package.
    - model:// and package:// with another name: the search folders, then `_package_folders`.
    - file:// and paths: relative to `base`, then to the search folders. The path of a file:// URI can start with the
      name of a search folder (`file://models/crate` in a folder `models`).
    - Fuel: the search folders.
    """
    fuel_uri, search_folders = parse_fuel_uri(uri), tree.roots[1:]
    if fuel_uri is not None:
        for folder in search_folders:
            yield from ((folder, path) for path in fuel_uri.candidate_paths_in(folder))
        return
    scheme = next((scheme for scheme in SCHEMES if uri.startswith(scheme)), "")
    rest = uri.removeprefix(scheme)
    if scheme in PACKAGE_SCHEMES:
        path = rest.lstrip("/")
        name, _, below = path.partition("/")
        if name in packages:
            yield packages[name], packages[name] / below.lstrip("/")
            return
        yield from ((folder, folder / path) for folder in search_folders)
        if is_package_name(name):
            yield from ((folder, folder / below.lstrip("/")) for folder in _package_folders(name, base, tree))
        return
    yield base, base / rest
    first, _, below = rest.partition("/")
    for folder in search_folders:
        yield folder, folder / rest
        if scheme and below and folder.name == first:
            yield folder, folder / below


def is_package_name(name: str) -> bool:
    """Return whether a name has only characters of ROS package names (REP 144), and at most MAX_NAME_CHARS."""
    return len(name) <= MAX_NAME_CHARS and name.replace("_", "").replace("-", "").isalnum()


def _package_folders(name: str, near: Path, tree: FolderTree) -> Iterator[Path]:
    """Yield folders that can be the ROS package `name`, to which a file in the folder `near` refers.

    First come folders with this name: `near` and its parents, subfolders of these folders, and folders up to three
    levels below the roots. Then come folders whose package.xml has this name.
    """
    for folder in (near, *near.parents):
        if folder.name == name:
            yield folder
        yield folder / name
        if folder in tree.roots:
            break
    yield from (root if root.name == name else root / name for root in tree.roots)
    yield from tree.find(name)
    for folder in (near, *near.parents):
        if not any(folder.is_relative_to(root) for root in tree.roots):
            break
        if _manifest_name(folder / "package.xml") == name:
            yield folder
    yield from tree.packages.get(name, ())


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
