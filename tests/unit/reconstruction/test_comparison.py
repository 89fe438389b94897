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


def shifted(drive, metres):
    return replace(drive, poses=drives.signal(drive.poses.times, drive.poses.values + np.array([0.0, metres, 0.0])))


def test_equal_drives_have_no_difference():
    one = drives.drive(drives.scans())
    rows = {row.name: row.difference for row in compare_drives(one, one)}
    assert rows["distance at the same time"] == "0.00 m RMS, at most 0.00 m"
    assert rows["duration"] == "+0.00 s"
    assert rows["ranges at the same place"].startswith("100 %")


def test_a_shifted_drive_is_that_far_away():
    rows = {row.name: row.difference for row in compare_drives(drives.drive(), shifted(drives.drive(), 0.2))}
    assert rows["distance at the same time"] == "0.20 m RMS, at most 0.20 m"


def test_scans_are_compared_in_the_same_directions_and_without_what_did_not_return():
    one = drives.drive(drives.scans())
    turned = replace(
        one,
        poses=drives.signal(one.poses.times, one.poses.values + np.array([0.0, 0.0, 0.5])),
        scans=replace(one.scans, angles=one.scans.angles - 0.5),
    )
    zeros = one.scans.ranges.copy()
    zeros[:, ::3] = 0.0
    times = np.arange(0.0, 10.0, 0.1)
    assert fraction_of_equal_ranges(one, turned, times) > 0.98
    assert fraction_of_equal_ranges(replace(one, scans=replace(one.scans, ranges=zeros)), one, times) == 1.0
    assert fraction_of_equal_ranges(one, replace(one, poses=turned.poses), times) < 0.7


def test_scans_are_compared_only_where_both_robots_are_at_one_place():
    one = drives.drive(drives.scans())
    assert fraction_of_equal_ranges(one, shifted(one, 1.0), np.arange(0.0, 10.0, 0.1)) is None


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
    one = drives.drive()
    incidents, others = compare_incidents([STUCK], [])
    verified = Verification(one, one, Path("x.mcap"), [*compare_drives(one, one)], incidents, others, ["stuck"])
    thing = FoundObject("<b>cart</b>", (0.9, 0.6), ((0.0, 4.0, 1.0, 0.0),))
    page = verification_page("<script>", drives.room(), [thing], verified)
    assert "<script>" not in page and "<b>cart" not in page
    assert "http" not in page.replace("http-equiv", "")
    assert "default-src 'none'" in page
    assert page.count("<figure>") == 3  # two maps, and the distance; without scans, no clearance
    assert "The run does not repeat the incident of the log." in page
    assert "not reproduced: stuck" in page


@pytest.mark.parametrize("steps", [0.0, 0.3])
def test_a_drive_is_compared_with_a_shorter_one(steps):
    one = drives.drive()
    kept = one.poses.times < 5.0 + steps
    short = replace(one, duration=5.0 + steps, poses=drives.signal(one.poses.times[kept], one.poses.values[kept]))
    rows = {row.name: row.difference for row in compare_drives(one, short)}
    assert rows["distance at the same time"].startswith("0.00 m")


def test_the_page_shows_the_clearance_and_what_is_not_on_the_map():
    measured = drives.scans(lambda time: [drives.body(4.5, 1.0, 0.0, (0.8, 0.4))])
    one = drives.drive(measured)
    verified = Verification(one, drives.drive(drives.scans()), Path("x.mcap"), [], [], [], [])
    page = verification_page("drive", drives.room(), [], verified)
    pictures = page.split("data:image/png;base64,")[1:]
    assert len(pictures) == 2 and pictures[0].partition('"')[0] != pictures[1].partition('"')[0]
    assert page.count("<figure>") == 4
    assert "no incident" in page


def test_a_run_without_a_result_does_not_meet_all_criteria(tmp_path):
    log = logs.write_mcap(tmp_path / "run.mcap", logs.drive(2.0))
    with pytest.raises(InvalidInput, match="it has no result"):
        compare_with_run(SimpleNamespace(drive=drives.drive()), log)
