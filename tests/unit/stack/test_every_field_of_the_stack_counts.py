"""Tests that each parameter of the stack changes a decision of the stack in a scene.

The parameters of controllers are tested in test_every_field_of_a_controller_counts.py.
"""

import re
from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, NamedTuple, Union, get_args, get_origin

import othervalues
import pytest
import scenes
from pydantic import BaseModel, ValidationError
from scenes import Scene

from simscen.advanced.spec import MedialAxisPlanner, Retrace, ScanMatchingAmcl, SlipEkf
from simscen.model import controllers, costmaps, localizers, planners
from simscen.model import recovery as behaviors
from simscen.model.localizers import OdometryFilter
from simscen.model.stack import StackSpec
from simscen.model.stack_base import ControllerSpec, Latency, SpeedZone
from simscen.model.velocity_commands import CollisionMonitor, VelocitySmoother
from simscen.spec.places import SpeedMask
from simscen.spec.registry import all_types

Data = dict[str, Any]
TRUTH: Data = {"localizer": {"type": "ground_truth"}, "planner": {"type": "navfn"}}
BLIND: Data = {**TRUTH, "costmap": {"obstacle_max_range": 0.05}}
"""Planner and controller that do not see obstacles."""


class Part(NamedTuple):
    """Part of the specification of the stack: the path to it, and the specifications and scenes for its tests."""

    keys: tuple[str | int, ...]
    kind: type[BaseModel]
    tries: tuple[tuple[Data, Scene], ...]
    special: dict[str, tuple[tuple[Data, Scene], ...]] = {}
    """Other specifications and scenes, by field, for fields without an effect in those of `tries`."""
    values: dict[str, list[Any]] = {}
    """Values to try, by field, for fields whose default values to try are unsuitable."""


def amcl(**fields: Any) -> Data:
    return {"localizer": {"type": "scan_matching_amcl", "max_particles": 120, "min_particles": 40, **fields}}


def plain_amcl(**fields: Any) -> Data:
    return {"localizer": {"type": "amcl", "max_particles": 120, "min_particles": 40, **fields}}


def planner(**fields: Any) -> Data:
    return {**TRUTH, "planner": fields}


def recovery(*behaviors: str | Data, **fields: Any) -> Data:
    return {**TRUTH, "recovery": {"behaviors": list(behaviors), "wait_duration": 0.4, **fields}}


def of_planner(kind: str) -> dict[str, tuple[tuple[Data, Scene], ...]]:
    """Return specifications and scenes for the fields that all planners have."""
    fields = {"type": kind}
    impatient = {**planner(**fields), "progress_checker": {"movement_time_allowance": 0.3}}
    return {
        "tolerance": ((planner(**fields), scenes.goal_near_wall),),
        "replanning": ((planner(**fields), scenes.replan_on_long_path),),
        "replanning_rate": ((planner(**fields, replanning="rate"), scenes.replan_on_long_path),),
        "proximity_threshold": ((planner(**fields, replanning="rate"), scenes.replan_on_long_path),),
        "cautious": ((impatient, scenes.gap_and_detour),),
        "allow_unknown": (({**planner(**fields), "costmap": {"raytrace_max_range": 1.0}}, scenes.unknown_cells),),
    }


