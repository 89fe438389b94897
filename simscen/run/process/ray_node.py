"""Parts of RayBackend that run on the nodes of a Ray cluster, and the transfer of jobs and files to and from a node.

RayBackend makes Ray actors of the classes NodeRunner and JobQueue.
"""

import hashlib
import io
import os
import pickle
import shutil
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import Any

from simscen.core.errors import UsageError
from simscen.core.version import __version__
from simscen.loading.loaded import LoadedScenario
from simscen.loading.plugins import requirement_of
from simscen.run.platform_fingerprint import source_digest
from simscen.run.process.jobs import Ended, Job, JobUpdate
from simscen.run.process.supervisor import Supervisor
from simscen.spec.registry import RegisteredType, find_type

PACKAGE_FOLDER = Path(__file__).parents[2]
"""Folder of the installed package simscen, which can differ between machines."""


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
    return (path for path in paths if path.is_file() and not path.is_relative_to(PACKAGE_FOLDER))


class Unpacker:
    """Restores packed jobs on another machine.

    Writes the input files of a job below `folder`, unless all of them exist at their original paths with the same
    content.
    """

    def __init__(self, folder: Path, receive: Callable[[Any], bytes]) -> None:
        """`receive` returns the content of a file for a Ray reference."""
        self._folder, self._receive = folder, receive
        self._is_here: dict[tuple[str, str], bool] = {}

    def unpack(self, packed: PackedJob, output: Path) -> Job:
        """Return the job with the output folder `output` and with paths that are valid on this machine."""
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
    """Pickler that stores each path as ("package", relative path) inside PACKAGE_FOLDER, else as ("path", path).

    `paths` collects the paths outside of PACKAGE_FOLDER.
    """

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
    """Unpickler for the output of _Pickler. Replaces the paths in `moved` by paths below `folder`."""

    def __init__(self, file: io.BytesIO, moved: frozenset[str], folder: Path) -> None:
        super().__init__(file)
        self._moved, self._folder = moved, folder

    def persistent_load(self, pid: tuple[str, str]) -> Path:
        origin, text = pid
        if origin == "package":
            return PACKAGE_FOLDER / text
        return self._folder / text.lstrip("/") if text in self._moved else Path(text)


CHUNK_BYTES = 8 << 20
"""Largest part of an output file that is sent at once."""


@dataclass(frozen=True)
class FileChunk:
    """Next part of a file in the output folder of job `number`. `name` is the path relative to the folder."""

    number: int
    name: str
    data: bytes


NodeUpdate = JobUpdate | FileChunk
"""Update that a node sends. The chunks of all files of a job are sent before the end of the job."""


class JobQueue:
    """Queue of jobs for all runners, and a record of the jobs that each runner has taken."""

    def __init__(self) -> None:
        self._waiting: deque[PackedJob] = deque()
        self._taken: dict[str, list[int]] = {}

    def add(self, job: PackedJob) -> None:
        """Add a job at the end."""
        self._waiting.append(job)

    def take(self, runner: str) -> PackedJob | None:
        """Remove the next job, and return it to the runner named `runner`; return None if the queue is empty."""
        if not self._waiting:
            return None
        job = self._waiting.popleft()
        self._taken.setdefault(runner, []).append(job.number)
        return job

    def taken_by(self, runner: str) -> list[int]:
        """Return the numbers of the jobs that a runner has taken since the last call of `clear`."""
        return self._taken.get(runner, [])

    def clear(self) -> None:
        """Remove all jobs and records."""
        self._waiting.clear()
        self._taken.clear()


class NodeRunner:
    """Runs jobs on one node in processes of its own supervisor, `workers` at a time."""

    def __init__(self, workers: int, entry: Sequence[str], receive: Callable[[Any], Any]) -> None:
        """`entry` are the Python arguments that start a fork server. `receive` is `ray.get`."""
        self._temporary = TemporaryDirectory(prefix="simscen-")
        self._folder = Path(self._temporary.name)
        self._supervisor = Supervisor(workers, entry)
        self._unpacker = Unpacker(self._folder / "inputs", receive)
        self._receive = receive

    def software(self) -> tuple[str, str]:
        """Return the version of simscen on this node, and a digest of its code."""
        return __version__, source_digest()

    def run(self, queue: Any, runner: str, plugins: Sequence[RegisteredType]) -> Iterator[NodeUpdate]:
        """Run jobs from the queue until it is empty, and yield their updates and files.

        `runner` is the name of this runner. Raises UsageError if a plug-in is missing or has another version here.
        """
        jobs = _JobsOfQueue(lambda: self._take_job(queue, runner))
        for update in self._supervisor.run(jobs, [_installed_plugin(entry) for entry in plugins]):
            if isinstance(update, Ended):
                folder = self._output_folder(update.number)
                yield from _file_chunks(update.number, folder)
                shutil.rmtree(folder, ignore_errors=True)
            yield update

    def _take_job(self, queue: Any, runner: str) -> Job | None:
        packed: PackedJob | None = self._receive(queue.take.remote(runner))
        return None if packed is None else self._unpacker.unpack(packed, self._output_folder(packed.number))

    def _output_folder(self, number: int) -> Path:
        return self._folder / f"run-{number}"


class _JobsOfQueue:
    """Iterator over the jobs of the queue. After its end, it yields jobs again if jobs were added to the queue."""

    def __init__(self, take: Callable[[], Job | None]) -> None:
        self._take = take

    def __iter__(self) -> "_JobsOfQueue":
        return self

    def __next__(self) -> Job:
        job = self._take()
        if job is None:
            raise StopIteration
        return job


def _file_chunks(number: int, folder: Path) -> Iterator[FileChunk]:
    """Yield all files in the output folder of a job, in chunks."""
    for path in sorted(folder.rglob("*")):
        if path.is_file():
            name = path.relative_to(folder).as_posix()
            with path.open("rb") as file:
                yield FileChunk(number, name, file.read(CHUNK_BYTES))
                while data := file.read(CHUNK_BYTES):
                    yield FileChunk(number, name, data)


def _installed_plugin(entry: RegisteredType) -> RegisteredType:
    """Return the plug-in as installed on this node. Raises UsageError if it is missing or has another version here."""
    installed = find_type(entry.group, entry.name)
    required = requirement_of(entry)
    if installed is None or requirement_of(installed) != required:
        found = "it is not installed" if installed is None else f"{requirement_of(installed)} is installed"
        raise UsageError(f"the scenarios need {entry.group} `{entry.name}` of {required}, but {found}")
    return installed
