"""Which evidence each criterion is decided by, so that a log without it is never judged as if it were there."""

from collections.abc import Mapping

from simscen.core.evidence import Coverage, Evidence
from simscen.core.verdict import Finding, Status
from simscen.criteria.criterion import AnyCriterion

_TRUTH, _BELIEF, _GOALS = Evidence.TRUTH, Evidence.BELIEF, Evidence.NAVIGATION
_PLACE = frozenset({_TRUTH, Evidence.ALIGNMENT})
_NEEDS: dict[str, frozenset[Evidence]] = {
    "goals_reached": _PLACE | {_GOALS},
    "result": frozenset({_GOALS}),
    "error_code": frozenset({_GOALS, Evidence.ERROR_CODES}),
    "no_false_success": _PLACE | {_GOALS},
    "collisions": frozenset({Evidence.CONTACTS}),
    "clearance": frozenset({Evidence.CLEARANCE}),
    "keepout": _PLACE | {Evidence.FOOTPRINT},
    "time_to_goal": frozenset({_GOALS}),
    "path_length": frozenset({_TRUTH}),
    "speed": frozenset({_TRUTH, Evidence.VELOCITY}),
    "stopped_within": frozenset({_TRUTH, Evidence.VELOCITY, Evidence.DISTURBANCES}),
    "stuck": frozenset({_TRUTH, _GOALS}),
    "localization_error": _PLACE | {_BELIEF},
    "localization_consistency": _PLACE | {_BELIEF},
    "relocalized_within": _PLACE | {_BELIEF},
    "replans": frozenset({Evidence.PLANNING}),
    "recoveries": frozenset({Evidence.RECOVERIES}),
}
"""A criterion that is not listed needs everything."""


_LOCALIZATION = ("rmse", "mean", "max", "final", "yaw_rmse")
_METRICS: dict[str, frozenset[Evidence]] = {
    **dict.fromkeys(("success", "spl", "soft_spl"), _PLACE | {_GOALS}),
    **dict.fromkeys(("path_length", "path_ratio", "heading_change"), frozenset({_TRUTH})),
    **dict.fromkeys(("speed_max", "time_standing"), frozenset({_TRUTH, Evidence.VELOCITY})),
    **dict.fromkeys(("nees", *(f"localization_{name}" for name in _LOCALIZATION)), _PLACE | {_BELIEF}),
    **dict.fromkeys(("clearance_min", "clearance_mean"), frozenset({Evidence.CLEARANCE})),
    **dict.fromkeys(("collisions", "contact_time"), frozenset({Evidence.CONTACTS})),
    "shortest_length": frozenset(),
    "time_to_goal": frozenset({_GOALS}),
    "replans": frozenset({Evidence.PLANNING}),
    "recoveries": frozenset({Evidence.RECOVERIES}),
}


def needs(entry: AnyCriterion) -> frozenset[Evidence]:
    """The evidence that decides a criterion as it is written."""
    wanted = _NEEDS.get(entry.kind, frozenset(Evidence))
    if getattr(entry.chosen, "error_code", None) is not None:
        wanted |= {Evidence.ERROR_CODES}
    if isinstance(getattr(entry.chosen, "after", None), str):
        wanted |= {Evidence.DISTURBANCES}
    return wanted


def undecidable(entry: AnyCriterion, coverage: Coverage) -> Finding | None:
    """The finding of a criterion that the log says nothing about; None when it can be judged."""
    lacking = [evidence for evidence in Evidence if evidence in coverage.missing and evidence in needs(entry)]
    if not lacking:
        return None
    because = f"the log does not say {' nor '.join(evidence.value for evidence in lacking)}"
    reasons = dict.fromkeys(reason for evidence in lacking if (reason := coverage.missing[evidence]))
    return Finding(Status.INCONCLUSIVE, entry.kind, because, "", detail=tuple(reasons))


def known(metrics: Mapping[str, float | None], coverage: Coverage) -> dict[str, float | None]:
    """The metrics, without those that the log cannot tell: no collision recorded is not the same as none."""
    everything = frozenset(Evidence)
    return {
        name: None if coverage.missing.keys() & _METRICS.get(name, everything) else value
        for name, value in metrics.items()
    }


def doubt(entry: AnyCriterion, coverage: Coverage) -> str:
    """Why a pass could be an accident: what decides it is not there all the time; "" when it is."""
    wanted = needs(entry)
    return "; ".join(reason for evidence, reason in coverage.partial.items() if evidence in wanted)
