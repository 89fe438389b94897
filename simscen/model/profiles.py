"""Profiles: sets of default values for the parameters of simscen's navigation stack."""

from collections.abc import Mapping
from typing import Any, Literal

Profile = Literal["reference", "advanced", "nav2", "simscen"]
Values = Mapping[str, Any]
"""Parameters by key, or by section and key."""

SECTIONS_BY_TYPE = ("localizer", "planner", "controller", "goal_checker")
"""Sections whose parameters depend on `type`. In a profile, the parameters of these sections are grouped by type. The
first type is the default."""
_COSTMAP: Values = {
    "obstacle_max_range": 2.5, "obstacle_min_range": 0.0, "raytrace_max_range": 3.0, "raytrace_min_range": 0.0,
    "max_obstacle_height": 2.0, "min_obstacle_height": 0.0, "max_ground_slope": 0.0,
    "inf_is_valid": False,
    "inflation_radius": 0.70, "cost_scaling_factor": 3.0, "resolution": 0.05,
}  # fmt: skip
"""Parameters of both costmaps in the profile `nav2`."""
_PLANNER: Values = {"tolerance": 0.5, "allow_unknown": True, "replanning": "rate", "cautious": False}
"""Parameters of all planners in the profile `nav2`."""
_USE_CIRCLE: Values = {"consider_footprint": False}
"""Parameters of MPPI critics in the profile `nav2`: check only the inscribed circle of the footprint."""
NAV2: Values = {
    "controller_frequency": 20.0,
    "failure_tolerance": 0.3,
    "min_x_velocity_threshold": 0.001, "min_theta_velocity_threshold": 0.001,
    "min_y_velocity_threshold": 0.001,  # nav2_bringup: 0.5, for robots that cannot move sideways
    "localizer": {"amcl": {"laser_model_type": "likelihood_field"}},
    "costmap": {**_COSTMAP, "update_frequency": 1.0, "track_unknown_space": True},
    "local_costmap": {**_COSTMAP, "update_frequency": 5.0, "width": 3.0, "height": 3.0, "track_unknown_space": False},
    "planner": {"navfn": _PLANNER, "smac_2d": {**_PLANNER, "tolerance": 0.125}},
    "controller": {
        "mppi": {
            "batch_size": 2000, "time_steps": 56, "model_dt": 0.05, "iteration_count": 1, "vx_max": 0.5,
            "vx_min": -0.35, "vy_max": 0.5, "wz_max": 1.9, "vx_std": 0.2, "vy_std": 0.2, "wz_std": 0.4,
            "ax_max": 3.0, "ax_min": -3.0,
            "ay_max": 3.0, "ay_min": -3.0, "az_max": 3.5, "temperature": 0.3, "gamma": 0.015,
            "regenerate_noises": True, "open_loop": False, "CostCritic": _USE_CIRCLE, "ObstaclesCritic": _USE_CIRCLE,
            "TrajectoryValidator": _USE_CIRCLE,
        },
        "regulated_pure_pursuit": {
            "desired_linear_vel": 0.5, "use_velocity_scaled_lookahead_dist": False, "slow_down_ahead": False,
        },
        "dwb": {"max_vel_x": 0.5, "max_vel_y": 0.0, "min_vel_y": 0.0, "prune_distance": 2.0},
    },
    "goal_checker": {
        "simple": {"xy_goal_tolerance": 0.25, "yaw_goal_tolerance": 0.25, "stateful": True, "well_inside": 1.0}
    },
    "progress_checker": {"required_movement_radius": 0.5, "movement_time_allowance": 10.0},
    "recovery": {
        "number_of_retries": 6, "retries_since_progress": False,
        "planner_codes": ["PLANNER_UNKNOWN", "PLANNER_TIMEOUT", "NO_VALID_PATH"],
        "behaviors": ["clear_costmap", "spin", "wait", "backup"],
        "clear_entirely": True, "backup_partial": False, "spin_dist": 1.57, "wait_duration": 5.0, "backup_dist": 0.30,
        "backup_speed": 0.15, "simulate_ahead_time": 2.0, "max_rotational_vel": 1.0,
    },
    "velocity_smoother": {
        "max_accel": 3.0, "max_decel": 3.0, "max_angular_accel": 3.5, "max_velocity": 0.5, "max_angular_velocity": 2.0,
        "counter_turn_slip": False,
    },
    "prediction": {"enabled": False},
    "collision_monitor": {
        "source_timeout": 1.0, "time_before_collision": 1.2, "stop_margin": 0.0, "min_points": 6, "hold_timeout": 0.0,
    },
}  # fmt: skip
"""Parameters of the profile `nav2`, by section."""
_CAUTIOUS: Values = {"cautious": True}
"""Parameters of all planners in the profile `advanced`."""
ADVANCED: Values = {
    "localizer": {"scan_matching_amcl": {}},
    "planner": {
        "medial_axis": _CAUTIOUS, "bit_star": _CAUTIOUS, "rrt_connect": _CAUTIOUS, "rrt_star": _CAUTIOUS,
        "informed_rrt_star": _CAUTIOUS, "aorrtc": _CAUTIOUS, "kpiece": _CAUTIOUS, "navfn": _CAUTIOUS,
        "smac_2d": _CAUTIOUS,
    },
    "goal_checker": {"simple": {"well_inside": 0.5}},
    "recovery": {
        "retries_since_progress": True,
        "planner_codes": [
            "PLANNER_UNKNOWN", "START_OUTSIDE_MAP", "START_OCCUPIED", "GOAL_OCCUPIED", "PLANNER_TIMEOUT",
            "NO_VALID_PATH",
        ],
        "behaviors": ["clear_costmap", "retrace", "spin", "wait"],
        "clear_entirely": False, "backup_partial": True,
    },
    "velocity_smoother": {"counter_turn_slip": True},
    "prediction": {"enabled": True},
}  # fmt: skip
"""Parameters of the profile `advanced`, by section, that differ from the defaults."""
PROFILES: Mapping[str, Values] = {"reference": {}, "advanced": ADVANCED, "nav2": NAV2, "simscen": ADVANCED}
"""Parameters that each profile sets, by profile and section. `simscen` is the deprecated name of `advanced`."""


def apply_profile(parameters: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the parameters of a stack. Missing parameters are taken from its `profile`."""
    profile = PROFILES.get(str(parameters.get("profile", "reference")), {})
    sections = {name: _complete_section(name, values, parameters.get(name)) for name, values in profile.items()}
    return {**parameters, **sections}


def _complete_section(name: str, defaults: Any, section: Any) -> Any:
    """Return the section `name` of a stack, with missing parameters from the profile's section `defaults`.

    `section` is None if the stack has no such section.
    """
    if section is None:
        if name not in SECTIONS_BY_TYPE:
            return defaults
        default_type = next(iter(defaults))
        return {"type": default_type, **defaults[default_type]}
    if not isinstance(section, Mapping) or not isinstance(defaults, Mapping):
        return section
    if name not in SECTIONS_BY_TYPE:
        return merge_parameters(defaults, section)
    type_name = str(section.get("type", next(iter(defaults))))
    return merge_parameters({"type": type_name, **defaults.get(type_name, {})}, section)


def merge_parameters(defaults: Mapping[str, Any], parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return `defaults` updated by `parameters`. Nested mappings are merged."""
    merged = dict(defaults)
    for key, value in parameters.items():
        is_nested = isinstance(defaults.get(key), Mapping) and isinstance(value, Mapping)
        merged[key] = merge_parameters(defaults[key], value) if is_nested else value
    return merged
