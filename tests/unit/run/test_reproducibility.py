"""Tests of the digests of a run and of its scenario, which depend on all files that the run reads."""

import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from PIL import Image

from simscen.cli.session.selection import Selection, load_selection
from simscen.run import reproducibility as module
from simscen.run.reproducibility import ScenarioDigests, scenario_digests

SCENARIO = """\
extends: base.yaml
world: hall.sdf
robot: {model: cart.robot.yaml, pose: {x: 1, y: 1}}
goals: [{pose: {x: 2, y: 1}}]
pass: [{keepout: {mask: judged.yaml}}, {speed: {mask: {file: calm.yaml, type: absolute, multiplier: 0.01}}}]
stack: {keepout_mask: closed.yaml, speed_mask: {file: slow.yaml}}
"""
BASE = "simscen: 1\npass: [{goals_reached: {}}]\n"
DEFAULTS = "time_limit: 30 s\n"
SDF = """\
<sdf version="1.9"><world name="hall">
  <include><uri>model://shelf</uri><pose>4 4 0 0 0 0</pose></include>
  <model name="crate"><static>true</static><pose>6 6 0 0 0 0</pose><link name="l"><collision name="c">
    <geometry><mesh><uri>crate.stl</uri></mesh></geometry></collision></link></model>
  <model name="hill"><static>true</static><pose>20 20 -5 0 0 0</pose><link name="l"><collision name="c">
    <geometry><heightmap><uri>hill.png</uri><size>4 4 1</size></heightmap></geometry></collision></link></model>
</world></sdf>
"""
SHELF = """\
<sdf version="1.9"><model name="shelf"><static>true</static><link name="l"><collision name="c">
  <geometry><box><size>1 1 1</size></box></geometry></collision></link></model></sdf>
"""
MODEL_CONFIG = '<model><name>shelf</name><sdf version="1.9">model.sdf</sdf></model>'
TRIANGLES = """\
solid crate
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 1 1
endloop
endfacet
endsolid
"""
ROBOT = """\
simscen: 1
name: cart
urdf: cart.xacro
drive: {type: differential, wheel_radius: 5 cm, wheel_separation: 0.25}
limits: {linear: 0.5, angular: 1, linear_acceleration: 1, angular_acceleration: 2}
sensors: {lidar: {lidar: {rate: 10 Hz}}, odom: {odometry: {}}}
"""
XACRO = """\
<robot name="cart" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:include filename="size.xacro"/>
  <link name="base_link">
    <inertial><mass value="5"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0 ${height}"/><geometry><box size="0.3 0.2 0.3"/></geometry></collision>
    <collision><origin xyz="0 0 0.5"/><geometry><mesh filename="mast.stl" scale="0.1 0.1 0.1"/></geometry></collision>
  </link>
  <link name="left"><inertial><mass value="1"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><cylinder radius="0.05" length="0.02"/></geometry></collision></link>
  <joint name="left_joint" type="continuous"><parent link="base_link"/><child link="left"/>
    <origin xyz="0 0.125 0.05" rpy="1.5708 0 0"/><axis xyz="0 0 1"/></joint>
  <link name="right"><inertial><mass value="1"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><cylinder radius="0.05" length="0.02"/></geometry></collision></link>
  <joint name="right_joint" type="continuous"><parent link="base_link"/><child link="right"/>
    <origin xyz="0 -0.125 0.05" rpy="1.5708 0 0"/><axis xyz="0 0 1"/></joint>
</robot>
"""
SIZE = """\
<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:property name="height" value="0.2"/></robot>
"""
MAP = "image: hall.pgm\nresolution: 0.5\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"
MASKS = ("judged", "calm", "closed", "slow")
FILES = {
    "p/a.scenario.yaml": SCENARIO + "map: hall.yaml\n",
    "p/base.yaml": BASE,
    "p/defaults.yaml": DEFAULTS,
    "p/hall.sdf": SDF,
    "p/crate.stl": TRIANGLES,
    "p/cart.robot.yaml": ROBOT,
    "p/cart.xacro": XACRO,
    "p/size.xacro": SIZE,
    "p/mast.stl": TRIANGLES,
    "p/hall.yaml": MAP,
    "p/hall.pgm": "P2 20 20 255\n" + "254 " * 400,
    **{f"p/{name}.yaml": MAP.replace("hall", name) for name in MASKS},
    **{f"p/{name}.pgm": "P2 20 20 255\n" + "0 " * 20 + "254 " * 380 for name in MASKS},
    "models/shelf/model.config": MODEL_CONFIG,
    "models/shelf/model.sdf": SHELF,
}
Digest = Callable[..., str]


