"""Tests of included SDF models."""

import os

import pytest

from simscen.core.errors import InvalidInput
from simscen.core.geometry.shapes import Box, Sphere
from simscen.worlds.sdf import load_sdf, model_tree

CRATE = (
    "<sdf version='{version}'><model name='crate'>{extra}<link name='a'><collision name='c'><geometry>{shape}"
    "</geometry></collision></link></model></sdf>"
)
BOX = "<box><size>1 1 1</size></box>"
BALL = "<sphere><radius>0.5</radius></sphere>"


def write_model(folder, name="crate", files=("model.sdf",), config=None, shape=BOX, extra="<static>1</static>"):
    model_folder = folder / name
    model_folder.mkdir(parents=True, exist_ok=True)
    for file in files:
        (model_folder / file).write_text(CRATE.format(version="1.6", shape=shape, extra=extra))
    if config is not None:
        (model_folder / "model.config").write_text(f"<model><name>{name}</name>{config}</model>")
    return model_folder


@pytest.fixture
def models(tmp_path):
    folder = tmp_path / "elsewhere" / "models"
    write_model(folder)
    return folder


def include(uri, content="", attributes=""):
    return f"<include {attributes}><uri>{uri}</uri>{content}</include>"


def test_model_uris_are_looked_up_in_the_search_folders_in_order(load, models, tmp_path):
    write_model(tmp_path / "other", shape=BALL)
    world = load(include("model://crate"), search=[models, tmp_path / "other"])
    assert world.solids[0].shape == Box((1, 1, 1))
    world = load(include("model://crate"), search=[tmp_path / "other", models])
    assert world.solids[0].shape == Sphere(0.5)


@pytest.mark.parametrize("uri", ["elsewhere/models/crate", "file://elsewhere/models/crate",
                                 "elsewhere/models/crate/model.sdf", "elsewhere/models/../models/crate"])  # fmt: skip
def test_relative_paths_are_relative_to_the_including_file(load, models, uri):
    assert len(load(include(uri)).solids) == 1


def test_absolute_paths_inside_the_root_are_read(load, models):
    assert len(load(include(f"file://{models}/crate")).solids) == 1


def test_an_include_overrides_name_pose_and_static(load, models):
    overrides = "<name>left</name><pose>1 2 3 0 0 0</pose>"
    (solid,) = load(include("model://crate", overrides), search=[models]).solids
    assert solid.name == "left::a::c"
    assert solid.pose.position == (1, 2, 3)
    (body,) = load(include("model://crate", overrides + "<static>false</static>"), search=[models]).bodies
    assert body.name == "left"


@pytest.mark.parametrize(
    ("name", "message"), [("", "has no name"), ("x" * 121, "longer than 120"), ("a\u202eb", "control")]
)
def test_new_name_of_an_include_is_validated(refuse, models, name, message):
    assert message in refuse(include("model://crate", f"<name>{name}</name>"), search=[models])[0].message


def test_include_without_a_pose_keeps_that_of_the_model(load, tmp_path):
    write_model(tmp_path / "m", extra="<static>1</static><pose>4 5 6 0 0 0</pose>")
    assert load(include("m/crate")).solids[0].pose.position == (4, 5, 6)


def test_pose_of_an_include_applies_to_its_placement_frame(load, tmp_path):
    write_model(tmp_path / "m", extra="<static>1</static><frame name='corner'><pose>1 1 0 0 0 0</pose></frame>")
    world = load(include("m/crate", "<pose>0 0 0 0 0 0</pose><placement_frame>corner</placement_frame>"))
    assert world.solids[0].pose.position == (-1, -1, 0)


def test_pose_of_an_include_may_be_relative_to_a_frame_of_its_parent(load, models):
    frame = "<frame name='f'><pose>10 0 0 0 0 0</pose></frame>"
    world = load(frame + include("model://crate", "<pose relative_to='f'>1 0 0 0 0 0</pose>"), search=[models])
    assert world.solids[0].pose.position == (11, 0, 0)


def test_model_included_in_a_static_model_is_static(load, tmp_path):
    write_model(tmp_path / "m", extra="")
    inner = include("m/crate", "<pose>1 0 0 0 0 0</pose>")
    world = load(f"<model name='shelf'><static>true</static><pose>0 2 0 0 0 0</pose>{inner}</model>")
    assert world.solids[0].name == "shelf::crate::a::c"
    assert world.solids[0].pose.position == (1, 2, 0)


def test_merged_include_exposes_its_names_and_takes_static_from_its_owner(load, tmp_path):
    write_model(tmp_path / "m", extra="<static>1</static>")
    ball = f"<collision name='c'><geometry>{BALL}</geometry></collision>"
    on_top = f"<link name='b'><pose relative_to='a'>0 0 1 0 0 0</pose>{ball}</link>"
    merged = include("m/crate", "<pose>3 0 0 0 0 0</pose>", "merge='true'")
    joint = "<joint name='j' type='fixed'><parent>a</parent><child>b</child></joint>"
    (body,) = load(f"<model name='cart'>{merged}{on_top}{joint}</model>").bodies
    assert (body.name, body.mass) == ("cart", 2.0)
    assert [solid.pose.position for solid in body.solids] == [(3, 0, 0), (3, 0, 1)]


