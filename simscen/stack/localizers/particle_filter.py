"""Adaptive Monte Carlo localisation: move, weigh, sum up, draw anew.

Thrun, Burgard & Fox, Probabilistic Robotics, tables 8.2 to 8.4; nav2_amcl's pf.c.
"""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.localization import Estimate
from simscen.core.messages.sensor_data import Scan
from simscen.model.localizers import Amcl
from simscen.stack.localizers.beams import Beams, select_beams
from simscen.stack.localizers.clusters import BINS_IN_TOUCH, in_touch, summarise
from simscen.stack.localizers.finder import around as around_places
from simscen.stack.localizers.kld import KldBound
from simscen.stack.localizers.likelihood_field import SensorModel
from simscen.stack.localizers.map_trust import MapTrust
from simscen.stack.localizers.motion_models import MotionModel
from simscen.stack.localizers.particles import FreeSpace, Particles, alike
from simscen.stack.localizers.recovery import PROBES, Recovery
from simscen.stack.localizers.resampling import adaptive, systematic
from simscen.stack.localizers.scan_matcher import Step, moved
from simscen.stack.localizers.scan_memory import METRES_A_RAD

CONVERGED_WITHIN = 0.5  # nav2_amcl's pf.dist_threshold, in m

BELIEVE_WHEELS = 0.2
"""Share of the particles that get as far as odometry says where the scans say otherwise."""

AT_ONCE = 0.2
"""What the first scan counts, of what it does when the robot has driven `settling_distance` m."""

SURE = 0.9
"""Share of a scan's beams that must fit for nothing to be amiss."""

_STRAY, _ANYWHERE = 1.0, 2.0
"""Marks of what descends from particles that recovery put anywhere, and of these themselves."""


