"""Tables and types for translating Nav2's parameters to parameters of simscen's reference stack."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from pydantic import BaseModel

CONTROLLERS = {
    "RegulatedPurePursuitController": "regulated_pure_pursuit",
    "DWBLocalPlanner": "dwb",
    "MPPIController": "mppi",
}
"""Types of controllers in simscen, by class of the Nav2 plugin."""
PLANNERS = {"NavfnPlanner": "navfn", "SmacPlanner2D": "smac_2d"}
"""Types of planners in simscen, by class of the Nav2 plugin."""
MOTION_MODELS = {
    "DifferentialMotionModel": "differential", "OmniMotionModel": "omni",
    "differential": "differential", "omnidirectional": "omni",
}  # fmt: skip
"""Motion models of AMCL in simscen, by name in Nav2. The last two names are older than Humble."""
DWB_CRITICS = {
    "BaseObstacle": "base_obstacle_scale", "PathAlign": "path_align_scale", "PathDist": "path_dist_scale",
    "GoalAlign": "goal_align_scale", "GoalDist": "goal_dist_scale", "RotateToGoal": "rotate_to_goal_scale",
    "Twirling": "twirling_scale",
}  # fmt: skip
"""Parameters in simscen for the weights of DWB's critics, by critic in Nav2."""
DWB_CRITICS_WITHOUT_WEIGHT = ("Oscillation", "ObstacleFootprint")
"""DWB critics that only reject trajectories. They are always active in simscen."""
DWB_FORWARD_POINT_M = 0.1
"""Default of `forward_point_distance` in simscen, which has one value for both alignment critics of DWB."""
DWB_OPTIONAL_LIMITS = ("min_speed_xy", "max_speed_xy", "min_speed_theta")
"""Limits of DWB that are off if they are negative."""
MPPI_OMNI_PARAMETERS = ("vy_std", "ay_max", "ay_min")
"""Parameters of MPPI that only the motion model Omni uses. Files for other models often set them to 0."""
MPPI_CRITICS = (
    "ConstraintCritic", "CostCritic", "ObstaclesCritic", "GoalCritic", "GoalAngleCritic", "PathAlignCritic",
    "PathFollowCritic", "PathAngleCritic", "PreferForwardCritic", "TwirlingCritic", "VelocityDeadbandCritic",
)  # fmt: skip
"""MPPI critics in simscen. They have the same names in Nav2."""
RENAMED_PARAMETERS: Mapping[tuple[str, str], str] = {
    ("regulated_pure_pursuit", "max_linear_vel"): "desired_linear_vel",
    **{("dwb", f"{critic}.scale"): weight for critic, weight in DWB_CRITICS.items()},
    ("dwb", "PathAlign.forward_point_distance"): "forward_point_distance",
    ("dwb", "RotateToGoal.slowing_factor"): "slowing_factor",
    ("dwb", "Oscillation.oscillation_reset_dist"): "oscillation_reset_dist",
    ("dwb", "Oscillation.oscillation_reset_angle"): "oscillation_reset_angle",
    ("dwb", "Oscillation.x_only_threshold"): "x_only_threshold",
}
"""Names in simscen of parameters that have another name in Nav2, by (type in simscen, name in Nav2)."""
IGNORED_PARAMETERS = frozenset(
    {
        "tf_broadcast", "save_pose_rate", "random_seed", "map_subscribe_transient_local",
        "always_send_full_costmap", "use_composition", "data_type", "type", "critics", "filters",
        "observation_sources", "expected_planner_frequency", "expected_update_rate", "smoothing_frequency",
        "odom_duration", "velocity_timeout", "stop_pub_timeout", "costmap_update_timeout", "first_map_only",
        "always_reset_initial_pose", "polygons", "controller_plugin_types",
    }
)  # fmt: skip
"""Parameters that have no effect in simulation, or are translated together with other parameters."""
IGNORED_NAME_PARTS = (
    "frame", "topic", "plugin", "use_sim_time", "transform_t", "introspection_mode", "publish", "visualize", "bond",
    "qos", "realtime_priority", "stamp", "transport",
)  # fmt: skip
"""Other parameters have no effect in simulation if the last part of their dotted name contains one of these texts."""
EQUIVALENT_VALUES: Mapping[str, tuple[object, ...]] = {
    "enabled": (True,), "marking": (True,), "clearing": (True,), "use_astar": (False,), "scale_velocities": (False,),
    "feedback": ("OPEN_LOOP",), "base_shift_correction": (True,), "deadband_velocity": ([0.0, 0.0, 0.0],),
    "combination_method": (1,), "footprint_clearing_enabled": (True,), "stateful": (True,), "lookahead_time": (-1.0,),
    **dict.fromkeys(("short_circuit_trajectory_evaluation", "debug_trajectory_details"), (True, False)),
}  # fmt: skip
"""Values with which Nav2 behaves like simscen, by parameter that simscen does not have."""
SCENARIO_PARAMETERS: Mapping[str, str] = {
    **dict.fromkeys(("footprint", "robot_radius"), "the robot file defines the size of the robot"),
    **dict.fromkeys(("initial_pose", "set_initial_pose"), "the scenario defines the initial pose"),
}
"""Notes about parameters that are ignored, because the scenario or the robot file defines their values."""
OLD_NODE_NAMES = {"recoveries_server": "behavior_server"}
"""New names of nodes that were renamed in Humble, by old name."""
IGNORED_NODES = frozenset(
    {
        "map_server", "map_saver", "lifecycle_manager", "lifecycle_manager_navigation",
        "lifecycle_manager_localization", "filter_mask_server", "costmap_filter_info_server",
        "keepout_filter_mask_server", "keepout_costmap_filter_info_server", "speed_filter_mask_server",
        "speed_costmap_filter_info_server", "loopback_simulator", "rviz2", "robot_state_publisher",
    }
)  # fmt: skip
"""Nodes that simscen replaces by the scenario, its map, and its zones."""


