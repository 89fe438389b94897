"""Build the external stack of a robot from its scenario."""

import sys
from dataclasses import replace
from pathlib import Path

from simscen.core.clock import Clock
from simscen.core.errors import InvalidInput
from simscen.core.external_command import ExternalCommand
from simscen.loading.stacks.userconfig import undefined_stack_problem
from simscen.model.stack import StackSpec
from simscen.model.stack_base import GoalTolerances, StackBase
from simscen.model.stack_files import ExternalStackSpec
from simscen.run.external.handshake import RunParameters
from simscen.run.external.stack import ExternalStack
from simscen.run.external.zone_masks import switchable_zones
from simscen.run.preparation import PreparedScenario
from simscen.run.process.isolation import clean_environment
from simscen.run.robot_interface import sensor_kinds, sensor_mounts
from simscen.sim.urdf.writer import to_urdf
from simscen.stack.protocols import Surroundings


def build_external_stack(
    prepared: PreparedScenario,
    spec: ExternalStackSpec,
    surroundings: Surroundings,
    seed: int,
    log_file: Path | None,
) -> ExternalStack:
    """Build the external stack of a robot. Raises InvalidInput if the name of the stack is not defined.

    The output of the stack goes to `log_file` (None: no file); see `robot_file` for its name with several robots.
    """
    command = prepared.loaded.external_command
    if command is None:
        raise InvalidInput([problem] if (problem := undefined_stack_problem(prepared.loaded)) else [])
    parameters = RunParameters(
        seed=seed,
        control_period=Clock(surroundings.tick_rate).period(spec.controller_frequency),
        sensors=sensor_kinds(prepared),
        mounts=sensor_mounts(prepared.robot),
        rates={name: float(getattr(sensor.chosen, "rate", 0.0)) for name, sensor in prepared.robot.sensors.items()},
        robot_description=to_urdf(prepared.body),
        stop_on_failure=prepared.spec.on_goal_failure == "stop",
        mode=prepared.spec.navigation.mode,
        robot_name=prepared.loaded.robot_name,
        switchable_zones=switchable_zones(prepared),
    )
    robot_log = log_file and robot_file(log_file, parameters.robot_name)
    return ExternalStack(spec.external, command, surroundings, parameters, robot_log)


def robot_file(file: Path, robot: str) -> Path:
    """Return `file` with the name of one of several robots, such as stack.a.log; unchanged if `robot` is ""."""
    return file.with_stem(f"{file.stem}.{robot}") if robot else file


def with_external_reference(prepared: PreparedScenario) -> PreparedScenario:
    """Return the scenario with the reference stack of each robot in an external process, for tests and benchmarks."""
    if prepared.robots:
        parts = {name: with_external_reference(part) for name, part in prepared.robots.items()}
        loaded = replace(prepared.loaded, robots={name: part.loaded for name, part in parts.items()})
        return replace(next(iter(parts.values())), loaded=loaded, robots=parts)
    stack = prepared.stack
    assert isinstance(stack, StackSpec)
    stack_json = stack.model_dump_json(by_alias=True, exclude_none=True)
    argv = (sys.executable, "-I", "-m", "simscen.run.external.reference_stack", stack_json)
    tolerances = {name: getattr(stack.goal_checker, name) for name in GoalTolerances.model_fields}
    shared = {name: getattr(stack, name) for name in StackBase.model_fields if name != "goal_checker"}
    external = ExternalStackSpec(
        external="reference", ground_truth=stack.gets_ground_truth, goal_checker=GoalTolerances(**tolerances), **shared
    )
    command = ExternalCommand(argv, clean_environment(), str(Path.cwd()))
    return replace(prepared, stack=external, loaded=replace(prepared.loaded, external_command=command))
