"""The only door to the disk for what a world or a robot names: all of it lies in the folders that the user allowed."""

import errno
import os
import stat
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath, PurePosixPath

from typing_extensions import Self

from simscen.assets.uris import (
    PACKAGE_SCHEMES,
    SCHEMES,
    candidate_paths,
    is_package_name,
    package_folder_candidates,
    parse_fuel_uri,
)
from simscen.core.files import record_read_file

LONGEST_PATH = 1000


class UnusableFile(Exception):
    """Why a file cannot be had, and what helps; never says anything about its content."""

    def __init__(self, message: str, hint: str = "") -> None:
        self.hint = hint
        super().__init__(message)


class NoSuchFile(UnusableFile):
    """There is nothing in the folders that it could mean."""


@dataclass(frozen=True)
class AllowedFolders:
    """The folders that files must lie in, absolute and with links followed: the scenarios' root, and others.

    `packages` are ROS packages by name that need not be looked for.
    """

    roots: tuple[Path, ...]
    packages: Mapping[str, Path] = field(default_factory=dict)

    @classmethod
    def of(cls, roots: Sequence[Path], packages: Mapping[str, Path] | None = None) -> Self:
        """As given by the caller."""
        return cls(tuple(Path(os.path.realpath(root)) for root in roots), packages or {})

    @property
    def search(self) -> tuple[Path, ...]:
        """The folders besides the root: what is not beside the file that names it is looked for in them."""
        return self.roots[1:]

    def shown(self, path: Path) -> str:
        """Return the path of a file for messages: relative to the root if it is below it, otherwise absolute."""
        return path.relative_to(self.roots[0]).as_posix() if path.is_relative_to(self.roots[0]) else str(path)

    def find(self, uri: str, beside: Path, *, absolute: bool = False) -> Path:
        """Return the real path of a URI or path in a file in the folder `beside`; see addresses.places.

        `absolute`: accept absolute paths, which xacro creates from `$(find package)` and which Gazebo saves in worlds.
        Raises UnusableFile, or NoSuchFile if the file does not exist.
        """
        if not uri or not uri.isprintable():
            raise UnusableFile("control character in the uri" if uri else "the uri is empty")
        if len(uri) > LONGEST_PATH:
            raise UnusableFile("not a usable path")
        if "://" in uri and not uri.startswith(SCHEMES) and parse_fuel_uri(uri) is None:
            raise UnusableFile("only model://, package://, file://, Fuel and relative paths are read",
                          "download it and name its folder with --world-path")  # fmt: skip
        if uri in SCHEMES or (uri.startswith(PACKAGE_SCHEMES) and not uri.partition("://")[2].strip("/")):
            raise UnusableFile("the name of a model is missing")
        if not absolute and PurePosixPath(uri.removeprefix("file://")).is_absolute():
            raise UnusableFile("absolute paths are not read", "write it relative to this file")
        here, tried = Path(os.path.realpath(beside)), []
        for folder, candidate in candidate_paths(uri, here, self.roots, self.packages):
            if folder in (here, *self.search):  # others may be links to where nobody is to be told what there is
                tried.append((folder, candidate))
            try:
                return self.resolve(candidate)
            except NoSuchFile:
                continue
        raise NoSuchFile(_ABSENT, self._hint(uri, tried))

    @staticmethod
    def named(path: Path) -> Path:
        """Return the path of a file without resolving links of its folder; the file itself must not lead out."""
        return Path(os.path.realpath(path.parent)) / path.name

    def package(self, name: str, near: Path) -> Path:
        """Return the folder of a ROS package for a file in the folder `near`; raises UnusableFile or NoSuchFile."""
        if name in self.packages:
            return self.packages[name]
        if not is_package_name(name):
            raise UnusableFile(f"{name[:60]!r} is not the name of a package")
        for folder in (*(folder / name for folder in self.search), *package_folder_candidates(name, near, self.roots)):
            real = Path(os.path.realpath(folder))
            if self._holds(real) and real.is_dir():
                return real
        hint = f"put a folder {name} beside the robot's package, name the one that holds it with --world-path, or say "
        raise NoSuchFile(f"there is no package {name!r}", hint + f"`packages: {{{name}: path}}` in the *.robot.yaml")

    def resolve(self, path: Path) -> Path:
        """Return the real path of an existing file in the allowed folders; raises UnusableFile or NoSuchFile."""
        if len(str(path)) > LONGEST_PATH or "\0" in str(path):
            raise UnusableFile("not a usable path")
        # First by the letters alone, so that nothing outside is even asked whether it exists.
        self._contain(Path(os.path.normpath(path)))
        try:
            real = Path(os.path.realpath(path, strict=True))
        except OSError as error:
            raise _trouble(error) from error
        self._contain(real)
        return real

    def check(self, path: Path, limit: int) -> Path:
        """Return the real path of a regular file of at most `limit` bytes; raises UnusableFile.

        Bullet would abort on a folder and wait forever for a pipe.
        """
        real = self.resolve(path)
        try:
            status = real.stat()
        except OSError as error:
            raise _trouble(error) from error
        if not stat.S_ISREG(status.st_mode):
            raise UnusableFile("not a regular file")
        if status.st_size > limit:
            raise UnusableFile(f"larger than {limit // 2**20} MiB")
        return real

    def open(self, path: Path, limit: int) -> tuple[Path, bytes]:
        """Return the real path and the content of a regular file of at most `limit` bytes; raises UnusableFile."""
        real = self.check(path, limit)
        record_read_file(real)
        try:
            return real, real.read_bytes()
        except OSError as error:
            raise _trouble(error) from error

    def _holds(self, path: Path) -> bool:
        return any(path.is_relative_to(folder) for folder in self.roots)

    def _contain(self, path: Path) -> None:
        if not self._holds(path):
            raise UnusableFile("outside the scenario root and the world paths")

    def _hint(self, uri: str, tried: list[tuple[Path, Path]]) -> str:
        near = next((found for folder, path in tried if (found := find_similar_name(folder, path))), None)
        if near:
            return f"did you mean `{near}`?"
        if parse_fuel_uri(uri) and not self.search:
            return "allow Fuel's cache with --world-path ~/.gz/fuel, or a folder that holds the downloaded model"
        looked = ", ".join(dict.fromkeys(self.shown(folder) or "." for folder, _ in tried)) or "no folder"
        return f"looked in {looked}; allow its folder with --world-path"


