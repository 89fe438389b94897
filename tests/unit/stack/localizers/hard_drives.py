"""Drives in the room that are hard on localizers: kidnapped, and among people with the furniture moved."""

import numpy as np

from simscen.testing.synthetic_room import BEAMS, BOXES, READINGS_PER_SCAN, SCAN_PERIOD, TICK_RATE_HZ, RoomDrive, cast


def kidnapped(before: RoomDrive, after: RoomDrive) -> RoomDrive:
    """The robot is carried from the end of one drive to the start of the next; its wheels do not notice."""
    count = len(before.truth) // READINGS_PER_SCAN * READINGS_PER_SCAN
    return RoomDrive(
        np.concatenate((before.truth[:count], after.truth)),
        np.concatenate((before.steps[:count], after.steps)),
        np.concatenate((before.ranges[: count // READINGS_PER_SCAN], after.ranges)),
    )


# Furniture that was moved since the map was drawn: what is gone from BOXES, and what is new.
GONE = (6, 7, 9)
NEW = np.array([
    (1.6, -0.3, 2.4, 0.4), (3.2, -3.2, 4.2, -2.6), (0.2, 1.2, 0.8, 1.6), (3.9, 2.2, 4.4, 3.0), (1.0, -3.9, 1.5, -3.4),
    (4.6, -1.5, 4.9, -0.5),
])  # fmt: skip


def crowded(way: RoomDrive, seed: int, people: int = 8) -> RoomDrive:
    """The same drive, but with the furniture moved, among people that come and go, and on slipping wheels.

    People are 0.6 m wide and walk 0.5 to 3 m from the robot. Slipping wheels turn up to 30 % too far, for seconds.
    """
    rng, angles = np.random.default_rng((seed, 7)), -np.pi + 2 * np.pi / BEAMS * np.arange(BEAMS)
    ranges = cast(way.truth[::READINGS_PER_SCAN], angles, np.concatenate((np.delete(BOXES, GONE, axis=0), NEW)))
    bearing, distance = rng.uniform(-np.pi, np.pi, people), rng.uniform(0.6, 2.5, people)
    phase, period = rng.uniform(0, 2 * np.pi, people), rng.uniform(8, 30, people)
    for row, (seen, yaw) in enumerate(zip(ranges, way.truth[::READINGS_PER_SCAN, 2], strict=True)):
        bearing += rng.normal(0, 0.05, people)
        distance = np.clip(distance + rng.normal(0, 0.05, people), 0.5, 3)
        here = np.sin(2 * np.pi * row * SCAN_PERIOD / TICK_RATE_HZ / period + phase) > 0
        for towards, far in zip(bearing[here], distance[here], strict=True):
            off = np.abs((angles - towards + yaw + np.pi) % (2 * np.pi) - np.pi)
            np.minimum(seen, far, out=seen, where=off < np.arctan(0.3 / far))
    slip = np.ones((len(way.steps), 3))
    row = 0
    while row < len(slip):
        end = row + int(rng.integers(20, 80))
        slip[row:end, 0] += rng.choice([0, 0, 0.1, -0.1, 0.3])
        row = end
    slip[:, 2] += (slip[:, 0] - 1) / 6
    return RoomDrive(way.truth, way.steps * slip, ranges)
