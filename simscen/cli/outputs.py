"""Files that a command is told to write."""

from collections.abc import Callable, Iterable
from pathlib import Path

from simscen.core.errors import UsageError
from simscen.core.outputs import require_no_input, require_plain


def save(path: Path, write: Callable[[Path], None], inputs: Iterable[Path] = ()) -> None:
    """Let `write` make the file; raises UsageError where that cannot be done or would overwrite what was read."""
    try:
        require_plain(path)
        require_no_input(path, inputs)
        path.parent.mkdir(parents=True, exist_ok=True)
        write(path)
    except OSError as error:
        raise UsageError(f"cannot write {path}: {error.strerror}") from error
