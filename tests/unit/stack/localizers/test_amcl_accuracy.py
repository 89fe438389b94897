"""Tests of the accuracy of AMCL on a few seeds. measure_localizers.py measures the accuracy on fifty seeds."""

import measure_localizers as measure
import numpy as np
import pytest
from estimate_drives import case
from measure_recovery import drives, position_errors

from simscen.model.localizers import Amcl

SEEDS = range(101, 105)
SEEDS_AMONG_PEOPLE = (5, 7)


@pytest.mark.parametrize("spec", [measure.SUM, measure.PROB, measure.BEAM], ids=lambda spec: spec.laser_model_type)
def test_drive_around_the_room_is_tracked_within_5_cm(spec: Amcl) -> None:
    seconds = 15.0 if spec is measure.BEAM else 30.0
    assert measure.tracking(spec, SEEDS[:2], seconds).rmse.max() <= 0.05


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("world", "circumstance", "seed"),
    [("warehouse", "short", 3), ("office", "crowded", 1), ("house coarse", "crowded", 3)],
)
def test_estimate_with_known_start_does_not_jump_to_the_best_particle(world: str, circumstance: str, seed: int) -> None:
    """With the mean of the particles near the best one, the errors were 1.45, 1.51, and 2.32 m for a short time."""
    errors = position_errors(case(world, circumstance, "likelihood_field", seed))
    assert errors.max() < 0.6
    assert np.sqrt(np.mean(errors**2)) < 0.2


def test_initial_error_of_half_a_meter_and_20_degrees_is_corrected(is_quick: bool) -> None:
    seeds = SEEDS[:2] if is_quick else SEEDS
    assert measure.wrong_start(measure.SUM, seeds).found.all()
    assert measure.wrong_start(measure.PROB, seeds).found.all()


@pytest.mark.slow
def test_robot_without_initial_pose_localizes() -> None:
    assert measure.global_start(measure.MANY, SEEDS[:3]).found.all()


def test_recovery_does_not_disturb_a_localized_robot(is_quick: bool) -> None:
    assert measure.tracking(measure.RECOVERING, SEEDS[:1], 30.0 if is_quick else 60.0).rmse.max() <= 0.05


@pytest.mark.slow
def test_recovery_keeps_good_particles_despite_people_furniture_and_slip() -> None:
    """No pose explains the scans well, but the robot is not lost. Averages of likelihoods led to errors of 6 m."""
    assert measure.errors_among_people(measure.RECOVERING_PROB, SEEDS_AMONG_PEOPLE, 40.0).max() <= 0.6
    assert measure.errors_among_people(measure.RECOVERING, SEEDS_AMONG_PEOPLE, 40.0).max() <= 1.5


@pytest.mark.slow
@pytest.mark.parametrize("world", ["clutter", "pillars"])
def test_random_particles_of_recovery_do_not_disperse_good_particles(world: str) -> None:
    """The share of random particles is limited, per scan and in total.

    Without a limit, the errors were 5 m in `clutter` and 16 m in `pillars`. With a limit of 5 % per scan alone, 80 % of
    the particles were random after ten seconds, and the error in `clutter` was 2.3 m.
    """
    (drive,) = drives("crowded", "likelihood_field", [12], [world])
    assert position_errors(drive).max() < 1.0


def test_kidnapped_robot_is_relocalized_only_with_recovery(is_quick: bool) -> None:
    assert measure.kidnapping(measure.RECOVERING, SEEDS[: 1 if is_quick else 2]).found.all()
    assert not measure.kidnapping(measure.PROB, SEEDS[:1]).found.any()


def test_tuned_filter_is_nearly_consistent() -> None:
    """A consistent filter has an ANEES of 3. The errors of the map's cells are equal in all runs, so 3 is not exact."""
    assert 1.0 < measure.tracking(measure.TUNED, SEEDS, 60.0).anees.mean() < 5.0


def test_covariance_with_defaults_of_nav2_is_never_too_small() -> None:
    """The defaults assume wheels and a lidar that are ten times as noisy as those of simscen."""
    for spec in (measure.SUM, measure.PROB):
        assert measure.tracking(spec, SEEDS, 20.0).anees.max() < 3
