"""Texts about a finished run that all reporters share: violations, errors, names and locations."""

from dataclasses import dataclass

from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import RunFinished
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.finding_text import sentence, violations
from simscen.report.display_text import escape_control, one_line


@dataclass(frozen=True)
class Violation:
    """One violated limit: its line in the scenario (0 = unknown), the message, and an explanation."""

    verdict: Verdict
    line: int
    message: str
    detail: tuple[str, ...]

    @property
    def warning(self) -> bool:
        """Whether the criterion only warns. Errors of a criterion are never warnings."""
        return self.verdict.severity == "warn" and self.verdict.status is not Status.ERROR


def reported_violations(run: RunFinished) -> list[Violation]:
    """Return everything that did not pass, in the order of the scenario."""
    lines = run.result.lines or (0,) * len(run.result.verdicts)
    return [
        _violation(run, verdict, line, finding)
        for verdict, line in zip(run.result.verdicts, lines, strict=True)
        for finding in violations(verdict) or _nothing_checked(verdict)
    ]


def short_run_name(key: RunKey, every_seed: bool = True, prefix: str = "") -> str:
    """Return the name of a run in a list: its ID without `prefix`, variation, seed with `every_seed`, and stack."""
    extra = ", ".join(part for part in (f"seed {key.seed}" if every_seed else "", key.stack_name) if part)
    name = key.test.removeprefix(prefix)
    return one_line(f"{name} ({extra})" if extra else name)


def source_location(run: RunFinished, line: int = 0) -> str:
    """Return path:line of a criterion, or of the scenario."""
    return one_line(f"{scenario_file(run)}:{line or 1}")


def scenario_file(run: RunFinished) -> str:
    """Return the path of the scenario file relative to the working folder."""
    return run.file or run.result.path


def error_details(run: RunFinished) -> tuple[str, str, str]:
    """Return kind, message and last output of a run that could not be completed."""
    if run.result.error is not None:
        return run.result.error.kind, one_line(run.result.error.message), escape_control(run.result.error.tail)
    assert run.outcome is Outcome.ERROR
    messages = "; ".join(violation.message for violation in reported_violations(run))
    return "invalid", messages or "no criterion judged this run", ""


def error_summary(run: RunFinished) -> str:
    """Return kind and message of a run that could not be completed, without repeating the kind."""
    kind, message, _ = error_details(run)
    return message if message.startswith(kind) else f"{kind}: {message}"


def first_violation(run: RunFinished, more: str = " (and {} more)") -> str:
    """Return the message of the first violation that is not a warning, with the number of others, or ""."""
    messages = [violation.message for violation in reported_violations(run) if not violation.warning]
    return messages[0] + (more.format(len(messages) - 1) if len(messages) > 1 else "") if messages else ""


def reason_without_failure(run: RunFinished) -> str:
    """Return why a skipped or expectedly failed run is not a failure, or "" for other runs."""
    match run.outcome:
        case Outcome.SKIPPED:
            return one_line(f"skipped: {run.result.reason}")
        case Outcome.FAILED_AS_EXPECTED:
            return one_line(f"failed as expected: {run.result.reason} ({first_violation(run, ' and {} more')})")
        case _:
            return ""


def _violation(run: RunFinished, verdict: Verdict, line: int, finding: Finding) -> Violation:
    detail = tuple(one_line(text) for text in finding.detail)
    return Violation(verdict, line, one_line(sentence(verdict, finding, run.result.tick_rate)), detail)


def _nothing_checked(verdict: Verdict) -> tuple[Finding, ...]:
    return () if verdict.findings else (Finding(Status.ERROR, verdict.criterion, "it checked nothing", ""),)
