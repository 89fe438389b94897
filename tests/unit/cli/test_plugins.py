"""Tests of `simscen plugins`, and of the effect of broken packages on other commands."""

import json

import pytest

HELLO = '''
from simscen.core.records.verdict import Finding, Status
from simscen.criteria.base import Criterion
from simscen.spec.base import Spec


class Hello(Spec, Criterion):
    """It says hello. And goodbye.

    Twice.
    """

    def judge(self, trace, case):
        return []
'''


def test_no_installed_types_gives_a_message(simscen) -> None:
    result = simscen("plugins")
    assert (result.code, result.err) == (0, "")
    assert result.out == "no plug-ins: no other package has entry points in a group `simscen.…`\n"


def test_types_are_listed_with_package_and_first_sentence(simscen, yardwork) -> None:
    result = simscen("plugins")
    assert (result.code, result.err) == (0, "")
    assert result.out.splitlines()[:4] == [
        f"yardwork 1.2 ({yardwork})",
        "  ✓ criterion dwell (yardwork.dwell:Dwell)",
        "      The robot leaves a region again soon enough.",
        "  ✓ fault crosstalk (yardwork.crosstalk:Crosstalk)",
    ]


def test_types_are_printed_as_json(simscen, yardwork) -> None:
    plugins = json.loads(simscen("plugins", "--format", "json").out)["plugins"]
    assert [row["kind"] for row in plugins] == ["criterion", "fault", "trigger", "action", "sensor", "metric"]
    assert plugins[0] == {
        "kind": "criterion",
        "name": "dwell",
        "package": "yardwork",
        "version": "1.2",
        "folder": str(yardwork),
        "class": "yardwork.dwell:Dwell",
        "text": "The robot leaves a region again soon enough.",
        "broken": "",
        "hint": "",
    }


@pytest.mark.parametrize(
    ("kind", "name", "value", "reason"),
    [
        ("criterion", "hello", "nowhere:Hello", "ModuleNotFoundError: No module named 'nowhere'"),
        ("criterion", "speed", "hello:Hello", "simscen ships a type with the same name"),
        ("criteria", "hello", "hello:Hello", "there is no group `simscen.criteria`"),
        ("metric", "success", "hello:Hello", "simscen ships a type with the same name"),
    ],
)
def test_broken_type_states_the_reason_and_sets_the_exit_code(simscen, packages, kind, name, value, reason) -> None:
    packages("hello", "1.0", {kind: {name: value}}, hello=HELLO)
    result = simscen("plugins")
    assert result.code == 3
    assert f"  ✗ {kind} {name} ({value})" in result.out
    assert f"cannot be used: {reason}" in " ".join(result.out.split()) or reason in " ".join(result.out.split())


def test_broken_package_affects_only_files_that_use_it(simscen, packages, tmp_path) -> None:
    packages("hello", "1.0", {"criterion": {"hello": "hello:Hello"}}, hello="raise RuntimeError('no licence')")
    scenario = (tmp_path / "good.scenario.yaml").read_text()
    (tmp_path / "uses.scenario.yaml").write_text(scenario.replace("goals_reached: {}", "hello: {}"))
    assert simscen("validate", "good.scenario.yaml").code == 0
    assert simscen("schema").code == 0
    assert simscen("explain", "speed").code == 0
    explained = simscen("explain", "hello")
    assert explained.code == 2
    assert "criterion `hello` of hello 1.0 cannot be used: " in explained.err
    result = simscen("validate", ".")
    assert result.code == 2
    assert "uses.scenario.yaml:10:16: error[SC019]" in result.out + result.err
    output = "criterion `hello` of hello 1.0 cannot be used: `hello:Hello` cannot be loaded: RuntimeError: no licence"
    assert output in result.out + result.err
    assert "good.scenario.yaml" not in result.out + result.err


def test_exception_in_a_validator_is_a_problem_of_the_file(simscen, packages, tmp_path) -> None:
    horizon = "    @property\n    def horizon(self):\n        return self.nothing\n\n    def judge"
    packages("hello", "1.0", {"criterion": {"hello": "hello:Hello"}}, hello=HELLO.replace("    def judge", horizon))
    scenario = (tmp_path / "good.scenario.yaml").read_text()
    (tmp_path / "good.scenario.yaml").write_text(scenario.replace("goals_reached: {}", "hello: {}"))
    result = simscen("validate", "good.scenario.yaml")
    assert result.code == 2
    assert "good.scenario.yaml:10:16: error[SC019] criterion `hello` of hello 1.0 cannot be used: " in result.out


def test_scenario_folder_is_never_imported(simscen, packages, tmp_path, monkeypatch) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))  # as `python -m` does with the working directory
    packages.install(tmp_path, "hello", "1.0", {"criterion": {"hello": "hello:Hello"}}, hello="raise SystemExit('ran')")
    assert simscen("plugins").out.startswith("no plug-ins")
