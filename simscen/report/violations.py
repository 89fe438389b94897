"""Texts about a finished run for all reporters: violations, errors, names, and locations in the scenario file."""

from dataclasses import dataclass

from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import RunFinished
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.finding_text import sentence, violations
from simscen.report.display_text import escape_control, one_line


@dataclass(frozen=True)
class Violation:
    """A finding (checked bound of a criterion) that did not pass.

    Attributes:
        verdict: Verdict that contains the finding.
        line: Line of the criterion in the scenario file; 0 if unknown.
        message: Sentence with the value, the limit, the time, and the position.
        detail: Lines that explain the cause.
    """

    verdict: Verdict
    line: int
    message: str
    detail: tuple[str, ...]

    @property
    def is_warning(self) -> bool:
        """Whether the criterion has the severity `warn`. An error in the criterion is never a warning."""
        return self.verdict.severity == "warn" and self.verdict.status is not Status.ERROR


def reported_violations(run: RunFinished) -> list[Violation]:
    """Return all findings that did not pass, including warnings, in the order of the verdicts.

    The texts are safe for terminals.
    """
    reported = []
    for verdict, line in run.result.verdicts_with_lines:
        no_findings = Finding(Status.ERROR, verdict.criterion, "it returned no findings", "")
        for finding in violations(verdict) if verdict.findings else [no_findings]:
            message = one_line(sentence(verdict, finding, run.result.tick_rate))
            reported.append(Violation(verdict, line, message, tuple(one_line(text) for text in finding.detail)))
    return reported


def failed_violations(run: RunFinished) -> list[Violation]:
    """Return the violations that are not warnings, in the order of the verdicts."""
    return [violation for violation in reported_violations(run) if not violation.is_warning]


def short_run_name(key: RunKey, with_seed: bool = True, prefix: str = "") -> str:
    """Return the name of a run in a list, such as "faults/lidar_off[speed=0.5] (seed 7, slow)".

    The name consists of the scenario ID without `prefix`, the variation, the seed if `with_seed` is true, and the stack
    if the session has several.
    """
    extra = ", ".join(part for part in (f"seed {key.seed}" if with_seed else "", key.stack_name) if part)
    name = key.test.removeprefix(prefix)
    return one_line(f"{name} ({extra})" if extra else name)


def source_location(run: RunFinished, line: int = 0) -> str:
    """Return path:line in the scenario file. `line` 0 (unknown) becomes line 1."""
    return one_line(f"{scenario_file(run)}:{line or 1}")


def scenario_file(run: RunFinished) -> str:
    """Return the path of the scenario file relative to the working folder."""
    return run.file or run.result.path


def error_details(run: RunFinished) -> tuple[str, str, str]:
    """Return (kind of the error of a run, message, end of the output of the worker process).

    For a completed run that could not be judged, the kind is "invalid", and the message lists the errors of criteria.
    """
    if run.result.error is not None:
        return run.result.error.kind, one_line(run.result.error.message), escape_control(run.result.error.tail)
    assert run.outcome is Outcome.ERROR
    messages = "; ".join(violation.message for violation in reported_violations(run))
    return "invalid", messages or "no criterion judged this run", ""


def error_summary(run: RunFinished) -> str:
    """Return the error of a run as "kind: message", or only the message if it starts with the kind."""
    kind, message, _ = error_details(run)
    return message if message.startswith(kind) else f"{kind}: {message}"


def first_violation(run: RunFinished, more: str = " (and {} more)") -> str:
    """Return the message of the first violation that is not a warning; "" if there is none.

    If there are further violations, `more` is appended, with the number of further violations in place of {}.
    """
    messages = [violation.message for violation in failed_violations(run)]
    return messages[0] + (more.format(len(messages) - 1) if len(messages) > 1 else "") if messages else ""


def reason_without_failure(run: RunFinished) -> str:
    """Return why a skipped run or an expected failure does not count as a failure; "" for other outcomes."""
    match run.outcome:
        case Outcome.SKIPPED:
            return one_line(f"skipped: {run.result.reason}")
        case Outcome.FAILED_AS_EXPECTED:
            return one_line(f"failed as expected: {run.result.reason} ({first_violation(run, ' and {} more')})")
        case _:
            return ""
