"""Tests of pedestrians in runs: motion, reactions, events, and free space."""

import math

import numpy as np
import pytest

from simscen.core.clock import Clock
from simscen.core.environment.world_model import World
from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Body, Box, Solid
from simscen.core.records.events import EventKind
from simscen.run.live_world.pedestrians import PedestrianMap, PedestrianSimulation
from simscen.sim.bullet.collision_shapes import fuse_surfaces
from simscen.sim.simulation import Simulation
from simscen.worlds.built_world import build_world_and_map
from simscen.worlds.geometry.triangulation import triangulate

STANDING_ROBOT = {
    "stack": "{localizer: {type: ground_truth}}",
    "goals": "[]",
    "time_limit": "6",
    "pass": "[{collisions: {}}]",
}
ANNA = "{pedestrian: {name: anna, pose: {x: 3, y: 3}, goals: [[7, 3], [3, 3]], repeat: loop}}"

TABLE = [
    Solid(Box((1.0, 1.0, 0.04)), Pose3(z=0.72)),
    *(Solid(Box((0.05, 0.05, 0.7)), Pose3(x, y, 0.35)) for x in (-0.4, 0.4) for y in (-0.4, 0.4)),
]


def events(*lines: str) -> str:
    return "events:\n" + "".join(f"  - {line}\n" for line in lines)


def kinds_and_names(trace, *kinds: EventKind) -> list[tuple[str, str]]:
    return [(event.kind.value, event.name) for event in trace.of_kind(*kinds)]


def test_pedestrian_is_a_moving_object_of_type_person(play):
    trace = play(events(f"{{when: {{time: 0}}, do: {ANNA}}}"), **STANDING_ROBOT)
    spawned = trace.of_kind(EventKind.OBJECT_SPAWNED)[-1]
    assert spawned.data["person"] and spawned.data["behavior"] == "regular" and spawned.data["size"] == [0.25, 1.7]
    assert kinds_and_names(trace, EventKind.PEDESTRIAN_REACHED)[0] == ("pedestrian.reached", "anna")
    positions = trace.objects["anna"].values
    assert positions[:, 0].max() > 6.7 and np.ptp(positions[:, 1]) < 0.01


def test_pedestrians_walk_around_obstacles_and_spawned_objects(play):
    """The obstacles are a crate of the world and a box that an event spawns."""
    crate = "{spawn: {name: box, box: [0.4, 0.4, 1], pose: {x: 6, y: 3.2}}}"
    anna = "{pedestrian: {name: anna, pose: {x: 3.5, y: 5.5}, goals: [[7, 4.5], [6, 2]], speed: 1.4 m/s}}"
    trace = play(events(f"{{when: {{time: 0}}, do: [{crate}, {anna}]}}"), **{**STANDING_ROBOT, "time_limit": "9"})
    positions = trace.objects["anna"].values[:, :2]
    assert len(trace.of_kind(EventKind.PEDESTRIAN_REACHED)) == 2
    for (x, y), half in (((5.0, 4.5), 0.5), ((6.0, 3.2), 0.2)):
        gap = np.hypot(*np.maximum(np.abs(positions - (x, y)) - half, 0.0).T)
        assert gap.min() >= 0.25 - 1e-6


def test_reacting_pedestrian_emits_an_event(play):
    anna = "{pedestrian: {name: anna, pose: {x: 5, y: 1, yaw: 180 deg}, behavior: surprised, reacts_for: 2 s}}"
    trace = play(events(f"{{when: {{time: 0}}, do: {anna}}}"), **{**STANDING_ROBOT, "robot": "{pose: {x: 2, y: 1}}"})
    reacted = trace.of_kind(EventKind.PEDESTRIAN_REACTED, EventKind.PEDESTRIAN_CALMED)
    assert [event.kind for event in reacted] == [EventKind.PEDESTRIAN_REACTED, EventKind.PEDESTRIAN_CALMED]
    assert reacted[1].tick - reacted[0].tick == 480
    assert dict(reacted[0].data) == {"behavior": "surprised", "robot": ""}


def test_events_can_move_or_remove_a_pedestrian(play):
    lines = events(
        f"{{when: {{time: 0}}, do: {ANNA}}}",
        "{when: {time: 1}, do: {move: {name: anna, through: [[3.5, 1.5]], speed: 1}}}",
        "{when: {time: 5}, do: {remove: {name: anna}}}",
    )
    trace = play(lines, **STANDING_ROBOT)
    anna = trace.objects["anna"]
    assert np.allclose(anna.values[anna.ticks >= 4 * 240, :2][0], (3.5, 1.5))
    assert kinds_and_names(trace, EventKind.OBJECT_REMOVED) == [("object.removed", "anna")]
    assert anna.ticks.max() <= 5 * 240


def test_pedestrians_are_not_spawned_without_free_space(play):
    lines = events(
        f"{{when: {{time: 0}}, do: {ANNA}}}",
        "{when: {time: 0}, do: {pedestrian: {name: bert, pose: {x: 3.3, y: 3}}}}",
        "{when: {time: 0}, do: {pedestrian: {name: cleo, pose: {x: 1.1, y: 1}}}}",
        "{when: {time: 0}, do: {crowd: {name: guest, count: 40, start: corner}}}",
    )
    trace = play(lines, **STANDING_ROBOT)
    effects = [event.data["effects"][0]["happened"] for event in trace.of_kind(EventKind.EVENT_ENDED)]
    assert effects == [True, False, False, False]


