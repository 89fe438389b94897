"""Entry of one run in the HTML report: a summary line that expands to criteria, disturbances, picture, and metrics."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from textwrap import dedent

from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import RunFinished
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.finding_text import (
    comparison,
    disturbance_times,
    relative_margin,
    subject,
    tightest_margin,
    time_and_place,
)
from simscen.report.display_text import escape_control, html_text, plain_text, shell_command_text
from simscen.report.session_history import PastOutcome, changed_outcome
from simscen.report.session_lines import violation_lines
from simscen.report.suite.elements import anchor, link, outcome_badge, outcome_symbols, sparkline
from simscen.report.violations import (
    error_details,
    error_summary,
    first_violation,
    reason_without_failure,
    source_location,
)

_OTHER_FILES = (("scenario.yaml", "scenario"), ("worker.log", "worker's log"), ("stack.log", "stack's log"))
"""Further files of a run to which its entry links, with the text of the link."""


def full_run_name(key: RunKey) -> str:
    """Return the unique name of a run, for example "faults/lidar_off[speed=0.5], seed 7, slow"."""
    return ", ".join(part for part in (key.test, f"seed {key.seed}", key.stack_name) if part)


def run_element(
    run: RunFinished, folder: str, picture: str, past: Sequence[PastOutcome | None], is_one_of_many: bool = False
) -> str:
    """Return the entry of a run. Failures and errors are expanded.

    `folder` is the output folder of the session. `picture` is the HTML of the picture of the run; "" for none. `past`
    are the outcomes of the run in earlier sessions, oldest first, with None for a session without the run.
    `is_one_of_many` states that the scenario has several runs; the name of the run then omits the scenario.
    """
    extra = ", ".join(part for part in (f"seed {run.key.seed}", run.key.stack_name) if part)
    name = (run.key.variation or extra) if is_one_of_many else run.key.test
    outcomes = [None if earlier is None else earlier.outcome for earlier in past]
    marks = outcome_symbols([*outcomes, run.outcome], "earlier sessions and this one") if any(outcomes) else ""
    return (
        f'<details class="run" id="{anchor(run.key)}"{"" if run.outcome.is_good else " open"} '
        f"{_data_attributes(run, past)}>"
        f'<summary>{outcome_badge(run.outcome)}<span class="name">{html_text(name)}</span>'
        f'<span class="quiet">{html_text(extra if name != extra else "")}</span>{marks}'
        f'<span class="quiet near">{html_text(_headline(run))}</span>'
        f'<span class="time">{"kept · " if run.resumed else ""}{run.result.simulated:.1f} s</span></summary>'
        f'<div class="in">{_error_section(run)}{_criteria_table(run)}{_disturbance_table(run)}'
        f"{_links(run, folder)}{picture}{_details(run, past)}</div></details>"
    )


def _data_attributes(run: RunFinished, past: Sequence[PastOutcome | None]) -> str:
    """Return the HTML attributes (`data-…`) by which the script of the page filters and sorts runs."""
    values = {
        "status": run.outcome.value,
        "tags": " ".join(run.tags),
        "theme": scenario_folder(run.key),
        "stack": run.key.stack_name,
        "variation": run.key.variation,
        "simulated": f"{run.result.simulated:.3f}",
        "wall": f"{run.wall:.3f}",
        "margin": "" if (margin := smallest_margin(run)) is None else f"{margin:.4f}",
        "changed": "1" if changed_outcome(run, past) else "",
    }
    return " ".join(f'data-{name}="{html_text(value)}"' for name, value in values.items() if value)


def scenario_folder(key: RunKey) -> str:
    """Return the name of the folder of a scenario: "faults" for "scenarios/faults/lidar_off"."""
    return key.scenario.rpartition("/")[0].rpartition("/")[2]


def smallest_margin(run: RunFinished) -> float | None:
    """Return the smallest margin of all findings as a fraction of the limit; None if no finding has a margin.

    The margin is negative if the limit is violated. Findings without a unit, such as counts, are ignored.
    """
    findings = [finding for verdict in run.result.verdicts for finding in verdict.findings]
    measured = (each for each in findings if each.margin is not None and each.value is not None and each.unit)
    return min(map(relative_margin, measured), default=None)


def _headline(run: RunFinished) -> str:
    """Return the tightest margin of a passed run, or the first reason why a run did not pass."""
    match run.outcome:
        case Outcome.PASSED:
            tightest = tightest_margin(run.result.verdicts)
            return f"tightest: {tightest}" if tightest else ""
        case Outcome.FAILED:
            return first_violation(run)
        case Outcome.ERROR:
            return error_summary(run)
        case Outcome.FAILED_AS_EXPECTED | Outcome.SKIPPED:
            return reason_without_failure(run)


def _error_section(run: RunFinished) -> str:
    if run.outcome is not Outcome.ERROR:
        return ""
    tail = error_details(run)[2]
    return f"<p><b>{html_text(error_summary(run))}</b></p>" + (
        f'<pre tabindex="0">{escape(escape_control(tail))}</pre>' if tail else ""
    )


def _criteria_table(run: RunFinished) -> str:
    """Return a table with a row per finding, violations first; "" without findings."""
    rows = [(verdict, each, line) for verdict, line in run.result.verdicts_with_lines for each in verdict.findings]
    rows.sort(key=lambda row: row[1].status is Status.PASS)
    headings = ("", "criterion", "measured", "margin", "source")
    return _table(headings, "".join(_criterion_row(run, *row) for row in rows))


def _criterion_row(run: RunFinished, verdict: Verdict, finding: Finding, line: int) -> str:
    has_passed, is_warning = finding.status is Status.PASS, verdict.severity == "warn"
    css_class = "" if has_passed else "bad" if finding.status is Status.FAIL and not is_warning else "odd"
    word = "warning" if is_warning and not has_passed else finding.status.value
    margin = "" if finding.margin is None else f"{finding.margin:+.3g} {finding.unit}".rstrip()
    where = "" if has_passed else time_and_place(finding, run.result.tick_rate)
    measured = f"{comparison(finding)}, {where}" if where else comparison(finding)
    reasons = "".join(f"<li>{html_text(reason)}</li>" for reason in finding.detail)
    return (
        f'<tr class="{css_class}"><td>{word}</td><td>{html_text(subject(verdict, finding))}</td>'
        f"<td>{html_text(measured)}{f'<ul class=why>{reasons}</ul>' if reasons else ''}</td>"
        f'<td class="margin">{html_text(margin)}</td>'
        f'<td class="quiet">{html_text(source_location(run, line))}</td></tr>'
    )


def _disturbance_table(run: RunFinished) -> str:
    """Return a table of events and faults with their times and effects; "" without any."""
    rows = "".join(
        f'<tr class="{"bad" if outcome.missing else ""}">'
        f"<td>{'happened' if outcome.happened else 'did not happen'}</td>"
        f"<td>{html_text(outcome.disturbance.name)}</td><td>{html_text(outcome.disturbance.trigger)}</td>"
        f"<td>{html_text(disturbance_times(outcome, run.result.tick_rate))}</td>"
        f"<td>{html_text(outcome.effect)}</td></tr>"
        for outcome in run.result.disturbances
    )
    return _table(("", "event or fault", "trigger", "started", "effect"), rows)


def _table(headings: Sequence[str], rows: str) -> str:
    """Return a table with these headings and rows; "" without rows. `rows` is HTML."""
    head = "".join(f'<th scope="col">{heading}</th>' for heading in headings)
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>' if rows else ""


def _links(run: RunFinished, folder: str) -> str:
    """Return links to the files of a run in the output folder of the session; "" without any."""
    files = run.artifacts
    labeled = [(files.replay, "replay"), (files.mcap, "log"), (files.picture, "picture"), (files.result, "result")]
    if files.folder:
        others = [(str(Path(files.folder, name)), label) for name, label in _OTHER_FILES]
        labeled += [(path, label) for path, label in others if _has_content(path)]
    links = " · ".join(html for path, label in labeled if (html := link(path, folder, label)))
    return f"<p>{links}</p>" if links else ""


def _has_content(path: str) -> bool:
    file = Path(path)
    return file.is_file() and file.stat().st_size > 0


def _details(run: RunFinished, past: Sequence[PastOutcome | None]) -> str:
    """Return the command that repeats a run, simulated times in earlier sessions, tags, metrics, and console output."""
    again = f'<p class="again">again: <code>{escape(shell_command_text(run.again))}</code></p>' if run.again else ""
    tags = "".join(f'<span class="tag">{html_text(tag)}</span> ' for tag in run.tags)
    known = [f"{name} {value:.4g}" for name, value in sorted(run.result.metrics.items()) if value is not None]
    metrics = _collapsible("metrics", f"<p>{html_text(' · '.join(known))}</p>") if known else ""
    tag_line = f"<p>{tags}</p>" if tags else ""
    return again + _duration_sparkline(run, past) + tag_line + metrics + _console_output(run)


def _console_output(run: RunFinished) -> str:
    """Return the lines that the console prints below a run; "" without lines."""
    text = "\n".join(plain_text(line).rstrip() for line in violation_lines(run))
    return (
        _collapsible("console output", f'<pre tabindex="0">{escape(escape_control(dedent(text)))}</pre>')
        if text
        else ""
    )


def _collapsible(title: str, inside: str) -> str:
    return f'<details class="metrics"><summary>{title}</summary>{inside}</details>'


def _duration_sparkline(run: RunFinished, past: Sequence[PastOutcome | None]) -> str:
    """Return a line chart of the simulated times in the last sessions; "" for fewer than three values."""
    times = [earlier.simulated for earlier in past if earlier is not None] + [run.result.simulated]
    if len(times) < 3:
        return ""
    values = ", ".join(f"{value:.1f}" for value in times)
    line = sparkline(times, f"simulated seconds, oldest first: {values}", min(times), max(times))
    return f'<p class="quiet">simulated time in the last sessions: {line} {times[-2]:.1f} s, now {times[-1]:.1f} s</p>'
