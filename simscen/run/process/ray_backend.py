"""Backend that runs jobs on a Ray cluster. One runner (a Ray actor) on each node supervises the processes there."""

import logging
import socket
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ray
from ray._private import services
from ray._private import worker as ray_worker
from ray.exceptions import RayActorError, RayTaskError
from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

from simscen.core.errors import UsageError
from simscen.core.version import PACKAGE, __version__
from simscen.run.platform_fingerprint import source_digest
from simscen.run.process.job_batch import JobBatch
from simscen.run.process.job_transfer import SentFile, digest_of, pack
from simscen.run.process.jobs import Job, JobUpdate
from simscen.run.process.ray_node import JobQueue, NodeRunner
from simscen.spec.registry import RegisteredType

QUEUED_JOBS_PER_WORKER = 2
"""Number of jobs in the queue for each worker."""
NODE_SEARCH_PERIOD_S = 5.0
"""Time between two searches for new nodes of the cluster."""
CONNECT_TIMEOUT_S = 5.0
START_TIMEOUT_S = 120.0
"""Time to wait until the first runner has started."""
CLOSE_TIMEOUT_S = 10.0
"""Time to wait until the runners have deleted their files."""
POLL_PERIOD_S = 0.5
MAX_UNREAD_UPDATES = 64
"""Number of unread updates after which a runner pauses."""


@dataclass
class _Runner:
    """Handle of the Ray actor of the class NodeRunner on one node.

    `call` is the pending remote call of a method of the actor: `software` until `is_ready`, then `run`. It is None
    while `is_ready` and no run is queued.
    """

    name: str
    node: str
    address: str
    actor: Any
    workers: int
    call: Any
    is_ready: bool = False


