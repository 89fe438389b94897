"""From the specifications of the shipped localizers to localizers."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from simscen.core.decorators import cached_on_instance
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.model import localizers as model
from simscen.stack.localizers.amcl import AmclLocalizer
from simscen.stack.localizers.beam_model import BeamModel, opaque_field
from simscen.stack.localizers.dead_reckoning import DeadReckoning
from simscen.stack.localizers.distance_field import DistanceField, beyond_the_map
from simscen.stack.localizers.global_search import GlobalSearch
from simscen.stack.localizers.ground_truth import GroundTruthLocalizer
from simscen.stack.localizers.likelihood_field import (
    BeamSkipping,
    LikelihoodField,
    LikelihoodFieldProb,
    SensorModel,
    obstacle_field,
)
from simscen.stack.localizers.map_trust import NEAR, MapTrust
from simscen.stack.localizers.misfit import MapMisfit
from simscen.stack.localizers.motion_models import Differential, MotionModel, Omni
from simscen.stack.localizers.particle_filter import ParticleFilter
from simscen.stack.localizers.particles import FreeSpace
from simscen.stack.protocols import Localizer
from simscen.stack.setting import Setting


def amcl(spec: model.Amcl, setting: Setting) -> Localizer:
    """A particle filter; without a map there is nothing to match scans with, then it is dead reckoning."""
    if setting.map is None:
        return DeadReckoning(setting.estimate)
    motion, known = _motion_model(spec, setting.robot.holonomic), matching(setting.map, spec)
    doubted = known.trust if spec.map_trust_full > 0 else None
    particles = ParticleFilter(spec, motion, known.sensor, known.anywhere, setting.chance, doubted)
    search = (known.search, known.trust) if spec.relocalization == "scan_matching" else None
    misfit = known.misfit if spec.covariance == "scatter" else None
    return AmclLocalizer(spec, particles, motion, setting.estimate, setting.surroundings.tick_rate, search, misfit)


@dataclass(frozen=True, eq=False)
class Matching:
    """How AMCL compares scans with its map: all that it keeps of that does not depend on the run."""

    sensor: SensorModel
    anywhere: FreeSpace
    trust: MapTrust
    misfit: MapMisfit
    search: GlobalSearch

    def ready(self) -> None:
        """Work out now what the search for a place nearby needs."""
        self.search.ready()


@cached_on_instance
def matching(grid: OccupancyGrid, spec: model.Amcl) -> Matching:
    """It takes some 10 ms for a house, and 0.3 s for a map of 100 x 100 m."""
    grid = replace(grid)  # the grid holds the result: what held that grid in turn would wait for the garbage collector
    field, beyond = obstacle_field(grid, spec.laser_likelihood_max_dist), beyond_the_map(grid).ravel()
    fits = field if spec.laser_likelihood_max_dist > NEAR else obstacle_field(grid, 2 * NEAR)
    trust = MapTrust(fits, beyond, spec.map_trust_none, spec.map_trust_full)
    misfit = MapMisfit(fits, beyond, spec.z_hit, spec.z_rand, spec.sigma_hit)
    return Matching(_sensor_model(spec, grid, field, beyond), FreeSpace(grid), trust, misfit, GlobalSearch(grid, field))


def ekf(spec: model.Ekf, setting: Setting) -> Localizer:
    """An extended Kalman filter of odometry and gyroscope."""
    from simscen.stack.localizers.ekf import EkfLocalizer

    return EkfLocalizer(spec, setting.estimate, setting.surroundings.tick_rate)


def ground_truth(_spec: model.GroundTruth, setting: Setting) -> Localizer:
    """The true pose."""
    return GroundTruthLocalizer(setting.estimate)


def odometry(_spec: model.OdometryOnly, setting: Setting) -> Localizer:
    """Dead reckoning."""
    return DeadReckoning(setting.estimate)


def _motion_model(spec: model.Amcl, holonomic: bool) -> MotionModel:
    alpha = (spec.alpha1, spec.alpha2, spec.alpha3, spec.alpha4)
    if (spec.robot_model or ("omni" if holonomic else "differential")) == "omni":
        return Omni((*alpha, spec.alpha5))
    return Differential(alpha)


def _sensor_model(
    spec: model.Amcl, grid: OccupancyGrid, field: DistanceField, beyond: npt.NDArray[np.bool_]
) -> SensorModel:
    """`field` and what is `beyond` are of the same grid, for all models but that of beams."""
    if spec.laser_model_type == "beam":
        opaque = opaque_field(grid, spec.farthest)
        return BeamModel(
            opaque, spec.z_hit, spec.z_short, spec.z_max, spec.z_rand, spec.sigma_hit, spec.lambda_short
        )  # fmt: skip
    if spec.laser_model_type == "likelihood_field":
        return LikelihoodField(field, spec.z_hit, spec.z_rand, spec.sigma_hit)
    skipping = BeamSkipping(spec.beam_skip_distance, spec.beam_skip_threshold, spec.beam_skip_error_threshold)
    says_nothing = beyond if spec.beams_beyond_the_map == "say_nothing" else None
    return LikelihoodFieldProb(
        field, spec.z_hit, spec.z_rand, spec.sigma_hit, skipping if spec.do_beamskip else None,
        spec.likelihood_exponent, says_nothing,
    )  # fmt: skip
