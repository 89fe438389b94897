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

HERE = Estimate(Pose2(0, 0, 0))


def built(spec: model.LocalizerSpec, around: Surroundings) -> Localizer:
    made: Localizer = spec.implementation()(spec, Setting(around, "localizer", Streams(1), estimate=HERE))
    return made


@pytest.mark.parametrize(
    ("spec", "kind"),
    [
        (model.Amcl(), AmclLocalizer),
        (model.Ekf(type="ekf"), EkfLocalizer),
        (model.GroundTruth(type="ground_truth"), GroundTruthLocalizer),
        (model.OdometryOnly(type="odometry"), DeadReckoning),
    ],
)
def test_each_type_becomes_its_localizer(spec: model.LocalizerSpec, kind: type) -> None:
    assert isinstance(built(spec, surroundings()), kind)


def test_without_a_map_amcl_is_dead_reckoning() -> None:
    assert isinstance(built(model.Amcl(), replace(surroundings(), map=None)), DeadReckoning)


@pytest.mark.parametrize(
    ("robot_model", "holonomic", "strafes"),
    [(None, False, False), (None, True, True), ("omni", False, True), ("differential", True, False)],
)
def test_the_motion_model_is_that_of_the_drive_unless_it_is_named(
    robot_model: str | None, holonomic: bool, strafes: bool
) -> None:
    """alpha5 is the noise of strafing: it shows in the covariance of the omni model only."""
    spec = model.Amcl(alpha1=0, alpha2=0, alpha3=0, alpha4=0, alpha5=1.0, robot_model=robot_model)  # type: ignore[arg-type]
    subject = built(spec, replace(surroundings(), robot=replace(ROBOT, holonomic=holonomic)))
    assert isinstance(subject, AmclLocalizer)
    grow_covariance = subject._motion.propagate(np.zeros((3, 3)), 0.0, Pose2(0.3, 0, 0))
    assert (grow_covariance[1, 1] > 0) == strafes
