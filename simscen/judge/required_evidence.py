"""Which evidence each criterion is decided by, so that a log without it is never judged as if it were there."""

from simscen.core.evidence import Coverage, Evidence
from simscen.core.verdict import Finding, Status
from simscen.criteria.registry import AnyCriterion
from simscen.judge.metrics.compute import MetricValues

_TRUTH, _BELIEF, _GOALS = Evidence.TRUTH, Evidence.BELIEF, Evidence.NAVIGATION
_PLACE = frozenset({_TRUTH, Evidence.ALIGNMENT})
_NEEDS: dict[str, frozenset[Evidence]] = {
    "goals_reached": _PLACE | {_GOALS},
    "result": frozenset({_GOALS}),
    "error_code": frozenset({_GOALS, Evidence.ERROR_CODES}),
    "no_false_success": _PLACE | {_GOALS},
    "collisions": frozenset({Evidence.CONTACTS}),
    "clearance": frozenset({Evidence.CLEARANCE}),
    "personal_space": _PLACE | {Evidence.OBJECTS, Evidence.FOOTPRINT, Evidence.VELOCITY},
    "keepout": _PLACE | {Evidence.FOOTPRINT},
    "time_to_goal": frozenset({_GOALS}),
    "path_length": frozenset({_TRUTH}),
    "speed": frozenset({_TRUTH, Evidence.VELOCITY}),
    "smoothness": frozenset({_TRUTH, Evidence.VELOCITY}),
    "stopped_within": frozenset({_TRUTH, Evidence.VELOCITY, Evidence.DISTURBANCES}),
    "stuck": frozenset({_TRUTH, _GOALS}),
    "localization_error": _PLACE | {_BELIEF},
    "localization_consistency": _PLACE | {_BELIEF, Evidence.COVARIANCE},
    "relocalized_within": _PLACE | {_BELIEF},
    "replans": frozenset({Evidence.PLANNING}),
    "recoveries": frozenset({Evidence.RECOVERIES}),
}
"""A criterion that is not listed needs everything."""


_SUMS = ("rmse", "mean", "median", "max")
_APE = (*(f"ape_{kind}_{one}" for kind in ("trans", "rot") for one in _SUMS), "ape_trans_final")
_RPE = tuple(f"rpe_{kind}_{one}" for kind in ("trans", "rot") for one in _SUMS)
_SHAPE = ("path_length", "path_length_ratio", "heading_change", "aol", "norm_curvature", "max_curvature")
_SPEEDS = ("max_speed", "time_not_moving", "mean_jerk", "max_jerk", "sparc", "ldlj")
_SPACES = ("min_person_distance", "intrusion_intimate", "intrusion_personal", "intrusion_social")
_METRICS: dict[str, frozenset[Evidence]] = {
    **dict.fromkeys(("success", "spl", "barn_score"), _PLACE | {_GOALS, Evidence.CONTACTS}),
    "soft_spl": _PLACE | {_GOALS},
    **dict.fromkeys(_SHAPE, frozenset({_TRUTH})),
    "path_irregularity": frozenset({_TRUTH, _GOALS, Evidence.PLANNING}),
    **dict.fromkeys(_SPEEDS, frozenset({_TRUTH, Evidence.VELOCITY})),
    **dict.fromkeys(_APE, _PLACE | {_BELIEF}),
    "nees": _PLACE | {_BELIEF, Evidence.COVARIANCE},
    **dict.fromkeys(_RPE, frozenset({_TRUTH, _BELIEF})),
    **dict.fromkeys(("min_clearance", "mean_clearance"), frozenset({Evidence.CLEARANCE})),
    **dict.fromkeys(("collisions", "contact_time"), frozenset({Evidence.CONTACTS})),
    **dict.fromkeys(_SPACES, _PLACE | {Evidence.OBJECTS, Evidence.FOOTPRINT}),
    "shortest_length": frozenset(),
    "time_to_goal": frozenset({_GOALS}),
    "replans": frozenset({Evidence.PLANNING}),
    "recoveries": frozenset({Evidence.RECOVERIES}),
}


def required_evidence(entry: AnyCriterion) -> frozenset[Evidence]:
    """The evidence that decides a criterion as it is written."""
    own = getattr(entry.chosen, "evidence", None)
    if own is not None:
        return frozenset(own)
    wanted = _NEEDS.get(entry.kind, frozenset(Evidence))
    if any(getattr(entry.chosen, key, None) is not None for key in ("in_", "mask")):
        wanted |= _PLACE
    if getattr(entry.chosen, "error_code", None) is not None:
        wanted |= {Evidence.ERROR_CODES}
    if isinstance(getattr(entry.chosen, "after", None), str):
        wanted |= {Evidence.DISTURBANCES}
    return wanted


def missing_evidence_finding(entry: AnyCriterion, coverage: Coverage) -> Finding | None:
    """The finding of a criterion that the log says nothing about; None when it can be judged."""
    lacking = [
        evidence for evidence in Evidence if evidence in coverage.missing and evidence in required_evidence(entry)
    ]
    if not lacking:
        return None
    because = f"the log does not say {' nor '.join(evidence.value for evidence in lacking)}"
    reasons = dict.fromkeys(reason for evidence in lacking if (reason := coverage.missing[evidence]))
    return Finding(Status.INCONCLUSIVE, entry.kind, because, "", detail=tuple(reasons))


def metrics_with_evidence(measures: MetricValues, coverage: Coverage) -> MetricValues:
    """The metrics, without those that the log cannot tell: no collision recorded is not the same as none."""
    lacking = {name: lack for name in measures.values if (lack := _lacking(_METRICS.get(name, frozenset()), coverage))}
    return MetricValues(
        {name: None if name in lacking else value for name, value in measures.values.items()},
        {
            **measures.undefined,
            **{name: f"the log does not say {' nor '.join(lack)}" for name, lack in lacking.items()},
        },
    )


def _lacking(wanted: frozenset[Evidence], coverage: Coverage) -> list[str]:
    return [evidence.value for evidence in Evidence if evidence in coverage.missing and evidence in wanted]


def partial_evidence_reason(entry: AnyCriterion, coverage: Coverage) -> str:
    """Why a pass could be an accident: what decides it is not there all the time; "" when it is."""
    wanted = required_evidence(entry)
    return "; ".join(reason for evidence, reason in coverage.partial.items() if evidence in wanted)
