"""The file of a log: under a partial name while it grows, under its own when it is whole."""

import errno
from pathlib import Path

from simscen.core.errors import RunError

PARTIAL_SUFFIX = ".partial.mcap"


class LogFile:
    """Writes `run.partial.mcap` and renames it to `run.mcap` on `finish`.

    Nothing is buffered in the process: what was written survives its death. A full disk or the like is a
    RunError of kind "output"; `failed` then says that the file takes no more.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.failed = False
        self.partial = path.with_suffix(PARTIAL_SUFFIX)
        try:
            self._raw = self.partial.open("wb", buffering=0)
        except OSError as error:
            raise failure(self.partial, error) from error

    def write(self, data: bytes, /) -> None:
        """Write all of `data`; a raw write may take only a part."""
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._raw.write(rest) :]
        except OSError as error:
            self._raw.close()
            self.failed = True
            raise failure(self.partial, error) from error

    def finish(self) -> None:
        """The log is whole: give it its name."""
        try:
            self._raw.close()
            self.partial.replace(self.path)
        except OSError as error:
            raise failure(self.partial, error) from error

    def abandon(self) -> None:
        """The run broke off: leave what there is under the partial name."""
        self._raw.close()


def failure(path: Path, error: OSError) -> RunError:
    """What a log that cannot be written means for its run."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return RunError("output", f"no space left writing {path}")
    return RunError("output", f"cannot write {path}: {error.strerror}")
