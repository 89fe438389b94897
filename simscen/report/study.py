"""Result of a study (many runs of one scenario) as console lines, and texts that other reports use as well.

A claim is a minimum pass rate that the study tests, with a stated confidence.
"""

from collections.abc import Iterator, Sequence
from itertools import groupby

from simscen.core.records.study import ClaimResult, ClaimStatus, ParameterEffect, RateRow, Study
from simscen.report.display_text import Role, StyledLine, StyledText, number_with_noun, one_line

MAX_ROWS = 60
"""Maximum number of listed rows with pass rates."""
MAX_EFFECTS = 10
"""Maximum number of listed significant effects."""
SIGNIFICANCE_LEVEL = 0.05
"""Maximum p-value of a significant effect, corrected for the number of tests."""
CLAIM_ROLES: dict[ClaimStatus, Role] = {
    ClaimStatus.HELD: "good",
    ClaimStatus.REFUTED: "bad",
    ClaimStatus.UNDECIDED: "warning",
    ClaimStatus.BLOCKED: "bad",
}
"""Role of the text about a claim, by its status."""


def study_lines(study: Study) -> Iterator[StyledLine]:
    """Yield pass rates by parameter, effects of parameters on margins, smallest margins, pass rate, and claim."""
    yield from _rate_table(study.rates)
    yield from _effect_table(study)
    yield from _smallest_margins(study)
    yield ()
    yield (StyledText(pass_rate_text(study)),)
    for text in pass_rate_notes(study):
        yield (StyledText(text, "quiet"),)
    if study.claim is not None:
        yield (StyledText(claim_text(study.claim), CLAIM_ROLES[study.claim.status]),)


def pass_rate_text(study: Study) -> str:
    """Return the pass rate of all runs, with its 95 % interval if the values were drawn at random."""
    runs = study.passed + study.failed
    text = f"study of {one_line(study.scenario)}: {study.passed} of {number_with_noun(runs, 'run')} passed"
    if runs:
        limits = study.limits
        interval = "" if limits is None else f", 95 % interval {100 * limits[0]:.1f} … {100 * limits[1]:.1f} %"
        text += f" ({100 * study.passed / runs:.1f} %{interval})"
    return text + (f", {number_with_noun(study.errors, 'run')} could not be completed" if study.errors else "")


def pass_rate_notes(study: Study) -> list[str]:
    """Return notes: whether values were random, the share of pairs that occurred, and the share of accepted draws."""
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
    """Return the claim in short, such as "pass rate >= 0.95 (confidence 0.95)"."""
    return f"pass rate >= {claim.min_rate:.6g} (confidence {claim.confidence:.6g})"


def claim_text(claim: ClaimResult) -> str:
    """Return the claim and its result in one sentence."""
    statement = f"claim: pass rate of at least {_percent(claim.min_rate)} with {_percent(claim.confidence)} confidence"
    runs = f"{claim.passed} of {number_with_noun(claim.runs, 'run')} passed"
    if claim.limits is not None:
        runs += f", which shows a rate of {100 * claim.limits[0]:.2f} … {100 * claim.limits[1]:.2f} %"
    match claim.status:
        case ClaimStatus.HELD:
            return f"{statement}: held, {runs}"
        case ClaimStatus.REFUTED:
            return f"{statement}: refuted, {runs}"
        case ClaimStatus.UNDECIDED:
            is_complete = claim.runs >= claim.max_runs
            needed = f"{claim.max_runs} are" if claim.method == "fixed" else f"up to {claim.max_runs} may be"
            hint = "more `runs` may decide it" if is_complete else f"{needed} needed"
            return f"{statement}: undecided, {runs}; {hint}"
        case ClaimStatus.BLOCKED:
            return f"{statement}: open, because {number_with_noun(claim.errors, 'run')} could not be completed; {runs}"


def effect_text(effect: ParameterEffect) -> str:
    """Return in words how a parameter affects a margin: its direction if the values of the parameter have an order."""
    if not effect.is_ordered:
        return "the margin depends on the value"
    return "a larger value lowers the margin" if effect.effect < 0 else "a larger value raises the margin"


def effect_size_text(effect: ParameterEffect) -> str:
    """Return the rank correlation of an ordered parameter, such as "-0.52"; otherwise, epsilon squared."""
    return f"{effect.effect:+.2f}" if effect.is_ordered else f"{effect.effect:.2f} (epsilon squared)"


def significant_effects(study: Study) -> Sequence[ParameterEffect]:
    """Return the effects with a p-value of at most SIGNIFICANCE_LEVEL."""
    return [effect for effect in study.effects if effect.p <= SIGNIFICANCE_LEVEL]


def _rate_table(rates: Sequence[RateRow]) -> Iterator[StyledLine]:
    """Yield a heading for each parameter, and below it the pass rate for each value."""
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
        yield (
            StyledText(f"  {name:{width}}   "),
            StyledText(f"{effect_size_text(effect)}   p = {effect.p:.1g}   {effect_text(effect)}", "quiet"),
        )


def _smallest_margins(study: Study) -> Iterator[StyledLine]:
    """Yield the smallest margin of each criterion, and the run in which it occurred."""
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
