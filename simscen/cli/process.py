"""Environment of a command: standard streams, working directory, environment variables, and configuration file."""

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from simscen.core.cpu_kernels import pinned_variables
from simscen.core.errors import Exit, UsageError
from simscen.core.files import expand_home

OUTPUT_LOST_ERRNOS = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EIO})
"""Error numbers with which output to stdout or stderr is lost: disk full, quota exceeded, terminal closed."""

INACCESSIBLE_PATH_ERRNOS = frozenset({errno.EACCES, errno.EPERM, errno.ENAMETOOLONG})
"""Error numbers of a path that cannot be accessed: permission denied, or a name that is too long."""

PYDANTIC_PLUGINS_VARIABLE = "PYDANTIC_DISABLE_PLUGINS"
"""Environment variable that disables plug-ins of pydantic."""
COMPLETION_VARIABLE = "_SIMSCEN_COMPLETE"
"""Environment variable with which a shell requests completions from click."""
_PYDANTIC_PLUGINS_AT_START = os.environ.get(PYDANTIC_PLUGINS_VARIABLE)
"""Value of PYDANTIC_PLUGINS_VARIABLE before `main` changes the variable; None if it was not set."""


def reopen_closed_streams() -> None:
    """Redirect closed standard streams, as in `simscen run . >&-`, to /dev/null.

    Otherwise, the next opened file would get the file descriptor of the stream, and receive all printed text.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.dup2(os.open(os.devnull, os.O_RDWR), number)
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "r" if number == 0 else "w", encoding="utf-8", closefd=False))  # noqa: SIM115


def require_working_directory() -> None:
    """Raise UsageError if the working directory has been deleted."""
    try:
        Path.cwd()
    except FileNotFoundError:
        raise UsageError("the working directory no longer exists") from None


def report_lost_output(error: OSError) -> Exit:
    """Discard further output on stdout, report the loss on stderr, and return INCOMPLETE."""
    discard_output(1)
    try:
        print(f"simscen: cannot write the output: {error.strerror}", file=sys.stderr, flush=True)
    except OSError:
        discard_output(2)
    return Exit.INCOMPLETE


def flush_output(code: Exit | int) -> Exit | int:
    """Flush stdout and stderr, and return the final exit code of the process.

    If output was lost, the exit code is at least INCOMPLETE. If the reader has closed the pipe, a `code` of 0 becomes
    INCOMPLETE, and other codes stay.
    """
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except BrokenPipeError:  # the reader has closed the pipe, as in `simscen list | head`
        discard_output(1)
        discard_output(2)
        return code or Exit.INCOMPLETE
    except OSError as error:
        return max(code, report_lost_output(error))
    return code


def discard_output(descriptor: int) -> None:
    """Redirect a file descriptor to /dev/null."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, descriptor)
    os.close(null)


@contextmanager
def engine_output_on_stderr() -> Iterator[None]:
    """Redirect file descriptor 1 to stderr within the context, so that warnings of Bullet do not go to stdout."""
    sys.stdout.flush()
    saved = os.dup(1)
    os.dup2(2, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(saved, 1)
        os.close(saved)


def caller_environment() -> dict[str, str]:
    """Return the environment variables with which simscen was started, for the programs that simscen starts."""
    changed = {PYDANTIC_PLUGINS_VARIABLE, *pinned_variables()}
    variables = {name: value for name, value in os.environ.items() if name not in changed}
    if _PYDANTIC_PLUGINS_AT_START is not None:
        variables[PYDANTIC_PLUGINS_VARIABLE] = _PYDANTIC_PLUGINS_AT_START
    return variables


def config_file() -> Path:
    """Return the user's configuration file: simscen/config.yaml in $XDG_CONFIG_HOME or ~/.config."""
    config_home = Path(os.environ.get("XDG_CONFIG_HOME", ""))
    return (config_home if config_home.is_absolute() else expand_home("~/.config")) / "simscen" / "config.yaml"
