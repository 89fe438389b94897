"""Drives in the synthetic room that are difficult for localizers: kidnapping, people, moved furniture, and slip."""

import numpy as np

from simscen.testing.synthetic_room import (
    BEAMS,
    BOXES,
    READINGS_PER_SCAN,
    SCAN_PERIOD_TICKS,
    TICK_RATE_HZ,
    RoomDrive,
    cast,
)


def kidnapped(before: RoomDrive, after: RoomDrive) -> RoomDrive:
    """Return a drive in which the robot is moved from the end of `before` to the start of `after`, without odometry."""
    count = len(before.truth) // READINGS_PER_SCAN * READINGS_PER_SCAN
    return RoomDrive(
        np.concatenate((before.truth[:count], after.truth)),
        np.concatenate((before.steps[:count], after.steps)),
        np.concatenate((before.ranges[: count // READINGS_PER_SCAN], after.ranges)),
    )


REMOVED_BOXES = (6, 7, 9)
"""Indices in BOXES of the furniture that is on the map, but not in the room."""
ADDED_BOXES = np.array([
    (1.6, -0.3, 2.4, 0.4), (3.2, -3.2, 4.2, -2.6), (0.2, 1.2, 0.8, 1.6), (3.9, 2.2, 4.4, 3.0), (1.0, -3.9, 1.5, -3.4),
    (4.6, -1.5, 4.9, -0.5),
])  # fmt: skip
"""min x, min y, max x, max y in m of the furniture that is in the room, but not on the map."""


def with_people_and_slip(path: RoomDrive, seed: int, people: int = 8) -> RoomDrive:
    """Return the same drive with moved furniture, people that come and go, and slipping wheels.

    People are 0.6 m wide and walk 0.5 to 3 m from the robot. Slipping wheels turn up to 30 % too far for some seconds.
    """
    rng, angles = np.random.default_rng((seed, 7)), -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS)
    ranges = cast(
        path.truth[::READINGS_PER_SCAN], angles, np.concatenate((np.delete(BOXES, REMOVED_BOXES, axis=0), ADDED_BOXES))
    )
    bearing, distance = rng.uniform(-np.pi, np.pi, people), rng.uniform(0.6, 2.5, people)
    phase, period = rng.uniform(0, 2 * np.pi, people), rng.uniform(8, 30, people)
    for row, (scan, yaw) in enumerate(zip(ranges, path.truth[::READINGS_PER_SCAN, 2], strict=True)):
        bearing += rng.normal(0, 0.05, people)
        distance = np.clip(distance + rng.normal(0, 0.05, people), 0.5, 3)
        is_near = np.sin(2 * np.pi * row * SCAN_PERIOD_TICKS / TICK_RATE_HZ / period + phase) > 0
        for direction, range_m in zip(bearing[is_near], distance[is_near], strict=True):
            angle = np.abs((angles - direction + yaw + np.pi) % (2 * np.pi) - np.pi)
            np.minimum(scan, range_m, out=scan, where=angle < np.arctan(0.3 / range_m))
    slip = np.ones((len(path.steps), 3))
    row = 0
    while row < len(slip):
        end = row + int(rng.integers(20, 80))
        slip[row:end, 0] += rng.choice([0, 0, 0.1, -0.1, 0.3])
        row = end
    slip[:, 2] += (slip[:, 0] - 1) / 6
    return RoomDrive(path.truth, path.steps * slip, ranges)
