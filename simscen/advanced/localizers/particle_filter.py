"""Particle filter and sensor model of scan-matching AMCL."""

import numpy as np
import numpy.typing as npt

from simscen.advanced.localizers.map_trust import MapTrust
from simscen.advanced.localizers.matched_motion import MatchedMotion, sample_motion
from simscen.advanced.localizers.pose_prior import CERTAIN_STD
from simscen.advanced.localizers.scan_memory import step_length
from simscen.advanced.spec import ScanMatchingAmcl
from simscen.core.geometry import Array, Pose2, wrap_array
from simscen.core.messages.navigation import Estimate
from simscen.stack.localizers.augmented_mcl import AugmentedMcl
from simscen.stack.localizers.beams import Beams
from simscen.stack.localizers.distance_field import DistanceField, Float32
from simscen.stack.localizers.motion_models import MotionModel
from simscen.stack.localizers.particle_filter import ParticleFilter
from simscen.stack.localizers.particles import FreeSpace, Particles, are_compact, summarize
from simscen.stack.localizers.sensor_models import BeamSkipping, LikelihoodFieldProb, SensorModel

UNMAPPED_LIKELIHOOD_RATIO = 0.4
"""Minimum likelihood of a beam that ends outside the mapped area, as a share of `z_hit`: about the mean likelihood of
all beams of a well localized robot."""


class TemperedLikelihoodField(LikelihoodFieldProb):
    """Sensor model `likelihood_field_prob` with an exponent, because the errors of neighboring beams are similar."""

    def __init__(
        self, field: DistanceField, z_hit: float, z_rand: float, sigma_hit: float, skipping: BeamSkipping | None = None,
        exponent: float = 1.0, unmapped: npt.NDArray[np.bool_] | None = None,
    ) -> None:  # fmt: skip
        """Create the model. `unmapped` marks cells of `field.table` in which beams carry no information."""
        super().__init__(field, z_hit, z_rand, sigma_hit, skipping)
        self.exponent, self._unmapped = exponent, unmapped

    def _hit_likelihoods(self) -> Float32:
        likelihoods = super()._hit_likelihoods()
        if self._unmapped is not None:
            floor = np.float32(UNMAPPED_LIKELIHOOD_RATIO * self._z_hit)
            likelihoods[self._unmapped] = np.maximum(likelihoods[self._unmapped], floor)
        return likelihoods


ODOMETRY_SHARE = 0.2
"""Share of the particles that follow odometry if odometry and scan matching disagree."""
FIRST_SCAN_WEIGHT = 0.2
"""Weight (exponent of the likelihood) of the first scan after an initial pose. It grows to 1 with the driven distance,
because early scans of a single room fit many poses."""
MIN_CERTAIN_FIT = 0.9
"""Minimum share of a scan's beams that fit the map for the filter to be certain."""


class ScanMatchingParticleFilter(ParticleFilter):
    """Particle filter that can move by scan matching, and that reduces the weight of scans if the map is outdated."""

    _spec: ScanMatchingAmcl

    def __init__(
        self, spec: ScanMatchingAmcl, motion: MotionModel, sensor: SensorModel, free_space: FreeSpace,
        rng: np.random.Generator, trust: MapTrust | None = None,
    ) -> None:  # fmt: skip
        """Create the filter. `trust` determines the weight of scans; if None, all scans have their full weight."""
        self._trust = trust
        super().__init__(spec, motion, sensor, free_space, rng)

    def reset(self, estimate: Estimate) -> None:
        """Restart at an estimate, as in `ParticleFilter.reset`."""
        super().reset(estimate)
        if self._spec.relocalization == "scan_matching":  # random particles would compete with the search
            self._augmented_mcl = AugmentedMcl(0.0, 0.0)
        self._map_weight, self._were_compact = 1.0, False
        self.fitting_share = 0.0
        """Share of the beams of the last scan that fit the map, among those that end on the mapped area."""
        has_prior = estimate.pose is not None and self._spec.settling_distance > 0
        self._scan_weight = FIRST_SCAN_WEIGHT if has_prior else 1.0

    @property
    def is_certain(self) -> bool:
        """Whether nearly all beams of the last scan fit the map, and the particles are compact (see `are_compact`)."""
        is_mapped = self._map_weight == 1.0 and self.fitting_share >= MIN_CERTAIN_FIT
        return is_mapped and self._were_compact and self._augmented_mcl.random_fraction == 0

    def move(self, delta: Pose2) -> None:
        """Move each particle by its own sample of the motion model. `delta` is the odometry in the base frame."""
        self._settle(delta)
        super().move(delta)

    def move_by_scan_matching(self, step: MatchedMotion, delta: Pose2) -> None:
        """Move each particle by its own sample of `step`, the motion by scan matching.

        `delta` is the same motion by odometry, in the base frame. If both disagree, the share ODOMETRY_SHARE of the
        particles moves by odometry, unless the last scan was ignored.
        """
        self._settle(delta)
        poses = sample_motion(self.particles.poses, step, self._rng)
        if self._map_weight > 0 and not step.agrees(delta):
            by_odometry = self._rng.random(len(poses)) < ODOMETRY_SHARE
            poses[by_odometry] = self._motion.sample(self.particles.poses[by_odometry], delta, self._rng)
        self.particles = Particles(poses, self.particles.weights)

    def _settle(self, delta: Pose2) -> None:
        """Increase the weight of scans by the motion `delta`: by 1 / `settling_distance` per meter, up to 1."""
        if self._scan_weight < 1.0:
            self._scan_weight = min(1.0, self._scan_weight + step_length(delta) / self._spec.settling_distance)

    def redistribute(self, poses: Array, shares: Array) -> tuple[Pose2, Array]:
        """Distribute all particles around `poses` (k, 3) with the `shares` (k,). Return the new pose and covariance."""
        count = self._bound.max_samples
        drawn = poses[self._rng.choice(len(poses), count, p=shares)] + self._rng.normal(0.0, CERTAIN_STD, (count, 3))
        drawn[:, 2] = wrap_array(drawn[:, 2])
        self.particles = Particles.with_equal_weights(drawn)
        self._is_random = self._is_descendant = None
        self._scan_weight = 1.0
        return summarize(self.particles, self._sensor.peak_power)

    def _trusted_beams(self, beams: Beams) -> tuple[float, Beams]:
        """Return the weight of a scan (exponent of its likelihood), and the beams to use."""
        if self._trust is not None and len(beams.ends):
            self._map_weight, self.fitting_share, used_hits = self._trust.weight(self.particles, beams)
            if used_hits is not None and self._map_weight > 0:
                beams = beams.with_hits(used_hits)
        return self._map_weight * self._scan_weight, beams

    def _resample(self) -> None:
        self._were_compact = are_compact(self.particles)
        super()._resample()
