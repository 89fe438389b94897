"""Tests of clusters of lidar hits, which do not depend on the heading of the lidar."""

import numpy as np
import pytest
import synthetic_drives as drives

from simscen.core.environment.world_model import World
from simscen.core.geometry import Pose2
from simscen.reconstruction.compared_scans import compare_scans
from simscen.reconstruction.drive.recorded_drive import Scans
from simscen.reconstruction.objects.clusters import scan_clusters
from simscen.reconstruction.static_world import StaticWorld

HALL = (
    drives.wall(0, -20, 40, 0.1),
    drives.wall(0, 20, 40, 0.1),
    drives.wall(-20, 0, 0.1, 40),
    drives.wall(20, 0, 0.1, 40),
)


def clusters_of_arc(distance, offsets, yaw):
    """Return the clusters of hits at `offsets` from straight ahead, seen by a lidar with this yaw; all in degrees."""
    world = StaticWorld(World("hall", HALL), drives.HEIGHT)
    times = np.arange(0.0, 0.5, 0.1)
    poses = np.tile([0.0, 0.0, np.radians(yaw)], (len(times), 1))
    ranges = world.ranges_from(poses, drives.ANGLES, 50.0)
    ranges[:, [(drives.BEAMS // 2 + offset - yaw) % drives.BEAMS for offset in offsets]] = distance
    measured = Scans(
        times, times, ranges, drives.ANGLES, 0.1, 50.0, Pose2(0.0, 0.0), drives.HEIGHT, np.zeros(len(times), bool)
    )
    drive = drives.drive(measured, poses=drives.signal(times, poses))
    return scan_clusters(compare_scans(drive, measured, world), world, has_true_poses=True)[0]


@pytest.mark.parametrize("yaw", [0, 90, 180])
@pytest.mark.parametrize(("distance", "offsets"), [
    (10.0, [-4, -3, -2, -1, 1, 2, 3, 4]),
    (15.0, [-2, -1, 0, 1, 2]),
])  # fmt: skip
def test_an_object_is_one_cluster_in_all_directions_of_the_lidar(distance, offsets, yaw):
    (cluster,) = clusters_of_arc(distance, offsets, yaw)
    assert len(cluster.points) == len(offsets)
    assert cluster.angle == pytest.approx(np.radians(max(offsets) - min(offsets) + 1))
    assert cluster.is_fully_visible
