"""Cache on disk that sessions share, in the user's cache folder.

A key contains everything that the entry depends on. Unreadable or damaged entries and folders of other users count as
missing. Write errors are ignored.
"""

import contextlib
import hashlib
import os
import stat
import tempfile
from collections.abc import Mapping
from pathlib import Path

CACHE_DIR_VARIABLE, CACHE_OFF = "SIMSCEN_CACHE_DIR", "off"
CACHE_FORMAT = "worlds-1"
"""Name of the cache folder; changes with the format."""
MAX_CACHE_BYTES = 256_000_000
"""Size limit of the cache. The least recently used entries are deleted first."""
MAX_ENTRY_BYTES = 32_000_000
_DIGEST = hashlib.sha256().digest_size


def cache_folder(environment: Mapping[str, str]) -> Path | None:
    """Return $SIMSCEN_CACHE_DIR, or simscen in $XDG_CACHE_HOME or ~/.cache (XDG Base Directory).

    Returns None for $SIMSCEN_CACHE_DIR=off and if there is no home folder.
    """
    if (configured := environment.get(CACHE_DIR_VARIABLE)) is not None:
        return Path(configured) / CACHE_FORMAT if configured != CACHE_OFF and Path(configured).is_absolute() else None
    for base, subfolder in ((environment.get("XDG_CACHE_HOME", ""), ""), (environment.get("HOME", ""), ".cache")):
        if Path(base).is_absolute():
            return Path(base, subfolder, "simscen", CACHE_FORMAT)
    return None


class DiskCache:
    """Cache with one file per key, a hexadecimal number. Concurrent sessions can share the folder.

    Without a `folder`, the cache is disabled. `max_bytes` limits the size of all entries together.
    """

    def __init__(self, folder: Path | None, max_bytes: int = MAX_CACHE_BYTES) -> None:
        self._folder, self._max_bytes = folder, max_bytes
        self._remaining_bytes: int | None = None

    @property
    def is_enabled(self) -> bool:
        """Whether the cache is enabled."""
        return self._folder is not None

    def get(self, key: str) -> bytes | None:
        """Return the entry of a key, or None if it is missing or damaged."""
        if self._folder is None or not is_private_folder(self._folder):
            return None
        try:
            descriptor = os.open(self._folder / key, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
            with os.fdopen(descriptor, "rb") as file:
                status = os.fstat(descriptor)
                if not stat.S_ISREG(status.st_mode) or status.st_size > MAX_ENTRY_BYTES:
                    return None
                data = file.read(MAX_ENTRY_BYTES)
                os.utime(descriptor)
        except OSError:  # missing or unreadable: the caller computes it again
            return None
        content = data[_DIGEST:]
        return content if hashlib.sha256(key.encode() + content).digest() == data[:_DIGEST] else None

    def put(self, key: str, content: bytes) -> None:
        """Store an entry, unless it is too large or the folder does not belong to this user alone."""
        data = hashlib.sha256(key.encode() + content).digest() + content
        if self._folder is None or len(data) > min(MAX_ENTRY_BYTES, self._max_bytes):
            return
        # A full disk or a read-only home must not fail the session.
        with contextlib.suppress(OSError):
            self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if is_private_folder(self._folder):
                self._write(self._folder, key, data)

    def _write(self, folder: Path, key: str, data: bytes) -> None:
        if self._remaining_bytes is None or self._remaining_bytes < len(data):
            self._remaining_bytes = self._max_bytes - _prune(folder, self._max_bytes - len(data))
        self._remaining_bytes -= len(data)
        descriptor, part = tempfile.mkstemp(prefix=".", suffix=".part", dir=folder)
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.write(data)
            Path(part).replace(folder / key)
        except OSError:
            Path(part).unlink(missing_ok=True)
            raise


def is_private_folder(folder: Path) -> bool:
    """Return whether a folder belongs to this user and no other user can write to it."""
    try:
        status = folder.lstat()
    except OSError:
        return False
    return stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not status.st_mode & 0o022


def disk_usage(folder: Path) -> tuple[int, int]:
    """Return the number of files in a folder and their total size in bytes."""
    sizes = [size for _, size, _ in _files(folder)]
    return len(sizes), sum(sizes)


def _prune(folder: Path, max_bytes: int) -> int:
    """Delete the least recently used files until at most `max_bytes` bytes remain; return the remaining size."""
    files = sorted(_files(folder))
    total = sum(size for _, size, _ in files)
    for _, size, name in files:
        if total <= max_bytes:
            break
        (folder / name).unlink(missing_ok=True)
        total -= size
    return total


def _files(folder: Path) -> list[tuple[int, int, str]]:
    """Return time of last use (ns), size (bytes), and name of each file."""
    files = []
    with os.scandir(folder) as entries:
        for entry in entries:
            with contextlib.suppress(FileNotFoundError):  # deleted by another session
                status = entry.stat(follow_symlinks=False)
                if stat.S_ISREG(status.st_mode):
                    files.append((status.st_mtime_ns, status.st_size, entry.name))
    return files
