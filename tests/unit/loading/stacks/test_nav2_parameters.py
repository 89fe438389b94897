"""`stack: {nav2_params: FILE}`: a user's own parameter file of Nav2."""

from pathlib import Path

import pytest

from simscen.core.errors import InvalidInput
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import load_scenario
from simscen.loading.stacks.stack_files import load_stack_file

SCENARIO = """\
simscen: 1
world: {simscen: 1, walls: [{name: room, points: [[0, 0], [6, 0], [6, 6], [0, 6], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 5}}]
pass: [{goals_reached: {}}]
"""
PARAMS = """\
amcl:
  ros__parameters:
    robot_model_type: "nav2_amcl::OmniMotionModel"
    alpha1: 0.11
    scan_topic: scan
    save_pose_rate: 0.5
controller_server:
  ros__parameters:
    controller_frequency: 30.0
    controller_plugins: ["FollowPath"]
    goal_checker_plugins: ["precise"]
    precise: {plugin: "nav2_controller::SimpleGoalChecker", xy_goal_tolerance: 0.1, path_length_tolerance: 1.0}
    FollowPath:
      plugin: "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
      max_linear_vel: 0.4
      lookahead_dist: 0.7
      min_distance_to_obstacle: 0.1
planner_server:
  ros__parameters:
    planner_plugins: ["GridBased"]
    GridBased: {plugin: "nav2_smac_planner::SmacPlanner2D", tolerance: 0.3}
global_costmap:
  global_costmap:
    ros__parameters:
      update_frequency: 2.0
      plugins: ["static_layer", "front", "inflation_layer"]
      front: {plugin: "nav2_costmap_2d::ObstacleLayer", scan: {obstacle_max_range: 4.0, topic: /scan}}
      inflation_layer: {plugin: "nav2_costmap_2d::InflationLayer", inflation_radius: 0.4}
local_costmap:
  local_costmap:
    ros__parameters: {width: 5, height: 4}
velocity_smoother:
  ros__parameters: {max_velocity: [0.3, 0.0, 1.0], max_decel: [-2.0, 0.0, -3.0]}
collision_monitor:
  ros__parameters:
    polygons: [Stop, Approach]
    Stop: {action_type: stop}
    Approach: {action_type: approach, time_before_collision: 0.9, min_points: 3}
behavior_server:
  ros__parameters: {simulate_ahead_time: 1.5, cycle_frequency: 10.0}
docking_server:
  ros__parameters: {controller_frequency: 50.0}
"""


def loaded(folder: Path, stack: str, params: str = PARAMS, rest: str = "") -> LoadedScenario:
    (folder / "nav2.yaml").write_text(params)
    file = folder / "a.scenario.yaml"
    file.write_text(f"{SCENARIO}{stack}\n{rest}")
    return load_scenario(file, folder)


def test_nav2_file_overrides_nav2_defaults(tmp_path: Path) -> None:
    stack = loaded(tmp_path, "stack: {nav2_params: nav2.yaml}").spec.stack
    assert (stack.localizer.robot_model, stack.localizer.alpha1, stack.localizer.alpha2) == ("omni", 0.11, 0.2)
    assert stack.localizer.laser_model_type == "likelihood_field"
    assert (stack.controller_frequency, stack.goal_checker.xy_goal_tolerance) == (30.0, 0.1)
    assert stack.controller.type == "regulated_pure_pursuit"
    assert (stack.controller.desired_linear_vel, stack.controller.lookahead_dist) == (0.4, 0.7)
    assert (stack.planner.type, stack.planner.tolerance, stack.planner.replanning) == ("smac_2d", 0.3, "rate")
    assert (stack.costmap.update_frequency, stack.costmap.obstacle_max_range) == (2.0, 4.0)
    assert (stack.costmap.inflation_radius, stack.local_costmap.inflation_radius) == (0.4, 0.7)
    assert (stack.local_costmap.width, stack.local_costmap.height) == (5.0, 4.0)
    smoother, monitor = stack.velocity_smoother, stack.collision_monitor
    assert (smoother.max_velocity, smoother.max_angular_velocity, smoother.max_decel) == (0.3, 1.0, 2.0)
    assert (monitor.time_before_collision, monitor.min_points, monitor.source_timeout) == (0.9, 3, 1.0)
    assert stack.recovery.simulate_ahead_time == 1.5


