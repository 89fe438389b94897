from simscen.bench.speed.external_stack import ExternalStackCost
from simscen.cli.commands.bench import _external_lines


def test_the_cost_of_a_beat_is_told_beside_that_in_the_engine() -> None:
    assert (
        _external_lines(ExternalStackCost(2401, 400.0, 1000.0))[1]
        == "    1000 µs a beat; in the engine 400 µs (2.5 times)"
    )
