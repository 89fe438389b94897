"""The map that a robot has of a building: what an earlier drive saw, as SLAM would have drawn it."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from simscen.bench.localization.buildings import Building, building, lived_in, mesh_of
from simscen.bench.localization.generated_drive import (
    CLEAN,
    STEP,
    ShutIn,
    Sight,
    Wheels,
    angles_of,
    drive,
    hidden_by,
    measured,
    people_in,
    reckoned,
    tour,
)
from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.random_streams import Streams
from simscen.model.robot import Lidar, WheelOdometry
from simscen.record.localization_logs.read import LocalizationLog
from simscen.record.localization_logs.rows import TICK_RATE_HZ

CELL = 0.05
MARGIN = 1.0
"""m around what was seen."""
REACH = 12.0
"""m: ranges beyond this are not drawn."""
SOLID = 0.25
"""Share of the beams through a cell that end there, from which on it is occupied."""


def drawn(poses: Array, angles: Array, ranges: Array, size: tuple[float, float]) -> OccupancyGrid:
    """A map of scans (n, b) taken at `poses` (n, 3): cells that beams ended in, or passed; all others are unknown."""
    width, height = (int(np.ceil((edge + 2 * MARGIN) / CELL)) for edge in size)
    heading = poses[:, 2:] + angles
    c, s = np.cos(heading), np.sin(heading)
    far = np.minimum(ranges, REACH)

    def counted(along: Array, chosen: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
        x = ((poses[:, :1] + c * along)[chosen] + MARGIN) / CELL
        y = ((poses[:, 1:2] + s * along)[chosen] + MARGIN) / CELL
        column, row = np.clip(x.astype(np.int64), 0, width - 1), np.clip(y.astype(np.int64), 0, height - 1)
        return np.bincount(row * width + column, minlength=height * width).astype(np.int64)

    ended = counted(far, np.isfinite(ranges) & (ranges < REACH))
    passed = np.zeros_like(ended)
    for step in np.arange(0.0, REACH, 2 * CELL):  # neighboring beams pass the cells between
        along = np.full_like(far, step)
        if (chosen := far - step > CELL).any():
            passed += counted(along, chosen)
    cells = np.full(height * width, UNKNOWN, dtype=np.int8)
    cells[passed > 0] = FREE
    cells[(ended > 0) & (ended >= SOLID * (ended + passed))] = OCCUPIED
    return OccupancyGrid(cells.reshape(height, width), CELL, Pose2(-MARGIN, -MARGIN, 0.0))


def first_half(grid: OccupancyGrid, middle: float) -> OccupancyGrid:
    """The same map, of which nothing is known right of x = `middle`."""
    cells = grid.cells.copy()
    cells[:, int((middle - grid.origin.x) / grid.resolution) :] = UNKNOWN
    return OccupancyGrid(cells, grid.resolution, grid.origin)


LIDARS = ((181, 5.0), (361, 5.0), (181, 10.0), (361, 10.0))
"""Beams over 180° and scans a second: what logs with a SICK LMS have."""
MOUNT = Pose2(0.1, 0.0, 0.0)
PEOPLE = 8
"""On a floor."""
SECONDS, KIDNAPPED_AT = 90.0, 30.0
MAPPED_WITHIN = (0.02, 0.02, 0.004)
"""Standard deviations (m, m, rad) of the poses that the map was drawn at."""
CIRCUMSTANCES = {
    "tracked": "the start is told",
    "clean": "the start is told; wheels with random errors only, nobody walks, everything is where the map shows it",
    "slipping": "the same, but for wheels as raw as in all others",
    "unknown": "the start is not told",
    "outdated": "the start is told; right of the middle the floor was rebuilt since the map was made",
    "half": "the start is told; of the half right of the middle there is no map",
    "kidnapped": "the start is told; after 30 s the robot is carried elsewhere",
}
ALONE = ("clean", "slipping")
"""Where nobody walks and everything is where the map shows it."""


@dataclass(frozen=True, eq=False)
class Log:
    """A recorded drive: what `sensed` says, the robot's `map` and what it is told at the start."""

    building: int
    number: int
    circumstance: str
    sensed: LocalizationLog
    map: OccupancyGrid
    estimate: Estimate


