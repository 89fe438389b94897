"""Tests of published SDF worlds: Fuel URLs, missing files, and distant objects."""

import pytest

from simscen.core.errors import InvalidInput

BOX = "<geometry><box><size>1 1 1</size></box></geometry>"
LINK = f"<link name='a'><collision name='c'>{BOX}</collision></link>"
CRATE = f"<sdf version='1.6'><model name='crate'><static>1</static>{LINK}</model></sdf>"
FUEL = "https://fuel.gazebosim.org/1.0/OpenRobotics/models"


def write_crate(folder):
    folder.mkdir(parents=True)
    (folder / "model.sdf").write_text(CRATE)


def include(uri, rest=""):
    return f"<include><uri>{uri}</uri>{rest}</include>"


def box(name, x, y=0.0, static=1):
    return f"<model name='{name}'><static>{static}</static><pose>{x} {y} 0 0 0 0</pose>{LINK}</model>"


@pytest.mark.parametrize(
    "uri",
    [
        f"{FUEL}/Sun",
        f"{FUEL}/Ground Plane",
        f"{FUEL}/Ground%20Plane/2",
        "https://fuel.ignitionrobotics.org/1.0/openrobotics/models/sun",
        "https://app.gazebosim.org/OpenRobotics/models/Ground Plane",
        "model:///sun",
        "model://ground_plane/",
    ],
)
def test_sun_and_ground_plane_are_known_at_any_url(load, uri):
    world = load(include(uri) + box("m", 0))
    assert [solid.name for solid in world.solids] == ["m::a::c"]


@pytest.mark.parametrize(
    ("layout", "uri"),
    [
        ("fuel.gazebosim.org/openrobotics/models/big crate/2", f"{FUEL}/Big Crate"),
        ("fuel.gazebosim.org/openrobotics/models/big crate/2", f"{FUEL}/Big%20Crate/2"),
        ("fuel.gazebosim.org/openrobotics/models/big crate/10", f"{FUEL}/Big Crate/tip"),
        ("Big Crate", f"{FUEL}/Big Crate"),
        ("big_crate", f"{FUEL}/Big Crate/3"),
        ("crate", "model:///crate"),
        ("crate", "file://models/crate"),
    ],
)
def test_model_is_found_in_an_allowed_folder_in_any_common_layout(load, tmp_path, layout, uri):
    write_crate(tmp_path / "models" / layout)
    assert len(load(include(uri), search=[tmp_path / "models"]).solids) == 1


def test_the_newest_cached_version_is_used(load, tmp_path):
    cache = tmp_path / "fuel" / "fuel.gazebosim.org" / "openrobotics" / "models" / "crate"
    write_crate(cache / "9")
    write_crate(cache / "10")
    (cache / "9" / "model.sdf").write_text("broken")
    assert len(load(include(f"{FUEL}/crate"), search=[tmp_path / "fuel"]).solids) == 1


@pytest.mark.parametrize("uri", [f"{FUEL}/../../secret", f"{FUEL}/..", f"{FUEL}/%2e%2e/files/../../x", "model:///../x"])
def test_no_url_leads_out_of_the_allowed_folders(refuse, tmp_path, uri):
    if not (tmp_path.parent / "secret").exists():
        write_crate(tmp_path.parent / "secret")
    (tmp_path / "models").mkdir()
    (problem,) = refuse(include(uri), search=[tmp_path / "models"])
    assert "no such file" in problem.message or "outside" in problem.message or "are read" in problem.message


@pytest.mark.parametrize(
    ("existing", "requested", "hint"),
    [
        ("meshes/Map.dae", "model://hall/meshes/map.dae", "did you mean `hall/meshes/Map.dae`?"),
        ("Meshes/map.DAE", "model://hall/meshes/map.dae", "did you mean `hall/Meshes/map.DAE`?"),
        ("meshes/map.dae", "model://hall/meshes/map.stl", "did you mean `hall/meshes/map.dae`?"),
        ("meshes/other.dae", "model://hall/meshes/map.dae", "looked in models; allow its folder with --world-path"),
    ],
)
def test_files_next_to_a_missing_mesh_are_named(refuse, tmp_path, existing, requested, hint):
    mesh = tmp_path / "models" / "hall" / existing
    mesh.parent.mkdir(parents=True)
    mesh.write_bytes(b"")
    shape = f"<collision name='c'><geometry><mesh><uri>{requested}</uri></mesh></geometry></collision>"
    (problem,) = refuse(f"<model name='m'><link name='a'>{shape}</link></model>", search=[tmp_path / "models"])
    assert problem.hint == hint