class RayBackend:
    """Runs jobs on all nodes of a running Ray cluster, at most `workers` at a time.

    Each node needs the same version of simscen and of the plug-ins. Input files are sent to the nodes. A job whose node
    or runner is lost is repeated once.
    """

    def __init__(self, address: str, workers: int, entry: Sequence[str]) -> None:
        """`address` is the address of the cluster. `entry` are the Python arguments that start a fork server."""
        self._address, self._workers, self._entry = address, workers, tuple(entry)
        self._runners: list[_Runner] = []
        self._files: dict[Path, SentFile] = {}
        self._contents: dict[str, SentFile] = {}
        """Files in the cluster by the digest of their content."""
        self._queue: Any = None
        self._next_name = 0
        self._last_search = 0.0

    def __enter__(self) -> "RayBackend":
        """Connect to the cluster. Raises UsageError if this fails."""
        connect(self._address)
        here = ray.get_runtime_context().get_node_id()
        self._queue = (
            ray.remote(JobQueue)
            .options(num_cpus=0, scheduling_strategy=NodeAffinitySchedulingStrategy(here, soft=False))
            .remote()
        )
        return self

    def __exit__(self, *_: object) -> None:
        if closing := [runner.actor.close.remote() for runner in self._runners if runner.call is None]:
            ray.wait(closing, num_returns=len(closing), timeout=CLOSE_TIMEOUT_S)
        self._kill_runners()
        ray.shutdown()

    def run(
        self,
        jobs: Iterable[Job],
        plugins: Sequence[RegisteredType] = (),
        should_continue: Callable[[], bool] = lambda: True,
    ) -> Iterator[JobUpdate]:
        """Run jobs and yield their updates (see `Backend.run`). Raises UsageError for an unusable cluster."""
        batch, start_time = JobBatch(jobs, should_continue), time.monotonic()
        try:
            while batch.is_unfinished():
                self._add_runners()
                self._send(batch)
                calls = {runner.call: runner for runner in self._runners if runner.call is not None}
                ready, _ = ray.wait(list(calls), timeout=POLL_PERIOD_S) if calls else ([], [])
                for call in ready:
                    yield from self._process_reply(calls[call], batch, plugins)
                for runner in self._runners:
                    if runner.is_ready and runner.call is None and batch.queued:
                        self._start(runner, plugins)
                self._require_free_cpus(start_time)
        except SystemError as error:  # Ray wraps an exception that a signal handler raised
            raise error.__cause__ or error from None
        finally:
            if batch.running or batch.queued:
                self._kill_runners()
            ray.get(self._queue.clear.remote())
        self._finish_calls()

    def _add_runners(self) -> None:
        """Start runners on nodes without one, up to the number of workers. Raises UsageError if no node has a CPU."""
        if self._runners and time.monotonic() < self._last_search + NODE_SEARCH_PERIOD_S:
            return
        self._last_search = time.monotonic()
        nodes = [node for node in _nodes() if node["Alive"] and node["Resources"].get("CPU", 0) >= 1]
        if not nodes:
            raise UsageError(f"no node of the Ray cluster at {self._address} has a CPU")
        used_nodes = {runner.node for runner in self._runners}
        for node in sorted(nodes, key=lambda node: str(node["NodeID"])):
            remaining = self._workers - sum(runner.workers for runner in self._runners)
            workers = min(int(node["Resources"]["CPU"]), remaining)
            if node["NodeID"] not in used_nodes and workers > 0:
                self._runners.append(self._new_runner(node["NodeID"], node["NodeManagerAddress"], workers))

    def _require_free_cpus(self, start_time: float) -> None:
        """Raise UsageError if no runner has started within START_TIMEOUT_S after `start_time` (monotonic clock, s)."""
        if time.monotonic() > start_time + START_TIMEOUT_S and not any(runner.is_ready for runner in self._runners):
            raise UsageError(
                f"no node of the Ray cluster at {self._address} has become free in {START_TIMEOUT_S:g} s: other "
                "programs use its CPUs; wait, or use fewer with --jobs"
            )

    def _new_runner(self, node: str, address: str, workers: int) -> _Runner:
        self._next_name += 1
        place = NodeAffinitySchedulingStrategy(node, soft=False)
        actor: Any = ray.remote(NodeRunner).options(num_cpus=workers, scheduling_strategy=place)
        actor = actor.remote(workers, self._entry, ray.get)
        return _Runner(f"runner-{self._next_name}", node, address, actor, workers, actor.software.remote())

    def _start(self, runner: _Runner, plugins: Sequence[RegisteredType]) -> None:
        """Let a runner take jobs from the queue."""
        call = runner.actor.run.options(num_returns="streaming", _generator_backpressure_num_objects=MAX_UNREAD_UPDATES)
        runner.call = call.remote(self._queue, runner.name, list(plugins))

    def _send(self, batch: JobBatch) -> None:
        """Put jobs into the queue until it has QUEUED_JOBS_PER_WORKER jobs for each worker."""
        limit = QUEUED_JOBS_PER_WORKER * sum(runner.workers for runner in self._runners)
        while len(batch.queued) < limit and (job := batch.next_job()) is not None:
            batch.queued[job.number] = job
            ray.get(self._queue.add.remote(pack(job, self._sent_file)))

    def _sent_file(self, path: Path) -> SentFile:
        """Put the content of a file into the cluster, unless the content is there already."""
        if path not in self._files:
            data = path.read_bytes()
            digest = digest_of(data)
            if digest not in self._contents:
                self._contents[digest] = SentFile(digest, ray.put(data))
            self._files[path] = self._contents[digest]
        return self._files[path]

    def _process_reply(
        self, runner: _Runner, batch: JobBatch, plugins: Sequence[RegisteredType]
    ) -> Iterator[JobUpdate]:
        """Process the next reply of a runner. Raises UsageError if its version of simscen or a plug-in differs."""
        try:
            if not runner.is_ready:
                self._require_same_software(runner, ray.get(runner.call))
                runner.is_ready = True
                self._start(runner, plugins)
                return
            update = ray.get(next(runner.call))
        except StopIteration:  # the runner found no job in the queue
            runner.call = None
        except RayActorError:
            yield from self._remove_lost_runner(runner, batch)
        except RayTaskError as error:
            if isinstance(error.cause, UsageError):
                raise UsageError(f"node {runner.address}: {error.cause}") from error
            raise
        else:
            yield from batch.process_update(update)

    def _require_same_software(self, runner: _Runner, found: tuple[str, str]) -> None:
        if found != (__version__, source_digest()):
            raise UsageError(
                f"node {runner.address} has simscen {found[0]} with other code than simscen {__version__} in "
                f"{PACKAGE}; install the same version on all nodes"
            )

    def _remove_lost_runner(self, runner: _Runner, batch: JobBatch) -> Iterator[JobUpdate]:
        """Remove a runner that has died, and queue its jobs again or report them as ended."""
        self._runners.remove(runner)
        ray.kill(runner.actor)  # the runner may only be unreachable
        self._last_search = 0.0
        for number in ray.get(self._queue.taken_by.remote(runner.name)):
            yield from batch.retry_or_fail(number, runner.address)

    def _finish_calls(self) -> None:
        """Wait until all remote calls have ended. The queue must be empty."""
        for runner in [runner for runner in self._runners if runner.is_ready and runner.call is not None]:
            try:
                ray.get(list(runner.call))
                runner.call = None
            except RayActorError:
                self._runners.remove(runner)

    def _kill_runners(self) -> None:
        for runner in self._runners:
            ray.kill(runner.actor)
        self._runners.clear()


def connect(address: str) -> None:
    """Connect to a running Ray cluster, unless this process is already connected. Raises UsageError if this fails."""
    if ray.is_initialized():
        return
    # Ray would report lost nodes on standard output, which is for results.
    ray_worker.print_to_stdstream = lambda *_, **__: None
    try:
        _require_answer(address)
        ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR)
    except (OSError, ValueError, RuntimeError) as error:
        reason = str(error).partition("\n")[0].rstrip(".")
        raise UsageError(
            f"cannot connect to a Ray cluster at {address}: {reason}; `ray start --head` starts one"
        ) from error


def _require_answer(address: str) -> None:
    """Raise OSError if nothing listens at the address. Ray itself would wait for minutes."""
    known = services.canonicalize_bootstrap_address(address)
    host, colon, port = (known or "").rpartition(":")
    if colon and port.isdigit() and "//" not in host:
        socket.create_connection((host.strip("[]"), int(port)), timeout=CONNECT_TIMEOUT_S).close()


def cluster_cpus(address: str) -> int:
    """Return the number of CPUs of a running Ray cluster. Raises UsageError if connecting fails."""
    connect(address)
    return sum(int(node["Resources"].get("CPU", 0)) for node in _nodes() if node["Alive"])


def _nodes() -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = ray.nodes()  # type: ignore[no-untyped-call]
    return found
