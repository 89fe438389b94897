"""Output file of a log, which has a partial name until the log is complete."""

import errno
from pathlib import Path

from simscen.core.errors import RunError

PARTIAL_SUFFIX = ".partial.mcap"


class LogFile:
    """Unbuffered file, named for example `run.partial.mcap` until `finish` renames it to `run.mcap`.

    Methods raise RunError of kind "output" if the file cannot be written. After a failed `write`, `failed` is True.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.failed = False
        self.partial = path.with_suffix(PARTIAL_SUFFIX)
        try:
            self._raw = self.partial.open("wb", buffering=0)
        except OSError as error:
            raise write_error(self.partial, error) from error

    def write(self, data: bytes, /) -> None:
        """Write all of `data`."""
        rest = memoryview(data)  # a raw write may write only a part
        try:
            while rest:
                rest = rest[self._raw.write(rest) :]
        except OSError as error:
            self._raw.close()
            self.failed = True
            raise write_error(self.partial, error) from error

    def finish(self) -> None:
        """Close the file and give it its final name."""
        try:
            self._raw.close()
            self.partial.replace(self.path)
        except OSError as error:
            raise write_error(self.partial, error) from error

    def abandon(self) -> None:
        """Close the file and keep its partial name, because the run was aborted."""
        self._raw.close()


def write_error(path: Path, error: OSError) -> RunError:
    """Return the RunError of kind "output" for a failed write."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return RunError("output", f"no space left writing {path}")
    return RunError("output", f"cannot write {path}: {error.strerror}")