LOST: Data = {"laser_model_type": "likelihood_field_prob", "update_min_d": 0.05}
RANDOM: Data = {
    "sigma_hit": 0.2, "likelihood_exponent": 1.0, "beams_beyond_the_map": "miss", "map_trust_none": 0.0,
    "map_trust_full": 0.0, "match_scans": False, "settling_distance": 0.0, "relocalization": "random",
    "sure_update_interval": 1,
}  # fmt: skip
"""Parameters with which scan-matching AMCL is plain AMCL."""
SMALL: Data = {**TRUTH, "costmap": {"rolling_size": 8.0}}
SEEN = ((TRUTH, scenes.through_door), (SMALL, scenes.without_map), (TRUTH, scenes.obstacles_in_depth_image))
SEEN_BY_A_CAMERA = ("min_obstacle_height", "max_obstacle_height", "max_ground_slope")
STRICT: Data = {**TRUTH, "goal_checker": {"well_inside": 0.5}}
DENOISE = {"enabled": True, "minimal_group_size": 6}
PARTS = [
    Part(("localizer",), localizers.Amcl, ((plain_amcl(), scenes.changed_room),), {
        "alpha5": ((plain_amcl(robot_model="omni"), scenes.changed_room),),
        "min_particles": ((plain_amcl(min_particles=20), scenes.changed_room),),
        # With at most 120 particles, KLD sampling draws the maximum for all values of these two parameters.
        **dict.fromkeys(("pf_err", "pf_z"), ((plain_amcl(max_particles=2000), scenes.changed_room),)),
        "selective_resampling": ((plain_amcl(max_beams=5), scenes.changed_room),),
        "recovery_alpha_slow": ((plain_amcl(**LOST, recovery_alpha_fast=0.9), scenes.kidnapped),),
        "recovery_alpha_fast": ((plain_amcl(**LOST, recovery_alpha_slow=0.01), scenes.kidnapped),),
        **dict.fromkeys(
            ("z_short", "z_max", "lambda_short"), ((plain_amcl(laser_model_type="beam"), scenes.changed_room),)
        ),
        **dict.fromkeys(
            ("beam_skip_distance", "beam_skip_threshold", "beam_skip_error_threshold"),
            ((plain_amcl(**LOST, do_beamskip=True, beam_skip_threshold=0.9), scenes.changed_room),),
        ),
        "do_beamskip": ((plain_amcl(**LOST, beam_skip_threshold=0.9), scenes.changed_room),),
    }, {"laser_min_range": [0.5, 1.5], "laser_max_range": [0.5, 1.5], "min_particles": [100],
        "laser_likelihood_max_dist": [0.2]}),
    Part(("localizer",), ScanMatchingAmcl, (
        (amcl(), scenes.changed_room), (amcl(match_scans=False), scenes.changed_room)), {
        "alpha5": ((amcl(robot_model="omni", match_scans=False), scenes.changed_room),),
        "min_particles": ((amcl(min_particles=20), scenes.changed_room),),
        "selective_resampling": ((amcl(max_beams=5, likelihood_exponent=0.1), scenes.changed_room),),
        "recovery_alpha_slow": ((amcl(**LOST, **RANDOM, recovery_alpha_fast=0.9), scenes.kidnapped),),
        "recovery_alpha_fast": ((amcl(**LOST, **RANDOM, recovery_alpha_slow=0.01), scenes.kidnapped),),
        "relocalization": ((amcl(), scenes.unknown_start),),
        "match_scans": ((amcl(), scenes.wheel_slip),),
        **dict.fromkeys(("z_short", "z_max", "lambda_short"), ((amcl(laser_model_type="beam"), scenes.changed_room),)),
        **dict.fromkeys(
            ("beam_skip_distance", "beam_skip_threshold", "beam_skip_error_threshold"),
            ((amcl(do_beamskip=True, beam_skip_threshold=0.9, settling_distance=0.0), scenes.changed_room),),
        ),
        "do_beamskip": ((amcl(beam_skip_threshold=0.9, settling_distance=0.0), scenes.changed_room),),
    }, {"laser_min_range": [0.5, 1.5], "laser_max_range": [0.5, 1.5], "min_particles": [100],
        "laser_likelihood_max_dist": [0.2]}),
    Part(("localizer",), localizers.Ekf, (({"localizer": {"type": "ekf"}}, scenes.wheel_slip),)),
    Part(("localizer",), SlipEkf, (({"localizer": {"type": "slip_ekf"}}, scenes.wheel_slip),)),
    Part(("costmap",), costmaps.Costmap, SEEN, {
        "rolling_size": ((SMALL, scenes.without_map),),
        **dict.fromkeys(SEEN_BY_A_CAMERA, ((TRUTH, scenes.obstacles_in_depth_image),)),
        **dict.fromkeys(("raytrace_min_range", "inf_is_valid", "track_unknown_space"), ((SMALL, scenes.without_map),)),
    }, {"min_obstacle_height": [0.3], "obstacle_min_range": [1.0], "raytrace_min_range": [2.0]}),
    Part(("costmap", "denoise_layer"), costmaps.DenoiseLayer, (
        ({**TRUTH, "costmap": {"denoise_layer": {"enabled": True}}}, scenes.through_door),
        ({**TRUTH, "costmap": {"denoise_layer": DENOISE}}, scenes.through_door)), {
        "enabled": (({**TRUTH, "costmap": {"denoise_layer": {"minimal_group_size": 20}}}, scenes.through_door),)}),
    Part(("local_costmap",), costmaps.LocalCostmap, SEEN, {
        **dict.fromkeys(("raytrace_min_range", "inf_is_valid"), ((SMALL, scenes.without_map),)),
        **dict.fromkeys(SEEN_BY_A_CAMERA, ((TRUTH, scenes.obstacles_in_depth_image),)),
    }, {
        "denoise_layer": [{"enabled": True, "minimal_group_size": 20}], "obstacle_min_range": [1.0],
        "raytrace_min_range": [2.0],
    }),
    Part(("goal_checker",), controllers.SimpleGoalChecker, (
        (STRICT, scenes.arrival), (STRICT, scenes.overshoot_goal))),
    Part(("progress_checker",), controllers.ProgressChecker, (
        ({**TRUTH, "progress_checker": {"movement_time_allowance": 0.5}}, scenes.no_progress),
        ({**TRUTH, "progress_checker": {"movement_time_allowance": 1.0}}, scenes.no_progress),
    )),
    Part(("recovery",), behaviors.Recovery, ((recovery("backup", "spin", "wait"), scenes.closed_door),), {
        "number_of_retries": ((recovery("clear_costmap"), scenes.closed_door),),
        "planner_codes": (
            ({**TRUTH, "recovery": StackSpec(profile="advanced").recovery.model_dump()}, scenes.invalid_start_or_goal),
            (TRUTH, scenes.closed_door)),
        "wait_duration": ((recovery("wait"), scenes.closed_door),),
        **dict.fromkeys(("spin_dist", "max_rotational_vel"), ((recovery("spin"), scenes.closed_door),)),
        "simulate_ahead_time": ((recovery("backup", backup_partial=False), scenes.closed_door),),
        "backup_partial": ((recovery("backup"), scenes.closed_door),),
        "retrace_dist": ((recovery("retrace"), scenes.blocked_corridor),),
    }, {"behaviors": [["wait"], ["spin"], ["backup"], ["clear_costmap"], ["retrace"]]}),
    Part(("recovery", "behaviors", 0), behaviors.Spin, (
        (recovery({"type": "spin"}), scenes.closed_door),), {
        "simulate_ahead_time": ((recovery({"type": "spin"}), scenes.little_room_to_turn),)}, {
        "simulate_ahead_time": [0.3]}),
    Part(("recovery", "behaviors", 0), behaviors.Wait, ((recovery({"type": "wait"}), scenes.closed_door),)),
    Part(("recovery", "behaviors", 0), behaviors.BackUp, (
        (recovery({"type": "backup"}), scenes.closed_door),
        (recovery({"type": "backup", "backup_partial": False}), scenes.closed_door),
    )),
    Part(("recovery", "behaviors", 0), Retrace, ((recovery({"type": "retrace"}), scenes.blocked_corridor),), {
        "backup_dist": ((recovery({"type": "retrace"}), scenes.closed_door),)}),
    Part(("velocity_smoother",), VelocitySmoother, ((TRUTH, scenes.through_door), (TRUTH, scenes.arrival))),
    Part(("collision_monitor",), CollisionMonitor, (
        (TRUTH, scenes.lidar_outage), (BLIND, scenes.obstacle_not_on_map), (BLIND, scenes.through_door))),
    Part(("prediction",), costmaps.Prediction, (
        ({**TRUTH, "prediction": {"enabled": True}}, scenes.moving_obstacles),), {
        "enabled": ((TRUTH, scenes.moving_obstacles),)}, {
        "max_range": [1.0], "max_radius": [0.1], "min_speed": [1.0]}),
    Part(("latency",), Latency, ((TRUTH, scenes.obstacle_not_on_map), (amcl(), scenes.changed_room))),
    Part((), StackSpec, ((TRUTH, scenes.through_door),), {"failure_tolerance": (
        ({**BLIND, "local_costmap": {"obstacle_max_range": 2.5}}, scenes.obstacle_not_on_map),)}, {
        "profile": ["nav2"]}),
    Part(("planner",), planners.OmplPlanner, (
        (planner(), scenes.plan_past_box),), {
        **of_planner("bit_star"),
        "max_iterations": ((planner(type="rrt_connect"), scenes.plan_past_box),),
        "improving_iterations": ((planner(type="rrt_star", improving_iterations=60), scenes.plan_past_box),),
        "range": ((planner(type="rrt_connect"), scenes.plan_past_box),),
        "goal_bias": ((planner(type="kpiece"), scenes.plan_past_box),),
        "state_space": ((planner(), scenes.plan_past_box), (planner(state_space="se2"), scenes.plan_past_box)),
    }, {"max_iterations": [1, 3], "improving_iterations": [5, 30]}),
    Part(("planner",), MedialAxisPlanner, ((planner(type="medial_axis"), scenes.plan_past_box),), {
        **of_planner("medial_axis"),
        "state_space": (
            (planner(type="medial_axis"), scenes.plan_past_box),
            (planner(type="medial_axis", state_space="se2"), scenes.plan_past_box),
        ),
    }, {"max_iterations": [1, 3]}),
    Part(("planner",), planners.Navfn, ((planner(type="navfn"), scenes.plan_past_box),), of_planner("navfn")),
    Part(("planner",), planners.Smac2d, ((planner(type="smac_2d"), scenes.plan_past_box),), of_planner("smac_2d")),
]  # fmt: skip
ELSEWHERE = {
    "Amcl.parameters": "tests/diagnostics/meaningless/deprecated_amcl_parameters.scenario.yaml",
    "StackSpec.keepout": "tests/scenarios/test_masks.py",
    "StackSpec.speed_zones": "tests/unit/run/test_costmap_filters.py",
    "StackSpec.keepout_mask": "tests/scenarios/test_masks.py",
    "StackSpec.speed_mask": "tests/scenarios/test_masks.py",
    "StackSpec.nav2_params": "tests/unit/loading/stacks/test_nav2_parameters.py",
    "StackSpec.latency": "tests/unit/run/test_latency.py",  # `robot` uses the latencies of the robot's file
    "OmplPlanner.gap_clearance": "tests/unit/stack/planners/test_ompl_planner.py",
    **{
        f"{kind}.{name}": "tests/unit/stack/planners/test_pose_planner.py"
        for kind in ("OmplPlanner", "MedialAxisPlanner")
        for name in ("minimum_turning_radius", "cusp_penalty", "pose_searches", "hull_clearance")
    },
    **dict.fromkeys(
        ("Costmap.publish_frequency", "LocalCostmap.publish_frequency"), "tests/unit/stack/test_publishing.py"
    ),
    **dict.fromkeys(
        (f"StackSpec.min_{axis}_velocity_threshold" for axis in ("x", "y", "theta")),
        "tests/unit/stack/test_navigator.py",
    ),
    "Costmap.lethal_cost_threshold": "tests/unit/stack/costmap/test_costmap.py",
    **dict.fromkeys(
        (
            "Recovery.time_allowance",
            "Recovery.rotational_acc_lim",
            "Recovery.min_rotational_vel",
            "Spin.time_allowance",
            "Spin.rotational_acc_lim",
            "Spin.min_rotational_vel",
            "BackUp.time_allowance",
        ),
        "tests/unit/stack/test_behaviors.py",
    ),
    "Retrace.time_allowance": "tests/unit/advanced/test_retrace.py",
    "CollisionMonitor.simulation_time_step": "tests/unit/stack/test_collision_monitor.py",
    "Recovery.clear_entirely": "tests/unit/advanced/test_costmap_clearing.py",
    "ClearCostmap.clear_entirely": "tests/unit/stack/test_behaviors.py",
    "Recovery.retries_since_progress": "tests/unit/stack/test_checks_and_limits.py",
    "VelocitySmoother.counter_turn_slip": "tests/unit/advanced/test_turn_slip.py",
    "ScanMatchingAmcl.sure_update_interval": "tests/unit/advanced/localizers/test_scan_matching_amcl.py",
    **{f"OdometryFilter.{name}": "tests/unit/stack/test_odometry_filter.py" for name in OdometryFilter.model_fields},
    # These are read when goals are created.
    "SimpleGoalChecker.xy_goal_tolerance": "tests/unit/run/test_goal_tolerances.py",
    "SimpleGoalChecker.yaw_goal_tolerance": "tests/unit/run/test_goal_tolerances.py",
}
"""Fields without an effect in these scenes, and the tests in which they have one."""


