"""Catalog of the metrics that are computed for every run: names, units, definitions, and required evidence."""

from collections.abc import Set
from dataclasses import dataclass

from simscen.core.records.verdict import POSITION_EVIDENCE, Evidence


@dataclass(frozen=True)
class Metric:
    """Definition of a metric.

    unit:      SI unit; "" for none
    text:      definition for users
    source:    paper or program that defines the metric; "" for simscen
    evidence:  kinds of information that a log must contain to compute the metric
    """

    unit: str
    text: str
    source: str = ""
    evidence: Set[Evidence] = frozenset()


_PATH = frozenset({Evidence.TRUTH})
_MOTION = frozenset({Evidence.TRUTH, Evidence.VELOCITY})
_GOALS = frozenset({Evidence.NAVIGATION})
_SUCCESS = POSITION_EVIDENCE | _GOALS | {Evidence.CONTACTS}
_BELIEF = POSITION_EVIDENCE | {Evidence.BELIEF}
_PEOPLE = POSITION_EVIDENCE | {Evidence.OBJECTS, Evidence.FOOTPRINT}
"""Sets of evidence that several metrics need."""

_ERROR_STATISTICS = {"rmse": "root mean square", "mean": "mean", "median": "median", "max": "largest"}
"""Statistics of pose errors: text by suffix of the metric's name."""

