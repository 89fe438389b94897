"""Create the output folder of a session and the names of its run folders, and write files atomically."""

import os
import secrets
from collections.abc import Iterable
from contextlib import suppress
from datetime import datetime, timezone
from pathlib import Path

from simscen.core.errors import UsageError
from simscen.core.files import probe_writable, require_regular_file
from simscen.core.records.run_result import RunKey

DEFAULT_FOLDER = Path("simscen-out")
RUNS_FOLDER = "runs"
"""Name of the folder of all run folders in the output folder."""


def create_output_folder(out: Path | None) -> Path:
    """Create and return the folder `out`. Raises UsageError if it is not empty or cannot be written to.

    If `out` is None, creates simscen-out/<UTC time>-<4 hex digits>, and the link simscen-out/latest to this folder.
    """
    folder = out or DEFAULT_FOLDER / f"{datetime.now(timezone.utc):%Y%m%dT%H%M%SZ}-{secrets.token_hex(2)}"
    try:
        if folder.is_dir() and any(folder.iterdir()):
            raise UsageError(f"the output folder {folder} is not empty; nothing in it was touched")
        folder.mkdir(parents=True, exist_ok=True)
        probe_writable(folder / ".probe")
    except OSError as error:
        raise UsageError(f"cannot use the output folder {folder}: {error.strerror}") from error
    if out is None:
        _link_latest(folder)
    return folder


def run_folder(folder: Path, key: RunKey) -> Path:
    """Return the folder of a run in the output folder `folder` of its session."""
    return folder / RUNS_FOLDER / key.scenario / key.folder


def write_atomically(path: Path, data: bytes | Iterable[bytes]) -> None:
    """Replace a file atomically: readers see the old or the new content, even after a crash.

    `data` is the content or its parts in order. Raises OSError if the file cannot be written or is not a regular file.
    """
    require_regular_file(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with part.open("wb") as file:
            file.writelines([data] if isinstance(data, bytes) else data)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError:
        with suppress(OSError):
            part.unlink()
        raise


def _link_latest(folder: Path) -> None:
    """Create the link `latest` to the folder, if the file system supports links."""
    link = folder.parent / "latest"
    part = folder.parent / f".latest.{os.getpid()}"
    if link.exists() and not link.is_symlink():
        return  # a file of the user
    with suppress(OSError):
        part.symlink_to(folder.name)
        try:
            part.replace(link)
        except OSError:
            part.unlink()