def test_scenario_values_override_the_nav2_file(tmp_path: Path) -> None:
    given = (
        "stack: {nav2_params: nav2.yaml, profile: simscen, controller: {lookahead_dist: 0.5}, failure_tolerance: 1 s}"
    )
    stack = loaded(tmp_path, given).spec.stack
    assert (stack.controller.desired_linear_vel, stack.controller.lookahead_dist) == (0.4, 0.5)
    assert stack.failure_tolerance == 1.0
    assert stack.collision_monitor.source_timeout != 1.0  # of our own profile
    other = loaded(tmp_path, "stack: {nav2_params: nav2.yaml, controller: {type: dwb}}").spec.stack
    assert other.controller.type == "dwb"


NOT_OURS = "precise.path_length_tolerance (12), FollowPath.min_distance_to_obstacle (17)"


def test_parameter_without_counterpart_is_reported_at_its_line(tmp_path: Path) -> None:
    notes = [str(note) for note in loaded(tmp_path, "stack: {nav2_params: nav2.yaml}").notes]
    output = [(note.line, note.message) for note in loaded(tmp_path, "stack: {nav2_params: nav2.yaml}").notes]
    assert all("SC341" in note for note in notes)
    assert output == [
        (12, f"controller_server: simscen has no {NOT_OURS}"),
        (36, "collision_monitor: `polygons`: action_type stop of Stop is not supported"),
        (40, "behavior_server: simscen has no cycle_frequency (40)"),
        (42, "simscen has no node like docking_server"),
    ]


def test_invalid_value_is_reported_at_its_line_of_the_nav2_file(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput) as wrong:
        loaded(tmp_path, "stack: {nav2_params: nav2.yaml}", PARAMS.replace("alpha1: 0.11", "alpha1: -1"))
    assert [(p.path, p.line, p.col) for p in wrong.value.problems] == [("nav2.yaml", 4, 13)]


@pytest.mark.parametrize(
    ("named", "code", "line"), [("none.yaml", "SC023", 6), ("../out.yaml", "SC020", 6), ("a.scenario.yaml", "SC340", 0)]
)
def test_missing_forbidden_or_wrong_file_is_reported(tmp_path: Path, named: str, code: str, line: int) -> None:
    with pytest.raises(InvalidInput) as wrong:
        loaded(tmp_path, f"stack: {{nav2_params: {named}}}")
    assert [(p.code, p.line) for p in wrong.value.problems] == [(code, line)]


def test_unknown_controller_is_replaced_by_the_default_with_a_note(tmp_path: Path) -> None:
    params = PARAMS.replace("nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController", "mine::Graceful")
    found = loaded(tmp_path, "stack: {nav2_params: nav2.yaml}", params)
    assert found.spec.stack.controller.type == "mppi"
    assert "mine::Graceful is not supported; the default controller is used" in "".join(
        note.message for note in found.notes
    )


def test_each_robot_can_have_its_own_file(tmp_path: Path) -> None:
    (tmp_path / "nav2.yaml").write_text(PARAMS)
    file = tmp_path / "two.scenario.yaml"
    file.write_text(
        SCENARIO.replace(
            "robot: {pose: {x: 1, y: 1}}\ngoals: [{pose: {x: 5, y: 5}}]\n",
            "robots:\n  a: {pose: {x: 1, y: 1}, goals: [{pose: {x: 5, y: 5}}], stack: {nav2_params: nav2.yaml}}\n"
            "  b: {pose: {x: 1, y: 5}, goals: [{pose: {x: 5, y: 1}}]}\n",
        )
    )
    found = load_scenario(file, tmp_path)
    assert [found.robots[name].spec.stack.localizer.alpha1 for name in "ab"] == [0.11, 0.2]


