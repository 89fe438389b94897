"""One run on the page: a line to find it by, and behind it all that is known of it."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from textwrap import dedent

from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import RunFinished
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.finding_text import comparison, disturbance_times, subject, tightest_margin, time_and_place
from simscen.report.display_text import escape_control, shell_command_text
from simscen.report.session_lines import violation_lines
from simscen.report.styled_line import plain_text
from simscen.report.suite.elements import anchor, html_text, link, outcome_marks, pill, sparkline
from simscen.report.suite.history import PastOutcome
from simscen.report.violations import error_details, error_summary, excuse_text, reported_violations, source_location

_FILES = (("scenario.yaml", "scenario"), ("worker.log", "worker's log"), ("stack.log", "stack's log"))


def full_run_name(key: RunKey) -> str:
    """What tells a run from all others."""
    return ", ".join(part for part in (key.test, f"seed {key.seed}", key.stack_name) if part)


def run_element(
    run: RunFinished, folder: str, picture: str, before: Sequence[PastOutcome | None], one_of_many: bool = False
) -> str:
    """The whole element; what did not pass stands open."""
    extra = ", ".join(part for part in (f"seed {run.key.seed}", run.key.stack_name) if part)
    name = (run.key.variation or extra) if one_of_many else run.key.test
    outcomes = [None if one is None else one.outcome for one in before]
    told = outcome_marks([*outcomes, run.outcome], "last sessions and this") if any(outcomes) else ""
    return (
        f'<details class="run" id="{anchor(run.key)}"{"" if run.outcome.good else " open"} '
        f"{_data_attributes(run, before)}>"
        f'<summary>{pill(run.outcome)}<span class="name">{html_text(name)}</span>'
        f'<span class="quiet">{html_text(extra if name != extra else "")}</span>{told}'
        f'<span class="quiet near">{html_text(_headline(run))}</span>'
        f'<span class="time">{"kept · " if run.resumed else ""}{run.result.simulated:.1f} s</span></summary>'
        f'<div class="in">{_error_section(run)}{_criteria_table(run)}{_disturbance_table(run)}'
        f"{_links(run, folder)}{picture}{_details(run, before)}</div></details>"
    )


def _data_attributes(run: RunFinished, before: Sequence[PastOutcome | None]) -> str:
    """What the page's script filters and sorts by."""
    known = [one.outcome.good for one in before if one is not None]
    values = {
        "status": run.outcome.value,
        "tags": " ".join(run.tags),
        "theme": theme(run.key),
        "stack": run.key.stack_name,
        "variation": run.key.variation,
        "simulated": f"{run.result.simulated:.3f}",
        "wall": f"{run.wall:.3f}",
        "margin": "" if (share := relative_margin(run)) is None else f"{share:.4f}",
        "changed": "1" if known and known[-1] != run.outcome.good else "",
    }
    return " ".join(f'data-{name}="{html_text(value)}"' for name, value in values.items() if value)


def theme(key: RunKey) -> str:
    """The folder that a scenario lies in: "scenarios/faults/lidar_off" is about faults."""
    return key.scenario.rpartition("/")[0].rpartition("/")[2]


def relative_margin(run: RunFinished) -> float | None:
    """The least margin of its criteria, as a share of the limit; negative where one is violated, None without any."""
    margins = [share for v in run.result.verdicts for f in v.findings if (share := _share(f)) is not None]
    return min(margins, default=None)


def _share(finding: Finding) -> float | None:
    if finding.margin is None or finding.value is None or not finding.unit:
        return None
    below = finding.limit.startswith(("≥", ">"))
    limit = abs(finding.value - finding.margin if below else finding.value + finding.margin)
    return finding.margin / limit if limit else finding.margin


def _headline(run: RunFinished) -> str:
    """How near it came to failing; of what failed the first reason, and how many more."""
    match run.outcome:
        case Outcome.PASSED:
            nearest = tightest_margin(run.result.verdicts)
            return f"tightest: {nearest}" if nearest else ""
        case Outcome.FAILED:
            told = [complaint.message for complaint in reported_violations(run) if not complaint.warning]
            more = f" (and {len(told) - 1} more)" if len(told) > 1 else ""
            return f"{told[0]}{more}" if told else ""
        case Outcome.ERROR:
            return error_summary(run)
        case Outcome.FAILED_AS_EXPECTED | Outcome.SKIPPED:
            return excuse_text(run)


def _error_section(run: RunFinished) -> str:
    if run.outcome is not Outcome.ERROR:
        return ""
    tail = error_details(run)[2]
    return f"<p><b>{html_text(error_summary(run))}</b></p>" + (
        f'<pre tabindex="0">{escape(escape_control(tail))}</pre>' if tail else ""
    )