def test_names_behind_a_link_are_not_revealed(refuse, tmp_path):
    (tmp_path / "private").mkdir()
    (tmp_path / "private" / "Key.dae").write_bytes(b"")
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "hall").symlink_to(tmp_path / "private")
    (problem,) = refuse(include("model://hall/key.dae"), search=[tmp_path / "models"])
    assert "Key" not in problem.hint


def test_a_missing_model_is_reported_once_with_the_number_of_its_places(refuse):
    problems = refuse(
        "\n".join(include("model://crate", f"<name>c{k}</name>") for k in range(4)) + include("model://box")
    )
    assert [problem.message.split(": ", 1)[1] for problem in problems] == [
        "model://crate: no such file or directory (and at 3 more places)",
        "model://box: no such file or directory",
    ]


@pytest.mark.parametrize(
    "config", ["<model>", "<model><name>x</name></model>", "<model><sdf>gone.sdf</sdf></model>", "\x00"]
)
def test_broken_model_config_next_to_a_model_sdf_is_ignored(load, tmp_path, config):
    write_crate(tmp_path / "models" / "crate")
    (tmp_path / "models" / "crate" / "model.config").write_text(config)
    world = load(include("model://crate"), search=[tmp_path / "models"])
    assert len(world.solids) == 1
    assert world.notes[0].endswith("; model.sdf in the same folder is used")


def test_broken_model_config_without_a_model_sdf_is_an_error(refuse, tmp_path):
    (tmp_path / "models" / "crate").mkdir(parents=True)
    (tmp_path / "models" / "crate" / "model.config").write_text("<model><name>x</name></model>")
    (problem,) = refuse(include("model://crate"), search=[tmp_path / "models"])
    assert "no <sdf> of version 1.12 or older" in problem.message


@pytest.mark.parametrize("static", [0, 1])
@pytest.mark.parametrize(
    ("x", "message"), [(9_000, "'far' is 8998 m away from the median"), (20_000, "farther than 10000 m")]
)
def test_distant_object_is_left_out_with_a_note(load, x, message, static):
    world = load("".join(box(f"m{k}", k, k) for k in range(5)) + box("far", x, static=static))
    assert sorted({solid.name[:2] for solid in world.solids}) == ["m0", "m1", "m2", "m3", "m4"]
    assert world.bodies == ()
    assert world.bounds == (-0.5, -0.5, 4.5, 4.5)
    assert any(message in note for note in world.notes)


def test_large_world_without_gaps_keeps_all_its_solids(load):
    world = load("".join(box(f"m{k}", 300 * k) for k in range(20)))
    assert len(world.solids) == 20


def test_world_without_usable_geometry_is_an_error_even_if_lenient(load):
    with pytest.raises(InvalidInput, match="nothing is left of this world: 2 of its elements were skipped"):
        load(include("model://gone") + include("model://lost"), lenient=True)


def test_world_with_only_a_ground_plane_is_empty_with_a_note(load):
    world = load(include("model://ground_plane"))
    assert world.solids == ()
    assert any("only a ground plane" in note for note in world.notes)


def test_planes_larger_than_a_world_are_cut(load):
    plane = (
        '<model name="NAME"><static>1</static><pose>0 0 HEIGHT 0 0 0</pose><link name="l">'
        "<collision name='c'><geometry>"
        "<plane><normal>0 0 1</normal><size>100000 3</size></plane></geometry></collision></link></model>"
    )
    ground, shelf = (plane.replace("NAME", name).replace("HEIGHT", z) for name, z in (("ground", "0"), ("shelf", "2")))
    (slab,) = load(ground + shelf).solids
    assert slab.shape.size == (10_000.0, 3.0, 0.02)
