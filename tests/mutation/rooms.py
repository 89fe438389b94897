"""What is mutated, and which tests concern it."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
ROOMS = ("criteria", "judge", "triggers")
WHYS = [f"tests/unit/judge/why/test_{of}.py" for of in ("cause", "halted", "blocked", "struck", "astray", "meanwhile")]
ALL_TESTS = {
    "criteria": ["tests/unit/criteria", "tests/unit/judge"],
    "judge": ["tests/unit/judge", "tests/unit/criteria/test_promises.py"],
    "triggers": ["tests/unit/triggers", "tests/unit/run/test_firing.py"],
}
NEIGHBOURS: dict[str, list[str]] = {
    "metrics": ["tests/unit/judge/test_metrics.py"],
    "way": ["tests/unit/judge/test_metrics.py"],
    "pose": ["tests/unit/judge/test_metrics.py"],
    "result": ["tests/unit/judge/test_disturbances.py"],
    "resultdata": ["tests/unit/judge/test_result.py", "tests/unit/judge/test_disturbances.py"],
    "verdictdata": ["tests/unit/judge/test_result.py", "tests/unit/judge/test_resultdata.py"],
    "needs": ["tests/unit/judge/test_judge.py"],
    "wording": [],
    "suite": [],
    "disturbances": [],
    **dict.fromkeys(("cause", "things", "blocked", "halted", "struck", "astray", "meanwhile"), WHYS),
}
"""What else than its own tests concerns a module of judge: these, and not the whole room."""
EVERY_CRITERION = ["tests/unit/criteria/test_promises.py", "tests/unit/criteria/test_specs.py"]
CONDITIONS = ["golden", "always", "eventually", "until", "whenever"]
CONCERNED = {
    "criteria/localization_consistency": [
        ["golden", "localization_consistency"],
        ["tests/unit/criteria/test_smoothness_and_consistency.py", *EVERY_CRITERION],
    ],
    "criteria/condition": [["tests/unit/criteria/test_conditions.py"], CONDITIONS],
    "criteria/condition_words": [["tests/unit/criteria/test_condition_words.py"], CONDITIONS],
    "criteria/formula": [CONDITIONS, ["tests/unit/criteria/test_formula.py"]],
    "criteria/horizon": [["tests/unit/criteria/test_horizon.py"]],
    "criteria/monitor": [CONDITIONS, ["tests/unit/criteria/test_monitor.py"]],
    "criteria/nees": [["golden", "localization_consistency"], ["tests/unit/criteria/test_nees.py"]],
    "criteria/signal_places": [["tests/unit/criteria/test_signal_values.py"], CONDITIONS],
    "criteria/signal_table": [
        [f"tests/unit/criteria/test_{what}.py" for what in ("signal_table", "conditions", "temporal")]
    ],
    "criteria/signal_values": [["tests/unit/criteria/test_signal_values.py"], CONDITIONS],
    "criteria/signals": [["tests/unit/criteria/test_signals.py"], ["golden"]],
    "criteria/smooth": [
        ["tests/unit/criteria/test_smooth.py"],
        ["tests/unit/criteria/test_smoothness_and_consistency.py"],
    ],
    "criteria/temporal": [CONDITIONS, ["tests/unit/criteria/test_temporal.py"]],
}
"""Of what many others use: the tests of what it is, not of all that is made of it."""
IDLE = {"__init__.py"}
"""What decides nothing."""


def modules() -> list[Path]:
    """Every module that has something to decide."""
    files = [file for room in ROOMS for file in sorted((ROOT / "simscen" / room).rglob("*.py"))]
    return [file for file in files if file.name not in IDLE]


def module_name(file: Path) -> str:
    """simscen.criteria.speed"""
    return ".".join(file.relative_to(ROOT).with_suffix("").parts)


def tests_of(file: Path) -> list[list[str]]:
    """The tests to try, the likeliest to kill first: golden cases, its own, those of every criterion or of its room.

    A criterion with golden cases of its own is used by nothing else.
    """
    room, kind = file.relative_to(ROOT / "simscen").parts[0], file.stem
    if f"{room}/{kind}" in CONCERNED:
        return CONCERNED[f"{room}/{kind}"]
    found = sorted((ROOT / "tests/unit" / room).rglob(f"test_{kind}*.py"))
    own = [path.relative_to(ROOT).as_posix() for path in found]
    kinds = ["result", "error_code"] if kind == "result" else [kind]
    if room == "criteria" and (ROOT / f"tests/cases/{kind}.yaml").exists():
        return [*(["golden", of] for of in kinds), [*own, *EVERY_CRITERION]]
    if room == "judge" and kind in NEIGHBOURS:
        beside = [test for test in NEIGHBOURS[kind] if test not in own]
        return [tests for tests in (own, beside) if tests]
    golden = [["golden"]] if room in ("criteria", "judge") else []
    return [*golden, *([own] if own else []), ALL_TESTS[room]]
