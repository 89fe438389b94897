"""Tests of COLLADA, STL, and OBJ meshes."""

import struct
import tracemalloc
import warnings

import numpy as np
import pytest

from simscen.core.errors import InvalidInput
from simscen.worlds.sdf.mesh_files import UnusableMesh, read_parts
from simscen.worlds.sdf.meshes import read_mesh

DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
 <asset><created>2020-01-01T00:00:00</created><modified>2020-01-01T00:00:00</modified>{unit}<up_axis>{up}</up_axis></asset>
 <library_geometries>{geometries}</library_geometries>
 <library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>
 <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>"""
GEOMETRY = """<geometry id="{id}" name="{id}"><mesh>
 <source id="{id}p"><float_array id="{id}a" count="{count}">{values}</float_array><technique_common>
  <accessor source="#{id}a" count="{vertices}" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
  <param name="Z" type="float"/></accessor></technique_common></source>
 <vertices id="{id}v"><input semantic="POSITION" source="#{id}p"/></vertices>
 {primitive}</mesh></geometry>"""
TRIANGLES = """<triangles count="1"><input semantic="VERTEX" source="#{id}v" offset="0"/><p>0 1 2</p></triangles>"""
QUAD = """<polylist count="1"><input semantic="VERTEX" source="#{id}v" offset="0"/><vcount>4</vcount>
 <p>0 1 2 3</p></polylist>"""
NODE = """<node id="{id}n" name="{name}">{transform}<instance_geometry url="#{id}"/>{inner}</node>"""

INVALID_MATRIX = "<matrix>INF NaN NaN -2938.633 NaN INF NaN 0 NaN NaN INF 0 0 0 0 1</matrix>"
"""Matrix that SketchUp writes for its last view."""


def geometry(name, points=((0, 0, 0), (1, 0, 0), (0, 1, 0)), primitive=TRIANGLES):
    values = " ".join(str(part) for point in points for part in point)
    return GEOMETRY.format(
        id=name, count=3 * len(points), vertices=len(points), values=values, primitive=primitive.format(id=name)
    )


def node(name, geometry_id="g", transform="", inner=""):
    return NODE.format(id=geometry_id, name=name, transform=transform, inner=inner)


def dae(geometries=None, nodes=None, unit='<unit meter="1"/>', up="Z_UP"):
    return DAE.format(geometries=geometries or geometry("g"), nodes=nodes or node("part"), unit=unit, up=up)


def world(uri, extra=""):
    return (
        "<model name='m'><static>1</static><link name='a'><collision name='c'><geometry>\n"
        f"<mesh><uri>{uri}</uri>{extra}</mesh></geometry></collision></link></model>"
    )


@pytest.fixture
def mesh(load, tmp_path):
    """Return a function that loads a world with a mesh file and returns its mesh."""

    def _mesh(content, extra="", name="x.dae"):
        (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        return load(world(name, extra)).solids[0].shape

    return _mesh


@pytest.fixture
def broken(refuse, tmp_path):
    """Return a function that loads a world with an invalid mesh file and returns the problem."""

    def _broken(content, extra="", name="x.dae"):
        (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        (problem,) = refuse(world(name, extra))
        assert problem.line == 3
        return problem

    return _broken


def corners(mesh):
    """Return the corners of the first triangle."""
    return mesh.vertices[mesh.faces[0]]


class TestCollada:
    def test_unit_scales_and_up_axis_is_ignored(self, mesh):
        shape = mesh(dae(geometry("g", [(0, 0, 0), (100, 0, 0), (0, 0, 50)]), unit='<unit meter="0.01"/>', up="Y_UP"))
        np.testing.assert_allclose(corners(shape), [(0, 0, 0), (1, 0, 0), (0, 0, 0.5)], atol=1e-12)

    def test_a_missing_unit_is_a_meter(self, mesh):
        np.testing.assert_allclose(corners(mesh(dae(unit="")))[1], (1, 0, 0))

    def test_node_transforms_apply_to_their_geometry(self, mesh):
        inner = node("inner", transform="<translate>0 0 3</translate>")
        outer = f"<node><rotate>0 0 1 90</rotate><translate>5 0 0</translate>{inner}</node>"
        np.testing.assert_allclose(corners(mesh(dae(nodes=outer)))[1], (0, 6, 3), atol=1e-6)

    def test_invalid_matrix_of_a_node_without_geometry_is_ignored(self, mesh):
        empty = f"<node id='camera'>{INVALID_MATRIX}<node>{INVALID_MATRIX}</node></node>"
        shape = mesh(dae(nodes=empty + node("part", inner=empty)))
        np.testing.assert_allclose(corners(shape)[1], (1, 0, 0))

    def test_invalid_matrix_above_geometry_is_an_error(self, broken):
        nodes = f"<node>{INVALID_MATRIX}{node('part')}</node>"
        assert "is not a finite number" in broken(dae(nodes=nodes)).message

    def test_polygons_are_cut_into_triangles(self, mesh):
        shape = mesh(dae(geometry("g", [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)], QUAD)))
        a, b, c = (shape.vertices[shape.faces[:, k]] for k in range(3))
        assert np.cross(b - a, c - a)[:, 2].sum() / 2 == pytest.approx(2)

    def test_the_scale_of_the_world_applies_last(self, mesh):
        np.testing.assert_allclose(corners(mesh(dae(), "<scale>2 3 4</scale>")), [(0, 0, 0), (2, 0, 0), (0, 3, 0)])

    def test_a_mirrored_mesh_still_faces_outwards(self, mesh):
        a, b, c = corners(mesh(dae(), "<scale>-1 1 1</scale>"))
        assert np.cross(b - a, c - a)[2] > 0
        a, b, c = corners(mesh(dae(nodes=node("part", transform="<scale>1 1 -1</scale>"))))
        assert np.cross(b - a, c - a)[2] < 0

    def test_a_submesh_is_chosen_by_the_name_of_its_node_and_centered(self, mesh):
        nodes = node("left") + node("right", "h")
        both = geometry("g") + geometry("h", [(10, 0, 0), (14, 0, 0), (10, 2, 0)])
        chosen = mesh(dae(both, nodes), "<submesh><name>right</name></submesh>")
        assert chosen.vertices[:, 0].min() == 10
        centered = mesh(dae(both, nodes), "<submesh><name>right</name><center>true</center></submesh>")
        np.testing.assert_allclose(centered.vertices.min(axis=0), (-2, -1, 0))
        assert len(mesh(dae(both, nodes)).faces) == 2

    def test_unknown_submesh_is_refused_with_the_existing_names(self, broken):
        problem = broken(dae(), "<submesh><name>door</name></submesh>")
        assert "no submesh 'door' in x.dae" in problem.message
        assert problem.hint == "it has part"

    def test_a_doctype_is_refused(self, broken):
        text = dae().replace("<COLLADA", '<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]>\n<COLLADA', 1)
        assert "DOCTYPE not allowed" in broken(text).message

    @pytest.mark.parametrize("content", ["", "<COLLADA/>", "not XML", dae()[:900], dae().replace("0 1 2", "0 1 9")])
    def test_broken_files_are_refused(self, broken, content):
        assert broken(content).message.startswith("world[w]/model[m]/link[a]/collision[c]/geometry/mesh/uri: x.dae: ")

    def test_unreadable_part_of_a_mesh_is_an_error(self, broken):
        both = geometry("g") + geometry("h", primitive=TRIANGLES.replace("triangles", "tristrips"))
        assert "<tristrips> is not read" in broken(dae(both, node("a") + node("b", "h"))).message
        assert "its geometry 'h' is missing" in broken(dae(nodes=node("a") + node("b", "h"))).message

    def test_missing_materials_are_ignored(self, mesh):
        material = "<technique_common><instance_material symbol='s' target='#gone'/></technique_common>"
        bound = f"<bind_material>{material}</bind_material>"
        nodes = node("a").replace('url="#g"/>', f'url="#g">{bound}</instance_geometry>')
        assert len(mesh(dae(nodes=nodes)).faces) == 1

    def test_instantiated_node_keeps_its_name(self):
        library = f"<library_nodes>{node('wheel')}</library_nodes><library_visual_scenes>"
        instance = '<node name="root"><instance_node url="#gn"/></node>'
        text = dae(nodes=instance).replace("<library_visual_scenes>", library)
        assert [part.names[0] for part in read_parts(text.encode(), ".dae")] == ["wheel"]

    def test_exponentially_nested_nodes_are_refused(self):
        levels = "".join(
            f'<node id="l{k}"><instance_node url="#l{k + 1}"/><instance_node url="#l{k + 1}"/></node>'
            for k in range(20)
        )
        library = f'<library_nodes><node id="l20"/>{levels}</library_nodes><library_visual_scenes>'
        text = dae(nodes='<node><instance_node url="#l0"/></node>').replace("<library_visual_scenes>", library)
        with pytest.raises(UnusableMesh):
            read_parts(text.encode(), ".dae")


def stl(count, triangles):
    """Return a binary STL file of equal triangles, whose header says `count`."""
    body = b"".join(struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0) for _ in range(triangles))
    return b"binary".ljust(80, b"\0") + struct.pack("<I", count) + body


class TestStl:
    def test_binary_files_are_read(self, mesh):
        shape = mesh(stl(1, 1), name="x.stl")
        np.testing.assert_allclose(corners(shape), [(0, 0, 0), (1, 0, 0), (0, 1, 0)])

    @pytest.mark.parametrize("prefix", ["", "\n  ", "\ufeff"])
    @pytest.mark.parametrize("write", [str, str.upper])
    def test_text_files_are_read(self, mesh, prefix, write):
        loop = "outer loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 0 1 0\nendloop\n"
        text = prefix + write(f"solid x\nfacet normal 0 0 1\n{loop}endfacet\nendsolid x\n")
        np.testing.assert_allclose(
            sorted(map(tuple, corners(mesh(text, name="x.STL")))), [(0, 0, 0), (0, 1, 0), (2, 0, 0)]
        )

    @pytest.mark.parametrize(("claimed", "held"), [(1000, 2), (1, 2), (4_000_000_000, 1)])
    def test_a_false_count_is_refused(self, broken, claimed, held):
        message = f"STL header says {claimed} triangles, file holds {held}"
        assert message in broken(stl(claimed, held), name="x.stl").message

    def test_empty_file_is_refused(self, broken):
        assert "has no triangles" in broken(stl(0, 0), name="x.stl").message
        assert "too short" in broken(b"solid", name="x.stl").message

    def test_more_than_a_million_triangles_are_refused(self):
        with pytest.raises(UnusableMesh, match="more than 1000000 triangles"):
            read_parts(stl(1_000_001, 1)[:84] + bytes(50 * 1_000_001), ".stl")

    def test_nan_coordinates_are_refused(self, broken):
        content = stl(1, 1).replace(struct.pack("<f", 1.0), struct.pack("<f", float("nan")))
        assert "not a finite number" in broken(content, name="x.stl").message


OBJ = (
    "mtllib ../../secret.mtl\no left\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no right\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf 4 5 6\n"
)


class TestObj:
    def test_all_objects_are_read_without_materials(self, mesh):
        shape = mesh(OBJ, name="x.obj")
        assert len(shape.faces) == 2
        assert shape.vertices[:, 0].max() == 6

    def test_a_submesh_is_an_object(self, mesh):
        shape = mesh(OBJ, "<submesh><name>right</name></submesh>", name="x.obj")
        assert (len(shape.faces), shape.vertices[:, 0].min()) == (1, 5)

    @pytest.mark.parametrize("vertex", ["v 0 0", "v 0", "v"])
    def test_vertices_without_three_coordinates_are_refused(self, broken, vertex):
        plane = "\n".join([vertex, vertex.replace("0", "1"), vertex.replace("0", "2"), "f 1 2 3", ""])
        assert "mesh" in broken(plane, name="x.obj").message

    def test_indices_out_of_range_are_refused(self, broken):
        broken(OBJ.replace("f 1 2 3", "f 1 2 300"), name="x.obj")


def test_other_formats_are_refused(broken):
    assert ".ply meshes are not read, only DAE, STL and OBJ" in broken("ply", name="x.ply").message


def test_a_scale_of_zero_is_refused(broken):
    assert "a scale of zero" in broken(dae(), "<scale>1 0 1</scale>").message


def test_a_mesh_beyond_10_km_is_refused(broken):
    assert "reaches farther than" in broken(dae(), "<scale>1e5 1 1</scale>").message


def test_mesh_file_beyond_64_mib_is_refused_without_being_read(refuse, tmp_path):
    with (tmp_path / "x.stl").open("wb") as file:
        file.truncate(200 * 2**20)
    tracemalloc.start()
    assert "larger than 64 MiB" in refuse(world("x.stl"))[0].message
    assert tracemalloc.get_traced_memory()[1] < 2**20
    tracemalloc.stop()


def test_a_folder_as_mesh_is_refused(refuse, tmp_path):
    (tmp_path / "x.dae").mkdir()
    assert "not a regular file" in refuse(world("x.dae"))[0].message


def test_equal_requests_share_one_immutable_mesh(load, tmp_path):
    (tmp_path / "x.dae").write_text(dae())
    solids = load(world("x.dae") + world("x.dae").replace("'m'", "'n'")).solids
    assert solids[0].shape is solids[1].shape
    with pytest.raises(ValueError, match="read-only"):
        solids[0].shape.vertices[0] = 1


def test_requested_convex_hull_is_ignored_with_a_note(load, tmp_path):
    (tmp_path / "x.dae").write_text(dae())
    (note,) = load(world("x.dae").replace("<mesh>", "<mesh optimization='convex_hull'>")).notes
    assert "the mesh is used unchanged" in note


def test_mesh_file_may_be_read_without_a_world(tmp_path):
    (tmp_path / "x.dae").write_text(dae(unit='<unit meter="0.5"/>'))
    np.testing.assert_allclose(read_mesh(tmp_path / "x.dae").vertices.max(axis=0), (0.5, 0.5, 0))
    (tmp_path / "x.stl").write_bytes(stl(5, 1))
    with pytest.raises(InvalidInput, match=r"x\.stl: STL header says 5 triangles, file holds 1"):
        read_mesh(tmp_path / "x.stl")
    with pytest.raises(InvalidInput, match=r"y\.stl: no such file"):
        read_mesh(tmp_path / "y.stl")


def test_texture_coordinates_of_an_obj_file_cause_no_warning(mesh):
    """NumPy warns about vertices without texture coordinates of an object that is not the first."""
    first = "o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"
    second = "o b\nv 2 0 0\nv 3 0 0\nv 2 1 0\nf 4/1 5/2 6/3\n"
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        assert len(mesh(first + second, name="x.obj").faces) == 2
