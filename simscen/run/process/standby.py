"""A warm process that waits for jobs which come one by one, for a caller who has other things to do in between."""

from collections.abc import Generator, Sequence

from simscen.run.process.jobs import Job, PreparerDeath, ProcessEnd
from simscen.run.process.supervisor import Ended, Happening, Supervisor


class Standby:
    """Runs jobs as a session does, each in a process of its own; what was imported and built stays for the next.

    `entry` is how Python is called to be the warm process. A context, which ends that process.
    """

    def __init__(self, entry: Sequence[str]) -> None:
        self._supervisor = Supervisor((), 1, entry, lambda: True)
        self._happenings: Generator[Happening, None, None] | None = None

    def __enter__(self) -> "Standby":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def run(self, job: Job) -> ProcessEnd | PreparerDeath:
        """Run it; how its process ended. Whatever is raised meanwhile (Ctrl-C) ends the warm process, too."""
        self._supervisor.add(job)
        if self._happenings is None:
            self._happenings = self._supervisor.happenings()
        try:
            return next(one.end for one in self._happenings if isinstance(one, Ended) and one.job is job)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End the warm process, if there is one."""
        if self._happenings is not None:
            self._happenings.close()
            self._happenings = None
