from simscen.bench.speed.run_overhead import ExternalStackCost
from simscen.cli.commands.bench import _external_lines


def test_cost_of_a_cycle_is_printed_with_the_cost_in_process() -> None:
    assert (
        _external_lines(ExternalStackCost(2401, 400.0, 1000.0))[1]
        == "    1000 µs of wall time per cycle; in process 400 µs (2.5 times)"
    )
