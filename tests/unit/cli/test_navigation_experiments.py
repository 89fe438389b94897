"""Tests of the groups of experiments of `simscen bench nav`."""

from pathlib import Path

import pytest

from simscen.cli.benchmarks.navigation_experiments import Sizes, experiment_groups

PROJECT = Path(__file__).parents[3]
QUICK_GROUPS = (
    "generated fields",
    "narrow fields",
    "dynamic fields",
    "ramps",
    "two robots",
    "corner cases",
    "localization",
)
AVAILABLE_GROUPS = ("BARN", "random goals", "degraded sensing", "tb3_sandbox", *QUICK_GROUPS)


def test_experiment_groups_are_listed_in_order(tmp_path: Path) -> None:
    assert {group.name for group in experiment_groups(None, None, PROJECT, tmp_path, Sizes())} == set(AVAILABLE_GROUPS)


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", QUICK_GROUPS)
def test_group_lists_the_names_of_its_experiments(tmp_path: Path, name: str) -> None:
    small = Sizes(seeds=1, fields=2, dynamic=1, goals=1, lost=1)
    (group,) = (group for group in experiment_groups(None, None, PROJECT, tmp_path, small) if group.name == name)
    assert [experiment.name for experiment in group.write_experiments()] == (list(group.other_names) or [name])


@pytest.mark.slow
def test_first_number_changes_drives_but_not_names(tmp_path: Path) -> None:
    def names(first: int) -> list[str]:
        small = Sizes(first, seeds=1, fields=2, dynamic=1, goals=1, lost=1)
        return [
            f"{experiment.name}: {drive.file.stem} {list(drive.seeds)}"
            for group in experiment_groups(None, None, PROJECT, tmp_path / str(first), small)
            if group.name in ("narrow fields", "dynamic fields", "ramps", "two robots", "localization", "corner cases")
            for experiment in group.write_experiments()
            for drive in experiment.drives
        ]

    first, later = names(1), names(400)
    assert len(first) == len(later)
    assert not set(first) & set(later)
