"""Tests of the check that a fault has changed a reading, and that a fault returns a reading for each measurement."""

from copy import deepcopy
from dataclasses import fields, replace

import numpy as np
import pytest

from simscen.core.errors import RunError
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.sensor_data import Bump, Image, Imu, Odometry, Reading, Scan
from simscen.core.random_streams import Streams
from simscen.faults.base import FaultSetting
from simscen.faults.message_loss import Off
from simscen.model.disturbances import FaultEntry
from simscen.run.faults.command_link import CommandLink
from simscen.run.faults.injector import FaultInjector, _is_equal

TILTED = Pose3(0.1, 0.0, 0.3, 0.0, np.sin(0.1), 0.0, np.cos(0.1))
SCAN = Scan("lidar", 24, np.array([1.0, np.inf, np.nan]), -1.0, 0.5, 0.1, 8.0)
READINGS: list[Reading] = [
    SCAN,
    replace(SCAN, tilted_mount=TILTED),
    Odometry("odom", 24, Pose2(1.0, 2.0, 0.3), Twist(0.4, 0.0, 0.1)),
    Imu("imu", 24, (0.0, 0.0, 0.1), (0.0, 0.0, 9.81)),
    Bump("bumper", 24, False),
    Image("camera", 24, np.zeros((2, 3, 3), np.uint8), np.full((2, 3), np.inf, np.float32)),
]
KINDS = [f"{type(reading).__name__}{number}" for number, reading in enumerate(READINGS)]


@pytest.mark.parametrize("reading", READINGS, ids=KINDS)
def test_a_copy_is_unchanged(reading: Reading) -> None:
    assert _is_equal(reading, deepcopy(reading))


@pytest.mark.parametrize("reading", READINGS, ids=KINDS)
def test_a_change_of_any_field_is_a_change(reading: Reading) -> None:
    for field in fields(reading):
        value = getattr(reading, field.name)
        if field.name == "sensor":
            continue
        if value is None:
            other = TILTED
        elif isinstance(value, np.ndarray):
            other = value.copy()
            other.flat[0] = 7
        elif isinstance(value, bool):
            other = not value
        elif isinstance(value, tuple):
            other = type(value)(value[0] + 1.0, *value[1:]) if hasattr(value, "_fields") else (value[0] + 1, *value[1:])
        elif isinstance(value, Pose3):
            other = replace(value, x=value.x + 1.0)
        else:
            other = value + 1
        assert not _is_equal(reading, replace(reading, **{field.name: other})), field.name


def test_a_fault_that_measures_again_must_not_withhold_the_measurement(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Off, "measures_again", True)
    entry = FaultEntry.model_validate({"sensor": "lidar", "off": {}})
    setting = FaultSetting(kind="Scan")
    injector = FaultInjector([entry], Streams(1), lambda _: setting, CommandLink(12, 120), lambda event: None)
    injector.begin(0)
    with pytest.raises(RunError) as raised:
        injector.measure(SCAN)
    assert raised.value.kind == "broken-component"
