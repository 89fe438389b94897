"""The metrics of every run: names, units and definitions, as `simscen explain metrics` and the reference show them."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Metric:
    """What a number means: its SI `unit` ("" = none), its definition, where that is from."""

    unit: str
    text: str
    source: str = ""


_ERRORS = {
    "rmse": "root mean square",
    "mean": "mean",
    "median": "median",
    "max": "greatest",
}

METRICS: dict[str, Metric] = {
    "success": Metric("", "1 when every goal was truly reached and nothing was touched, else 0.", "BARN, run.py"),
    "time_to_goal": Metric("s", "From the first goal's acceptance to the report that the last one is reached."),
    "barn_score": Metric(
        "",
        "OT / clip(t, 2 OT, 8 OT), OT = shortest_length / (2 m/s), t = time_to_goal; 0 without success. For runs with "
        "one goal.",
        "BARN challenge, run.py",
    ),
    "path_length": Metric("m", "The true way in the plane, in moves of at least 1 cm.", "HuNavSim, bench-mr"),
    "shortest_length": Metric("m", "The shortest way from the start through all goals."),
    "path_length_ratio": Metric("", "path_length / shortest_length.", "SEAN"),
    "spl": Metric("", "success x l / max(l, p), l = shortest_length, p = path_length.", "Anderson et al. 2018"),
    "soft_spl": Metric(
        "", "max(0, 1 - d / l) x l / max(l, p), d = what is left to the last goal at the end.", "Habitat"
    ),
    "heading_change": Metric("rad", "Sum of all changes of the true heading, wrapped, either way.", "HuNavSim"),
    "path_irregularity": Metric(
        "rad", "heading_change beyond that of the first plan to each goal; never negative.", "SEAN"
    ),
    "aol": Metric("rad/m", "Angle over length: changes of the driven way's slope by path_length.", "bench-mr"),
    "norm_curvature": Metric(
        "rad",
        "Sum of k (s1 + s2) over the driven way resampled to steps s of at least 0.3 m, k = 1 / radius of the circle "
        "through three of its points.",
        "bench-mr",
    ),
    "max_curvature": Metric("1/m", "The greatest k.", "bench-mr"),
    "max_speed": Metric("m/s", "Greatest true speed over ground."),
    "time_not_moving": Metric("s", "While the speed is below 0.01 m/s and the turn rate, either way, below 0.02 rad/s.",
                              "HuNavSim"),
    "mean_jerk": Metric("m/s^3", "Mean of |v[k+1] - 2 v[k] + v[k-1]| / dt^2, v = true speed over ground."),
    "max_jerk": Metric("m/s^3", "The greatest of them."),
    "sparc": Metric("", "Spectral arc length of the speed over ground; 0 = smooth.", "Balasubramanian et al. 2015"),
    "ldlj": Metric("", "Log dimensionless jerk of the speed over ground; greater = smoother.",
                   "Balasubramanian et al. 2015"),
    "min_clearance": Metric("m", "Least true distance of the hull to anything; 2 m where nothing is nearer."),
    "mean_clearance": Metric("m", "Its mean, more than 2 m counting as 2 m.", "bench-mr"),
    "min_person_distance": Metric("m", "Least true gap between the robot's footprint and a pedestrian's body.",
                                  "HuNavSim"),
    "intrusion_intimate": Metric(
        "", "Share of the time with the gap to the nearest pedestrian below 0.45 m.", "Hall 1966, HuNavSim"
    ),
    "intrusion_personal": Metric("", "The same from 0.45 m to below 1.2 m.", "Hall 1966, HuNavSim"),
    "intrusion_social": Metric("", "The same from 1.2 m to below 3.6 m.", "Hall 1966, HuNavSim"),
    "collisions": Metric("", "Contacts that began.", "Arena"),
    "contact_time": Metric("s", "While there was at least one contact."),
    "replans": Metric("", "Plans made for another reason than a new goal."),
    "recoveries": Metric("", "Recoveries begun."),
    **{
        f"ape_trans_{name}": Metric(
            "m", f"Absolute pose error, position: {text} distance of belief and truth, not aligned.", "evo"
        )
        for name, text in _ERRORS.items()
    },
    "ape_trans_final": Metric("m", "The last of them."),
    **{
        f"ape_rot_{name}": Metric("rad", f"Absolute pose error, heading: {text} angle of belief and truth.", "evo")
        for name, text in _ERRORS.items()
    },
    **{
        f"rpe_trans_{name}": Metric(
            "m", f"Relative pose error over each true metre, position: {text}.", "evo, delta 1 m, pairs from reference"
        )
        for name, text in _ERRORS.items()
    },
    **{
        f"rpe_rot_{name}": Metric("rad", f"Relative pose error over each true metre, heading: {text}.", "evo")
        for name, text in _ERRORS.items()
    },
    "nees": Metric(
        "",
        "Squared pose error measured by the believed covariance, mean over the run; 3 when the belief is as sure as it "
        "may be.",
        "filterpy; Bar-Shalom et al. 2001",
    ),
}  # fmt: skip
"""Every metric by name, in the order of the reference."""

ADDRESSES = dict.fromkeys(METRICS, "simscen.judge.metrics.compute:compute_metrics")
"""Where each is measured, for the registry: no package may add another of its name."""
