"""A small navigation stack in one rclpy node: scan matching, A* on the map, pure pursuit, independent of simscen.

In: /map, /scan, /odom, /initialpose, /tf_static, and goals by /goal_pose or an action of Nav2.
Out: /cmd_vel (Twist, or TwistStamped with `stamped`), /plan, /amcl_pose, /tf map→odom.
Parameters: `stamped`, `rate` (Hz), `speed` (m/s), `radius` (m), `action` ("", navigate_to_pose,
navigate_through_poses or follow_waypoints), `hangs_at` (s).
"""

import heapq
import math
import os
import time

import numpy as np
import rclpy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rclpy.task import Future
from sensor_msgs.msg import LaserScan

try:
    from tf2_msgs.msg import TFMessage
except ImportError:
    TFMessage = None

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
CELL = 0.1  # of the grid that is planned on, in meters
NEIGHBORS = [(dy, dx, math.hypot(dy, dx)) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dy or dx]


def yaw_of(q):
    return math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))


def wrap(angle):
    return math.atan2(math.sin(angle), math.cos(angle))


def compose(a, b):
    """The pose `b`, given in the frame of `a`."""
    cos, sin = math.cos(a[2]), math.sin(a[2])
    return (a[0] + cos * b[0] - sin * b[1], a[1] + sin * b[0] + cos * b[1], wrap(a[2] + b[2]))


def inverse(a):
    cos, sin = math.cos(a[2]), math.sin(a[2])
    return (-cos * a[0] - sin * a[1], sin * a[0] - cos * a[1], -a[2])


def spread(field, steps):
    """Proximity of each cell to a cell that is 1; it decreases by 1/steps per cell."""
    for _ in range(steps):
        padded = np.pad(field, 1)
        best = np.maximum.reduce([padded[1 + dy :, 1 + dx :][: field.shape[0], : field.shape[1]] for dy, dx in SIDES])
        field = np.maximum(field, best - 1 / steps)
    return field


SIDES = [(-1, 0), (1, 0), (0, -1), (0, 1)]


