"""What is mutated, and which tests concern it."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
ROOMS = ("criteria", "judge", "triggers")
ALL_TESTS = {
    "criteria": ["tests/unit/criteria", "tests/unit/judge", "tests/properties/test_verdicts.py"],
    "judge": ["tests/unit/judge", "tests/unit/criteria", "tests/properties/test_verdicts.py"],
    "triggers": ["tests/unit/triggers", "tests/unit/run/test_firing.py"],
}
IDLE = {"__init__.py", "sketch.py"}
"""What decides nothing: sketches make the traces of tests."""


def modules() -> list[Path]:
    """Every module that has something to decide."""
    files = [file for room in ROOMS for file in sorted((ROOT / "simscen" / room).glob("*.py"))]
    return [file for file in files if file.name not in IDLE]


def module_name(file: Path) -> str:
    """simscen.criteria.speed"""
    return ".".join(file.relative_to(ROOT).with_suffix("").parts)


def tests_of(file: Path) -> list[list[str]]:
    """The tests to try, the likeliest to kill first: its own, then all of its room."""
    room, kind = file.parent.name, file.stem
    own = [f"tests/unit/{room}/test_{kind}.py"]
    stages = []
    if (ROOT / f"tests/cases/{kind}.yaml").exists():
        stages.append(["golden", kind])
    elif room in ("criteria", "judge"):
        stages.append(["golden", ""])
    if (ROOT / own[0]).exists():
        stages.append(own)
    return [*stages, [test for test in ALL_TESTS[room] if (ROOT / test).exists()]]
