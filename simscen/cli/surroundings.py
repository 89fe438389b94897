"""What a process finds around it may be missing: its standard descriptors, its folder, room for what it prints."""

import errno
import os
import sys
from pathlib import Path

from simscen.core.errors import Exit, UsageError

NO_ROOM = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EIO})
"""What a stream says that takes no more; EIO is a terminal that has gone."""


def occupy_descriptors() -> None:
    """Give standard streams that were closed (`simscen run . >&-`) to /dev/null.

    Otherwise the next file that is opened, the journal perhaps, would get the descriptor, and what a library prints.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.dup2(os.open(os.devnull, os.O_RDWR), number)
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "r" if number == 0 else "w", encoding="utf-8", closefd=False))  # noqa: SIM115


def require_folder() -> None:
    """Raise UsageError when the working folder has been deleted: nothing could be named from here."""
    try:
        Path.cwd()
    except FileNotFoundError:
        raise UsageError("the working folder no longer exists") from None


def output_lost(error: OSError) -> Exit:
    """Tell why nothing more can be printed, if stderr at least takes it; later flushes shall not fail on it again."""
    _to_nowhere(1)
    try:
        print(f"simscen: cannot write the output: {error.strerror}", file=sys.stderr, flush=True)
    except OSError:
        _to_nowhere(2)
    return Exit.INCOMPLETE


def flushed(code: Exit | int) -> Exit | int:
    """The exit code, or that of output that is lost now that the last of it is written."""
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except BrokenPipeError:  # the reader has gone (`simscen list | head`): nobody is left to tell
        _to_nowhere(1)
        _to_nowhere(2)
        return code or Exit.INCOMPLETE
    except OSError as error:
        return max(code, output_lost(error))
    return code


def _to_nowhere(descriptor: int) -> None:
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, descriptor)
    os.close(nowhere)
