"""A run that did not pass, as pytest shows it: here, in the summary, in junit.xml and from a worker of xdist."""

from typing import Any

from _pytest._code.code import ReprEntryNative, ReprExceptionInfo, ReprFileLocation, ReprTraceback

from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunFinished
from simscen.report.complaints import broken, complaints, scenario_file
from simscen.report.line import text_of
from simscen.report.lines import complained


class ScenarioFailed(AssertionError):
    """A run that did not pass, and was not expected to fail; or that could not be completed."""

    def __init__(self, run: RunFinished) -> None:
        self.run = run
        super().__init__(_cause(run))


def as_seen(run: RunFinished) -> Any:
    """What the command line prints below such a run.

    pytest passes a failure on from worker to controller only in this form, which has no public name.
    """
    lines = [f"{text_of(line).removeprefix('      ')}\n" for line in complained(run)]
    first = next((complaint.line for complaint in complaints(run) if not complaint.warning), 0)
    crash = ReprFileLocation(path=scenario_file(run), lineno=first or 1, message=_cause(run))
    return ReprExceptionInfo(ReprTraceback([ReprEntryNative(lines)], extraline=None, style="native"), crash)


def _cause(run: RunFinished) -> str:
    """The first reason, in a line."""
    if run.outcome is Outcome.ERROR:
        return broken(run)
    return next((complaint.message for complaint in complaints(run) if not complaint.warning), "failed")
