"""What of Nav2 is called otherwise in the reference stack, and what is not there."""

from collections.abc import Mapping

CONTROLLERS = {
    "RegulatedPurePursuitController": "regulated_pure_pursuit",
    "DWBLocalPlanner": "dwb",
    "MPPIController": "mppi",
}
PLANNERS = {"NavfnPlanner": "navfn", "SmacPlanner2D": "smac_2d"}
MOTION_MODELS = {"DifferentialMotionModel": "differential", "OmniMotionModel": "omni"}
SAID_OTHERWISE: Mapping[tuple[str, str], str] = {
    ("regulated_pure_pursuit", "max_linear_vel"): "desired_linear_vel",
    **{
        ("dwb", f"{critic}.scale"): f"{name}_scale"
        for critic, name in (
            ("BaseObstacle", "base_obstacle"), ("PathAlign", "path_align"), ("PathDist", "path_dist"),
            ("GoalAlign", "goal_align"), ("GoalDist", "goal_dist"), ("RotateToGoal", "rotate_to_goal"),
            ("Twirling", "twirling"),
        )
    },
    ("dwb", "PathAlign.forward_point_distance"): "forward_point_distance",
    ("dwb", "RotateToGoal.slowing_factor"): "slowing_factor",
    ("dwb", "Oscillation.oscillation_reset_dist"): "oscillation_reset_dist",
    ("dwb", "Oscillation.oscillation_reset_angle"): "oscillation_reset_angle",
    ("dwb", "Oscillation.x_only_threshold"): "x_only_threshold",
}  # fmt: skip
"""(Our type, Nav2's name) → our name, where that is another."""
NOTHING_HERE = (
    "frame", "topic", "plugin", "plugins", "use_sim_time", "transform_tolerance", "tf_broadcast", "introspection_mode",
    "publish", "visualize", "random_seed", "save_pose_rate", "bond", "qos",
    "map_subscribe_transient_local", "robot_radius",
    "footprint", "rolling_window", "always_send_full_costmap", "use_realtime_priority", "use_composition", "data_type",
    "critics", "filters", "observation_sources", "clearing", "marking", "expected_planner_frequency",
    "smoothing_frequency", "feedback", "odom_duration", "velocity_timeout",
)  # fmt: skip
"""Part of the names of parameters that mean nothing in a simulation: frames and topics, transport, what is shown; and
what the robot is, which comes from its own file."""
WITHOUT = frozenset(
    {
        "map_server", "map_saver", "lifecycle_manager", "lifecycle_manager_navigation",
        "lifecycle_manager_localization",
        "keepout_filter_mask_server", "keepout_costmap_filter_info_server", "speed_filter_mask_server",
        "speed_costmap_filter_info_server", "loopback_simulator", "rviz2", "robot_state_publisher",
    }
)  # fmt: skip
"""Nodes whose part the scenario, its map and its zones have."""
