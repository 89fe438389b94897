"""The only door to the disk: everything an SDF file names must lie inside the folders the user allowed."""

import errno
import os
import stat
from collections.abc import Sequence
from pathlib import Path

from simscen.core.filesread import note_read
from simscen.worlds.sdf.addresses import SCHEMES, fuel, places
from simscen.worlds.sdf.markup import Element
from simscen.worlds.sdf.neighbours import neighbour
from simscen.worlds.sdf.report import Missing, Place, Unusable

LONGEST_PATH = 1000
WORLD_BYTES = 20 * 2**20
MESH_BYTES = 64 * 2**20


class Trouble(Exception):
    """Why a file cannot be had; never says anything about its content."""


class Library:
    """Finds and reads files inside `root` and the folders of `search`, symbolic links followed first."""

    def __init__(self, root: Path, search: Sequence[Path]) -> None:
        self.root = Path(os.path.realpath(root))
        self.search = tuple(Path(os.path.realpath(folder)) for folder in search)

    def shown(self, path: Path) -> str:
        """The name of a file for users: relative to the root, elsewhere absolute."""
        return path.relative_to(self.root).as_posix() if path.is_relative_to(self.root) else str(path)

    def open(self, path: Path, limit: int) -> tuple[Path, bytes]:
        """The real path and the bytes of a regular file of at most `limit` bytes; raises Trouble."""
        real = self.resolve(path)
        try:
            status = real.stat()
            if not stat.S_ISREG(status.st_mode):
                raise Trouble("not a regular file")
            if status.st_size > limit:
                raise Trouble(f"larger than {limit // 2**20} MiB")
            note_read(real)
            return real, real.read_bytes()
        except OSError as error:
            raise Trouble(_reason(error)) from error

    def resolve(self, path: Path) -> Path:
        """The real path of something that exists inside the allowed folders; raises Trouble."""
        if len(str(path)) > LONGEST_PATH or "\0" in str(path):
            raise Trouble("not a usable path")
        # First by the letters alone, so that nothing outside is even asked whether it exists.
        self._contain(Path(os.path.normpath(path)))
        try:
            real = Path(os.path.realpath(path, strict=True))
        except OSError as error:
            raise Trouble(_reason(error)) from error
        self._contain(real)
        return real

    def _contain(self, path: Path) -> None:
        if not any(path.is_relative_to(folder) for folder in (self.root, *self.search)):
            raise Trouble("outside the scenario root and the world paths")

    def locate(self, element: Element) -> Path:
        """The real path of what a `<uri>` means, see addresses.places; raises Unusable."""
        uri = element.text
        if not uri or not uri.isprintable():
            raise element.unusable("control character in the uri" if uri else "the uri is empty")
        if len(uri) > LONGEST_PATH:
            raise element.unusable("not a usable path")
        if "://" in uri and not uri.startswith(SCHEMES) and fuel(uri) is None:
            raise element.unusable(f"{uri}: only model://, package://, file://, Fuel and relative paths are read",
                                   "download it and name its folder with --world-path")  # fmt: skip
        if uri in SCHEMES or (uri.startswith(("model://", "package://")) and not uri.partition("://")[2].strip("/")):
            raise element.unusable(f"{uri}: the name of a model is missing")
        tried: list[tuple[Path, Path]] = []
        for folder, candidate in places(uri, Path(element.source.folder), self.search):
            tried.append((folder, candidate))
            try:
                return self.resolve(candidate)
            except Trouble as trouble:
                if str(trouble) != _ABSENT:
                    raise element.unusable(f"{uri}: {trouble}") from trouble
        raise Missing(element.place, f"{uri}: {_ABSENT}", self._hint(uri, tried), uri)

    def _hint(self, uri: str, tried: list[tuple[Path, Path]]) -> str:
        near = next((found for folder, path in tried if (found := neighbour(folder, path))), None)
        if near:
            return f"did you mean `{near}`?"
        if fuel(uri) and not self.search:
            return "allow Fuel's cache with --world-path ~/.gz/fuel, or a folder that holds the downloaded model"
        looked = ", ".join(dict.fromkeys(self.shown(folder) or "." for folder, _ in tried)) or "no folder"
        return f"looked in {looked}; allow its folder with --world-path"

    def read(self, path: Path, element: Element, limit: int) -> bytes:
        """The bytes of a located file; raises Unusable at the element that asked for it."""
        try:
            return self.open(path, limit)[1]
        except Trouble as trouble:
            raise element.unusable(f"{self.shown(path)}: {trouble}") from trouble

    def read_world(self, path: Path) -> tuple[Path, bytes]:
        """Real path and bytes of the world itself; raises Unusable for the file as a whole."""
        try:
            # Links in the folder that the user typed are the user's; only the file itself must not lead out.
            return self.open(Path(os.path.realpath(path.parent)) / path.name, WORLD_BYTES)
        except Trouble as trouble:
            raise Unusable(Place(path.name), str(trouble)) from trouble


_ABSENT = "no such file or directory"


def _reason(error: OSError) -> str:
    reasons = {
        errno.ENOENT: _ABSENT,
        errno.ENOTDIR: _ABSENT,
        errno.ELOOP: "symbolic link loop",
        errno.EACCES: "permission denied",
        errno.ENAMETOOLONG: "not a usable path",
    }
    return reasons.get(error.errno or 0, error.strerror or "cannot be read")