def test_model_config_names_the_newest_version_that_is_read(load, tmp_path):
    config = "<sdf version='1.9'>old.sdf</sdf><sdf version='1.10'>new.sdf</sdf><sdf version='2.0'>future.sdf</sdf>"
    write_model(tmp_path / "m", files=("old.sdf", "future.sdf"), config=config)
    write_model(tmp_path / "m", files=("new.sdf",), shape=BALL)
    assert load(include("m/crate")).solids[0].shape == Sphere(0.5)


@pytest.mark.parametrize(("file", "config"), [("model.sdf", None), ("crate.sdf", "<sdf version='1.6'>crate.sdf</sdf>")])
def test_a_folder_with_a_model_comes_before_other_folders_with_its_name(load, tmp_path, file, config):
    (tmp_path / "crate" / "launch").mkdir(parents=True)
    write_model(tmp_path / "models", files=(file,), config=config)
    assert len(load(include("model://crate"), search=[tmp_path]).solids) == 1


def test_a_folder_without_a_model_is_refused(refuse, tmp_path):
    (tmp_path / "m").mkdir()
    assert "neither model.config nor model.sdf" in refuse(include("m"))[0].message


def test_sun_and_ground_plane_of_gazebo_need_no_files(load, models):
    world = load(include("model://sun") + include("model://ground_plane") + include("model://crate"), search=[models])
    assert len(world.solids) == 1
    assert not world.notes


def test_missing_model_lists_the_searched_folders(refuse, models):
    (problem,) = refuse(f"\n  {include('model://crates')}", search=[models])
    assert (problem.path, problem.line, problem.col) == ("shop.world", 3, 13)
    assert "model://crates: no such file or directory" in problem.message
    assert problem.hint == "looked in elsewhere/models; allow its folder with --world-path"


@pytest.mark.parametrize(("tag", "message"), [("poes", "did you mean <pose>?"), ("xacro:include", "expand it first")])
def test_unsupported_elements_of_an_include_are_refused(refuse, models, tag, message):
    text = include("model://crate", f"<{tag}>1 0 0 0 0 0</{tag}>")
    (problem,) = refuse(f"<sdf version='1.9' xmlns:xacro='x'><world name='w'>{text}</world></sdf>", search=[models])
    assert problem.hint.startswith(message)


@pytest.mark.parametrize(
    "change",
    [
        "<visual element_id='link::v' action='remove'/>",
        "<link element_id='link' action='modify'><sensor name='s' action='add'/></link>",
    ],
)
def test_params_that_change_only_looks_are_accepted(load, models, change):
    text = include("model://crate", f"<experimental:params>{change}</experimental:params>")
    world = load(f"<sdf version='1.9' xmlns:experimental='x'><world name='w'>{text}</world></sdf>", search=[models])
    assert world.solids or world.bodies


@pytest.mark.parametrize(
    "change",
    [
        "<link element_id='link' action='remove'/>",
        "<link element_id='link' action='modify'><pose>1 0 0 0 0 0</pose></link>",
        "<collision element_id='link::c' action='remove'/>",
    ],
)
def test_params_that_change_geometry_are_refused(refuse, models, change):
    text = include("model://crate", f"<experimental:params>{change}</experimental:params>")
    (problem,) = refuse(
        f"<sdf version='1.9' xmlns:experimental='x'><world name='w'>{text}</world></sdf>", search=[models]
    )
    assert problem.hint.startswith("expand it first")


def test_online_models_are_not_fetched(refuse):
    (problem,) = refuse(include("https://example.org/models/Coke"))
    assert "only model://, package://, file://, Fuel and relative paths are read" in problem.message
    (problem,) = refuse(include("https://fuel.gazebosim.org/1.0/OpenRobotics/models/Coke"))
    assert problem.message.endswith("models/Coke: no such file or directory")
    assert (
        problem.hint == "allow Fuel's cache with --world-path ~/.gz/fuel, or a folder that holds the downloaded model"
    )


def test_include_cycle_is_refused_with_its_chain(tmp_path, load, refuse):
    for name, other in (("a", "b"), ("b", "a")):
        write_model(tmp_path, name, extra=include(f"../{other}"))
    (problem,) = refuse(include("a"))
    assert problem.path == "b/model.sdf"
    assert "include cycle: a/model.sdf → b/model.sdf → a/model.sdf" in problem.message


def test_exponentially_nested_includes_are_refused(tmp_path, refuse, monkeypatch):
    monkeypatch.setattr(model_tree, "MAX_MODELS", 1000)
    for level in range(8):
        inner = "".join(include(f"../l{level + 1}", f"<name>n{k}</name>") for k in range(10))
        write_model(tmp_path, f"l{level}", extra=inner if level < 7 else "")
    assert any("more than 1000 models" in problem.message for problem in refuse(include("l0")))


