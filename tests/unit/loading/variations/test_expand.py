"""From `variations:` to scenarios."""

from collections.abc import Callable
from pathlib import Path

import pytest

from simscen.core.errors import UsageError
from simscen.loading.scenario import load_scenario, try_variations
from simscen.loading.variations.expand import Variation, expand_variations
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.tree import MappingNode

Write = Callable[[str, str], Path]
BASE = "stack: {controller: {desired_linear_vel: 0.3}}\nrobot: {pose: {x: 1, y: 1}}\ngoals: [{pose: desk}]\n"


def variations_of(variations: str, base: str = BASE) -> list[Variation]:
    tree, problems = parse_yaml(f"{base}variations:\n{variations}", "x")
    assert isinstance(tree, MappingNode)
    assert not problems
    found = expand_variations(tree)
    assert isinstance(found[0], Variation), found
    return found  # type: ignore[return-value]


def problems_of(variations: str) -> list[str]:
    tree, _ = parse_yaml(f"{BASE}variations:\n{variations}", "x")
    assert isinstance(tree, MappingNode)
    return [
        f"{found.line}:{found.col} {found.message}"
        for found in expand_variations(tree)
        if not isinstance(found, Variation)
    ]


def names(variations: str) -> list[str]:
    return [variation.name for variation in variations_of(variations)]


def test_a_grid_is_every_combination_and_each_is_called_by_what_differs() -> None:
    found = variations_of("  grid: {robot.pose.x: [1, 2], robot.pose.y: [3, 4 m], stack.type: [reference]}")
    assert [variation.name for variation in found] == ["x=1,y=3", "x=1,y=4m", "x=2,y=3", "x=2,y=4m"]
    assert [
        (variation.tree.plain["robot"]["pose"]["x"], variation.tree.plain["robot"]["pose"]["y"]) for variation in found
    ] == [
        (1, 3),
        (1, "4 m"),
        (2, 3),
        (2, "4 m"),
    ]
    assert all("variations" not in variation.tree.entries for variation in found)


def test_values_that_are_too_long_for_the_name_of_a_folder_are_numbered() -> None:
    short, long = 21 * "名", 39 * "名"
    assert names(f"  grid: {{robot.a: [{short}, b], robot.b: [{long}]}}")[0] == f"a={short}"
    assert names(f"  grid: {{robot.a: [{long}, b], robot.b: [{long}, b]}}")[0] == "variation-1"


def test_pairs_go_together() -> None:
    assert names("  pairs: {robot.pose.x: [1, 2], robot.pose.y: [3, 4]}") == ["x=1,y=3", "x=2,y=4"]


def test_a_list_has_names_or_gets_them() -> None:
    listed = (
        "  list:\n  - {name: slow, robot.pose.x: 1}\n  - {robot.pose.x: 2, robot.pose.y: 3}\n  - {name: 3, tags: [x]}"
    )
    assert names(listed) == ["slow", "x=2,y=3", "3"]


def test_several_kinds_are_combined_and_several_blocks_follow_each_other() -> None:
    assert names(
        "  grid: {robot.pose.x: [1, 2]}\n  list: [{name: a, robot.pose.y: 1}, {name: b, robot.pose.y: 2}]"
    ) == [
        "x=1,a",
        "x=1,b",
        "x=2,a",
        "x=2,b",
    ]
    assert names("- grid: {robot.pose.x: [1, 2]}\n- list: [{name: far, goals.desk.pose: sofa}]") == [
        "x=1",
        "x=2",
        "far",
    ]


def test_no_blocks_are_no_variations() -> None:
    (only,) = variations_of("  []")
    assert (only.name, "variations" in only.tree.entries) == ("", False)


def test_drawn_values_are_those_of_the_tree_where_they_are_chosen() -> None:
    found = variations_of(
        "  sampled: {count: 3, values: {robot.pose: {choice: [{x: 1, y: 1}, dock]}, robot.pose2: {integer: [1, 9]}}}"
    )
    assert len(found) == 3
    assert all(variation.tree.plain["robot"]["pose"] in ({"x": 1, "y": 1}, "dock") for variation in found)


def test_items_of_lists_are_called_as_their_paths_call_them() -> None:
    base = BASE.replace("[{pose: desk}]", "[{pose: desk}, {pose: sofa}]")
    found = variations_of("  pairs: {goals.desk.timeout: [1, 2], goals.1.timeout: [3, 4]}", base)
    assert [variation.name for variation in found] == ["desk.timeout=1,1.timeout=3", "desk.timeout=2,1.timeout=4"]


