"""Section of the HTML report about a study (many runs of a scenario): claim, pass rates, effects, and plots.

A claim is a minimum pass rate that the study tests.
"""

from collections.abc import Sequence
from math import isfinite

from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunFinished
from simscen.core.records.study import Study
from simscen.report.display_text import html_text
from simscen.report.study import (
    claim_text,
    effect_size_text,
    effect_text,
    pass_rate_notes,
    pass_rate_text,
    significant_effects,
)
from simscen.report.suite.elements import address
from simscen.spec.quantities import si_number

MAX_PLOTS = 8
"""Maximum number of parameters with a plot. Parameters with the most significant effects come first."""
MAX_POINTS = 2000
"""Maximum number of runs in a plot. Errors and failures have priority."""
WIDTH, HEIGHT, LABEL_SPACE = 420, 220, 44
"""Size of a plot, and space for the axis labels to the left and below, in SVG units."""


def study_html(study: Study, runs: Sequence[RunFinished], folder: str) -> str:
    """Return the section. Each point of a plot is a run, with a link to its replay or log in the output `folder`."""
    remarks = "".join(f'<p class="quiet">{html_text(text)}</p>' for text in pass_rate_notes(study))
    claim = ""
    if study.claim is not None:
        claim = f'<p class="claim {study.claim.status.value}">{html_text(claim_text(study.claim))}</p>'
    return (
        f'<section id="study" aria-label="study"><h2>Study</h2><p>{html_text(pass_rate_text(study))}</p>'
        f"{remarks}{claim}{_rate_table(study)}{_effect_table(study)}{_plots(study, runs, folder)}</section>"
    )


def _rate_table(study: Study) -> str:
    if not study.rates:
        return ""
    has_limits = any(row.limits is not None for row in study.rates)
    rows = "".join(
        f"<tr><td>{html_text(row.path)}</td><td>{html_text(row.value)}</td><td>{row.passed} of {row.runs}</td>"
        f"{'' if row.limits is None else f'<td>{100 * row.limits[0]:.0f} … {100 * row.limits[1]:.0f} %</td>'}</tr>"
        for row in study.rates
    )
    return (
        "<h3>Pass rate by parameter</h3><table><thead><tr><th>parameter</th><th>value</th><th>passed</th>"
        f"{'<th>95 % interval</th>' if has_limits else ''}</tr></thead><tbody>{rows}</tbody></table>"
    )


def _effect_table(study: Study) -> str:
    effects = significant_effects(study)
    if not study.effects:
        return ""
    if not effects:
        return '<p class="quiet">No parameter has a significant effect on a margin.</p>'
    rows = "".join(
        f"<tr><td>{html_text(effect.path)}</td><td>{html_text(effect.criterion)}</td><td>{effect_size_text(effect)}</td>"
        f"<td>{effect.p:.1g}</td><td>{effect_text(effect)}</td></tr>"
        for effect in effects
    )
    return (
        "<h3>Effects on margins</h3><table><thead><tr><th>parameter</th><th>margin of</th>"
        "<th>rank correlation</th><th>p, corrected</th><th>meaning</th></tr></thead><tbody>"
        f"{rows}</tbody></table>"
    )


def _plots(study: Study, runs: Sequence[RunFinished], folder: str) -> str:
    """Return a plot for each of at most MAX_PLOTS numeric parameters.

    A plot shows the margin on which the parameter has the most significant effect.
    """
    criteria = {effect.path: effect.criterion for effect in reversed(study.effects) if effect.is_ordered}
    paths = [path for path in dict.fromkeys(effect.path for effect in study.effects) if path in criteria]
    plots = "".join(_plot(path, criteria[path], study, runs, folder) for path in paths[:MAX_PLOTS])
    return f'<h3>Margins</h3><div class="plots">{plots}</div>' if plots else ""


def _plot(path: str, criterion: str, study: Study, runs: Sequence[RunFinished], folder: str) -> str:
    """Return a plot of the smallest margin of a criterion against the parameter at `path`; "" without points."""
    points = []
    for run in sorted(runs, key=lambda run: (run.outcome.is_good, run.key))[:MAX_POINTS]:
        value = si_number(study.values.get(run.key, {}).get(path))
        margins = [
            finding.margin
            for verdict in run.result.verdicts
            if verdict.id == criterion
            for finding in verdict.findings
            if finding.margin is not None and isfinite(finding.margin)
        ]
        if isinstance(value, int | float) and margins:
            points.append((float(value), min(margins), run))
    if not points:
        return ""
    x_range, y_range = _range([x for x, _, _ in points]), _range([0.0, *(y for _, y, _ in points)])
    zero = _scale(0.0, y_range, HEIGHT - LABEL_SPACE, 12)
    dots = "".join(
        _dot(_scale(x, x_range, LABEL_SPACE, WIDTH - 12), _scale(y, y_range, HEIGHT - LABEL_SPACE, 12), run, folder)
        for x, y, run in reversed(points)
    )
    labels = (
        f'<text x="{LABEL_SPACE}" y="{HEIGHT - 26}">{x_range[0]:.4g}</text>'
        f'<text x="{WIDTH - 12}" y="{HEIGHT - 26}" text-anchor="end">{x_range[1]:.4g}</text>'
        f'<text x="{LABEL_SPACE}" y="{HEIGHT - 8}">{html_text(path)} (SI units)</text>'
        f'<text x="{LABEL_SPACE - 4}" y="16" text-anchor="end">{y_range[1]:.3g}</text>'
        f'<text x="{LABEL_SPACE - 4}" y="{HEIGHT - LABEL_SPACE}" text-anchor="end">{y_range[0]:.3g}</text>'
    )
    title = f"margin of {criterion} against {path}"
    return (
        f'<figure><figcaption>{html_text(title)}</figcaption><svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
        f'aria-label="{html_text(title)}"><line class="zero" x1="{LABEL_SPACE}" x2="{WIDTH - 12}" y1="{zero:.1f}" '
        f'y2="{zero:.1f}"/>{labels}{dots}</svg></figure>'
    )


def _dot(x: float, y: float, run: RunFinished, folder: str) -> str:
    """Return the point of a run at (x, y) in SVG units, with a link if the output folder has its replay or log."""
    name = f"{run.key.variation or run.key.scenario}, seed {run.key.seed}: {run.outcome.value}"
    mark = (
        f'<circle class="{"good" if run.outcome is Outcome.PASSED else "bad"}" cx="{x:.1f}" cy="{y:.1f}" r="3.5">'
        f"<title>{html_text(name)}</title></circle>"
    )
    target = address(run.artifacts.replay or run.artifacts.mcap, folder)
    return f'<a href="{target}">{mark}</a>' if target else mark


def _range(values: Sequence[float]) -> tuple[float, float]:
    """Return the lowest and the highest value, or a range of length 1 around equal values."""
    low, high = min(values), max(values)
    return (low, high) if low < high else (low - 0.5, high + 0.5)


def _scale(value: float, limits: tuple[float, float], start: float, end: float) -> float:
    """Map `value` linearly from the range `limits` to the range from `start` to `end`."""
    return start + (value - limits[0]) / (limits[1] - limits[0]) * (end - start)
