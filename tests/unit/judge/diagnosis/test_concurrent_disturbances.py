"""Tests of the report of disturbances at the time of a failure."""

import pytest
from diagnosis_cases import slip, why, with_event


@pytest.mark.parametrize(
    ("events", "texts"),
    [
        (slip(2, 2, name="lidar.off", kind="off"), ["lidar.off was active since t = 2.00 s, for 8.00 s"]),
        (slip(0, 0, name="lidar.off", kind="off"), ["lidar.off was active since the start, for 10.00 s"]),
        (slip(2, 2, 8, "lidar.off", "off"), ["lidar.off had ended 2.00 s before, after 6.00 s"]),
        (slip(2, 2, 6.5, "lidar.off", "off"), []),
        ([[2, "fault.started", "lidar.off", {"entry": 0}]], []),
        (slip(2, 2, 7, "lidar.off", "off"), ["lidar.off had ended 3.00 s before, after 5.00 s"]),
        (slip(5, 5, 10, "lidar.off", "off"), ["lidar.off had ended 0.00 s before, after 5.00 s"]),
        (slip(5, 10, 10, "lidar.off", "off"), ["lidar.off had ended 0.00 s before, after 5.00 s"]),
        (slip(10, 10, None, "lidar.off", "off"), ["lidar.off was active since t = 10.00 s, for 0.00 s"]),
        (
            [*slip(2, 2, 5, "lidar.off", "off"), *slip(5, 5, 8, "lidar.off", "off")],
            ["lidar.off had ended 2.00 s before, after 3.00 s"],
        ),
        (
            [*slip(5, 5, 8, "lidar.off", "off"), [8.5, "fault.started", "lidar.off", {"entry": 0}]],
            ["lidar.off had ended 2.00 s before, after 3.00 s"],
        ),
        (
            [
                [4, "fault.started", "lidar.off", {"entry": 0}],
                [7.5, "fault.ended", "lidar.off", {"entry": 0}],
                *slip(8, 8, 9, "lidar.off", "off"),
            ],
            ["lidar.off had ended 1.00 s before, after 1.00 s"],
        ),
        (
            [[2, "fault.started", "imu.off", {"entry": 1}], *slip(2, 2, name="lidar.off", kind="off")],
            ["lidar.off was active since t = 2.00 s, for 8.00 s"],
        ),
        (with_event("gust", 5), ["event `gust` happened 5.00 s before: something"]),
        (with_event("gust", 10), ["event `gust` happened 0.00 s before: something"]),
        ([[8, "event.ended", "gust", {"effects": [{"happened": False, "what": "nothing"}]}]], []),
        (with_event("gust", 6), ["event `gust` happened 4.00 s before: something"]),
        (with_event("gust", 4), []),
    ],
)
def test_active_and_recent_disturbances_are_reported_for_any_criterion(events, texts):
    assert why("speed", events, case={}) == [f"meanwhile: {text}" for text in texts]
