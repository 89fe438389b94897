"""Tests that each parameter of the stack has an effect.

Those of controllers are tried in test_every_field_of_a_controller_counts.py, command by command.
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
from simscen.model import controllers, costmaps, guards, localizers, planners
from simscen.model import recovery as behaviors
from simscen.model.localizers import OdometryFilter
from simscen.model.stack import StackSpec
from simscen.model.stack_base import ControllerSpec, Latency, SpeedZone
from simscen.spec.places import SpeedMask
from simscen.spec.registry import all_types

Said = dict[str, Any]
TRUTH: Said = {"localizer": {"type": "ground_truth"}, "planner": {"type": "navfn"}}
BLIND: Said = {**TRUTH, "costmap": {"obstacle_max_range": 0.05}}
"""A planner and a controller that do not see what is in the way."""


class Part(NamedTuple):
    """A part of the stack: where it is, and what to begin with in which scenes."""

    way: tuple[str | int, ...]
    kind: type[BaseModel]
    tries: tuple[tuple[Said, Scene], ...]
    special: dict[str, tuple[tuple[Said, Scene], ...]] = {}
    """Other beginnings and scenes, for fields that show in no usual one."""
    values: dict[str, list[Any]] = {}
    """Other values for fields of which the usual ones do not fit."""


def amcl(**said: Any) -> Said:
    return {"localizer": {"type": "scan_matching_amcl", "max_particles": 120, "min_particles": 40, **said}}


def plain_amcl(**said: Any) -> Said:
    return {"localizer": {"type": "amcl", "max_particles": 120, "min_particles": 40, **said}}


def planner(**said: Any) -> Said:
    return {**TRUTH, "planner": said}


def recovery(*behaviors: str | Said, **said: Any) -> Said:
    return {**TRUTH, "recovery": {"behaviors": list(behaviors), "wait_duration": 0.4, **said}}


def of_planner(kind: str) -> dict[str, tuple[tuple[Said, Scene], ...]]:
    """Where the fields show that all planners have."""
    said = {"type": kind}
    impatient = {**planner(**said), "progress_checker": {"movement_time_allowance": 0.3}}
    return {
        "tolerance": ((planner(**said), scenes.at_a_wall),),
        "replanning": ((planner(**said), scenes.long_way),),
        "replanning_rate": ((planner(**said, replanning="rate"), scenes.long_way),),
        "proximity_threshold": ((planner(**said, replanning="rate"), scenes.long_way),),
        "cautious": ((impatient, scenes.two_ways),),
        "allow_unknown": (({**planner(**said), "costmap": {"raytrace_max_range": 1.0}}, scenes.half_known),),
    }


LOST: Said = {"laser_model_type": "likelihood_field_prob", "update_min_d": 0.05}
RANDOM: Said = {
    "sigma_hit": 0.2, "likelihood_exponent": 1.0, "beams_beyond_the_map": "miss", "map_trust_none": 0.0,
    "map_trust_full": 0.0, "match_scans": False, "settling_distance": 0.0, "relocalization": "random",
    "sure_update_interval": 1,
}  # fmt: skip
"""Parameters with which scan-matching AMCL is plain AMCL."""
SMALL: Said = {**TRUTH, "costmap": {"rolling_size": 8.0}}
SEEN = ((TRUTH, scenes.through), (SMALL, scenes.no_map), (TRUTH, scenes.seen_by_a_camera))
SEEN_BY_A_CAMERA = ("min_obstacle_height", "max_obstacle_height", "max_ground_slope")
STRICT: Said = {**TRUTH, "goal_checker": {"well_inside": 0.5}}
DENOISE = {"enabled": True, "minimal_group_size": 6}
PARTS = [
    Part(("localizer",), localizers.Amcl, ((plain_amcl(), scenes.moved),), {
        "alpha5": ((plain_amcl(robot_model="omni"), scenes.moved),),
        "min_particles": ((plain_amcl(min_particles=20), scenes.moved),),
        # With at most 120 particles, their spread needs more than the maximum whatever these two parameters are.
        **dict.fromkeys(("pf_err", "pf_z"), ((plain_amcl(max_particles=2000), scenes.moved),)),
        "selective_resampling": ((plain_amcl(max_beams=5), scenes.moved),),
        "recovery_alpha_slow": ((plain_amcl(**LOST, recovery_alpha_fast=0.9), scenes.kidnapped),),
        "recovery_alpha_fast": ((plain_amcl(**LOST, recovery_alpha_slow=0.01), scenes.kidnapped),),
        **dict.fromkeys(("z_short", "z_max", "lambda_short"), ((plain_amcl(laser_model_type="beam"), scenes.moved),)),
        **dict.fromkeys(
            ("beam_skip_distance", "beam_skip_threshold", "beam_skip_error_threshold"),
            ((plain_amcl(**LOST, do_beamskip=True, beam_skip_threshold=0.9), scenes.moved),),
        ),
        "do_beamskip": ((plain_amcl(**LOST, beam_skip_threshold=0.9), scenes.moved),),
    }, {"laser_min_range": [0.5, 1.5], "laser_max_range": [0.5, 1.5], "min_particles": [100],
        "laser_likelihood_max_dist": [0.2]}),
    Part(("localizer",), ScanMatchingAmcl, ((amcl(), scenes.moved), (amcl(match_scans=False), scenes.moved)), {
        "alpha5": ((amcl(robot_model="omni", match_scans=False), scenes.moved),),
        "min_particles": ((amcl(min_particles=20), scenes.moved),),
        "selective_resampling": ((amcl(max_beams=5, likelihood_exponent=0.1), scenes.moved),),
        "recovery_alpha_slow": ((amcl(**LOST, **RANDOM, recovery_alpha_fast=0.9), scenes.kidnapped),),
        "recovery_alpha_fast": ((amcl(**LOST, **RANDOM, recovery_alpha_slow=0.01), scenes.kidnapped),),
        "relocalization": ((amcl(), scenes.unknown),),
        "match_scans": ((amcl(), scenes.slipped),),
        **dict.fromkeys(("z_short", "z_max", "lambda_short"), ((amcl(laser_model_type="beam"), scenes.moved),)),
        **dict.fromkeys(
            ("beam_skip_distance", "beam_skip_threshold", "beam_skip_error_threshold"),
            ((amcl(do_beamskip=True, beam_skip_threshold=0.9, settling_distance=0.0), scenes.moved),),
        ),
        "do_beamskip": ((amcl(beam_skip_threshold=0.9, settling_distance=0.0), scenes.moved),),
    }, {"laser_min_range": [0.5, 1.5], "laser_max_range": [0.5, 1.5], "min_particles": [100],
        "laser_likelihood_max_dist": [0.2]}),
    Part(("localizer",), localizers.Ekf, (({"localizer": {"type": "ekf"}}, scenes.slipped),)),
    Part(("localizer",), SlipEkf, (({"localizer": {"type": "slip_ekf"}}, scenes.slipped),)),
    Part(("costmap",), costmaps.Costmap, SEEN, {
        "rolling_size": ((SMALL, scenes.no_map),),
        **dict.fromkeys(SEEN_BY_A_CAMERA, ((TRUTH, scenes.seen_by_a_camera),)),
        **dict.fromkeys(("raytrace_min_range", "inf_is_valid", "track_unknown_space"), ((SMALL, scenes.no_map),)),
    }, {"min_obstacle_height": [0.3], "obstacle_min_range": [1.0], "raytrace_min_range": [2.0]}),
    Part(("costmap", "denoise_layer"), costmaps.DenoiseLayer, (
        ({**TRUTH, "costmap": {"denoise_layer": {"enabled": True}}}, scenes.through),
        ({**TRUTH, "costmap": {"denoise_layer": DENOISE}}, scenes.through)), {
        "enabled": (({**TRUTH, "costmap": {"denoise_layer": {"minimal_group_size": 20}}}, scenes.through),)}),
    Part(("local_costmap",), costmaps.LocalCostmap, SEEN, {
        **dict.fromkeys(("raytrace_min_range", "inf_is_valid"), ((SMALL, scenes.no_map),)),
        **dict.fromkeys(SEEN_BY_A_CAMERA, ((TRUTH, scenes.seen_by_a_camera),)),
    }, {
        "denoise_layer": [{"enabled": True, "minimal_group_size": 20}], "obstacle_min_range": [1.0],
        "raytrace_min_range": [2.0],
    }),
    Part(("goal_checker",), controllers.SimpleGoalChecker, (
        (STRICT, scenes.arriving), (STRICT, scenes.drifting_past))),
    Part(("progress_checker",), controllers.ProgressChecker, (
        ({**TRUTH, "progress_checker": {"movement_time_allowance": 0.5}}, scenes.stuck),
        ({**TRUTH, "progress_checker": {"movement_time_allowance": 1.0}}, scenes.stuck),
    )),
    Part(("recovery",), behaviors.Recovery, ((recovery("backup", "spin", "wait"), scenes.shut),), {
        "number_of_retries": ((recovery("clear_costmap"), scenes.shut),),
        "planner_codes": (
            ({**TRUTH, "recovery": StackSpec(profile="advanced").recovery.model_dump()}, scenes.walled_in),
            (TRUTH, scenes.shut)),
        "wait_duration": ((recovery("wait"), scenes.shut),),
        **dict.fromkeys(("spin_dist", "max_rotational_vel"), ((recovery("spin"), scenes.shut),)),
        "simulate_ahead_time": ((recovery("backup", backup_partial=False), scenes.shut),),
        "backup_partial": ((recovery("backup"), scenes.shut),),
        "retrace_dist": ((recovery("retrace"), scenes.in_a_corridor),),
    }, {"behaviors": [["wait"], ["spin"], ["backup"], ["clear_costmap"], ["retrace"]]}),
    Part(("recovery", "behaviors", 0), behaviors.Spin, (
        (recovery({"type": "spin"}), scenes.shut),), {
        "simulate_ahead_time": ((recovery({"type": "spin"}), scenes.wedged),)}, {"simulate_ahead_time": [0.3]}),
    Part(("recovery", "behaviors", 0), behaviors.Wait, ((recovery({"type": "wait"}), scenes.shut),)),
    Part(("recovery", "behaviors", 0), behaviors.BackUp, (
        (recovery({"type": "backup"}), scenes.shut),
        (recovery({"type": "backup", "backup_partial": False}), scenes.shut),
    )),
    Part(("recovery", "behaviors", 0), Retrace, ((recovery({"type": "retrace"}), scenes.in_a_corridor),), {
        "backup_dist": ((recovery({"type": "retrace"}), scenes.shut),)}),
    Part(("velocity_smoother",), guards.VelocitySmoother, ((TRUTH, scenes.through), (TRUTH, scenes.arriving))),
    Part(("collision_monitor",), guards.CollisionMonitor, (
        (TRUTH, scenes.silent), (BLIND, scenes.seen_by_one), (BLIND, scenes.through))),
    Part(("prediction",), guards.Prediction, (({**TRUTH, "prediction": {"enabled": True}}, scenes.crossed),), {
        "enabled": ((TRUTH, scenes.crossed),)}, {
        "max_range": [1.0], "max_radius": [0.1], "min_speed": [1.0]}),
    Part(("latency",), Latency, ((TRUTH, scenes.seen_by_one), (amcl(), scenes.moved))),
    Part((), StackSpec, ((TRUTH, scenes.through),), {"failure_tolerance": (
        ({**BLIND, "local_costmap": {"obstacle_max_range": 2.5}}, scenes.seen_by_one),)}, {"profile": ["nav2"]}),
    Part(("planner",), planners.OmplPlanner, (
        (planner(), scenes.planned),), {
        **of_planner("bit_star"),
        "max_iterations": ((planner(type="rrt_connect"), scenes.planned),),
        "improving_iterations": ((planner(type="rrt_star", improving_iterations=60), scenes.planned),),
        "range": ((planner(type="rrt_connect"), scenes.planned),),
        "goal_bias": ((planner(type="kpiece"), scenes.planned),),
        "state_space": ((planner(), scenes.planned), (planner(state_space="se2"), scenes.planned)),
    }, {"max_iterations": [1, 3], "improving_iterations": [5, 30]}),
    Part(("planner",), MedialAxisPlanner, ((planner(type="medial_axis"), scenes.planned),), {
        **of_planner("medial_axis"),
        "state_space": (
            (planner(type="medial_axis"), scenes.planned),
            (planner(type="medial_axis", state_space="se2"), scenes.planned),
        ),
    }, {"max_iterations": [1, 3]}),
    Part(("planner",), planners.Navfn, ((planner(type="navfn"), scenes.planned),), of_planner("navfn")),
    Part(("planner",), planners.Smac2d, ((planner(type="smac_2d"), scenes.planned),), of_planner("smac_2d")),
]  # fmt: skip
ELSEWHERE = {
    "Amcl.parameters": "tests/diagnostics/meaningless/deprecated_amcl_parameters.scenario.yaml",
    "StackSpec.keepout": "tests/scenarios/test_masks.py",
    "StackSpec.speed_zones": "tests/unit/run/test_costmap_filters.py",
    "StackSpec.keepout_mask": "tests/scenarios/test_masks.py",
    "StackSpec.speed_mask": "tests/scenarios/test_masks.py",
    "StackSpec.nav2_params": "tests/unit/loading/stacks/test_nav2_parameters.py",
    "StackSpec.latency": "tests/unit/run/test_latency.py",  # `robot` is what the robot's file says
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
    # Whoever makes goals reads these.
    "SimpleGoalChecker.xy_goal_tolerance": "tests/unit/run/test_goal_tolerances.py",
    "SimpleGoalChecker.yaw_goal_tolerance": "tests/unit/run/test_goal_tolerances.py",
}
"""Fields that show in no scene here, and the tests in which they do."""


def left_out(kind: type[BaseModel], name: str) -> bool:
    """Whether a field is not tried here: it has a test of its own, or another value of it makes another model."""
    return f"{kind.__name__}.{name}" in ELSEWHERE or (name == "type" and kind is not planners.OmplPlanner)


OTHERS_CARE = {planners.PlannerSpec, ControllerSpec, controllers.GoalCheckerSpec, SpeedZone, SpeedMask}
"""What all planners and goal checkers have is tried with each; controllers and zones have tests of their own."""


def models_in(kind: Any) -> Iterator[type[BaseModel]]:
    """The specifications that a field of this type may hold, and those in them."""
    if get_origin(kind) in (Annotated, Union, UnionType, list):
        for member in get_args(kind):
            yield from models_in(member)
    elif isinstance(kind, type) and issubclass(kind, BaseModel):
        yield kind
        for field in kind.model_fields.values():
            yield from models_in(field.annotation)


class Other(NamedTuple):
    """A field of a part with other values, of which one must count."""

    part: Part
    name: str
    values: list[Any]

    def __str__(self) -> str:
        told = f"={self.values[0]}" if len(self.values) == 1 else ""
        return f"{self.part.kind.__name__}.{self.name}{told}"


def others() -> Iterator[Other]:
    for part in PARTS:
        for name, field in part.kind.model_fields.items():
            if left_out(part.kind, name):
                continue
            if name in part.values:
                found = [part.values[name]]
            else:
                found = othervalues.others(field.annotation, field.default)
            yield from (Other(part, name, values) for values in found)


def with_value(start: Any, way: tuple[str | int, ...], name: str, value: Any) -> Any:
    if not way:
        return {**start, name: value}
    first, *rest = way
    if isinstance(first, int):
        inner = with_value(start[first], tuple(rest), name, value)
        return [inner if number == first else each for number, each in enumerate(start)]
    return {**start, first: with_value(start.get(first, {}), tuple(rest), name, value)}


class Usual:
    """What is decided in a scene with what is said to begin with, as far as anybody asked."""

    known: dict[tuple[str, str], "Usual"] = {}

    def __init__(self, said: Said, scene: Scene) -> None:
        self._told: list[object] = []
        self._more = scene(StackSpec.model_validate(said))

    @classmethod
    def of(cls, said: Said, scene: Scene) -> "Usual":
        key = (repr(said), scene.__name__)
        if key not in cls.known:
            cls.known[key] = cls(said, scene)
        return cls.known[key]

    def __iter__(self) -> Iterator[object]:
        number = 0
        while True:
            if number == len(self._told):
                try:
                    self._told.append(hash(next(self._more)))
                except StopIteration:
                    return
            yield self._told[number]
            number += 1


def counts(other: Other, value: Any) -> bool:
    """Whether something else is decided with this value, anywhere."""
    for said, scene in other.part.special.get(other.name, other.part.tries):
        try:
            spec = StackSpec.model_validate(with_value(said, other.part.way, other.name, value))
        except ValidationError:
            continue
        if spec == StackSpec.model_validate(said):
            continue
        told = (hash(each) for each in scene(spec))
        if any(one != another for one, another in zip_longest(told, Usual.of(said, scene))):
            return True
    return False


OTHERS = list(others())


@pytest.mark.sample(20)
@pytest.mark.parametrize("other", OTHERS, ids=str)
def test_another_value_changes_a_decision(other: Other) -> None:
    assert any(counts(other, value) for value in other.values)


def test_unchanged_values_change_no_decision() -> None:
    """Otherwise a change shows nothing."""
    scene = scenes.seen_by_one
    assert [*scene(StackSpec.model_validate(amcl()))] == [*scene(StackSpec.model_validate(amcl()))]


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.kind.__name__)
def test_every_field_is_tried(part: Part) -> None:
    tried = {other.name for other in OTHERS if other.part is part}
    holding = {name for name, field in part.kind.model_fields.items() if any(models_in(field.annotation))}
    elsewhere = {name for name in part.kind.model_fields if left_out(part.kind, name)}
    assert part.kind.model_fields.keys() <= tried | elsewhere | holding


def test_every_model_is_tried() -> None:
    """Those that a stack holds, and those of the shipped components."""
    groups = ("localizer", "planner", "behavior", "goal_checker")
    roots = [StackSpec, *(entry.load() for group in groups for entry in all_types(group))]
    holding = {
        kind for root in roots for kind in models_in(root) if any(not left_out(kind, n) for n in kind.model_fields)
    }
    assert holding - OTHERS_CARE == {part.kind for part in PARTS}


@pytest.mark.parametrize("field", ELSEWHERE)
def test_every_excluded_parameter_names_its_test(field: str) -> None:
    text = (Path(__file__).parents[3] / ELSEWHERE[field]).read_text(encoding="utf-8")
    assert re.search(rf"\b{field.partition('.')[2]}\b", text)