def write_project(folder: Path) -> Path:
    """Write a scenario that reads a file of each kind that scenarios can refer to."""
    for name, text in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    Image.new("L", (3, 3), 100).save(folder / "p/hill.png")
    return folder


def digests(project: Path, *world_path: str, lenient: bool = False) -> ScenarioDigests:
    """Return the digests that `simscen run` computes."""
    folders = [project / folder for folder in world_path or ("models",)]
    file = project / "p/a.scenario.yaml"
    (loaded,), _ = load_selection([file], project / "p", folders, lenient, Selection())
    return scenario_digests(loaded)


def digest(project: Path, *world_path: str, lenient: bool = False) -> str:
    """Return the digest of a run."""
    return digests(project, *world_path, lenient=lenient).run


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the project, the same for all tests because digests contain paths."""
    return tmp_path_factory.mktemp("home")


@pytest.fixture(scope="module")
def unchanged(home: Path) -> ScenarioDigests:
    """The digests of the scenario without changes."""
    return digests(write_project(home))


@pytest.fixture
def project(home: Path, unchanged: ScenarioDigests) -> Path:
    """The folder of the scenario, without the changes of earlier tests."""
    shutil.rmtree(home)
    return write_project(home)


@pytest.fixture
def run_digest(project: Path) -> Digest:
    """Return the function `digest` for the project of this test."""
    return partial(digest, project)


@pytest.mark.sample(6)
@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("p/a.scenario.yaml", "x: 2", "x: 2.1"),
        ("p/base.yaml", "goals_reached: {}", "collisions: {max: 0}"),
        ("p/defaults.yaml", "30 s", "31 s"),
        ("p/hall.sdf", "6 6 0", "6 7 0"),
        ("models/shelf/model.sdf", "1 1 1", "1 1 2"),
        ("models/shelf/model.config", "<name>shelf", "<name>rack"),
        ("p/crate.stl", "1 0 0\nvertex", "2 0 0\nvertex"),
        ("p/cart.robot.yaml", "linear: 0.5", "linear: 0.6"),
        ("p/cart.xacro", "0.3 0.2 0.3", "0.4 0.2 0.3"),
        ("p/size.xacro", "0.2", "0.25"),
        ("p/mast.stl", "1 0 0\nvertex", "2 0 0\nvertex"),
        ("p/hall.yaml", "0.65", "0.66"),
        ("p/hall.pgm", "254 254 254", "254 0 254"),
        *((f"p/{name}.pgm", "254 254 254", "254 0 254") for name in MASKS),
    ],
)
def test_any_file_that_a_run_reads_changes_the_digest(
    project: Path, run_digest: Digest, unchanged: ScenarioDigests, file: str, old: str, new: str
) -> None:
    """Includes indirect includes: otherwise, `--resume` would keep the verdict of a scenario with a moved model."""
    text = (project / file).read_text()
    assert old in text
    (project / file).write_text(text.replace(old, new, 1))
    assert run_digest() != unchanged.run
    (project / file).write_text(text)
    assert run_digest() == unchanged.run


def test_a_heightmap_changes_the_digest(project: Path, run_digest: Digest, unchanged: ScenarioDigests) -> None:
    """SDF files refer to images, too, not only to meshes."""
    Image.new("L", (3, 3), 0).save(project / "p/hill.png")
    assert run_digest() != unchanged.run


def test_unused_file_does_not_change_the_digest(project: Path, run_digest: Digest, unchanged: ScenarioDigests) -> None:
    """Otherwise `--resume` would keep no verdicts."""
    (project / "p/notes.txt").write_text("hello")
    (project / "models/other").mkdir()
    assert run_digest() == unchanged.run


def test_order_of_the_world_path_changes_the_digest_if_it_selects_another_model(
    project: Path, run_digest: Digest, unchanged: ScenarioDigests
) -> None:
    """The model `shelf` is in both folders; the first folder counts."""
    (project / "mine/shelf").mkdir(parents=True)
    (project / "mine/shelf/model.config").write_text(MODEL_CONFIG)
    (project / "mine/shelf/model.sdf").write_text(SHELF.replace("1 1 1", "2 2 2"))
    assert run_digest("mine", "models") != run_digest("models", "mine")
    assert run_digest("models", "mine") == unchanged.run


def test_lenient_option_changes_the_digest(run_digest: Digest, unchanged: ScenarioDigests) -> None:
    """`--lenient` leaves out elements that simscen cannot use."""
    assert run_digest(lenient=True) != unchanged.run


def test_scenarios_of_one_world_list_all_its_files(project: Path, run_digest: Digest) -> None:
    """The second scenario lists them, too, although its world is already built."""
    (project / "p/b.scenario.yaml").write_text(FILES["p/a.scenario.yaml"])
    loaded, _ = load_selection([project / "p"], project / "p", [project / "models"], False, Selection())
    first, second = (scenario.read_files for scenario in loaded)
    assert first == second
    assert {"model.sdf", "crate.stl", "hill.png", "cart.xacro", "size.xacro", "mast.stl"} <= {f.name for f in first}


@pytest.mark.parametrize("function", ["software_versions", "cpu_flags", "arithmetic_fingerprints", "source_digest"])
def test_software_and_processor_change_the_digest(
    run_digest: Digest, unchanged: ScenarioDigests, monkeypatch: pytest.MonkeyPatch, function: str
) -> None:
    """Another release of Bullet, other vector instructions, or another simscen may change the last bits of a result."""
    monkeypatch.setattr(module, function, lambda: {"pybullet": "0"})
    assert run_digest() != unchanged.run


@pytest.mark.sample(4)
@pytest.mark.parametrize(
    ("file", "old", "new", "is_other_definition"),
    [
        ("p/a.scenario.yaml", "x: 2", "x: 2.1", True),
        ("p/base.yaml", "simscen: 1", "simscen: 1\nname: other", True),
        ("p/defaults.yaml", "30 s", "31 s", True),
        ("p/hall.sdf", "6 6 0", "6 7 0", True),
        ("models/shelf/model.sdf", "1 1 1", "1 1 2", True),
        ("p/crate.stl", "1 0 0\nvertex", "2 0 0\nvertex", True),
        ("p/cart.robot.yaml", "linear: 0.5", "linear: 0.6", True),
        ("p/cart.xacro", "0.3 0.2 0.3", "0.4 0.2 0.3", True),
        ("p/judged.pgm", "254 254 254", "254 0 254", True),
        ("p/a.scenario.yaml", "keepout_mask: closed.yaml, ", "", True),  # applies to every stack
        ("p/a.scenario.yaml", "stack: {", "stack: {controller: {type: dwb}, ", False),
        ("p/a.scenario.yaml", "goals:", "# a comment\ngoals:", False),
    ],
)
def test_definition_is_the_scenario_without_its_stack(
    project: Path, unchanged: ScenarioDigests, file: str, old: str, new: str, is_other_definition: bool
) -> None:
    text = (project / file).read_text()
    assert old in text
    (project / file).write_text(text.replace(old, new, 1))
    assert (digests(project).definition != unchanged.definition) == is_other_definition


def test_definition_does_not_depend_on_the_folder_of_the_project(tmp_path: Path, unchanged: ScenarioDigests) -> None:
    assert digests(write_project(tmp_path)).definition == unchanged.definition
