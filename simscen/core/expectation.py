"""That a run is known to fail."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Expectation:
    """Why a run is expected to fail; `criteria` are the ids of the verdicts that do, () = whichever.

    `line` is where that is written in the scenario's own file; 0 = unknown.
    """

    reason: str
    criteria: tuple[str, ...] = ()
    line: int = 0