@pytest.mark.parametrize(
    ("variations", "expected"),
    [
        ("  grid:\n    goals[0].pose: [a, b]", ["pose=a", "pose=b"]),
        ("  grid: {robot.pose: [{x: 1, y: 2}, dock]}", ["pose=1_2", "pose=dock"]),
        ("  grid: {world: [a/b.world.yaml, ../c d.yaml]}", ["world=a_b.world.yaml", "world=.._cd.yaml"]),
        ("  grid: {robot.pose.x: [1, 2], start.pose.x: [1]}\n  list: [{start.pose.y: 1}]", ["x=1", "x=2"]),
        ("  pairs: {robot.x: [1, 2], start.x: [3, 4]}", ["robot.x=1,start.x=3", "robot.x=2,start.x=4"]),
        ("  grid: {description: [a, A]}", ["description=a", "description=A+2"]),
        ("  grid: {events: [[{name: x}], [{name: y}]]}", ["events=no1", "events=no2"]),
        ("  grid: {robot.pose.yaw: [0 deg, -90 deg]}", ["yaw=0deg", "yaw=-90deg"]),
        (f"  grid: {{description: [{'a' * 300}, {'b' * 300}]}}", ["description=no1", "description=no2"]),
        ("  grid: {ключ: [été, b]}", ["ключ=été", "ключ=b"]),
    ],
)  # fmt: skip
def test_derived_names_are_readable_unique_and_safe_as_folders(variations: str, expected: list[str]) -> None:
    assert names(variations) == expected


@pytest.mark.parametrize(
    ("variations", "text"),
    [
        ("  {}", "a key is missing here"),
        ("  grid: {robot.pose.x: [1, 1.0]}", "this value is listed twice"),
        ("  grid: {robot.pose.x: [1], robot.pose: [dock]}", "`robot.pose.x` and `robot.pose` overlap: one is part"),
        ("  grid: {goals.0.pose: [a]}\n  pairs: {goals.desk.pose: [b]}", "and `goals.desk.pose` change the same value"),
        ("  list: [{robot.pose.x: 1, robot.pose: dock}]", "`robot.pose.x` and `robot.pose` overlap"),
        ("  pairs: {goals.0.pose: [a], goals.desk.pose: [b]}", "and `goals.desk.pose` change the same value"),
        ("  pairwise: {robot.pose.x: [1], robot.pose: [dock]}", "`robot.pose.x` and `robot.pose` overlap"),
        (
            "  sampled: {count: 1, values: {robot.pose.x: {uniform: [1, 2]}, robot.pose: {choice: [dock]}}}",
            "`robot.pose.x` and `robot.pose` overlap",
        ),
        ("  pairs: {robot.pose.x: [1, 2], robot.pose.y: [1]}", "`robot.pose.y` has 1 values, `robot.pose.x` has 2"),
        (f"  list: [{{name: {61 * '名'}, tags: [x]}}]", "is not a valid name of a variation"),
        ("  list: [{name: a b, tags: [x]}]", "`a b` is not a valid name of a variation"),
        ("  list: [{name: ../x, tags: [x]}]", "`../x` is not a valid name of a variation"),
        ("  list: [{name: a, tags: [x]}, {name: A, tags: [y]}]", "the variation at line 5 is also called `A`"),
        ("  list: [{name: a}]", "this variation changes nothing"),
        ("  sampled: {count: 3, values: {seed: {uniform: [2, 1]}}}", "the range is empty"),
        ("  sampled: {count: 1001, values: {seed: {integer: [1, 2]}}}", "the scenario has 1001 variations"),
    ],
)  # fmt: skip
def test_mistakes_in_variations_are_reported_at_their_positions(variations: str, text: str) -> None:
    assert any(text in found for found in problems_of(variations)), problems_of(variations)


def test_a_thousand_million_combinations_are_refused_without_being_made() -> None:
    grid = ", ".join(f"robot.k{n}: [{', '.join(map(str, range(10)))}]" for n in range(9))
    assert problems_of(f"  grid: {{{grid}}}") == ["5:3 the scenario has 1000000000 variations; the limit is 1000"]


