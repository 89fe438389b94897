"""report.html: one file that shows a session, pictures included; no script, nothing loaded from elsewhere."""

import base64
from collections.abc import Sequence
from html import escape
from pathlib import Path

from simscen.core.comparison import Comparison
from simscen.core.result import Outcome
from simscen.core.sessionevents import RunFinished
from simscen.judge.wording import comparison, subject, tightest, when
from simscen.report.comparedpage import as_html
from simscen.report.complaints import broken, complaints, excused, failure, place
from simscen.report.text import command, one_line, visible

PICTURE_BYTES = 6 * 2**20
"""Of all pictures together; one weighs some 40 kB. Larger pages open slowly and are cut off by CI systems."""

_STYLE = """
:root { color-scheme: light; font: 15px/1.45 system-ui, sans-serif; color: #262a30; }
body { max-width: 1180px; margin: 32px auto; padding: 0 20px; }
h1 { font-size: 22px; margin: 0 0 4px; } .quiet { color: #6f757d; }
details { border: 1px solid #dee0e3; border-radius: 8px; margin: 8px 0; }
summary { display: flex; gap: 14px; align-items: baseline; padding: 9px 14px; cursor: pointer; list-style: none; }
summary .name { font-weight: 600; flex: 1; overflow-wrap: anywhere; }
.pill { border-radius: 5px; color: #fff; padding: 1px 9px; font-size: 13px; text-transform: uppercase; }
.passed { background: #1c8042; } .failed { background: #c81e28; } .error { background: #be7800; }
.failed-as-expected, .skipped { background: #6f757d; }
.in { padding: 4px 16px 14px; } table { border-collapse: collapse; width: 100%; margin: 6px 0 12px; }
td, th { text-align: left; padding: 4px 10px 4px 0; border-top: 1px solid #eceef0; vertical-align: top; }
h2 { font-size: 18px; } h3 { font-size: 15px; margin-bottom: 2px; } section { margin: 18px 0; }
.clear td:nth-child(5) { font-weight: 600; } .count.good { color: #1c8042; } .count.bad { color: #c81e28; }
.margin { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.bad td:first-child { color: #c81e28; font-weight: 600; } .odd td:first-child { color: #be7800; font-weight: 600; }
img { max-width: 100%; border: 1px solid #dee0e3; border-radius: 6px; } code, pre { font-size: 13px; }
pre { background: #f4f5f6; padding: 10px; border-radius: 6px; overflow-x: auto; white-space: pre-wrap; }
p code { white-space: pre-wrap; }
"""


def to_html(runs: Sequence[RunFinished], title: str = "simscen", comparison: Comparison | None = None) -> str:
    """The page; what did not pass comes first and stands open. Pictures are read from the runs' artifacts."""
    order = [Outcome.ERROR, Outcome.FAILED, Outcome.FAILED_AS_EXPECTED, Outcome.SKIPPED, Outcome.PASSED]
    ordered = sorted(runs, key=lambda run: (order.index(run.outcome), run.result.path, run.key))
    counts = ", ".join(
        f"{number} {outcome.value.replace('-', ' ')}"
        for outcome in Outcome
        if (number := sum(run.outcome is outcome for run in runs)) or outcome is Outcome.PASSED
    )
    simulated = sum(run.result.simulated for run in ordered)
    pictures = _pictures(ordered)
    compared = "" if comparison is None else as_html(comparison)
    body = "\n".join(_run(run, picture) for run, picture in zip(ordered, pictures, strict=True))
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; img-src data:; '
        "style-src 'unsafe-inline'\">\n"
        f"<title>{_text(title)}: {counts}</title><style>{_STYLE}</style></head>\n<body>\n"
        f'<h1>{counts}</h1><p class="quiet">{len(runs)} runs, {simulated:.0f} s simulated</p>\n{compared}\n{body}\n'
        "</body></html>\n"
    )


