"""Checks of output paths, and a record of the input files that were read."""

import errno
import os
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path


def require_regular_file(path: Path) -> None:
    """Raise OSError unless `path` is a plain file or nothing.

    To replace a device or a link breaks what others rely on, and a pipe that nobody reads is waited for.
    """
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return
    if stat.S_ISLNK(mode):
        raise OSError(errno.EINVAL, "it is a symbolic link; name the file itself")
    if stat.S_ISDIR(mode):
        raise OSError(errno.EISDIR, os.strerror(errno.EISDIR))
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "it is not a plain file")


def require_not_input(path: Path, inputs: Iterable[Path]) -> None:
    """Raise OSError when writing `path` would overwrite one of the files that were read."""
    real = os.path.realpath(path)
    if any(os.path.realpath(each) == real for each in inputs):
        raise OSError(errno.EINVAL, "it is one of the files that are read")


_READ: ContextVar[set[Path] | None] = ContextVar("files_read", default=None)


@contextmanager
def collect_read_files() -> Iterator[set[Path]]:
    """The set that every file goes into which is read within: real paths, also of files that could not be used."""
    read: set[Path] = set()
    token = _READ.set(read)
    try:
        yield read
    finally:
        _READ.reset(token)


def record_read_file(file: Path) -> None:
    """Say that a result depends on the content of this file; every reader of files that others name must."""
    read = _READ.get()
    if read is not None:
        read.add(file)