class World:
    """The map: free space, and the match of a scan."""

    def __init__(self, message, radius):
        info = message.info
        cells = np.array(message.data, dtype=np.int16).reshape(info.height, info.width)
        self.fine, self.origin = info.resolution, (info.origin.position.x, info.origin.position.y)
        walls = (cells > 50).astype(float)
        self.field = spread(walls, 6)
        step = max(1, round(CELL / self.fine))
        rows, columns = (math.ceil(n / step) for n in walls.shape)
        padded = np.pad(
            (cells > 50) | (cells < 0), ((0, rows * step - walls.shape[0]), (0, columns * step - walls.shape[1]))
        )
        self.step = step * self.fine
        self.blocked = padded.reshape(rows, step, columns, step).any(axis=(1, 3))
        self.reach = math.ceil(radius / self.step)
        self.seen = np.zeros_like(self.blocked, dtype=np.int16)

    def fit(self, points):
        """Return how well (..., n, 2) points on the map lie on walls, 0 to 1."""
        column, row = (np.floor((points[..., i] - self.origin[i]) / self.fine).astype(int) for i in (0, 1))
        height, width = self.field.shape
        inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
        return np.where(inside, self.field[row.clip(0, height - 1), column.clip(0, width - 1)], 0.0)

    def cell(self, x, y):
        row, column = int((y - self.origin[1]) // self.step), int((x - self.origin[0]) // self.step)
        height, width = self.blocked.shape
        return min(max(row, 0), height - 1), min(max(column, 0), width - 1)

    def point(self, cell):
        return self.origin[0] + (cell[1] + 0.5) * self.step, self.origin[1] + (cell[0] + 0.5) * self.step

    def see(self, points):
        """Remember obstacles in the free space of the map for a while after they were last seen."""
        self.seen = np.maximum(self.seen - 1, 0)
        for x, y in points:
            self.seen[self.cell(x, y)] = 60

    def plan(self, start, goal):
        """Return points from start to goal, or None."""
        obstacles = (self.blocked | (self.seen > 0)).astype(float)
        near = spread(obstacles, self.reach + 4)
        closed = near > 1 - self.reach / (self.reach + 4)
        cost = 1 + 6 * near
        first, last = self.cell(*start), self.cell(*goal)
        open_, best, before = [(0.0, first)], {first: 0.0}, {}
        done = set()
        while open_:
            _, cell = heapq.heappop(open_)
            if cell == last:
                way = [cell]
                while cell in before:
                    cell = before[cell]
                    way.append(cell)
                return [*(self.point(c) for c in way[::-1][:-1]), tuple(goal)]
            if cell in done:
                continue
            done.add(cell)
            for dy, dx, length in NEIGHBORS:
                other = (cell[0] + dy, cell[1] + dx)
                if not (0 <= other[0] < cost.shape[0] and 0 <= other[1] < cost.shape[1]):
                    continue
                # The robot may leave a tight spot but not enter one.
                if closed[other] and not closed[cell] and other != last:
                    continue
                total = best[cell] + length * cost[other]
                if total < best.get(other, math.inf):
                    best[other], before[other] = total, cell
                    ahead = math.hypot(other[0] - last[0], other[1] - last[1])
                    heapq.heappush(open_, (total + ahead, other))
        return None


class Navigator(Node):
    def __init__(self):
        super().__init__("navigator")
        self.stamped = self.declare_parameter("stamped", False).value
        self.speed = self.declare_parameter("speed", 0.35).value
        self.radius = self.declare_parameter("radius", 0.25).value
        rate = self.declare_parameter("rate", 20.0).value
        action = self.declare_parameter("action", "").value
        self.hangs_at = self.declare_parameter("hangs_at", math.inf).value
        self.world = self.odom = self.scan = self.correction = None
        self.mounts = {}
        self.goals, self.plan, self.planned_at, self.turning = [], None, -math.inf, False
        self.blocked_since, self.finished = None, None
        self.create_subscription(OccupancyGrid, "map", self.on_map, LATCHED)
        self.create_subscription(LaserScan, "scan", self.on_scan, qos_profile_sensor_data)
        self.create_subscription(Odometry, "odom", self.on_odometry, 10)
        self.create_subscription(PoseWithCovarianceStamped, "initialpose", self.on_initial_pose, 10)
        self.command = self.create_publisher(TwistStamped if self.stamped else Twist, "cmd_vel", 10)
        self.paths = self.create_publisher(Path, "plan", 10)
        self.poses = self.create_publisher(PoseWithCovarianceStamped, "amcl_pose", LATCHED)
        if TFMessage is not None:
            self.create_subscription(TFMessage, "/tf_static", self.on_static, LATCHED)
            self.transforms = self.create_publisher(TFMessage, "/tf", 100)
        if action:
            self.serve(action)
        else:
            self.create_subscription(PoseStamped, "goal_pose", self.on_goal, 10)
        self.create_timer(1 / rate, self.drive)

    # Subscriptions

    def on_map(self, message):
        self.world = World(message, self.radius)

    def on_static(self, message):
        for link in message.transforms:
            at, turn = link.transform.translation, link.transform.rotation
            upside_down = turn.x * turn.x + turn.y * turn.y > 0.5
            self.mounts[link.child_frame_id] = (at.x, at.y, yaw_of(turn), upside_down)

    def on_initial_pose(self, message):
        at = message.pose.pose
        self.start = (at.position.x, at.position.y, yaw_of(at.orientation))
        self.correction = compose(self.start, inverse(self.odom)) if self.odom else None
        self.waiting = self.odom is None

    def on_odometry(self, message):
        at = message.pose.pose
        self.odom = (at.position.x, at.position.y, yaw_of(at.orientation))
        if self.correction is None and getattr(self, "start", None) is not None:
            self.correction = compose(self.start, inverse(self.odom))
        self.odom_stamp = message.header.stamp

    def on_scan(self, message):
        if self.world is None or self.correction is None or self.odom is None:
            return
        mount = self.mounts.get(message.header.frame_id, (0.0, 0.0, 0.0, False))
        ranges = np.array(message.ranges, dtype=float)
        angles = message.angle_min + message.angle_increment * np.arange(len(ranges))
        good = np.isfinite(ranges) & (ranges > message.range_min) & (ranges < min(message.range_max, 8.0))
        angles = (-angles if mount[3] else angles) + mount[2]
        points = np.column_stack((mount[0] + ranges * np.cos(angles), mount[1] + ranges * np.sin(angles)))[good]
        self.scan = points
        if len(points) < 20:
            return
        self.match(points[:: max(1, len(points) // 90)])
        self.publish_pose(message.header.stamp)
        on_map = self.on_the_map(points, self.pose())
        near = (np.hypot(*points.T) < 2.0) & (self.world.fit(on_map) < 0.1)
        self.world.see(on_map[near])

    # Localization

    def pose(self):
        return compose(self.correction, self.odom)

    @staticmethod
    def on_the_map(points, pose):
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        return np.column_stack(
            (pose[0] + cos * points[:, 0] - sin * points[:, 1], pose[1] + sin * points[:, 0] + cos * points[:, 1])
        )

    def match(self, points):
        """Move the estimate towards the best match of the scan with the map's walls."""
        pose = self.pose()
        for step, turn in ((0.03, 0.02), (0.01, 0.007)):
            shifts = [(i * step, j * step, k * turn) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-2, -1, 0, 1, 2)]
            candidates = [(pose[0] + dx, pose[1] + dy, pose[2] + dyaw) for dx, dy, dyaw in shifts]
            scores = [
                self.world.fit(self.on_the_map(points, c)).mean() - 0.02 * math.hypot(*s[:2])
                for c, s in zip(candidates, shifts, strict=False)
            ]
            pose = candidates[int(np.argmax(scores))]
        if max(scores) > 0.35:
            self.correction = compose(pose, inverse(self.odom))

    def publish_pose(self, stamp):
        x, y, yaw = self.pose()
        message = PoseWithCovarianceStamped()
        message.header.stamp, message.header.frame_id = stamp, "map"
        message.pose.pose.position.x, message.pose.pose.position.y = x, y
        message.pose.pose.orientation.z, message.pose.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        message.pose.covariance[0] = message.pose.covariance[7] = 0.003
        message.pose.covariance[35] = 0.002
        self.poses.publish(message)
        if TFMessage is not None:
            from geometry_msgs.msg import TransformStamped

            link = TransformStamped()
            link.header.stamp, link.header.frame_id, link.child_frame_id = stamp, "map", "odom"
            dx, dy, turn = self.correction
            link.transform.translation.x, link.transform.translation.y = dx, dy
            link.transform.rotation.z, link.transform.rotation.w = math.sin(turn / 2), math.cos(turn / 2)
            self.transforms.publish(TFMessage(transforms=[link]))

    # Control

    def on_goal(self, message):
        self.set_goals([message])

    def set_goals(self, messages):
        self.goals = [(m.pose.position.x, m.pose.position.y, yaw_of(m.pose.orientation)) for m in messages]
        self.plan, self.planned_at, self.turning, self.blocked_since = None, -math.inf, False, None

    def drive(self):
        now = self.get_clock().now()
        if now.nanoseconds >= self.hangs_at * 1e9:
            time.sleep(3600)
        linear, angular = self.decide(now.nanoseconds * 1e-9)
        twist = Twist()
        twist.linear.x, twist.angular.z = linear, angular
        if self.stamped:
            message = TwistStamped(twist=twist)
            message.header.stamp, message.header.frame_id = now.to_msg(), "base_link"
            self.command.publish(message)
        else:
            self.command.publish(twist)

    def decide(self, now):
        if not self.goals or self.world is None or self.correction is None:
            return 0.0, 0.0
        pose, goal = self.pose(), self.goals[0]
        left = math.hypot(goal[0] - pose[0], goal[1] - pose[1])
        self.turning = left < (0.2 if self.turning else 0.1)
        if self.turning:
            error = wrap(goal[2] - pose[2])
            if abs(error) > 0.1:
                return 0.0, math.copysign(min(0.8, 0.3 + abs(error)), error)
            self.goals.pop(0)
            self.plan, self.planned_at, self.turning = None, -math.inf, False
            self.arrived()
            return 0.0, 0.0
        if now - self.planned_at >= 1.0:
            self.plan, self.planned_at = self.world.plan(pose[:2], goal[:2]), now
            self.publish_plan()
        if not self.plan:
            return 0.0, 0.0
        return self.follow(pose, left)

    def follow(self, pose, left):
        """Pure pursuit of a point on the plan, slower in turns and near obstacles."""
        lookahead = 0.4
        nearest = min(
            range(len(self.plan)), key=lambda i: math.hypot(self.plan[i][0] - pose[0], self.plan[i][1] - pose[1])
        )
        target = next(
            (p for p in self.plan[nearest:] if math.hypot(p[0] - pose[0], p[1] - pose[1]) >= lookahead), self.plan[-1]
        )
        bearing = wrap(math.atan2(target[1] - pose[1], target[0] - pose[0]) - pose[2])
        if abs(bearing) > 0.9:
            return 0.0, math.copysign(0.8, bearing)
        speed = min(self.speed, 0.1 + left) * max(0.2, math.cos(bearing) ** 2)
        free = self.free_ahead(bearing)
        if free < 0.08:
            return 0.0, math.copysign(0.4, bearing) if abs(bearing) > 0.15 else 0.0
        speed = min(speed, 0.8 * free)
        return speed, max(-1.2, min(1.2, 1.8 * bearing))

    def free_ahead(self, bearing):
        """Return the distance that the robot can drive before it touches what the lidar sees."""
        if self.scan is None:
            return math.inf
        cos, sin = math.cos(bearing / 2), math.sin(bearing / 2)
        ahead = self.scan[:, 0] * cos + self.scan[:, 1] * sin
        aside = -self.scan[:, 0] * sin + self.scan[:, 1] * cos
        meets = (np.abs(aside) < self.radius - 0.02) & (ahead > 0)
        return float(ahead[meets].min()) - self.radius if meets.any() else math.inf

    def publish_plan(self):
        message = Path()
        message.header.frame_id, message.header.stamp = "map", self.get_clock().now().to_msg()
        for x, y in self.plan or ():
            pose = PoseStamped(header=message.header)
            pose.pose.position.x, pose.pose.position.y = x, y
            message.poses.append(pose)
        self.paths.publish(message)

    # Goals from an action of Nav2

    def serve(self, name):
        from nav2_msgs import action

        kind = getattr(action, "".join(word.capitalize() for word in name.split("_")))
        self.kind = kind
        self.server = ActionServer(
            self,
            kind,
            name,
            execute_callback=self.execute,
            goal_callback=lambda _: GoalResponse.ACCEPT,
            cancel_callback=self.on_cancel,
        )

    def on_cancel(self, _):
        self.goals = []
        if self.finished is not None and not self.finished.done():
            self.finished.set_result("canceled")
        return CancelResponse.ACCEPT

    def arrived(self):
        if self.finished is None:
            return
        if not self.goals:
            self.finished.set_result("succeeded")
            return
        feedback = self.kind.Feedback()
        if hasattr(feedback, "number_of_poses_remaining"):
            feedback.number_of_poses_remaining = len(self.goals)
        elif hasattr(feedback, "current_waypoint"):
            feedback.current_waypoint = self.count - len(self.goals)
        self.goal_handle.publish_feedback(feedback)

    async def execute(self, handle):
        goal = handle.request
        poses = [goal.pose] if hasattr(goal, "pose") else getattr(goal.poses, "goals", goal.poses)
        if self.finished is not None and not self.finished.done():
            self.finished.set_result("aborted")
        mine = self.finished = Future(executor=self.executor)
        self.goal_handle, self.count = handle, len(poses)
        self.set_goals(poses)
        ended = await mine
        result = self.kind.Result()
        if ended == "succeeded":
            handle.succeed()
        elif ended == "canceled":
            handle.canceled()
        else:
            handle.abort()
            result.error_code = 9000
        return result


def main():
    rclpy.init()
    try:
        rclpy.spin(Navigator())
    except KeyboardInterrupt:
        os._exit(0)


if __name__ == "__main__":
    main()
