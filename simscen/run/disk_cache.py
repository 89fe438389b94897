"""Disk cache of the current user: one file for each entry, in a folder to which only this user can write."""

import contextlib
import hashlib
import os
import stat
import tempfile
from collections.abc import Mapping
from pathlib import Path

CACHE_DIR_VARIABLE, CACHE_OFF = "SIMSCEN_CACHE_DIR", "off"
"""Environment variable with the absolute path of the cache folder, and its value that disables the disk cache."""
CACHE_FORMAT = "worlds-1"
"""Name of the subfolder for entries. Change it when the format of entries changes."""
MAX_CACHE_BYTES = 256_000_000
"""Size limit of the disk cache. Above it, the least recently used entries are deleted."""
MAX_ENTRY_BYTES = 32_000_000
"""Size limit of one entry; a larger entry is not stored."""
_DIGEST_BYTES = hashlib.sha256().digest_size


def cache_folder(environment: Mapping[str, str]) -> Path | None:
    """Return the folder for entries: in $SIMSCEN_CACHE_DIR, $XDG_CACHE_HOME/simscen, or ~/.cache/simscen.

    Returns None if $SIMSCEN_CACHE_DIR is `off` or not absolute, or if there is no home folder.
    """
    if (configured := environment.get(CACHE_DIR_VARIABLE)) is not None:
        return Path(configured) / CACHE_FORMAT if configured != CACHE_OFF and Path(configured).is_absolute() else None
    for base, subfolder in ((environment.get("XDG_CACHE_HOME", ""), ""), (environment.get("HOME", ""), ".cache")):
        if Path(base).is_absolute():
            return Path(base, subfolder, "simscen", CACHE_FORMAT)
    return None


class DiskCache:
    """Cache with one file for each entry, named after its key. Concurrent sessions can share the folder.

    Without a `folder`, the cache is disabled. `max_bytes` limits the total size of all entries.
    """

    def __init__(self, folder: Path | None, max_bytes: int = MAX_CACHE_BYTES) -> None:
        self._folder, self._max_bytes = folder, max_bytes
        self._remaining_bytes: int | None = None
        """Number of bytes that can be written before entries must be deleted; None before the first write."""

    @property
    def is_enabled(self) -> bool:
        """Whether the cache is enabled."""
        return self._folder is not None

    def get(self, key: str) -> bytes | None:
        """Return the entry of a key, or None if the entry is missing or damaged."""
        if self._folder is None or not is_private_folder(self._folder):
            return None
        try:
            descriptor = os.open(self._folder / key, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
            with os.fdopen(descriptor, "rb") as file:
                status = os.fstat(descriptor)
                if not stat.S_ISREG(status.st_mode) or status.st_size > MAX_ENTRY_BYTES:
                    return None
                data = file.read(MAX_ENTRY_BYTES)
                with contextlib.suppress(OSError):  # a read-only file system
                    os.utime(descriptor)
        except OSError:  # missing or unreadable: the caller computes the entry again
            return None
        content = data[_DIGEST_BYTES:]
        return content if hashlib.sha256(key.encode() + content).digest() == data[:_DIGEST_BYTES] else None

    def put(self, key: str, content: bytes) -> None:
        """Store an entry. Does nothing if the entry is too large or the folder cannot be used."""
        data = hashlib.sha256(key.encode() + content).digest() + content
        if self._folder is None or len(data) > min(MAX_ENTRY_BYTES, self._max_bytes):
            return
        # A full disk or a read-only home must not fail the session.
        with contextlib.suppress(OSError):
            self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if is_private_folder(self._folder):
                self._write(self._folder, key, data)

    def _write(self, folder: Path, key: str, data: bytes) -> None:
        """Write an entry atomically. Deletes old entries first if the cache would become too large."""
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
    """Return whether a folder exists, belongs to this user, and no other user can write to it."""
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
    """Return the time of last use (ns), size (bytes), and name of each file."""
    files = []
    with os.scandir(folder) as entries:
        for entry in entries:
            with contextlib.suppress(FileNotFoundError):  # deleted by another session
                status = entry.stat(follow_symlinks=False)
                if stat.S_ISREG(status.st_mode):
                    files.append((status.st_mtime_ns, status.st_size, entry.name))
    return files
