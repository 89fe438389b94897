"""Tests of the comparison of a recorded drive with the run of its reconstructed scenario, and of its page."""

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import synthetic_drives as drives

sys.path.insert(0, str(Path(__file__).parents[1] / "record"))
import foreign_logs as logs

from simscen.core.errors import InvalidInput
from simscen.reconstruction.objects.found_object import FoundObject
from simscen.reconstruction.scenario.incidents import Incident
from simscen.reconstruction.verification.comparison import (
    Verification,
    compare_drives,
    compare_incidents,
    compare_with_run,
    fraction_of_equal_ranges,
)
from simscen.reconstruction.verification.page import verification_page

STUCK = Incident("stuck", 10.0, (3.0, 2.0), "the robot stayed", "stuck")


def shifted(drive, meters):
    """Return the drive with poses that are shifted along the y axis."""
    return replace(drive, poses=drives.signal(drive.poses.times, drive.poses.values + np.array([0.0, meters, 0.0])))


def test_equal_drives_have_no_difference():
    recorded = drives.drive(drives.scans())
    rows = {row.name: row.difference for row in compare_drives(recorded, recorded)}
    assert rows["distance at the same time"] == "0.00 m RMS, at most 0.00 m"
    assert rows["duration"] == "+0.00 s"
    assert rows["ranges at the same place"].startswith("100 %")


def test_distance_to_a_shifted_drive_is_the_shift():
    rows = {row.name: row.difference for row in compare_drives(drives.drive(), shifted(drives.drive(), 0.2))}
    assert rows["distance at the same time"] == "0.20 m RMS, at most 0.20 m"


def test_scans_are_compared_in_the_same_directions_and_without_beams_that_did_not_return():
    recorded = drives.drive(drives.scans())
    turned = replace(
        recorded,
        poses=drives.signal(recorded.poses.times, recorded.poses.values + np.array([0.0, 0.0, 0.5])),
        scans=replace(recorded.scans, angles=recorded.scans.angles - 0.5),
    )
    zeros = recorded.scans.ranges.copy()
    zeros[:, ::3] = 0.0
    times = np.arange(0.0, 10.0, 0.1)
    assert fraction_of_equal_ranges(recorded, turned, times) > 0.98
    assert (
        fraction_of_equal_ranges(replace(recorded, scans=replace(recorded.scans, ranges=zeros)), recorded, times) == 1.0
    )
    assert fraction_of_equal_ranges(recorded, replace(recorded, poses=turned.poses), times) < 0.7


def test_scans_are_compared_only_where_both_robots_are_at_one_place():
    recorded = drives.drive(drives.scans())
    assert fraction_of_equal_ranges(recorded, shifted(recorded, 1.0), np.arange(0.0, 10.0, 0.1)) is None


def test_the_same_incident_nearby_is_reproduced():
    ((found,), others) = compare_incidents([STUCK], [replace(STUCK, time=11.0, position=(3.2, 2.0))])
    assert found.is_reproduced and not others
    assert found.sentence == "reproduced: stuck at 10.00 s (the robot stayed), 1.00 s later and 0.20 m away"


def test_an_incident_far_away_is_only_similar():
    ((found,), _) = compare_incidents([STUCK], [replace(STUCK, position=(6.0, 2.0))])
    assert not found.is_reproduced
    assert found.sentence.startswith("only similar")


def test_another_kind_of_incident_does_not_count():
    contact = replace(STUCK, kind="contact")
    ((found,), others) = compare_incidents([STUCK], [contact])
    assert found.sentence == "not reproduced: stuck at 10.00 s (the robot stayed)"
    assert others == [contact]


def test_the_page_loads_nothing_and_escapes_names():
    recorded = drives.drive()
    incidents, others = compare_incidents([STUCK], [])
    verified = Verification(
        recorded, recorded, Path("x.mcap"), [*compare_drives(recorded, recorded)], incidents, others, ["stuck"]
    )
    cart = FoundObject("<b>cart</b>", (0.9, 0.6), ((0.0, 4.0, 1.0, 0.0),))
    page = verification_page("<script>", drives.room(), [cart], verified)
    assert "<script>" not in page and "<b>cart" not in page
    assert "http" not in page.replace("http-equiv", "")
    assert "default-src 'none'" in page
    assert page.count("<figure>") == 3  # two maps, and the distance; without scans, no clearance
    assert "The run does not repeat the incident of the log." in page
    assert "not reproduced: stuck" in page


@pytest.mark.parametrize("steps", [0.0, 0.3])
def test_a_drive_is_compared_with_a_shorter_one(steps):
    recorded = drives.drive()
    is_kept = recorded.poses.times < 5.0 + steps
    shorter = replace(
        recorded,
        duration=5.0 + steps,
        poses=drives.signal(recorded.poses.times[is_kept], recorded.poses.values[is_kept]),
    )
    rows = {row.name: row.difference for row in compare_drives(recorded, shorter)}
    assert rows["distance at the same time"].startswith("0.00 m")


def test_the_page_shows_the_clearance_and_objects_that_are_not_on_the_map():
    measured = drives.scans(lambda time: [drives.body(4.5, 1.0, 0.0, (0.8, 0.4))])
    recorded = drives.drive(measured)
    verified = Verification(recorded, drives.drive(drives.scans()), Path("x.mcap"), [], [], [], [])
    page = verification_page("drive", drives.room(), [], verified)
    pictures = page.split("data:image/png;base64,")[1:]
    assert len(pictures) == 2 and pictures[0].partition('"')[0] != pictures[1].partition('"')[0]
    assert page.count("<figure>") == 4
    assert "no incident" in page


def test_a_run_without_a_result_does_not_meet_all_criteria(tmp_path):
    log = logs.write_mcap(tmp_path / "run.mcap", logs.drive(2.0))
    with pytest.raises(InvalidInput, match="it has no result"):
        compare_with_run(SimpleNamespace(drive=drives.drive()), log)
