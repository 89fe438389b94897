"""Tests of stack parameters: given values, values of a profile, and defaults."""

import pytest

from simscen.model.localizers import GroundTruth
from simscen.model.profiles import NAV2, apply_profile, merge_parameters
from simscen.model.stack import ADVANCED_BUILDER, REFERENCE_BUILDER, StackSpec

NAV2_PARAMS = {
    # nav2_bringup/params/nav2_params.yaml, August 2026, with the names of simscen
    "localizer.laser_model_type": "likelihood_field", "localizer.max_beams": 60, "localizer.max_particles": 2000,
    "localizer.alpha1": 0.2, "localizer.z_hit": 0.5, "localizer.sigma_hit": 0.2, "localizer.update_min_a": 0.2,
    "controller_frequency": 20.0, "failure_tolerance": 0.3,
    "min_x_velocity_threshold": 0.001, "min_theta_velocity_threshold": 0.001,
    "progress_checker.required_movement_radius": 0.5, "progress_checker.movement_time_allowance": 10.0,
    "goal_checker.xy_goal_tolerance": 0.25, "goal_checker.yaw_goal_tolerance": 0.25, "goal_checker.stateful": True,
    "controller.type": "mppi", "controller.time_steps": 56, "controller.model_dt": 0.05, "controller.batch_size": 2000,
    "controller.vx_max": 0.5, "controller.vx_min": -0.35, "controller.wz_max": 1.9, "controller.az_max": 3.5,
    "controller.temperature": 0.3, "controller.gamma": 0.015, "controller.CostCritic.cost_weight": 3.81,
    "controller.CostCritic.consider_footprint": False, "controller.PathAlignCritic.cost_weight": 14.0,
    "controller.GoalCritic.threshold_to_consider": 1.4, "controller.TrajectoryValidator.consider_footprint": False,
    "local_costmap.update_frequency": 5.0, "local_costmap.width": 3.0, "local_costmap.resolution": 0.05,
    "costmap.update_frequency": 1.0, "costmap.track_unknown_space": True, "costmap.obstacle_max_range": 2.5,
    "costmap.raytrace_max_range": 3.0, "costmap.inflation_radius": 0.7, "costmap.cost_scaling_factor": 3.0,
    "costmap.inf_is_valid": False,
    "planner.type": "navfn", "planner.tolerance": 0.5, "planner.allow_unknown": True,
    "recovery.behaviors": ["clear_costmap", "spin", "wait", "backup"], "recovery.retries_since_progress": False,
    "recovery.simulate_ahead_time": 2.0, "recovery.max_rotational_vel": 1.0,
    "velocity_smoother.max_velocity": 0.5, "velocity_smoother.max_angular_velocity": 2.0,
    "velocity_smoother.max_accel": 3.0, "velocity_smoother.max_decel": 3.0, "velocity_smoother.max_angular_accel": 3.5,
    "collision_monitor.source_timeout": 1.0, "collision_monitor.time_before_collision": 1.2,
    "collision_monitor.min_points": 6,
    # its default behavior tree
    "planner.replanning": "rate", "recovery.number_of_retries": 6, "recovery.spin_dist": 1.57,
    "recovery.wait_duration": 5.0, "recovery.backup_dist": 0.30, "recovery.backup_speed": 0.15,
    "recovery.planner_codes": ["PLANNER_UNKNOWN", "PLANNER_TIMEOUT", "NO_VALID_PATH"],
}  # fmt: skip


def parameter(spec: object, path: str) -> object:
    for name in path.split("."):
        spec = getattr(spec, name)
    return spec


@pytest.mark.parametrize("path", NAV2_PARAMS)
def test_nav2_profile_has_the_values_of_nav2(path: str) -> None:
    assert parameter(StackSpec(profile="nav2"), path) == NAV2_PARAMS[path]


def test_given_parameters_override_the_profile_and_the_profile_overrides_defaults() -> None:
    spec = StackSpec(profile="nav2", collision_monitor={"min_points": 2}, controller={"type": "mppi", "vx_max": 1.0})
    assert (spec.collision_monitor.min_points, spec.collision_monitor.source_timeout) == (2, 1.0)
    assert (spec.controller.vx_max, spec.controller.batch_size) == (1.0, 2000)
    assert StackSpec().collision_monitor.source_timeout != 1.0


def test_other_types_get_the_profile_values_of_their_type() -> None:
    spec = StackSpec(profile="nav2", controller={"type": "dwb"}, planner={"type": "smac_2d"}, localizer={"type": "ekf"})
    assert (spec.controller.type, spec.controller.max_vel_x, spec.controller.prune_distance) == ("dwb", 0.5, 2.0)
    assert (spec.planner.type, spec.planner.replanning, spec.planner.tolerance) == ("smac_2d", "rate", 0.125)
    assert spec.localizer == StackSpec(localizer={"type": "ekf"}).localizer


def test_validated_specification_is_unchanged() -> None:
    output = GroundTruth(type="ground_truth")
    assert StackSpec(profile="nav2", localizer=output).localizer is output


def test_parameters_without_a_profile_are_unchanged() -> None:
    assert apply_profile({"controller": {"type": "dwb"}}) == {"controller": {"type": "dwb"}}
    assert StackSpec(profile="reference") == StackSpec()


def test_advanced_parameters_select_the_advanced_builder() -> None:
    assert StackSpec(profile="nav2").builder == REFERENCE_BUILDER
    assert StackSpec(profile="nav2", prediction={"enabled": True}).builder == ADVANCED_BUILDER
    assert StackSpec(profile="nav2", recovery={"clear_entirely": False}).builder == ADVANCED_BUILDER
    assert StackSpec().builder == REFERENCE_BUILDER
    assert StackSpec(profile="advanced").builder == ADVANCED_BUILDER


def test_advanced_profile_selects_the_advanced_components() -> None:
    spec = StackSpec(profile="advanced")
    assert (spec.localizer.type, spec.planner.type, spec.planner.cautious) == (
        "scan_matching_amcl",
        "medial_axis",
        True,
    )
    assert "retrace" in spec.recovery.names and spec.prediction.enabled
    spec_with_types = StackSpec(profile="advanced", planner={"type": "navfn"}, localizer={"type": "amcl"})
    assert (spec_with_types.planner.type, spec_with_types.planner.cautious, spec_with_types.localizer.type) == (
        "navfn",
        True,
        "amcl",
    )


def test_nested_mappings_are_merged() -> None:
    assert merge_parameters({"a": {"b": 1, "c": {"d": 2}}, "e": 3}, {"a": {"c": {"d": 4}}, "e": {"f": 5}}) == {
        "a": {"b": 1, "c": {"d": 4}},
        "e": {"f": 5},
    }


def test_every_value_of_a_profile_is_valid() -> None:
    for section in ("localizer", "planner", "controller", "goal_checker"):
        for kind in NAV2[section]:
            assert parameter(StackSpec(profile="nav2", **{section: {"type": kind}}), f"{section}.type") == kind
