"""Creation of a file that must not exist yet and that is removed again if writing it fails."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from simscen.core.errors import UsageError
from simscen.loading.yaml.textfile import os_error_reason


@contextmanager
def create_file(file: Path, name: str) -> Iterator[None]:
    """Create an empty file and its folder; remove the file if the block fails.

    `name` is the file as the user wrote it. Raises UsageError if the file exists or cannot be written.
    """
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.open("x").close()
    except FileExistsError:
        raise UsageError(f"{file} already exists; choose another name") from None
    except (OSError, ValueError) as error:
        reason = os_error_reason(error) if isinstance(error, OSError) else "the name cannot be a path"
        raise UsageError(f"cannot write {name!r}: {reason}") from None
    try:
        yield
    except OSError as error:
        file.unlink(missing_ok=True)
        raise UsageError(f"cannot write {name!r}: {os_error_reason(error)}") from None
    except BaseException:
        file.unlink(missing_ok=True)
        raise
