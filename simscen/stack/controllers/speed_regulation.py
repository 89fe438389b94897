"""Speed regulation of the regulated pure pursuit controller (Macenski et al. 2023)."""

import math

from simscen.model.controllers import RegulatedPurePursuit as RppSpec
from simscen.stack.controllers.path_handler import PathTracker
from simscen.stack.footprint import distance_at
from simscen.stack.protocols import CostmapView
from simscen.stack.setting import Setting

DECELERATION_RATIO, REACTION_TIME_S = 0.9, 0.1
"""Assumptions about braking: fraction of the maximum deceleration, and delay before braking starts."""
SAMPLE_SPACING_M = 0.1
"""Distance between the points of the path ahead for which a speed is determined."""
SPEED_PER_CLEARANCE_1_S = 10.0
"""Speed in m/s that each meter of clearance adds to the minimum speed in a narrow passage."""


class SpeedRegulation:
    """Regulates the speed (m/s) by curvature and obstacle distance, at the robot and on the path ahead."""

    def __init__(self, spec: RppSpec, setting: Setting) -> None:
        self._spec, self._inscribed_radius = spec, setting.footprint.inscribed
        self._doubled_deceleration = 2.0 * DECELERATION_RATIO * setting.robot.linear_deceleration

    def speed_at_distance(self, speed: float, distance: float) -> float:
        """Return the speed at `distance` m from the base to the nearest obstacle.

        With `slow_down_ahead`, the speed in narrow passages is lower than in Nav2.
        """
        spec = self._spec
        if not spec.use_cost_regulated_linear_velocity_scaling or distance >= spec.cost_scaling_dist:
            return speed
        scaled = speed * spec.cost_scaling_gain * distance / spec.cost_scaling_dist
        if not spec.slow_down_ahead:
            return scaled
        clearance = max(0.0, distance - self._inscribed_radius)
        return min(scaled, spec.regulated_linear_scaling_min_speed + SPEED_PER_CLEARANCE_1_S * clearance)

    def speed_at_curvature(self, speed: float, curvature: float) -> float:
        """Return the speed in a bend with this curvature in 1/m."""
        ratio = abs(curvature) * self._spec.regulated_linear_scaling_min_radius
        return speed / ratio if self._spec.use_regulated_linear_velocity_scaling and ratio > 1.0 else speed

    def speed_for_path_ahead(self, speed: float, regulated: float, tracker: PathTracker, costmap: CostmapView) -> float:
        """Return `regulated`, reduced so that the robot can brake in time for bends and narrow passages ahead.

        `speed` is the speed without regulation.
        """
        if not self._spec.slow_down_ahead:
            return regulated
        stopping_distance = regulated * (regulated / self._doubled_deceleration + REACTION_TIME_S)
        for distance, point, curvature in tracker.samples_ahead(SAMPLE_SPACING_M, stopping_distance):
            point_speed = self.speed_at_curvature(speed, curvature)
            obstacle_distance = distance_at(costmap, point.real, point.imag)
            if obstacle_distance > 0.0:  # the collision check handles obstacles on the path
                point_speed = min(point_speed, self.speed_at_distance(speed, obstacle_distance))
            if point_speed < regulated:
                braking = self._doubled_deceleration * max(0.0, distance - REACTION_TIME_S * regulated)
                regulated = min(regulated, math.sqrt(point_speed * point_speed + braking))
        return regulated
