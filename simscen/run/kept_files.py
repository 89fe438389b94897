"""Options for the files of runs: which runs keep their files, and which get a picture and a replay page."""

from enum import Enum

from simscen.core.records.run_result import Outcome


class KeptLogs(str, Enum):
    """Option: the runs that keep their log, picture, and other files besides result.json."""

    ALL = "all"
    FAILED = "failed"


class WrittenFor(str, Enum):
    """Option: the runs for which a file is written, such as a replay page or a picture."""

    NONE = "none"
    FAILED = "failed"
    ALL = "all"

    def includes(self, outcome: Outcome) -> bool:
        """Return whether the file is written for a run with this outcome."""
        return self is WrittenFor.ALL or (self is WrittenFor.FAILED and not outcome.is_good)
