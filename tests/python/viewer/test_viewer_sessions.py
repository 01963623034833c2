"""Sessions that are uploaded, and bundles: sessions with the files of uploads."""

import io
import json
import os
import re
import zipfile

import numpy as np
import pytest
from viewer_client import Client

import isospline
from isospline import volumes
from isospline.cli.main import main
from isospline.viewer import bundle
from isospline.viewer.session import session_of, write_session
from isospline.viewer.state import CameraState

CAMERA = CameraState(eye=(30.0, -50.0, 40.0), target=(10.0, 10.0, 10.0), up=(0.0, 0.0, 1.0))
BALL = (1000 * volumes.sphere(0.7).values(20)).astype(np.int16)
MHD = "ObjectType = Image\nNDims = 3\nDimSize = 20 20 20\nElementType = MET_SHORT\nElementDataFile = {}\n"
OFF = b"OFF\n3 1 0\n0 0 20\n20 0 20\n0 20 20\n3 0 1 2\n"


def npy(data):
    file = io.BytesIO()
    np.save(file, data)
    return file.getvalue()


@pytest.fixture
def viewer(ball):
    with isospline.view(ball, levels=[100.0], browser=False) as opened:
        opened.remember_camera(CAMERA)
        yield opened


@pytest.fixture
def client(viewer):
    opened = Client(viewer)
    yield opened
    opened.close()


def saved(client, what="session"):
    client.send(type="camera", camera=CAMERA.to_json())
    client.send(type="save", what=what)
    about, content = client.receive("file", "error")
    assert about["type"] == "file", about
    return about["name"], content


def test_far_from_the_origin_a_mesh_is_saved_with_its_place(tmp_path):
    far = isospline.Volume(isospline.volumes.sphere(0.7).values(12), origin=(5e5, 4.5e6, 300))
    with isospline.view(isospline.Isosurface(far, 0.0), browser=False) as opened:
        client = Client(opened)
        name, content = saved(client, "mesh")
        client.close()
    (tmp_path / name).write_bytes(content)
    bounds = isospline.read_mesh(tmp_path / name).bounds
    np.testing.assert_allclose(bounds.mean(axis=0), np.array([5e5, 4.5e6, 300]) + 5.5, atol=1e-6)


def session(sources, level=50.0, **more):
    """The text of a session with an isosurface of each source."""
    objects = [{"id": id, "source": each["key"], "level": level} for id, each in enumerate(sources)]
    state = {"objects": objects, "camera": CAMERA.to_json(), **more}
    return json.dumps({"format": "isospline session 2", "sources": sources, "state": state}).encode()


def zipped(files):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return file.getvalue()


def levels_of(viewer):
    return [each.level for each in viewer.state.objects]


def test_a_dropped_session_shows_the_files_that_are_open(viewer, client, ball):
    name, content = saved(client)
    assert name == "session.json"
    viewer.change(lambda state: state.with_object(0, level=300.0, color="#ff0000"))
    assert not client.uploaded({"session.json": content})
    assert levels_of(viewer) == [100.0] and len(list(viewer.document)) == 1
    assert viewer.state.camera == CAMERA


def test_a_dropped_session_takes_the_files_that_are_dropped_with_it(client, viewer):
    text = session([{"key": "a", "path": "/far/away/other.mhd"}, {"key": "b", "path": "deep/one.off"}], None)
    text = text.replace(b'"level": null', b'"level": 70.5', 1)
    files = {"other.mhd": MHD.format("other.raw").encode(), "other.raw": BALL.tobytes(), "one.off": OFF}
    assert not client.uploaded({"session.json": text, **files})
    sources = {source.key: source for source in viewer.document}
    assert [sources[each.source].name for each in viewer.state.objects] == ["other.mhd", "one.off"]
    assert levels_of(viewer) == [70.5, None]
    assert all(sources[each.source].within is not None for each in viewer.state.objects)


ABOVE = "../" * 20

