"""Tables and types of the translation from Nav2 parameters to parameters of the reference stack."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

CONTROLLERS = {
    "RegulatedPurePursuitController": "regulated_pure_pursuit",
    "DWBLocalPlanner": "dwb",
    "MPPIController": "mppi",
}
PLANNERS = {"NavfnPlanner": "navfn", "SmacPlanner2D": "smac_2d"}
MOTION_MODELS = {
    "DifferentialMotionModel": "differential", "OmniMotionModel": "omni",
    "differential": "differential", "omnidirectional": "omni",
}  # fmt: skip
"""Motion models of AMCL; the last two names are from before Humble."""
DWB_CRITICS = {
    "BaseObstacle": "base_obstacle_scale", "PathAlign": "path_align_scale", "PathDist": "path_dist_scale",
    "GoalAlign": "goal_align_scale", "GoalDist": "goal_dist_scale", "RotateToGoal": "rotate_to_goal_scale",
    "Twirling": "twirling_scale",
}  # fmt: skip
"""DWB critics, and the parameters for their weights."""
DWB_CRITICS_WITHOUT_WEIGHT = ("Oscillation", "ObstacleFootprint")
"""DWB critics that reject trajectories instead of weighting them; they are always active."""
MPPI_CRITICS = (
    "ConstraintCritic", "CostCritic", "ObstaclesCritic", "GoalCritic", "GoalAngleCritic", "PathAlignCritic",
    "PathFollowCritic", "PathAngleCritic", "PreferForwardCritic", "TwirlingCritic", "VelocityDeadbandCritic",
)  # fmt: skip
RENAMED_PARAMETERS: Mapping[tuple[str, str], str] = {
    ("regulated_pure_pursuit", "max_linear_vel"): "desired_linear_vel",
    **{("dwb", f"{critic}.scale"): weight for critic, weight in DWB_CRITICS.items()},
    ("dwb", "PathAlign.forward_point_distance"): "forward_point_distance",
    ("dwb", "RotateToGoal.slowing_factor"): "slowing_factor",
    ("dwb", "Oscillation.oscillation_reset_dist"): "oscillation_reset_dist",
    ("dwb", "Oscillation.oscillation_reset_angle"): "oscillation_reset_angle",
    ("dwb", "Oscillation.x_only_threshold"): "x_only_threshold",
}
"""Parameters with different names: (type in simscen, name in Nav2) → name in simscen."""
IGNORED_PARAMETERS = frozenset(
    {
        "tf_broadcast", "save_pose_rate", "random_seed", "map_subscribe_transient_local",
        "always_send_full_costmap", "use_composition", "data_type", "type", "critics", "filters",
        "observation_sources", "expected_planner_frequency", "expected_update_rate", "smoothing_frequency",
        "odom_duration", "velocity_timeout", "stop_pub_timeout", "costmap_update_timeout", "first_map_only",
        "always_reset_initial_pose", "polygons", "controller_plugin_types",
    }
)  # fmt: skip
"""Parameters that have no effect in simulation: transport, visualization, lists of plugins."""
IGNORED_NAME_PARTS = (
    "frame", "topic", "plugin", "use_sim_time", "transform_t", "introspection_mode", "publish", "visualize", "bond",
    "qos", "realtime_priority", "stamp", "transport",
)  # fmt: skip
"""Parameters whose names contain one of these have no effect in simulation either."""
EQUIVALENT_VALUES: Mapping[str, tuple[object, ...]] = {
    "enabled": (True,), "marking": (True,), "clearing": (True,), "use_astar": (False,), "scale_velocities": (False,),
    "feedback": ("OPEN_LOOP",), "base_shift_correction": (True,), "deadband_velocity": ([0.0, 0.0, 0.0],),
    "combination_method": (1,), "footprint_clearing_enabled": (True,),
}  # fmt: skip
"""Parameters that simscen does not have, with the values that match its behavior."""
SCENARIO_PARAMETERS: Mapping[str, str] = {
    **dict.fromkeys(("footprint", "robot_radius"), "the robot file defines the size of the robot"),
    **dict.fromkeys(("initial_pose", "set_initial_pose"), "the scenario defines the initial pose"),
}
"""Parameters that the scenario or the robot file defines, and the reason given to users."""
OLD_NODE_NAMES = {"recoveries_server": "behavior_server"}
"""Names of nodes before Humble."""
IGNORED_NODES = frozenset(
    {
        "map_server", "map_saver", "lifecycle_manager", "lifecycle_manager_navigation",
        "lifecycle_manager_localization", "filter_mask_server", "costmap_filter_info_server",
        "keepout_filter_mask_server", "keepout_costmap_filter_info_server", "speed_filter_mask_server",
        "speed_costmap_filter_info_server", "loopback_simulator", "rviz2", "robot_state_publisher",
    }
)  # fmt: skip
"""Nodes that the scenario, its map and its zones replace."""


def class_of(plugin: object) -> str:
    """Return the class in a plugin name such as `nav2_navfn_planner::NavfnPlanner` (or with `/`)."""
    return str(plugin).replace("/", "::").rpartition("::")[2]


Path = tuple[str, ...]
"""Keys below `stack:`."""
Parameters = Mapping[str, Any]
"""Parameters of one node by dotted name, e.g. `obstacle_layer.scan.topic`."""
Known = Mapping[str, Sequence[str]]
"""Parameters of simscen by section, or by the type in a section; `a.b` is `b` in the mapping `a`."""


@dataclass(frozen=True)
class Translation:
    """Nav2 parameter, and the keys and value below `stack:` that it becomes.

    `note` and `hint` are for the user. A parameter with neither path nor note already matches the behavior of simscen.
    Parameters whose names begin with `covers` are treated the same way, without notes of their own.
    """

    node: str
    parameter: str
    path: Path
    value: Any
    note: str = ""
    covers: str | None = None
    hint: str = "it is ignored"


def translate_same_name(
    node: str, name: str, value: Any, section: Path, known: Sequence[str], simscen_name: str = ""
) -> Iterator[Translation]:
    """Yield the translation of a parameter that exists in simscen under the same name, or under `simscen_name`."""
    target = simscen_name or name
    if target in known:
        yield Translation(node, name, (*section, *target.split(".")), value)


def strings(value: Any) -> list[str]:
    """Return the items of a list as text; an empty list for anything else."""
    return [str(one) for one in value] if isinstance(value, list) else []


def parameters_below(parameters: Parameters, name: str) -> Iterator[tuple[str, Any]]:
    """Yield the parameters below a name, with names relative to it."""
    for key, value in parameters.items():
        if name and key.startswith(f"{name}."):
            yield key.removeprefix(f"{name}."), value
