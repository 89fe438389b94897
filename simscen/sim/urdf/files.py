"""The files that a robot is made of: inside the allowed folders, regular, and of bounded size."""

import errno
import os
import stat
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from simscen.core.errors import InvalidInput
from simscen.core.filesread import note_read
from simscen.core.problems import Problem
from simscen.sim.urdf.markup import CODE, Element, parse
from simscen.sim.urdf.packages import is_package_name, places_of

URDF_BYTES = 2 * 2**20
MESH_BYTES = 20 * 2**20
PACKAGES, FILE = ("package://", "model://"), "file://"
"""ROS and Gazebo name the same folder so; a `file://` is read as in worlds, beside the file that names it."""


class Trouble(Exception):
    """Why a file cannot be read, and what helps."""

    def __init__(self, message: str, hint: str = "") -> None:
        self.hint = hint
        super().__init__(message)


@dataclass(frozen=True)
class Found:
    """Where the files are that a `*.robot.yaml` names: its URDF, and the folders of ROS packages by name."""

    urdf: Path
    packages: Mapping[str, Path]


@dataclass(frozen=True)
class Folders:
    """The folders that a robot's files must lie in, absolute and with links followed.

    `packages` are ROS packages by name that need not be looked for.
    """

    roots: tuple[Path, ...]
    packages: Mapping[str, Path] = field(default_factory=dict)

    @classmethod
    def of(cls, roots: Sequence[Path], packages: Mapping[str, Path] | None = None) -> "Folders":
        """As given by the caller."""
        return cls(tuple(root.resolve() for root in roots), packages or {})

    def shown(self, path: Path) -> str:
        """How messages name a file: relative to the first root, which is the scenarios', elsewhere absolute."""
        return path.relative_to(self.roots[0]).as_posix() if path.is_relative_to(self.roots[0]) else str(path)

    def locate(self, written: str, folder: Path, expanded: bool = False) -> Path:
        """The real path of what `written` means in a file in `folder`; raises Trouble.

        `expanded` = xacro may have made an absolute path, or the URL of one, of `$(find package)`. Whether something
        outside the folders exists is not told.
        """
        if not written.isprintable() or len(written) > 4096:
            raise Trouble("not a usable path")
        if written.startswith(PACKAGES):
            name, _, rest = written.partition("://")[2].partition("/")
            return self.inside(self.package(name, folder) / rest.lstrip("/"))
        path = written.removeprefix(FILE)
        if "://" in path:
            raise Trouble("only URLs of package://, model:// and file:// are read; write the path relative to the URDF")
        if PurePosixPath(path).is_absolute() and not expanded:
            raise Trouble("absolute paths are not read; write it relative to the URDF")
        return self.inside(folder / path)

    def package(self, name: str, near: Path) -> Path:
        """The folder of a ROS package for a file in the folder `near`; raises Trouble."""
        if name in self.packages:
            return self.packages[name]
        if not is_package_name(name):
            raise Trouble(f"{name[:60]!r} is not the name of a package")
        for folder in places_of(name, near, self.roots):
            real = Path(os.path.realpath(folder))
            if any(real.is_relative_to(root) for root in self.roots) and real.is_dir():
                return real
        hint = f"put a folder {name} beside the robot's package, name the one that holds it with --world-path, or say "
        raise Trouble(f"there is no package {name!r}", hint + f"`packages: {{{name}: path}}` in the *.robot.yaml")

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
