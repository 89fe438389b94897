"""Tests that a simscen log gives the same verdicts when it is read like a third-party log."""

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
def own(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the log of a short drive."""
    folder = tmp_path_factory.mktemp("own")
    (folder / "a.scenario.yaml").write_text(SCENARIO)
    simulate(prepare(load_scenario(folder / "a.scenario.yaml", folder)), 1, log=folder / "run.mcap")
    return folder / "run.mcap"


@pytest.fixture(scope="module")
def disguised(own: Path) -> Path:
    """Return a log with the same messages, without metadata, written by the mcap library."""
    file = own.with_name("disguised.mcap")
    with open_log(own) as source, file.open("wb") as stream:
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


def test_signals_are_bit_identical(own: Path, disguised: Path) -> None:
    """Headings may differ by rounding of normalized quaternions."""
    assert is_simscen_log(own) and not is_simscen_log(disguised)
    ours, theirs = read_log(own).trace, read_foreign_log(disguised, TRUTH).trace
    for name in ("truth", "velocity", "belief", "odometry", "command"):
        mine, its = getattr(ours, name), getattr(theirs, name)
        np.testing.assert_array_equal(mine.ticks, its.ticks, name)
        np.testing.assert_allclose(mine.values, its.values, rtol=0, atol=1e-12, err_msg=name)
    np.testing.assert_array_equal(ours.scans, theirs.scans)
    assert (ours.end, len(ours.plans)) == (theirs.end, len(theirs.plans))


@pytest.mark.parametrize(
    "text",
    [
        {"speed": {"max": 0.45}},
        {"speed": {"max": 5.0, "max_turn_rate": 0.2}},
        {"localization_error": {"max": 0.01, "rmse": 5.0, "max_yaw": 1.0}},
        {"path_length": {"max": 3.0}},
        {"always": {"signal": "turn_rate", "op": "<=", "value": 3.0}},
    ],
)
def test_verdicts_and_margins_are_equal(own: Path, disguised: Path, text: dict[str, object]) -> None:
    entry = AnyCriterion.model_validate(text)
    log, foreign = read_log(own), read_foreign_log(disguised, TRUTH)
    (mine,) = judge([entry], log.trace, log.header.case)
    (its,) = judge([entry], foreign.trace, log.header.case, foreign.coverage)
    assert [finding.status for finding in mine.findings] == [finding.status for finding in its.findings]
    assert [f.margin for f in mine.findings] == pytest.approx([f.margin for f in its.findings], abs=1e-9)
    assert Status.INCONCLUSIVE not in {finding.status for finding in its.findings}


@pytest.mark.parametrize("options", [*CHUNKED.values(), {"use_chunking": False}])
def test_a_log_with_wrong_bytes_is_read_or_refused(tmp_path: Path, options: dict[str, Any]) -> None:
    rng, file = random.Random(7), tmp_path / "a.mcap"
    data = write_mcap(file, drive(2.0), **options).read_bytes()
    refused = 0
    for _ in range(150):
        spoilt = bytearray(data)
        for _ in range(rng.choice((1, 3, 20))):
            spoilt[rng.randrange(8, len(data))] = rng.randrange(256)
        file.write_bytes(spoilt[: rng.choice((len(data), rng.randrange(8, len(data))))])
        is_simscen_log(file)
        try:
            read_foreign_log(file, ForeignLogOptions(truth="/mocap"))
        except InvalidInput as error:
            refused += 1
            assert error.problems[0].code in ("SC802", "SC804")
    assert refused > 30
