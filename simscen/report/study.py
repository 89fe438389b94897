"""Result of a study as text, as console lines, and as a section of the HTML report."""

from collections.abc import Iterator, Sequence
from itertools import groupby

from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunFinished
from simscen.core.records.study import ClaimResult, ClaimStatus, ParameterEffect, RateRow, Study
from simscen.report.display_text import Role, StyledLine, StyledText, one_line
from simscen.report.results_json import relative
from simscen.report.suite.elements import html_text
from simscen.spec.quantities import si_number

MAX_ROWS = 60
"""Maximum number of rows of pass rates to list."""
MAX_EFFECTS = 10
"""Maximum number of significant effects to list."""
SIGNIFICANCE_LEVEL = 0.05
CLAIM_ROLES: dict[ClaimStatus, Role] = {
    ClaimStatus.HELD: "good",
    ClaimStatus.REFUTED: "bad",
    ClaimStatus.UNDECIDED: "warning",
    ClaimStatus.BLOCKED: "bad",
}


def study_lines(study: Study) -> Iterator[StyledLine]:
    """Yield pass rates by parameter, effects, smallest margins, and finally the pass rate and the claim."""
    yield from _rate_table(study.rates)
    yield from _effect_table(study)
    yield from _worst_margins(study)
    yield ()
    yield (StyledText(pass_rate_text(study)),)
    for text in notes(study):
        yield (StyledText(text, "quiet"),)
    if study.claim is not None:
        yield (StyledText(claim_text(study.claim), CLAIM_ROLES[study.claim.status]),)


def pass_rate_text(study: Study) -> str:
    """Return the pass rate of all runs, with its interval if the runs are random."""
    runs = study.passed + study.failed
    text = f"study of {one_line(study.scenario)}: {study.passed} of {runs_text(runs)} passed"
    if runs:
        text += f" ({100 * study.passed / runs:.1f} %{interval_text(study.limits)})"
    return text + (f", {runs_text(study.errors)} could not be completed" if study.errors else "")


def notes(study: Study) -> list[str]:
    """Return remarks on how to interpret the pass rate."""
    texts = []
    if not study.is_random:
        texts.append(
            "the values were chosen, not drawn at random: the pass rate is that of these values, and has no interval"
        )
    if study.coverage is not None:
        texts.append(f"{100 * study.coverage:.1f} % of the pairs of values of two parameters occurred in a run")
    if study.accepted is not None:
        texts.append(f"{100 * study.accepted:.1f} % of the drawn values meet the conditions in `require`")
    return texts


def claim_title(claim: ClaimResult) -> str:
    """Return a short form of the claim: "pass rate >= 95 % (confidence 95 %)"."""
    return f"pass rate >= {claim.min_rate:.6g} (confidence {claim.confidence:.6g})"


def claim_text(claim: ClaimResult) -> str:
    """Return the claim and its result in one sentence."""
    statement = f"claim: pass rate of at least {_percent(claim.min_rate)} with {_percent(claim.confidence)} confidence"
    runs = f"{claim.passed} of {runs_text(claim.runs)} passed{limits_text(claim)}"
    match claim.status:
        case ClaimStatus.HELD:
            return f"{statement}: held, {runs}"
        case ClaimStatus.REFUTED:
            return f"{statement}: refuted, {runs}"
        case ClaimStatus.UNDECIDED:
            return f"{statement}: undecided, {runs}; {undecided_hint(claim)}"
        case ClaimStatus.BLOCKED:
            return f"{statement}: open, because {runs_text(claim.errors)} could not be completed; {runs}"


def undecided_hint(claim: ClaimResult) -> str:
    """Return what can be done about an undecided claim."""
    if claim.runs < claim.max_runs:
        return f"{claim.max_runs} are needed"
    return "more `runs` may decide it"


def limits_text(claim: ClaimResult) -> str:
    """Return the confidence limits of a claim, or ""."""
    if claim.limits is None:
        return ""
    low, high = claim.limits
    return f", which shows a rate of {100 * low:.2f} … {100 * high:.2f} %"


def interval_text(limits: tuple[float, float] | None) -> str:
    """Return ", 95 % interval 94 … 100 %", or "" without limits."""
    return "" if limits is None else f", 95 % interval {100 * limits[0]:.1f} … {100 * limits[1]:.1f} %"


