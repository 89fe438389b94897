"""Fuzz targets: a folder in which exactly one file is damaged, and the function that loads it."""

import contextlib
import io
import random
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from mcap import records
from mutate import mutant

from simscen.cli.session.file_checks import FileChecker
from simscen.core.errors import InvalidInput, Problem
from simscen.judge.evaluation import judge
from simscen.loading.scenario_text import criteria_of_text
from simscen.record.log_reader import read_run
from simscen.record.log_recovery import recover
from simscen.record.mcap_reader import RecordReader
from simscen.record.mcap_writer import Channel, McapWriter
from simscen.record.topics import MessageType
from simscen.run.preparation import prepare

CORPUS = Path(__file__).parent / "corpus"
SCENARIO = """\
simscen: 1
world: {world}
robot: {{model: {robot}, pose: {{x: 1, y: 1}}}}
goals: [{{pose: {{x: 1.5, y: 1}}}}]
pass: [{{goals_reached: {{}}}}]
"""
ROBOT = """\
simscen: 1
name: cube
urdf: {urdf}
drive: {{type: omnidirectional}}
limits: {{linear: 0.5, angular: 1, linear_acceleration: 1, angular_acceleration: 2}}
sensors: {{lidar: {{lidar: {{rate: 10 Hz}}}}, odom: {{odometry: {{}}}}}}
"""
ROOM = "{simscen: 1, walls: [{points: [[0, 0], [2, 0], [2, 2], [0, 2], [0, 0]]}]}"
MESH_WORLD = """\
<sdf version="1.7"><world name="w"><model name="m"><static>true</static><link name="l">
<collision name="a"><pose>0 0 0.5 0 0 0</pose><geometry><box><size>0.1 0.1 1</size></box></geometry></collision>
<collision name="b"><pose>4 4 0.5 0 0 0</pose><geometry><box><size>0.1 0.1 1</size></box></geometry></collision>
<collision name="c"><pose>3 3 0 0 0 0</pose><geometry><mesh><uri>{file}</uri></mesh></geometry></collision>
</link></model></world></sdf>
"""
MAP = "image: {file}\nresolution: 0.05\norigin: [0, 0, 0]\n"


@dataclass
class Target:
    """Files to damage, by name, the texts of other files in their folder, and the function that reads them.

    `{file}` in a text is the name of the damaged file. `read` returns the problems that a user would see.
    """

    files: dict[str, bytes]
    other_files: dict[str, str]
    read: Callable[[Path], list[Problem]]
    damage: Callable[[list[bytes], random.Random], tuple[int, bytes]] = field(default=mutant)

    def build(self, folder: Path, rng: random.Random) -> Path:
        """Write a mutant and the files that it needs; return the path of the mutant."""
        names = list(self.files)
        index, data = self.damage(list(self.files.values()), rng)
        for name, text in self.other_files.items():
            (folder / name).write_text(text.replace("{file}", names[index]))
        for name in ("tent.stl", "room.pgm"):
            (folder / name).write_bytes(next(CORPUS.glob(f"*/{name}")).read_bytes())
        (folder / "room.yaml").write_text(MAP.format(file="room.pgm"))
        (folder / names[index]).write_bytes(data)
        return folder / names[index]


def read_scenario(mutated: Path) -> list[Problem]:
    """Return the problems that `validate` reports; prepare the run if it accepts the file."""
    folder = mutated.parent
    file = mutated if mutated.name.endswith(".scenario.yaml") else folder / "a.scenario.yaml"
    variations, problems = FileChecker(folder).check_scenario(file)
    for loaded in variations:
        prepare(loaded)
    return problems


def read_log(path: Path) -> list[Problem]:
    """Read a log like `judge` and `log recover`."""
    with contextlib.suppress(InvalidInput):
        recover(path)
    read = read_run(path)
    spec = criteria_of_text(read.header.scenario, str(path), {})
    verdicts = judge(spec.pass_, read.trace, read.header.case)
    assert isinstance(verdicts, tuple)
    return []