def left_out(kind: type[BaseModel], name: str) -> bool:
    """Return whether a field is not tested here: it has its own test, or another value selects another model."""
    return f"{kind.__name__}.{name}" in ELSEWHERE or (name == "type" and kind is not planners.OmplPlanner)


TESTED_ELSEWHERE = {planners.PlannerSpec, ControllerSpec, controllers.GoalCheckerSpec, SpeedZone, SpeedMask}
"""Models that are tested with each planner and goal checker, and those of controllers and zones."""


def models_in(kind: Any) -> Iterator[type[BaseModel]]:
    """Yield the models that a field of this type can contain, including nested ones."""
    if get_origin(kind) in (Annotated, Union, UnionType, list):
        for member in get_args(kind):
            yield from models_in(member)
    elif isinstance(kind, type) and issubclass(kind, BaseModel):
        yield kind
        for field in kind.model_fields.values():
            yield from models_in(field.annotation)


class FieldValues(NamedTuple):
    """Field of a part with values, one of which must change a decision."""

    part: Part
    name: str
    values: list[Any]

    def __str__(self) -> str:
        value = f"={self.values[0]}" if len(self.values) == 1 else ""
        return f"{self.part.kind.__name__}.{self.name}{value}"


def field_values() -> Iterator[FieldValues]:
    """Yield all fields that are tested here, with their values."""
    for part in PARTS:
        for name, field in part.kind.model_fields.items():
            if left_out(part.kind, name):
                continue
            if name in part.values:
                found = [part.values[name]]
            else:
                found = othervalues.others(field.annotation, field.default)
            yield from (FieldValues(part, name, values) for values in found)


