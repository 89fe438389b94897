"""Test of batch sampling of paths against single samples."""

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.motion_paths import PathSampler, pose_at
from simscen.core.geometry.scripted_poses import BatchPathSampler
from simscen.core.geometry.shapes import MotionPath


def random_path(rng: np.random.Generator) -> MotionPath:
    """Return a path with up to five legs, some with zero duration or a rotation, and sometimes with easing."""
    count = int(rng.integers(1, 6))
    steps = rng.uniform(0.1, 3.0, count - 1) * (rng.random(count - 1) < 0.8)
    times = np.concatenate(([0.0], np.cumsum(steps)))
    headings = np.cumsum(rng.uniform(-4, 4, count) * (rng.random(count) < 0.4))
    poses = [Pose2(*pose) for pose in np.column_stack((rng.uniform(-9, 9, (count, 2)), headings)).tolist()]
    mode, ease = str(rng.choice(["once", "loop", "back_and_forth"])), str(rng.choice(["linear"] * 4 + ["smooth"]))
    start, phase = float(rng.choice([0.0, 1.7])), float(rng.choice([0.0, 0.6]))
    return MotionPath(tuple(times.tolist()), tuple(poses), mode, start, ease, phase)


@pytest.mark.parametrize("seed", range(4))
def test_batch_sampling_equals_single_sampling(seed: int) -> None:
    rng = np.random.default_rng(seed)
    paths_and_heights = [(random_path(rng), float(height)) for height in rng.uniform(0, 1, 30)]
    ticks = np.arange(0, 6 * 480, 6)[:, np.newaxis] - rng.integers(0, 240, len(paths_and_heights))
    ticks[0, :] = 0
    # Times at which legs begin and end, and at which the motion reverses.
    leg_times = np.array(
        [(p.times[0], p.times[1] if len(p.times) > 1 else 0.0, p.times[-1]) for p, _ in paths_and_heights]
    ).T
    seconds = np.concatenate(
        (ticks / 240, *(k * leg_times + [p.start - p.phase for p, _ in paths_and_heights] for k in (1, 2)))
    )
    poses = BatchPathSampler(paths_and_heights).at(seconds)
    for column, (path, z) in enumerate(paths_and_heights):
        sampler = PathSampler(path, z)
        single_poses = [sampler.at(time) for time in seconds[:, column].tolist()]
        assert poses[:, column].tolist() == [list(pose) for pose in single_poses]
        planar_poses = [pose_at(path, time) for time in seconds[:, column].tolist()]
        assert np.array([pose[:2] for pose in single_poses]) == pytest.approx(
            np.array([planar_pose[:2] for planar_pose in planar_poses])
        )