def test_a_stack_file_may_take_its_parameters_from_one(tmp_path: Path) -> None:
    (tmp_path / "nav2.yaml").write_text(PARAMS)
    (tmp_path / "ours.stack.yaml").write_text("simscen: 1\nstack: {nav2_params: nav2.yaml}\n")
    choice = load_stack_file("ours", "ours.stack.yaml", tmp_path / "ours.stack.yaml", tmp_path)
    assert choice.section is not None
    assert choice.section.plain["controller"]["desired_linear_vel"] == 0.4
    assert "docking_server" in "".join(note.message for note in choice.notes)


def test_a_stack_file_elsewhere_has_its_parameters_beside_it(tmp_path: Path) -> None:
    (tmp_path / "here").mkdir()
    (tmp_path / "nav2.yaml").write_text(PARAMS)
    (tmp_path / "ours.stack.yaml").write_text("simscen: 1\nstack: {nav2_params: nav2.yaml}\n")
    file = tmp_path / "here" / "a.scenario.yaml"
    file.write_text(SCENARIO)
    choice = load_stack_file("ours", "ours.stack.yaml", tmp_path / "ours.stack.yaml", tmp_path / "here")
    found = load_scenario(file, tmp_path / "here", choice=choice)
    assert found.spec.stack.controller.desired_linear_vel == 0.4
    assert any("docking_server" in note.message for note in found.notes)


HUMBLE = """\
/**:
  ros__parameters: {use_sim_time: true, failure_tolerance: 0.7}
amcl:
  ros__parameters: {robot_model_type: "differential", set_initial_pose: true, max_beams: 30, max_beams: 40}
/bot/controller_server:
  ros__parameters:
    progress_checker_plugin: "slow"
    goal_checker_plugins: ["general_goal_checker", "precise"]
    controller_plugins: ["FollowPath"]
    slow: {plugin: "nav2_controller::SimpleProgressChecker", movement_time_allowance: 25.0}
    general_goal_checker: {plugin: "nav2_controller::SimpleGoalChecker", yaw_goal_tolerance: 0.4}
    precise: {plugin: "nav2_controller::SimpleGoalChecker", yaw_goal_tolerance: 0.1}
    FollowPath:
      plugin: "dwb_core::DWBLocalPlanner"
      acc_lim_y: 0.0
      decel_lim_y: 0.0
      vy_samples: 0
      critics: [RotateToGoal, Oscillation, BaseObstacle, ObstacleFootprint, PathDist, GoalDist, PreferForward]
      PathDist.scale: 30.0
global_costmap:
  global_costmap:
    ros__parameters:
      robot_radius: 0.22
      rolling_window: true
      plugins: ["obstacle_layer"]
      obstacle_layer:
        plugin: "nav2_costmap_2d::ObstacleLayer"
        observation_sources: scan
        scan: {obstacle_max_range: 4.0, clearing: false}
        old: {obstacle_max_range: 9.0}
      static_layer: {plugin: "nav2_costmap_2d::StaticLayer"}
recoveries_server:
  ros__parameters: {simulate_ahead_time: 1.5}
collision_monitor:
  ros__parameters:
    polygons: ["Near"]
    Near: {action_type: "approach", enabled: false, max_points: 3}
"""


