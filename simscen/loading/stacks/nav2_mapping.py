"""Tables and types for the translation of Nav2 parameters to parameters of the reference stack (see nav2_nodes.py)."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

CONTROLLERS = {
    "RegulatedPurePursuitController": "regulated_pure_pursuit",
    "DWBLocalPlanner": "dwb",
    "MPPIController": "mppi",
}
"""Class of a controller plugin → type in simscen."""
PLANNERS = {"NavfnPlanner": "navfn", "SmacPlanner2D": "smac_2d"}
"""Class of a planner plugin → type in simscen."""
MOTION_MODELS = {
    "DifferentialMotionModel": "differential", "OmniMotionModel": "omni",
    "differential": "differential", "omnidirectional": "omni",
}  # fmt: skip
"""Motion model of AMCL → name in simscen; the last two are names from before Humble."""
DWB_CRITICS = {
    "BaseObstacle": "base_obstacle_scale", "PathAlign": "path_align_scale", "PathDist": "path_dist_scale",
    "GoalAlign": "goal_align_scale", "GoalDist": "goal_dist_scale", "RotateToGoal": "rotate_to_goal_scale",
    "Twirling": "twirling_scale",
}  # fmt: skip
"""DWB critic → parameter for its weight in simscen."""
DWB_CRITICS_WITHOUT_WEIGHT = ("Oscillation", "ObstacleFootprint")
"""DWB critics that reject trajectories instead of rating them. They are always active in simscen."""
MPPI_CRITICS = (
    "ConstraintCritic", "CostCritic", "ObstaclesCritic", "GoalCritic", "GoalAngleCritic", "PathAlignCritic",
    "PathFollowCritic", "PathAngleCritic", "PreferForwardCritic", "TwirlingCritic", "VelocityDeadbandCritic",
)  # fmt: skip
"""MPPI critics that simscen has, under the same names."""
RENAMED_PARAMETERS: Mapping[tuple[str, str], str] = {
    ("regulated_pure_pursuit", "max_linear_vel"): "desired_linear_vel",
    **{("dwb", f"{critic}.scale"): weight for critic, weight in DWB_CRITICS.items()},
    ("dwb", "PathAlign.forward_point_distance"): "forward_point_distance",
    ("dwb", "RotateToGoal.slowing_factor"): "slowing_factor",
    ("dwb", "Oscillation.oscillation_reset_dist"): "oscillation_reset_dist",
    ("dwb", "Oscillation.oscillation_reset_angle"): "oscillation_reset_angle",
    ("dwb", "Oscillation.x_only_threshold"): "x_only_threshold",
}
"""Parameters with other names in simscen: (type in simscen, name in Nav2) → name in simscen."""
IGNORED_PARAMETERS = frozenset(
    {
        "tf_broadcast", "save_pose_rate", "random_seed", "map_subscribe_transient_local",
        "always_send_full_costmap", "use_composition", "data_type", "type", "critics", "filters",
        "observation_sources", "expected_planner_frequency", "expected_update_rate", "smoothing_frequency",
        "odom_duration", "velocity_timeout", "stop_pub_timeout", "costmap_update_timeout", "first_map_only",
        "always_reset_initial_pose", "polygons", "controller_plugin_types",
    }
)  # fmt: skip
"""Parameters that need no translation, because they have no effect in simulation or are read with other ones."""
IGNORED_NAME_PARTS = (
    "frame", "topic", "plugin", "use_sim_time", "transform_t", "introspection_mode", "publish", "visualize", "bond",
    "qos", "realtime_priority", "stamp", "transport",
)  # fmt: skip
"""Parameters whose names contain one of these texts have no effect in simulation either."""
EQUIVALENT_VALUES: Mapping[str, tuple[object, ...]] = {
    "enabled": (True,), "marking": (True,), "clearing": (True,), "use_astar": (False,), "scale_velocities": (False,),
    "feedback": ("OPEN_LOOP",), "base_shift_correction": (True,), "deadband_velocity": ([0.0, 0.0, 0.0],),
    "combination_method": (1,), "footprint_clearing_enabled": (True,),
}  # fmt: skip
"""Parameter that simscen does not have → values for which Nav2 behaves like simscen."""
SCENARIO_PARAMETERS: Mapping[str, str] = {
    **dict.fromkeys(("footprint", "robot_radius"), "the robot file defines the size of the robot"),
    **dict.fromkeys(("initial_pose", "set_initial_pose"), "the scenario defines the initial pose"),
}
"""Parameter that is ignored because the scenario or the robot file defines it → message for users."""
OLD_NODE_NAMES = {"recoveries_server": "behavior_server"}
"""Name of a node before Humble → its present name."""
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
    """Return the class of a plugin, without the package: "NavfnPlanner" for `nav2_navfn_planner::NavfnPlanner`.

    Older files have `/` instead of `::`.
    """
    return str(plugin).replace("/", "::").rpartition("::")[2]


StackKeys = tuple[str, ...]
"""Keys that lead to a value below `stack:`."""
Parameters = Mapping[str, Any]
"""Parameters of one node by dotted name, e.g. `obstacle_layer.scan.topic`."""
KnownParameters = Mapping[str, Sequence[str]]
"""Names of simscen's parameters, by the section of `stack:` or by the type of the thing that a section describes.

`a.b` is the parameter `b` in the mapping `a`.
"""


@dataclass(frozen=True)
class Translation:
    """What a parameter of a Nav2 node becomes: a value in simscen, a note that it is ignored, or nothing."""

    node: str
    parameter: str
    """Dotted name."""
    keys: StackKeys
    """Keys of the value below `stack:`; () if the parameter is ignored."""
    value: Any
    """Value in simscen, or the ignored value."""
    note: str = ""
    """Message for the user; "" for none."""
    covers: str | None = None
    """Beginning of the names of further parameters that this translation is for, so that they need none; or None."""
    hint: str = "it is ignored"
    """Hint for the user, which is shown with the note."""


def translate_same_name(
    node: str, name: str, value: Any, section: StackKeys, known: Sequence[str], simscen_name: str = ""
) -> Iterator[Translation]:
    """Yield the translation of a parameter if `known`, the parameters of a section, contains its name.

    `simscen_name` is its name in simscen; "" for the same name as in Nav2.
    """
    target = simscen_name or name
    if target in known:
        yield Translation(node, name, (*section, *target.split(".")), value)


def strings(value: Any) -> list[str]:
    """Return the items of a list as texts; an empty list for anything else."""
    return [str(one) for one in value] if isinstance(value, list) else []


def parameters_below(parameters: Parameters, name: str) -> Iterator[tuple[str, Any]]:
    """Yield the name (relative to `name`) and the value of each parameter below `name`; nothing if `name` is ""."""
    for key, value in parameters.items():
        if name and key.startswith(f"{name}."):
            yield key.removeprefix(f"{name}."), value
