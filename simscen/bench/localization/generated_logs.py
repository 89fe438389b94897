"""Generator of logs for the localization benchmark: sensor readings and true poses of a drive, and a map."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from simscen.bench.localization.buildings import Building, generate_building, rearranged_furniture
from simscen.bench.localization.generated_drive import (
    RANDOM_ERRORS_ONLY,
    STEP_S,
    EnclosedStart,
    OdometryErrors,
    PartlyTransparentScene,
    add_lidar_noise,
    beam_angles,
    drive_between_rooms,
    mapping_tour,
    occlude_by_people,
    simulate_odometry,
    simulate_people,
)
from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.random_streams import Streams
from simscen.model.sensors import Lidar
from simscen.record.localization_logs.read import LocalizationLog
from simscen.record.localization_logs.rows import TICK_RATE_HZ

CELL_M = 0.05
"""Cell size of the map."""
MAP_MARGIN_M = 1.0
"""Width of the margin of the map around the floor."""
MAP_RANGE_M = 12.0
"""Maximum range of the beams that draw the map. A longer beam draws only free space, up to this range."""
OCCUPIED_FRACTION = 0.25
"""A cell becomes occupied if at least this fraction of the beams that reach it end in it."""


def draw_map(poses: Array, angles: Array, ranges: Array, size: tuple[float, float]) -> OccupancyGrid:
    """Draw a map, as SLAM does, from scans with `ranges` (n, b) in m and beam `angles` (b,) in rad.

    `poses` (n, 3) are lidar poses. `size` is the length and depth of the floor in m. Cells that no beam reaches are
    unknown.
    """
    width, height = (int(np.ceil((edge + 2 * MAP_MARGIN_M) / CELL_M)) for edge in size)
    heading = poses[:, 2:] + angles
    c, s = np.cos(heading), np.sin(heading)
    clipped = np.minimum(ranges, MAP_RANGE_M)

    def count_per_cell(along: Array, selected: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
        x = ((poses[:, :1] + c * along)[selected] + MAP_MARGIN_M) / CELL_M
        y = ((poses[:, 1:2] + s * along)[selected] + MAP_MARGIN_M) / CELL_M
        column, row = np.clip(x.astype(np.int64), 0, width - 1), np.clip(y.astype(np.int64), 0, height - 1)
        return np.bincount(row * width + column, minlength=height * width).astype(np.int64)

    ended = count_per_cell(clipped, np.isfinite(ranges) & (ranges < MAP_RANGE_M))
    passed = np.zeros_like(ended)
    for step in np.arange(0.0, MAP_RANGE_M, 2 * CELL_M):  # neighboring beams pass the cells between
        if (selected := clipped - step > CELL_M).any():
            passed += count_per_cell(np.full_like(clipped, step), selected)
    cells = np.full(height * width, UNKNOWN, dtype=np.int8)
    cells[passed > 0] = FREE
    cells[(ended > 0) & (ended >= OCCUPIED_FRACTION * (ended + passed))] = OCCUPIED
    return OccupancyGrid(cells.reshape(height, width), CELL_M, Pose2(-MAP_MARGIN_M, -MAP_MARGIN_M, 0.0))


def left_half(grid: OccupancyGrid, middle: float) -> OccupancyGrid:
    """Return the map with unknown cells to the right of x = `middle` in m."""
    cells = grid.cells.copy()
    cells[:, int((middle - grid.origin.x) / grid.resolution) :] = UNKNOWN
    return OccupancyGrid(cells, grid.resolution, grid.origin)


LIDARS = ((181, 5.0), (361, 5.0), (181, 10.0), (361, 10.0))
"""Lidars that the drives use in turn: number of beams over 180°, and scans per second.

