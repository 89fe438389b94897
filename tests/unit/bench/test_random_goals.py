"""Tests of drives between random poses, and of their generated worlds."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy import ndimage

from simscen.bench.navigation import generated_worlds
from simscen.bench.navigation.experiments import with_stack_parameters
from simscen.bench.navigation.generated_worlds import FREE, generate_office_map, write_office_map
from simscen.bench.navigation.random_goals import (
    FAULTS,
    MOVABLE_MARGIN_M,
    WALL_MARGIN_M,
    random_drives,
    write_degraded_sensing,
    write_random_goals,
)
from simscen.core.environment.world_model import BuiltWorld, World
from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Body, Box, Solid
from simscen.loading.builders import world_from_file
from simscen.loading.files.single_files import load_world_file
from simscen.loading.scenario import load_scenario
from simscen.worlds.built_world import build_world_and_map


def two_rooms() -> BuiltWorld:
    """Return a world of 10 x 6 m with a wall without a door at x = 5, and a movable object at (2, 3)."""
    solids = [Solid(Box((10.2, 0.1, 1.0)), Pose3(5.0, y, 0.5), "wall") for y in (0.0, 6.0)] + [
        Solid(Box((0.1, 6.0, 1.0)), Pose3(x, 3.0, 0.5), "wall") for x in (0.0, 5.0, 10.0)
    ]
    cart = Body("cart", (Solid(Box((0.4, 0.4, 0.4)), Pose3(), "cart"),), Pose3(2.0, 3.0, 0.2))
    return build_world_and_map(World("rooms", tuple(solids), (cart,), bounds=(0.0, 0.0, 10.0, 6.0)), 0.2)


def test_every_drive_is_reachable_with_free_start_and_goal() -> None:
    drives = list(random_drives(two_rooms(), 0.22, range(1, 21), min_length=2.0))
    assert len(drives) == 20
    for drive in drives:
        assert (drive.start.x < 5.0) == (drive.goal.x < 5.0)  # the wall has no door
        assert drive.length >= max(2.0, drive.start.distance(drive.goal) - 1e-6)
        for end in (drive.start, drive.goal):
            to_walls = min(abs(end.x - x) for x in (0.0, 5.0, 10.0)), min(end.y, 6.0 - end.y)
            assert min(to_walls) >= 0.05 + 0.22 + WALL_MARGIN_M - 0.01
            assert math.hypot(end.x - 2.0, end.y - 3.0) >= MOVABLE_MARGIN_M


def test_drive_depends_only_on_its_number() -> None:
    first, second, third = random_drives(two_rooms(), 0.22, (1, 2, 3), min_length=2.0)
    assert [first, second, third] != [first, first, first]
    assert list(random_drives(two_rooms(), 0.22, (3, 1), min_length=2.0)) == [third, first]
    assert [drive.number for drive in (first, second, third)] == [1, 2, 3]


def test_office_map_has_one_large_free_part_and_loads(tmp_path: Path) -> None:
    for number in range(1, 7):
        cells, resolution = generate_office_map(number)
        parts, _ = ndimage.label(cells == FREE)
        largest = np.bincount(parts.ravel())[1:].max()
        assert largest * resolution**2 > 100.0
        assert largest > 0.6 * np.count_nonzero(cells == FREE)
    file = write_office_map(1, tmp_path)
    world = world_from_file(load_world_file(file, tmp_path), tmp_path)
    assert world.grid is not None
    assert world.grid.resolution == generate_office_map(1)[1]
    assert np.array_equal(world.grid.cells == 0, generate_office_map(1)[0] == FREE)


def test_random_goals_and_degraded_drives_load(tmp_path: Path) -> None:
    file = write_office_map(3, tmp_path)
    built = {file.name: build_world_and_map(world_from_file(load_world_file(file, tmp_path), tmp_path), 0.2)}
    plain = write_random_goals("random goals", tmp_path, built, (1, 2))
    weak, medium, strong = write_degraded_sensing(tmp_path / "degraded", built, 1, (tmp_path,))
    assert len(plain.drives) == 2
    for drive in plain.drives:
        load_scenario(drive.file, plain.root, plain.world_path)
    assert len(weak.drives) == len(medium.drives) == len(strong.drives) == len(FAULTS)
    for weak_drive, strong_drive in list(zip(weak.drives, strong.drives, strict=True))[::3]:
        weak_spec, strong_spec = (
            load_scenario(drive.file, weak.root, weak.world_path).spec for drive in (weak_drive, strong_drive)
        )
        assert weak_spec.only_robot.pose == strong_spec.only_robot.pose and weak_spec.goals == strong_spec.goals
        assert weak_spec.faults != strong_spec.faults
        assert weak_drive.world == file.name  # the confidence interval is over buildings, not over faults


def test_corridors_and_ramps_load_and_differ(tmp_path: Path) -> None:
    for experiment in (
        generated_worlds.write_two_robots(tmp_path / "corridors", (1, 2, 3)),
        generated_worlds.write_ramps(tmp_path / "r", (1, 2, 3)),
    ):
        names = {load_scenario(drive.file, experiment.root).spec.name for drive in experiment.drives}
        assert len(names) == 3


def test_ramps_are_not_walls_on_the_map(tmp_path: Path) -> None:
    for drive in generated_worlds.write_ramps(tmp_path, range(1, 21)).drives:
        loaded = load_scenario(drive.file, tmp_path)
        (lidar,) = (sensor.lidar for sensor in loaded.robot.spec.sensors.values() if sensor.lidar)
        (platform,) = loaded.world.spec.obstacles
        assert platform.box[2] < lidar.mount.z - 0.01


OTHER = {"controller": {"desired_linear_vel": 0.3}, "localizer": {"type": "odometry"}}


def test_a_variant_has_the_same_drives_with_other_parameters(tmp_path: Path) -> None:
    original = generated_worlds.write_ramps(tmp_path / "r", (1, 2))
    variant = with_stack_parameters(original, "slow", OTHER, tmp_path / "v")
    for original_drive, variant_drive in zip(original.drives, variant.drives, strict=True):
        original_spec = load_scenario(original_drive.file, original.root).spec
        variant_spec = load_scenario(variant_drive.file, variant.root, variant.world_path).spec
        assert original_spec.goals == variant_spec.goals
        assert (variant_spec.stack.controller.desired_linear_vel, variant_spec.stack.localizer.type) == (
            0.3,
            "odometry",
        )


def test_a_variant_of_drives_without_a_map_keeps_the_localizer_that_needs_none(tmp_path: Path) -> None:
    original = replace(generated_worlds.write_ramps(tmp_path / "r", (1,)), is_mapless=True)
    variant = with_stack_parameters(original, "slow", OTHER, tmp_path / "v")
    spec = load_scenario(variant.drives[0].file, variant.root, variant.world_path).spec
    assert (spec.stack.controller.desired_linear_vel, spec.stack.localizer.type) == (0.3, "amcl")


def test_reference_page_lists_every_fault() -> None:
    page = (Path(__file__).parents[3] / "docs/reference/navigation-benchmark.md").read_text(encoding="utf-8")
    table = page[page.index("| Fault | Weak |") :].partition("\n\n")[0]
    rows = {row.split("`")[1]: row for row in table.splitlines() if row.startswith("| `")}
    assert set(FAULTS) <= set(rows)
    for fault, (_, values) in FAULTS.items():
        if "sector" not in fault:  # its values are widths
            assert all(f"| {value} " in rows[fault] for value in values)
