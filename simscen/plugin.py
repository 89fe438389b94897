"""Stable interface for plug-in authors: `from simscen.plugin import PlannerSpec`.

All quantities have SI units: meters, seconds, radians, m/s, rad/s. Frames follow REP 103 and REP 105: `map`, `odom`,
and `base_link` with x forward and y to the left. Arrays are numpy arrays of float64 unless stated otherwise.

Each name is imported on first use, so that a module with the Spec classes of a plug-in does not import the physics
engine. Names that are not listed here can change without notice.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from simscen.actions.base import Action
    from simscen.core.clock import Clock
    from simscen.core.environment.costmap_filters import Zones, ZoneSwitch
    from simscen.core.environment.occupancy_grid import OccupancyGrid
    from simscen.core.geometry import Array, Pose2, Pose3, wrap
    from simscen.core.geometry.kinematics import STOP, Twist
    from simscen.core.geometry.polygons import distance_to_polygon
    from simscen.core.geometry.shapes import Body, MotionPath
    from simscen.core.messages.goals import Goal
    from simscen.core.messages.navigation import Belief, ErrorCode, Estimate, Path, TaskResult
    from simscen.core.messages.sensor_data import Bump, Image, Imu, Odometry, Reading, Readings, Scan
    from simscen.core.random_streams import Streams
    from simscen.core.records.case import Case
    from simscen.core.records.events import Event, EventKind
    from simscen.core.records.trace import CostGrid, Decision, Samples, Trace
    from simscen.core.records.verdict import Evidence, Finding, Status
    from simscen.core.stage import Effect, Situation, Stage
    from simscen.criteria.base import Criterion, Measure
    from simscen.criteria.findings import at_least, at_most, counted, held, missed, undecided
    from simscen.criteria.trace_signals.estimation_errors import pose_error
    from simscen.criteria.trace_signals.ground_truth import clearance, drive, speed, truth, turn_rate
    from simscen.faults.base import Fault, FaultEffect, FaultSetting, FaultTarget, SensorSimulator
    from simscen.model.controllers import GoalCheckerSpec
    from simscen.model.localizers import LocalizerSpec
    from simscen.model.planners import PlannerSpec
    from simscen.model.recovery import BehaviorSpec
    from simscen.model.sensors import Mount, SensorSpec
    from simscen.model.stack import InProcessStack
    from simscen.model.stack_base import ControllerSpec
    from simscen.sensors.sensor import Sensor, SensorSetting, SensorView
    from simscen.spec.base import Ranged, Spec, Value, by_default
    from simscen.spec.choice import Choice
    from simscen.spec.places import (
        GoalName,
        MaskFile,
        MovableName,
        ObjectName,
        PlaceOrPoint,
        PlaceOrPose,
        Point,
        PoseSpec,
        RegionName,
    )
    from simscen.spec.quantities import (
        Angle,
        AngularSpeed,
        Duration,
        Frequency,
        Length,
        NonNegativeLength,
        PositiveAcceleration,
        PositiveAngle,
        PositiveAngularAcceleration,
        PositiveAngularSpeed,
        PositiveDuration,
        PositiveLength,
        PositiveSpeed,
        Probability,
        Ratio,
        Speed,
    )
    from simscen.stack.footprint import Footprint, distances
    from simscen.stack.moving_obstacles import MovingObstacles
    from simscen.stack.protocols import (
        Behavior,
        Controller,
        CostmapView,
        GoalChecker,
        Localizer,
        NavigationFailure,
        Planner,
        RobotModel,
        Stack,
        SupportsZones,
        Surroundings,
    )
    from simscen.stack.setting import Setting
    from simscen.stack.tasks import Task
    from simscen.triggers.base import Condition

__all__ = [
    "STOP", "Action", "Angle", "AngularSpeed", "Array", "Behavior", "BehaviorSpec", "Belief", "Body", "Bump",
    "Case", "Choice", "Clock", "Condition", "Controller", "ControllerSpec", "CostGrid", "CostmapView", "Criterion",
    "Decision", "Duration", "Effect", "ErrorCode", "Estimate", "Event", "EventKind", "Evidence", "Fault",
    "FaultEffect", "FaultSetting", "FaultTarget", "Finding", "Footprint", "Frequency", "Goal", "GoalChecker",
    "GoalCheckerSpec", "GoalName", "Image", "Imu", "InProcessStack", "Length", "Localizer", "LocalizerSpec",
    "MaskFile", "Measure", "MotionPath", "Mount", "MovableName", "MovingObstacles", "NavigationFailure",
    "NonNegativeLength", "ObjectName", "OccupancyGrid", "Odometry", "Path", "PlaceOrPoint", "PlaceOrPose",
    "Planner", "PlannerSpec", "Point", "Pose2", "Pose3", "PoseSpec", "PositiveAcceleration", "PositiveAngle",
    "PositiveAngularAcceleration", "PositiveAngularSpeed", "PositiveDuration", "PositiveLength", "PositiveSpeed",
    "Probability", "Ranged", "Ratio", "Reading", "Readings", "RegionName", "RobotModel", "Samples", "Scan",
    "Sensor", "SensorSetting", "SensorSimulator", "SensorSpec", "SensorView", "Setting", "Situation", "Spec",
    "Speed", "Stack", "Stage", "Status", "Streams", "SupportsZones", "Surroundings", "Task", "TaskResult", "Trace",
    "Twist", "Value", "ZoneSwitch", "Zones", "at_least", "at_most", "by_default", "clearance", "counted",
    "distance_to_polygon", "distances", "drive", "held", "missed", "pose_error", "speed", "truth", "turn_rate",
    "undecided", "wrap",
]  # fmt: skip

_NAMES_BY_MODULE = {
    # Parts of specifications.
    "simscen.spec.base": ("Spec", "Value", "Ranged", "by_default"),
    "simscen.spec.choice": ("Choice",),
    "simscen.spec.quantities": (
        "Angle", "AngularSpeed", "Duration", "Frequency", "Length", "NonNegativeLength", "PositiveAcceleration",
        "PositiveAngle", "PositiveAngularAcceleration", "PositiveAngularSpeed", "PositiveDuration",
        "PositiveLength", "PositiveSpeed", "Probability", "Ratio", "Speed",
    ),
    "simscen.spec.places": (
        "GoalName", "MaskFile", "MovableName", "ObjectName", "PlaceOrPoint", "PlaceOrPose", "Point", "PoseSpec",
        "RegionName",
    ),
    # Base classes of specifications.
    "simscen.model.stack": ("InProcessStack",),
    "simscen.model.recovery": ("BehaviorSpec",),
    "simscen.model.controllers": ("GoalCheckerSpec",),
    "simscen.model.localizers": ("LocalizerSpec",),
    "simscen.model.planners": ("PlannerSpec",),
    "simscen.model.stack_base": ("ControllerSpec",),
    "simscen.model.sensors": ("Mount", "SensorSpec"),
    "simscen.criteria.base": ("Criterion", "Measure"),
    "simscen.faults.base": ("FaultEffect", "Fault", "FaultSetting", "FaultTarget", "SensorSimulator"),
    "simscen.triggers.base": ("Condition",),
    "simscen.actions.base": ("Action",),
    # Interfaces of components, and their environment.
    "simscen.stack.protocols": (
        "Behavior", "Controller", "CostmapView", "GoalChecker", "Localizer", "NavigationFailure", "Planner",
        "RobotModel", "Stack", "Surroundings", "SupportsZones",
    ),
    "simscen.stack.setting": ("Setting",),
    "simscen.stack.footprint": ("Footprint", "distances"),
    "simscen.stack.tasks": ("Task",),
    "simscen.stack.moving_obstacles": ("MovingObstacles",),
    "simscen.sensors.sensor": ("Sensor", "SensorSetting", "SensorView"),
    # Measurements and findings of criteria.
    "simscen.criteria.findings": ("at_least", "at_most", "counted", "held", "missed", "undecided"),
    "simscen.criteria.trace_signals.ground_truth": ("clearance", "drive", "speed", "truth", "turn_rate"),
    "simscen.criteria.trace_signals.estimation_errors": ("pose_error",),
    # Shared data types.
    "simscen.core.records.case": ("Case",),
    "simscen.core.random_streams": ("Streams",),
    "simscen.core.records.events": ("Event", "EventKind"),
    "simscen.core.geometry": ("Array", "Pose2", "Pose3", "wrap"),
    "simscen.core.environment.occupancy_grid": ("OccupancyGrid",),
    "simscen.core.geometry.kinematics": ("STOP", "Twist"),
    "simscen.core.messages.goals": ("Goal",),
    "simscen.core.messages.navigation": ("Belief", "ErrorCode", "Estimate", "Path", "TaskResult"),
    "simscen.core.geometry.polygons": ("distance_to_polygon",),
    "simscen.core.messages.sensor_data": ("Bump", "Image", "Imu", "Odometry", "Reading", "Readings", "Scan"),
    "simscen.core.geometry.shapes": ("Body", "MotionPath"),
    "simscen.core.stage": ("Effect", "Situation", "Stage"),
    "simscen.core.clock": ("Clock",),
    "simscen.core.records.trace": ("CostGrid", "Decision", "Samples", "Trace"),
    "simscen.core.records.verdict": ("Evidence", "Finding", "Status"),
    "simscen.core.environment.costmap_filters": ("ZoneSwitch", "Zones"),
}  # fmt: skip
_MODULE_OF = {name: module for module, names in _NAMES_BY_MODULE.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULE_OF[name]), name)


def __dir__() -> list[str]:
    return __all__
