"""Tests of building localizers from specifications."""

from dataclasses import replace

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import Estimate
from simscen.core.random_streams import Streams
from simscen.model import localizers as model
from simscen.stack.localizers.amcl import AmclLocalizer
from simscen.stack.localizers.dead_reckoning import DeadReckoning
from simscen.stack.localizers.ekf import EkfLocalizer
from simscen.stack.localizers.ground_truth import GroundTruthLocalizer
from simscen.stack.protocols import Localizer, Surroundings
from simscen.stack.setting import Setting
from simscen.testing.synthetic_room import ROBOT, surroundings

ESTIMATE = Estimate(Pose2(0, 0, 0))


def build_localizer(spec: model.LocalizerSpec, robot_surroundings: Surroundings) -> Localizer:
    localizer: Localizer = spec.implementation()(
        spec, Setting(robot_surroundings, "localizer", Streams(1), estimate=ESTIMATE)
    )
    return localizer


@pytest.mark.parametrize(
    ("spec", "kind"),
    [
        (model.Amcl(), AmclLocalizer),
        (model.Ekf(type="ekf"), EkfLocalizer),
        (model.GroundTruth(type="ground_truth"), GroundTruthLocalizer),
        (model.OdometryOnly(type="odometry"), DeadReckoning),
    ],
)
def test_each_type_of_specification_builds_its_localizer(spec: model.LocalizerSpec, kind: type) -> None:
    assert isinstance(build_localizer(spec, surroundings()), kind)


def test_amcl_without_a_map_is_dead_reckoning() -> None:
    assert isinstance(build_localizer(model.Amcl(), replace(surroundings(), map=None)), DeadReckoning)


@pytest.mark.parametrize(
    ("robot_model", "holonomic", "is_omni"),
    [(None, False, False), (None, True, True), ("omni", False, True), ("differential", True, False)],
)
def test_motion_model_is_robot_model_or_else_that_of_the_drive(
    robot_model: str | None, holonomic: bool, is_omni: bool
) -> None:
    """Only the omni model uses alpha5, the noise of lateral motion."""
    spec = model.Amcl(alpha1=0, alpha2=0, alpha3=0, alpha4=0, alpha5=1.0, robot_model=robot_model)  # type: ignore[arg-type]
    localizer = build_localizer(spec, replace(surroundings(), robot=replace(ROBOT, holonomic=holonomic)))
    assert isinstance(localizer, AmclLocalizer)
    covariance = localizer._motion.propagate(np.zeros((3, 3)), 0.0, Pose2(0.3, 0, 0))
    assert (covariance[1, 1] > 0) == is_omni
