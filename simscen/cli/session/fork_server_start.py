"""Start of the fork server, the process from which runs are forked, in parallel with the imports of a session."""

from collections.abc import Iterator
from contextlib import closing, contextmanager

from simscen.run.process.fork_server_process import ForkServerProcess

FORK_SERVER = ("-m", "simscen.cli.session.fork_server_main")
"""Arguments of Python that start the fork server."""


@contextmanager
def early_fork_server(is_needed: bool) -> Iterator[ForkServerProcess | None]:
    """Start a fork server if `is_needed`, and close it at the end of the context. Otherwise, provide None.

    The fork server imports its modules while this process imports the modules of the session and loads the scenarios.
    """
    if not is_needed:
        yield None
        return
    with closing(ForkServerProcess(FORK_SERVER)) as server:
        yield server
