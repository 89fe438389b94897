"""The reference stack as an external process: `python -m simscen.run.external.reference_stack STACK`.

STACK is a `stack:` section as JSON (default: empty). Tests use this program to verify the protocol, and `simscen bench`
uses it to measure the cost of the protocol.
"""

from __future__ import annotations

import json
import sys
from array import array
from collections.abc import Iterator
from typing import Any, get_args

import numpy as np

from simscen.core.clock import NS_PER_SECOND, Clock
from simscen.core.environment.costmap_filters import FilterMasks, SpeedLimits
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal as CoreGoal
from simscen.core.messages.goals import Mode
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Bump, Image, Imu, Odometry, Reading, Scan
from simscen.core.random_streams import Streams
from simscen.core.records.events import EventKind, Value
from simscen.core.records.trace import Decision
from simscen.model.stack import StackSpec
from simscen.peer import Goal, Peer, Step, messages, wire
from simscen.peer.client import EVENTS, Message
from simscen.record import topics
from simscen.record.messages import encode
from simscen.run.external.protocol import EXACT_SUFFIX, KEEPOUT_MASK, SPEED_MASK
from simscen.stack.build import build_stack
from simscen.stack.protocols import RobotModel, Stack, Surroundings

_EMPTY_IMAGE = Image("", 0, np.empty((0, 0, 3), np.uint8), np.empty((0, 0), np.float32))
"""Reading of each camera. The stack ignores images without a field of view."""