class ParticleFilter:
    """Particles that are moved by odometry and weighed by scans; it knows neither time nor frames but the map's."""

    def __init__(
        self, spec: Amcl, motion: MotionModel, sensor: SensorModel, anywhere: FreeSpace, chance: np.random.Generator,
        trust: MapTrust | None = None,
    ) -> None:  # fmt: skip
        """`trust` says how much the map is worth where the robot is; without, it is right everywhere."""
        self._trust = trust
        self._spec, self._motion, self._sensor, self._anywhere, self._chance = spec, motion, sensor, anywhere, chance
        self._bound = KldBound(spec.pf_err, spec.pf_z, spec.min_particles, spec.max_particles)
        self._few_suffice = bool(self._bound.samples(BINS_IN_TOUCH) <= self._bound.least)
        self.begin(Estimate(None))

    def begin(self, estimate: Estimate) -> None:
        """Start over: particles around the estimate's pose, or over all free space when it has none."""
        self.particles = self._anywhere.begin(estimate, self._bound.most, self._chance)
        self._recovery = Recovery(self._spec.recovery_alpha_slow, self._spec.recovery_alpha_fast, self._sensor.strays)
        self._put_anywhere: npt.NDArray[np.bool_] | None = None
        self._strays: npt.NDArray[np.bool_] | None = None
        self._corrections, self._trusted, self._together = 0, 1.0, False
        self.fitting = 0.0
        """The share of the last scan's beams that fit at the particles, as far as the map says anything of them."""
        self._settled = AT_ONCE if estimate.pose is not None and self._spec.settling_distance > 0 else 1.0

    @property
    def sure(self) -> bool:
        """Whether the map showed nearly all that the last scan saw, and the particles were one narrow group."""
        known = self._trusted == 1.0 and self.fitting >= SURE
        return known and self._together and self._recovery.share == 0

    def beams(self, scan: Scan) -> Beams:
        """Those of a scan that are compared with the map."""
        return select_beams(scan, self._spec.max_beams, self._spec.laser_min_range, self._spec.farthest)

    def move(self, delta: Pose2) -> None:
        """Move each particle by its own noisy copy of a motion that odometry reports in the base frame."""
        self._settle(delta)
        poses = self._motion.sample(self.particles.poses, delta, self._chance)
        self.particles = Particles(poses, self.particles.weights)

    def follow(self, seen: Step, delta: Pose2) -> None:
        """Move each particle by its own copy of a motion that was seen; `delta` is what odometry reports of it.

        Where the two differ wheels slip, or people walk along with the robot: then some particles get as far as
        odometry says, and the map decides, unless it does not show what is around. How the robot turned walls show,
        whoever walks beside it: wheels that slip in a turn would only find rebuilt rooms that fit by chance.
        """
        self._settle(delta)
        poses = moved(self.particles.poses, seen, self._chance)
        if self._trusted > 0 and not seen.agrees(delta):
            some = self._chance.random(len(poses)) < BELIEVE_WHEELS
            driven = Step(Pose2(delta.x, delta.y, seen.delta.yaw), seen.covariance)
            poses[some] = moved(self.particles.poses[some], driven, self._chance)
        self.particles = Particles(poses, self.particles.weights)

    def _settle(self, delta: Pose2) -> None:
        """The first metres from a place that was told: a scan of a room fits many places, and only the next rooms tell.

        So scans count little at first, and what was told counts on.
        """
        if self._settled < 1.0:
            way = math.hypot(delta.x, delta.y) + METRES_A_RAD * abs(delta.yaw)
            self._settled = min(1.0, self._settled + way / self._spec.settling_distance)

    def put(self, poses: Array, shares: Array) -> tuple[Pose2, Array]:
        """Put all particles about `poses` (k, 3), each with its share (k,); and where they say the robot is then."""
        drawn = around_places(poses, shares, self._bound.most, self._chance)
        self.particles = Particles.equal(drawn)
        self._put_anywhere = self._strays = None
        self._settled = 1.0
        return summarise(self.particles, self._sensor.peak)

    def correct(self, scan: Scan) -> tuple[Pose2, Array] | None:
        """Weigh the particles by a scan and draw new ones; where that says the robot is, with covariance (3, 3).

        None when it does not say: nothing was hit, or no particle can explain the scan. The latter leaves the
        particles equally likely, as in nav2_amcl, and counts as likelihood zero for the recovery. Particles are
        summed up before new ones are drawn, which would only add noise (Probabilistic Robotics, section 4.3.4).
        """
        spec, poses = self._spec, self.particles.poses
        beams = self.beams(scan)
        if self._trust is not None and len(beams.ends):
            self._trusted, self.fitting, told = self._trust.of(self.particles, beams)
            if self._trusted == 0:
                return None
            beams = beams if told is None else beams.of_hits(told)
        converged = spec.do_beamskip and self.particles.within(CONVERGED_WITHIN)
        counts = self._trusted * self._settled
        logarithm = counts * self._sensor.log_likelihood(poses, beams, converged)
        best, worst = logarithm.item(logarithm.argmax()), logarithm.item(logarithm.argmin())
        if best == worst and best > -np.inf:
            return None
        shift = best if best > -np.inf else 0.0
        weights = self.particles.weights * np.exp(logarithm - shift)
        total = float(np.add.reduce(weights))
        if self._recovery.wanted:
            self._observe(beams, weights, shift, counts)
        weights = weights / total if total > 0 else alike(len(poses))
        self.particles = self.particles.weighted(weights)
        answer = summarise(self.particles, self._sensor.peak) if total > 0 else None
        self._together = in_touch(self.particles)
        self._resample()
        return answer

    def _observe(self, beams: Beams, weights: Array, shift: float, counts: float) -> None:
        """Tell the recovery how the particles explain a scan, but for those that were put anywhere a scan ago.

        `weights` (n,) are theirs times the likelihood of the beams to the power `counts`, without a factor exp(shift).
        """
        kept = slice(None) if self._put_anywhere is None or self._put_anywhere.all() else ~self._put_anywhere
        likely = float(weights[kept].sum() / self.particles.weights[kept].sum())
        tracked = math.log(likely) + shift if likely > 0 else -math.inf
        anywhere = counts * self._sensor.log_likelihood(self._anywhere.draw(PROBES, self._chance), beams, False)
        scale = self._sensor.tempering(beams)
        self._recovery.observe(tracked * scale, anywhere * scale)

    def _resample(self) -> None:
        """Draw new particles, on every resample_interval-th scan and, if selective, when too few carry weight."""
        self._corrections += 1
        self._put_anywhere = None
        if self._corrections % self._spec.resample_interval:
            return
        if self._spec.selective_resampling and self.particles.effective > len(self.particles.weights) / 2:
            return
        if self._few_suffice and self._recovery.share == 0 and in_touch(self.particles):
            chosen = systematic(self.particles.weights, self._bound.least, self._chance)
            self.particles = Particles.equal(self.particles.poses.T.take(chosen, axis=1).T)
            self._strays = None
            return
        if self._recovery.share == 0:
            self._strays = None
        if self._strays is not None:
            weights = self.particles.weights.copy()
            weights[self._strays] *= self._recovery.kept(float(weights[self._strays].sum()))
            self.particles = self.particles.weighted(weights / weights.sum())
        drawn = adaptive(self._draw, self._bound).T.copy()
        self._put_anywhere, self._strays = drawn[3] == _ANYWHERE, drawn[3] > 0
        self.particles = Particles.equal(drawn[:3].T)

    def _draw(self, count: int) -> Array:
        """Poses in random order: most from the particles, the recovery's share from anywhere.

        Rows (count, 4): x, y, yaw, and _ANYWHERE, or _STRAY for what descends from such.
        """
        drawn = np.zeros((count, 4))
        chosen = systematic(self.particles.weights, count, self._chance)
        drawn[:, :3] = self.particles.poses[chosen]
        if self._strays is not None:
            drawn[self._strays[chosen], 3] = _STRAY
        if (share := self._recovery.share) > 0:
            lost = self._chance.random(count) < share
            drawn[lost, :3] = self._anywhere.draw(int(lost.sum()), self._chance)
            drawn[lost, 3] = _ANYWHERE
        return self._chance.permutation(drawn)
