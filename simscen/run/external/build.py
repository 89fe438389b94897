"""From a prepared scenario to its external stack, ready to `start`."""

from pathlib import Path

from simscen.core.clock import Clock
from simscen.core.errors import InvalidInput
from simscen.loading.stacks.userconfig import undefined_stack
from simscen.model.anystack import ExternalStackSpec
from simscen.run.external.hello import Ordered
from simscen.run.external.stack import ExternalStack
from simscen.run.prepare import Prepared
from simscen.run.sensornames import sensor_frames, sensor_kinds
from simscen.sim.urdf.describe import describe
from simscen.stack.protocols import Surroundings


def build_external(
    prepared: Prepared, spec: ExternalStackSpec, surroundings: Surroundings, seed: int, printed: Path | None
) -> ExternalStack:
    """The stack that a scenario names; what it prints goes to the file `printed`, as `for_robot` calls it.

    Raises InvalidInput when nobody says what the name runs.
    """
    command = prepared.loaded.runs
    if command is None:
        raise InvalidInput([problem] if (problem := undefined_stack(prepared.loaded)) else [])
    ordered = Ordered(
        seed=seed,
        control_period=Clock(surroundings.tick_rate).period(spec.controller_frequency),
        sensors=sensor_kinds(prepared),
        mounts=sensor_frames(prepared.robot),
        rates={name: float(getattr(sensor.chosen, "rate", 0.0)) for name, sensor in prepared.robot.sensors.items()},
        robot_description=describe(prepared.body),
        stop_on_failure=prepared.spec.on_goal_failure == "stop",
        mode=prepared.spec.navigation.mode,
        robot_name=prepared.loaded.robot_name,
    )
    shown = printed and for_robot(printed, ordered.robot_name)
    return ExternalStack(spec.external, command, surroundings, ordered, shown)


def for_robot(file: Path, robot: str) -> Path:
    """What the file of a stack is called for that one of several robots: `stack.a.log`."""
    return file.with_stem(f"{file.stem}.{robot}") if robot else file
