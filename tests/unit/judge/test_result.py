import json
import math

import pytest

from simscen.core.result import Outcome
from simscen.criteria.criterion import AnyCriterion
from simscen.judge.judge import judge
from simscen.judge.result import run_result
from simscen.judge.resultdata import from_json, read_result, to_json
from simscen.judge.sketch import sketch, sketch_case

TRACE = {"seconds": 4, "truth": [[0, 0, 0], [4, 2, 0]], "clearance": 0.5, "events": [[1, "plan.made", "", {}]]}


def conclude(trace, *criteria):
    built, case = sketch(trace), sketch_case({})
    verdicts = judge([AnyCriterion.model_validate(words) for words in criteria], built, case)
    lines = tuple(range(10, 10 + len(criteria)))
    return run_result("a/b", "scenarios/a/b.scenario.yaml", 7, verdicts, built, case, lines=lines)


def test_a_result_survives_its_file(tmp_path):
    result = conclude(TRACE, {"clearance": {"min": 0.6}}, {"goals_reached": {}})
    path = tmp_path / "result.json"
    path.write_text(to_json(result), encoding="utf-8")
    assert read_result(path) == result


def test_the_file_says_what_happened_in_words_and_numbers():
    data = json.loads(to_json(conclude(TRACE, {"clearance": {"min": 0.6}})))
    (verdict,) = data["verdicts"]
    (finding,) = verdict["findings"]
    assert data["outcome"] == "failed"
    assert data["again"] == "simscen run scenarios/a/b.scenario.yaml --seed 7"
    assert data["events"] == {"plan.made": 1, "run.ended": 1}
    assert data["simulated_seconds"] == 4.0
    assert verdict["line"] == 10
    assert finding["message"] == "clearance: 0.50 m < 0.60 m, at t = 0.00 s, (0.00, 0.00)"
    assert finding["margin"] == pytest.approx(-0.1)


def test_the_same_run_gives_the_same_bytes():
    words = ({"clearance": {"min": 0.2}}, {"collisions": {}}, {"speed": {"max": 1.0}})
    assert to_json(conclude(TRACE, *words)) == to_json(conclude(TRACE, *words))


def test_numbers_that_json_lacks_become_null():
    text = to_json(conclude({**TRACE, "clearance": math.inf}, {"clearance": {"min": 0.2}}))
    assert "Infinity" not in text
    assert json.loads(text)["verdicts"][0]["findings"][0]["margin"] is None


def test_a_broken_signal_makes_the_run_an_error_even_when_no_criterion_looks_at_it():
    result = conclude({**TRACE, "truth": [[0, 0, 0], [2, math.nan, 0]]}, {"collisions": {}})
    assert result.outcome is Outcome.ERROR
    assert "not finite" in result.error.message


@pytest.mark.parametrize("text", ["{}", "[]", "3", '{"format": 99}', "nonsense"])
def test_something_else_is_refused(text):
    with pytest.raises(ValueError, match=r"not a result|format 99|Expecting"):
        from_json(text)
