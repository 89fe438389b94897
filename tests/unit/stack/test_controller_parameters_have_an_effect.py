"""Tests that each parameter of a controller changes a command."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import other_values
import pytest
from pydantic import BaseModel, ValidationError

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Path
from simscen.model.controllers import CONTROLLERS, ControllerSpec, DynamicWindow, RegulatedPurePursuit
from simscen.model.costmaps import Costmap as CostmapSpec
from simscen.model.mppi import Mppi
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel, Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, box_robot, round_robot, setting

ROUND, OMNI, BOX = round_robot(speed=1.2), round_robot(speed=1.2, max_lateral=0.6), box_robot(0.6, 0.3)
CAR = round_robot(speed=1.2, turning_radius=0.6)
FAST_TURNING = replace(round_robot(speed=1.2, max_angular=3.0), angular_acceleration=9.0)


class Step(NamedTuple):
    """Input of one call of the controller."""

    pose: Pose2
    twist: Twist = Twist()
    path: tuple[tuple[float, float], ...] = ()
    """Corners of a new path; empty if the path stays the same."""


class Probe(NamedTuple):
    """A few calls of the controller in a world with boxes."""

    robot: RobotModel
    boxes: tuple[tuple[float, float, float, float], ...]
    goal: Pose2
    steps: tuple[Step, ...]


AHEAD, LEFT, RIGHT = ((0, 0), (4, 0)), ((0, 0), (0, 1), (4, 0)), ((0, 0), (0, -1), (4, 0))
BEND = ((0, 0), (0.8, 0), (1.5, 0.7), (1.5, 3))
LOOP = ((0, 0), (1, 0), (1, 0.3), (0, 0.3), (0, 3))
"""A path that passes its own start after 2.3 m."""
FAR = Pose2(4.0, 0.0, 1.0)
MOVING = Twist(0.3, 0.0, 0.2)


def path_probe(robot: RobotModel, path: Any, pose: Pose2, *boxes: Any, twist: Twist = MOVING, n: int = 2) -> Probe:
    """Return a probe with `n` equal calls along a new path; its end is the goal."""
    return Probe(robot, boxes, Pose2(*path[-1], 1.0), (Step(pose, twist, path), *[Step(pose, twist)] * (n - 1)))


def common_probes(robot: RobotModel) -> list[Probe]:
    """Return probes in which most parameters have an effect."""
    wall, side_wall, near_wall = (0.9, -2, 1.1, 2), (-2, 0.45, 4, 0.6), (0.45, -2, 0.6, 2)
    return [
        path_probe(robot, BEND, Pose2(0.1, 0.1, 0.2)),
        path_probe(robot, BEND, Pose2(0.1, 0.1, 0.2), (1.2, -0.6, 1.6, -0.2), (0.3, 0.6, 0.6, 1.0)),
        path_probe(robot, AHEAD, Pose2(0.1, 0.1, 0.1), side_wall, (2, -1, 2.4, -0.4), twist=Twist(0.5)),
        path_probe(robot, AHEAD, Pose2(0.1, 0.0, 1.0)),
        path_probe(robot, AHEAD, Pose2(0.1, 0.0, 2.6)),
        path_probe(robot, AHEAD, Pose2(0.1, 0.05, 0.0), wall, twist=Twist(0.5)),
        path_probe(robot, AHEAD, Pose2(0.1, 0.0, 0.0), near_wall),
        path_probe(robot, ((0, 0), (0.7, 0)), Pose2(0.0, 0.05, 0.2)),
        path_probe(robot, ((0, 0), (0.3, 0)), Pose2(0.0, 0.05, -0.2)),
        path_probe(robot, ((0, 0), (0.3, 0)), Pose2(0.27, 0.0, -0.6), twist=Twist(0.3)),
        path_probe(robot, ((0, 0), (0.3, 0)), Pose2(0.27, 0.0, -0.6), twist=Twist(0.1)),
        path_probe(robot, AHEAD, Pose2(0.1, 0.05, 0.0), (1.0, -0.1, 1.3, 0.1), twist=Twist(0.6)),
        path_probe(robot, AHEAD, Pose2(0.1, 0.0, 0.0), twist=Twist(0.9)),
        path_probe(robot, ((0, 0), (-3, 0.2)), Pose2(0.0, 0.0, 0.1)),
        path_probe(robot, ((0, 0), (-3, 0.2)), Pose2(0.0, 0.0, 0.1), twist=Twist(0.0, 0.0, 1.75)),
        path_probe(robot, BEND, Pose2(0.1, 0.1, 0.2), twist=Twist(0.05)),
        path_probe(robot, BEND, Pose2(0.1, 0.1, 0.2), twist=Twist(0.9)),
        path_probe(robot, AHEAD, Pose2(0.1, 0.0, 0.1), (-2, 0.3, 4, 0.5)),
        path_probe(robot, ((0, 0), (0.3, 0)), Pose2(0.0, 0.0, 0.0), n=1),
        path_probe(robot, ((0, 0), (0.3, 0)), Pose2(0.27, 0.0, 0.5), twist=Twist(0.2)),
        Probe(robot, (), FAR, (Step(Pose2(0.27, 0.0), MOVING, ((0, 0), (0.3, 0))),)),
        path_probe(robot, ((0, 0), (0.3, 0)), Pose2(0.0, 0.05, -2.0)),
        path_probe(robot, ((0, 0), (0.3, 0)), Pose2(0.15, 0.0, 0.5), twist=Twist(0.2)),
        path_probe(robot, LOOP, Pose2(0.0, 0.28, 0.1)),
    ]


OSCILLATION = [
    Probe(ROUND, (), FAR, tuple(Step(pose, Twist(), path) for pose, path in zip(
        (Pose2(0, 0, 0), Pose2(0, 0, 0), moved, moved), (LEFT, RIGHT, LEFT, LEFT), strict=True)))
    for moved in (Pose2(0, 0, 0), Pose2(0.08, 0, 0), Pose2(0.03, 0, 0), Pose2(0, 0, 0.3), Pose2(0, 0, 0.15))
]  # fmt: skip
"""Probes with paths to the left, right, and left, for a robot that stands, has moved, or has turned."""

COLLISION = Probe(
    round_robot(speed=1.2, linear_acceleration=0.1, linear_deceleration=0.1), ((0.9, -2, 1.1, 2),), FAR,
    (Step(Pose2(0.5, 0.0), Twist(1.0), AHEAD), Step(Pose2(-1.5, 0.0))),
)  # fmt: skip
"""The robot cannot stop before the wall in the first call, and is in free space in the second one."""

DETOUR = path_probe(ROUND, AHEAD, Pose2(0.0, 0.3), (0.25, -0.3, 0.9, -0.05), twist=Twist(0.5))

SMALL_MPPI = {"type": "mppi", "batch_size": 60, "time_steps": 30}
BASE_SPECS: dict[type[ControllerSpec], list[dict[str, Any]]] = {
    RegulatedPurePursuit: [
        {},
        {"use_velocity_scaled_lookahead_dist": False, "use_fixed_curvature_lookahead": True},
        {"use_velocity_scaled_lookahead_dist": False},
        {"rotate_to_heading_min_angle": 0.1},
        {"desired_linear_vel": 1.2},
    ],
    DynamicWindow: [
        {"type": "dwb", "vx_samples": 7, "vtheta_samples": 7, "sim_time": 1.0, "min_vel_x": -0.2},
        {"type": "dwb", "vx_samples": 9, "vtheta_samples": 9, "min_speed_xy": 0.2, "min_speed_theta": 0.5},
        {"type": "dwb", "vx_samples": 9, "vtheta_samples": 9, "max_vel_x": 1.0, "goal_dist_scale": 0.0},
        {"type": "dwb", "vx_samples": 9, "vtheta_samples": 9, "max_vel_x": 0.05, "oscillation_reset_angle": 9.0},
        {"type": "dwb", "vx_samples": 9, "vtheta_samples": 9, "max_vel_x": 0.05, "oscillation_reset_dist": 9.0},
    ],
    Mppi: [
        SMALL_MPPI,
        {**SMALL_MPPI, "critics": ["ConstraintCritic", "ObstaclesCritic", "PathFollowCritic", "TwirlingCritic"]},
        {**SMALL_MPPI, "critics": ["ConstraintCritic", "ObstaclesCritic"], "ObstaclesCritic": {"critical_weight": 0.0}},
        {
            **SMALL_MPPI,
            "PathAngleCritic": {"mode": 1},
            "PathAlignCritic": {"offset_from_furthest": 5, "max_path_occupancy_ratio": 1.0},
        },
        {**SMALL_MPPI, "CostCritic": {"near_collision_cost": 100, "near_goal_distance": 0.5}, "wz_max": 0.2},
        {**SMALL_MPPI, "critics": ["ConstraintCritic", "PathFollowCritic"]},
        {**SMALL_MPPI, "command_free_time": 12.0},
        {
            **SMALL_MPPI,
            "critics": ["PathFollowCritic", "VelocityDeadbandCritic"],
            "VelocityDeadbandCritic": {"deadband_velocities": [0.3, 0.0, 0.5]},
        },
    ],
}
PROBES: dict[type[ControllerSpec], list[Probe]] = {
    RegulatedPurePursuit: [*common_probes(ROUND), *common_probes(FAST_TURNING)],
    DynamicWindow: [*common_probes(ROUND), *common_probes(OMNI), *OSCILLATION],
    Mppi: [
        *common_probes(ROUND),
        *common_probes(OMNI)[:4],
        *common_probes(BOX)[2:7],
        *common_probes(CAR)[:5],
        DETOUR,
        COLLISION,
    ],
}


@cache
def view_of(robot: RobotModel, boxes: tuple[tuple[float, float, float, float], ...]) -> CostmapView:
    grid = Flatland(list(boxes)).grid((-3.5, -2.5, 5.0, 3.5))
    return LayeredCostmap(CostmapSpec(), Surroundings(robot, grid, TICK_RATE_HZ)).view


def dense_path(corners: tuple[tuple[float, float], ...]) -> Path:
    """Return the path through the corners with a point every 5 cm."""
    pieces = [np.linspace(a, b, max(2, round(np.hypot(b[0] - a[0], b[1] - a[1]) / 0.05)), endpoint=False)
              for a, b in pairwise(corners)]  # fmt: skip
    points = np.vstack((*pieces, corners[-1]))
    headings = np.arctan2(*np.diff(points, axis=0)[:, ::-1].T)
    return Path(np.column_stack((points, np.append(headings, headings[-1]))))


def results_of(spec: ControllerSpec, probe: Probe) -> list[Any]:
    """Return the command or the failure of each call."""
    controller = spec.implementation()(spec, setting(probe.robot))
    results: list[Any] = []
    for step in probe.steps:
        if step.path:
            controller.set_path(dense_path(step.path))
        try:
            view, goal = view_of(probe.robot, probe.boxes), Goal("g", probe.goal)
            results.append(controller.command(step.pose, step.twist, view, goal))
        except NavigationFailure as failure:
            results.append((failure.code, str(failure)))
    return results


class FieldValues(NamedTuple):
    """Field, given by the keys that lead to it, with values of which at least one must change a command."""

    spec: type[ControllerSpec]
    keys: tuple[str, ...]
    values: list[Any]

    def __str__(self) -> str:
        text = f"={self.values[0]}" if len(self.values) == 1 else ""
        return f"{self.spec.__name__}.{'.'.join(self.keys)}{text}"


def field_values(
    spec: type[ControllerSpec], model: type[BaseModel], keys: tuple[str, ...] = ()
) -> Iterator[FieldValues]:
    """Yield the fields of the model and its nested models, with each group of values that are valid on their own."""
    for name, field in model.model_fields.items():
        kind, default = field.annotation, field.default
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            yield from field_values(spec, kind, (*keys, name))
        elif name != "type":
            for group in other_values.other_value_groups(kind, default):
                if values := [value for value in group if is_valid(model, name, value)]:
                    yield FieldValues(spec, (*keys, name), values)


def is_valid(model: type[BaseModel], name: str, value: Any) -> bool:
    """Return whether the value has a valid type and range; it may contradict the default values of other fields."""
    try:
        model.model_validate({**({"type": "dwb"} if model is DynamicWindow else {}),
                              **({"type": "mppi"} if model is Mppi else {}), name: value})  # fmt: skip
    except ValidationError as error:
        return all(problem["type"] == "value_error" for problem in error.errors())
    return True


def with_value(start: dict[str, Any], keys: tuple[str, ...], value: Any) -> dict[str, Any]:
    first, *rest = keys
    return {**start, first: with_value(start.get(first, {}), tuple(rest), value) if rest else value}


@cache
def base_results(spec: type[ControllerSpec], start: int, probe: int) -> list[Any]:
    return results_of(spec.model_validate(BASE_SPECS[spec][start]), PROBES[spec][probe])


def changed_specs(field: FieldValues) -> Iterator[tuple[int, ControllerSpec]]:
    """Yield the index of each base specification, and this specification with each of the values.

    Base specifications that set the part of the field come first, as the field has an effect there most likely.
    """
    for index, base in sorted(enumerate(BASE_SPECS[field.spec]), key=lambda item: field.keys[0] not in item[1]):
        for value in field.values:
            try:
                spec = field.spec.model_validate(with_value(base, field.keys, value))
            except ValidationError:
                continue
            if spec != field.spec.model_validate(base):
                yield index, spec


FIELD_VALUES = [field for spec in BASE_SPECS for field in field_values(spec, spec)]
CASES = [
    pytest.param(field, id=str(field), marks=[pytest.mark.slow] if index % 3 else [])
    for index, field in enumerate(FIELD_VALUES)
]
"""At most every third case runs in `make test`; all cases run in `make test-all`."""


@pytest.mark.sample(12)
@pytest.mark.parametrize("field", CASES)
def test_another_value_changes_a_command(field: FieldValues) -> None:
    probes, specs = [*enumerate(PROBES[field.spec])][::-1], list(changed_specs(field))
    assert any(
        results_of(spec, probe) != base_results(field.spec, spec_index, probe_index)
        for probe_index, probe in probes
        for spec_index, spec in specs
    )


def test_every_field_is_tested() -> None:
    tested = {(field.spec, field.keys[0]) for field in FIELD_VALUES}
    assert tested == {(spec, name) for spec in BASE_SPECS for name in spec.model_fields if name != "type"}


def test_every_shipped_controller_is_tested() -> None:
    assert {f"{spec.__module__}:{spec.__name__}" for spec in BASE_SPECS} == set(CONTROLLERS.values())
