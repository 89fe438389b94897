"""Tests that a log of simscen gives the same verdicts when it is read like the log of a real robot."""

import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foreign_logs import CHUNKED, drive, write_mcap
from mcap import records
from mcap.writer import Writer

from simscen.core.errors import InvalidInput
from simscen.core.records.verdict import Status
from simscen.criteria.registry import AnyCriterion
from simscen.judge.evaluation import judge
from simscen.loading.scenario import load_scenario
from simscen.record.foreign.options import ForeignLogOptions
from simscen.record.foreign.raw_messages import is_simscen_log
from simscen.record.foreign.read import read_foreign_log
from simscen.record.log_reader import read_log
from simscen.record.mcap_reader import RecordReader, open_log
from simscen.run.preparation import prepare
from simscen.run.simulate import simulate

SCENARIO = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 4, y: 3}}]
pass: [{goals_reached: {}}]
"""
TRUTH = ForeignLogOptions(truth="/ground_truth/odom", tick_rate=240)


@pytest.fixture(scope="module")
def simscen_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a short run."""
    folder = tmp_path_factory.mktemp("own")
    (folder / "a.scenario.yaml").write_text(SCENARIO)
    simulate(prepare(load_scenario(folder / "a.scenario.yaml", folder)), 1, log=folder / "run.mcap")
    return folder / "run.mcap"


@pytest.fixture(scope="module")
def anonymous_log(simscen_log: Path) -> Path:
    """A log with the same messages, but without the metadata of simscen, written by the mcap library."""
    file = simscen_log.with_name("anonymous.mcap")
    with open_log(simscen_log) as source, file.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "other recorder")
        schemas, channels = {}, {}
        for record in RecordReader(source):
            match record:
                case records.Schema():
                    schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data)
                case records.Channel() if record.id not in channels:
                    channels[record.id] = writer.register_channel(record.topic, "cdr", schemas[record.schema_id])
                case records.Message():
                    writer.add_message(
                        channels[record.channel_id], record.log_time, record.data, record.publish_time, record.sequence
                    )
        writer.finish()
    return file


def test_signals_are_bit_identical(simscen_log: Path, anonymous_log: Path) -> None:
    """Headings may differ by rounding, because quaternions are normalized."""
    assert is_simscen_log(simscen_log) and not is_simscen_log(anonymous_log)
    trace, foreign_trace = read_log(simscen_log).trace, read_foreign_log(anonymous_log, TRUTH).trace
    for name in ("truth", "velocity", "belief", "odometry", "command"):
        expected, samples = getattr(trace, name), getattr(foreign_trace, name)
        np.testing.assert_array_equal(expected.ticks, samples.ticks, name)
        np.testing.assert_allclose(expected.values, samples.values, rtol=0, atol=1e-12, err_msg=name)
    np.testing.assert_array_equal(trace.scans, foreign_trace.scans)
    assert (trace.end, len(trace.plans)) == (foreign_trace.end, len(foreign_trace.plans))


@pytest.mark.parametrize(
    "criterion",
    [
        {"speed": {"max": 0.45}},
        {"speed": {"max": 5.0, "max_turn_rate": 0.2}},
        {"localization_error": {"max": 0.01, "rmse": 5.0, "max_yaw": 1.0}},
        {"path_length": {"max": 3.0}},
        {"always": {"signal": "turn_rate", "op": "<=", "value": 3.0}},
    ],
)
def test_verdicts_and_margins_are_equal(simscen_log: Path, anonymous_log: Path, criterion: dict[str, object]) -> None:
    entry = AnyCriterion.model_validate(criterion)
    log, foreign = read_log(simscen_log), read_foreign_log(anonymous_log, TRUTH)
    (verdict,) = judge([entry], log.trace, log.header.case)
    (foreign_verdict,) = judge([entry], foreign.trace, log.header.case, foreign.coverage)
    assert [finding.status for finding in verdict.findings] == [finding.status for finding in foreign_verdict.findings]
    assert [f.margin for f in verdict.findings] == pytest.approx([f.margin for f in foreign_verdict.findings], abs=1e-9)
    assert Status.INCONCLUSIVE not in {finding.status for finding in foreign_verdict.findings}


@pytest.mark.parametrize("options", [*CHUNKED.values(), {"use_chunking": False}])
def test_a_log_with_wrong_bytes_is_read_or_refused(tmp_path: Path, options: dict[str, Any]) -> None:
    rng, file = random.Random(7), tmp_path / "a.mcap"
    data = write_mcap(file, drive(2.0), **options).read_bytes()
    refused = 0
    for _ in range(150):
        damaged = bytearray(data)
        for _ in range(rng.choice((1, 3, 20))):
            damaged[rng.randrange(8, len(data))] = rng.randrange(256)
        file.write_bytes(damaged[: rng.choice((len(data), rng.randrange(8, len(data))))])
        is_simscen_log(file)
        try:
            read_foreign_log(file, ForeignLogOptions(truth="/mocap"))
        except InvalidInput as error:
            refused += 1
            assert error.problems[0].code in ("SC802", "SC804")
    assert refused > 30