def test_humble_file_is_read_with_its_meaning(tmp_path: Path) -> None:
    stack = loaded(tmp_path, "stack: {nav2_params: nav2.yaml}", HUMBLE).spec.stack
    drives = stack.controller
    assert (stack.localizer.robot_model, stack.localizer.max_beams) == ("differential", 40)
    assert (stack.failure_tolerance, stack.progress_checker.movement_time_allowance) == (0.7, 25.0)
    assert stack.goal_checker.yaw_goal_tolerance == 0.4
    assert (drives.type, drives.acc_lim_y, drives.decel_lim_y, drives.vy_samples) == ("dwb", 0.0, 0.0, 0)
    assert drives.base_obstacle_scale == 0.02
    assert (drives.path_dist_scale, drives.path_align_scale, drives.goal_align_scale) == (30.0, 0.0, 0.0)
    assert (stack.costmap.obstacle_max_range, stack.recovery.simulate_ahead_time) == (4.0, 1.5)
    assert (stack.collision_monitor.enabled, stack.collision_monitor.min_points) == (False, 4)


def test_every_parameter_that_changes_nothing_here_is_named_with_its_line(tmp_path: Path) -> None:
    output = [(note.line, note.message) for note in loaded(tmp_path, "stack: {nav2_params: nav2.yaml}", HUMBLE).notes]
    assert output == [
        (4, "amcl: `set_initial_pose`: the scenario defines the initial pose"),
        (4, "duplicate key `max_beams` (first at 4:79)"),
        (8, "controller_server: `goal_checker_plugins`: only the first goal_checker is used: general_goal_checker,"
         " not precise"),
        (18, "controller_server: `FollowPath.critics`: not supported: PreferForward"),
        (23, "global_costmap: `robot_radius`: the robot file defines the size of the robot"),
        (24, "global_costmap: `rolling_window`: the local costmap always rolls, the global costmap with `map: none`"),
        (25, "global_costmap: `plugins`: it lists no inflation layer"),
        (29, "global_costmap: simscen has no obstacle_layer.scan.clearing (29),"
         " obstacle_layer.old.obstacle_max_range (30)"),
        (31, "global_costmap: `static_layer.plugin`: `plugins` does not list static_layer"),
    ]  # fmt: skip


SOURCES = """\
local_costmap:
  local_costmap:
    ros__parameters:
      plugins: [obstacle_layer, voxel_layer]
      obstacle_layer:
        plugin: "nav2_costmap_2d::ObstacleLayer"
        observation_sources: front rear
        front: {obstacle_max_range: 10.0, raytrace_max_range: 11.0, max_obstacle_height: 1.0}
        rear: {data_type: LaserScan, obstacle_max_range: 10.0, raytrace_max_range: 8.0, max_obstacle_height: 3.0}
      voxel_layer:
        plugin: "nav2_costmap_2d::VoxelLayer"
        observation_sources: depth
        depth:
          data_type: PointCloud2
          obstacle_max_range: 0.4
          raytrace_max_range: 0.5
          max_obstacle_height: 0.8
"""


def test_only_laser_scans_set_the_ranges_of_the_lidar(tmp_path: Path) -> None:
    found = loaded(tmp_path, "stack: {nav2_params: nav2.yaml}", SOURCES)
    costmap = found.spec.stack.local_costmap
    assert (costmap.obstacle_max_range, costmap.raytrace_max_range, costmap.max_obstacle_height) == (10.0, 11.0, 0.8)
    assert [(note.line, note.message) for note in found.notes] == [
        (4, "local_costmap: `plugins`: it lists no inflation layer"),
        (9, "local_costmap: `obstacle_layer.rear.raytrace_max_range`: only the value of the first source is used:"
         " obstacle_layer.front"),
        (15, "local_costmap: `voxel_layer.depth.obstacle_max_range`: PointCloud2 data does not set the ranges of the"
         " lidar"),
    ]  # fmt: skip


