"""What earlier sessions worked out, as files under the user's cache folder, by a key that says all it depends on.

Nothing is ever wrong because of it: what cannot be read, is damaged, or was put there by others counts as not there,
and what cannot be written costs the time to work it out again.
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
"""The folder of what this simscen writes; of another format, another folder."""
MAX_CACHE_BYTES = 256_000_000
"""Of all files together; those that were not used for longest go first."""
MAX_ENTRY_BYTES = 32_000_000
_DIGEST = hashlib.sha256().digest_size


def cache_folder(environment: Mapping[str, str]) -> Path | None:
    """$SIMSCEN_CACHE_DIR, where "off" is none; else simscen in $XDG_CACHE_HOME or ~/.cache (XDG Base Directory).

    None also where there is no home.
    """
    if (own := environment.get(CACHE_DIR_VARIABLE)) is not None:
        return Path(own) / CACHE_FORMAT if own != CACHE_OFF and Path(own).is_absolute() else None
    for base, inside in ((environment.get("XDG_CACHE_HOME", ""), ""), (environment.get("HOME", ""), ".cache")):
        if Path(base).is_absolute():
            return Path(base, inside, "simscen", CACHE_FORMAT)
    return None


class DiskCache:
    """A file for each key, which is a hexadecimal number; sessions that run at once may share the folder."""

    def __init__(self, folder: Path | None, most_bytes: int = MAX_CACHE_BYTES) -> None:
        self._folder, self._most = folder, most_bytes
        self._room: int | None = None

    @property
    def on(self) -> bool:
        """Whether anything is kept at all."""
        return self._folder is not None

    def get(self, key: str) -> bytes | None:
        """What was put there under this key; None where there is nothing, or nothing sound."""
        if self._folder is None or not is_private_folder(self._folder):
            return None
        try:
            descriptor = os.open(self._folder / key, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
            with os.fdopen(descriptor, "rb") as file:
                found = os.fstat(descriptor)
                if not stat.S_ISREG(found.st_mode) or found.st_size > MAX_ENTRY_BYTES:
                    return None
                data = file.read(MAX_ENTRY_BYTES)
                os.utime(descriptor)
        except OSError:  # not there, or not to be read: it is worked out anew
            return None
        content = data[_DIGEST:]
        return content if hashlib.sha256(key.encode() + content).digest() == data[:_DIGEST] else None

    def put(self, key: str, content: bytes) -> None:
        """Keep this, where there is room and a folder that is nobody else's."""
        data = hashlib.sha256(key.encode() + content).digest() + content
        if self._folder is None or len(data) > min(MAX_ENTRY_BYTES, self._most):
            return
        # A full disk, a home that is read-only: the next session works it out again.
        with contextlib.suppress(OSError):
            self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if is_private_folder(self._folder):
                self._write(self._folder, key, data)

    def _write(self, folder: Path, key: str, data: bytes) -> None:
        if self._room is None or self._room < len(data):
            self._room = self._most - _pruned(folder, self._most - len(data))
        self._room -= len(data)
        descriptor, part = tempfile.mkstemp(prefix=".", suffix=".part", dir=folder)
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.write(data)
            Path(part).replace(folder / key)
        except OSError:
            Path(part).unlink(missing_ok=True)
            raise


def is_private_folder(folder: Path) -> bool:
    """Whether it is a folder of this user into which nobody else may write."""
    try:
        found = folder.lstat()
    except OSError:
        return False
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022


def disk_usage(folder: Path) -> tuple[int, int]:
    """How many files a folder holds, and their bytes."""
    sizes = [size for _, size, _ in _files(folder)]
    return len(sizes), sum(sizes)


def _pruned(folder: Path, most: int) -> int:
    """The bytes of a folder, after what was not used for longest has gone as far as `most` asks, also what was left."""
    files = sorted(_files(folder))
    total = sum(size for _, size, _ in files)
    for _, size, name in files:
        if total <= most:
            break
        (folder / name).unlink(missing_ok=True)
        total -= size
    return total


def _files(folder: Path) -> list[tuple[int, int, str]]:
    """When each file was used, its size and its name."""
    found = []
    with os.scandir(folder) as entries:
        for entry in entries:
            with contextlib.suppress(FileNotFoundError):  # another session was faster
                about = entry.stat(follow_symlinks=False)
                if stat.S_ISREG(about.st_mode):
                    found.append((about.st_mtime_ns, about.st_size, entry.name))
    return found
