"""One person: where they are, where they want to, and how they take a robot that they see."""

import math
from dataclasses import dataclass, field

from simscen.core.environment.world_model import PedestrianAction, WalkingPedestrian
from simscen.core.geometry import Array, Pose2, wrap
from simscen.pedestrians.forces import MOST_OF_SPEED, RELAXATION_TIME
from simscen.pedestrians.surroundings import ObservedRobot

GOAL_RADIUS = 0.3
"""m around a goal that count as there (HuNavSim's goal_radius)."""
CORNER_RADIUS = 0.5
"""m around a corner of the way at which the next is walked to."""
FIELD_OF_VIEW = math.pi / 2 + 0.17
"""rad to each side (HuNavSim's lineOfSight)."""
TURN_RATE = math.pi
"""rad/s at which somebody turns round at most (HuNavSim's max_ang_vel)."""
WALKING = 0.1
"""m/s; who is slower faces where they faced."""
LOSES_SIGHT = 1.5
"""A reaction ends where the robot is this many times as far as where it would begin, so that it does not flicker."""
CURIOUS_SPEED, CURIOUS_GAP = 1.8, 1.5
"""m/s at which the curious come from the far end of their view, slower when nearer; m at which they stop."""
SCARED_SPEED, SCARED_FORCE = 0.6, 4.0
"""m/s that the scared walk at most; m²/s² over the gap in meters is the force that drives them off (20 x 0.2)."""
THREATENING_SPEED, THREATENING_GAP, STARES_WITHIN = 2.0, 1.1, 1.2
"""m/s; m in front of the robot where the threatening stand; m within which they look at it."""
ARRIVED = 0.05
"""m from where somebody wants to stand that they no longer walk."""


@dataclass(frozen=True)
class Intent:
    """What somebody wants now: to walk to `target` at `speed` m/s, never above `most`, or to stand where they are.

    `looks_at` is what they turn to. Who is `still` lets nobody push them aside.
    """

    target: tuple[float, float] | None
    speed: float
    most: float
    looks_at: tuple[float, float] | None = None
    still: bool = False


