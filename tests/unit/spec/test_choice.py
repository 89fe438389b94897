"""Tests of choices that installed packages extend."""

import pickle
from copy import deepcopy

import pytest
from pydantic import ValidationError

from simscen.criteria.registry import AnyCriterion
from simscen.model.stack import StackSpec
from simscen.spec.choice import with_installed_choices
from simscen.spec.registry import installed_specs


def test_name_of_an_installed_package_is_a_valid_choice(calm) -> None:
    entry = AnyCriterion.model_validate({"calm": {"max": "0.5 m/s"}, "severity": "warn"}, by_alias=True, by_name=False)
    assert isinstance(entry, AnyCriterion)
    assert (entry.kind, entry.severity, entry.chosen.max) == ("calm", "warn", 0.5)
    assert set(installed_specs("criterion")) == {"calm"}


def test_name_is_unknown_without_its_package() -> None:
    with pytest.raises(ValidationError) as output:
        AnyCriterion.model_validate({"calm": {}})
    assert "extra_forbidden" in {error["type"] for error in output.value.errors()}
    assert with_installed_choices(AnyCriterion) is AnyCriterion


@pytest.mark.parametrize(
    ("keys", "loc", "kind"),
    [
        ({"calm": {"max": -1}}, ("calm", "max"), "greater_than"),
        ({"calm": {"min": 1}}, ("calm", "min"), "extra_forbidden"),
        ({"calm": {}, "collisions": {}}, (), "value_error"),
        ({"calm": {}, "clam": {}}, ("clam",), "extra_forbidden"),
    ],
)
def test_error_in_an_installed_choice_has_its_location(calm, keys, loc, kind) -> None:
    with pytest.raises(ValidationError) as output:
        AnyCriterion.model_validate(keys)
    assert [(error["loc"], error["type"]) for error in output.value.errors()] == [(loc, kind)]


def test_broken_package_is_reported_at_the_key_that_uses_it(packages) -> None:
    packages("calm", "1.0", {"criterion": {"calm": "calm:Calm"}}, calm="import nowhere")
    assert AnyCriterion.model_validate({"collisions": {}}).kind == "collisions"
    with pytest.raises(ValidationError) as output:
        AnyCriterion.model_validate({"calm": {}})
    (error,) = output.value.errors()
    assert error["loc"] == ("calm",)
    assert error["msg"].startswith("criterion `calm` of calm 1.0 cannot be used: `calm:Calm` cannot be loaded: ")
    assert installed_specs("criterion") == {}


def test_installed_choice_can_be_copied_and_pickled(calm) -> None:
    entry = AnyCriterion.model_validate({"calm": {"max": 2.0}})
    for copy in (pickle.loads(pickle.dumps(entry)), deepcopy(entry), entry.model_copy()):
        assert copy == entry
        assert copy.chosen.max == 2.0


@pytest.mark.parametrize(
    ("kind", "choice", "bases"),
    [("criterion", AnyCriterion, "Calm(Spec, Criterion)"), ("planner", StackSpec, "Calm(PlannerSpec)")],
)
def test_exception_in_a_validator_of_a_package_is_reported_at_its_key(packages, kind, choice, bases) -> None:
    text = (
        "from typing import ClassVar, Literal\nfrom pydantic import model_validator\n"
        "from simscen.criteria.base import Criterion\nfrom simscen.model.planners import PlannerSpec\n"
        "from simscen.spec.base import Spec\n\n\n"
        f"class {bases}:\n    component: ClassVar[str] = 'calm:Device'\n    type: Literal['calm'] = 'calm'\n\n"
        "    @model_validator(mode='after')\n    def _checked(self):\n        return {}['nothing']\n\n"
        "    def judge(self, trace, case):\n        return []\n"
    )
    packages("calm", "1.0", {kind: {"calm": "calm:Calm"}}, calm=text)
    keys = {"calm": {}} if kind == "criterion" else {"planner": {"type": "calm"}}
    with pytest.raises(ValidationError) as output:
        choice.model_validate(keys, by_alias=True, by_name=False)
    (error,) = output.value.errors()
    assert error["loc"] == (("calm",) if kind == "criterion" else ("planner",))
    assert "its validation raises KeyError: 'nothing'" in error["msg"]