#: Sessions that name the file of a folder outside.
ATTACKS = {
    "absolute": lambda secret: {"a.json": session([{"key": "a", "path": f"{secret}/secret.npy"}])},
    "above": lambda secret: {"a.json": session([{"key": "a", "path": f"{ABOVE}{secret}/secret.npy"}])},
    "its folder": lambda secret: {"a.json": session([{"key": "a", "path": f"{secret}"}])},
    "address": lambda secret: {"a.json": session([{"key": "a", "path": f"file://{secret}/secret.npy"}])},
    "raw": lambda secret: {
        "a.json": session([{"key": "a", "path": "/etc/passwd", "read_options": {"shape": [2, 4, 4], "dtype": "u1"}}])
    },
    "its own confinement": lambda secret: {
        "a.json": session([{"key": "a", "path": "b.npy", "read_options": {"within": "/"}}]),
        "b.npy": npy(BALL),
    },
    "another header": lambda secret: {
        "a.json": session([{"key": "a", "path": "b.mhd"}]),
        "b.mhd": MHD.format(f"{secret}/secret.raw").encode(),
    },
    "the second of two": lambda secret: {
        "a.json": session([{"key": "a", "path": "b.npy"}, {"key": "b", "path": f"{secret}/secret.npy"}]),
        "b.npy": npy(BALL),
    },
    "bundle, absolute": lambda secret: {
        "a.zip": zipped({"session.json": session([{"key": "a", "path": f"{secret}/secret.npy"}])})
    },
    "bundle, above": lambda secret: {
        "a.zip": zipped({"session.json": session([{"key": "a", "path": f"{ABOVE}{secret}/secret.npy"}])})
    },
    "bundle, link": lambda secret: {"a.zip": with_link(f"{secret}/secret.npy")},
    "bundle, header": lambda secret: {
        "a.zip": zipped(
            {
                "session.json": session([{"key": "a", "path": "files1/b.mhd"}]),
                "files1/b.mhd": MHD.format(f"{secret}/secret.raw"),
            }
        )
    },
}


