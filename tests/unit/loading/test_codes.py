"""Test that all error codes are documented."""

import re
from pathlib import Path

import simscen
from simscen.loading.codes import CODES

SOURCE = Path(simscen.__file__).parent


def test_every_code_in_the_source_is_explained() -> None:
    codes = {code for file in SOURCE.rglob("*.py") if file.name != "codes.py" for code in _codes(file)}
    assert codes - set(CODES) == set()


def _codes(file: Path) -> list[str]:
    return re.findall(r'"(SC\d{3})"', file.read_text(encoding="utf-8"))
