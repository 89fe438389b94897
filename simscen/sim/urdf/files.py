"""The files that a robot is made of: inside the allowed folders, regular, and of bounded size."""

import errno
import os
import stat
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from simscen.core.errors import InvalidInput
from simscen.core.filesread import note_read
from simscen.core.problems import Problem
from simscen.sim.urdf.markup import CODE, Element, parse

URDF_BYTES = 2 * 2**20
MESH_BYTES = 20 * 2**20


class Trouble(Exception):
    """Why a file cannot be read."""


@dataclass(frozen=True)
class Folders:
    """The folders that a robot's files must lie in, absolute and with links followed."""

    roots: tuple[Path, ...]

    @classmethod
    def of(cls, roots: Sequence[Path]) -> "Folders":
        """As given by the caller."""
        return cls(tuple(root.resolve() for root in roots))

    def shown(self, path: Path) -> str:
        """How messages name a file: relative to the first root, which is the scenarios', elsewhere absolute."""
        return path.relative_to(self.roots[0]).as_posix() if path.is_relative_to(self.roots[0]) else str(path)

    def locate(self, written: str, folder: Path) -> Path:
        """The real path of what `written` means in a file in `folder`; raises Trouble.

        Whether something outside the folders exists is not told.
        """
        if "://" in written:
            raise Trouble("URLs such as package:// are not read; write the path relative to the URDF")
        if PurePosixPath(written).is_absolute():
            raise Trouble("absolute paths are not read; write it relative to the URDF")
        if not written.isprintable() or len(written) > 4096:
            raise Trouble("not a usable path")
        return self.inside(folder / written)

    def inside(self, path: Path) -> Path:
        """The real path, if it is in one of the folders; raises Trouble."""
        real = Path(os.path.realpath(path))
        if not any(real.is_relative_to(root) for root in self.roots):
            raise Trouble("outside the scenario root")
        return real


def check_regular(path: Path, limit: int) -> None:
    """Raises Trouble unless the file is a regular one of at most `limit` bytes.

    Bullet aborts on a folder and waits forever for a pipe.
    """
    try:
        status = path.stat()
    except OSError as error:
        reason = "symbolic link loop" if error.errno == errno.ELOOP else os.strerror(error.errno or errno.ENOENT)
        raise Trouble(reason.lower()) from error
    if not stat.S_ISREG(status.st_mode):
        raise Trouble("not a regular file")
    if status.st_size > limit:
        raise Trouble(f"larger than {limit // 2**20} MiB")


def read_xml(path: Path, folders: Folders) -> Element:
    """The elements of a URDF or of a file that it includes, as written. Raises InvalidInput."""
    shown = folders.shown(path)
    try:
        real = folders.inside(path)
        check_regular(real, URDF_BYTES)
        note_read(real)
        data = real.read_bytes()
    except Trouble as trouble:
        raise InvalidInput([Problem(shown, 0, 0, CODE, str(trouble))]) from trouble
    except OSError as error:
        raise InvalidInput([Problem(shown, 0, 0, CODE, (error.strerror or str(error)).lower())]) from error
    return parse(data, shown)
