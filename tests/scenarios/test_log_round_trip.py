"""Tests that scenarios reconstructed from only their logs agree with the shipped scenarios.

`python tests/campaign/log_round_trip.py` prints the same comparison for all shipped scenarios.
"""

import sys
from pathlib import Path

import pytest

from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

sys.path.insert(0, str(Path(__file__).parents[1] / "campaign"))
from log_round_trip import ROOT, compare

NAMES = (
    *("corner_cases/cart_crossing", "corner_cases/narrow_doorway", "corner_cases/person_stops_in_front"),
    *("faults/dust", "faults/garbage_scans", "faults/glass_wall", "faults/imu_drift", "faults/late_commands"),
    *("faults/lidar_delay", "faults/lidar_knocked", "faults/lidar_noise", "faults/lidar_off", "faults/lidar_sector"),
    *("faults/localizer_jump", "faults/localizer_silent", "faults/loose_contact", "faults/lost_commands"),
    *("faults/odometry_scale", "faults/rain", "faults/weak_motor", "faults/wheel_slip"),
    *("ground/low_battery", "localization/slipping_wheels", "navigation/goal", "navigation/patrol"),
    *("obstacles/cart_crossing", "obstacles/pallet_on_plan", "obstacles/walking_pillars"),
    *("people/group_in_the_way", "people/head_on_in_a_corridor", "people/someone_stops_in_front"),
)
CASES = [pytest.param(name, marks=[pytest.mark.slow] if number % 10 else []) for number, name in enumerate(NAMES)]


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", CASES)
def test_scenario_reconstructed_from_its_log_agrees(name, tmp_path):
    log = tmp_path / "run.mcap"
    simulate(prepare(load_scenario(ROOT / "scenarios" / f"{name}.scenario.yaml", ROOT)), log=log)
    row = compare(log, tmp_path / "again.scenario.yaml")
    assert row.problem == ""
    assert row.poses_agree
    assert row.objects_agree, row.objects
    assert not row.missing and not row.extra
