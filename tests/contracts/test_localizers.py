"""Contract tests of all localizers."""

import numpy as np
import pytest

from simscen.advanced.spec import ScanMatchingAmcl, SlipEkf
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Odometry
from simscen.model.localizers import Amcl, Ekf, GroundTruth, LocalizerSpec, OdometryOnly
from simscen.testing import Promise, promises_of
from simscen.testing.contracts.localizer import short_drive, start_estimate
from simscen.testing.synthetic_room import RoomDrive, build_localizer, run_localizer

SPECS: dict[str, LocalizerSpec] = {
    "amcl": Amcl(),
    "scan_matching_amcl": ScanMatchingAmcl(),
    "scan_matching_amcl consistent": ScanMatchingAmcl(parameters="consistent"),
    "amcl omni": Amcl(robot_model="omni", update_min_d=0.0, update_min_a=0.0),
    "amcl prob": Amcl(laser_model_type="likelihood_field_prob", do_beamskip=True, selective_resampling=True),
    "amcl beam": Amcl(laser_model_type="beam", min_particles=100, max_particles=300, resample_interval=2),
    "amcl recovering": Amcl(recovery_alpha_slow=0.001, recovery_alpha_fast=0.1),
    "amcl narrow": Amcl(laser_model_type="likelihood_field_prob", z_rand=0.0, sigma_hit=0.001, max_beams=2000),
    "ekf": Ekf(type="ekf"),
    "slip_ekf": SlipEkf(type="slip_ekf"),
    "slip_ekf with laser odometry": SlipEkf(type="slip_ekf", match_scans=True),
    "ekf noiseless": Ekf(type="ekf", translation_noise=0.0, rotation_noise=0.0, gyro_noise=0.0),
    "ground_truth": GroundTruth(type="ground_truth"),
    "odometry": OdometryOnly(type="odometry"),
}


@pytest.mark.sample(30)
@pytest.mark.parametrize("promise", [p for name, spec in SPECS.items() for p in promises_of(spec, name)], ids=str)
def test_component_meets_its_contract(promise: Promise) -> None:
    promise.check()


@pytest.mark.parametrize("spec", SPECS.values(), ids=SPECS)
def test_belief_after_reset_equals_the_estimate(spec: LocalizerSpec) -> None:
    """This is stricter than the contract, which allows the deviation of random particles."""
    localizer = build_localizer(spec, Estimate(Pose2(3, 3, 3)), 1)
    run_localizer(
        localizer, RoomDrive(short_drive().truth[:80], short_drive().steps[:80], short_drive().ranges[:20]), 1, imu=True
    )
    localizer.reset(start_estimate())
    assert localizer.belief.pose == start_estimate().pose
    assert np.allclose(localizer.belief.covariance, np.diag(np.square(start_estimate().std)))
    localizer.on_odometry(Odometry("odom", 0, Pose2(-8, 4, 2), Twist()))
    assert localizer.belief.pose == pytest.approx(start_estimate().pose)
