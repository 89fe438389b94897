"""Options for the files of runs: which runs keep their files, and which get a replay page."""

from enum import Enum

from simscen.core.records.run_result import Outcome


class KeptLogs(str, Enum):
    """Option: the runs that keep their log, picture, and other files besides result.json."""

    ALL = "all"
    FAILED = "failed"


class ReplayMode(str, Enum):
    """Option: the runs that get a replay page."""

    NONE = "none"
    FAILED = "failed"
    ALL = "all"

    def includes(self, outcome: Outcome) -> bool:
        """Return whether a run with this outcome gets a replay page."""
        return self is ReplayMode.ALL or (self is ReplayMode.FAILED and not outcome.is_good)