def with_value(start: Any, keys: tuple[str | int, ...], name: str, value: Any) -> Any:
    """Return the data with another value of the field `name` of the part at `keys`."""
    if not keys:
        return {**start, name: value}
    first, *rest = keys
    if isinstance(first, int):
        inner = with_value(start[first], tuple(rest), name, value)
        return [inner if number == first else each for number, each in enumerate(start)]
    return {**start, first: with_value(start.get(first, {}), tuple(rest), name, value)}


class ReferenceDecisions:
    """Decisions in a scene with an unchanged specification. They are computed when they are needed, and cached."""

    known: dict[tuple[str, str], "ReferenceDecisions"] = {}

    def __init__(self, data: Data, scene: Scene) -> None:
        self._decisions: list[object] = []
        self._remaining = scene(StackSpec.model_validate(data))

    @classmethod
    def of(cls, data: Data, scene: Scene) -> "ReferenceDecisions":
        key = (repr(data), scene.__name__)
        if key not in cls.known:
            cls.known[key] = cls(data, scene)
        return cls.known[key]

    def __iter__(self) -> Iterator[object]:
        number = 0
        while True:
            if number == len(self._decisions):
                try:
                    self._decisions.append(hash(next(self._remaining)))
                except StopIteration:
                    return
            yield self._decisions[number]
            number += 1


