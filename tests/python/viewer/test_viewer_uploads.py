"""Uploads: they reach no file outside of their folder, have limits, and do not outlive the viewer."""

import base64
import gzip
import io
import json
import os
import pathlib
import signal
import stat
import subprocess
import sys
import time
import zlib

import numpy as np
import pytest
import websockets.exceptions
from interrupts import obey_signals
from viewer_client import Client, connect, port_of, token_of

import isospline
from isospline import read_mesh
from isospline.viewer.upload import Uploads

SHAPE = (8, 7, 6)
SIZE = int(np.prod(SHAPE))


@pytest.fixture
def secret(tmp_path):
    """A folder outside of all uploads with files that only the user may read: samples, and vertices."""
    folder = tmp_path / "private"
    folder.mkdir(mode=0o700)
    samples = (np.arange(SIZE) % 251).astype(np.uint8).tobytes()
    triangle = np.array([(0, 0, 0), (7, 0, 0), (0, 7, 0)], "<f4").tobytes()
    files = {"scan.raw": samples, "scan1.raw": samples, "buffer.bin": triangle, "part.inp": INP}
    slices = np.split(np.frombuffer(samples, np.uint8), SHAPE[0])
    files.update({f"slice{number}.raw": part.tobytes() for number, part in enumerate(slices, 1)})
    files |= {"scan.zraw": zlib.compress(samples), "scan.raw.gz": gzip.compress(samples)}
    for name, content in files.items():
        (folder / name).write_bytes(content)
        (folder / name).chmod(0o600)
    return folder


def uploads_of(viewer):
    """The files in the folder of uploads; folders in it may be removed meanwhile, which os.walk allows."""
    walk = os.walk(viewer.uploads.path)
    return sorted(pathlib.Path(folder, name) for folder, _, names in walk for name in names)


INP = b"*NODE\n1,0,0,0\n2,7,0,0\n3,0,7,0\n*ELEMENT,TYPE=S3\n1,1,2,3\n"
SIZES = " ".join(map(str, SHAPE[::-1]))


def mhd(data, more="", count=3):
    head = f"ObjectType = Image\nNDims = {count}\nDimSize = {SIZES}\nElementType = MET_UCHAR\n{more}"
    return f"{head}ElementDataFile = {data}\n".encode()


def nhdr(data, more="encoding: raw\n"):
    return f"NRRD0004\ntype: uint8\ndimension: 3\nsizes: {SIZES}\n{more}data file: {data}\n".encode()


def gltf(uri):
    accessor = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [7, 7, 0]}
    content = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "scene": 0,
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [accessor],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"uri": uri, "byteLength": 36}],
    }
    return json.dumps(content).encode()


ABOVE = "../" * 20

#: Uploads that refer to a file of the folder `private`; an attacker may know or guess any path.
ATTACKS = {
    "mhd, absolute": lambda private: {"a.mhd": mhd(f"{private}/scan.raw")},
    "mhd, above": lambda private: {"a.mhd": mhd(f"{ABOVE}{private}/scan.raw")},
    "mhd, from its folder": lambda private: {"a.mhd": mhd(f"x/..{private}/../{ABOVE}{private}/scan.raw")},
    "mhd, address": lambda private: {"a.mhd": mhd(f"file://{private}/scan.raw")},
    "mhd, list": lambda private: {"a.mhd": mhd(f"LIST\n{private}/scan.raw\n{private}/scan.raw")},
    "mhd, pattern": lambda private: {"a.mhd": mhd(f"{private}/scan%d.raw 1 1 1")},
    "mhd, compressed": lambda private: {"a.mhd": mhd(f"{private}/scan.zraw", "CompressedData = True\n")},
    "mhd beside its samples": lambda private: {"a.mhd": mhd(f"{private}/scan.raw"), "scan.raw": bytes(SIZE)},
    "mha": lambda private: {"a.mha": mhd(f"{private}/scan.raw")},
    "nhdr, absolute": lambda private: {"a.nhdr": nhdr(f"{private}/scan.raw")},
    "nhdr, above": lambda private: {"a.nhdr": nhdr(f"{ABOVE}{private}/scan.raw")},
    "nhdr, address": lambda private: {"a.nhdr": nhdr(f"file://{private}/scan.raw")},
    "nhdr, list": lambda private: {
        "a.nhdr": nhdr("\n".join(["LIST", *(f"{private}/slice{n}.raw" for n in range(1, 9))]))
    },
    "nhdr, pattern": lambda private: {"a.nhdr": nhdr(f"{private}/slice%d.raw 1 8 1")},
    "nhdr, compressed": lambda private: {"a.nhdr": nhdr(f"{private}/scan.raw.gz", "encoding: gzip\n")},
    "nrrd": lambda private: {"a.nrrd": nhdr(f"{private}/scan.raw")},
    "glTF, absolute": lambda private: {"a.gltf": gltf(f"{private}/buffer.bin")},
    "glTF, above": lambda private: {"a.gltf": gltf(f"{ABOVE}{private}/buffer.bin")},
    "glTF, address": lambda private: {"a.gltf": gltf(f"file://{private}/buffer.bin")},
    "Abaqus": lambda private: {"a.inp": f"*INCLUDE, INPUT={private}/part.inp\n".encode()},
    "VTK pieces": lambda private: {"a.pvti": f'<VTKFile type="PImageData"><Piece Source="{private}/a.vti"/>'.encode()},
    "several files": lambda private: {"b.mhd": mhd(f"{private}/scan.raw"), "a.nhdr": nhdr(f"{private}/scan.raw")},
    "a folder of slices": lambda private: {f"{number}.tif": link(private) for number in range(5)},
}


