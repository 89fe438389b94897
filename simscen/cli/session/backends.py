"""The processes that execute the runs of a session."""

import os
from enum import Enum
from typing import Annotated

import typer

from simscen.core.errors import UsageError
from simscen.run.process.backend import Backend
from simscen.run.process.supervisor import Supervisor
from simscen.run.sessions.run_session import SessionOptions

WARM_PROCESS = ("-m", "simscen.cli.session.warm_process")
"""Python arguments that start the fork server."""

OWN_CLUSTER = "auto"
"""Ray's address of the cluster in RAY_ADDRESS, or of the one that was started on this machine."""


class BackendName(str, Enum):
    """Where runs are executed."""

    LOCAL = "local"
    RAY = "ray"


BackendOption = Annotated[
    BackendName,
    typer.Option(help="local: this machine; ray: all nodes of a running Ray cluster (needs Ray: pip install ray)."),
]
AddressOption = Annotated[
    str | None,
    typer.Option(
        metavar="HOST:PORT", help="Address of the Ray cluster; default: RAY_ADDRESS, or the cluster of this machine."
    ),
]


def workers_and_cluster(jobs: int | None, backend: BackendName, address: str | None) -> tuple[int, str]:
    """Return the number of parallel runs and the address of the cluster ("" for this machine). Raises UsageError."""
    if backend is BackendName.LOCAL:
        if address is not None:
            raise UsageError("--address is for --backend ray")
        return jobs or len(os.sched_getaffinity(0)), ""
    try:
        from simscen.run.cluster.ray_backend import cluster_cpus
    except ModuleNotFoundError:
        raise UsageError("--backend ray needs Ray; install it with: pip install ray") from None
    cpus = cluster_cpus(address or OWN_CLUSTER)
    return jobs or cpus, address or OWN_CLUSTER


def backend_of(options: SessionOptions) -> Backend:
    """Return the backend that the options select. Its processes start with the first run."""
    if not options.cluster:
        return Supervisor(options.workers, WARM_PROCESS)
    from simscen.run.cluster.ray_backend import RayBackend

    return RayBackend(options.cluster, options.workers, WARM_PROCESS)
