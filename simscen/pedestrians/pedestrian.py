"""State of a pedestrian, with goals and the reaction to robots."""

import math
from dataclasses import dataclass, field

from simscen.core.environment.world_model import PedestrianEvent, WalkingPedestrian
from simscen.core.geometry import Array, Pose2, wrap
from simscen.pedestrians.forces import MAX_SPEED_RATIO, RELAXATION_TIME_S
from simscen.pedestrians.surroundings import ObservedRobot

GOAL_RADIUS_M = 0.3
"""Maximum distance at which a goal counts as reached (HuNavSim's goal_radius)."""
CORNER_RADIUS_M = 0.5
"""Maximum distance at which a corner of the path counts as passed."""
HALF_FIELD_OF_VIEW_RAD = math.pi / 2 + 0.17
"""Maximum angle between the heading and the direction to a robot for a reaction to begin (HuNavSim's lineOfSight)."""
MAX_TURN_RATE_RAD_S = math.pi
"""Maximum turn rate (HuNavSim's max_ang_vel)."""
MIN_TURNING_SPEED_M_S = 0.1
"""Speed above which a pedestrian turns to the direction of motion."""
LOST_RANGE_RATIO = 1.5
"""Ratio of the distance at which a reaction ends to the distance at which it begins (hysteresis)."""
CURIOUS_SPEED_M_S, CURIOUS_DISTANCE_M = 1.8, 1.5
"""Maximum speed of a curious pedestrian, and distance from the robot at which a curious pedestrian stops."""
SCARED_SPEED_M_S, SCARED_FORCE_M2_S2 = 0.6, 4.0
"""Maximum speed of a scared pedestrian, and factor k of the force k / d away from the robot. d is the distance from the
pedestrian's body to the center of the robot (HuNavSim: k = 20 x 0.2)."""
THREATENING_SPEED_M_S, BLOCKING_DISTANCE_M, STARING_RANGE_M = 2.0, 1.1, 1.2
"""Maximum speed of a threatening pedestrian, distance in front of the robot at which the pedestrian stands, and maximum
distance from the robot at which the pedestrian looks at the robot."""
STOPPING_DISTANCE_M = 0.05
"""Distance from the target position within which a pedestrian stops walking."""


@dataclass(frozen=True)
class Intent:
    """Motion that a pedestrian intends in the next step. Points (x, y) are in m in the world frame.

    target:        point to walk to; None to stand still
    speed:         intended speed in m/s
    max_speed:     maximum speed in m/s, including the effect of forces
    looks_at:      point to turn to; None to turn to the direction of motion
    is_immovable:  whether forces have no effect
    """

    target: tuple[float, float] | None
    speed: float
    max_speed: float
    looks_at: tuple[float, float] | None = None
    is_immovable: bool = False


