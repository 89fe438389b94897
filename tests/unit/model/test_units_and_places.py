"""Tests that numbers and poses in all files accept units and names of places."""

import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import pytest
from annotated_types import MaxLen, MinLen
from pydantic import BaseModel, TypeAdapter, ValidationError

sys.path.insert(0, str(Path(__file__).parents[2]))
from everyfield import Written, every_value

from simscen.model.controllers import DynamicWindow
from simscen.model.localizers import Amcl
from simscen.model.robot import SkidSteer
from simscen.model.scenario import Physics, ScenarioSpec
from simscen.model.sensors import InertialUnit
from simscen.spec.places import PlaceAllowed, PoseSpec, Ring
from simscen.spec.quantities import AnyQuantity, Quantity

NUMBERS_WITHOUT_UNITS = {
    "SpeedMask.base": "percent or m/s, as `type` says: CostmapFilterInfo has one number for both",
    "SpeedMask.multiplier": "percent or m/s for each unit of a cell's value, as `type` says",
    "Amcl.alpha1": "variances of unlike things for each other (Thrun et al., table 5.6), 0.2 in every file of Nav2",
    "Amcl.alpha2": "likewise",
    "Amcl.alpha3": "likewise",
    "Amcl.alpha4": "likewise",
    "Amcl.alpha5": "likewise",
    "Amcl.pf_z": "a quantile of the standard normal distribution",
    "ScanMatchingAmcl.alpha1": "as for `Amcl`",
    "ScanMatchingAmcl.alpha2": "as for `Amcl`",
    "ScanMatchingAmcl.alpha3": "as for `Amcl`",
    "ScanMatchingAmcl.alpha4": "as for `Amcl`",
    "ScanMatchingAmcl.alpha5": "as for `Amcl`",
    "ScanMatchingAmcl.pf_z": "as for `Amcl`",
    "ScanMatchingAmcl.lambda_short": "as for `Amcl`",
    "ScanMatchingAmcl.likelihood_exponent": "an exponent",
    "OmplPlanner.cost_travel_multiplier": "a factor of costs, as in every file of Nav2",
    "OmplPlanner.rewire_factor": "a factor",
    "Smac2d.cost_travel_multiplier": "likewise",
    "MedialAxisPlanner.cost_travel_multiplier": "likewise",
    "Costmap.cost_scaling_factor": "an exponent for each meter, 3.0 in every file of Nav2",
    "LocalCostmap.cost_scaling_factor": "likewise",
    "Amcl.lambda_short": "an exponent for each meter, 0.1 in every file of Nav2",
    "DynamicWindow.base_obstacle_scale": "a weight of a critic",
    "DynamicWindow.path_align_scale": "a weight of a critic",
    "DynamicWindow.path_dist_scale": "a weight of a critic",
    "DynamicWindow.goal_align_scale": "a weight of a critic",
    "DynamicWindow.goal_dist_scale": "a weight of a critic",
    "DynamicWindow.rotate_to_goal_scale": "a weight of a critic",
    "DynamicWindow.slowing_factor": "a weight of a critic",
    "DynamicWindow.twirling_scale": "a weight of a critic",
    **{
        f"Mppi{critic}Critic.cost_weight": "a weight of a critic"
        for critic in (
            "Constraint",
            "Cost",
            "Goal",
            "GoalAngle",
            "PathAlign",
            "PathFollow",
            "PathAngle",
            "PreferForward",
            "Twirling",
            "VelocityDeadband",
        )
    },
    "MppiCostCritic.critical_cost": "a cost, as the costmap's",
    "MppiCostCritic.collision_cost": "a cost, as the costmap's",
    "MppiObstaclesCritic.repulsion_weight": "a weight of a critic",
    "MppiObstaclesCritic.critical_weight": "a weight of a critic",
    "MppiObstaclesCritic.collision_cost": "a cost",
    "Mppi.temperature": "of a softmax over costs without a dimension",
    "Mppi.gamma": "a weight of costs",
    "OdometryFilter.process_noise_covariance": "variances, as in robot_localization",
    "OdometryFilter.odom0_twist_rejection_threshold": "a number of standard deviations, as in robot_localization",
    "Smoothness.min_sparc": "spectral arc length, which has no dimension",
    "Smoothness.min_ldlj": "a logarithm of dimensionless jerk",
    "RobotSpec.arguments": "whatever the xacro file makes of it",
}
"""Numbers that accept no unit, and why."""