def test_only_the_first_enabled_approach_polygon_is_used(tmp_path: Path) -> None:
    polygons = """\
collision_monitor:
  ros__parameters:
    polygons: [Off, Near, Far]
    Off: {action_type: approach, enabled: false, min_points: 7}
    Near: {action_type: approach, min_points: 4}
    Far: {action_type: approach, min_points: 9}
"""
    found = loaded(tmp_path, "stack: {nav2_params: nav2.yaml}", polygons)
    assert (found.spec.stack.collision_monitor.enabled, found.spec.stack.collision_monitor.min_points) == (True, 4)
    assert [note.message for note in found.notes] == [
        "collision_monitor: `polygons`: only the first polygon with the action_type approach is used: Near, not Far"
    ]


ACCEPTED = """\
amcl:
  ros__parameters: {alpha1: 0.2, laser_min_range: 1.44, laser_max_range: -1.44}
behavior_server:
  ros__parameters: {simulate_ahead_time: 0.0, min_rotational_vel: -0.8}
controller_server:
  ros__parameters: {controller_frequency: 50.0}
"""


def test_values_with_a_special_meaning_in_nav2_are_accepted(tmp_path: Path) -> None:
    """AMCL ignores range limits of 0 and less, Spin a negative minimum; without time ahead, nothing is checked."""
    found = loaded(tmp_path, "stack: {nav2_params: nav2.yaml}", ACCEPTED)
    stack = found.spec.stack
    assert (stack.localizer.laser_min_range, stack.localizer.max_used_range) == (1.44, float("inf"))
    assert (stack.recovery.simulate_ahead_time, stack.recovery.min_rotational_vel) == (0.0, 0.0)


@pytest.mark.parametrize(("physics", "rate"), [("", 48.0), ("physics: {tick_rate: 200 Hz}", 50.0)])
def test_controller_frequency_is_the_nearest_possible_one(tmp_path: Path, physics: str, rate: float) -> None:
    found = loaded(tmp_path, "stack: {nav2_params: nav2.yaml}", ACCEPTED, rest=physics)
    assert found.spec.stack.controller_frequency == rate
    notes = [(note.line, note.message) for note in found.notes]
    expected = "controller_server: `controller_frequency`: 50 Hz does not divide 240 Hz; the nearest that does is 48 Hz"
    assert notes == ([] if physics else [(6, expected)])


@pytest.mark.parametrize("frequency", [".inf", ".nan", "-.inf", "0.0"])
def test_controller_frequency_must_be_positive_and_finite(tmp_path: Path, frequency: str) -> None:
    with pytest.raises(InvalidInput) as wrong:
        loaded(tmp_path, "stack: {nav2_params: nav2.yaml}", ACCEPTED.replace("50.0", frequency))
    assert [(problem.code, problem.line) for problem in wrong.value.problems] == [("SC013", 6)]


def test_a_minimum_above_its_maximum_is_reported_at_the_minimum(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput) as wrong:
        loaded(tmp_path, "stack: {nav2_params: nav2.yaml}", ACCEPTED.replace("-1.44", "1.0"))
    assert [(p.code, p.line, p.col) for p in wrong.value.problems] == [("SC016", 2, 51)]


def test_only_the_last_of_several_nodes_with_the_same_name_is_used(tmp_path: Path) -> None:
    params = "a: {amcl: {ros__parameters: {alpha1: 0.1}}}\nb: {amcl: {ros__parameters: {alpha1: 0.3}}}\n"
    found = loaded(tmp_path, "stack: {nav2_params: nav2.yaml}", params)
    assert found.spec.stack.localizer.alpha1 == 0.3
    assert [(note.line, note.message) for note in found.notes] == [
        (1, "only the last of the nodes called amcl is used")
    ]


COSTMAP = "{name}:\n  {name}:\n    ros__parameters:\n      plugins: [{layers}]\n"
LAYER = "      {layer}: {{plugin: 'nav2_costmap_2d::{kind}'{values}}}\n"


