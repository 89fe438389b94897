"""Tests of built-in types and of types of installed packages."""

import subprocess
import sys

import pytest
from pydantic import TypeAdapter, ValidationError

import simscen.plugin
from simscen.advanced.spec import MedialAxisPlanner
from simscen.model.disturbances import FaultEntry
from simscen.model.sensors import Sensor
from simscen.spec.choice import Choice
from simscen.spec.extensible_union import BehaviorName
from simscen.spec.registry import (
    GROUPS,
    BrokenPlugin,
    all_types,
    built_in_types,
    find_type,
    installed_specs,
    installed_types,
    plugin_types,
    types_without_group,
)
from simscen.triggers.base import Trigger


def test_built_in_types_are_listed_first_and_installed_ones_by_name(packages, calm_module) -> None:
    packages("zeta", "2.0", {"criterion": {"zen": "calm:Calm"}}, calm=calm_module)
    packages("alpha", "1.0", {"criterion": {"calm": "calm:Calm"}})
    names = [entry.name for entry in all_types("criterion")]
    own = [entry.name for entry in built_in_types("criterion")]
    assert own[:3] == ["goals_reached", "result", "error_code"]
    assert names == [*own, "calm", "zen"]
    assert [entry.origin for entry in installed_types("criterion")] == ["alpha 1.0", "zeta 2.0"]


def test_built_in_and_installed_types_are_loaded_the_same_way(packages, calm_module) -> None:
    packages("calm", "1.0", {"criterion": {"calm": "calm:Calm"}}, calm=calm_module)
    for name, wanted in (("calm", "Calm"), ("speed", "Speed")):
        entry = find_type("criterion", name)
        assert entry is not None
        assert entry.load().__name__ == wanted
    assert find_type("criterion", "clam") is None
    assert [find_type("criterion", name).is_shipped for name in ("calm", "speed")] == [False, True]


@pytest.mark.parametrize("group", sorted(GROUPS.keys() - {"metric"}))  # what simscen measures has no parameters
def test_built_in_types_are_valid_members_of_their_group(group: str) -> None:
    for entry in built_in_types(group):
        if (group, entry.name) != ("criterion", "whenever"):  # half of one, `then` is the other
            assert entry.load() is not None, entry


@pytest.mark.parametrize(
    ("group", "name", "value", "why"),
    [
        ("criterion", "calm", "nowhere:Calm", "ModuleNotFoundError: No module named 'nowhere'"),
        ("criterion", "calm", "calm:Clam", "`calm:Clam` does not exist"),
        ("criterion", "calm", "calm:Lax", "not a subclass of simscen.plugin.Spec or simscen.plugin.Value"),
        ("criterion", "calm", "calm:Stranger", "is not a subclass of simscen.plugin.Criterion"),
        ("criterion", "calm", "calm:Vague", "does not implement judge"),
        ("criterion", "calm", "calm", "not of the form package.module:Class"),
        ("criterion", "Calm", "calm:Calm", "its name must start with a lowercase letter"),
        ("criterion", "severity", "calm:Calm", "`severity` is reserved"),
        ("criterion", "speed", "calm:Calm", "simscen ships a type with the same name"),
        ("trigger", "all", "calm:Calm", "`all` is reserved"),
        ("fault", "calm", "calm:Calm", "is not a subclass of simscen.plugin.Fault"),
    ],
)
def test_unusable_type_states_reason_and_package(packages, group, name, value, why, calm_module) -> None:
    packages("calm-driving", "1.0", {group: {name: value}}, calm=calm_module)
    (entry,) = installed_types(group)
    with pytest.raises(BrokenPlugin) as broken:
        entry.load()
    assert why in str(broken.value)
    assert f"{group} `{name}` of calm-driving 1.0 cannot be used" in str(broken.value)


@pytest.mark.parametrize("text", ["raise RuntimeError('first line\\nsecond')", "import sys; sys.exit(3)", "def ("])
def test_module_that_fails_during_import_is_a_broken_plugin(packages, text: str) -> None:
    packages("calm", "1.0", {"criterion": {"calm": "calm:Calm"}}, calm=text)
    with pytest.raises(BrokenPlugin, match="`calm:Calm` cannot be loaded: "):
        find_type("criterion", "calm").load()


def test_name_added_by_two_packages_is_unusable(packages, calm_module) -> None:
    packages("b", "1.0", {"criterion": {"calm": "calm:Calm"}}, calm=calm_module)
    packages("a", "2.0", {"criterion": {"calm": "calm:Calm"}})
    with pytest.raises(BrokenPlugin, match=r"added by a 2.0 \(calm:Calm\) and by b 1.0"):
        find_type("criterion", "calm").load()


