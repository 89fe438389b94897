"""Selection of the backend that executes runs (local processes or a Ray cluster), and handling of signals."""

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from simscen.cli.session import fork_server_start
from simscen.cli.shared_options import BackendName
from simscen.core.errors import UsageError
from simscen.run.process.fork_server_process import ForkServerProcess
from simscen.run.process.jobs import Backend
from simscen.run.process.supervisor import Interrupted, Supervisor
from simscen.run.sessions.run_session import SessionOptions

REPEATED_SIGNAL_S = 0.5
"""Time after the first signal in which further signals are ignored."""
SHOW_CURSOR = b"\x1b[?25h"
"""Terminal sequence that shows the cursor again."""


@contextmanager
def interrupt_on_signals(clock: Callable[[], float] = time.monotonic) -> Iterator[None]:
    """Within the context, raise Interrupted on the first SIGINT, SIGTERM, or SIGHUP, and exit on a later one.

    A second signal within REPEATED_SIGNAL_S is ignored. SIGHUP stays ignored if it was ignored before, as with nohup.
    """
    first: list[float] = []

    def interrupt(number: int, _: FrameType | None) -> None:
        if not first:
            first.append(clock())
            raise Interrupted(number)
        if clock() - first[0] > REPEATED_SIGNAL_S:
            _exit_at_once(number)

    handled = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        handled.append(signal.SIGHUP)
    previous = {number: signal.getsignal(number) for number in handled}
    for number in handled:
        signal.signal(number, interrupt)
    try:
        yield
    finally:
        if not first:
            for number, handler in previous.items():
                signal.signal(number, handler)


def _exit_at_once(number: int) -> None:
    """Show the cursor of the terminal, and exit immediately with the exit code of signal `number`."""
    if os.isatty(1):
        os.write(1, SHOW_CURSOR + b"\n")
    os.write(2, b"simscen: stopped without reports; run `simscen report` to write them from the journal\n")
    os._exit(128 + number)


def workers_and_cluster(jobs: int | None, backend: BackendName, address: str | None) -> tuple[int, str]:
    """Return the number of parallel runs, and the address of the Ray cluster ("" for local processes).

    The parameters are the values of --jobs, --backend, and --address. Raises UsageError if the options contradict each
    other, or if Ray is not installed.
    """
    if backend is BackendName.LOCAL:
        if address is not None:
            raise UsageError("--address is for --backend ray")
        return jobs or len(os.sched_getaffinity(0)), ""
    try:
        from simscen.run.process.ray_backend import cluster_cpus
    except ModuleNotFoundError:
        raise UsageError("--backend ray needs Ray; install it with: pip install ray") from None
    cluster = address or "auto"  # with "auto", Ray uses RAY_ADDRESS, or else the cluster of this machine
    return jobs or cluster_cpus(cluster), cluster


def backend_of(options: SessionOptions, unused_server: ForkServerProcess | None = None) -> Backend:
    """Return the backend that the options select. The backend starts its processes when they are needed.

    A local backend first uses `unused_server`, a fork server that was started before.
    """
    if not options.cluster:
        return Supervisor(options.workers, fork_server_start.FORK_SERVER, unused_server)
    from simscen.run.process.ray_backend import RayBackend

    return RayBackend(options.cluster, options.workers, fork_server_start.FORK_SERVER)
