"""Options for the files of runs: which runs keep their files, and which get a picture and a replay page."""

from enum import Enum

from simscen.core.records.run_result import Outcome


class LogRetention(str, Enum):
    """Values of the option --keep-logs: runs of which all files are kept. Other runs keep only result.json."""

    ALL = "all"
    FAILED = "failed"


class OutcomeFilter(str, Enum):
    """Outcomes of the runs for which a file is written, such as a replay page or a picture."""

    NONE = "none"
    FAILED = "failed"
    ALL = "all"

    def includes(self, outcome: Outcome) -> bool:
        """Return whether the file is written for a run with this outcome."""
        return self is OutcomeFilter.ALL or (self is OutcomeFilter.FAILED and not outcome.is_good)