def changes_a_decision(field: FieldValues, value: Any) -> bool:
    """Return whether a field with this value changes a decision in any scene."""
    for start, scene in field.part.special.get(field.name, field.part.tries):
        try:
            spec = StackSpec.model_validate(with_value(start, field.part.keys, field.name, value))
        except ValidationError:
            continue
        if spec == StackSpec.model_validate(start):
            continue
        decisions = (hash(each) for each in scene(spec))
        if any(one != another for one, another in zip_longest(decisions, ReferenceDecisions.of(start, scene))):
            return True
    return False


FIELD_VALUES = list(field_values())


@pytest.mark.sample(20)
@pytest.mark.parametrize("field", FIELD_VALUES, ids=str)
def test_another_value_changes_a_decision(field: FieldValues) -> None:
    assert any(changes_a_decision(field, value) for value in field.values)


def test_unchanged_values_change_no_decision() -> None:
    """Otherwise, the tests above would pass without an effect of the field."""
    scene = scenes.obstacle_not_on_map
    assert [*scene(StackSpec.model_validate(amcl()))] == [*scene(StackSpec.model_validate(amcl()))]


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.kind.__name__)
def test_every_field_is_tried(part: Part) -> None:
    tried = {field.name for field in FIELD_VALUES if field.part is part}
    holding = {name for name, field in part.kind.model_fields.items() if any(models_in(field.annotation))}
    elsewhere = {name for name in part.kind.model_fields if left_out(part.kind, name)}
    assert part.kind.model_fields.keys() <= tried | elsewhere | holding


def test_every_model_is_tried() -> None:
    """Models of the stack and of the shipped components."""
    groups = ("localizer", "planner", "behavior", "goal_checker")
    roots = [StackSpec, *(entry.load() for group in groups for entry in all_types(group))]
    holding = {
        kind for root in roots for kind in models_in(root) if any(not left_out(kind, n) for n in kind.model_fields)
    }
    assert holding - TESTED_ELSEWHERE == {part.kind for part in PARTS}


@pytest.mark.parametrize("field", ELSEWHERE)
def test_every_excluded_parameter_names_its_test(field: str) -> None:
    text = (Path(__file__).parents[3] / ELSEWHERE[field]).read_text(encoding="utf-8")
    assert re.search(rf"\b{field.partition('.')[2]}\b", text)