class ReferenceStackPeer(Peer):
    """Client of the stack protocol that passes readings to the reference stack, and sends the stack's decisions."""

    def __init__(self, spec: StackSpec) -> None:
        self._spec = spec
        self._stack: Stack | None = None
        self._goal_content: dict[str, Any] = {}
        self._requests: list[tuple[int, dict[str, Any]]] = []
        self._had_plan = False
        self._goal_index: Value = 0
        super().__init__("simscen's reference stack", every_beat=True, topics=None, modes=get_args(Mode))
        self._time = Clock(self.hello["tick_rate"])
        self._sensors = {topic["topic"]: topic.get("sensor", "") for topic in self.hello["says"]}

    def serve(self) -> None:
        """Answer each STEP until the run is over."""
        for step in self:
            stack = self._stack or self._start_stack(step)
            for kind, content in self._requests:
                if kind == wire.PREEMPT:
                    stack.preempt(content["tick"], _to_core_goal(Goal.from_content(content["goal"])))
                else:
                    stack.cancel(content["tick"])
            self._requests.clear()
            self._send_decision(step, stack.decide(step.tick, tuple(self._readings(step.messages))), stack)

    def _process_frame(self, kind: int, content: dict[str, Any]) -> None:
        """Keep the goals (GOAL) or a request (PREEMPT, CANCEL) for the next step."""
        if kind == wire.GOAL:
            self._goal_content = content
        else:
            self._requests.append((kind, content))

    def _start_stack(self, step: Step) -> Stack:
        hello, grids = self.hello, {m.topic: m.content for m in step.messages if m.type == topics.MAP.type}
        speed = _to_grid(hello["speed_mask"], grids.get(SPEED_MASK.name))
        limits = hello["speed_mask"]
        surroundings = Surroundings(
            robot=RobotModel(**{**self.robot, "footprint": _to_polygon(self.robot["footprint"])}),
            map=_to_grid(hello["map"], grids.get(topics.MAP.name)),
            tick_rate=hello["tick_rate"],
            keepout=tuple(map(_to_polygon, hello["keepout"])),
            speed_zones=tuple((_to_polygon(zone["polygon"]), zone["speed_limit"]) for zone in hello["speed_zones"]),
            masks=FilterMasks(
                _to_grid(hello["keepout_mask"], grids.get(KEEPOUT_MASK.name)),
                speed if speed is None else SpeedLimits(speed, limits["percent"], limits["base"], limits["multiplier"]),
            ),
            lidars=tuple(hello["lidars"]),
            has_imu=any(sensor["says"] == "Imu" for sensor in hello["sensors"].values()),
        )
        task, estimate = self._goal_content, self._goal_content["initial_estimate"]
        self._stack = build_stack(
            self._spec,
            surroundings,
            Streams(hello["seed"], hello["robot_name"]),
            Clock(hello["tick_rate"]),
            stop_on_failure=task["on_goal_failure"] == "stop",
            mode=task["mode"],
        )
        pose, std = estimate["pose"], estimate["std"]
        self._stack.start(
            Estimate(None if pose is None else Pose2(*pose), (std[0], std[1], std[2])),
            tuple(_to_core_goal(Goal.from_content(goal)) for goal in task["goals"]),
        )
        return self._stack

    def _readings(self, received: list[Message]) -> Iterator[Reading]:
        """Yield the readings in the received messages in full precision."""
        exact = {m.topic: iter([e.content for e in received if e.topic == m.topic + EXACT_SUFFIX]) for m in received}
        for message in received:
            sensor = self._sensors[message.topic]
            if not sensor or message.topic.endswith(EXACT_SUFFIX):
                continue
            exact_values: Any = next(exact[message.topic], None)
            match message.type:
                case topics.SCAN_TYPE:
                    scan = message.content
                    angle, step, range_min, range_max, x, y, yaw = exact_values[:7]
                    ranges = np.array(exact_values[7:], dtype=np.float64)
                    limits = angle, step, range_min, range_max
                    mount = self._mount(sensor)
                    tilted = None if mount.is_level else mount
                    yield Scan(sensor, self._tick(scan.stamp), ranges, *limits, Pose2(x, y, yaw), tilted)
                case topics.ODOMETRY_TYPE:
                    odom = message.content
                    twist, covariance = Twist(odom.vx, odom.vy, odom.wz), odom.twist_covariance
                    variance = covariance[0], covariance[7], covariance[35]
                    yield Odometry(sensor, self._tick(odom.stamp), Pose2(*exact_values), twist, variance)
                case topics.IMU_TYPE:
                    imu = message.content
                    variances = imu.angular_velocity_covariance[0], imu.linear_acceleration_covariance[0]
                    values = imu.angular_velocity, imu.linear_acceleration
                    yield Imu(sensor, self._tick(imu.stamp), *values, *variances, self._mount(sensor))
                case topics.BUMPER_TYPE:
                    yield Bump(sensor, 0, message.content)
                case topics.IMAGE_TYPE:
                    yield _EMPTY_IMAGE

    def _mount(self, sensor: str) -> Pose3:
        return Pose3(*(self.hello["sensors"][sensor]["mount"] or ()))

    def _tick(self, stamp: messages.Stamp) -> int:
        return self._time.tick_at(stamp[0] * NS_PER_SECOND + stamp[1])

    def _send_decision(self, step: Step, decision: Decision, stack: Stack) -> None:
        vx, vy, wz = decision.command
        step.drive(vx, wz, vy)
        if decision.belief is not None:
            belief = decision.belief
            covariance = belief.covariance.ravel().tolist()
            step.publish(topics.BELIEF.name, messages.pose_with_covariance(step.stamp, belief.pose, covariance))
            step.publish(topics.BELIEF.name + EXACT_SUFFIX, messages.pose2d(*belief.pose))
            step.publish(topics.TF.name + EXACT_SUFFIX, messages.pose2d(*belief.map_from_odom))
            if len(belief.particles):
                step.publish(topics.PARTICLES.name + EXACT_SUFFIX, _encode_table(belief.particles))
        if decision.plan is not None:
            stamp = self._time.stamp(decision.plan.tick)
            step.publish(topics.PLAN.name, messages.path(stamp, []))
            step.publish(topics.PLAN.name + EXACT_SUFFIX, _encode_table(decision.plan.points))
        elif self._had_plan and stack.plan is None:
            step.publish(topics.PLAN.name, messages.path(step.stamp, []))
        # A plan can be made and dropped in the same step.
        self._had_plan = decision.plan is not None or stack.plan is not None
        if decision.local_plan is not None:
            step.publish(topics.LOCAL_PLAN.name + EXACT_SUFFIX, _encode_table(decision.local_plan.points))
        for costmap in decision.costmaps:
            topic = topics.GLOBAL_COSTMAP if costmap.name == "global" else topics.LOCAL_COSTMAP
            step.publish(topic.name, encode.occupancy_grid(costmap.frame, step.stamp, costmap.grid))
        if decision.odometry:
            rows = [
                (odom.tick, *odom.pose, *odom.twist, *odom.twist_variance, *odom.pose_covariance)
                for odom in decision.odometry
            ]
            step.publish(topics.FILTERED_ODOMETRY.name + EXACT_SUFFIX, _encode_table(np.array(rows)))
        for event in decision.events:
            if event.kind is EventKind.GOAL_ACCEPTED:
                self._goal_index = event.data["index"]
            if event.data.get("index", self._goal_index) != self._goal_index:
                continue  # simscen derives the end of the other goals of the same drive
            if event.kind is not EventKind.NAVIGATION_ENDED:
                report = {"kind": event.kind.value, "name": event.name, "data": dict(event.data)}
                step.publish(EVENTS, messages.string(json.dumps(report)))


def _to_core_goal(goal: Goal) -> CoreGoal:
    pose = Pose2(goal.x, goal.y, goal.yaw)
    return CoreGoal(goal.name, pose, goal.xy_tolerance, goal.yaw_tolerance, goal.timeout, goal.via, goal.wait)


def _to_grid(facts: dict[str, Any] | None, grid: messages.OccupancyGrid | None) -> OccupancyGrid | None:
    """Return a grid with the cells of a message, and with the exact resolution and origin in HELLO (`facts`)."""
    if facts is None or grid is None:
        return None
    cells = np.array(grid.data, dtype=np.int8).reshape(grid.height, grid.width)
    return OccupancyGrid(cells, facts["resolution"], Pose2(*facts["origin"]))


def _to_polygon(corners: list[list[float]]) -> tuple[tuple[float, float], ...]:
    return tuple((x, y) for x, y in corners)


def _encode_table(table: Array) -> bytes:
    return messages.float64_array(array("d", np.ascontiguousarray(table, dtype=np.float64).tobytes()))


def main() -> None:
    """Serve the stack that the argument STACK specifies."""
    section = json.loads(sys.argv[1]) if len(sys.argv) > 1 else {}
    ReferenceStackPeer(StackSpec.model_validate(section, by_alias=True, by_name=False)).serve()


if __name__ == "__main__":
    main()
