"""Controllers of a Nav2 parameter file: `stack: {nav2_params: FILE}`."""

from pathlib import Path

import pytest

from simscen.core.errors import InvalidInput
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import load_scenario

SCENARIO = """\
simscen: 1
world: {simscen: 1, walls: [{name: room, points: [[0, 0], [6, 0], [6, 6], [0, 6], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 5}}]
stack: {nav2_params: nav2.yaml}
pass: [{goals_reached: {}}]
"""
CONTROLLER = """\
controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath: {{plugin: "{plugin}", {parameters}}}
"""
DWB, MPPI = "dwb_core::DWBLocalPlanner", "nav2_mppi_controller::MPPIController"


def loaded(folder: Path, nav2_params: str) -> LoadedScenario:
    (folder / "nav2.yaml").write_text(nav2_params)
    (folder / "a.scenario.yaml").write_text(SCENARIO)
    return load_scenario(folder / "a.scenario.yaml", folder)


def with_controller(folder: Path, plugin: str, parameters: str) -> LoadedScenario:
    """Return a scenario whose Nav2 file has a controller with these parameters."""
    return loaded(folder, CONTROLLER.format(plugin=plugin, parameters=parameters))


def test_a_rotation_shim_leaves_its_controller_to_drive_alone(tmp_path: Path) -> None:
    shimmed = """\
controller_server:
  ros__parameters:
    FollowPath:
      plugin: "nav2_rotation_shim_controller::RotationShimController"
      primary_controller:
        plugin: "nav2_mppi_controller::MPPIController"
        motion_model: "Ackermann"
        AckermannConstraints: {min_turning_r: 0.6}
        critics: ["CostCritic", "GoalCritic", "MineCritic"]
"""
    found = loaded(tmp_path, shimmed)
    drives = found.spec.stack.controller
    assert (drives.type, drives.motion_model, drives.min_turning_r) == ("mppi", "Ackermann", 0.6)
    assert drives.critics == ["CostCritic", "GoalCritic"]
    assert [note.line for note in found.notes] == [6, 9]


def test_mppis_motion_model_is_found_by_the_name_of_its_plugin(tmp_path: Path) -> None:
    params = """\
controller_server:
  ros__parameters:
    controller_plugins: ["FollowPath"]
    FollowPath:
      plugin: "nav2_mppi_controller::MPPIController"
      motion_model: "any"
      any: {plugin: "mppi::OmniMotionModel"}
      CostCritic: {cost_weight: 2.5}
"""
    stack = loaded(tmp_path, params).spec.stack
    assert (stack.controller.motion_model, stack.controller.CostCritic.cost_weight) == ("Omni", 2.5)
    assert stack.controller.CostCritic.consider_footprint is False


def test_negative_speed_limits_of_dwb_are_off(tmp_path: Path) -> None:
    limits = "min_speed_xy: -0.26, max_speed_xy: -1, min_speed_theta: -1.0"
    found = with_controller(tmp_path, DWB, limits)
    dwb = found.spec.stack.controller
    assert (dwb.min_speed_xy, dwb.max_speed_xy, dwb.min_speed_theta) == (0.0, None, 0.0)
    assert not found.notes


@pytest.mark.parametrize("model", ["", "motion_model: DiffDrive, ", "motion_model: Ackermann, "])
def test_zeros_of_mppi_for_sideways_motion_are_ignored_without_sideways_motion(tmp_path: Path, model: str) -> None:
    parameters = f"{model}vy_std: 0.0, ay_max: 0.0, ay_min: 0"
    found = with_controller(tmp_path, MPPI, parameters)
    mppi = found.spec.stack.controller
    assert (mppi.vy_std, mppi.ay_max, mppi.ay_min) == (0.2, 3.0, -3.0)  # defaults of Nav2
    assert not found.notes


@pytest.mark.parametrize("parameter", ["vy_std: 0.0", "ay_max: 0.0", "ay_min: 0"])
def test_zeros_of_mppi_for_sideways_motion_are_refused_for_the_omni_model(tmp_path: Path, parameter: str) -> None:
    parameters = f"motion_model: Omni, {parameter}"
    with pytest.raises(InvalidInput) as wrong:
        with_controller(tmp_path, MPPI, parameters)
    assert [(problem.path, problem.line) for problem in wrong.value.problems] == [("nav2.yaml", 4)]


def test_parameters_of_dwb_without_an_effect_are_not_reported(tmp_path: Path) -> None:
    """DWB stops the evaluation of a trajectory early only if another one is better."""
    no_effect = (
        "stateful: true, short_circuit_trajectory_evaluation: true, debug_trajectory_details: true, "
        "RotateToGoal.lookahead_time: -1.0, PathAlign.forward_point_distance: 0.3, "
        "GoalAlign.forward_point_distance: 0.3"
    )
    found = with_controller(tmp_path, DWB, no_effect)
    assert found.spec.stack.controller.forward_point_distance == 0.3
    assert not found.notes


@pytest.mark.parametrize("others", ["", "PathAlign.forward_point_distance: 0.2, "])
def test_another_front_point_for_the_alignment_with_the_goal_is_reported(tmp_path: Path, others: str) -> None:
    found = with_controller(tmp_path, DWB, f"{others}GoalAlign.forward_point_distance: 0.3")
    assert found.spec.stack.controller.forward_point_distance == (0.2 if others else 0.1)
    name = "FollowPath.GoalAlign.forward_point_distance"
    assert [note.message for note in found.notes] == [
        f"controller_server: `{name}`: simscen uses the value of PathAlign"
    ]


def test_velocity_thresholds_are_read(tmp_path: Path) -> None:
    thresholds = "min_x_velocity_threshold: 0.01, min_y_velocity_threshold: 0.3, min_theta_velocity_threshold: 0.02"
    stack = loaded(tmp_path, f"controller_server: {{ros__parameters: {{{thresholds}}}}}\n").spec.stack
    names = ("min_x_velocity_threshold", "min_y_velocity_threshold", "min_theta_velocity_threshold")
    assert [getattr(stack, name) for name in names] == [0.01, 0.3, 0.02]