def runs_text(number: int) -> str:
    """Return "1 run" or "3 runs"."""
    return f"{number} run" if number == 1 else f"{number} runs"


def effect_text(effect: ParameterEffect) -> str:
    """Return what a larger value of a parameter does, or that values differ."""
    if not effect.is_ordered:
        return "the margin depends on the value"
    return "a larger value lowers the margin" if effect.effect < 0 else "a larger value raises the margin"


def significant_effects(study: Study) -> Sequence[ParameterEffect]:
    """Return the effects that are significant after the correction for the number of tests."""
    return [effect for effect in study.effects if effect.p <= SIGNIFICANCE_LEVEL]


def _rate_table(rates: Sequence[RateRow]) -> Iterator[StyledLine]:
    if not rates:
        return
    listed = rates[:MAX_ROWS]
    width = max(len(row.value) for row in listed)
    yield ()
    yield (StyledText("pass rate by parameter"),)
    for path, rows in groupby(listed, key=lambda row: row.path):
        yield (StyledText(f"  {one_line(path)}", "name"),)
        for row in rows:
            rate = f"{row.passed} of {row.runs}"
            limits = "" if row.limits is None else f"   {100 * row.limits[0]:.0f} … {100 * row.limits[1]:.0f} %"
            role: Role = "plain" if row.passed == row.runs else "bad"
            yield StyledText(f"    {one_line(row.value):{width}}   "), StyledText(f"{rate:>12}{limits}", role)
    if len(rates) > MAX_ROWS:
        yield (StyledText(f"    … {len(rates) - MAX_ROWS} more in results.json", "quiet"),)


def _effect_table(study: Study) -> Iterator[StyledLine]:
    if not study.effects:
        return
    yield ()
    effects = significant_effects(study)
    if not effects:
        tests = f"{len(study.effects)} pairs of parameter and margin"
        yield (StyledText(f"no parameter has a significant effect on a margin ({tests} tested)", "quiet"),)
        return
    yield (StyledText("effects on margins (rank correlation; p corrected for the number of tests)"),)
    names = [f"{one_line(effect.path)} on {one_line(effect.criterion)}" for effect in effects[:MAX_EFFECTS]]
    width = max(map(len, names))
    for name, effect in zip(names, effects, strict=False):
        size = f"{effect.effect:+.2f}" if effect.is_ordered else f"{effect.effect:.2f} (epsilon squared)"
        yield (
            StyledText(f"  {name:{width}}   "),
            StyledText(f"{size}   p = {effect.p:.1g}   {effect_text(effect)}", "quiet"),
        )


def _worst_margins(study: Study) -> Iterator[StyledLine]:
    if not study.worst:
        return
    yield ()
    yield (StyledText("smallest margins"),)
    width = max(map(len, study.worst))
    for criterion, (key, margin, unit) in study.worst.items():
        number = f"{margin:+.3g} {unit}".rstrip()
        run = f"{key.variation}, seed {key.seed}" if key.variation else f"seed {key.seed}"
        yield (
            StyledText(f"  {criterion:{width}}   "),
            StyledText(f"{number:12}", "bad" if margin < 0 else "plain"),
            StyledText(f" {one_line(run)}", "quiet"),
        )


def _percent(rate: float) -> str:
    return f"{100 * rate:.6g} %"


MAX_PLOTS = 8
"""Maximum number of parameters with a plot, those with the strongest effects first."""
MAX_POINTS = 2000
"""Maximum number of runs in a plot; failures come first."""
WIDTH, HEIGHT, MARGIN = 420, 220, 44


def study_html(study: Study, runs: Sequence[RunFinished], folder: str) -> str:
    """Return the section. Points of the plots are links to replay or log in `folder`."""
    remarks = "".join(f'<p class="quiet">{html_text(text)}</p>' for text in notes(study))
    claim = ""
    if study.claim is not None:
        claim = f'<p class="claim {study.claim.status.value}">{html_text(claim_text(study.claim))}</p>'
    return (
        f'<section id="study" aria-label="study"><h2>Study</h2><p>{html_text(pass_rate_text(study))}</p>'
        f"{remarks}{claim}{_rates(study)}{_effects(study)}{_plots(study, runs, folder)}</section>"
    )


def _rates(study: Study) -> str:
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


