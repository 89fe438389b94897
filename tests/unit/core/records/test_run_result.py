"""Tests of the names, folders, and order of runs."""

from itertools import product

from simscen.core.records.run_result import RunKey


def test_run_id_has_the_variation_in_brackets_as_in_pytest() -> None:
    assert RunKey("aisle", 1).test == "aisle"
    assert RunKey("a/aisle", 1, "speed=0.5").test == "a/aisle[speed=0.5]"


def test_no_two_runs_of_a_session_have_the_same_folder() -> None:
    """Names of variations can contain dashes, dots, and the names of stacks."""
    keys_with_stacks = [RunKey("a", 1, v, s) for v, s in product(("x", "x-b", "x.again"), ("a", "b-a", "a.again"))]
    keys_without_stack = [RunKey("a", 1, v) for v in ("x", "x-b", "again", "x.again")]
    for keys in (keys_with_stacks, [*keys_without_stack, *(key.repetition for key in keys_without_stack)]):
        assert len({key.folder for key in keys}) == len(keys)


def test_the_second_of_two_equal_runs_keeps_its_variation() -> None:
    key = RunKey("a", 1, "speed=0.5", "mine")
    assert key.repetition.folder == "seed-1-speed=0.5@mine.again"
    assert key.repetition.original == key
    assert RunKey("a", 1, "again").is_repetition is False


def test_runs_are_in_the_order_of_variations_then_seeds() -> None:
    keys = [RunKey("a", 2, "x"), RunKey("a", 1, "y"), RunKey("a", 1, "x")]
    assert sorted(keys) == [RunKey("a", 1, "x"), RunKey("a", 2, "x"), RunKey("a", 1, "y")]