@dataclass
class Pedestrian:
    """State of a pedestrian. Positions (x, y) are in m in the world frame."""

    spec: WalkingPedestrian
    pose: Pose2
    """Position and heading."""
    velocity: tuple[float, float] = (0.0, 0.0)
    """Velocity in m/s along x and y."""
    goal_index: int = 0
    """Index of the current goal in `spec.goals`."""
    is_forward: bool = True
    """Whether the goals are visited in the order of `spec.goals`; False for the reverse order on the way back, with
    `repeat: back_and_forth`."""
    has_arrived: bool = False
    """Whether the last goal has been reached for good; True without goals."""
    path: list[tuple[float, float]] = field(default_factory=list)
    """Corners of the remaining path around walls. The last corner is the current goal."""
    planned_goal: tuple[float, float] | None = None
    """Goal for which `path` was planned."""
    reacts_to: str | None = None
    """Name of the robot to which the pedestrian currently reacts; None without a reaction."""
    total_reaction_s: float = 0.0
    """Total duration in s of all reactions so far."""
    has_lost_interest: bool = False
    """Whether `total_reaction_s` had reached `spec.reacts_for` when the last reaction ended. If so, only scared
    pedestrians react again."""

    @property
    def position(self) -> tuple[float, float]:
        """Position (x, y) in m."""
        return self.pose.x, self.pose.y

    @property
    def destination(self) -> tuple[float, float]:
        """Position of the current goal; without goals, the initial position."""
        return self.spec.goals[self.goal_index] if self.spec.goals else (self.spec.pose.x, self.spec.pose.y)

    # Goals

    def update_goal(self) -> list[PedestrianEvent]:
        """Remove passed corners from the path, and set the next goal if the goal is reached.

        Returns one event if the goal is reached.
        """
        while len(self.path) > 1 and math.dist(self.position, self.path[0]) <= CORNER_RADIUS_M:
            self.path.pop(0)
        if self.has_arrived or math.dist(self.position, self.destination) > GOAL_RADIUS_M:
            return []
        event = PedestrianEvent(self.spec.name, "reached", str(self.goal_index + 1))
        self._advance_goal()
        return [event]

    def _advance_goal(self) -> None:
        """Set the next goal, according to `spec.repeat`."""
        count = len(self.spec.goals)
        if self.spec.repeat == "once" or (count == 1 and self.spec.repeat == "loop"):
            self.has_arrived = self.goal_index == count - 1
            self.goal_index = min(self.goal_index + 1, count - 1)
        elif self.spec.repeat == "loop":
            self.goal_index = (self.goal_index + 1) % count
        elif count == 1:
            self.has_arrived = True
        else:
            last = count - 1 if self.is_forward else 0
            self.is_forward ^= self.goal_index == last
            self.goal_index += 1 if self.is_forward else -1

    # Reaction to robots

    def _is_in_view(self, robot: ObservedRobot) -> bool:
        """Return whether a robot is within the reaction distance and in the field of view, regardless of walls."""
        if math.dist(self.position, robot.pose[:2]) > self.spec.reacts_within:
            return False
        bearing = math.atan2(robot.pose.y - self.pose.y, robot.pose.x - self.pose.x)
        return abs(wrap(bearing - self.pose.yaw)) <= HALF_FIELD_OF_VIEW_RAD

    def update_reaction(self, visible: dict[str, ObservedRobot], seconds: float) -> list[PedestrianEvent]:
        """Begin, continue, or end a reaction in a step of `seconds`. Return one event if a reaction began or ended.

        `visible` are the robots that no wall hides, by name.
        """
        if self.reacts_to is not None:
            self.total_reaction_s += seconds
            robot = visible.get(self.reacts_to)
            is_lost = (
                robot is None or math.dist(self.position, robot.pose[:2]) > LOST_RANGE_RATIO * self.spec.reacts_within
            )
            is_time_over = self.total_reaction_s >= self.spec.reacts_for
            if not is_lost and (not is_time_over or self.spec.behavior == "scared"):
                return []
            self.has_lost_interest = is_time_over
            robot_name, self.reacts_to = self.reacts_to, None
            return [PedestrianEvent(self.spec.name, "calmed", robot_name)]
        if self.has_lost_interest and self.spec.behavior != "scared":
            return []
        near = sorted((math.dist(self.position, robot.pose[:2]), name) for name, robot in visible.items()
                      if self._is_in_view(robot))  # fmt: skip
        if not near:
            return []
        self.reacts_to = near[0][1]
        return [PedestrianEvent(self.spec.name, "reacted", self.reacts_to)]

    def intent(self, robot: ObservedRobot | None) -> Intent:
        """Return the intended motion. `robot` is the robot that the pedestrian reacts to; None without a reaction."""
        if robot is None:
            return self._intent_to_goal()
        robot_position = robot.pose[:2]
        match self.spec.behavior:
            case "surprised":
                return Intent(None, 0.0, MAX_SPEED_RATIO * self.spec.speed, robot_position, is_immovable=True)
            case "curious":
                distance = math.dist(self.position, robot_position)
                if distance <= max(CURIOUS_DISTANCE_M, robot.radius + self.spec.radius):
                    return Intent(None, 0.0, CURIOUS_SPEED_M_S, robot_position, is_immovable=True)
                return Intent(robot_position, CURIOUS_SPEED_M_S * distance / self.spec.reacts_within, CURIOUS_SPEED_M_S)
            case "scared":
                return Intent(self._target(), SCARED_SPEED_M_S if not self.has_arrived else 0.0, SCARED_SPEED_M_S)
            case "threatening":
                return self._blocking_intent(robot)
            case _:
                return self._intent_to_goal()

    def _intent_to_goal(self) -> Intent:
        """Return the intent to walk along the path, and to stop at the last goal."""
        speed, max_speed = self.spec.speed, MAX_SPEED_RATIO * self.spec.speed
        if self.has_arrived or (self.spec.repeat == "once" and self.goal_index == len(self.spec.goals) - 1):
            speed = min(speed, _braking_speed(math.dist(self.position, self.destination)))
        return Intent(self._target(), speed, max_speed)

    def _target(self) -> tuple[float, float]:
        """Return the next corner of the path; the goal if there is no path."""
        return self.path[0] if self.path else self.destination

    def _blocking_intent(self, robot: ObservedRobot) -> Intent:
        """Return the intent to walk to a position in front of the robot, and to stand there."""
        # HuNavSim's blockRobot swaps sine and cosine here, so that its pedestrians do not stand in front of the robot.
        gap = max(BLOCKING_DISTANCE_M, robot.radius + self.spec.radius + STOPPING_DISTANCE_M)
        yaw = robot.pose.yaw
        target = robot.pose.x + gap * math.cos(yaw), robot.pose.y + gap * math.sin(yaw)
        is_near = math.dist(self.position, robot.pose[:2]) <= max(STARING_RANGE_M, gap + STOPPING_DISTANCE_M)
        speed = min(THREATENING_SPEED_M_S, _braking_speed(math.dist(self.position, target)))
        return Intent(target, speed, THREATENING_SPEED_M_S, robot.pose[:2] if is_near else None)

    # Motion

    def move(self, displacement: Array, velocity: Array, looks_at: tuple[float, float] | None, seconds: float) -> None:
        """Apply the displacement (2,) in m of a step of `seconds`, and set the velocity (2,) in m/s.

        The pedestrian turns to the point `looks_at`, or to the direction of motion if `looks_at` is None.
        """
        x, y, yaw = self.pose
        x, y = x + float(displacement[0]), y + float(displacement[1])
        self.velocity = float(velocity[0]), float(velocity[1])
        facing = yaw
        if looks_at is not None:
            facing = math.atan2(looks_at[1] - y, looks_at[0] - x)
        elif math.hypot(*self.velocity) > MIN_TURNING_SPEED_M_S:
            facing = math.atan2(self.velocity[1], self.velocity[0])
        turn, max_turn = wrap(facing - yaw), MAX_TURN_RATE_RAD_S * seconds
        self.pose = Pose2(x, y, wrap(yaw + max(-max_turn, min(max_turn, turn))))


def _braking_speed(distance: float) -> float:
    """Return the speed in m/s from which a pedestrian stops within `distance` m; 0 up to STOPPING_DISTANCE_M."""
    return distance / RELAXATION_TIME_S if distance > STOPPING_DISTANCE_M else 0.0
