"""Parts of RayBackend that run on the nodes of a Ray cluster.

RayBackend makes Ray actors of the classes NodeRunner and JobQueue.
"""

import shutil
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from simscen.core.errors import UsageError
from simscen.core.version import __version__
from simscen.loading.plugins import requirement_of
from simscen.run.platform_fingerprint import source_digest
from simscen.run.process.job_transfer import PackedJob, Unpacker
from simscen.run.process.jobs import Ended, ForkServerDeath, Job, JobUpdate
from simscen.run.process.supervisor import Supervisor
from simscen.spec.registry import RegisteredType, find_type

CHUNK_BYTES = 8 << 20
"""Maximum size of a part of an output file that is sent at once."""


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

        `runner` is the name of this runner. Raises UsageError if a plug-in is missing or has another version here, or
        if the fork server cannot start. Otherwise this node would take jobs from other nodes only to fail them.
        """
        jobs = _JobsOfQueue(lambda: self._take_job(queue, runner))
        for update in self._supervisor.run(jobs, [_installed_plugin(entry) for entry in plugins]):
            if isinstance(update, Ended):
                if isinstance(update.end, ForkServerDeath) and not update.end.has_started:
                    raise UsageError(f"the fork server cannot start: it {update.end.description}\n{update.end.output}")
                folder = self._output_folder(update.number)
                yield from _file_chunks(update.number, folder)
                shutil.rmtree(folder, ignore_errors=True)
            yield update

    def close(self) -> None:
        """End the processes of this runner, and delete its files."""
        self._supervisor.close()
        self._temporary.cleanup()

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
