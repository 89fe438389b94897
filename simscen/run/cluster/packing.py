"""Transfer of jobs to other machines: the scenario, and the content of the files from which it was loaded."""

import hashlib
import io
import os
import pickle
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from typing import Any

from simscen.loading.loaded import LoadedScenario
from simscen.run.process.jobs import Job

PACKAGE_FOLDER = Path(__file__).parents[2]
"""Folder of the installed package, which can differ between machines."""


@dataclass(frozen=True)
class SentFile:
    """An input file: SHA-256 of its content, and a handle with which a machine gets the content."""

    digest: str
    content: Any


@dataclass(frozen=True)
class PackedJob:
    """A job for another machine: `data` is its pickle with marked paths, `files` its input files by absolute path."""

    number: int
    data: bytes
    files: Mapping[str, SentFile]


def pack(job: Job, send: Callable[[Path], SentFile]) -> PackedJob:
    """Return a job for another machine, without its output folder, which differs there.

    `send` is called for each input file.
    """
    buffer = io.BytesIO()
    pickler = _Pickler(buffer)
    pickler.dump(replace(job, folder=Path()))
    files = sorted({*_input_files(job.scenario), *(path for path in pickler.paths if path.is_file())})
    return PackedJob(job.number, buffer.getvalue(), {str(path): send(path) for path in files})


def _input_files(scenario: LoadedScenario) -> Iterable[Path]:
    paths = {
        path for view in (scenario, *scenario.robots.values()) for path in (*view.files.values(), *view.read_files)
    }
    return (path for path in paths if path.is_file() and not path.is_relative_to(PACKAGE_FOLDER))


class Unpacker:
    """Restores packed jobs.

    If all input files of a job exist here at the same paths with the same content, as in a shared folder, they are used
    in place. Otherwise all of them are written below `folder`.
    """

    def __init__(self, folder: Path, receive: Callable[[Any], bytes]) -> None:
        """`receive` returns the content of a file for its handle."""
        self._folder, self._receive = folder, receive
        self._is_here: dict[tuple[str, str], bool] = {}

    def unpack(self, packed: PackedJob, output: Path) -> Job:
        """Return the job with this output folder, and with paths that are valid on this machine."""
        moved: frozenset[str] = frozenset()
        if not all(self._has(path, file.digest) for path, file in packed.files.items()):
            for path, file in packed.files.items():
                self._write(self._folder / path.lstrip("/"), file)
            moved = frozenset(text for path in packed.files for text in (path, *map(str, PurePath(path).parents)))
        job = _Unpickler(io.BytesIO(packed.data), moved, self._folder).load()
        assert isinstance(job, Job)
        return replace(job, folder=output)

    def _has(self, path: str, digest: str) -> bool:
        """Return whether a file with this content is at the same path on this machine."""
        if (path, digest) not in self._is_here:
            try:
                local_digest = digest_of(Path(path).read_bytes())
            except OSError:
                local_digest = ""
            self._is_here[path, digest] = local_digest == digest
        return self._is_here[path, digest]

    def _write(self, target: Path, file: SentFile) -> None:
        if not target.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(self._receive(file.content))


def digest_of(data: bytes) -> str:
    """Return the SHA-256 of a file's content."""
    return hashlib.sha256(data).hexdigest()


class _Pickler(pickle.Pickler):
    """Pickler that marks each path as "package" (stored relative to the package) or "path", collected in `paths`."""

    def __init__(self, file: io.BytesIO) -> None:
        super().__init__(file)
        self.paths: set[Path] = set()

    def persistent_id(self, obj: Any) -> tuple[str, str] | None:
        if not isinstance(obj, Path):
            return None
        if obj.is_relative_to(PACKAGE_FOLDER):
            return "package", os.fspath(obj.relative_to(PACKAGE_FOLDER))
        self.paths.add(obj)
        return "path", os.fspath(obj)


class _Unpickler(pickle.Unpickler):
    """Unpickler that restores marked paths. Files whose paths are in `moved` are found below `folder` instead."""

    def __init__(self, file: io.BytesIO, moved: frozenset[str], folder: Path) -> None:
        super().__init__(file)
        self._moved, self._folder = moved, folder

    def persistent_load(self, pid: tuple[str, str]) -> Path:
        origin, text = pid
        if origin == "package":
            return PACKAGE_FOLDER / text
        return self._folder / text.lstrip("/") if text in self._moved else Path(text)
