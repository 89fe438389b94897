"""Finished runs that succeeded, collided, timed out, or failed, for summaries of the navigation benchmark."""

from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.records.session_events import RunFinished
from simscen.core.records.verdict import Finding, Status, Verdict


def run(
    outcome: Outcome, collided: bool = False, ended: str = "navigation ended", seconds: float | None = 8.0
) -> RunFinished:
    """Return a finished run; `ended` is the reason of its end, and `seconds` the time to the last goal."""
    status = Status.FAIL if collided else Status.PASS
    verdict = Verdict("collisions", "collisions", "error", (Finding(status, "collisions", "", ""),))
    failure = RunFailure("crashed", "it crashed") if outcome is Outcome.ERROR else None
    metrics = {"time_to_goal": seconds, "path_length_ratio": 1.1, "shortest_length": 10.0}
    key = RunKey("s", 1)
    return RunFinished(RunResult(key, "s.scenario.yaml", outcome, (verdict,), (), metrics, ended=ended, error=failure))


ARRIVED, HIT = run(Outcome.PASSED), run(Outcome.FAILED, collided=True)
LATE, GAVE_UP = run(Outcome.FAILED, ended="time limit"), run(Outcome.FAILED)
