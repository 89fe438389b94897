import subprocess
import sys

import pytest

import simscen.plugin
from simscen.model.disturbances import FaultEntry
from simscen.model.robot import Sensor
from simscen.spec.choice import Choice
from simscen.spec.registry import GROUPS, BrokenPlugin, entries, find, installed, shipped, unknown_groups
from simscen.triggers.registry import Trigger


def test_shipped_types_come_first_in_the_order_of_their_list_and_installed_ones_by_name(packages, calm_module) -> None:
    packages("zeta", "2.0", {"criterion": {"zen": "calm:Calm"}}, calm=calm_module)
    packages("alpha", "1.0", {"criterion": {"calm": "calm:Calm"}})
    names = [entry.name for entry in entries("criterion")]
    own = [entry.name for entry in shipped("criterion")]
    assert own[:3] == ["goals_reached", "result", "error_code"]
    assert names == [*own, "calm", "zen"]
    assert [entry.origin for entry in installed("criterion")] == ["alpha 1.0", "zeta 2.0"]


def test_shipped_and_installed_types_are_loaded_through_the_same_door(packages, calm_module) -> None:
    packages("calm", "1.0", {"criterion": {"calm": "calm:Calm"}}, calm=calm_module)
    for name, wanted in (("calm", "Calm"), ("speed", "Speed")):
        entry = find("criterion", name)
        assert entry is not None
        assert entry.load().__name__ == wanted
    assert find("criterion", "clam") is None
    assert [find("criterion", name).shipped for name in ("calm", "speed")] == [False, True]


@pytest.mark.parametrize("group", sorted(GROUPS.keys() - {"metric"}))  # what simscen measures has no parameters
def test_everything_shipped_keeps_the_promise_of_its_group(group: str) -> None:
    for entry in shipped(group):
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
def test_what_cannot_be_used_says_why_and_whose_it_is(packages, group, name, value, why, calm_module) -> None:
    packages("calm-driving", "1.0", {group: {name: value}}, calm=calm_module)
    (entry,) = installed(group)
    with pytest.raises(BrokenPlugin) as broken:
        entry.load()
    assert why in str(broken.value)
    assert f"{group} `{name}` of calm-driving 1.0 cannot be used" in str(broken.value)


@pytest.mark.parametrize("text", ["raise RuntimeError('first line\\nsecond')", "import sys; sys.exit(3)", "def ("])
def test_a_module_that_fails_while_it_is_imported_is_a_broken_plugin(packages, text: str) -> None:
    packages("calm", "1.0", {"criterion": {"calm": "calm:Calm"}}, calm=text)
    with pytest.raises(BrokenPlugin, match="`calm:Calm` cannot be loaded: "):
        find("criterion", "calm").load()


def test_a_name_that_two_packages_add_is_usable_from_neither(packages, calm_module) -> None:
    packages("b", "1.0", {"criterion": {"calm": "calm:Calm"}}, calm=calm_module)
    packages("a", "2.0", {"criterion": {"calm": "calm:Calm"}})
    with pytest.raises(BrokenPlugin, match=r"added by a 2.0 \(calm:Calm\) and by b 1.0"):
        find("criterion", "calm").load()


def test_a_name_of_simscen_keeps_its_meaning_whoever_wants_it(packages, calm_module) -> None:
    packages("calm", "1.0", {"criterion": {"speed": "calm:Calm"}}, calm=calm_module)
    assert find("criterion", "speed").shipped
    assert [entry.name for entry in entries("criterion")].count("speed") == 1


def test_a_group_that_there_is_not_is_told(packages, calm_module) -> None:
    packages("calm", "1.0", {"criteria": {"calm": "calm:Calm"}}, calm=calm_module)
    assert [entry.flaw for entry in unknown_groups()] == ["there is no group `simscen.criteria`"]


def test_what_a_module_prints_while_it_is_imported_does_not_get_into_the_output(packages, capsys, calm_module) -> None:
    packages("calm", "1.0", {"criterion": {"calm": "calm:Calm"}}, calm=calm_module + "\nprint('hello')\n")
    find("criterion", "calm").load()
    assert capsys.readouterr() == ("", "hello\n")


@pytest.mark.parametrize(("group", "choice"), [("trigger", Trigger), ("fault", FaultEntry), ("sensor", Sensor)])
def test_what_stands_beside_a_choice_is_reserved(group: str, choice: type[Choice]) -> None:
    beside = choice.known_keys() - {entry.name for entry in shipped(group)}
    assert beside == set(GROUPS[group].reserved)


def test_nothing_is_looked_for_before_a_name_is_used_that_is_not_shipped() -> None:
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
def test_an_installation_that_is_damaged_is_told_and_hides_no_other(packages, calm_module, text: str) -> None:
    site = packages("calm", "1.0", {"criterion": {"calm": "calm:Calm"}}, calm=calm_module)
    packages("wreck", "2.0", {})
    (site / "wreck-2.0.dist-info" / "entry_points.txt").write_bytes(text.encode("latin-1"))
    assert find("criterion", "calm").load().__name__ == "Calm"
    told = [(stranger.distribution, stranger.flaw.partition(":")[0]) for stranger in unknown_groups()]
    assert told == ([("wreck", "its entry_points.txt is damaged")] if "simscen." in text else [])


def test_an_installation_that_broke_off_has_no_name_and_is_usable(packages, calm_module) -> None:
    site = packages("calm", "1.0", {"criterion": {"calm": "calm:Calm"}}, calm=calm_module)
    (site / "calm-1.0.dist-info" / "METADATA").unlink()
    (entry,) = installed("criterion")
    assert (entry.origin, entry.load().__name__) == ("an unnamed package", "Calm")


@pytest.mark.parametrize("kind", GROUPS)
def test_what_a_specification_must_be_is_to_be_had_where_authors_of_plugins_import(kind) -> None:
    assert GROUPS[kind].base.rpartition(":")[2] in simscen.plugin.__all__