@pytest.mark.slow
def test_another_pedestrian_does_not_change_distant_ones(play):
    far = "{pedestrian: {name: aaron, pose: {x: 0.4, y: 5.6}}}"
    anna = "{pedestrian: {name: anna, pose: {x: 7.5, y: 1}, goals: [[7.5, 5]]}}"
    crowd = "{crowd: {name: guest, count: COUNT, start: corner, goals: [corner], repeat: loop}}"
    without_others = play(events(f"{{when: {{time: 0}}, do: {anna}}}"), **STANDING_ROBOT)
    with_aaron = play(events(f"{{when: {{time: 0}}, do: [{far}, {anna}]}}"), **STANDING_ROBOT)
    assert (without_others.objects["anna"].values == with_aaron.objects["anna"].values).all()
    robot = {**STANDING_ROBOT, "robot": "{pose: {x: 7, y: 5}}"}
    two, three = (
        play(events(f"{{when: {{time: 0}}, do: {crowd.replace('COUNT', count)}}}"), **robot) for count in ("2", "3")
    )
    for name in ("guest-1", "guest-2"):
        first = two.objects[name].values[0, :2], three.objects[name].values[0, :2]
        assert np.allclose(*first, atol=0.02), "they start at the same place; later they may meet"


@pytest.mark.slow
def test_speed_depends_on_the_seed_unless_it_is_specified(play):
    def fastest(anna: str, seed: int) -> float:
        trace = play(events(f"{{when: {{time: 0}}, do: {anna}}}"), seed, **STANDING_ROBOT)
        positions = trace.objects["anna"]
        return float((np.hypot(*np.diff(positions.values[:, :2], axis=0).T) / np.diff(positions.ticks)).max() * 240)

    assert fastest(ANNA, 1) == fastest(ANNA, 1) != fastest(ANNA, 2)
    slow = ANNA.replace("repeat", "speed: 0.5 m/s, repeat")
    assert abs(fastest(slow, 1) - 0.5) < 0.01 and abs(fastest(slow, 2) - 0.5) < 0.01


def test_only_blind_pedestrians_touch_the_robot(play):
    def collisions(more: str) -> list[tuple[str, str]]:
        anna = f"{{pedestrian: {{name: anna, pose: {{x: 4, y: 1}}, goals: [[0.5, 1]]{more}}}}}"
        trace = play(
            events(f"{{when: {{time: 0}}, do: {anna}}}"), **{**STANDING_ROBOT, "robot": "{pose: {x: 2, y: 1}}"}
        )
        return kinds_and_names(trace, EventKind.COLLISION_STARTED)

    assert collisions("") == collisions(", behavior: impassive") == []
    assert collisions(", blind_to: [robots]")[0] == ("collision.started", "anna")


def test_pedestrians_have_no_room_inside_a_solid():
    block = Solid(Box((5.0, 5.0, 2.0)), Pose3(z=1.0), "block")
    world = World("w", (block,), bounds=(-2.5, -2.5, 2.5, 2.5))
    walls = PedestrianMap(build_world_and_map(world, 0.2))
    places = [(0.0, 0.0), (2.0, 0.0), (2.6, 0.0), (3.0, 0.0), (9.0, 9.0)]
    assert [walls.has_room(place, 0.25) for place in places] == [False, False, False, True, True]


@pytest.mark.parametrize(
    ("solids", "blocks"),
    [
        ((Solid(Box((1.0, 1.0, 0.05)), Pose3(z=0.72)),), True),
        ((Solid(Box((1.0, 1.0, 0.2)), Pose3(z=1.5)),), True),
        ((Solid(Box((1.0, 1.0, 0.2)), Pose3(z=1.9)),), False),
        ((Solid(Box((1.0, 1.0, 0.1)), Pose3(z=0.05)),), False),
        ((Solid(fuse_surfaces(TABLE, triangulate)),), True),
    ],
)
def test_walls_block_pedestrians_from_their_shins_to_their_heads(solids, blocks):
    walls = PedestrianMap(build_world_and_map(World("w", solids, bounds=(-2.5, -2.5, 2.5, 2.5)), 0.2))
    places = [(0.0, 0.0), (0.7, 0.0), (0.8, 0.0)]
    assert [walls.has_room(place, 0.25) for place in places] == [not blocks, not blocks, True]


def test_objects_block_pedestrians_only_at_the_height_and_tilt_of_their_pose():
    def has_room(solid: Solid, pose: Pose3, *places: tuple[float, float]) -> list[bool]:
        body = Body("object", (solid,), pose)
        built = build_world_and_map(World("w", (), (body,), bounds=(-4.0, -4.0, 4.0, 4.0)), 0.2)
        simulation = Simulation(built.mesh, [body], {}, triangulate)
        try:
            pedestrians = PedestrianSimulation(built, simulation, Clock(240))
            return [pedestrians.has_room(place, 0.25, walls_only=False) for place in places]
        finally:
            simulation.close()

    lamp = Solid(Box((1.0, 1.0, 0.6)), Pose3(z=0.3))
    assert has_room(lamp, Pose3(), (0.0, 0.0), (0.7, 0.0), (0.8, 0.0)) == [False, False, True]
    assert has_room(lamp, Pose3(z=2.5), (0.0, 0.0), (0.7, 0.0)) == [True, True]
    hanging = Solid(Box((1.0, 1.0, 1.5)), Pose3(z=-0.8))
    assert has_room(hanging, Pose3(z=1.8), (0.0, 0.0), (0.8, 0.0)) == [False, True]
    pole = Solid(Box((0.1, 0.1, 3.0)), Pose3(z=1.5))
    lying = Pose3.from_rpy(0.0, 0.0, 0.1, 0.0, math.pi / 2, math.pi / 2)  # lies along +y
    assert has_room(pole, lying, (0.0, 2.0), (2.0, 0.0), (0.0, -0.5)) == [False, True, True]
