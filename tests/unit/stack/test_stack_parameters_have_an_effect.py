"""Tests that each parameter of the stack changes a decision of the stack in a scene.

The parameters of controllers are tested in test_controller_parameters_have_an_effect.py.
"""

import re
from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, NamedTuple, Union, get_args, get_origin

import other_values
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
"""Costmaps contain no obstacles of the lidar, so that only the collision monitor reacts to them."""


class Part(NamedTuple):
    """Part of the stack's specification, and the specifications and scenes with which its fields are tested."""

    keys: tuple[str | int, ...]
    """Keys that lead to the part."""
    kind: type[BaseModel]
    tries: tuple[tuple[Data, Scene], ...]
    """Specifications and scenes for all fields that are not in `special`."""
    special: dict[str, tuple[tuple[Data, Scene], ...]] = {}
    """Specifications and scenes for fields that have no effect in those of `tries`."""
    values: dict[str, list[Any]] = {}
    """Values for fields for which the values of `other_value_groups` are unsuitable."""


def amcl(**fields: Any) -> Data:
    return {"localizer": {"type": "scan_matching_amcl", "max_particles": 120, "min_particles": 40, **fields}}


def plain_amcl(**fields: Any) -> Data:
    return {"localizer": {"type": "amcl", "max_particles": 120, "min_particles": 40, **fields}}


def planner(**fields: Any) -> Data:
    return {**TRUTH, "planner": fields}


def recovery(*behaviors: str | Data, **fields: Any) -> Data:
    return {**TRUTH, "recovery": {"behaviors": list(behaviors), "wait_duration": 0.4, **fields}}


def planner_fields(kind: str) -> dict[str, tuple[tuple[Data, Scene], ...]]:
    """Return the specifications and scenes, by field, for the fields that all planners have."""
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


