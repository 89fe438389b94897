"""One run on the page: a line to find it by, and behind it all that is known of it."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from textwrap import dedent

from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import RunFinished
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.finding_text import comparison, disturbance_times, subject, tightest_margin, time_and_place
from simscen.report.complaints import broken, complaints, excused, failure, place
from simscen.report.line import text_of
from simscen.report.lines import complained
from simscen.report.suite.bits import anchor, link, marks, pill, sparkline, text
from simscen.report.suite.history import Before
from simscen.report.text import command, visible

_FILES = (("scenario.yaml", "scenario"), ("worker.log", "worker's log"), ("stack.log", "stack's log"))


def run_label(key: RunKey) -> str:
    """What tells a run from all others."""
    return ", ".join(part for part in (key.test, f"seed {key.seed}", key.stack_name) if part)


def run_element(
    run: RunFinished, folder: str, picture: str, before: Sequence[Before | None], one_of_many: bool = False
) -> str:
    """The whole element; what did not pass stands open."""
    extra = ", ".join(part for part in (f"seed {run.key.seed}", run.key.stack_name) if part)
    name = (run.key.variation or extra) if one_of_many else run.key.test
    outcomes = [None if one is None else one.outcome for one in before]
    told = marks([*outcomes, run.outcome], "last sessions and this") if any(outcomes) else ""
    return (
        f'<details class="run" id="{anchor(run.key)}"{"" if run.outcome.good else " open"} {_data(run, before)}>'
        f'<summary>{pill(run.outcome)}<span class="name">{text(name)}</span>'
        f'<span class="quiet">{text(extra if name != extra else "")}</span>{told}'
        f'<span class="quiet near">{text(_nearest(run))}</span>'
        f'<span class="time">{"kept · " if run.resumed else ""}{run.result.simulated:.1f} s</span></summary>'
        f'<div class="in">{_why(run)}{_verdicts(run)}{_disturbances(run)}{_links(run, folder)}{picture}'
        f"{_more(run, before)}</div></details>"
    )


def _data(run: RunFinished, before: Sequence[Before | None]) -> str:
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
        "margin": "" if (share := share_left(run)) is None else f"{share:.4f}",
        "changed": "1" if known and known[-1] != run.outcome.good else "",
    }
    return " ".join(f'data-{name}="{text(value)}"' for name, value in values.items() if value)


def theme(key: RunKey) -> str:
    """The folder that a scenario lies in: "scenarios/faults/lidar_off" is about faults."""
    return key.scenario.rpartition("/")[0].rpartition("/")[2]


def share_left(run: RunFinished) -> float | None:
    """The least margin of its criteria, as a share of the limit; negative where one is violated, None without any."""
    margins = [share for v in run.result.verdicts for f in v.findings if (share := _share(f)) is not None]
    return min(margins, default=None)


def _share(finding: Finding) -> float | None:
    if finding.margin is None or finding.value is None or not finding.unit:
        return None
    below = finding.limit.startswith(("≥", ">"))
    limit = abs(finding.value - finding.margin if below else finding.value + finding.margin)
    return finding.margin / limit if limit else finding.margin


def _nearest(run: RunFinished) -> str:
    """How near it came to failing; of what failed the first reason, and how many more."""
    match run.outcome:
        case Outcome.PASSED:
            nearest = tightest_margin(run.result.verdicts)
            return f"tightest: {nearest}" if nearest else ""
        case Outcome.FAILED:
            told = [complaint.message for complaint in complaints(run) if not complaint.warning]
            more = f" (and {len(told) - 1} more)" if len(told) > 1 else ""
            return f"{told[0]}{more}" if told else ""
        case Outcome.ERROR:
            return broken(run)
        case Outcome.FAILED_AS_EXPECTED | Outcome.SKIPPED:
            return excused(run)


def _why(run: RunFinished) -> str:
    if run.outcome is not Outcome.ERROR:
        return ""
    tail = failure(run)[2]
    return f"<p><b>{text(broken(run))}</b></p>" + (f'<pre tabindex="0">{escape(visible(tail))}</pre>' if tail else "")


def _verdicts(run: RunFinished) -> str:
    """A line for each bound that was checked, those that do not hold first, each with its reasons."""
    lines = run.result.lines or (0,) * len(run.result.verdicts)
    rows = [(v, f, n) for v, n in zip(run.result.verdicts, lines, strict=True) for f in v.findings]
    rows.sort(key=lambda row: row[1].status is Status.PASS)
    body = "".join(_verdict(run, *row) for row in rows)
    head = "".join(f'<th scope="col">{name}</th>' for name in ("", "criterion", "measured", "margin", "written in"))
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>' if body else ""


def _verdict(run: RunFinished, verdict: Verdict, finding: Finding, line: int) -> str:
    failed, warning = finding.status is not Status.PASS, verdict.severity == "warn"
    look = "" if not failed else "bad" if finding.status is Status.FAIL and not warning else "odd"
    word = "warning" if failed and warning else finding.status.value
    margin = "" if finding.margin is None else f"{finding.margin:+.3g} {finding.unit}".rstrip()
    where = (
        f", {time_and_place(finding, run.result.tick_rate)}"
        if failed and time_and_place(finding, run.result.tick_rate)
        else ""
    )
    reasons = "".join(f"<li>{text(reason)}</li>" for reason in finding.detail)
    return (
        f'<tr class="{look}"><td>{word}</td><td>{text(subject(verdict, finding))}</td>'
        f"<td>{text(comparison(finding) + where)}{f'<ul class=why>{reasons}</ul>' if reasons else ''}</td>"
        f'<td class="margin">{text(margin)}</td><td class="quiet">{text(place(run, line))}</td></tr>'
    )


def _disturbances(run: RunFinished) -> str:
    """Each event and fault, when it began and what it changed."""
    rows = "".join(
        f'<tr class="{"bad" if one.missing else ""}"><td>{"happened" if one.happened else "did not happen"}</td>'
        f"<td>{text(one.ordered.name)}</td><td>{text(one.ordered.trigger)}</td>"
        f"<td>{text(disturbance_times(one, run.result.tick_rate))}</td><td>{text(one.effect)}</td></tr>"
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


def _more(run: RunFinished, before: Sequence[Before | None]) -> str:
    """How to see it again, how long it took before, what it is tagged with, its numbers, and what the console said."""
    again = f'<p class="again">again: <code>{escape(command(run.again))}</code></p>' if run.again else ""
    tags = "".join(f'<span class="tag">{text(tag)}</span> ' for tag in run.tags)
    known = [f"{name} {value:.4g}" for name, value in sorted(run.result.metrics.items()) if value is not None]
    told = _folded("metrics", f"<p>{text(' · '.join(known))}</p>") if known else ""
    return again + _durations(run, before) + (f"<p>{tags}</p>" if tags else "") + told + _console(run)


def _console(run: RunFinished) -> str:
    """What the console said of it, to be copied."""
    said = "\n".join(text_of(line).rstrip() for line in complained(run))
    return _folded("as the console told it", f'<pre tabindex="0">{escape(visible(dedent(said)))}</pre>') if said else ""


def _folded(title: str, inside: str) -> str:
    return f'<details class="metrics"><summary>{title}</summary>{inside}</details>'


def _durations(run: RunFinished, before: Sequence[Before | None]) -> str:
    """How long a run took to end, session by session, in simulated seconds, as a line; "" of less than three."""
    known = [one.simulated for one in before if one is not None] + [run.result.simulated]
    if len(known) < 3:
        return ""
    told = ", ".join(f"{value:.1f}" for value in known)
    line = sparkline(known, f"simulated seconds, oldest first: {told}", min(known), max(known))
    return f'<p class="quiet">simulated in the last sessions {line} {known[-2]:.1f} s, now {known[-1]:.1f} s</p>'
