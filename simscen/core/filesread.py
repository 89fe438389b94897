"""Which files a world or a robot was made of, told by the few functions that open them."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

_READ: ContextVar[set[Path] | None] = ContextVar("files_read", default=None)


@contextmanager
def files_read() -> Iterator[set[Path]]:
    """The set that every file goes into which is read within: real paths, also of files that could not be used."""
    read: set[Path] = set()
    token = _READ.set(read)
    try:
        yield read
    finally:
        _READ.reset(token)


def note_read(file: Path) -> None:
    """Say that a result depends on the content of this file; every reader of files that others name must."""
    read = _READ.get()
    if read is not None:
        read.add(file)
