"""Find and read the files that worlds and robots refer to, but only in the folders that the user allows."""

import errno
import os
import re
import stat
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path, PurePath, PurePosixPath

from typing_extensions import Self

from simscen.assets.uris import PACKAGE_SCHEMES, SCHEMES, FolderTree, candidate_paths, is_package_name, parse_fuel_uri
from simscen.core.files import record_read_file

MAX_PATH_LENGTH = 1000
"""Maximum number of characters of a path or URI."""
INVALID_IN_PATHS = re.compile("[\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")
"""Control characters, line separators, bidirectional controls, surrogates, and noncharacters."""
MESH_SUFFIXES = (".dae", ".stl", ".obj")
"""Suffixes of mesh files. References to meshes often have the wrong suffix."""
_NOT_FOUND = "no such file or directory"


class UnusableFile(Exception):
    """A file cannot be found, may not be read, or cannot be read. The message never contains content of the file."""

    def __init__(self, message: str, hint: str = "") -> None:
        self.hint = hint
        super().__init__(message)


class NoSuchFile(UnusableFile):
    """A file does not exist in the allowed folders."""


@dataclass(frozen=True)
class AllowedFolders:
    """The folders in which files may be read.

    roots:     absolute paths without symbolic links: the root of the scenarios, then the folders of `--world-path`
    packages:  known folders of ROS packages by name; other packages are searched for in `roots`
    """

    roots: tuple[Path, ...]
    packages: Mapping[str, Path] = field(default_factory=dict)

    @classmethod
    def of(cls, roots: Sequence[Path], packages: Mapping[str, Path] | None = None) -> Self:
        """Create an instance from folders whose paths may be relative or contain symbolic links."""
        return cls(tuple(Path(os.path.realpath(root)) for root in roots), packages or {})

    @cached_property
    def _tree(self) -> FolderTree:
        return FolderTree(self.roots)

    @property
    def search_folders(self) -> tuple[Path, ...]:
        """The `roots` without the first one: folders that are searched for files."""
        return self.roots[1:]

    def display_path(self, path: Path) -> str:
        """Return a path for messages: relative to the first root if the file is in it, otherwise absolute."""
        return path.relative_to(self.roots[0]).as_posix() if path.is_relative_to(self.roots[0]) else str(path)

    def find(
        self,
        uri: str,
        base: Path,
        *,
        allow_absolute: bool = False,
        is_preferred: Callable[[Path], bool] = lambda _: True,
    ) -> Path:
        """Return the real path of the file or folder that a URI or path refers to, see `uris.candidate_paths`.

        base:            folder of the file that contains the URI
        allow_absolute:  whether absolute paths are accepted (xacro and Gazebo write them)
        is_preferred:    called for each existing path in order. The first path with True is returned; without such a
                         path, the first existing path.

        Raises UnusableFile, or NoSuchFile if the file does not exist.
        """
        if not uri or INVALID_IN_PATHS.search(uri):
            raise UnusableFile("the URI contains a control character" if uri else "the URI is empty")
        if len(uri) > MAX_PATH_LENGTH:
            raise UnusableFile("not a usable path")
        if "://" in uri and not uri.startswith(SCHEMES) and parse_fuel_uri(uri) is None:
            raise UnusableFile("only model://, package://, file://, Fuel and relative paths are read",
                          "download it and name its folder with --world-path")  # fmt: skip
        if uri in SCHEMES or (uri.startswith(PACKAGE_SCHEMES) and not uri.partition("://")[2].strip("/")):
            raise UnusableFile("the name of a model is missing")
        if not allow_absolute and PurePosixPath(uri.removeprefix("file://")).is_absolute():
            raise UnusableFile("absolute paths are not read", "write it relative to this file")
        real_base, tried = Path(os.path.realpath(base)), []
        first: Path | None = None  # first existing path
        for folder, candidate in candidate_paths(uri, real_base, self._tree, self.packages):
            # Other folders could be links, and hints must not reveal their content.
            if folder in (real_base, *self.search_folders):
                tried.append((folder, candidate))
            try:
                path = self.resolve(candidate)
            except NoSuchFile:
                continue
            if is_preferred(path):
                return path
            first = first or path
        if first is not None:
            return first
        raise NoSuchFile(_NOT_FOUND, self._hint(uri, real_base, tried))

    @staticmethod
    def resolve_parent(path: Path) -> Path:
        """Return a path with the symbolic links of the folder resolved. The file itself can still be a link."""
        return Path(os.path.realpath(path.parent)) / path.name

    def package_folder(self, name: str, near: Path) -> Path:
        """Return the folder of the ROS package `name` for a file in the folder `near`; see `uris.candidate_paths`.

        A folder with a package.xml has priority over other folders with this name, such as `include/name`, folders of
        Python modules, and build folders. Raises UnusableFile, or NoSuchFile if there is no such package.
        """
        if name in self.packages:
            return self.packages[name]
        if not is_package_name(name):
            raise UnusableFile(f"{name[:60]!r} is not the name of a package")
        first: Path | None = None
        for _, folder in candidate_paths(f"package://{name}", near, self._tree, self.packages):
            real = Path(os.path.realpath(folder))
            if self._contains(real) and real.is_dir():
                manifest = real / "package.xml"
                if manifest.is_file() and not manifest.is_symlink():
                    return real
                first = first or real
        if first is not None:
            return first
        hint = f"put a folder {name} next to the robot's package, pass its parent folder with --world-path, or set "
        raise NoSuchFile(f"there is no package {name!r}", hint + f"`packages: {{{name}: path}}` in the *.robot.yaml")

    def resolve(self, path: Path) -> Path:
        """Return the path of a file or folder without symbolic links.

        Raises UnusableFile if the path is not in an allowed folder, or NoSuchFile if the path does not exist.
        """
        if len(str(path)) > MAX_PATH_LENGTH or "\0" in str(path):
            raise UnusableFile("not a usable path")
        # First check the path without access to the disk, so that messages do not reveal whether other files exist.
        self._require_inside(Path(os.path.normpath(path)))
        try:
            real = Path(os.path.realpath(path, strict=True))
        except OSError as error:
            raise _to_unusable_file(error) from error
        self._require_inside(real)
        return real

    def check_file(self, path: Path, max_bytes: int) -> Path:
        """Return the real path of a file.

        Raises UnusableFile as `resolve` does, or if the path is not a regular file of at most `max_bytes`.
        """
        real = self.resolve(path)
        try:
            status = real.stat()
        except OSError as error:
            raise _to_unusable_file(error) from error
        if not stat.S_ISREG(status.st_mode):
            raise UnusableFile("not a regular file")
        if status.st_size > max_bytes:
            raise UnusableFile(f"larger than {max_bytes // 2**20} MiB")
        return real

    def read_file(self, path: Path, max_bytes: int) -> tuple[Path, bytes]:
        """Return the real path and the content of a file. Raises UnusableFile as `check_file` does."""
        real = self.check_file(path, max_bytes)
        record_read_file(real)
        try:
            return real, real.read_bytes()
        except OSError as error:
            raise _to_unusable_file(error) from error

    def _contains(self, path: Path) -> bool:
        return any(path.is_relative_to(folder) for folder in self.roots)

    def _require_inside(self, path: Path) -> None:
        """Raise UnusableFile if a path is not in an allowed folder."""
        if not self._contains(path):
            raise UnusableFile("outside the scenario root and the world paths")

    def _hint(self, uri: str, base: Path, tried: list[tuple[Path, Path]]) -> str:
        """Return a hint for a URI that was not found in the `tried` pairs (allowed folder, path in it).

        `base` is the folder of the file that contains the URI.
        """
        similar = next((match for folder, path in tried if (match := find_similar_name(folder, path))), None)
        if similar:
            return f"did you mean `{similar}`?"
        if parse_fuel_uri(uri) and not self.search_folders:
            return "allow Fuel's cache with --world-path ~/.gz/fuel, or a folder that holds the downloaded model"
        if not tried and (package := self._package_of(uri, base)) is not None:
            return f"the folder of its package is {self.display_path(package) or '.'}"
        searched = ", ".join(dict.fromkeys(self.display_path(folder) or "." for folder, _ in tried))
        return f"{f'looked in {searched}; ' if searched else ''}allow its folder with --world-path"

    def _package_of(self, uri: str, base: Path) -> Path | None:
        """Return the folder of the package of a URI such as "package://cart/base.stl"; None for another URI."""
        name, _, file = uri.partition("://")[2].partition("/")
        try:
            return self.package_folder(name, base) if uri.startswith(PACKAGE_SCHEMES) and file else None
        except UnusableFile:
            return None


