"""Tests that each parameter of a controller has an effect."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import othervalues
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
TURNED = replace(round_robot(speed=1.2, max_angular=3.0), angular_acceleration=9.0)


class Step(NamedTuple):
    """One command that is asked for."""

    pose: Pose2
    twist: Twist = Twist()
    path: tuple[tuple[float, float], ...] = ()
    """Corners of a new path, where there is one."""


class Probe(NamedTuple):
    """A few commands in one place."""

    robot: RobotModel
    boxes: tuple[tuple[float, float, float, float], ...]
    goal: Pose2
    steps: tuple[Step, ...]


AHEAD, LEFT, RIGHT = ((0, 0), (4, 0)), ((0, 0), (0, 1), (4, 0)), ((0, 0), (0, -1), (4, 0))
BEND = ((0, 0), (0.8, 0), (1.5, 0.7), (1.5, 3))
RETURNING = ((0, 0), (1, 0), (1, 0.3), (0, 0.3), (0, 3))
"""A path that passes its own start after 2.3 m."""
FAR = Pose2(4.0, 0.0, 1.0)
MOVING = Twist(0.3, 0.0, 0.2)


def following(robot: RobotModel, path: Any, pose: Pose2, *boxes: Any, twist: Twist = MOVING, n: int = 2) -> Probe:
    """The same place asked `n` times, from a first moment on; the path's end is the goal."""
    return Probe(robot, boxes, Pose2(*path[-1], 1.0), (Step(pose, twist, path), *[Step(pose, twist)] * (n - 1)))


def common(robot: RobotModel) -> list[Probe]:
    """Places that tell most parameters."""
    wall, beside, close = (0.9, -2, 1.1, 2), (-2, 0.45, 4, 0.6), (0.45, -2, 0.6, 2)
    return [
        following(robot, BEND, Pose2(0.1, 0.1, 0.2)),
        following(robot, BEND, Pose2(0.1, 0.1, 0.2), (1.2, -0.6, 1.6, -0.2), (0.3, 0.6, 0.6, 1.0)),
        following(robot, AHEAD, Pose2(0.1, 0.1, 0.1), beside, (2, -1, 2.4, -0.4), twist=Twist(0.5)),
        following(robot, AHEAD, Pose2(0.1, 0.0, 1.0)),
        following(robot, AHEAD, Pose2(0.1, 0.0, 2.6)),
        following(robot, AHEAD, Pose2(0.1, 0.05, 0.0), wall, twist=Twist(0.5)),
        following(robot, AHEAD, Pose2(0.1, 0.0, 0.0), close),
        following(robot, ((0, 0), (0.7, 0)), Pose2(0.0, 0.05, 0.2)),
        following(robot, ((0, 0), (0.3, 0)), Pose2(0.0, 0.05, -0.2)),
        following(robot, ((0, 0), (0.3, 0)), Pose2(0.27, 0.0, -0.6), twist=Twist(0.3)),
        following(robot, ((0, 0), (0.3, 0)), Pose2(0.27, 0.0, -0.6), twist=Twist(0.1)),
        following(robot, AHEAD, Pose2(0.1, 0.05, 0.0), (1.0, -0.1, 1.3, 0.1), twist=Twist(0.6)),
        following(robot, AHEAD, Pose2(0.1, 0.0, 0.0), twist=Twist(0.9)),
        following(robot, ((0, 0), (-3, 0.2)), Pose2(0.0, 0.0, 0.1)),
        following(robot, ((0, 0), (-3, 0.2)), Pose2(0.0, 0.0, 0.1), twist=Twist(0.0, 0.0, 1.75)),
        following(robot, BEND, Pose2(0.1, 0.1, 0.2), twist=Twist(0.05)),
        following(robot, BEND, Pose2(0.1, 0.1, 0.2), twist=Twist(0.9)),
        following(robot, AHEAD, Pose2(0.1, 0.0, 0.1), (-2, 0.3, 4, 0.5)),
        following(robot, ((0, 0), (0.3, 0)), Pose2(0.0, 0.0, 0.0), n=1),
        following(robot, ((0, 0), (0.3, 0)), Pose2(0.27, 0.0, 0.5), twist=Twist(0.2)),
        Probe(robot, (), FAR, (Step(Pose2(0.27, 0.0), MOVING, ((0, 0), (0.3, 0))),)),
        following(robot, ((0, 0), (0.3, 0)), Pose2(0.0, 0.05, -2.0)),
        following(robot, ((0, 0), (0.3, 0)), Pose2(0.15, 0.0, 0.5), twist=Twist(0.2)),
        following(robot, RETURNING, Pose2(0.0, 0.28, 0.1)),
    ]


SWINGING = [
    Probe(ROUND, (), FAR, tuple(Step(pose, Twist(), path) for pose, path in zip(
        (Pose2(0, 0, 0), Pose2(0, 0, 0), moved, moved), (LEFT, RIGHT, LEFT, LEFT), strict=True)))
    for moved in (Pose2(0, 0, 0), Pose2(0.08, 0, 0), Pose2(0.03, 0, 0), Pose2(0, 0, 0.3), Pose2(0, 0, 0.15))
]  # fmt: skip
"""The path leads left, right, left, while the robot stands, or has come some way, or has turned."""

DOOMED = Probe(
    round_robot(speed=1.2, linear_acceleration=0.1, linear_deceleration=0.1), ((0.9, -2, 1.1, 2),), FAR,
    (Step(Pose2(0.5, 0.0), Twist(1.0), AHEAD), Step(Pose2(-1.5, 0.0))),
)  # fmt: skip
"""Nothing keeps it from the wall; after that it is free."""

AROUND = following(ROUND, AHEAD, Pose2(0.0, 0.3), (0.25, -0.3, 0.9, -0.05), twist=Twist(0.5))