def _criteria_table(run: RunFinished) -> str:
    """A line for each bound that was checked, those that do not hold first, each with its reasons."""
    lines = run.result.lines or (0,) * len(run.result.verdicts)
    rows = [(v, f, n) for v, n in zip(run.result.verdicts, lines, strict=True) for f in v.findings]
    rows.sort(key=lambda row: row[1].status is Status.PASS)
    body = "".join(_criterion_row(run, *row) for row in rows)
    head = "".join(f'<th scope="col">{name}</th>' for name in ("", "criterion", "measured", "margin", "written in"))
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>' if body else ""


def _criterion_row(run: RunFinished, verdict: Verdict, finding: Finding, line: int) -> str:
    failed, warning = finding.status is not Status.PASS, verdict.severity == "warn"
    look = "" if not failed else "bad" if finding.status is Status.FAIL and not warning else "odd"
    word = "warning" if failed and warning else finding.status.value
    margin = "" if finding.margin is None else f"{finding.margin:+.3g} {finding.unit}".rstrip()
    where = (
        f", {time_and_place(finding, run.result.tick_rate)}"
        if failed and time_and_place(finding, run.result.tick_rate)
        else ""
    )
    reasons = "".join(f"<li>{html_text(reason)}</li>" for reason in finding.detail)
    return (
        f'<tr class="{look}"><td>{word}</td><td>{html_text(subject(verdict, finding))}</td>'
        f"<td>{html_text(comparison(finding) + where)}{f'<ul class=why>{reasons}</ul>' if reasons else ''}</td>"
        f'<td class="margin">{html_text(margin)}</td>'
        f'<td class="quiet">{html_text(source_location(run, line))}</td></tr>'
    )


def _disturbance_table(run: RunFinished) -> str:
    """Each event and fault, when it began and what it changed."""
    rows = "".join(
        f'<tr class="{"bad" if one.missing else ""}"><td>{"happened" if one.happened else "did not happen"}</td>'
        f"<td>{html_text(one.ordered.name)}</td><td>{html_text(one.ordered.trigger)}</td>"
        f"<td>{html_text(disturbance_times(one, run.result.tick_rate))}</td><td>{html_text(one.effect)}</td></tr>"
        for one in run.result.disturbances
    )
    head = "".join(f'<th scope="col">{name}</th>' for name in ("", "event or fault", "ordered", "began", "effect"))
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>' if rows else ""


def _links(run: RunFinished, folder: str) -> str:
    """Where to look further: what the run left in its folder."""
    files = run.artifacts
    named = [
        (files.replay, "replay"),
        (files.mcap, "log"),
        (files.picture, "picture"),
        (files.result, "result"),
    ]
    if files.folder:
        others = [(str(Path(files.folder, name)), label) for name, label in _FILES]
        named += [(path, label) for path, label in others if _written(path)]
    links = " · ".join(one for path, label in named if (one := link(path, folder, label)))
    return f"<p>{links}</p>" if links else ""


def _written(path: str) -> bool:
    file = Path(path)
    return file.is_file() and file.stat().st_size > 0


def _details(run: RunFinished, before: Sequence[PastOutcome | None]) -> str:
    """How to see it again, how long it took before, what it is tagged with, its numbers, and what the console said."""
    again = f'<p class="again">again: <code>{escape(shell_command_text(run.again))}</code></p>' if run.again else ""
    tags = "".join(f'<span class="tag">{html_text(tag)}</span> ' for tag in run.tags)
    known = [f"{name} {value:.4g}" for name, value in sorted(run.result.metrics.items()) if value is not None]
    told = _folded("metrics", f"<p>{html_text(' · '.join(known))}</p>") if known else ""
    return again + _duration_sparkline(run, before) + (f"<p>{tags}</p>" if tags else "") + told + _console_output(run)


def _console_output(run: RunFinished) -> str:
    """What the console said of it, to be copied."""
    said = "\n".join(plain_text(line).rstrip() for line in violation_lines(run))
    return (
        _folded("as the console told it", f'<pre tabindex="0">{escape(escape_control(dedent(said)))}</pre>')
        if said
        else ""
    )


def _folded(title: str, inside: str) -> str:
    return f'<details class="metrics"><summary>{title}</summary>{inside}</details>'


def _duration_sparkline(run: RunFinished, before: Sequence[PastOutcome | None]) -> str:
    """How long a run took to end, session by session, in simulated seconds, as a line; "" of less than three."""
    known = [one.simulated for one in before if one is not None] + [run.result.simulated]
    if len(known) < 3:
        return ""
    told = ", ".join(f"{value:.1f}" for value in known)
    line = sparkline(known, f"simulated seconds, oldest first: {told}", min(known), max(known))
    return f'<p class="quiet">simulated in the last sessions {line} {known[-2]:.1f} s, now {known[-1]:.1f} s</p>'
