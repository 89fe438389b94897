"""Speed regulation of pure pursuit: slow down before bends and narrow passages.

Nav2's controller slows down in them; this one also regards the braking distance.
"""

import math

from simscen.model.controllers import RegulatedPurePursuit as RppSpec
from simscen.stack.controllers.path_handler import PathTracker
from simscen.stack.footprint import distance_at
from simscen.stack.protocols import CostmapView
from simscen.stack.setting import Setting

DECELERATION_RATIO, REACTION_TIME_S = 0.9, 0.1
"""Fraction of the maximum deceleration used for planning, and delay before braking starts."""
STATION_SPACING_M = 0.1
"""Distance along the path between the places that are checked."""
SPEED_PER_CLEARANCE_1_S = 10.0
"""Speed allowed per meter of clearance beside the hull, to react when the robot leaves the center of a gap."""


class SpeedRegulation:
    """Computes the speed at a place of the path, and the braking before it. Speeds are in m/s."""

    def __init__(self, spec: RppSpec, setting: Setting) -> None:
        self._spec, self._inscribed = spec, setting.footprint.inscribed
        self._brakes = 2.0 * DECELERATION_RATIO * setting.robot.linear_deceleration

    def beside(self, speed: float, distance: float) -> float:
        """Return the speed with an obstacle `distance` m from the base: Nav2's, and less in narrow passages."""
        spec = self._spec
        if not spec.use_cost_regulated_linear_velocity_scaling or distance >= spec.cost_scaling_dist:
            return speed
        scaled = speed * spec.cost_scaling_gain * distance / spec.cost_scaling_dist
        if not spec.slow_down_ahead:
            return scaled
        room = max(0.0, distance - self._inscribed)
        return min(scaled, spec.regulated_linear_scaling_min_speed + SPEED_PER_CLEARANCE_1_S * room)

    def within(self, speed: float, curvature: float) -> float:
        """Return the speed in a bend of this curvature in 1/m."""
        radii = abs(curvature) * self._spec.regulated_linear_scaling_min_radius
        return speed / radii if self._spec.use_regulated_linear_velocity_scaling and radii > 1.0 else speed

    def before(self, speed: float, slow: float, track: PathTracker, costmap: CostmapView) -> float:
        """Return the speed at most `slow` from which the robot can brake for everything ahead on the path."""
        if not self._spec.slow_down_ahead:
            return slow
        for meters, place, bend in track.stations(STATION_SPACING_M, slow * (slow / self._brakes + REACTION_TIME_S)):
            there, near = self.within(speed, bend), distance_at(costmap, place.real, place.imag)
            if near > 0.0:  # in an obstacle, or off the costmap, is for others to see to
                there = min(there, self.beside(speed, near))
            if there < slow:
                braking = self._brakes * max(0.0, meters - REACTION_TIME_S * slow)
                slow = min(slow, math.sqrt(there * there + braking))
        return slow