The values are those of the SICK LMS in public logs.
"""
LIDAR_MOUNT = Pose2(0.1, 0.0, 0.0)
"""Pose of the lidar in the base frame."""
PEOPLE_COUNT = 8
"""Number of people on a floor."""
LOG_DURATION_S, KIDNAPPING_TIME_S = 90.0, 30.0
MAPPING_POSE_STD = (0.02, 0.02, 0.004)
"""Standard deviations (x in m, y in m, yaw in rad) of the pose errors with which the map is drawn."""
CIRCUMSTANCES = {
    "tracked": "known start",
    "clean": "known start, odometry with random errors only, no people, furniture as on the map",
    "slipping": "as `clean`, but with systematic odometry errors and slipping wheels",
    "unknown": "unknown start",
    "outdated": "known start; the right half of the floor was rebuilt after the map was made",
    "half": "known start; the map ends at the middle of the floor",
    "kidnapped": "known start; after 30 s the robot is placed elsewhere",
}
"""Circumstances in which logs are generated: name and description."""
UNCHANGED_CIRCUMSTANCES = ("clean", "slipping")
"""Circumstances without people and with the furniture of the map."""


@dataclass(frozen=True, eq=False)
class Log:
    """Generated log of a drive, with the map and the initial pose estimate for a localizer.

    building:     number of the building
    number:       number of the drive in the building
    circumstance: a key of CIRCUMSTANCES
    recording:    sensor readings and true poses
    map:          map for the localizer
    estimate:     initial pose estimate for the localizer
    """

    building: int
    number: int
    circumstance: str
    recording: LocalizationLog
    map: OccupancyGrid
    estimate: Estimate


def generate_log(building: int, number: int, circumstance: str, seconds: float = LOG_DURATION_S) -> Log:
    """Generate the log of a drive in a building. The result depends on the arguments only.

    `circumstance` is a key of CIRCUMSTANCES.
    """
    rng = Streams(building).generator(f"{circumstance} {number}")
    beams, rate = LIDARS[number % len(LIDARS)]
    lidar = Lidar(
        rate=rate, beams=beams, field_of_view=np.pi, min_range=0.0, max_range=80.0, noise=0.01, resolution=0.01
    )
    floor = generate_building(building, int(circumstance == "outdated"))
    truth, furniture = _drive_in_furniture(floor, circumstance, seconds, rng)
    errors = RANDOM_ERRORS_ONLY if circumstance == "clean" else OdometryErrors()
    odometry = simulate_odometry(truth, errors, rng)
    if circumstance == "kidnapped":
        after, _ = _drive_in_furniture(floor, circumstance, seconds, rng, furniture)
        row = int(KIDNAPPING_TIME_S / STEP_S)
        odometry_after = simulate_odometry(after, OdometryErrors(), rng)
        last = Pose2(*odometry[row])
        continued = [last.compose(Pose2(*pose)) for pose in odometry_after[: len(truth) - row].tolist()]
        odometry = np.vstack((odometry[:row], continued))
        truth = np.vstack((truth[:row], after[: len(truth) - row]))
    poses_per_scan = round(1 / rate / STEP_S)
    poses = truth[::poses_per_scan]
    lidar_poses = np.array([Pose2(*pose).compose(LIDAR_MOUNT) for pose in poses.tolist()])
    angles = beam_angles(lidar)
    ranges = PartlyTransparentScene(floor, furniture).distances(lidar_poses, angles, lidar.max_range, rng)
    if circumstance not in UNCHANGED_CIRCUMSTANCES:
        people = simulate_people(floor, len(poses), poses_per_scan * STEP_S, PEOPLE_COUNT, rng)
        ranges = occlude_by_people(people, lidar_poses, angles, ranges)
    ranges = add_lidar_noise(ranges, lidar, rng)
    readings = _readings(odometry, ranges, poses_per_scan, lidar)
    ticks = np.round(np.arange(len(truth)) * STEP_S * TICK_RATE_HZ).astype(np.int64)
    grid = building_map(building)
    return Log(
        building=building,
        number=number,
        circumstance=circumstance,
        recording=LocalizationLog(readings, ticks, truth),
        map=left_half(grid, floor.middle) if circumstance == "half" else grid,
        estimate=Estimate(None if circumstance == "unknown" else Pose2(*truth[0].tolist())),
    )


def _drive_in_furniture(
    floor: Building, circumstance: str, seconds: float, rng: np.random.Generator, furniture: Array | None = None
) -> tuple[Array, Array]:
    """Return the true poses (k, 3) of a drive, and boxes (n, 4) of the furniture.

    If `furniture` is None, the furniture is chosen for the circumstance. If the furniture encloses the robot, a new
    drive is generated, with new furniture if `furniture` is None.
    """
    while True:
        current = furniture
        if current is None:
            current = floor.furniture if circumstance in UNCHANGED_CIRCUMSTANCES else rearranged_furniture(floor, rng)
        try:
            return drive_between_rooms(floor, current, seconds, rng, circumstance in ("outdated", "half")), current
        except EnclosedStart:
            continue


@lru_cache(maxsize=2)
def building_map(building: int) -> OccupancyGrid:
    """Return the map of a building with its original rooms and furniture."""
    floor, rng = generate_building(building), Streams(building).generator("map")
    poses = mapping_tour(floor)
    angles = np.linspace(-np.pi, np.pi, 480, endpoint=False)
    ranges = PartlyTransparentScene(floor, floor.furniture).distances(poses, angles, 80.0, rng)
    return draw_map(poses + rng.normal(0, MAPPING_POSE_STD, poses.shape), angles, ranges, floor.size)


def _readings(odometry: Array, ranges: Array, poses_per_scan: int, lidar: Lidar) -> list[Odometry | Scan]:
    """Return an odometry message for each pose (k, 3), and a scan after every `poses_per_scan`-th of these messages.

    `ranges` (n, b) are the ranges of the scans in m. The first scan follows the first odometry message.
    """
    readings: list[Odometry | Scan] = []
    increment = lidar.field_of_view / (lidar.beams - 1)
    for row, pose in enumerate(odometry.tolist()):
        tick = round(row * STEP_S * TICK_RATE_HZ)
        readings.append(Odometry("odom", tick, Pose2(*pose), Twist()))
        if row % poses_per_scan == 0:
            readings.append(
                Scan("lidar", tick, ranges[row // poses_per_scan], -lidar.field_of_view / 2, increment, lidar.min_range,
                     lidar.max_range, LIDAR_MOUNT)
            )  # fmt: skip
    return readings
