"""The processes that execute the runs of a session."""

from simscen.run.process.backend import Backend
from simscen.run.process.supervisor import Supervisor
from simscen.run.sessions.run_session import SessionOptions

WARM_PROCESS = ("-m", "simscen.cli.session.warm_process")
"""Python arguments that start the fork server."""


def backend_of(options: SessionOptions) -> Backend:
    """Return the backend that the options select. Its processes start with the first run."""
    return Supervisor(options.workers, WARM_PROCESS)
