"""Functions that build the reference localizers. The `component` of a specification names its function."""

from dataclasses import dataclass, replace

from simscen.core.decorators import cached_on_instance
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.model import localizers as model
from simscen.stack.localizers.amcl import AmclLocalizer
from simscen.stack.localizers.dead_reckoning import DeadReckoning
from simscen.stack.localizers.distance_field import DistanceField
from simscen.stack.localizers.ground_truth import GroundTruthLocalizer
from simscen.stack.localizers.motion_models import DifferentialMotionModel, MotionModel, OmniMotionModel
from simscen.stack.localizers.particle_filter import ParticleFilter
from simscen.stack.localizers.particles import FreeSpace
from simscen.stack.localizers.sensor_models import (
    BeamModel,
    BeamSkipping,
    LikelihoodField,
    LikelihoodFieldProb,
    SensorModel,
    obstacle_field,
    opaque_field,
)
from simscen.stack.protocols import Localizer
from simscen.stack.setting import Setting


def amcl(spec: model.Amcl, setting: Setting) -> Localizer:
    """Build AMCL; without a map, build dead reckoning instead."""
    if setting.map is None:
        return DeadReckoning(setting.estimate)
    motion, models = motion_model(spec, setting.robot.holonomic), map_models(setting.map, spec)
    particle_filter = ParticleFilter(spec, motion, models.sensor, models.free_space, setting.rng)
    return AmclLocalizer(spec, particle_filter, motion, setting.estimate, setting.surroundings.tick_rate)


def ekf(spec: model.Ekf, setting: Setting) -> Localizer:
    """Build an extended Kalman filter that fuses wheel odometry and gyroscope."""
    from simscen.stack.localizers.ekf import EkfLocalizer

    return EkfLocalizer(spec, setting.estimate, setting.surroundings.tick_rate)


def ground_truth(_spec: model.GroundTruth, setting: Setting) -> Localizer:
    """Build a localizer that reports the true pose."""
    return GroundTruthLocalizer(setting.estimate)


def odometry(_spec: model.OdometryOnly, setting: Setting) -> Localizer:
    """Build a localizer that only integrates odometry (dead reckoning)."""
    return DeadReckoning(setting.estimate)


@dataclass(frozen=True, eq=False)
class MapModels:
    """Sensor model and free space of a map. All runs share them."""

    sensor: SensorModel
    free_space: FreeSpace


@cached_on_instance
def map_models(grid: OccupancyGrid, spec: model.Amcl) -> MapModels:
    """Return the sensor model and the free space of a map. Cached in the map."""
    grid = replace(grid)  # a copy, so that the map is not kept alive by its own cache
    field = obstacle_field(grid, spec.laser_likelihood_max_dist)
    return MapModels(sensor_model(spec, grid, field), FreeSpace(grid))


def precompute(spec: model.Amcl, grid: OccupancyGrid) -> None:
    """Compute and cache the models of a map, before worker processes are forked."""
    map_models(grid, spec)


def motion_model(spec: model.AmclParameters, holonomic: bool) -> MotionModel:
    """Return the motion model `robot_model`; if it is not set, the model for a holonomic or non-holonomic robot."""
    alpha = (spec.alpha1, spec.alpha2, spec.alpha3, spec.alpha4)
    if (spec.robot_model or ("omni" if holonomic else "differential")) == "omni":
        return OmniMotionModel((*alpha, spec.alpha5))
    return DifferentialMotionModel(alpha)


def sensor_model(spec: model.AmclParameters, grid: OccupancyGrid, field: DistanceField) -> SensorModel:
    """Return the sensor model `laser_model_type`. `field` is the result of `obstacle_field` for `grid`."""
    if spec.laser_model_type == "beam":
        opaque = opaque_field(grid, spec.max_used_range)
        return BeamModel(
            opaque, spec.z_hit, spec.z_short, spec.z_max, spec.z_rand, spec.sigma_hit, spec.lambda_short
        )  # fmt: skip
    if spec.laser_model_type == "likelihood_field":
        return LikelihoodField(field, spec.z_hit, spec.z_rand, spec.sigma_hit)
    return LikelihoodFieldProb(field, spec.z_hit, spec.z_rand, spec.sigma_hit, beam_skipping(spec))


def beam_skipping(spec: model.AmclParameters) -> BeamSkipping | None:
    """Return the parameters of beam skipping; None if `do_beamskip` is false."""
    if not spec.do_beamskip:
        return None
    return BeamSkipping(spec.beam_skip_distance, spec.beam_skip_threshold, spec.beam_skip_error_threshold)