METRICS: dict[str, Metric] = {
    "success": Metric(
        "",
        "1 if every goal was truly reached and nothing was touched, otherwise 0; undefined without goals.",
        "BARN, run.py",
        evidence=_SUCCESS,
    ),
    "time_to_goal": Metric(
        "s", "Time from the acceptance of the first goal to the report that the last one is reached.", evidence=_GOALS
    ),
    "barn_score": Metric(
        "",
        "OT / clip(t, 2 OT, 8 OT), optimal time OT = shortest_length / (2 m/s), t = time_to_goal; 0 without success. "
        "For runs with one goal.",
        "BARN challenge, run.py",
        evidence=_SUCCESS,
    ),
    "path_length": Metric(
        "m", "Length of the true path in the plane, in moves of at least 1 cm.", "HuNavSim, bench-mr", evidence=_PATH
    ),
    "shortest_length": Metric("m", "Length of the shortest path from the start through all goals."),
    "path_length_ratio": Metric("", "path_length / shortest_length.", "SEAN", evidence=_PATH),
    "spl": Metric(
        "", "success x l / max(l, p), l = shortest_length, p = path_length.", "Anderson et al. 2018", evidence=_SUCCESS
    ),
    "soft_spl": Metric(
        "",
        "max(0, 1 - d / l) x l / max(l, p), d = final distance from the last goal.",
        "Habitat",
        evidence=POSITION_EVIDENCE | _GOALS,
    ),
    "heading_change": Metric(
        "rad", "Sum of the absolute changes of the true heading, wrapped.", "HuNavSim", evidence=_PATH
    ),
    "path_irregularity": Metric(
        "rad",
        "heading_change minus the heading changes of the first plan to each goal; at least 0.",
        "SEAN",
        evidence=_PATH | _GOALS | {Evidence.PLANNING},
    ),
    "aol": Metric(
        "rad/m",
        "Angle over length: sum of the changes of direction of the driven path divided by path_length.",
        "bench-mr",
        evidence=_PATH,
    ),
    "norm_curvature": Metric(
        "rad",
        "Sum of k (s1 + s2) over the points of the driven path, resampled to steps of at least 0.3 m; s1, s2 = steps "
        "before and after the point, k = 1 / radius of the circle through it and its neighbors.",
        "bench-mr",
        evidence=_PATH,
    ),
    "max_curvature": Metric("1/m", "Largest k of norm_curvature.", "bench-mr", evidence=_PATH),
    "max_speed": Metric("m/s", "Largest true speed over ground.", evidence=_MOTION),
    "time_not_moving": Metric(
        "s",
        "Time with a speed below 0.01 m/s and an absolute turn rate below 0.02 rad/s.",
        "HuNavSim",
        evidence=_MOTION,
    ),
    "mean_jerk": Metric(
        "m/s^3", "Mean of |v[k+1] - 2 v[k] + v[k-1]| / dt^2, v = true speed over ground.", evidence=_MOTION
    ),
    "max_jerk": Metric("m/s^3", "Largest jerk, computed as for mean_jerk.", evidence=_MOTION),
    "sparc": Metric(
        "", "Spectral arc length of the speed over ground; 0 = smooth.", "Balasubramanian et al. 2015", evidence=_MOTION
    ),
    "ldlj": Metric(
        "",
        "Log dimensionless jerk of the speed over ground; larger = smoother.",
        "Balasubramanian et al. 2015",
        evidence=_MOTION,
    ),
    "min_clearance": Metric(
        "m",
        "Smallest true distance from the hull to anything; 2 m if nothing is nearer.",
        evidence={Evidence.CLEARANCE},
    ),
    "mean_clearance": Metric(
        "m", "Mean true clearance; values above 2 m count as 2 m.", "bench-mr", evidence={Evidence.CLEARANCE}
    ),
    "min_person_distance": Metric(
        "m", "Smallest true gap between the robot's footprint and a pedestrian's body.", "HuNavSim", evidence=_PEOPLE
    ),
    "intrusion_intimate": Metric(
        "",
        "Share of the time with the gap to the nearest pedestrian below 0.45 m.",
        "Hall 1966, HuNavSim",
        evidence=_PEOPLE,
    ),
    "intrusion_personal": Metric(
        "",
        "Share of the time with the gap to the nearest pedestrian from 0.45 m to below 1.2 m.",
        "Hall 1966, HuNavSim",
        evidence=_PEOPLE,
    ),
    "intrusion_social": Metric(
        "",
        "Share of the time with the gap to the nearest pedestrian from 1.2 m to below 3.6 m.",
        "Hall 1966, HuNavSim",
        evidence=_PEOPLE,
    ),
    "collisions": Metric("", "Number of contacts that began.", "Arena", evidence={Evidence.CONTACTS}),
    "contact_time": Metric("s", "Time with at least one contact.", evidence={Evidence.CONTACTS}),
    "replans": Metric("", "Number of plans made for another reason than a new goal.", evidence={Evidence.PLANNING}),
    "recoveries": Metric("", "Number of recoveries that started.", evidence={Evidence.RECOVERIES}),
    **{
        f"ape_trans_{name}": Metric(
            "m",
            f"Absolute pose error, position: {text} distance between belief and truth, not aligned.",
            "evo",
            evidence=_BELIEF,
        )
        for name, text in _ERROR_STATISTICS.items()
    },
    "ape_trans_final": Metric("m", "Final distance between belief and truth.", evidence=_BELIEF),
    **{
        f"ape_rot_{name}": Metric(
            "rad",
            f"Absolute pose error, heading: {text} angle between belief and truth.",
            "evo",
            evidence=_BELIEF,
        )
        for name, text in _ERROR_STATISTICS.items()
    },
    **{
        f"rpe_trans_{name}": Metric(
            "m",
            f"Relative pose error over each true meter, position: {text}.",
            "evo, delta 1 m, pairs from reference",
            evidence=frozenset({Evidence.TRUTH, Evidence.BELIEF}),
        )
        for name, text in _ERROR_STATISTICS.items()
    },
    **{
        f"rpe_rot_{name}": Metric(
            "rad",
            f"Relative pose error over each true meter, heading: {text}.",
            "evo",
            evidence=frozenset({Evidence.TRUTH, Evidence.BELIEF}),
        )
        for name, text in _ERROR_STATISTICS.items()
    },
    "nees": Metric(
        "",
        "Normalized estimation error squared: squared pose error weighted by the inverse of the estimated covariance, "
        "mean over the run; 3 for a correct covariance.",
        "filterpy; Bar-Shalom et al. 2001",
        evidence=_BELIEF | {Evidence.COVARIANCE},
    ),
}
"""Metrics by name, in the order of the reference page."""

ADDRESSES = dict.fromkeys(METRICS, "simscen.judge.metrics.compute:compute_metrics")
"""Module and function that computes the metric, by name of the metric."""
