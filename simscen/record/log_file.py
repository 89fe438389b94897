"""Output file of a log, whose name marks the log as partial until it is complete."""

import errno
from pathlib import Path

from simscen.core.errors import RunError

PARTIAL_SUFFIX = ".partial.mcap"


class LogFile:
    """Unbuffered file, named for example `run.partial.mcap` until `finish` renames it to `run.mcap`.

    Methods raise RunError of kind "output" if the file cannot be written.

    Attributes:
        path: Path of the complete log.
        partial_path: Path until `finish`.
        has_failed: Whether a `write` has failed. The file is then closed.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.has_failed = False
        self.partial_path = path.with_suffix(PARTIAL_SUFFIX)
        try:
            self._raw = self.partial_path.open("wb", buffering=0)
        except OSError as error:
            raise write_error(self.partial_path, error) from error

    def write(self, data: bytes, /) -> None:
        """Write all of `data`."""
        remaining = memoryview(data)  # a raw write may write only a part
        try:
            while remaining:
                remaining = remaining[self._raw.write(remaining) :]
        except OSError as error:
            self._raw.close()
            self.has_failed = True
            raise write_error(self.partial_path, error) from error

    def finish(self) -> None:
        """Close the file and give it its final name."""
        try:
            self._raw.close()
            self.partial_path.replace(self.path)
        except OSError as error:
            raise write_error(self.partial_path, error) from error

    def abandon(self) -> None:
        """Close the file and keep its partial name, because the run was aborted."""
        self._raw.close()


def write_error(path: Path, error: OSError) -> RunError:
    """Return the RunError of kind "output" for the failed write of a file."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return RunError("output", f"no space left writing {path}")
    return RunError("output", f"cannot write {path}: {error.strerror}")
