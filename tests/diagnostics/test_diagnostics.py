"""Tests of exact messages for invalid files: `<name>.scenario.yaml` and `<name>.txt`.

`SIMSCEN_UPDATE=1 pytest tests/diagnostics` writes the messages anew; read the difference before you keep it.
"""

import os
from pathlib import Path

import pytest

from simscen.cli.diagnostics import as_text
from tests.scenario_files import try_scenario

HERE = Path(__file__).parent
CASES = sorted(HERE.glob("*.scenario.yaml"))


@pytest.mark.parametrize("case", CASES, ids=lambda path: path.name.split(".")[0])
def test_message_states_the_problem_and_its_position(case: Path) -> None:
    problems = try_scenario(case, HERE)
    assert isinstance(problems, list), "the file is valid"
    expected = case.with_name(case.name.replace(".scenario.yaml", ".txt"))
    text = as_text(problems) + "\n"
    if os.environ.get("SIMSCEN_UPDATE"):
        expected.write_text(text, encoding="utf-8")
    assert text == expected.read_text(encoding="utf-8")


def test_every_message_file_has_a_case() -> None:
    assert {path.stem for path in HERE.glob("*.txt")} == {path.name.split(".")[0] for path in CASES}
