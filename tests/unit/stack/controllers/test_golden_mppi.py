"""Tests of MPPI against golden/mppi.yaml, computed by an implementation of Nav2's sources with loops."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from simscen.core.geometry import Pose2
from simscen.model.mppi import Mppi
from simscen.stack.controllers.mppi.control_sequence import apply_limits, sample_weights, smooth_sequence
from simscen.stack.controllers.mppi.critic_data import CriticData
from simscen.stack.controllers.mppi.critics import CriticManager
from simscen.stack.controllers.mppi.rollouts import integrate_velocities, predict_velocities
from simscen.stack.controllers.path_handler import UpcomingPath
from simscen.stack.footprint import Footprint
from simscen.stack.kinematics import VelocityLimits
from simscen.stack.protocols import CostmapView
from simscen.testing.flatland import round_robot

CASES = yaml.safe_load((Path(__file__).parent / "golden/mppi.yaml").read_text(encoding="utf-8"))
STEPS, DT, CURRENT = 22, 0.1, np.array((0.2, 0.3, -0.1), np.float32)


def controls(axes: int) -> np.ndarray:
    """Return controls vx, wz, and vy (axes, steps, 3 samples) that oscillate around a mean."""
    axis, step, sample = np.meshgrid(np.arange(axes), np.arange(STEPS), np.arange(3), indexing="ij")
    mean, amplitude = np.array((0.35, 0.0, 0.1))[axis], np.array((0.5, 0.8, 0.25))[axis]
    return (mean + amplitude * np.sin(0.37 * step * (axis + 1) + 1.1 * sample + 0.5 * axis)).astype(np.float32)


def scene(given: dict[str, Any], sampled: np.ndarray, limits: VelocityLimits) -> CriticData:
    """Return the rollouts of the sampled controls, with the costmap and the plan of a case."""
    rollouts = integrate_velocities(predict_velocities(CURRENT[: len(sampled)], sampled, limits, DT), given["yaw"], DT)
    rows, columns = np.mgrid[0:160, 0:160]
    costs = ((7 * rows + 13 * columns) % 200).astype(np.uint8)
    if "block" in given:
        costs[given["block"][1], given["block"][0]] = 254
    distance = np.where(costs == 254, 0.0, 9.0).astype(np.float32)
    view = CostmapView(costs, distance, 0.05, (-4.0, -4.0))
    angle, lengths = given["yaw"] + given["bend"], 0.05 * np.arange(given["points"])
    points = np.column_stack((lengths * math.cos(angle), lengths * math.sin(angle), np.full_like(lengths, angle)))
    plan = UpcomingPath(points, 0.05, float(lengths[-1]))
    footprint = Footprint(round_robot(), 0.05)
    return CriticData(rollouts, plan, Pose2(0.0, 0.0, given["yaw"]), given["goal"], view, footprint, limits, DT, 0.25)


@pytest.mark.parametrize("case", CASES, ids=[case["name"] for case in CASES])
def test_vectorized_mppi_equals_an_implementation_with_loops(case: dict[str, Any]) -> None:
    given, axes = case["given"], case["given"]["axes"]
    limits = VelocityLimits((-0.2, -0.3, -1.5), (0.5, 0.3, 1.5), (1.2, 0.9, 2.0), (-1.8, -0.9, -2.0), given["radius"])
    sampled = controls(axes)
    data = scene(given, sampled, limits)
    ends = np.stack((data.rollouts.x[-1], data.rollouts.y[-1], data.rollouts.yaw[-1]), axis=-1)
    assert ends == pytest.approx(np.array(case["ends"]), abs=2e-5)
    assert data.furthest_point == case["furthest"]
    options: dict[str, dict[str, Any]] = {
        "CostCritic": {"consider_footprint": False},
        "PathAlignCritic": {"offset_from_furthest": 10},
        "PathAngleCritic": {"mode": given.get("mode", 0)},
        "VelocityDeadbandCritic": {"deadband_velocities": (0.1, 0.05, 0.2)},
    }
    names = sorted(name for name in Mppi.model_fields if name.endswith("Critic") and name != "ObstaclesCritic")
    parts = {name: {"cost_power": given.get("power", 1), **options.get(name, {})} for name in names}
    total = np.zeros(3)
    for name in names:
        spec = Mppi.model_validate({"type": "mppi", "critics": [name], **parts})
        cost, _ = CriticManager(spec, axes == 3).costs(data)
        assert cost == pytest.approx(np.array(case["costs"].get(name, [0.0] * 3)), rel=2e-4, abs=2e-5), name
        total += cost
    mean = sampled.mean(axis=2)
    mean[:, 0] = CURRENT[:axes]
    noise = sampled - mean[:, :, None]
    weights = sample_weights(total, mean, noise, (0.2, 0.4, 0.2)[:axes], 0.015, 0.3)
    assert weights == pytest.approx(np.array(case["weights"]), abs=2e-4)
    past = (0.01 * np.multiply.outer(np.arange(1, axes + 1), np.arange(4))).astype(np.float32)
    sequence = apply_limits(smooth_sequence(sampled @ weights, past, 2), CURRENT[:axes], limits, DT)
    assert sequence[:, [1, 2, 7, 20]] == pytest.approx(np.array(case["sequence"]), abs=2e-4)