_ABSENT = "no such file or directory"


def _trouble(error: OSError) -> UnusableFile:
    if error.errno in (errno.ENOENT, errno.ENOTDIR):
        return NoSuchFile(_ABSENT)
    reasons = {
        errno.ELOOP: "symbolic link loop",
        errno.EACCES: "permission denied",
        errno.ENAMETOOLONG: "not a usable path",
    }
    return UnusableFile(reasons.get(error.errno or 0, error.strerror or "cannot be read"))


MESHES = (".dae", ".stl", ".obj")
"""Suffixes that published files confuse with each other."""


def find_similar_name(folder: Path, path: Path) -> str | None:
    """Return the file or folder below `folder` that `path` probably means, relative to it, or None.

    Symbolic links are not followed, so that messages do not reveal names outside the folder.
    """
    here, parts = folder, path.relative_to(folder).parts if path.is_relative_to(folder) else ("..",)
    for part in parts:
        found = None if part == ".." else _spelled(here, part)
        if found is None or (here / found).is_symlink():
            return None
        here /= found
    return here.relative_to(folder).as_posix()


def _spelled(folder: Path, name: str) -> str | None:
    """Return the entry of a folder with this name, or with other capitalization, or the mesh in another format."""
    try:
        entries = sorted(entry.name for entry in folder.iterdir())
    except OSError:
        return None
    if name in entries:
        return name
    wanted = PurePath(name.casefold())
    meant = [wanted.name]
    if wanted.suffix in MESHES:
        meant += [wanted.with_suffix(suffix).name for suffix in MESHES]
    return next((entry for spelling in meant for entry in entries if entry.casefold() == spelling), None)
