"""Creation of files that the user named on the command line. Errors are raised as UsageError."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from simscen.core.errors import UsageError
from simscen.core.files import probe_writable, require_not_input
from simscen.loading.yaml.textfile import os_error_reason


@contextmanager
def create_file(file: Path, name: str) -> Iterator[None]:
    """Create an empty file and its folder. If the body of the `with` statement fails, remove the file again.

    `name` is the name of the file in messages. Raises UsageError if the file exists or cannot be written.
    """
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.open("x").close()
    except FileExistsError:
        raise UsageError(f"{file} already exists; choose another name") from None
    except (OSError, ValueError) as error:
        reason = os_error_reason(error) if isinstance(error, OSError) else "a path cannot contain this character"
        raise UsageError(f"cannot write {name!r}: {reason}") from None
    try:
        yield
    except BaseException as error:
        file.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise UsageError(f"cannot write {name!r}: {os_error_reason(error)}") from None
        raise


def require_writable(path: Path, inputs: Iterable[Path] = ()) -> None:
    """Create the folder of an output file. Raises UsageError if it cannot be written or is an input."""
    try:
        require_not_input(path, inputs)
        path.parent.mkdir(parents=True, exist_ok=True)
        probe_writable(path)
    except OSError as error:
        raise UsageError(f"cannot write {path}: {error.strerror}") from error


def save(path: Path, write: Callable[[Path], object], inputs: Iterable[Path] = ()) -> None:
    """Create or replace a file by calling `write` with its path.

    Raises UsageError if that fails, and if the file is one of the `inputs`.
    """
    require_writable(path, inputs)
    try:
        write(path)
    except OSError as error:
        raise UsageError(f"cannot write {path}: {error.strerror}") from error