def class_of(plugin: object) -> str:
    """Return the class of a plugin, e.g. "NavfnPlanner" for `package::NavfnPlanner` or `package/NavfnPlanner`."""
    return str(plugin).replace("/", "::").rpartition("::")[2]


StackKeys = tuple[str, ...]
"""Keys of a value under `stack`, e.g. ("controller", "type")."""
Parameters = Mapping[str, Any]
"""Parameters of one node by dotted name, e.g. `obstacle_layer.scan.topic`."""


@dataclass(frozen=True)
class Translation:
    """Translation of a parameter of a Nav2 node to a value in simscen, to a note for the user, or to both."""

    parameter: str
    """Dotted name of the parameter."""
    keys: StackKeys
    """Keys of the value under `stack`; () if the parameter is ignored."""
    value: Any
    """Value in simscen, or the ignored value."""
    note: str = ""
    """Message of a separate warning. Ignored parameters without a note are listed in one warning for the node."""
    covers: str | None = None
    """Prefix of the names of other parameters that this translation includes; None if there are none."""
    hint: str = "it is ignored"
    """Hint of the separate warning: what simscen does instead."""


def translate_same_name(
    name: str, value: Any, section: StackKeys, kind: str, simscen_name: str = ""
) -> Iterator[Translation]:
    """Yield the translation of a parameter to the same value in `section`; nothing if simscen has no such parameter.

    `kind` is an argument of `simscen_parameters`. `simscen_name` is another name in simscen.
    """
    target = simscen_name or name
    if target in simscen_parameters(kind):
        yield Translation(name, (*section, *target.split(".")), value)


@cache
def simscen_parameters(kind: str) -> frozenset[str]:
    """Return the parameters that simscen has in a section of `stack`, or of a type such as "dwb".

    The name of a nested parameter is dotted: `a.b` is `b` in `a`.
    """
    from simscen.model import controllers, costmaps, localizers, mppi, planners, recovery

    models: dict[str, type[BaseModel]] = {
        "amcl": localizers.Amcl,
        "progress_checker": controllers.ProgressChecker,
        "goal_checker": controllers.SimpleGoalChecker,
        "regulated_pure_pursuit": controllers.RegulatedPurePursuit,
        "dwb": controllers.DynamicWindow,
        "mppi": mppi.Mppi,
        "navfn": planners.Navfn,
        "smac_2d": planners.Smac2d,
        "costmap": costmaps.Costmap,
        "local_costmap": costmaps.LocalCostmap,
        "denoise_layer": costmaps.DenoiseLayer,
        "recovery": recovery.Recovery,
    }
    names = set()
    for name, model_field in models[kind].model_fields.items():
        names.add(name)
        if isinstance(model_field.annotation, type) and issubclass(model_field.annotation, BaseModel):
            names |= {f"{name}.{part}" for part in model_field.annotation.model_fields}
    return frozenset(names)


def strings(value: Any) -> list[str]:
    """Return the items of a list as texts; [] for other values."""
    return [str(item) for item in value] if isinstance(value, list) else []


def parameters_below(parameters: Parameters, name: str) -> Iterator[tuple[str, Any]]:
    """Yield the parameters below `name`, with names relative to `name`; nothing if `name` is ""."""
    for key, value in parameters.items():
        if name and key.startswith(f"{name}."):
            yield key.removeprefix(f"{name}."), value