def with_link(target):
    """A ZIP file with a symbolic link."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("session.json", session([{"key": "a", "path": "files1/link.npy"}]))
        link = zipfile.ZipInfo("files1/link.npy")
        link.create_system, link.external_attr = 3, 0o120777 << 16
        archive.writestr(link, target)
    return file.getvalue()


@pytest.mark.parametrize("name", ATTACKS)
def test_an_uploaded_session_reaches_no_file_outside(viewer, client, tmp_path, name):
    secret = tmp_path / "private"
    secret.mkdir()
    (secret / "secret.npy").write_bytes(npy(BALL))
    (secret / "secret.raw").write_bytes(BALL.tobytes())
    state = viewer.state
    assert client.uploaded(ATTACKS[name](secret))
    # Of two files, the first one may have been read, but is not shown.
    assert viewer.state.objects == state.objects
    assert all(source.path is None or "private" not in source.path for source in viewer.document)
    assert len(list(viewer.document)) == 1


@pytest.mark.parametrize(
    "files",
    [
        {"../escaped.npy": b"1"},
        {"/tmp/isospline-escaped.npy": b"1"},
        {"files1/../../escaped.npy": b"1"},
        {"..\\escaped.npy": b"1"},
    ],
    ids=str,
)
def test_a_bundle_is_unpacked_into_its_folder(client, viewer, files):
    errors = client.uploaded({"a.zip": zipped({"session.json": session([]), **files})})
    assert "expected names inside the bundle" in errors
    assert not list(os.scandir(viewer.uploads.path))


def test_a_bundle_counts_with_what_it_holds(ball):
    with isospline.view(ball, browser=False, upload_limit=200_000, upload_count=5) as viewer:
        client = Client(viewer)
        file = io.BytesIO()
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("session.json", session([]))
            archive.writestr("bomb", bytes(1_000_000))
        assert len(file.getvalue()) < 5000
        assert "upload_limit" in client.uploaded({"a.zip": file.getvalue()})
        assert "upload_count" in client.uploaded({"a.zip": zipped({str(number): b"" for number in range(9)})})
        client.close()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"PK\x05\x06" + bytes(18), "without session.json"),
        (zipped({"session.json": b"no JSON"}), "text that is not JSON"),
        (zipped({"session.json": session([])})[:-30], "session of isospline"),
        (zipped({"session.json": session([])}).replace(b"isospline", b"isospl1ne"), "CRC"),
    ],
    ids=["empty", "not JSON", "cut", "changed"],  # the bytes have the time
)
def test_broken_bundles_are_one_clear_error(client, viewer, content, message):
    before = viewer.state
    assert message in client.uploaded({"a.zip": content})
    assert viewer.state == before


def shot(viewer, state=None):
    from isospline.viewer.picture import PictureMaker, passes

    state = viewer.state if state is None else state
    return PictureMaker(viewer.document).render(state, (48, 36), passes(state)[-1]).to_srgb()


def test_a_session_with_uploads_is_saved_as_a_bundle(client, viewer, ball, tmp_path):
    """It can be opened when the viewer has ended: by name, by drop, and as a picture."""
    files = {"other.mhd": MHD.format("other.raw").encode(), "other.raw": (BALL // 2).tobytes(), "note.txt": b"?"}
    assert not client.uploaded(files)
    assert not client.uploaded({"one.off": OFF})
    level = 80.0
    viewer.change(lambda state: state.with_object(1, level=level, color="#00ff00"))
    name, content = saved(client)
    assert name == "session.zip"
    expected, state = shot(viewer), viewer.state
    viewer.close()
    path = tmp_path / name
    path.write_bytes(content)
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        text = archive.read("session.json").decode()
    assert names[0] == "session.json" and "files1/other.raw" in names and "files2/one.off" in names
    assert "isospline-" not in text and str(ball) in text  # files that were opened by name keep it

    with isospline.view(session=path, browser=False) as again:
        np.testing.assert_array_equal(shot(again), expected)
        assert again.state == state
        second = Client(again)
        assert saved(second)[1] == content  # it can be saved again
        second.close()
    with isospline.view(ball, browser=False) as again:
        second = Client(again)
        assert not second.uploaded({"session.zip": content})
        np.testing.assert_array_equal(shot(again), expected)
        second.close()
    out = tmp_path / "out.png"
    assert main(["render", "--session", str(path), "-o", str(out), "--size", "48x36"]) == 0
    import PIL.Image

    np.testing.assert_array_equal(np.asarray(PIL.Image.open(out)), expected)


def test_a_bundle_has_a_size_that_a_page_can_receive(client, viewer, monkeypatch):
    assert not client.uploaded({"other.npy": npy(BALL)})
    monkeypatch.setattr(bundle, "LARGEST_BUNDLE", 1000)
    client.send(type="save", what="session")
    assert "expected at most 1000 bytes of uploaded files" in client.receive("error")[0]["text"]


def test_a_text_session_of_uploads_is_refused(client, viewer, tmp_path):
    assert not client.uploaded({"other.npy": npy(BALL)})
    with pytest.raises(ValueError, match=r"^session: expected files that stay"):
        write_session(tmp_path / "session.json", session_of(viewer.document, viewer.state))


def test_code_names_an_upload_without_its_folder(client, viewer):
    assert not client.uploaded({"other.npy": npy(BALL)})
    _, code = saved(client, "python")
    assert b"isospline.read_volume('other.npy')" in code and b"isospline-" not in code


def test_two_sessions_at_once_are_refused(client):
    assert "expected one session" in client.uploaded({"a.json": session([]), "b.json": session([])})


@pytest.mark.parametrize("options", [{"read_options": {"within": "/"}}, {"model_options": {"progress": "x"}}])
def test_sessions_have_no_other_options(tmp_path, options, ball):
    (tmp_path / "a.json").write_bytes(session([{"key": "a", "path": str(ball), **options}]))
    with pytest.raises(ValueError, match="_options: expected some of "):
        isospline.view(session=tmp_path / "a.json", browser=False)


def test_a_session_whose_files_cannot_be_read_opens_none_of_them(viewer, ball, tmp_path):
    sources = [{"key": "a", "path": str(ball)}, {"key": "b", "path": "gone.npy"}]
    (tmp_path / "a.json").write_bytes(session(sources))
    with pytest.raises(FileNotFoundError, match=r"gone\.npy"):
        viewer.open_session(*viewer.read_session(tmp_path / "a.json"))
    assert [each.key for each in viewer.document] == ["source1"]


POINT = {"object": 0, "position": [0, 0, 0], "normal": [0, 0, 1]}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"exponent": 10**400}, "exponent: expected a finite number from 0.1 to 100, got 1000"),
        ({"slices": {"index": [0, 0, 10**400]}}, "index: expected a finite number, got 1000"),
        ({"camera": {"eye": [1, 2, 3], "target": [1, 2, 3], "up": [0, 0, 1]}}, "target: expected a point other than"),
        (
            {"measurements": [{"id": 1, "tool": "point", "points": [POINT]}] * 2},
            "id: expected one of its own for each measurement, got 1 of several",
        ),
    ],
    ids=["a number", "an index", "a camera", "two measurements"],
)
def test_impossible_numbers_of_a_session_are_named(ball, tmp_path, changes, message, capsys):
    path = tmp_path / "a session.json"
    path.write_bytes(session([{"key": "a", "path": str(ball)}], **changes))
    assert main(["render", "--session", str(path), "-o", str(tmp_path / "a.png"), "--size", "40x30"]) == 2
    assert message in capsys.readouterr().err and not (tmp_path / "a.png").exists()


def test_a_level_that_a_file_does_not_have_is_told(ball, tmp_path, capsys):
    """For example, that of another file which had this name."""
    message = f"level: expected .* the values of {ball.name}, got 1e\\+30: there is no surface"
    (tmp_path / "a.json").write_bytes(session([{"key": "a", "path": str(ball)}], level=1e30))
    command = ["render", "--session", tmp_path / "a.json", "-o", tmp_path / "a.png", "--size", "40x30"]
    assert main(list(map(str, command))) == 0
    assert re.search(f"warning: {message}", capsys.readouterr().err)
    with pytest.warns(UserWarning, match=message):
        isospline.view(ball, levels=[1e30], browser=False).close()


def test_a_session_is_named_by_a_path():
    """The number of an open file would close it."""
    with pytest.raises(TypeError, match="^session: expected a str, path-like or None, got 3"):
        isospline.view(session=3, browser=False)
