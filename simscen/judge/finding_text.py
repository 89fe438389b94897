"""Text of findings and disturbances for reports, and relative margins (margins divided by limits)."""

from collections.abc import Sequence
from math import isfinite

from simscen.core.records.disturbances import DisturbanceOutcome
from simscen.core.records.run_result import Outcome, RunResult
from simscen.core.records.verdict import Finding, Status, Verdict

DISTURBANCE = "disturbance"
"""Criterion name of verdicts on missing events and faults. The ID is the name of the event or fault."""
GOALS_REACHED = "goals_reached"
"""Name of the criterion that checks the true pose of the robot at its goals."""
MAX_TIMES_SHOWN = 5
"""Maximum number of times that are listed for a repeated disturbance."""
_RELATIONS = {"≤ ": ("≤ ", "> "), "≥ ": ("≥ ", "< "), "< ": ("< ", "≥ "), "> ": ("> ", "≤ ")}
"""Signs between value and limit, by the sign at the start of the limit: (limit is met, limit is violated)."""


def comparison(finding: Finding) -> str:
    """Return the comparison of the measured value with the limit, e.g. "0.84 s > 0.50 s after lidar.off"."""
    if finding.status in (Status.INCONCLUSIVE, Status.ERROR):
        return f"{finding.status.value}: {finding.measured}"
    sign_if_held, sign_if_violated = _RELATIONS.get(finding.limit[:2], ("", ""))
    if sign_if_held:
        relation = sign_if_held if finding.status is Status.PASS else sign_if_violated
        return f"{finding.measured} {relation}{finding.limit[2:]}"
    is_sufficient = finding.status is Status.PASS or not finding.limit
    return finding.measured if is_sufficient else f"{finding.measured}; expected {finding.limit}"


def time_and_place(finding: Finding, tick_rate: int) -> str:
    """Return the time and place of a finding, e.g. "at t = 10.84 s, (2.10, 3.41)"; "" if its time is unknown."""
    if finding.tick is None:
        return ""
    time = f"at t = {finding.tick / tick_rate:.2f} s"
    return time if finding.place is None else f"{time}, ({finding.place[0]:.2f}, {finding.place[1]:.2f})"


def subject(verdict: Verdict, finding: Finding) -> str:
    """Return the criterion and the checked item, e.g. "goals_reached: goal shelf"."""
    if verdict.criterion == DISTURBANCE:  # the ID is the name of an event or fault, and looks like a criterion
        return finding.what
    item = finding.what.removeprefix(verdict.criterion).removeprefix(":").strip()
    return f"{verdict.id}: {item}" if item else verdict.id


def sentence(verdict: Verdict, finding: Finding, tick_rate: int) -> str:
    """Return the text of a finding, e.g. "stuck: 8.00 s > 5.00 s, at t = 10.84 s, (2.10, 3.41)"."""
    parts = (f"{subject(verdict, finding)}: {comparison(finding)}", time_and_place(finding, tick_rate))
    return ", ".join(part for part in parts if part)


def disturbance_times(outcome: DisturbanceOutcome, tick_rate: int) -> str:
    """Return the times at which a disturbance began, e.g. "t = 10.00 s, 12.50 s and 3 more", or "never"."""
    times = [f"{tick / tick_rate:.2f} s" for tick in outcome.fired[:MAX_TIMES_SHOWN]]
    more = f" and {len(outcome.fired) - MAX_TIMES_SHOWN} more" if len(outcome.fired) > MAX_TIMES_SHOWN else ""
    return f"t = {', '.join(times)}{more}" if times else "never"


def disturbance_line(outcome: DisturbanceOutcome, tick_rate: int) -> str:
    """Return the text of a disturbance, e.g. "pallet falls: t = 10.00 s, spawned pallet at (2.00, 2.00)"."""
    parts = (
        disturbance_times(outcome, tick_rate) if outcome.fired else "",
        outcome.effect,
        "" if outcome.happened else "so it did not happen",
    )
    return f"{outcome.disturbance.name}: {', '.join(part for part in parts if part)}"


def violations(verdict: Verdict) -> tuple[Finding, ...]:
    """Return the findings of a verdict that did not pass: failed, inconclusive, and with an error, in order."""
    return tuple(finding for finding in verdict.findings if finding.status is not Status.PASS)


def tightest_margin(verdicts: Sequence[Verdict]) -> str:
    """Return the smallest relative margin of a pass, e.g. "path_length +0.14 m, 1 % of its limit"; "" if there is none.

    Counts and other values without a unit, and the distance, heading error, and waiting time at goals are left out.
    """
    # Robots always stop near the limit of the distance from a goal.
    tightest = _tightest_finding(verdicts)
    if tightest is None:
        return ""
    verdict, finding = tightest
    margin = f"{subject(verdict, finding)} {finding.margin:+.2f} {finding.unit}".rstrip()
    return f"{margin}, {100 * relative_margin(finding):.0f} % of its limit" if _limit(finding) else margin


def run_margin(result: RunResult) -> float:
    """Return the smallest relative margin of a run: at least 0 for a passed run, otherwise negative and at least -1.

    If no finding has a margin, return 1 for a passed run, otherwise -1. For a passed run, the findings that
    `tightest_margin` leaves out do not count.
    """
    if result.outcome is Outcome.PASSED:
        tightest = _tightest_finding(result.verdicts)
        return 1.0 if tightest is None else max(0.0, relative_margin(tightest[1]))
    failed = [finding for verdict in result.verdicts for finding in verdict.findings if finding.status is Status.FAIL]
    margins = [
        relative_margin(finding) for finding in failed if finding.margin is not None and isfinite(finding.margin)
    ]
    return max(-1.0, min(margins)) if margins and min(margins) < 0 else -1.0


def _tightest_finding(verdicts: Sequence[Verdict]) -> tuple[Verdict, Finding] | None:
    """Return the passed finding with the smallest relative margin, with its verdict; see `tightest_margin`."""
    findings = [(v, f) for v in verdicts for f in v.findings if f.status is Status.PASS and not _is_about_arrival(v, f)]
    # A margin without value and unit is in multiples of the `scale` of a condition, and therefore relative.
    comparable = [(v, f) for v, f in findings if f.unit or f.value is None]
    with_margin = [(v, f) for v, f in comparable if f.margin is not None and isfinite(f.margin)]
    return min(with_margin, key=lambda pair: relative_margin(pair[1]), default=None)


def _is_about_arrival(verdict: Verdict, finding: Finding) -> bool:
    """Return whether the finding is about the distance, heading error, or waiting time at a goal."""
    return verdict.criterion == GOALS_REACHED and not (finding.unit == "s" and finding.limit.startswith("≤"))


def relative_margin(finding: Finding) -> float:
    """Return the margin divided by the limit, or the margin itself if the limit is 0 or unknown."""
    margin, limit = finding.margin or 0.0, _limit(finding)
    return margin / abs(limit) if limit else margin


def _limit(finding: Finding) -> float:
    """Return the limit, or 0 if it is unknown."""
    if finding.value is None or finding.margin is None:
        return 0.0
    is_lower = finding.limit.startswith(("≥", ">"))
    return finding.value - finding.margin if is_lower else finding.value + finding.margin
