"""A run that did not pass, as pytest shows it: here, in the summary, in junit.xml and from a worker of xdist."""

from typing import Any

from _pytest._code.code import ReprEntryNative, ReprExceptionInfo, ReprFileLocation, ReprTraceback

from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunFinished
from simscen.report.session_lines import violation_lines
from simscen.report.styled_line import plain_text
from simscen.report.violations import error_summary, reported_violations, scenario_file


class ScenarioFailed(AssertionError):
    """A run that did not pass, and was not expected to fail; or that could not be completed."""

    def __init__(self, run: RunFinished) -> None:
        self.run = run
        super().__init__(_cause(run))


def as_seen(run: RunFinished) -> Any:
    """What the command line prints below such a run.

    pytest passes a failure on from worker to controller only in this form, which has no public name.
    """
    lines = [f"{plain_text(line).removeprefix('      ')}\n" for line in violation_lines(run)]
    first = next((complaint.line for complaint in reported_violations(run) if not complaint.warning), 0)
    crash = ReprFileLocation(path=scenario_file(run), lineno=first or 1, message=_cause(run))
    return ReprExceptionInfo(ReprTraceback([ReprEntryNative(lines)], extraline=None, style="native"), crash)


def _cause(run: RunFinished) -> str:
    """The first reason, in a line."""
    if run.outcome is Outcome.ERROR:
        return error_summary(run)
    return next((complaint.message for complaint in reported_violations(run) if not complaint.warning), "failed")
