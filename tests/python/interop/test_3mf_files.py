"""Objects of 3MF files in their places. The oracle is the formula of the standard: rows of vertices times a matrix."""

import zipfile

import numpy as np
import pytest

import isospline

POINTS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
ASIDE = (1, 0, 0, 0, 1, 0, 0, 0, 1, 10, 0, 0)
TURNED = (0, 2, 0, 0, 0, 1, 3, 0, 0, 1, 2, 3)
MIRRORED = (-1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0)
SPACES = (
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
    'xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06" '
    'xmlns:s="http://schemas.microsoft.com/3dmanufacturing/slice/2015/07"'
)
MAIN = "3D/3dmodel.model"
RELATION = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"


def mesh_of(size=1):
    vertices = "".join('<vertex x="{}" y="{}" z="{}"/>'.format(*point) for point in size * POINTS)
    triangles = "".join('<triangle v1="{}" v2="{}" v3="{}"/>'.format(*face) for face in FACES)
    return f"<mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>"


def named(word, identifier, place=None, **attributes):
    """An item or a component."""
    if place is not None:
        attributes["transform"] = " ".join(map(str, place))
    pairs = (f'{name.replace("_", ":")}="{value}"' for name, value in attributes.items())
    return f'<{word} objectid="{identifier}" {" ".join(pairs)}/>'


def with_components(*components):
    return f"<components>{''.join(components)}</components>"


def model(objects, items=(), unit="millimeter"):
    """A model; objects are pairs of attributes and content."""
    resources = "".join(f"<object {attributes}>{content}</object>" for attributes, content in objects)
    return (
        f'<?xml version="1.0"?><model unit="{unit}" {SPACES}><resources>{resources}</resources>'
        f"<build>{''.join(items)}</build></model>"
    )


def read(path, main, name=MAIN, **others):
    with zipfile.ZipFile(path, "w") as archive:
        relation = f'<Relationship Target="/{name}" Id="a" Type="{RELATION}"/>'
        archive.writestr("_rels/.rels", f"<Relationships>{relation}</Relationships>")
        for other, text in others.items():
            archive.writestr(f"3D/Objects/{other}.model", text)
        archive.writestr(name, main)
    return isospline.read_mesh(path)


def check(mesh, *parts):
    """Compare with tetrahedra, pairs of a size and places from the innermost to the outermost."""
    points = []
    for size, *places in parts:
        part = size * POINTS
        for place in places:
            matrix = np.reshape(place, (4, 3))
            part = part @ matrix[:3] + matrix[3]
        points.append(part)
    found = np.split(mesh.vertices, np.arange(4, len(mesh.vertices), 4))
    np.testing.assert_array_equal(sorted(map(np.ndarray.tolist, found)), sorted(map(np.ndarray.tolist, points)))
    volumes = np.linalg.det(mesh.vertices[mesh.faces].reshape(-1, 4, 3, 3)).sum(axis=1)
    assert (volumes > 0).all()  # faces are counter-clockwise as seen from outside
    assert len(mesh.faces) == 4 * len(parts)


def test_instances_with_one_part_number_stay(tmp_path):
    items = [named("item", 1, place, partnumber="a") for place in (None, ASIDE, TURNED, MIRRORED)]
    mesh = read(tmp_path / "a.3mf", model([('id="1"', mesh_of())], items))
    check(mesh, [1], [1, ASIDE], [1, TURNED], [1, MIRRORED])


@pytest.mark.parametrize("names", [("a", "a"), ("world", "b"), ("body 1(1)", "body 1(2)"), ("ä &amp; b", "")])
def test_names_do_not_count(tmp_path, names):
    objects = [(f'id="{place + 1}" name="{name}"', mesh_of(place + 1)) for place, name in enumerate(names)]
    objects += [
        (f'id="{place + 5}" name="{name}"', with_components(named("component", place + 1, TURNED)))
        for place, name in enumerate(names)
    ]
    mesh = read(tmp_path / "a.3mf", model(objects, [named("item", 5, ASIDE), named("item", 6, MIRRORED)]))
    check(mesh, [1, TURNED, ASIDE], [2, TURNED, MIRRORED])


def test_objects_of_several_files(tmp_path):
    """As slicers write them, by the production extension; identifiers are those of one file."""
    path = {"p_path": "/3D/Objects/b.model"}
    components = [named("component", 1, **path), named("component", 2, ASIDE, **path)]
    objects = [('id="1"', with_components(*components)), ('id="2"', mesh_of(5))]
    items = [named("item", 1), named("item", 1, TURNED, p_path="/3d/OBJECTS/c.model")]
    others = {"b": model([('id="1"', mesh_of()), ('id="2"', mesh_of(2))]), "c": model([('id="1"', mesh_of(3))])}
    check(read(tmp_path / "a.3mf", model(objects, items), **others), [1], [2, ASIDE], [3, TURNED])


def test_the_archive_names_its_model(tmp_path):
    path = tmp_path / "a.3mf"
    other = model([('id="1"', mesh_of(2))], [named("item", 1)])
    check(read(path, model([('id="1"', mesh_of())], [named("item", 1)], "inch"), "3D/part.model", a=other), [1])
    assert isospline.scene.mesh_files.unit_of_mesh(path) == "inch"


def test_elements_of_extensions_are_left_out(tmp_path):
    slices = '<s:vertices><s:vertex x="1" y="2"/></s:vertices><s:item/>'
    check(read(tmp_path / "a.3mf", model([('id="1"', slices + mesh_of())], [named("item", 1)])), [1])


@pytest.mark.parametrize(
    "content, item, said",
    [
        (mesh_of(), named("item", 7), "expected an object 7 in 3d/3dmodel.model, got none"),
        (with_components(named("component", 1)), named("item", 1), "no parts of themselves, got object 1"),
        (mesh_of(), named("item", 1, (1, 2)), "expected 12 numbers of a transform, got 1 2"),
        (mesh_of(), named("item", 1, p_path="/b.model"), "expected a file b.model in the archive, got none"),
        (mesh_of().replace("v1", "v4", 1), named("item", 1), "expected numbers v1, v2, v3 of a triangle"),
        (mesh_of().replace("0.0", "0,0", 1), named("item", 1), "expected numbers x, y, z of a vertex"),
        (mesh_of().replace('"3"', '"4"', 1), named("item", 1), "expected vertex indices from 0 to 4 - 1"),
        (mesh_of(), "", "expected faces, got none"),
    ],
)
def test_errors_name_what_is_wrong(tmp_path, content, item, said):
    with pytest.raises(ValueError, match=rf"a\.3mf: cannot be read as a mesh: .*{said}"):
        read(tmp_path / "a.3mf", model([('id="1"', content)], [item]))