def test_an_error_in_an_included_file_is_reported_in_that_file(tmp_path, refuse):
    write_model(tmp_path, "m", shape="<box><size>1 -1 1</size></box>")
    (problem,) = refuse(include("m"))
    assert (problem.path, problem.line) == ("m/model.sdf", 1)
    assert problem.message.startswith("model[crate]/link[a]/collision[c]/geometry/box/size: must be positive")


def test_a_broken_included_file_is_reported_with_its_line(tmp_path, refuse):
    write_model(tmp_path, "m")
    (tmp_path / "m" / "model.sdf").write_text("<sdf version='1.6'>\n<model name='x'>\n</link>")
    (problem,) = refuse(include("m"))
    assert (problem.path, problem.line) == ("m/model.sdf", 3)
    assert "not well-formed XML: mismatched tag" in problem.message


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("<sdf version='1.6'><world name='x'/></sdf>", "contains no model"),
        ("<robot name='r'/>", "this is a URDF, not an SDF"),
        ("<sdf version='1.13'><model name='x'/></sdf>", "SDF version 1.13 is not read"),
        ("<sdf><model name='x'/></sdf>", "SDF version none is not read"),
    ],
)
def test_only_sdf_models_are_included(tmp_path, refuse, content, message):
    (tmp_path / "m.sdf").write_text(content)
    assert message in refuse(include("m.sdf"))[0].message


class TestContainment:
    @pytest.fixture
    def outside(self, tmp_path_factory):
        folder = tmp_path_factory.mktemp("outside")
        write_model(folder, shape="<box><size>7 7 7</size></box>")
        return folder

    def test_relative_path_out_of_the_root_is_refused(self, refuse, outside):
        (problem,) = refuse(include(f"../{outside.name}/crate"))
        assert "outside the scenario root" in problem.message

    def test_absolute_path_out_of_the_root_is_refused_whether_or_not_it_exists(self, refuse, outside):
        for uri in (f"file://{outside}/crate", str(outside / "nothing"), "/etc/passwd"):
            assert "outside the scenario root" in refuse(include(uri))[0].message

    def test_symbolic_link_out_of_the_root_is_refused(self, refuse, outside, tmp_path):
        (tmp_path / "link").symlink_to(outside / "crate")
        assert "outside the scenario root" in refuse(include("link"))[0].message
        (tmp_path / "m").mkdir()
        (tmp_path / "m" / "model.sdf").symlink_to(outside / "crate" / "model.sdf")
        assert "outside the scenario root" in refuse(include("m"))[0].message

    def test_model_uris_out_of_the_root_are_refused(self, refuse, outside, tmp_path):
        (problem,) = refuse(include(f"model://../../{outside.name}/crate"), search=[tmp_path])
        assert "outside" in problem.message

    def test_folder_allowed_by_the_user_can_be_read(self, load, outside):
        assert len(load(include("model://crate"), search=[outside]).solids) == 1

    def test_world_file_outside_the_root_is_refused(self, outside, tmp_path):
        with pytest.raises(InvalidInput, match="outside the scenario root"):
            load_sdf(outside / "crate" / "model.sdf", root=tmp_path)

    def test_links_in_the_folder_that_the_user_named_are_followed(self, tmp_path):
        (tmp_path / "real").mkdir()
        write_model(tmp_path / "real")
        (tmp_path / "alias").symlink_to(tmp_path / "real")
        world = load_sdf(tmp_path / "alias" / "crate" / "model.sdf", root=tmp_path / "alias")
        assert len(world.solids) == 1

    def test_a_loop_of_symbolic_links_is_named(self, refuse, tmp_path):
        (tmp_path / "a").symlink_to(tmp_path / "b")
        (tmp_path / "b").symlink_to(tmp_path / "a")
        assert "symbolic link loop" in refuse(include("a"))[0].message

    def test_named_pipe_is_refused_without_waiting(self, refuse, tmp_path):
        os.mkfifo(tmp_path / "pipe.sdf")
        assert "not a regular file" in refuse(include("pipe.sdf"))[0].message

    def test_names_with_nul_and_very_long_names_are_refused(self, refuse):
        assert "not a usable path" in refuse(include("a" * 5000))[0].message
        assert "not a usable path" in refuse(include("a" * 300))[0].message
        assert "control character" in refuse(include("a\u202eb"))[0].message
        assert "not well-formed XML" in refuse(include("a\0b"))[0].message

    def test_an_unreadable_file_is_reported(self, refuse, tmp_path):
        write_model(tmp_path, "m")
        (tmp_path / "m" / "model.sdf").chmod(0)
        if os.access(tmp_path / "m" / "model.sdf", os.R_OK):
            pytest.skip("running as root")
        assert "permission denied" in refuse(include("m"))[0].message
