"""Tests of the faults that are found in the times of the messages of a sensor."""

import numpy as np
import pytest
import synthetic_drives as drives

from simscen.reconstruction.faults.message_stream import stream_faults, stuck_scans

TIMES = np.arange(0.0, 30.0, 0.1)
END = 30.0


def lidar_faults(times, arrivals=None):
    """Return the faults of a lidar that measures at these times; without `arrivals`, messages have no delay."""
    return list(stream_faults("lidar", times, times if arrivals is None else arrivals, END))


def test_a_regular_stream_has_no_fault():
    assert lidar_faults(TIMES) == []


def test_a_gap_is_an_outage_with_its_time():
    (fault,) = lidar_faults(TIMES[(TIMES < 9.95) | (TIMES > 13.0)])
    assert (fault.kind, fault.begin, fault.duration) == (
        "off",
        pytest.approx(9.95, abs=0.1),
        pytest.approx(3.1, abs=0.1),
    )


def test_a_stream_that_ends_early_is_off_until_the_end():
    (fault,) = lidar_faults(TIMES[TIMES < 20.0])
    assert (fault.kind, fault.duration) == ("off", None)
    assert fault.begin == pytest.approx(20.0, abs=0.1)


def test_messages_lost_at_random_are_a_dropout_with_its_probability():
    is_kept = np.random.default_rng(3).random(len(TIMES)) > 0.3
    (fault,) = [fault for fault in lidar_faults(TIMES[is_kept]) if fault.kind == "dropout"]
    assert float(str(fault.values["probability"]).split()[0]) == pytest.approx(30, abs=8)


def test_a_sensor_that_measures_irregularly_loses_nothing():
    """In a public log of a robot that is polled over Wi-Fi, 90 % of the periods are 0.156 to 0.268 s."""
    steps = np.random.default_rng(4).uniform(0.15, 0.28, 150)
    steps[60:65] = 0.3
    times = np.cumsum(steps)
    assert [fault.kind for fault in lidar_faults(times[times < END])] == []


def test_several_gaps_are_an_intermittent_sensor():
    is_kept = (TIMES % 4.0) < 3.0
    (fault,) = lidar_faults(TIMES[is_kept])
    assert fault.kind == "intermittent"
    assert float(str(fault.values["down"]).split()[0]) == pytest.approx(1.0, abs=0.15)


def test_late_messages_are_a_delay_with_latency_and_jitter():
    delays = 0.2 + 0.1 * np.random.default_rng(1).random(len(TIMES))
    (fault,) = lidar_faults(TIMES, TIMES + delays)
    assert (fault.kind, fault.begin) == ("delay", None)
    assert float(str(fault.values["latency"]).split()[0]) == pytest.approx(200, abs=15)
    assert float(str(fault.values["jitter"]).split()[0]) == pytest.approx(100, abs=20)


def test_a_lower_rate_in_a_part_of_the_drive_is_a_slow_sensor():
    slow_times = np.concatenate((TIMES[TIMES < 10], np.arange(10.0, 20.0, 0.4), TIMES[TIMES >= 20]))
    (fault,) = lidar_faults(slow_times)
    assert (fault.kind, fault.values["rate"]) == ("slow", "2.50 Hz")
    assert fault.begin == pytest.approx(10.0, abs=0.5)


def test_repeated_scans_are_a_stuck_lidar():
    measured = drives.scans()
    ranges = measured.ranges.copy()
    ranges[50:70] = ranges[49]
    (fault,) = stuck_scans(drives.with_ranges(measured, ranges), drives.DURATION_S)
    assert (fault.kind, fault.begin, fault.duration) == (
        "stuck",
        pytest.approx(4.9, abs=0.1),
        pytest.approx(2.0, abs=0.15),
    )


def test_scans_with_noise_are_never_stuck():
    assert list(stuck_scans(drives.scans(), drives.DURATION_S)) == []
