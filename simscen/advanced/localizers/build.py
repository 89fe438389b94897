"""Builders of the advanced localizers, and models of a map that are computed once for all runs on the map."""

from dataclasses import dataclass, replace

from simscen.advanced.localizers.covariance_estimator import MapResiduals
from simscen.advanced.localizers.global_search import GlobalSearch
from simscen.advanced.localizers.map_trust import FIT_DISTANCE_M, MapTrust, unmapped_cells
from simscen.advanced.localizers.particle_filter import ScanMatchingParticleFilter, TemperedLikelihoodField
from simscen.advanced.localizers.scan_matching_amcl import ScanMatchingAmclLocalizer
from simscen.advanced.spec import ScanMatchingAmcl, SlipEkf
from simscen.core.decorators import cached_on_instance
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.stack.localizers.build import beam_skipping, motion_model, sensor_model
from simscen.stack.localizers.dead_reckoning import DeadReckoning
from simscen.stack.localizers.particles import FreeSpace
from simscen.stack.localizers.sensor_models import SensorModel, obstacle_field
from simscen.stack.protocols import Localizer
from simscen.stack.setting import Setting


def scan_matching_amcl(spec: ScanMatchingAmcl, setting: Setting) -> Localizer:
    """Return a scan-matching AMCL, or dead reckoning if there is no map."""
    if setting.map is None:
        return DeadReckoning(setting.estimate)
    motion, models = motion_model(spec, setting.robot.holonomic), map_models(setting.map, spec)
    trust = models.trust if spec.map_trust_full > 0 else None
    particles = ScanMatchingParticleFilter(spec, motion, models.sensor, models.free_space, setting.rng, trust)
    search = (models.search, models.trust) if spec.relocalization == "scan_matching" else None
    residuals = models.residuals if spec.covariance == "scatter" else None
    tick_rate = setting.surroundings.tick_rate
    return ScanMatchingAmclLocalizer(spec, particles, motion, setting.estimate, tick_rate, search, residuals)


def slip_ekf(spec: SlipEkf, setting: Setting) -> Localizer:
    """Return an extended Kalman filter of odometry and gyroscope that detects wheel slip."""
    from simscen.advanced.localizers.slip_ekf import SlipEkfLocalizer

    return SlipEkfLocalizer(spec, setting.estimate, setting.surroundings.tick_rate)


@dataclass(frozen=True, eq=False)
class MapModels:
    """Models that scan-matching AMCL computes from a map before a run. All runs on the map share them.

    sensor:      likelihood of a scan at a pose
    free_space:  free cells, from which random poses are drawn
    trust:       weight of a scan, from its agreement with the map
    residuals:   agreement of scans with the map, for the covariance
    search:      correlative search of the whole map for the pose of a lost robot
    """

    sensor: SensorModel
    free_space: FreeSpace
    trust: MapTrust
    residuals: MapResiduals
    search: GlobalSearch


@cached_on_instance
def map_models(grid: OccupancyGrid, spec: ScanMatchingAmcl) -> MapModels:
    """Return the models of a map, which are cached with the map."""
    grid = replace(grid)  # the cache belongs to the original, which must not be kept alive by its own cache
    field, unmapped = obstacle_field(grid, spec.laser_likelihood_max_dist), unmapped_cells(grid).ravel()
    trust_field = field if spec.laser_likelihood_max_dist > FIT_DISTANCE_M else obstacle_field(grid, 2 * FIT_DISTANCE_M)
    if spec.laser_model_type == "likelihood_field_prob":
        sensor: SensorModel = TemperedLikelihoodField(
            field, spec.z_hit, spec.z_rand, spec.sigma_hit, beam_skipping(spec), spec.likelihood_exponent,
            unmapped if spec.beams_beyond_the_map == "say_nothing" else None,
        )  # fmt: skip
    else:
        sensor = sensor_model(spec, grid, field)
    return MapModels(
        sensor=sensor,
        free_space=FreeSpace(grid),
        trust=MapTrust(trust_field, unmapped, spec.map_trust_none, spec.map_trust_full),
        residuals=MapResiduals(trust_field, unmapped, spec.z_hit, spec.z_rand, spec.sigma_hit),
        search=GlobalSearch(grid, field),
    )


def precompute(spec: ScanMatchingAmcl, grid: OccupancyGrid) -> None:
    """Compute the models of a map in the parent process, so that all worker processes forked from it share them."""
    map_models(grid, spec).search.precompute()