SHORT = {"type": "mppi", "batch_size": 60, "time_steps": 30}
STARTS: dict[type[ControllerSpec], list[dict[str, Any]]] = {
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
        SHORT,
        {**SHORT, "critics": ["ConstraintCritic", "ObstaclesCritic", "PathFollowCritic", "TwirlingCritic"]},
        {**SHORT, "critics": ["ConstraintCritic", "ObstaclesCritic"], "ObstaclesCritic": {"critical_weight": 0.0}},
        {
            **SHORT,
            "PathAngleCritic": {"mode": 1},
            "PathAlignCritic": {"offset_from_furthest": 5, "max_path_occupancy_ratio": 1.0},
        },
        {**SHORT, "CostCritic": {"near_collision_cost": 100, "near_goal_distance": 0.5}, "wz_max": 0.2},
        {**SHORT, "critics": ["ConstraintCritic", "PathFollowCritic"]},
        {**SHORT, "command_free_time": 12.0},
        {
            **SHORT,
            "critics": ["PathFollowCritic", "VelocityDeadbandCritic"],
            "VelocityDeadbandCritic": {"deadband_velocities": [0.3, 0.0, 0.5]},
        },
    ],
}
PROBES: dict[type[ControllerSpec], list[Probe]] = {
    RegulatedPurePursuit: [*common(ROUND), *common(TURNED)],
    DynamicWindow: [*common(ROUND), *common(OMNI), *SWINGING],
    Mppi: [*common(ROUND), *common(OMNI)[:4], *common(BOX)[2:7], *common(CAR)[:5], AROUND, DOOMED],
}


@cache
def view_of(robot: RobotModel, boxes: tuple[tuple[float, float, float, float], ...]) -> CostmapView:
    grid = Flatland(list(boxes)).grid((-3.5, -2.5, 5.0, 3.5))
    return LayeredCostmap(CostmapSpec(), Surroundings(robot, grid, TICK_RATE_HZ)).view


def dense(corners: tuple[tuple[float, float], ...]) -> Path:
    pieces = [np.linspace(a, b, max(2, round(np.hypot(b[0] - a[0], b[1] - a[1]) / 0.05)), endpoint=False)
              for a, b in pairwise(corners)]  # fmt: skip
    points = np.vstack((*pieces, corners[-1]))
    headings = np.arctan2(*np.diff(points, axis=0)[:, ::-1].T)
    return Path(np.column_stack((points, np.append(headings, headings[-1]))))


def answers(spec: ControllerSpec, probe: Probe) -> list[Any]:
    """The commands, or how they failed."""
    controller = spec.implementation()(spec, setting(probe.robot))
    results: list[Any] = []
    for step in probe.steps:
        if step.path:
            controller.set_path(dense(step.path))
        try:
            view, goal = view_of(probe.robot, probe.boxes), Goal("g", probe.goal)
            results.append(controller.command(step.pose, step.twist, view, goal))
        except NavigationFailure as failure:
            results.append((failure.code, str(failure)))
    return results


class Other(NamedTuple):
    """A field, by the way to it, with another value; of a number there are several to try."""

    spec: type[ControllerSpec]
    keys: tuple[str, ...]
    values: list[Any]

    def __str__(self) -> str:
        text = f"={self.values[0]}" if len(self.values) == 1 else ""
        return f"{self.spec.__name__}.{'.'.join(self.keys)}{text}"


def fields(spec: type[ControllerSpec], model: type[BaseModel], way: tuple[str, ...] = ()) -> Iterator[Other]:
    """Every field of the model and of those in it, with each of its other values that is valid by itself."""
    for name, field in model.model_fields.items():
        kind, default = field.annotation, field.default
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            yield from fields(spec, kind, (*way, name))
        elif name != "type":
            for group in othervalues.others(kind, default):
                if values := [value for value in group if valid(model, name, value)]:
                    yield Other(spec, (*way, name), values)


def valid(model: type[BaseModel], name: str, value: Any) -> bool:
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
def usual(spec: type[ControllerSpec], start: int, probe: int) -> list[Any]:
    return answers(spec.model_validate(STARTS[spec][start]), PROBES[spec][probe])


def changed(other: Other) -> Iterator[tuple[int, ControllerSpec]]:
    """The specifications to begin with, by number, each with each of the other values; first what names its part."""
    for start, values in sorted(enumerate(STARTS[other.spec]), key=lambda each: other.keys[0] not in each[1]):
        for value in other.values:
            try:
                spec = other.spec.model_validate(with_value(values, other.keys, value))
            except ValidationError:
                continue
            if spec != other.spec.model_validate(values):
                yield start, spec


OTHERS = [other for spec in STARTS for other in fields(spec, spec)]
CASES = [
    pytest.param(other, id=str(other), marks=[pytest.mark.slow] if number % 3 else [])
    for number, other in enumerate(OTHERS)
]
"""Every third is tried by `make test`, the others by `make test-all`."""


@pytest.mark.sample(12)
@pytest.mark.parametrize("other", CASES)
def test_another_value_changes_a_command(other: Other) -> None:
    probes, tried = [*enumerate(PROBES[other.spec])][::-1], list(changed(other))
    assert any(
        answers(spec, probe) != usual(other.spec, start, number) for number, probe in probes for start, spec in tried
    )


def test_every_field_is_tried() -> None:
    tried = {(other.spec, other.keys[0]) for other in OTHERS}
    assert tried == {(spec, name) for spec in STARTS for name in spec.model_fields if name != "type"}


def test_every_shipped_controller_is_tried() -> None:
    assert {f"{spec.__module__}:{spec.__name__}" for spec in STARTS} == set(CONTROLLERS.values())