def _run(run: RunFinished, picture: str) -> str:
    label = ", ".join(part for part in (f"seed {run.key.seed}", run.key.stack_name) if part)
    nearest = f"tightest: {tightest(run.result.verdicts)}" if run.outcome is Outcome.PASSED else excused(run)
    opened = "" if run.outcome.good else " open"
    return (
        f"<details{opened}><summary>"
        f'<span class="pill {run.outcome.value}">{run.outcome.value.replace("-", " ")}</span>'
        f'<span class="name">{_text(run.key.test)}</span><span class="quiet">{_text(label)}</span>'
        f'<span class="quiet">{run.result.simulated:.1f} s</span><span class="quiet">{_text(nearest)}</span></summary>'
        f'<div class="in">{_why(run)}{_verdicts(run)}{_disturbances(run)}{picture}'
        f"{_metrics(run)}{_again(run)}</div></details>"
    )


def _why(run: RunFinished) -> str:
    if run.outcome is not Outcome.ERROR:
        return ""
    tail = failure(run)[2]
    return f"<p><b>{_text(broken(run))}</b></p>" + (f"<pre>{escape(visible(tail))}</pre>" if tail else "")


def _verdicts(run: RunFinished) -> str:
    lines = dict(zip(run.result.verdicts, run.result.lines, strict=True)) if run.result.lines else {}
    rows = []
    for verdict in run.result.verdicts:
        for finding in verdict.findings:
            status = finding.status.value
            look = {"pass": "", "fail": "bad"}.get(status, "odd")
            margin = "" if finding.margin is None else f"{finding.margin:+.3g} {finding.unit}".rstrip()
            details = "".join(f'<div class="quiet">{_text(text)}</div>' for text in finding.detail)
            rows.append(
                f'<tr class="{look}"><td>{status}</td><td>{_text(subject(verdict, finding))}</td>'
                f'<td>{_text(comparison(finding))}{details}</td><td class="margin">{_text(margin)}</td>'
                f'<td class="quiet">{_text(place(run, lines.get(verdict, 0)))}</td></tr>'
            )
    head = "<tr><th></th><th>criterion</th><th>measured</th><th>margin</th><th>written in</th></tr>"
    return f"<table>{head}{''.join(rows)}</table>" if rows else ""


def _disturbances(run: RunFinished) -> str:
    """Each event and fault, when it began and what it changed."""
    rows = [
        f'<tr class="{"bad" if one.missing else ""}"><td>{"happened" if one.happened else "did not happen"}</td>'
        f"<td>{_text(one.ordered.name)}</td><td>{_text(one.ordered.trigger)}</td>"
        f"<td>{_text(when(one, run.result.tick_rate))}</td><td>{_text(one.effect)}</td></tr>"
        for one in run.result.disturbances
    ]
    head = "<tr><th></th><th>event or fault</th><th>ordered</th><th>began</th><th>effect</th></tr>"
    return f"<table>{head}{''.join(rows)}</table>" if rows else ""


def _pictures(runs: Sequence[RunFinished]) -> list[str]:
    """Each run's picture inside the page, as long as there is room; one that has gone since is left out."""
    shown, room = [], PICTURE_BYTES
    for run in runs:
        path = Path(run.artifacts.picture)
        size = path.stat().st_size if run.artifacts.picture and path.is_file() else 0
        room -= size
        shown.append(_picture(path) if size and room >= 0 else _where(path) if size else "")
    return shown


def _picture(path: Path) -> str:
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    return f'<img alt="map of the run" loading="lazy" src="data:image/png;base64,{data}">'


def _where(path: Path) -> str:
    return f'<p class="quiet">picture: <code>{_text(str(path))}</code></p>'


def _metrics(run: RunFinished) -> str:
    told = [f"{name} {value:.4g}" for name, value in sorted(run.result.metrics.items()) if value is not None]
    return f'<p class="quiet">{_text(" · ".join(told))}</p>' if told else ""


def _again(run: RunFinished) -> str:
    warned = [complaint.message for complaint in complaints(run) if complaint.warning]
    notes = "".join(f"<p>warning: {_text(message)}</p>" for message in warned)
    return notes + (f"<p>again: <code>{escape(command(run.again))}</code></p>" if run.again else "")


def _text(text: str) -> str:
    return escape(one_line(text))
