"""What a process finds around it may be missing: its standard descriptors, its folder, room for what it prints."""

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
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


# MERGED: Keeps what engines print on file descriptor 1 out of the command's own output.
@contextmanager
def engine_output_on_stderr() -> Iterator[None]:
    """Bullet prints warnings from C on descriptor 1; send them to standard error meanwhile."""
    sys.stdout.flush()
    saved = os.dup(1)
    os.dup2(2, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(saved, 1)
        os.close(saved)


# MERGED: The environment that simscen was called with, and where the user's own configuration lies in it.
PLUGINS = "PYDANTIC_DISABLE_PLUGINS"
COMPLETE = "_SIMSCEN_COMPLETE"
"""By this variable a shell says that it wants to know what may be typed next; the name is click's."""
_AT_START = os.environ.get(PLUGINS)
"""As the caller had it: `simscen` sets it for itself before anything else."""


def environment() -> dict[str, str]:
    """The variables that the user has: what is started for them shall meet them as in their shell."""
    variables = {name: value for name, value in os.environ.items() if name != PLUGINS}
    return variables if _AT_START is None else {**variables, PLUGINS: _AT_START}


def config_file() -> Path:
    """$XDG_CONFIG_HOME/simscen/config.yaml; ~/.config where that is not an absolute folder (XDG Base Directory)."""
    home = Path(os.environ.get("XDG_CONFIG_HOME", ""))
    return (home if home.is_absolute() else Path("~/.config").expanduser()) / "simscen" / "config.yaml"