def _effects(study: Study) -> str:
    effects = significant_effects(study)
    if not study.effects:
        return ""
    if not effects:
        return '<p class="quiet">No parameter has a significant effect on a margin.</p>'
    rows = "".join(
        f"<tr><td>{html_text(one.path)}</td><td>{html_text(one.criterion)}</td><td>{one.effect:+.2f}</td>"
        f"<td>{one.p:.1g}</td><td>{effect_text(one)}</td></tr>"
        for one in effects
    )
    return (
        "<h3>Effects on margins</h3><table><thead><tr><th>parameter</th><th>margin of</th>"
        "<th>rank correlation</th><th>p, corrected</th><th>meaning</th></tr></thead><tbody>"
        f"{rows}</tbody></table>"
    )


def _plots(study: Study, runs: Sequence[RunFinished], folder: str) -> str:
    """Return a plot of margin against parameter for the strongest effects, one for each parameter."""
    criterion_of = {one.path: one.criterion for one in reversed(study.effects) if one.is_ordered}
    order = [path for path in dict.fromkeys(one.path for one in study.effects) if path in criterion_of]
    plots = "".join(_plot(path, criterion_of[path], study, runs, folder) for path in order[:MAX_PLOTS])
    return f'<h3>Margins</h3><div class="plots">{plots}</div>' if plots else ""


def _plot(path: str, criterion: str, study: Study, runs: Sequence[RunFinished], folder: str) -> str:
    points = []
    for run in sorted(runs, key=lambda run: (run.outcome.good, run.key))[:MAX_POINTS]:
        value = si_number(study.values.get(run.key, {}).get(path))
        margins = [
            finding.margin
            for verdict in run.result.verdicts
            if verdict.id == criterion
            for finding in verdict.findings
            if finding.margin is not None
        ]
        if isinstance(value, int | float) and margins:
            points.append((float(value), min(margins), run))
    if not points:
        return ""
    x_range, y_range = _range([x for x, _, _ in points]), _range([0.0, *(y for _, y, _ in points)])
    zero = _scale(0.0, y_range, HEIGHT - MARGIN, 12)
    dots = "".join(
        _dot(_scale(x, x_range, MARGIN, WIDTH - 12), _scale(y, y_range, HEIGHT - MARGIN, 12), run, folder)
        for x, y, run in reversed(points)
    )
    labels = (
        f'<text x="{MARGIN}" y="{HEIGHT - 26}">{x_range[0]:.4g}</text>'
        f'<text x="{WIDTH - 12}" y="{HEIGHT - 26}" text-anchor="end">{x_range[1]:.4g}</text>'
        f'<text x="{MARGIN}" y="{HEIGHT - 8}">{html_text(path)} (SI units)</text>'
        f'<text x="{MARGIN - 4}" y="16" text-anchor="end">{y_range[1]:.3g}</text>'
        f'<text x="{MARGIN - 4}" y="{HEIGHT - MARGIN}" text-anchor="end">{y_range[0]:.3g}</text>'
    )
    title = f"margin of {criterion} against {path}"
    return (
        f'<figure><figcaption>{html_text(title)}</figcaption><svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
        f'aria-label="{html_text(title)}"><line class="zero" x1="{MARGIN}" x2="{WIDTH - 12}" y1="{zero:.1f}" '
        f'y2="{zero:.1f}"/>{labels}{dots}</svg></figure>'
    )


def _dot(x: float, y: float, run: RunFinished, folder: str) -> str:
    name = f"{run.key.variation or run.key.scenario}, seed {run.key.seed}: {run.outcome.value}"
    mark = (
        f'<circle class="{"good" if run.outcome is Outcome.PASSED else "bad"}" cx="{x:.1f}" cy="{y:.1f}" r="3.5">'
        f"<title>{html_text(name)}</title></circle>"
    )
    target = run.artifacts.replay or run.artifacts.mcap
    return f'<a href="{html_text(relative(target, folder))}">{mark}</a>' if target else mark


def _range(values: Sequence[float]) -> tuple[float, float]:
    low, high = min(values), max(values)
    return (low, high) if low < high else (low - 0.5, high + 0.5)


def _scale(value: float, limits: tuple[float, float], start: float, end: float) -> float:
    return start + (value - limits[0]) / (limits[1] - limits[0]) * (end - start)
