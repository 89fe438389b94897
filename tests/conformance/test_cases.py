"""Test that CASES.md and the conformance tests agree."""

import re
from pathlib import Path

HERE = Path(__file__).parent


def test_cases_md_and_tests_agree() -> None:
    listed = [int(number) for number in re.findall(r"^(\d+)\. ", (HERE / "CASES.md").read_text(), re.MULTILINE)]
    assert listed == list(range(1, len(listed) + 1))
    source = "\n".join(path.read_text() for path in HERE.glob("test_*.py"))
    names = [re.findall(r"\d+", name) for name in re.findall(r"def test_((?:\d+_(?:and_)?)+)", source)]
    parameters = re.findall(r'(?:id="|Case\(\s*)(\d+)[ ",]', source) + re.findall(r'ids=\["(\d+) ', source)
    tested = {int(number) for numbers in names for number in numbers} | {int(number) for number in parameters}
    assert sorted(set(listed) - tested) == [], "no test"
    assert sorted(tested - set(listed)) == [], "not in the list"
