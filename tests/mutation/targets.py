"""List the modules that are mutated, and the tests that check each of them."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("criteria", "judge", "triggers")
DIAGNOSIS = ["tests/unit/judge/diagnosis"]
ALL_TESTS = {
    "criteria": ["tests/unit/criteria", "tests/unit/judge"],
    "judge": ["tests/unit/judge", "tests/unit/criteria/test_every_criterion.py"],
    "triggers": ["tests/unit/triggers", "tests/unit/run/test_trigger_evaluation.py"],
}
EVERY_CRITERION = [
    "tests/unit/criteria/test_every_criterion.py",
    "tests/unit/criteria/test_specs.py",
    "tests/unit/judge/test_required_evidence.py",
]
TEMPORAL = ["golden", "always", "eventually", "until", "whenever"]
_STL, _SIGNALS, _METRICS = "tests/unit/criteria/stl", "tests/unit/criteria/trace_signals", "tests/unit/judge/metrics"
TESTS_OF_MODULE = {
    "criteria/clearance": [
        ["golden", "clearance"],
        ["golden", "personal_space"],
        [f"{_SIGNALS}/test_distances.py", *EVERY_CRITERION],
    ],
    "criteria/localization": [
        ["golden", "localization_error"],
        ["golden", "relocalized_within"],
        ["golden", "localization_consistency"],
        [f"tests/unit/criteria/test_{of}.py" for of in ("smoothness_and_consistency", "sparse_beliefs")],
        EVERY_CRITERION,
    ],
    "criteria/stopping": [
        ["golden", "stopped_within"],
        ["golden", "stuck"],
        ["tests/unit/criteria/test_stopped_within.py", *EVERY_CRITERION],
    ],
    "criteria/efficiency": [
        ["golden", "time_to_goal"],
        ["golden", "path_length"],
        ["tests/unit/criteria/test_path_length.py", *EVERY_CRITERION],
    ],
    "criteria/temporal": [
        TEMPORAL,
        [f"{_STL}/test_criterion.py", f"{_STL}/test_decision_horizon.py", *EVERY_CRITERION],
    ],
    "criteria/speed": [["golden", "speed"], ["tests/unit/criteria/test_masks.py", *EVERY_CRITERION]],
    "criteria/keepout": [
        ["golden", "keepout"],
        ["tests/unit/criteria/test_keepout.py", "tests/unit/criteria/test_masks.py", *EVERY_CRITERION],
    ],
    "criteria/event_counts": [["golden", "replans", "recoveries"], EVERY_CRITERION],
    "criteria/result": [
        ["golden", "result"],
        ["golden", "error_code"],
        ["golden", "no_false_success"],
        EVERY_CRITERION,
    ],
    "criteria/stl/condition": [[f"{_STL}/test_condition.py"], [f"{_STL}/test_decision_horizon.py"], TEMPORAL],
    **{
        f"criteria/stl/{of}": [TEMPORAL, [f"{_STL}/test_robustness.py", "tests/properties/test_three_valued.py"]]
        for of in ("evaluation", "robustness")
    },
    "criteria/stl/operators": [TEMPORAL, [f"{_STL}/test_operators.py"]],
    **{
        f"criteria/stl/{of}": [TEMPORAL, [f"{_STL}/test_criterion.py", f"{_STL}/test_description.py"]]
        for of in ("criterion", "description")
    },
    "criteria/trace_signals/distances": [
        [f"{_SIGNALS}/test_{of}.py" for of in ("distances", "readers", "motion_signals")],
        TEMPORAL,
        ["golden", "personal_space"],
    ],
    "criteria/trace_signals/catalog": [
        [f"{_SIGNALS}/test_catalog.py", f"{_STL}/test_condition.py", f"{_STL}/test_criterion.py"]
    ],
    **{
        f"criteria/trace_signals/{of}": [
            [f"{_SIGNALS}/test_readers.py", f"{_SIGNALS}/test_motion_signals.py"],
            TEMPORAL,
        ]
        for of in ("event_readers", "readers")
    },
    **{
        f"criteria/trace_signals/{of}": [[f"{_SIGNALS}/test_ground_truth.py", f"{_SIGNALS}/test_nees.py"], ["golden"]]
        for of in ("ground_truth", "estimation_errors")
    },
    "criteria/trace_signals/sparc_ldlj": [
        [f"{_SIGNALS}/test_sparc_ldlj.py"],
        ["tests/unit/criteria/test_smoothness_and_consistency.py"],
    ],
    "judge/run_result": [
        [f"tests/unit/judge/test_{of}.py" for of in ("run_result", "disturbances")],
    ],
    "judge/result_json": [[f"tests/unit/judge/test_{of}.py" for of in ("result_json", "run_result", "disturbances")]],
    "judge/evaluation": [
        [f"tests/unit/judge/test_{of}.py" for of in ("required_evidence", "required_evidence_of_signals", "evaluation")]
    ],
    "judge/study_json": [["tests/unit/judge/test_study.py"]],
    "judge/outcome": [[f"tests/unit/judge/test_{of}.py" for of in ("expected_failure", "evaluation")]],
    **{
        f"judge/{of}": [[f"tests/unit/judge/test_{of}.py"]]
        for of in ("disturbances", "finding_text", "pass_rate_claims", "several_robots", "significance", "study")
    },
    "judge/metrics/trajectory": [
        [f"{_METRICS}/test_path.py", f"{_METRICS}/test_pose_error.py"],
        [f"{_METRICS}/test_compute.py"],
    ],
    "judge/metrics/compute": [
        [f"{_METRICS}/test_{of}.py" for of in ("compute", "compute_edges", "people", "plugin_metrics")]
    ],
    **{f"judge/metrics/{of}": [[f"{_METRICS}/test_{of}.py"]] for of in ("session_summary", "comparison")},
    **{
        f"judge/{of}": [DIAGNOSIS]
        for of in ("blocked_path", "failure_causes", "goal_failure_causes", "movable_objects")
    },
}
"""Tests of single modules, in stages. The stage with all tests of the package follows."""
IGNORED_FILES = {"__init__.py"}


def modules() -> list[Path]:
    """Return all modules of the mutated packages."""
    files = [file for package in PACKAGES for file in sorted((ROOT / "simscen" / package).rglob("*.py"))]
    return [file for file in files if file.name not in IGNORED_FILES]


def module_name(file: Path) -> str:
    """Return the dotted name, such as simscen.criteria.speed."""
    return ".".join(file.relative_to(ROOT).with_suffix("").parts)


def tests_of(file: Path) -> list[list[str]]:
    """Return the tests to try, in stages: golden cases first, then the module's own, then those of its package.

    Later stages run only for mutants that survive the earlier ones.
    """
    path = file.relative_to(ROOT / "simscen").with_suffix("")
    package, kind = path.parts[0], file.stem
    if path.as_posix() in TESTS_OF_MODULE:
        return [*TESTS_OF_MODULE[path.as_posix()], ALL_TESTS[package]]
    found = sorted((ROOT / "tests/unit" / package).rglob(f"test_{kind}*.py"))
    own = [test.relative_to(ROOT).as_posix() for test in found]
    if package == "criteria" and (ROOT / f"tests/cases/{kind}.yaml").exists():
        return [["golden", kind], [*own, *EVERY_CRITERION]]
    golden = [["golden"]] if package in ("criteria", "judge") else []
    return [*golden, *([own] if own else []), ALL_TESTS[package]]
