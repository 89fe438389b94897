"""What of Nav2 is called otherwise in the reference stack, and what is not there."""

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
"""AMCL's, the latter two as they were called before Humble."""
DWB_CRITICS = {
    "BaseObstacle": "base_obstacle_scale", "PathAlign": "path_align_scale", "PathDist": "path_dist_scale",
    "GoalAlign": "goal_align_scale", "GoalDist": "goal_dist_scale", "RotateToGoal": "rotate_to_goal_scale",
    "Twirling": "twirling_scale",
}  # fmt: skip
"""DWB's critics by what weighs them here."""
DWB_CRITICS_WITHOUT_WEIGHT = ("Oscillation", "ObstacleFootprint")
"""Those that forbid rather than weigh, and are always asked here."""
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
"""(Our type, Nav2's name) → our name, where that is another."""
IGNORED_PARAMETERS = frozenset(
    {
        "tf_broadcast", "save_pose_rate", "random_seed", "map_subscribe_transient_local",
        "always_send_full_costmap", "use_composition", "data_type", "type", "critics", "filters",
        "observation_sources", "expected_planner_frequency", "expected_update_rate", "smoothing_frequency",
        "odom_duration", "velocity_timeout", "stop_pub_timeout", "costmap_update_timeout", "first_map_only",
        "always_reset_initial_pose", "polygons", "controller_plugin_types",
    }
)  # fmt: skip
"""Parameters that mean nothing in a simulation: transport, what is shown, lists of what follows."""
IGNORED_NAME_PARTS = (
    "frame", "topic", "plugin", "use_sim_time", "transform_t", "introspection_mode", "publish", "visualize", "bond",
    "qos", "realtime_priority", "stamp", "transport",
)  # fmt: skip
"""Those that have one of these in their names: frames and topics, transport, what is shown."""
EQUIVALENT_VALUES: Mapping[str, tuple[object, ...]] = {
    "enabled": (True,), "marking": (True,), "clearing": (True,), "use_astar": (False,), "scale_velocities": (False,),
    "feedback": ("OPEN_LOOP",), "base_shift_correction": (True,), "deadband_velocity": ([0.0, 0.0, 0.0],),
    "combination_method": (1,), "footprint_clearing_enabled": (True,),
}  # fmt: skip
"""Parameters that are not here, with the values that say what is done here anyway."""
SCENARIO_PARAMETERS: Mapping[str, str] = {
    **dict.fromkeys(("footprint", "robot_radius"), "the robot's file says how large it is"),
    **dict.fromkeys(("initial_pose", "set_initial_pose"), "the scenario says where the robot begins"),
}
"""Parameters that something other than the stack says here."""
OLD_NODE_NAMES = {"recoveries_server": "behavior_server"}
"""What nodes were called before Humble."""
IGNORED_NODES = frozenset(
    {
        "map_server", "map_saver", "lifecycle_manager", "lifecycle_manager_navigation",
        "lifecycle_manager_localization", "filter_mask_server", "costmap_filter_info_server",
        "keepout_filter_mask_server", "keepout_costmap_filter_info_server", "speed_filter_mask_server",
        "speed_costmap_filter_info_server", "loopback_simulator", "rviz2", "robot_state_publisher",
    }
)  # fmt: skip
"""Nodes whose part the scenario, its map and its zones have."""


def class_of(plugin: object) -> str:
    """`nav2_navfn_planner::NavfnPlanner` and `nav2_navfn_planner/NavfnPlanner` → NavfnPlanner."""
    return str(plugin).replace("/", "::").rpartition("::")[2]


Path = tuple[str, ...]
"""Keys below `stack:`."""
Parameters = Mapping[str, Any]
"""`obstacle_layer.scan.topic` → value, of one node."""
Known = Mapping[str, Sequence[str]]
"""Our parameters by section, or by the type of what is in it; `a.b` is `b` in the mapping `a`."""


@dataclass(frozen=True)
class Translation:
    """A parameter of Nav2, and where it belongs in a stack.

    `why` is what there is to tell of it; without a path and a reason it is as it is here, and no word is lost on it.
    What begins with `covers` has the same fate.
    """

    node: str
    parameter: str
    path: Path
    value: Any
    why: str = ""
    covers: str | None = None


def translate_same_name(
    node: str, name: str, value: Any, section: Path, known: Sequence[str], own: str = ""
) -> Iterator[Translation]:
    """A parameter that is called here as there, or `own`, if there is one; `a.b` is `b` in the mapping `a`."""
    here = own or name
    if here in known:
        yield Translation(node, name, (*section, *here.split(".")), value)


def strings(value: Any) -> list[str]:
    """The names in a list, of which there are none where it is no list."""
    return [str(one) for one in value] if isinstance(value, list) else []


def parameters_below(parameters: Parameters, name: str) -> Iterator[tuple[str, Any]]:
    """What stands below a name, called from there."""
    for key, value in parameters.items():
        if name and key.startswith(f"{name}."):
            yield key.removeprefix(f"{name}."), value
