"""What installed packages are, down to their files: a package in development changes without a new version."""

import hashlib
import importlib.util
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

from simscen.spec.registry import Entry


def packages_of(plugins: Iterable[Entry]) -> dict[str, dict[str, object]]:
    """The packages by name, each with its version and what of it is used, for run.json."""
    found: dict[str, dict[str, object]] = {}
    for entry in plugins:
        package = found.setdefault(entry.distribution, {"version": entry.version, "used": []})
        used = package["used"]
        assert isinstance(used, list)
        used.append(f"{entry.group} {entry.name}")
    return found


def fingerprints(plugins: Iterable[Entry]) -> dict[str, list[str]]:
    """What of an installed package could change a run: its version, its class, and all of its files."""
    return {
        f"{entry.group} {entry.name}": [entry.distribution, entry.version, entry.value, _files_digest(entry.value)]
        for entry in plugins
    }


@cache
def _files_digest(value: str) -> str:
    """SHA-256 over the files of the outermost package that the class is in; of its module alone where there is none."""
    sha = hashlib.sha256()
    for name, file in _files(value):
        data = file.read_bytes()
        sha.update(f"{name}\0{len(data)}\0".encode() + data)
    return sha.hexdigest()


def files_of(plugins: Iterable[Entry]) -> list[Path]:
    """The files of the outermost packages that their classes are in."""
    return [file for entry in plugins for _, file in _files(entry.value)]


def _files(value: str) -> Iterator[tuple[str, Path]]:
    found = importlib.util.find_spec(value.partition(":")[0])
    if found is None or found.origin is None:
        return
    file = Path(found.origin)
    folder = file.parent
    if not (folder / "__init__.py").is_file():
        yield file.name, file
        return
    while (folder.parent / "__init__.py").is_file():
        folder = folder.parent
    for path in sorted(folder.rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts:
            yield path.relative_to(folder).as_posix(), path
