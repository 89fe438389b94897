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
"""Part of the base's deceleration that is counted on, and seconds for which it drives on as it did."""
STATION_SPACING_M = 0.1
"""Meters of path between two places that are looked at."""
SPEED_PER_CLEARANCE_1_S = 10.0
"""1/s. Beside the hull it needs the way of a tenth of a second: who comes off the middle of a gap has to notice it."""


class SpeedRegulation:
    """Knows how slow to be at a place, and how slow before it. Speeds in m/s."""

    def __init__(self, spec: RppSpec, setting: Setting) -> None:
        self._spec, self._inscribed = spec, setting.footprint.inscribed
        self._brakes = 2.0 * DECELERATION_RATIO * setting.robot.linear_deceleration

    def beside(self, speed: float, distance: float) -> float:
        """The speed where the nearest obstacle is `distance` meters from the base: Nav2's, less in a gap."""
        spec = self._spec
        if not spec.use_cost_regulated_linear_velocity_scaling or distance >= spec.cost_scaling_dist:
            return speed
        scaled = speed * spec.cost_scaling_gain * distance / spec.cost_scaling_dist
        if not spec.slow_down_ahead:
            return scaled
        room = max(0.0, distance - self._inscribed)
        return min(scaled, spec.regulated_linear_scaling_min_speed + SPEED_PER_CLEARANCE_1_S * room)

    def within(self, speed: float, curvature: float) -> float:
        """The speed in a bend."""
        radii = abs(curvature) * self._spec.regulated_linear_scaling_min_radius
        return speed / radii if self._spec.use_regulated_linear_velocity_scaling and radii > 1.0 else speed

    def before(self, speed: float, slow: float, track: PathTracker, costmap: CostmapView) -> float:
        """What is left of the speed `slow` here, so that the brakes suffice for all that is ahead on the path."""
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
