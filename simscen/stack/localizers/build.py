"""From a specification to a localizer."""

import numpy as np
from typing_extensions import assert_never

from simscen.core.belief import Estimate
from simscen.core.grid import OccupancyGrid
from simscen.model import stack as model
from simscen.stack.localizers.amcl import AmclLocalizer
from simscen.stack.localizers.beam_model import BeamModel, opaque_field
from simscen.stack.localizers.dead_reckoning import DeadReckoning
from simscen.stack.localizers.ground_truth import GroundTruthLocalizer
from simscen.stack.localizers.likelihood_field import (
    BeamSkipping,
    LikelihoodField,
    LikelihoodFieldProb,
    SensorModel,
    obstacle_field,
)
from simscen.stack.localizers.motion_models import Differential, MotionModel, Omni
from simscen.stack.localizers.particle_filter import ParticleFilter
from simscen.stack.localizers.particles import FreeSpace
from simscen.stack.protocols import Localizer, Surroundings


def build_localizer(
    spec: model.Localizer, surroundings: Surroundings, estimate: Estimate, chance: np.random.Generator
) -> Localizer:
    """A localizer at its start, told `estimate`; `chance` is its own random stream.

    Without a map there is nothing to match scans with: then `amcl` is dead reckoning.
    """
    rate = surroundings.tick_rate
    match spec:
        case model.Amcl() if surroundings.map is not None:
            motion = _motion_model(spec, surroundings.robot.holonomic)
            sensor, anywhere = _sensor_model(spec, surroundings.map), FreeSpace(surroundings.map)
            particles = ParticleFilter(spec, motion, sensor, anywhere, chance)
            return AmclLocalizer(spec, particles, motion, estimate, rate)
        case model.Amcl() | model.OdometryOnly():
            return DeadReckoning(estimate)
        case model.Ekf():
            from simscen.stack.localizers.ekf import EkfLocalizer

            return EkfLocalizer(spec, estimate, rate)
        case model.GroundTruth():
            return GroundTruthLocalizer(estimate)
        case _:
            assert_never(spec)


def _motion_model(spec: model.Amcl, holonomic: bool) -> MotionModel:
    alpha = (spec.alpha1, spec.alpha2, spec.alpha3, spec.alpha4)
    if (spec.robot_model or ("omni" if holonomic else "differential")) == "omni":
        return Omni((*alpha, spec.alpha5))
    return Differential(alpha)


def _sensor_model(spec: model.Amcl, grid: OccupancyGrid) -> SensorModel:
    if spec.laser_model_type == "beam":
        field = opaque_field(grid, spec.laser_max_range)
        return BeamModel(
            field, spec.z_hit, spec.z_short, spec.z_max, spec.z_rand, spec.sigma_hit, spec.lambda_short
        )  # fmt: skip
    field = obstacle_field(grid, spec.laser_likelihood_max_dist)
    if spec.laser_model_type == "likelihood_field":
        return LikelihoodField(field, spec.z_hit, spec.z_rand, spec.sigma_hit)
    skipping = BeamSkipping(spec.beam_skip_distance, spec.beam_skip_threshold, spec.beam_skip_error_threshold)
    return LikelihoodFieldProb(
        field, spec.z_hit, spec.z_rand, spec.sigma_hit, skipping if spec.do_beamskip else None
    )  # fmt: skip
