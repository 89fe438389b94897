"""What reporters say of a finished run, as plain lines: the same facts for console, JUnit and annotations."""

from dataclasses import dataclass

from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import RunFinished
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.finding_text import sentence, violations
from simscen.report.display_text import escape_control, one_line


@dataclass(frozen=True)
class Violation:
    """One violated bound: its line in the scenario (0 = unknown), what to say, and what explains it."""

    verdict: Verdict
    line: int
    message: str
    detail: tuple[str, ...]

    @property
    def warning(self) -> bool:
        """Whether it is only reported; a criterion that broke down never is."""
        return self.verdict.severity == "warn" and self.verdict.status is not Status.ERROR


def reported_violations(run: RunFinished) -> list[Violation]:
    """Everything that did not pass, in the order of the scenario."""
    lines = run.result.lines or (0,) * len(run.result.verdicts)
    return [
        _complaint(run, verdict, line, finding)
        for verdict, line in zip(run.result.verdicts, lines, strict=True)
        for finding in violations(verdict) or _nothing_checked(verdict)
    ]


def short_run_name(key: RunKey, every_seed: bool = True, prefix: str = "") -> str:
    """What a run is called in a list: its id without `prefix`, its variation, the seed where there are several."""
    extra = ", ".join(part for part in (f"seed {key.seed}" if every_seed else "", key.stack_name) if part)
    name = key.test.removeprefix(prefix)
    return one_line(f"{name} ({extra})" if extra else name)


def source_location(run: RunFinished, line: int = 0) -> str:
    """path:line of a criterion, or of the scenario."""
    return one_line(f"{scenario_file(run)}:{line or 1}")


def scenario_file(run: RunFinished) -> str:
    """The scenario's file as seen from the working folder, for people and tools to open."""
    return run.file or run.result.path


def error_details(run: RunFinished) -> tuple[str, str, str]:
    """Kind, message and tail of a run that could not be completed."""
    if run.result.error is not None:
        return run.result.error.kind, one_line(run.result.error.message), escape_control(run.result.error.tail)
    assert run.outcome is Outcome.ERROR
    return "invalid", "; ".join(c.message for c in reported_violations(run)) or "nothing judged this run", ""


def error_summary(run: RunFinished) -> str:
    """Kind and message of a run that could not be completed, in one line that does not say the kind twice."""
    kind, message, _ = error_details(run)
    return message if message.startswith(kind) else f"{kind}: {message}"


def excuse_text(run: RunFinished) -> str:
    """Why a run that did not pass is no failure, in one line; "" for all others."""
    match run.outcome:
        case Outcome.SKIPPED:
            return one_line(f"skipped: {run.result.reason}")
        case Outcome.FAILED_AS_EXPECTED:
            violated = [complaint.message for complaint in reported_violations(run) if not complaint.warning]
            more = f" and {len(violated) - 1} more" if len(violated) > 1 else ""
            return one_line(f"failed as expected: {run.result.reason} ({violated[0]}{more})")
        case _:
            return ""


def _complaint(run: RunFinished, verdict: Verdict, line: int, finding: Finding) -> Violation:
    detail = tuple(one_line(text) for text in finding.detail)
    return Violation(verdict, line, one_line(sentence(verdict, finding, run.result.tick_rate)), detail)


def _nothing_checked(verdict: Verdict) -> tuple[Finding, ...]:
    return () if verdict.findings else (Finding(Status.ERROR, verdict.criterion, "it checked nothing", ""),)