def log(number: int, which: int, circumstance: str, seconds: float = SECONDS) -> Log:
    """Drive `which` through the building of a number under one of CIRCUMSTANCES: always the same."""
    rng = Streams(number).generator(f"{circumstance} {which}")
    beams, rate = LIDARS[which % len(LIDARS)]
    lidar = Lidar(
        rate=rate, beams=beams, field_of_view=np.pi, min_range=0.0, max_range=80.0, noise=0.01, resolution=0.01
    )
    floor = building(number, int(circumstance == "outdated"))
    alone = circumstance in ALONE
    truth, furniture = _driven(floor, circumstance, seconds, rng)
    odometry = reckoned(truth, STEP, CLEAN if circumstance == "clean" else Wheels(), WheelOdometry(), rng)
    if circumstance == "kidnapped":
        other, _ = _driven(floor, circumstance, seconds, rng, furniture)
        row = int(KIDNAPPED_AT / STEP)
        carried = reckoned(other, STEP, Wheels(), WheelOdometry(), rng)
        there = Pose2(*odometry[row])
        odometry = np.vstack(
            (odometry[:row], [there.compose(Pose2(*pose)) for pose in carried[: len(truth) - row].tolist()])
        )
        truth = np.vstack((truth[:row], other[: len(truth) - row]))
    each = round(1 / rate / STEP)
    poses = truth[::each]
    seen_from = np.array([Pose2(*pose).compose(MOUNT) for pose in poses.tolist()])
    angles = angles_of(lidar)
    sight = Sight.of(mesh_of(floor.walls, furniture), mesh_of(floor.walls, floor.glass, furniture))
    ranges = sight.distances(seen_from, angles, lidar.max_range, rng)
    if not alone:
        ranges = hidden_by(people_in(floor, len(poses), each * STEP, PEOPLE, rng), seen_from, angles, ranges)
    ranges = measured(ranges, lidar, rng)
    readings = _readings(odometry, ranges, each, lidar)
    ticks = np.round(np.arange(len(truth)) * STEP * TICK_RATE_HZ).astype(np.int64)
    whole = mapped(number)
    return Log(
        number, which, circumstance, LocalizationLog(readings, ticks, truth),
        first_half(whole, floor.middle) if circumstance == "half" else whole,
        Estimate(None if circumstance == "unknown" else Pose2(*truth[0].tolist())),
    )  # fmt: skip


def _driven(
    floor: Building, circumstance: str, seconds: float, rng: np.random.Generator, furniture: Array | None = None
) -> tuple[Array, Array]:
    """The truth (k, 3) and the furniture (n, 4); drawn anew where furniture shuts the robot in."""
    while True:
        stands = furniture
        if stands is None:
            stands = floor.furniture if circumstance in ALONE else lived_in(floor, rng)
        try:
            return drive(floor, stands, seconds, rng, circumstance in ("outdated", "half")), stands
        except ShutIn:
            continue


@lru_cache(maxsize=2)
def mapped(number: int) -> OccupancyGrid:
    """The map of a building, drawn from an earlier drive through all its rooms that nobody was in."""
    floor, rng = building(number), Streams(number).generator("map")
    poses = tour(floor)
    angles = np.linspace(-np.pi, np.pi, 480, endpoint=False)
    sight = Sight.of(mesh_of(floor.walls, floor.furniture), mesh_of(floor.walls, floor.glass, floor.furniture))
    ranges = sight.distances(poses, angles, 80.0, rng)
    return drawn(poses + rng.normal(0, MAPPED_WITHIN, poses.shape), angles, ranges, floor.size)


def _readings(odometry: Array, ranges: Array, each: int, lidar: Lidar) -> list[Odometry | Scan]:
    readings: list[Odometry | Scan] = []
    increment = lidar.field_of_view / (lidar.beams - 1)
    for row, pose in enumerate(odometry.tolist()):
        tick = round(row * STEP * TICK_RATE_HZ)
        readings.append(Odometry("odom", tick, Pose2(*pose), Twist()))
        if row % each == 0:
            readings.append(
                Scan("lidar", tick, ranges[row // each], -lidar.field_of_view / 2, increment, lidar.min_range,
                     lidar.max_range, MOUNT)
            )  # fmt: skip
    return readings