PROB_MODEL: Data = {"laser_model_type": "likelihood_field_prob", "update_min_d": 0.05}
AS_AMCL: Data = {
    "sigma_hit": 0.2, "likelihood_exponent": 1.0, "beams_beyond_the_map": "miss", "map_trust_none": 0.0,
    "map_trust_full": 0.0, "match_scans": False, "settling_distance": 0.0, "relocalization": "random",
    "sure_update_interval": 1,
}  # fmt: skip
"""Parameters that disable what scan-matching AMCL adds to AMCL."""
ROLLING: Data = {**TRUTH, "costmap": {"rolling_size": 8.0}}
MARKING_SCENES = (
    (TRUTH, scenes.through_door),
    (ROLLING, scenes.without_map),
    (TRUTH, scenes.obstacles_in_depth_image),
)
CAMERA_FIELDS = ("min_obstacle_height", "max_obstacle_height", "max_ground_slope")
STRICT: Data = {**TRUTH, "goal_checker": {"well_inside": 0.5}}
DENOISE = {"enabled": True, "minimal_group_size": 6}
PARTS = [
    Part(("localizer",), localizers.Amcl, ((plain_amcl(), scenes.changed_room),), {
        "alpha5": ((plain_amcl(robot_model="omni"), scenes.changed_room),),
        "min_particles": ((plain_amcl(min_particles=20), scenes.changed_room),),
        # With at most 120 particles, KLD sampling draws the maximum for all values of these two parameters.
        **dict.fromkeys(("pf_err", "pf_z"), ((plain_amcl(max_particles=2000), scenes.changed_room),)),
        "selective_resampling": ((plain_amcl(max_beams=5), scenes.changed_room),),
        "recovery_alpha_slow": ((plain_amcl(**PROB_MODEL, recovery_alpha_fast=0.9), scenes.kidnapping),),
        "recovery_alpha_fast": ((plain_amcl(**PROB_MODEL, recovery_alpha_slow=0.01), scenes.kidnapping),),
        **dict.fromkeys(
            ("z_short", "z_max", "lambda_short"), ((plain_amcl(laser_model_type="beam"), scenes.changed_room),)
        ),
        **dict.fromkeys(
            ("beam_skip_distance", "beam_skip_threshold", "beam_skip_error_threshold"),
            ((plain_amcl(**PROB_MODEL, do_beamskip=True, beam_skip_threshold=0.9), scenes.changed_room),),
        ),
        "do_beamskip": ((plain_amcl(**PROB_MODEL, beam_skip_threshold=0.9), scenes.changed_room),),
    }, {"laser_min_range": [0.5, 1.5], "laser_max_range": [0.5, 1.5], "min_particles": [100],
        "laser_likelihood_max_dist": [0.2]}),
    Part(("localizer",), ScanMatchingAmcl, (
        (amcl(), scenes.changed_room), (amcl(match_scans=False), scenes.changed_room)), {
        "alpha5": ((amcl(robot_model="omni", match_scans=False), scenes.changed_room),),
        "min_particles": ((amcl(min_particles=20), scenes.changed_room),),
        "selective_resampling": ((amcl(max_beams=5, likelihood_exponent=0.1), scenes.changed_room),),
        "recovery_alpha_slow": ((amcl(**PROB_MODEL, **AS_AMCL, recovery_alpha_fast=0.9), scenes.kidnapping),),
        "recovery_alpha_fast": ((amcl(**PROB_MODEL, **AS_AMCL, recovery_alpha_slow=0.01), scenes.kidnapping),),
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
    Part(("costmap",), costmaps.Costmap, MARKING_SCENES, {
        "rolling_size": ((ROLLING, scenes.without_map),),
        **dict.fromkeys(CAMERA_FIELDS, ((TRUTH, scenes.obstacles_in_depth_image),)),
        **dict.fromkeys(
            ("raytrace_min_range", "inf_is_valid", "track_unknown_space"), ((ROLLING, scenes.without_map),)
        ),
    }, {"min_obstacle_height": [0.3], "obstacle_min_range": [1.0], "raytrace_min_range": [2.0]}),
    Part(("costmap", "denoise_layer"), costmaps.DenoiseLayer, (
        ({**TRUTH, "costmap": {"denoise_layer": {"enabled": True}}}, scenes.through_door),
        ({**TRUTH, "costmap": {"denoise_layer": DENOISE}}, scenes.through_door)), {
        "enabled": (({**TRUTH, "costmap": {"denoise_layer": {"minimal_group_size": 20}}}, scenes.through_door),)}),
    Part(("local_costmap",), costmaps.LocalCostmap, MARKING_SCENES, {
        **dict.fromkeys(("raytrace_min_range", "inf_is_valid"), ((ROLLING, scenes.without_map),)),
        **dict.fromkeys(CAMERA_FIELDS, ((TRUTH, scenes.obstacles_in_depth_image),)),
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
        "simulate_ahead_time": ((recovery({"type": "spin"}), scenes.small_turning_space),)}, {
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
        **planner_fields("bit_star"),
        "max_iterations": ((planner(type="rrt_connect"), scenes.plan_past_box),),
        "improving_iterations": ((planner(type="rrt_star", improving_iterations=60), scenes.plan_past_box),),
        "range": ((planner(type="rrt_connect"), scenes.plan_past_box),),
        "goal_bias": ((planner(type="kpiece"), scenes.plan_past_box),),
        "state_space": ((planner(), scenes.plan_past_box), (planner(state_space="se2"), scenes.plan_past_box)),
    }, {"max_iterations": [1, 3], "improving_iterations": [5, 30]}),
    Part(("planner",), MedialAxisPlanner, ((planner(type="medial_axis"), scenes.plan_past_box),), {
        **planner_fields("medial_axis"),
        "state_space": (
            (planner(type="medial_axis"), scenes.plan_past_box),
            (planner(type="medial_axis", state_space="se2"), scenes.plan_past_box),
        ),
    }, {"max_iterations": [1, 3]}),
    Part(("planner",), planners.Navfn, ((planner(type="navfn"), scenes.plan_past_box),), planner_fields("navfn")),
    Part(("planner",), planners.Smac2d, ((planner(type="smac_2d"), scenes.plan_past_box),), planner_fields("smac_2d")),
]  # fmt: skip
TESTED_BY = {
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
"""Fields without an effect in these scenes, and the files with their tests."""


def is_excluded(kind: type[BaseModel], name: str) -> bool:
    """Return whether a field is not tested here: it has its own test, or it is a `type` that selects the model."""
    return f"{kind.__name__}.{name}" in TESTED_BY or (name == "type" and kind is not planners.OmplPlanner)


EXCLUDED_MODELS = {planners.PlannerSpec, ControllerSpec, controllers.GoalCheckerSpec, SpeedZone, SpeedMask}
"""Base models, which are tested with each planner and goal checker, and models of controllers and zones."""


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
    """Field of a part with values of which at least one must change a decision."""

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
            if is_excluded(part.kind, name):
                continue
            if name in part.values:
                groups = [part.values[name]]
            else:
                groups = other_values.other_value_groups(field.annotation, field.default)
            yield from (FieldValues(part, name, values) for values in groups)


def with_value(start: Any, keys: tuple[str | int, ...], name: str, value: Any) -> Any:
    """Return the data with another value of the field `name` of the part at `keys`."""
    if not keys:
        return {**start, name: value}
    first, *rest = keys
    if isinstance(first, int):
        inner = with_value(start[first], tuple(rest), name, value)
        return [inner if index == first else item for index, item in enumerate(start)]
    return {**start, first: with_value(start.get(first, {}), tuple(rest), name, value)}


class ReferenceDecisions:
    """Decisions in a scene with the unchanged specification, computed lazily and cached."""

    cache: dict[tuple[str, str], "ReferenceDecisions"] = {}

    def __init__(self, data: Data, scene: Scene) -> None:
        self._decisions: list[object] = []
        self._remaining = scene(StackSpec.model_validate(data))

    @classmethod
    def of(cls, data: Data, scene: Scene) -> "ReferenceDecisions":
        key = (repr(data), scene.__name__)
        if key not in cls.cache:
            cls.cache[key] = cls(data, scene)
        return cls.cache[key]

    def __iter__(self) -> Iterator[object]:
        index = 0
        while True:
            if index == len(self._decisions):
                try:
                    self._decisions.append(hash(next(self._remaining)))
                except StopIteration:
                    return
            yield self._decisions[index]
            index += 1


def changes_a_decision(field: FieldValues, value: Any) -> bool:
    """Return whether a field with this value changes a decision in any scene."""
    for start, scene in field.part.special.get(field.name, field.part.tries):
        try:
            spec = StackSpec.model_validate(with_value(start, field.part.keys, field.name, value))
        except ValidationError:
            continue
        if spec == StackSpec.model_validate(start):
            continue
        decisions = (hash(decision) for decision in scene(spec))
        if any(
            decision != reference for decision, reference in zip_longest(decisions, ReferenceDecisions.of(start, scene))
        ):
            return True
    return False


FIELD_VALUES = list(field_values())


@pytest.mark.sample(20)
@pytest.mark.parametrize("field", FIELD_VALUES, ids=str)
def test_another_value_changes_a_decision(field: FieldValues) -> None:
    assert any(changes_a_decision(field, value) for value in field.values)


def test_equal_specifications_give_equal_decisions() -> None:
    """Otherwise, the test above would pass for fields without an effect."""
    scene = scenes.obstacle_not_on_map
    assert [*scene(StackSpec.model_validate(amcl()))] == [*scene(StackSpec.model_validate(amcl()))]


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.kind.__name__)
def test_every_field_is_tested_or_excluded(part: Part) -> None:
    tested = {field.name for field in FIELD_VALUES if field.part is part}
    containers = {name for name, field in part.kind.model_fields.items() if any(models_in(field.annotation))}
    excluded = {name for name in part.kind.model_fields if is_excluded(part.kind, name)}
    assert part.kind.model_fields.keys() <= tested | excluded | containers


def test_every_model_has_a_part() -> None:
    """This includes the models of the stack and of all shipped components."""
    groups = ("localizer", "planner", "behavior", "goal_checker")
    roots = [StackSpec, *(entry.load() for group in groups for entry in all_types(group))]
    models = {
        kind for root in roots for kind in models_in(root) if any(not is_excluded(kind, n) for n in kind.model_fields)
    }
    assert models - EXCLUDED_MODELS == {part.kind for part in PARTS}


@pytest.mark.parametrize("field", TESTED_BY)
def test_named_test_file_of_an_excluded_field_mentions_the_field(field: str) -> None:
    text = (Path(__file__).parents[3] / TESTED_BY[field]).read_text(encoding="utf-8")
    assert re.search(rf"\b{field.partition('.')[2]}\b", text)
