"""Checks of the paths of output files, the home folder in paths, and a record of the input files that were read."""

import errno
import os
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path


def require_regular_file(path: Path) -> None:
    """Raise OSError if `path` exists and is not a regular file: a folder, symbolic link, device, or pipe."""
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return
    if stat.S_ISLNK(mode):
        raise OSError(errno.EINVAL, "it is a symbolic link; name the file itself")
    if stat.S_ISDIR(mode):
        raise OSError(errno.EISDIR, os.strerror(errno.EISDIR))
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "it is not a regular file")


def probe_writable(path: Path) -> None:
    """Raise OSError unless a regular file can be written at `path`. Deletes the file if it did not exist before."""
    require_regular_file(path)
    existed = path.exists()
    with path.open("ab"):
        pass
    if not existed:
        path.unlink()


def require_not_input(path: Path, inputs: Iterable[Path]) -> None:
    """Raise OSError if the output file `path` is one of the `inputs`."""
    real_path = os.path.realpath(path)
    if any(os.path.realpath(file) == real_path for file in inputs):
        raise OSError(errno.EINVAL, "it is one of the input files")


def expand_home(path: str | Path) -> Path:
    """Return a path with its leading `~` replaced by the home folder; unchanged if the home folder is unknown."""
    try:
        return Path(path).expanduser()
    except RuntimeError:
        return Path(path)


_READ_FILES: ContextVar[set[Path] | None] = ContextVar("files_read", default=None)
"""Set to which `record_read_file` adds files; None outside of a `with` block of `collect_read_files`."""


@contextmanager
def collect_read_files() -> Iterator[set[Path]]:
    """Yield a set to which `record_read_file` adds the files that are read during the `with` block."""
    read: set[Path] = set()
    token = _READ_FILES.set(read)
    try:
        yield read
    finally:
        _READ_FILES.reset(token)


def record_read_file(file: Path) -> None:
    """Record that an input file was read. Has no effect outside of a `with` block of `collect_read_files`.

    Call this for every file to which another input file refers.
    """
    read = _READ_FILES.get()
    if read is not None:
        read.add(file)
