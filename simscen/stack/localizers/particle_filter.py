"""The particle filter of AMCL: moves, weights, and resamples particles, and estimates the pose.

Sources: Thrun, Burgard & Fox, Probabilistic Robotics, tables 8.2 to 8.4; nav2_amcl's pf.c.
"""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Scan
from simscen.model.localizers import AmclParameters
from simscen.stack.localizers.augmented_mcl import PROBE_COUNT, AugmentedMcl
from simscen.stack.localizers.beams import Beams, select_beams
from simscen.stack.localizers.motion_models import MotionModel
from simscen.stack.localizers.particles import (
    MAX_COMPACT_BINS,
    FreeSpace,
    Particles,
    are_compact,
    equal_weights,
    summarize,
)
from simscen.stack.localizers.resampling import KldBound, kld_sampling, systematic_resampling
from simscen.stack.localizers.sensor_models import SensorModel

CONVERGENCE_DISTANCE_M = 0.5
"""The filter has converged if all particles are within this distance of the mean, along x and along y (nav2_amcl's
pf.dist_threshold)."""
_DESCENDANT, _RANDOM = 1.0, 2.0
"""Marks in the fourth column of drawn particles: descendant of a random particle, and new random particle."""


class ParticleFilter:
    """Particle filter in the map frame. Odometry moves the particles, and scans weight them.

    Subclasses may override `reset`, `_trusted_beams`, and `_resample`.
    """

    def __init__(
        self, spec: AmclParameters, motion: MotionModel, sensor: SensorModel, free_space: FreeSpace,
        rng: np.random.Generator,
    ) -> None:  # fmt: skip
        self._spec, self._motion, self._sensor, self._free_space, self._rng = (
            spec, motion, sensor, free_space, rng,
        )  # fmt: skip
        self._bound = KldBound(spec.pf_err, spec.pf_z, spec.min_particles, spec.max_particles)
        self._compact_needs_minimum = bool(self._bound.samples(MAX_COMPACT_BINS) <= self._bound.min_samples)
        self.reset(Estimate(None))

    def reset(self, estimate: Estimate) -> None:
        """Restart with particles around the pose of the estimate, or over all free space if this pose is None."""
        self.particles = self._free_space.initial_particles(estimate, self._bound.max_samples, self._rng)
        self._augmented_mcl = AugmentedMcl(
            self._spec.recovery_alpha_slow, self._spec.recovery_alpha_fast, self._sensor.max_random_fraction
        )
        self._is_random: npt.NDArray[np.bool_] | None = None
        """Which particles (n,) were drawn at random after the last scan."""
        self._is_descendant: npt.NDArray[np.bool_] | None = None
        """Which particles (n,) were drawn at random, or descend from such a particle."""
        self._correction_count = 0

    def beams(self, scan: Scan) -> Beams:
        """Return the beams of a scan that are compared with the map."""
        return select_beams(scan, self._spec.max_beams, self._spec.laser_min_range, self._spec.max_used_range)

    def move(self, delta: Pose2) -> None:
        """Move each particle by a sample of the motion model. `delta` is the odometry in the base frame."""
        poses = self._motion.sample(self.particles.poses, delta, self._rng)
        self.particles = Particles(poses, self.particles.weights)

    def correct(self, scan: Scan) -> tuple[Pose2, Array] | None:
        """Weight the particles by a scan and resample. Return the estimated pose and its covariance (3, 3).

        Return None if the scan fits all particles equally well, fits no particle at all, or is not trusted. If the scan
        fits no particle, all particles get the same weight. The estimate is computed before resampling, because
        resampling adds noise.
        """
        spec, poses = self._spec, self.particles.poses
        exponent, beams = self._trusted_beams(self.beams(scan))
        if exponent == 0:
            return None
        has_converged = spec.do_beamskip and self.particles.are_within(CONVERGENCE_DISTANCE_M)
        logarithm = exponent * self._sensor.log_likelihood(poses, beams, has_converged)
        best, worst = logarithm.item(logarithm.argmax()), logarithm.item(logarithm.argmin())
        if best == worst and best > -np.inf:
            return None
        shift = best if best > -np.inf else 0.0
        weights = self.particles.weights * np.exp(logarithm - shift)
        total = float(np.add.reduce(weights))
        if self._augmented_mcl.is_enabled:
            self._observe_likelihood(beams, weights, shift, exponent)
        weights = weights / total if total > 0 else equal_weights(len(poses))
        self.particles = self.particles.with_weights(weights)
        estimate = summarize(self.particles, self._sensor.peak_power) if total > 0 else None
        self._resample()
        return estimate

    def _trusted_beams(self, beams: Beams) -> tuple[float, Beams]:
        """Return the exponent for the likelihood of a scan (0 ignores the scan), and the beams to use: 1, and all."""
        return 1.0, beams

    def _observe_likelihood(self, beams: Beams, weights: Array, shift: float, exponent: float) -> None:
        """Pass the likelihoods of a scan at the particles and at random poses to Augmented MCL.

        `weights` (n,) are the new weights of the particles, not normalized. `shift` was subtracted from their
        logarithms. New random particles do not count.
        """
        counted = slice(None) if self._is_random is None or self._is_random.all() else ~self._is_random
        likelihood = float(weights[counted].sum() / self.particles.weights[counted].sum())
        at_particles = math.log(likelihood) + shift if likelihood > 0 else -math.inf
        random_poses = self._free_space.draw(PROBE_COUNT, self._rng)
        at_random_poses = exponent * self._sensor.log_likelihood(random_poses, beams, False)
        scale = self._sensor.tempering_exponent(beams)
        self._augmented_mcl.observe(at_particles * scale, at_random_poses * scale)

    def _resample(self) -> None:
        """Resample at every n-th scan, where n is `resample_interval`.

        With `selective_resampling`, resample only if the effective number of particles is at most half of their number.
        """
        self._correction_count += 1
        self._is_random = None
        if self._correction_count % self._spec.resample_interval:
            return
        if self._spec.selective_resampling and self.particles.effective_count > len(self.particles.weights) / 2:
            return
        # Compact particles are in so few bins that KLD sampling, too, would draw the minimum number of particles.
        if self._compact_needs_minimum and self._augmented_mcl.random_fraction == 0 and are_compact(self.particles):
            chosen = systematic_resampling(self.particles.weights, self._bound.min_samples, self._rng)
            self.particles = Particles.with_equal_weights(self.particles.poses.T.take(chosen, axis=1).T)
            self._is_descendant = None
            return
        if self._augmented_mcl.random_fraction == 0:
            self._is_descendant = None
        if self._is_descendant is not None:
            weights = self.particles.weights.copy()
            weights[self._is_descendant] *= self._augmented_mcl.kept_fraction(float(weights[self._is_descendant].sum()))
            self.particles = self.particles.with_weights(weights / weights.sum())
        drawn = kld_sampling(self._draw, self._bound).T.copy()
        self._is_random, self._is_descendant = drawn[3] == _RANDOM, drawn[3] > 0
        self.particles = Particles.with_equal_weights(drawn[:3].T)

    def _draw(self, count: int) -> Array:
        """Draw poses from the particles and, for Augmented MCL, from the free space. Return them in random order.

        Rows (count, 4) are x, y, yaw, and the mark _RANDOM, _DESCENDANT, or 0.
        """
        drawn = np.zeros((count, 4))
        chosen = systematic_resampling(self.particles.weights, count, self._rng)
        drawn[:, :3] = self.particles.poses[chosen]
        if self._is_descendant is not None:
            drawn[self._is_descendant[chosen], 3] = _DESCENDANT
        if (random_fraction := self._augmented_mcl.random_fraction) > 0:
            is_random = self._rng.random(count) < random_fraction
            drawn[is_random, :3] = self._free_space.draw(int(is_random.sum()), self._rng)
            drawn[is_random, 3] = _RANDOM
        return self._rng.permutation(drawn)