POSES_WITHOUT_PLACES = {
    "WorldSpec.places": "they are what the names stand for",
    "WorldSpec.regions": "an area is drawn, corner by corner",
    "Part.pose": "in the robot's frame",
    "RobotSpec.footprint": "in the robot's frame",
    "Outdated.missing": "an area is drawn, corner by corner",
    "Outdated.extra": "likewise",
    "Spawn.ahead": "in the robot's frame",
    **{f"{shape}.polygon": "in the frame of the object" for shape in ("Obstacle", "Movable", "Part", "Spawn")},
    **{f"{shape}.cylinder": "radius and height" for shape in ("Obstacle", "Movable", "Part", "Spawn")},
}
"""Poses and pairs of lengths that are no places of the world, and why."""


def _bare_numbers() -> Iterator[Written]:
    for value in every_value():
        if value.kind is float and not any(isinstance(mark, Quantity | AnyQuantity) for mark in value.marks):
            yield value


def _poses_and_points() -> Iterator[Written]:
    """Models of poses, and lists of two lengths."""
    for value in every_value():
        lengths = any(isinstance(mark, Quantity) and mark.dimension == "length" for mark in value.marks)
        if (lengths and {MinLen(2), MaxLen(2)} <= {*value.marks}) or is_pose(value.kind):
            yield value


def is_pose(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, PoseSpec)


def test_every_number_with_a_dimension_accepts_a_unit() -> None:
    assert {str(value) for value in _bare_numbers()} == set(NUMBERS_WITHOUT_UNITS)


@pytest.mark.parametrize(
    ("model", "key", "text", "value"),
    [
        (ScenarioSpec, "linger", "2 s", 2.0),
        (Physics, "tick_rate", "0.24 kHz", 240),
        (Amcl, "update_min_a", "12 deg", math.radians(12)),
        (DynamicWindow, "min_vel_x", "-36 km/h", -10.0),
        (InertialUnit, "accelerometer_noise", "2 cm/s^2", 0.02),
        (SkidSteer, "turning_scale", "150 %", 1.5),
    ],
)
def test_numbers_accept_units(model: type[BaseModel], key: str, text: str, value: float) -> None:
    adapter = TypeAdapter(Annotated[(model.model_fields[key].annotation, *model.model_fields[key].metadata)])
    assert adapter.validate_python(text, strict=True) == pytest.approx(value)
    with pytest.raises(ValidationError):
        adapter.validate_python("2 kg", strict=True)


def test_integer_with_a_unit_stays_an_integer() -> None:
    with pytest.raises(ValidationError, match="valid integer"):
        Physics.model_validate({"tick_rate": "240.5 Hz"})


def test_names_of_places_are_valid_for_all_poses_and_points_of_the_world() -> None:
    found = list(_poses_and_points())
    without = {str(value) for value in found if not any(isinstance(mark, PlaceAllowed) for mark in value.marks)}
    assert without == set(POSES_WITHOUT_PLACES)
    assert len(found) > len(without)


@pytest.mark.parametrize("repeated", [0, 2, 3])
def test_repeated_corners_of_a_polygon_are_dropped(repeated: int) -> None:
    """Some tools close a polygon with its first corner. An edge without length has no direction."""
    square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    written = [*square, square[0]] if repeated == 0 else [*square[:repeated], *square[repeated - 1 :]]
    corners = TypeAdapter(Ring).validate_python(written)
    assert sorted(corners) == sorted(square)