def damaged_log(corpus: list[bytes], rng: random.Random) -> tuple[int, bytes]:
    """Damage the bytes of 30 % of the logs, with wrong checksums; damage records of the others, with valid ones."""
    if rng.random() < 0.3:
        return mutant(corpus, rng)
    out = io.BytesIO()
    writer = McapWriter(out, "ros2", "simscen")
    kinds: dict[int, MessageType] = {}
    channels: dict[int, Channel] = {}
    rate = rng.choice((0.0005, 0.002, 0.02))

    def damaged(data: bytes) -> bytes:
        return mutant([data], rng)[1] if data and rng.random() < rate else data

    with contextlib.suppress(KeyError, ValueError, struct.error, OverflowError):  # such a mutant cannot be written
        for record in RecordReader(io.BytesIO(corpus[0])):
            match record:
                case records.Schema():
                    kinds[record.id] = MessageType(record.name, record.data.decode(), "")
                case records.Channel():
                    channels[record.id] = writer.add_channel(record.topic, kinds[record.schema_id], record.metadata)
                case records.Message():
                    channels[record.channel_id].write(record.log_time, damaged(record.data))
                case records.Attachment():
                    data = mutant([record.data], rng)[1] if rng.random() < 0.2 else record.data
                    writer.add_attachment(record.name, record.media_type, data)
                case records.Metadata():
                    values = {k: damaged(v.encode()).decode("utf-8", "replace") for k, v in record.metadata.items()}
                    writer.add_metadata(record.name, values)
        writer.finish()
    return 0, out.getvalue()


def _corpus(name: str) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((CORPUS / name).iterdir())}


def targets(log: bytes) -> dict[str, Target]:
    """Return all targets by name; `log` is the log of a short run."""
    world = {"a.scenario.yaml": SCENARIO.format(world="{file}", robot="turtlebot")}
    robot = {"a.scenario.yaml": SCENARIO.format(world=ROOM, robot="{file}")}
    urdf = {
        "a.scenario.yaml": SCENARIO.format(world=ROOM, robot="a.robot.yaml"),
        "a.robot.yaml": ROBOT.format(urdf="{file}"),
    }
    image = {"a.scenario.yaml": SCENARIO.format(world="a.yaml", robot="turtlebot"), "a.yaml": MAP}
    mesh = {"a.scenario.yaml": SCENARIO.format(world="a.sdf", robot="turtlebot"), "a.sdf": MESH_WORLD}
    return {
        "scenario": Target(_corpus("scenario"), {}, read_scenario),
        "world": Target(_corpus("world"), world, read_scenario),
        "robot": Target(_corpus("robot"), robot, read_scenario),
        "map": Target(_corpus("map"), world, read_scenario),
        "image": Target(_corpus("image"), image, read_scenario),
        "sdf": Target(_corpus("sdf"), world, read_scenario),
        "urdf": Target(_corpus("urdf"), urdf, read_scenario),
        "xacro": Target(_corpus("xacro"), urdf, read_scenario),
        "mesh": Target(_corpus("mesh"), mesh, read_scenario),
        "log": Target({"run.mcap": log}, {}, read_log, damaged_log),
    }


def check_problems(problems: list[Problem], mutated: Path) -> None:
    """Check that each problem has a message, a path, and a position inside the file."""
    for problem in problems:
        assert problem.message, problem
        assert problem.path, problem
        if problem.line and mutated.suffix != ".mcap" and Path(problem.path).name == mutated.name:
            text = mutated.read_bytes().decode("utf-8-sig", "replace").replace("\r\n", "\n").replace("\r", "\n")
            lines = text.split("\n")
            assert problem.line <= len(lines), f"line {problem.line} of {len(lines)}: {problem.message}"
            assert 0 <= problem.col <= len(lines[problem.line - 1]) + 1, f"{problem.place}: {problem.message}"