def link(private):
    return f"{private}/scan.raw".encode()


@pytest.mark.parametrize("name", ATTACKS)
def test_an_upload_reaches_no_file_outside(viewer, secret, name):
    client = Client(viewer)
    files = ATTACKS[name](secret)
    for _ in range(2):  # a refused upload leaves nothing that the next one could use
        errors = client.uploaded(files)
        assert errors and len(list(viewer.document)) == 1 and not uploads_of(viewer)
    client.close()


#: Readers open these without a confinement: the attacks are real.
OPENS = [f"mhd, {how}" for how in ("absolute", "above", "list", "pattern", "compressed")]
OPENS += [f"nhdr, {how}" for how in ("absolute", "above", "list", "pattern", "compressed")]


@pytest.mark.parametrize("name", OPENS)
def test_the_same_files_open_by_name(secret, tmp_path, name):
    for file, content in ATTACKS[name](secret).items():
        (tmp_path / file).write_bytes(content)
        values = isospline.read_volume(tmp_path / file).data.ravel()[: SIZE // 2]
        np.testing.assert_array_equal(values, np.arange(SIZE // 2) % 251)
        with pytest.raises(ValueError, match="within"):
            isospline.read_volume(tmp_path / file, within=tmp_path / "nothing")
    (tmp_path / "a.gltf").write_bytes(gltf(os.path.relpath(secret / "buffer.bin", tmp_path)))
    assert np.ptp(read_mesh(tmp_path / "a.gltf").vertices) == 7


def test_an_upload_may_refer_to_its_own_files(viewer):
    samples = np.random.default_rng(0).integers(0, 255, SHAPE, np.uint8)
    client = Client(viewer)
    assert not client.uploaded({"a.mhd": mhd("a.raw"), "a.raw": samples.tobytes()})
    assert not client.uploaded({"b.nhdr": nhdr("b.raw"), "b.raw": samples.tobytes()})
    triangle = np.array([(0, 0, 0), (7, 0, 0), (0, 7, 0)], "<f4").tobytes()
    assert not client.uploaded({"c.gltf": gltf("c.bin"), "c.bin": triangle})
    encoded = base64.b64encode(triangle).decode()
    assert not client.uploaded({"d.gltf": gltf(f"data:application/octet-stream;base64,{encoded}")})
    sources = list(viewer.document)[1:]
    assert [source.name for source in sources][:3] == ["a.mhd", "b.nhdr", "c.gltf"]
    for source in sources[:2]:
        place = (source.item.affine @ (2, 3, 4, 1))[:3]
        np.testing.assert_allclose(source.item.sample(place), samples[4, 3, 2], atol=1e-3)
    client.close()


def test_files_beside_a_header_are_opened(viewer):
    """All but its samples."""
    samples = np.random.default_rng(0).integers(0, 255, SHAPE, np.uint8)
    file = io.BytesIO()
    np.save(file, samples)
    off = b"OFF\n3 1 0\n0 0 7\n7 0 7\n0 7 7\n3 0 1 2\n"
    client = Client(viewer)
    files = {"a.mhd": mhd("a.raw"), "a.raw": samples.tobytes(), "the other.npy": file.getvalue(), "b.off": off}
    assert not client.uploaded(files)
    assert [source.name for source in viewer.document][1:] == ["a.mhd", "the other.npy", "b.off"]
    client.close()


def test_errors_of_a_folder_of_slices_do_not_name_it(viewer):
    client = Client(viewer)
    text = client.uploaded(dict.fromkeys("abcd", b"nothing"))
    assert text.startswith("the uploaded files: expected a folder with a DICOM series or TIFF slices"), text
    client.close()


def test_an_upload_cannot_leave_its_folder(viewer, ball):
    content = ball.read_bytes()
    client = Client(viewer)
    for name in ("../../../escaped.npy", "..\\..\\escaped.npy", "/tmp/escaped.npy", "C:\\escaped.npy"):
        assert not client.uploaded({name: content})
        source = list(viewer.document)[-1]
        folder = os.path.dirname(source.path)
        assert source.name == "escaped.npy" and source.within == folder
        assert os.path.basename(os.path.dirname(folder)).startswith("isospline-")
        for path in (folder, os.path.dirname(folder)):
            assert stat.S_IMODE(os.stat(path).st_mode) == 0o700
    client.close()
    viewer.close()
    assert not os.path.exists(source.path)


AS_NOBODY = """
import json, os, socket, sys
port, query, secret = int(sys.argv[1]), sys.argv[2], sys.argv[3]
assert os.getuid() == 65534
try:
    open(secret).read()
    sys.exit("the file is not private")
except PermissionError:
    pass
raw = socket.create_connection(("127.0.0.1", port), timeout=20)
own = f"127.0.0.1:{port}"
lines = [f"GET /socket{query} HTTP/1.1", f"Host: {own}", f"Origin: http://{own}", "Connection: Upgrade",
         "Upgrade: websocket", "Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: MDEyMzQ1Njc4OTAxMjM0NQ=="]
raw.sendall(("\\r\\n".join(lines) + "\\r\\n\\r\\n").encode())
answer = raw.recv(4096).decode(errors="replace")
print(answer.split("\\r\\n")[0])
"""


@pytest.mark.skipif(os.name != "posix" or os.getuid() != 0, reason="another user needs root")
def test_another_user_cannot_read_private_files(viewer, tmp_path):
    """A local user can forge every header; the token is in no place that he can read."""
    private = tmp_path / "private.raw"
    private.write_bytes(bytes(range(256)))
    private.chmod(0o600)

    def ask(query):
        command = ["/usr/bin/env", "python3", "-c", AS_NOBODY, str(port_of(viewer)), query, str(private)]
        path = "/usr/local/bin:/usr/bin:/bin"
        done = subprocess.run(
            command, user=65534, group=65534, extra_groups=[], cwd="/", env={"PATH": path}, capture_output=True,
            encoding="utf-8", timeout=60, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    assert ask("") == ask("?token=guess") == "HTTP/1.1 403 Forbidden"
    # The same request with the token: it is the token that keeps him out. Even then, uploads do not reach the file.
    assert ask(f"?token={token_of(viewer)}") == "HTTP/1.1 101 Switching Protocols"
    client = Client(viewer)
    assert "within" in client.uploaded({"a.mhd": mhd(private).replace(SIZES.encode(), b"8 8 4")})
    client.close()


def test_limits_of_size_and_number(ball):
    content = ball.read_bytes()
    with isospline.view(browser=False, upload_limit=2 * len(content) + 10, upload_count=3) as viewer:
        client = Client(viewer)
        assert "upload_limit" in refusal(client, {"a.npy": 2 * len(content) + 11})
        assert "upload_count" in refusal(client, dict.fromkeys("abcd", 1))
        assert not client.uploaded({"a.npy": content})
        assert not client.uploaded({"b.npy": content})
        # All uploads count together, and also a file of no bytes.
        assert "upload_limit" in refusal(client, {"c.npy": 11})
        assert client.uploaded({"c.npy": b"broken"})
        assert client.uploaded({"c.npy": b"broken"})  # the refused one was removed, and no longer counts
        assert "upload_count" in refusal(client, {"c.npy": 0, "d.npy": 0})
        assert len(list(viewer.document)) == 2
        client.close()
    for options, name in (
        ({"upload_limit": "big"}, "upload_limit"),
        ({"upload_limit": 0}, "upload_limit"),
        ({"upload_count": 0}, "upload_count"),
    ):
        with pytest.raises(ValueError, match=f"^{name}: expected"):
            isospline.view(browser=False, **options)


def refusal(client, sizes):
    client.send(type="upload", files=[{"name": name, "size": size} for name, size in sizes.items()])
    return client.receive("error")[0]["text"]


def test_more_bytes_than_announced_are_refused(viewer):
    client = Client(viewer)
    client.send(type="upload", files=[{"name": "a.npy", "size": 10}])
    client.socket.send(bytes(11))
    assert "expected 10 bytes, got more" in client.receive("error")[0]["text"]
    client.socket.send(bytes(11))  # of no upload
    assert not uploads_of(viewer)
    client.close()


def test_two_files_of_one_name_are_refused(viewer):
    client = Client(viewer)
    assert "expected different names, got '1.dcm' twice" in refusal_of_twins(client)
    client.close()


def refusal_of_twins(client):
    client.send(type="upload", files=[{"name": "first/1.dcm", "size": 3}, {"name": "second/1.dcm", "size": 3}])
    return client.receive("error")[0]["text"]


@pytest.mark.parametrize("how", ["closed", "gone", "another"])
def test_an_unfinished_upload_ends_with_its_page(viewer, how):
    client = Client(viewer)
    client.send(type="upload", files=[{"name": "a.npy", "size": 1000}])
    client.socket.send(bytes(500))
    client.receive("progress")
    assert [path.name for path in uploads_of(viewer)] == ["a.npy"]
    if how == "closed":
        client.close()
    elif how == "gone":
        client.socket.socket.close()  # as after a crash
    else:
        assert client.uploaded({"b.npy": b"broken"})
    wait(lambda: not uploads_of(viewer))


def wait(condition, seconds=20):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


class Command:
    """A running `isospline view` with an upload."""

    def __init__(self, ball, folder):
        environment = {**os.environ, "TMPDIR": str(folder)}
        command = [sys.executable, "-m", "isospline", "view", str(ball), "--no-browser"]
        self.process = subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8",
            preexec_fn=obey_signals,
        )  # fmt: skip
        self.url = self.process.stdout.readline().strip()
        self.client = Client(self)
        assert not self.client.uploaded({"other.npy": ball.read_bytes()})
        assert [path.name for path in folder.rglob("other.npy")]


@pytest.mark.sweep(2)
@pytest.mark.slow
@pytest.mark.parametrize("ending", ["SIGINT", "SIGTERM", "SIGHUP", "SIGKILL"])
def test_uploads_do_not_outlive_the_viewer(ball, tmp_path, ending):
    folder = tmp_path / "temporary"
    folder.mkdir()
    running = Command(ball, folder)
    try:
        running.process.send_signal(getattr(signal, ending))
        _, errors = running.process.communicate(timeout=120)  # for a busy machine
    finally:
        running.process.kill()
    if ending in ("SIGINT", "SIGTERM"):  # a proper end: nothing is left when the program has ended
        assert running.process.returncode == 0 and errors == "isospline: Ctrl-C ends the viewer\n"
        assert not os.listdir(folder)
    wait(lambda: not os.listdir(folder))
    with pytest.raises((websockets.exceptions.ConnectionClosed, OSError, TimeoutError)):
        for _ in range(1000):
            running.client.socket.recv(timeout=10)


WITHOUT_CLOSE = """
import os, sys
import isospline
viewer = isospline.view(browser=False)
folder = viewer.uploads.folder([3])
child = os.fork()
if child == 0:
    sys.exit(0)
os.waitpid(child, 0)
assert os.path.isdir(folder)  # a forked process does not remove it
print(folder)
"""


def test_a_program_that_ends_without_close_leaves_nothing():
    done = subprocess.run(
        [sys.executable, "-W", "error", "-W", "ignore::DeprecationWarning", "-c", WITHOUT_CLOSE],
        capture_output=True,
        encoding="utf-8",
        timeout=60,
        check=False,
    )
    assert done.returncode == 0 and not done.stderr
    assert not os.path.exists(done.stdout.strip()) and "isospline-" in done.stdout


def test_uploads_count_again_after_they_are_discarded():
    uploads = Uploads(100, 2)
    folder = uploads.folder([60])
    with pytest.raises(ValueError, match="expected at most 100 bytes in all uploads"):
        uploads.folder([60])
    uploads.discard(folder)
    assert os.path.isdir(uploads.folder([60])) and not os.path.exists(folder)
    uploads.remove()


def test_a_socket_without_a_token_uploads_nothing(viewer):
    with pytest.raises(websockets.exceptions.InvalidStatus, match="403"):
        connect(viewer, query="")
    assert viewer.uploads.path is None
