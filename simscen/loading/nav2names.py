"""What of Nav2 is called otherwise in the reference stack, and what is not there."""

from collections.abc import Mapping

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
DWB_CRITICS_OF_NO_WEIGHT = ("Oscillation", "ObstacleFootprint")
"""Those that forbid rather than weigh, and are always asked here."""
MPPI_CRITICS = (
    "ConstraintCritic", "CostCritic", "ObstaclesCritic", "GoalCritic", "GoalAngleCritic", "PathAlignCritic",
    "PathFollowCritic", "PathAngleCritic", "PreferForwardCritic", "TwirlingCritic", "VelocityDeadbandCritic",
)  # fmt: skip
SAID_OTHERWISE: Mapping[tuple[str, str], str] = {
    ("regulated_pure_pursuit", "max_linear_vel"): "desired_linear_vel",
    **{("dwb", f"{critic}.scale"): weight for critic, weight in DWB_CRITICS.items()},
    ("dwb", "PathAlign.forward_point_distance"): "forward_point_distance",
    ("dwb", "RotateToGoal.slowing_factor"): "slowing_factor",
    ("dwb", "Oscillation.oscillation_reset_dist"): "oscillation_reset_dist",
    ("dwb", "Oscillation.oscillation_reset_angle"): "oscillation_reset_angle",
    ("dwb", "Oscillation.x_only_threshold"): "x_only_threshold",
}
"""(Our type, Nav2's name) → our name, where that is another."""
NOTHING_HERE = frozenset(
    {
        "tf_broadcast", "save_pose_rate", "random_seed", "map_subscribe_transient_local",
        "always_send_full_costmap", "use_composition", "data_type", "type", "critics", "filters",
        "observation_sources", "expected_planner_frequency", "expected_update_rate", "smoothing_frequency",
        "odom_duration", "velocity_timeout", "stop_pub_timeout", "costmap_update_timeout", "first_map_only",
        "always_reset_initial_pose", "polygons", "controller_plugin_types",
    }
)  # fmt: skip
"""Parameters that mean nothing in a simulation: transport, what is shown, lists of what follows."""
PARTS_OF_NOTHING_HERE = (
    "frame", "topic", "plugin", "use_sim_time", "transform_t", "introspection_mode", "publish", "visualize", "bond",
    "qos", "realtime_priority", "stamp", "transport",
)  # fmt: skip
"""Those that have one of these in their names: frames and topics, transport, what is shown."""
AS_HERE: Mapping[str, tuple[object, ...]] = {
    "enabled": (True,), "marking": (True,), "clearing": (True,), "use_astar": (False,), "scale_velocities": (False,),
    "feedback": ("OPEN_LOOP",), "base_shift_correction": (True,), "deadband_velocity": ([0.0, 0.0, 0.0],),
    "combination_method": (1,), "footprint_clearing_enabled": (True,),
}  # fmt: skip
"""Parameters that are not here, with the values that say what is done here anyway."""
OF_THE_SCENARIO: Mapping[str, str] = {
    **dict.fromkeys(("footprint", "robot_radius"), "the robot's file says how large it is"),
    **dict.fromkeys(("initial_pose", "set_initial_pose"), "the scenario says where the robot begins"),
}
"""Parameters that something other than the stack says here."""
CALLED_BEFORE = {"recoveries_server": "behavior_server"}
"""What nodes were called before Humble."""
WITHOUT = frozenset(
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
