"""The output folder of a session: made at the start, so that an unusable one is known before anything runs."""

import os
import secrets
from contextlib import suppress
from datetime import datetime, timezone
from pathlib import Path

from simscen.core.errors import UsageError
from simscen.core.files import require_regular_file
from simscen.core.records.run_result import RunKey

DEFAULT_FOLDER = Path("simscen-out")
RUNS_FOLDER = "runs"
"""What every run's folder lies below, so that no scenario's name is that of a report."""


def create_output_folder(out: Path | None) -> Path:
    """The folder `out`, which must be new or empty, or simscen-out/<UTC time>-<4 hex>, to which `latest` then links.

    Raises UsageError when it cannot be made or written to; what is in it is never touched.
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
    """Where a run of the session in `folder` leaves its files."""
    return folder / RUNS_FOLDER / key.scenario / key.folder


def probe_writable(path: Path) -> None:
    """Raise OSError unless a plain file can be written at `path`; leaves no trace."""
    require_regular_file(path)
    existed = path.exists()
    with path.open("ab"):
        pass
    if not existed:
        path.unlink()


def write_atomically(path: Path, data: bytes) -> None:
    """Replace a file as a whole: whoever reads it sees the old one or the new one, even after a crash.

    Raises OSError, also where something other than a plain file would be replaced.
    """
    require_regular_file(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with part.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError:
        with suppress(OSError):
            part.unlink()
        raise


def _link_latest(folder: Path) -> None:
    """`latest` beside the folder; a file system without links does without."""
    link = folder.parent / "latest"
    part = folder.parent / f".latest.{os.getpid()}"
    if link.exists() and not link.is_symlink():
        return  # someone's own
    with suppress(OSError):
        part.symlink_to(folder.name)
        try:
            part.replace(link)
        except OSError:
            part.unlink()
