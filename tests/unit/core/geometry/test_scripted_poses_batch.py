"""Test of batch sampling of paths against single samples."""

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.geometry.motion_paths import PathSampler, pose_at
from simscen.core.geometry.scripted_poses import BatchPathSampler
from simscen.core.geometry.shapes import MotionPath


def any_path(rng: np.random.Generator) -> MotionPath:
    """Of up to five legs: some straight, some of no time, some that turn; sometimes eased."""
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
    each = [(any_path(rng), float(height)) for height in rng.uniform(0, 1, 30)]
    ticks = np.arange(0, 6 * 480, 6)[:, np.newaxis] - rng.integers(0, 240, len(each))
    ticks[0, :] = 0
    # Also exactly where legs begin and end, and where the way turns back.
    ends = np.array([(p.times[0], p.times[1] if len(p.times) > 1 else 0.0, p.times[-1]) for p, _ in each]).T
    seconds = np.concatenate((ticks / 240, *(k * ends + [p.start - p.phase for p, _ in each] for k in (1, 2))))
    poses = BatchPathSampler(each).at(seconds)
    for column, (path, z) in enumerate(each):
        track = PathSampler(path, z)
        alone = [track.at(time) for time in seconds[:, column].tolist()]
        assert poses[:, column].tolist() == [list(pose) for pose in alone]
        planes = [pose_at(path, time) for time in seconds[:, column].tolist()]
        assert np.array([pose[:2] for pose in alone]) == pytest.approx(np.array([plane[:2] for plane in planes]))