def _to_unusable_file(error: OSError) -> UnusableFile:
    if error.errno in (errno.ENOENT, errno.ENOTDIR):
        return NoSuchFile(_NOT_FOUND)
    reasons = {
        errno.ELOOP: "symbolic link loop",
        errno.EACCES: "permission denied",
        errno.ENAMETOOLONG: "not a usable path",
    }
    return UnusableFile(reasons.get(error.errno or 0, error.strerror or "cannot be read"))


def find_similar_name(folder: Path, path: Path) -> str | None:
    """Return the existing path in `folder` that is similar to the missing `path`, relative to `folder`; otherwise None.

    Capitalization and the suffix of a mesh can differ. Symbolic links are not followed.
    """
    current, parts = folder, path.relative_to(folder).parts if path.is_relative_to(folder) else ("..",)
    for part in parts:
        entry = None if part == ".." else _match_entry(current, part)
        if entry is None or (current / entry).is_symlink():
            return None
        current /= entry
    return current.relative_to(folder).as_posix()


def _match_entry(folder: Path, name: str) -> str | None:
    """Return the entry of a folder with this name, other capitalization, or another mesh suffix; None if missing."""
    try:
        entries = sorted(entry.name for entry in folder.iterdir())
    except OSError:
        return None
    if name in entries:
        return name
    requested = PurePath(name.casefold())
    spellings = [requested.name]
    if requested.suffix in MESH_SUFFIXES:
        spellings += [requested.with_suffix(suffix).name for suffix in MESH_SUFFIXES]
    return next((entry for spelling in spellings for entry in entries if entry.casefold() == spelling), None)
