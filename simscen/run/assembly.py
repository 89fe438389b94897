"""Composition root of a run: builds the simulation, robots, sensors, stacks, and faults from the scenario."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from simscen.core.clock import Clock
from simscen.core.environment.world_model import FloorPatch
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Odometry, Reading
from simscen.core.random_streams import Streams
from simscen.core.records.events import Event, EventKind
from simscen.model.stack_files import ExternalStackSpec
from simscen.run.external.build import build_external_stack
from simscen.run.faults.command_link import CommandLink
from simscen.run.faults.fault_setting import FaultSettingFactory
from simscen.run.faults.injector import FaultInjector
from simscen.run.live_world.costmap_filters import CostmapFilters
from simscen.run.live_world.director import Director
from simscen.run.live_world.event_data import body_data
from simscen.run.live_world.pedestrians import PedestrianSimulation
from simscen.run.live_world.ray_caster import LiveRayCaster
from simscen.run.live_world.stage import LiveStage
from simscen.run.lockstep import EndCondition, RobotUnderTest, RunSetup
from simscen.run.preparation import PreparedScenario
from simscen.run.robot_interface import (
    SensorSuite,
    TickSchedule,
    command_latencies,
    robot_model,
    sensor_latencies,
    with_robot_latency,
)
from simscen.sensors.factory import build_sensors
from simscen.sensors.sensor import Sensor
from simscen.sim.robots.robot import Robot
from simscen.sim.simulation import RobotPlacement, Simulation
from simscen.stack.build import build_stack
from simscen.stack.protocols import Localizer, Stack, Surroundings
from simscen.worlds.geometry.triangulation import triangulate
from simscen.worlds.raycasting.ray_scene import RayScene


def assemble(prepared: PreparedScenario, seed: int, stack_log: Path | None = None) -> RunSetup:
    """Build everything that one run needs, without starting the stacks.

    `stack_log` is the file for the output of an external stack (None: no file). With several robots, the name of the
    robot is added to the file name.
    """
    spec, world = prepared.spec, prepared.built.world
    clock, streams = Clock(spec.physics.tick_rate), Streams(seed)
    simulation = Simulation(
        prepared.built.mesh,
        world.bodies,
        {name: RobotPlacement(part.body, part.start, part.obstacles) for name, part in prepared.by_robot.items()},
        triangulate,
        tick_rate=clock.rate,
        solver_iterations=spec.physics.solver_iterations,
        clearance_range=prepared.case.clearance_range,
        has_images=any(
            sensor.may_render for part in prepared.by_robot.values() for sensor in part.robot.sensors.values()
        ),
    )
    for region, friction in world.friction.items():
        simulation.add_friction_patch(region, FloorPatch(world.regions[region], friction))
    scene, stages = RayScene(prepared.built.mesh), dict[str, LiveStage]()
    pedestrians = PedestrianSimulation(prepared.built, simulation, clock)
    robots = {
        name: _build_robot(name, part, simulation, scene, seed, pedestrians, stages, stack_log)
        for name, part in prepared.by_robot.items()
    }
    for name, stage in stages.items():
        for body in (*world.bodies, *(robot.body for robot in simulation.robots[name].others)):
            stage.record_event(Event(0, EventKind.OBJECT_SPAWNED, body.name, body_data(body)))
    directors = tuple(director for director in _directors(prepared, streams, robots) if director.has_disturbances)
    for stage in stages.values():
        stage.is_observed = bool(directors)
    return RunSetup(simulation, tuple(robots.values()), directors)


def _directors(
    prepared: PreparedScenario, streams: Streams, robots: Mapping[str, RobotUnderTest]
) -> Iterator[Director]:
    """Yield the director of all events and faults; with several robots, one for events and one per robot for faults."""
    spec = prepared.spec
    first, *_ = robots.values()
    if not prepared.robots:
        yield Director(spec.steps, spec.faults, streams, first.stage, first.faults)
        return
    yield Director(spec.steps, [], streams, first.stage, first.faults)
    for name, robot in robots.items():
        robot_streams = Streams(streams.seed, name)
        yield Director([], prepared.robots[name].spec.faults, robot_streams, robot.stage, robot.faults)


def _build_robot(
    name: str,
    prepared: PreparedScenario,
    simulation: Simulation,
    scene: RayScene,
    seed: int,
    pedestrians: PedestrianSimulation,
    stages: dict[str, LiveStage],
    stack_log: Path | None,
) -> RobotUnderTest:
    """Build one robot with its sensors and its stack.

    Adds the robot's stage (interface of triggers and actions) to `stages` under the name of the robot.
    """
    spec, robot = prepared.spec, simulation.robots[name]
    clock, streams = Clock(spec.physics.tick_rate), Streams(seed, name)
    rays = LiveRayCaster(RayScene(scene), robot)
    sensors: tuple[Sensor, ...] = build_sensors(prepared.robot, clock, streams, robot, rays)

    def measure(reading: Reading) -> Reading:
        return faults.measure(reading)

    if any(entry.fault.measures_again for entry in spec.faults):
        sensors = tuple(SensorWithFaults(sensor, measure) for sensor in sensors)
    truth_period = clock.period(spec.physics.truth_rate)
    control_period = clock.period(prepared.stack.controller_frequency)
    if prepared.stack.gets_ground_truth:
        # The last sensor, because the log treats the first odometry sensor as the robot's odometry.
        sensors = (*sensors, TruthSensor(robot, control_period))
    suite = SensorSuite(sensors, sensor_latencies(prepared, clock))

    def disturb_belief(belief: Belief) -> Belief:
        return faults.belief(simulation.tick, belief)

    stack = _build_stack(prepared, clock, streams, seed, stack_log, disturb_belief)
    world, event_goals = prepared.built.world, prepared.case.sent
    filters = CostmapFilters(prepared.stack, world.regions, prepared.masks)
    stage = LiveStage(world, simulation, robot, stack, filters, clock, event_goals, pedestrians, Streams(seed), stages)
    settings = FaultSettingFactory(prepared.robot, clock, lambda: simulation.tick, robot, prepared.built.mesh)
    link = CommandLink(control_period, clock.ticks(prepared.robot.limits.command_timeout))
    faults = FaultInjector(spec.faults, streams, settings, link, stage.record_event, prepared.map_faults)
    return RobotUnderTest(
        robot=robot,
        sensors=suite,
        stack=stack,
        faults=faults,
        stage=stage,
        end_condition=EndCondition(clock, spec.time_limit, spec.linger, is_idle=bool(name) and not prepared.case.goals),
        schedule=TickSchedule(
            (truth_period, control_period, *suite.periods),
            (
                *suite.periods_and_latencies,
                *((control_period, latency) for latency in command_latencies(prepared, clock)),
            ),
        ),
        truth_period=truth_period,
    )


def _build_stack(
    prepared: PreparedScenario,
    clock: Clock,
    streams: Streams,
    seed: int,
    stack_log: Path | None,
    disturb_belief: Callable[[Belief], Belief],
) -> Stack:
    """Build the stack of a robot. `disturb_belief` applies active faults to each belief of the reference stack."""
    world = prepared.built.world
    surroundings = Surroundings(
        robot=robot_model(prepared.body),
        map=prepared.map,
        tick_rate=clock.rate,
        keepout=tuple(world.regions[name] for name in prepared.stack.keepout),
        speed_zones=tuple((world.regions[zone.region], zone.speed_limit) for zone in prepared.stack.speed_zones),
        masks=prepared.masks,
        lidars=tuple(name for name, sensor in prepared.robot.sensors.items() if sensor.localizes),
        has_imu=prepared.robot.has_imu,
    )
    if isinstance(prepared.stack, ExternalStackSpec):
        return build_external_stack(prepared, prepared.stack, surroundings, seed, stack_log)
    return build_stack(
        with_robot_latency(prepared.stack, prepared.robot),
        surroundings,
        streams,
        clock,
        stop_on_failure=prepared.spec.on_goal_failure != "continue",
        mode=prepared.spec.navigation.mode,
        wrap_localizer=lambda localizer: (
            LocalizerWithFaults(localizer, disturb_belief) if prepared.spec.faults else localizer
        ),
    )


class TruthSensor:
    """Sensor that reports the true pose (map frame) and velocity as odometry, for stacks that get the ground truth."""

    name = "ground_truth"

    def __init__(self, robot: Robot, period: int) -> None:
        self._robot, self.period = robot, period

    def read(self, tick: int) -> Odometry:
        """Return the true pose and velocity."""
        truth = self._robot.truth()
        return Odometry(self.name, tick, truth.pose.plane, truth.twist)


class SensorWithFaults:
    """Sensor with the measurements of the sensor `inner`, changed by `disturb`."""

    def __init__(self, inner: Sensor, disturb: Callable[[Reading], Reading]) -> None:
        self._inner, self._disturb = inner, disturb
        self.name, self.period = inner.name, inner.period

    def read(self, tick: int) -> Reading:
        """Return the changed measurement."""
        return self._disturb(self._inner.read(tick))


class LocalizerWithFaults:
    """Localizer with the published beliefs (pose estimates) of the localizer `inner`, changed by `disturb`."""

    def __init__(self, inner: Localizer, disturb: Callable[[Belief], Belief]) -> None:
        self._inner, self._disturb = inner, disturb
        self.reset, self.on_odometry = inner.reset, inner.on_odometry
        self.on_scan, self.on_imu = inner.on_scan, inner.on_imu

    @property
    def belief(self) -> Belief:
        """Belief with the effects of faults."""
        return self._disturb(self._inner.belief)