def test_unknown_name_lists_a_name_added_by_two_packages_once(packages, calm_module) -> None:
    packages("alpha", "1.0", {"behavior": {"zen": "calm:Calm"}}, calm=calm_module)
    packages("beta", "1.0", {"behavior": {"zen": "calm:Calm"}})
    with pytest.raises(ValidationError) as raised:
        TypeAdapter(BehaviorName).validate_python("zzen")
    assert raised.value.errors()[0]["ctx"]["names"].split(", ").count("zen") == 1


def test_packages_cannot_redefine_shipped_names(packages, calm_module) -> None:
    packages("calm", "1.0", {"criterion": {"speed": "calm:Calm"}}, calm=calm_module)
    assert find_type("criterion", "speed").is_shipped
    assert [entry.name for entry in all_types("criterion")].count("speed") == 1


def test_advanced_components_are_entry_points_of_simscen_that_packages_cannot_redefine(packages, calm_module) -> None:
    packages("calm", "1.0", {"planner": {"medial_axis": "calm:Calm"}}, calm=calm_module)
    own, other = installed_types("planner")
    assert (own.distribution, own.is_shipped, own.problem) == ("simscen", True, "")
    assert find_type("planner", "medial_axis") == own
    assert own.load() is MedialAxisPlanner and installed_specs("planner") == {"medial_axis": MedialAxisPlanner}
    assert other.problem == "simscen ships a type with the same name, which takes precedence"
    assert plugin_types("planner") == (other,)
    assert "medial_axis" not in [entry.name for entry in built_in_types("planner")]


def test_unknown_groups_are_reported(packages, calm_module) -> None:
    packages("calm", "1.0", {"criteria": {"calm": "calm:Calm"}}, calm=calm_module)
    assert [entry.problem for entry in types_without_group()] == ["there is no group `simscen.criteria`"]


def test_output_of_a_module_during_import_goes_to_stderr(packages, capsys, calm_module) -> None:
    packages("calm", "1.0", {"criterion": {"calm": "calm:Calm"}}, calm=calm_module + "\nprint('hello')\n")
    find_type("criterion", "calm").load()
    assert capsys.readouterr() == ("", "hello\n")


@pytest.mark.parametrize(("group", "choice"), [("trigger", Trigger), ("fault", FaultEntry), ("sensor", Sensor)])
def test_modifiers_are_reserved_names(group: str, choice: type[Choice]) -> None:
    beside = choice.known_keys() - {entry.name for entry in built_in_types(group)}
    assert beside == set(GROUPS[group].reserved)


def test_packages_are_searched_only_for_unknown_names() -> None:
    code = (
        "import sys; from simscen.criteria.registry import AnyCriterion;"
        "AnyCriterion.model_validate({'collisions': {}}); print('simscen.spec.registry' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


@pytest.mark.parametrize(
    "text",
    [
        "[simscen.criterion]\nno equals sign\n",
        "\x00\xff",
        "[simscen.criterion]\n\xff",
        "plain words",
    ],
)
def test_damaged_installation_is_reported_and_hides_no_other(packages, calm_module, text: str) -> None:
    site = packages("calm", "1.0", {"criterion": {"calm": "calm:Calm"}}, calm=calm_module)
    packages("wreck", "2.0", {})
    (site / "wreck-2.0.dist-info" / "entry_points.txt").write_bytes(text.encode("latin-1"))
    assert find_type("criterion", "calm").load().__name__ == "Calm"
    output = [(stranger.distribution, stranger.problem.partition(":")[0]) for stranger in types_without_group()]
    assert output == ([("wreck", "its entry_points.txt is damaged")] if "simscen." in text else [])


def test_incomplete_installation_without_a_name_is_usable(packages, calm_module) -> None:
    site = packages("calm", "1.0", {"criterion": {"calm": "calm:Calm"}}, calm=calm_module)
    (site / "calm-1.0.dist-info" / "METADATA").unlink()
    (entry,) = installed_types("criterion")
    assert (entry.origin, entry.load().__name__) == ("an unnamed package", "Calm")


@pytest.mark.parametrize("kind", GROUPS)
def test_base_classes_are_exported_by_simscen_plugin(kind) -> None:
    assert GROUPS[kind].base.rpartition(":")[2] in simscen.plugin.__all__