@dataclass
class Pedestrian:
    """Somebody and their state; `velocity` in m/s in the world."""

    who: WalkingPedestrian
    x: float
    y: float
    yaw: float
    velocity: tuple[float, float] = (0.0, 0.0)
    goal: int = 0
    forward: bool = True
    there: bool = False
    way: list[tuple[float, float]] = field(default_factory=list)
    planned_for: tuple[float, float] | None = None
    reacts_to: str | None = None
    reacted: float = 0.0
    """Seconds of reaction so far."""
    spent: bool = False

    @classmethod
    def of(cls, who: WalkingPedestrian) -> "Pedestrian":
        """At rest where they start."""
        return cls(who, who.pose.x, who.pose.y, who.pose.yaw, there=not who.goals)

    @property
    def place(self) -> tuple[float, float]:
        """Where they are."""
        return self.x, self.y

    @property
    def pose(self) -> Pose2:
        """Where they are and what they face."""
        return Pose2(self.x, self.y, self.yaw)

    @property
    def destination(self) -> tuple[float, float]:
        """The goal they walk to, or where they stay."""
        return self.who.goals[self.goal] if self.who.goals else (self.who.pose.x, self.who.pose.y)

    # goals

    def arrive(self) -> list[PedestrianAction]:
        """Notice a corner of the way or a goal that is reached, and turn to the next."""
        while len(self.way) > 1 and math.dist(self.place, self.way[0]) <= CORNER_RADIUS:
            self.way.pop(0)
        if self.there or math.dist(self.place, self.destination) > GOAL_RADIUS:
            return []
        deed = PedestrianAction(self.who.name, "reached", str(self.goal + 1))
        self._next_goal()
        return [deed]

    def _next_goal(self) -> None:
        count = len(self.who.goals)
        if self.who.repeat == "once" or (count == 1 and self.who.repeat == "loop"):
            self.there = self.goal == count - 1
            self.goal = min(self.goal + 1, count - 1)
        elif self.who.repeat == "loop":
            self.goal = (self.goal + 1) % count
        elif count == 1:
            self.there = True
        else:
            last = count - 1 if self.forward else 0
            self.forward ^= self.goal == last
            self.goal += 1 if self.forward else -1

    # the robot

    def sees(self, robot: ObservedRobot) -> bool:
        """Whether the robot is near enough and in their field of view; walls are not looked at."""
        if math.dist(self.place, robot.pose[:2]) > self.who.reacts_within:
            return False
        bearing = math.atan2(robot.pose.y - self.y, robot.pose.x - self.x)
        return abs(wrap(bearing - self.yaw)) <= FIELD_OF_VIEW

    def take(self, visible: dict[str, ObservedRobot], seconds: float) -> list[PedestrianAction]:
        """React to one of the robots that no wall hides, go on doing so, or lose interest."""
        if self.reacts_to is not None:
            self.reacted += seconds
            robot = visible.get(self.reacts_to)
            lost = robot is None or math.dist(self.place, robot.pose[:2]) > LOSES_SIGHT * self.who.reacts_within
            tired = self.reacted >= self.who.reacts_for
            if not lost and not (tired and self.who.behavior != "scared"):
                return []
            self.spent = tired
            about, self.reacts_to = self.reacts_to, None
            return [PedestrianAction(self.who.name, "calmed", about)]
        if self.spent and self.who.behavior != "scared":
            return []
        near = sorted((math.dist(self.place, robot.pose[:2]), name) for name, robot in visible.items()
                      if self.sees(robot))  # fmt: skip
        if not near:
            return []
        self.reacts_to = near[0][1]
        return [PedestrianAction(self.who.name, "reacted", self.reacts_to)]

    def wish(self, robot: ObservedRobot | None) -> Intent:
        """Return the intent of the pedestrian, which may react to `robot`."""
        if robot is None:
            return self._to_goal()
        where = robot.pose[:2]
        match self.who.behavior:
            case "surprised":
                return Intent(None, 0.0, MOST_OF_SPEED * self.who.speed, where, still=True)
            case "curious":
                distance = math.dist(self.place, where)
                if distance <= max(CURIOUS_GAP, robot.radius + self.who.radius):
                    return Intent(None, 0.0, CURIOUS_SPEED, where, still=True)
                return Intent(where, CURIOUS_SPEED * distance / self.who.reacts_within, CURIOUS_SPEED)
            case "scared":
                return Intent(self._towards(), SCARED_SPEED if not self.there else 0.0, SCARED_SPEED)
            case "threatening":
                return self._block(robot)
            case _:
                return self._to_goal()

    def _to_goal(self) -> Intent:
        speed, most = self.who.speed, MOST_OF_SPEED * self.who.speed
        if self.there or (self.who.repeat == "once" and self.goal == len(self.who.goals) - 1):
            speed = min(speed, _braking(math.dist(self.place, self.destination)))
        return Intent(self._towards(), speed, most)

    def _towards(self) -> tuple[float, float]:
        return self.way[0] if self.way else self.destination

    def _block(self, robot: ObservedRobot) -> Intent:
        """Stand in front of the robot; HuNavSim's own blockRobot has sine and cosine the wrong way round."""
        gap = max(THREATENING_GAP, robot.radius + self.who.radius + ARRIVED)
        yaw = robot.pose.yaw
        spot = robot.pose.x + gap * math.cos(yaw), robot.pose.y + gap * math.sin(yaw)
        stares = math.dist(self.place, robot.pose[:2]) <= max(STARES_WITHIN, gap + ARRIVED)
        speed = min(THREATENING_SPEED, _braking(math.dist(self.place, spot)))
        return Intent(spot, speed, THREATENING_SPEED, robot.pose[:2] if stares else None)

    # motion

    def move(self, by: Array, velocity: Array, looks_at: tuple[float, float] | None, seconds: float) -> None:
        """Be somewhere else, and face where they look or walk to."""
        self.x, self.y = self.x + float(by[0]), self.y + float(by[1])
        self.velocity = float(velocity[0]), float(velocity[1])
        facing = self.yaw
        if looks_at is not None:
            facing = math.atan2(looks_at[1] - self.y, looks_at[0] - self.x)
        elif math.hypot(*self.velocity) > WALKING:
            facing = math.atan2(self.velocity[1], self.velocity[0])
        turn, most = wrap(facing - self.yaw), TURN_RATE * seconds
        self.yaw = wrap(self.yaw + max(-most, min(most, turn)))


def _braking(distance: float) -> float:
    """Return the speed from which a pedestrian can stop within a distance in m; 0 within ARRIVED."""
    return distance / RELAXATION_TIME if distance > ARRIVED else 0.0