def test_many_variations_of_a_large_value_are_refused_without_being_made() -> None:
    seeds = ", ".join(map(str, range(1, 1000)))
    goals = ", ".join("{pose: desk}" for _ in range(3000))
    (text,) = problems_of(f"  grid: {{seed: [{seeds}], goals: [[{goals}]]}}")
    assert "999 variations of up to 9" in text
    assert text.endswith("values exceed the limit of 5000000 values in total")


def test_each_variation_is_a_whole_scenario_with_its_values(write, scenario: str) -> None:
    file = write(
        "a.scenario.yaml",
        scenario + "variations:\n  grid: {seed: [3, 4], stack.controller.desired_linear_vel: [0.2]}\n",
    )
    loaded = try_variations(file, file.parent)
    assert isinstance(loaded, tuple)
    assert [(variation.title, variation.spec.seed) for variation in loaded] == [("a[seed=3]", 3), ("a[seed=4]", 4)]
    assert loaded[0].spec.stack.controller.desired_linear_vel == 0.2  # type: ignore[union-attr]
    assert loaded[0].world is loaded[1].world
    assert load_scenario(file, file.parent, variation="seed=4").spec.seed == 4


def test_a_file_that_is_extended_may_hold_the_variations(write, scenario: str) -> None:
    write("base.yaml", scenario + "variations: {grid: {seed: [3, 4]}}\n")
    file = write("a.scenario.yaml", "extends: base.yaml\n")
    assert [variation.variation for variation in try_variations(file, Path(file).parent)] == ["seed=3", "seed=4"]  # type: ignore[union-attr]
    file = write("b.scenario.yaml", "extends: base.yaml\nvariations: []\n")
    assert [variation.variation for variation in try_variations(file, Path(file).parent)] == [""]  # type: ignore[union-attr]


def test_conditions_that_exclude_all_pairs_are_an_error() -> None:
    block = "  pairwise: {robot.pose.x: [1, 2], robot.pose.y: [3, 4]}\n  require: [robot.pose.x > 5]"
    assert problems_of(block) == ["6:12 no variation meets the conditions"]


def test_the_name_of_a_numbered_variation_is_reserved() -> None:
    assert problems_of("  list: [{name: variation-2, tags: [a]}, {tags: [b]}]") == [
        "5:17 `variation-2` is reserved for the variation with this number"
    ]


def test_a_number_without_a_variation_is_not_a_file_without_variations(write: Write, scenario: str) -> None:
    path = write("a.scenario.yaml", f"{scenario}variations: {{grid: {{time_limit: [50, 60]}}}}\n")
    with pytest.raises(UsageError, match=r"has no variation `variation-9`$"):
        load_scenario(path, path.parent, variation="variation-9")


@pytest.mark.parametrize(
    ("varied", "condition"),
    [
        ("goals[0].pose: [{x: 1}, {x: 5}]", "goals[0].pose.x > 2"),
        ("goals.dock.pose.x: [1, 10]", "goals[0].pose.x > 5"),
        ("faults.lidar.for: [3 s, 10 s]", "value('faults[0].for') > 5"),
        ("robot.limits: [{linear: 0.4}, {linear: 0.8}]", "robot.limits.linear > 0.5"),
        ("robot.pose.x: [1, 2]", "robot.pose.x == 2"),
    ],
)
def test_a_condition_uses_the_new_value_however_its_path_is_written(varied: str, condition: str) -> None:
    base = "robot: {}\ngoals: [{name: dock, pose: {x: 1}}]\nfaults: [{sensor: lidar, for: 3 s}]\n"
    (only,) = variations_of(f'  grid:\n    {varied}\n  require: ["{condition}"]', base)
    assert only.changes[0].number == 2


def test_conditions_on_other_axes_leave_out_no_pairs() -> None:
    block = "  pairwise: {robot.pose.x: [1, 2], robot.pose.y: [3, 4]}\n  pairs: {robot.pose.yaw: [1, 5]}\n"
    base = BASE.replace("y: 1", "y: 1, yaw: 0")
    assert len(variations_of(f"{block}  require: [robot.pose.yaw > robot.pose.y]", base)) == 4
    with_other_path = block.replace("robot.pose.yaw:", "'robot[\"pose\"].yaw':")
    assert len(variations_of(f"{with_other_path}  require: [robot.pose.yaw > robot.pose.y]", base)) == 4
