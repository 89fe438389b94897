"""Transfer of jobs and their input files to other machines, where paths can differ."""

import hashlib
import io
import os
import pickle
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from typing import Any

from simscen.core.version import PACKAGE
from simscen.loading.loaded import LoadedScenario
from simscen.run.process.jobs import Job


@dataclass(frozen=True)
class SentFile:
    """An input file: the SHA-256 of its content, and a Ray reference to the content."""

    digest: str
    content: Any


@dataclass(frozen=True)
class PackedJob:
    """A job to send to another machine: `data` is the pickled job, and `files` has its input files by absolute path."""

    number: int
    data: bytes
    files: Mapping[str, SentFile]


def pack(job: Job, send: Callable[[Path], SentFile]) -> PackedJob:
    """Pack a job, without its output folder, for another machine. `send` puts an input file into the cluster."""
    buffer = io.BytesIO()
    pickler = _Pickler(buffer)
    pickler.dump(replace(job, folder=Path()))
    files = sorted({*_input_files(job.scenario), *(path for path in pickler.paths if path.is_file())})
    return PackedJob(job.number, buffer.getvalue(), {str(path): send(path) for path in files})


def _input_files(scenario: LoadedScenario) -> Iterable[Path]:
    paths = {
        path for view in (scenario, *scenario.robots.values()) for path in (*view.files.values(), *view.read_files)
    }
    return (path for path in paths if path.is_file() and not path.is_relative_to(PACKAGE))


class Unpacker:
    """Restores packed jobs on another machine.

    Writes the input files of a job below `folder`, unless all of them exist at their original paths with the same
    content.
    """

    def __init__(self, folder: Path, receive: Callable[[Any], bytes]) -> None:
        """`receive` returns the content of a file for a Ray reference."""
        self._folder, self._receive = folder, receive
        self._is_on_machine: dict[tuple[str, str], bool] = {}
        """Cache of `_has`, by path and digest."""

    def unpack(self, packed: PackedJob, output: Path) -> Job:
        """Return the job with the output folder `output` and with paths that are valid on this machine."""
        moved_paths: frozenset[str] = frozenset()
        if not all(self._has(path, file.digest) for path, file in packed.files.items()):
            for path, file in packed.files.items():
                self._write(self._folder / path.lstrip("/"), file)
            moved_paths = frozenset(text for path in packed.files for text in (path, *map(str, PurePath(path).parents)))
        job = _Unpickler(io.BytesIO(packed.data), moved_paths, self._folder).load()
        assert isinstance(job, Job)
        return replace(job, folder=output)

    def _has(self, path: str, digest: str) -> bool:
        """Return whether a file with this content is at the same path on this machine."""
        if (path, digest) not in self._is_on_machine:
            try:
                local_digest = digest_of(Path(path).read_bytes())
            except OSError:
                local_digest = ""
            self._is_on_machine[path, digest] = local_digest == digest
        return self._is_on_machine[path, digest]

    def _write(self, target: Path, file: SentFile) -> None:
        if not target.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(self._receive(file.content))


def digest_of(data: bytes) -> str:
    """Return the SHA-256 of a file's content."""
    return hashlib.sha256(data).hexdigest()


class _Pickler(pickle.Pickler):
    """Pickler that stores each path as ("package", relative path) inside PACKAGE, else as ("path", path).

    PACKAGE is the folder of simscen, which can differ between machines. `paths` collects the paths outside of it.
    """

    def __init__(self, file: io.BytesIO) -> None:
        super().__init__(file)
        self.paths: set[Path] = set()

    def persistent_id(self, obj: Any) -> tuple[str, str] | None:
        if not isinstance(obj, Path):
            return None
        if obj.is_relative_to(PACKAGE):
            return "package", os.fspath(obj.relative_to(PACKAGE))
        self.paths.add(obj)
        return "path", os.fspath(obj)


class _Unpickler(pickle.Unpickler):
    """Unpickler for the output of _Pickler. Replaces the paths in `moved_paths` by paths below `folder`."""

    def __init__(self, file: io.BytesIO, moved_paths: frozenset[str], folder: Path) -> None:
        super().__init__(file)
        self._moved_paths, self._folder = moved_paths, folder

    def persistent_load(self, pid: tuple[str, str]) -> Path:
        origin, text = pid
        if origin == "package":
            return PACKAGE / text
        return self._folder / text.lstrip("/") if text in self._moved_paths else Path(text)