def _costmap(name: str, kinds: str, values: str = "") -> str:
    """Return the part of a Nav2 file with a costmap that has layers of these kinds, all with the same values."""
    layers = {kind: kind.lower() for kind in kinds.split()}
    texts = [LAYER.format(layer=layer, kind=kind, values=values) for kind, layer in layers.items()]
    return COSTMAP.format(name=name, layers=", ".join(layers.values())) + "".join(texts)


@pytest.mark.parametrize(
    ("name", "kinds", "noted"),
    [
        ("global_costmap", "StaticLayer ObstacleLayer InflationLayer", []),
        ("local_costmap", "VoxelLayer InflationLayer", []),
        ("global_costmap", "StaticLayer InflationLayer", ["obstacle layer"]),
        ("local_costmap", "ObstacleLayer", ["inflation layer"]),
        ("local_costmap", "StaticLayer ObstacleLayer InflationLayer", ["the map"]),
    ],
)
def test_layers_unlike_those_of_simscen_are_named(tmp_path: Path, name: str, kinds: str, noted: list[str]) -> None:
    notes = loaded(tmp_path, "stack: {nav2_params: nav2.yaml}", _costmap(name, kinds)).notes
    assert len(notes) == len(noted)
    for note, text in zip(notes, noted, strict=True):
        assert note.line == 4
        assert f"{name}: `plugins`: " in note.message
        assert text in note.message


@pytest.mark.parametrize(("values", "is_enabled"), [("", True), (", enabled: true", True), (", enabled: false", False)])
def test_a_listed_denoise_layer_is_enabled_by_default(tmp_path: Path, values: str, is_enabled: bool) -> None:
    params = _costmap("local_costmap", "ObstacleLayer InflationLayer DenoiseLayer", values)
    stack = loaded(tmp_path, "stack: {nav2_params: nav2.yaml}", params).spec.stack
    assert stack.local_costmap.denoise_layer.enabled is is_enabled
    assert not stack.costmap.denoise_layer.enabled


def _checkers(folder: Path, goal: str, progress: str) -> LoadedScenario:
    """Return a scenario with a Nav2 file that has these plug-ins as goal checker and progress checker."""
    params = f"""\
controller_server:
  ros__parameters:
    goal_checker: {{plugin: "nav2_controller::{goal}", yaw_goal_tolerance: 0.1}}
    progress_checker: {{plugin: "nav2_controller::{progress}"}}
collision_monitor:
  ros__parameters: {{source_timeout: 0.0}}
"""
    return loaded(folder, "stack: {nav2_params: nav2.yaml}", params)


def test_turns_are_progress_for_the_pose_progress_checker(tmp_path: Path) -> None:
    found = _checkers(tmp_path, "SimpleGoalChecker", "PoseProgressChecker")
    assert found.spec.stack.progress_checker.required_movement_angle == 0.5
    assert not found.notes
    simple = _checkers(tmp_path, "SimpleGoalChecker", "SimpleProgressChecker")
    assert simple.spec.stack.progress_checker.required_movement_angle is None


def test_the_position_goal_checker_accepts_any_heading(tmp_path: Path) -> None:
    stack = _checkers(tmp_path, "PositionGoalChecker", "SimpleProgressChecker").spec.stack
    assert stack.goal_checker.yaw_goal_tolerance == pytest.approx(3.1416, abs=1e-4)


def test_unknown_checkers_are_named(tmp_path: Path) -> None:
    notes = _checkers(tmp_path, "StoppedGoalChecker", "Mine").notes
    assert [(note.line, note.message.partition(": ")[2]) for note in notes] == [
        (3, "`goal_checker.plugin`: StoppedGoalChecker is not supported; the simple goal_checker is used"),
        (4, "`progress_checker.plugin`: Mine is not supported; the simple progress_checker is used"),
    ]


def test_a_source_timeout_of_zero_never_stops_the_robot(tmp_path: Path) -> None:
    stack = _checkers(tmp_path, "SimpleGoalChecker", "SimpleProgressChecker").spec.stack
    assert stack.collision_monitor.source_timeout == 86400.0
