"""Connections to the viewer, its answers to invalid messages, and how it ends."""

import json
import re
import signal
import socket
import subprocess
import sys
import time

import numpy as np
import pytest
import websockets.exceptions
from interrupts import obey_signals
from viewer_client import Client, port_of

import isospline
from isospline.cli.main import main
from isospline.viewer.access import is_local


def test_it_listens_only_to_this_machine(viewer):
    outside = next(
        (
            each[4][0]
            for each in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)
            if not is_local(each[4][0])
        ),
        None,
    )
    if outside is None:
        outside = "127.0.0.2"  # another address of this machine: a listener on all addresses would answer
    with pytest.raises(OSError, match="refused"):
        socket.create_connection((outside, port_of(viewer)), timeout=2).close()


def test_a_port_that_is_taken_is_one_clear_error(viewer):
    with pytest.raises(OSError, match=f"^.*port: expected a free port at 127.0.0.1, got {port_of(viewer)}"):
        isospline.view(browser=False, port=port_of(viewer))


@pytest.mark.parametrize(
    "message",
    [
        {},
        {"type": "nothing"},
        {"type": "__init__"},
        {"type": 7},
        [],
        3,
        None,
        {"type": "size", "width": 10**9, "height": 3},
        {"type": "size", "width": "a"},
        {"type": "size", "width": float("inf"), "height": 3},
        {"type": "size", "width": 10**400, "height": 3},
        {"type": "pick", "x": 10**400, "y": 3},
        {"type": "size", "width": float("nan"), "height": 3, "input": float("-inf")},
        {"type": "camera", "camera": {}},
        {"type": "camera", "camera": [1]},
        {"type": "camera", "camera": {"eye": [0, 0, 0], "target": [0, 0, 0], "up": [0, 0, 1]}},
        {"type": "change", "changes": {"lens": 1}},
        {"type": "change", "changes": {"light": 3}},
        {"type": "change", "changes": {"clip": {"normal": [0, "x", 0]}}},
        {"type": "change"},
        {"type": "change_object", "id": 9, "changes": {}},
        {"type": "change_object", "id": 0, "changes": {"level": None}},
        {"type": "change_object", "id": 0, "changes": {"color_by": "source9"}},
        {"type": "change_object", "id": 0, "changes": {"level": 1e400}},
        {"type": "change", "changes": {"clip": {"kind": "plane", "normal": [0, 0, 0]}}},
        {"type": "add_object", "source": "nothing"},
        {"type": "remove_object", "id": 5},
        {"type": "look", "view": "inside"},
        {"type": "pick", "x": "a"},
        {"type": "save", "what": "/etc/passwd"},
        {"type": "upload", "files": []},
        {"type": "upload", "files": [{"name": "..", "size": 1}]},
        {"type": "upload", "files": [{"name": "a", "size": 10**18}]},
        {"type": "upload", "files": [{"name": "a", "size": 1}, {"name": "b/a", "size": 1}]},
        {"type": "upload", "files": [3]},
        {"type": "restore"},
        {"type": "restore", "sources": [3], "state": {}},
        {"type": "restore", "sources": [], "state": {"lens": 1}},
        {"type": "change_object", "id": 0, "changes": {"level": 1e9}},
        {"type": "change_object", "id": 0, "changes": {"level": "60,5"}},
        {"type": "add_object", "source": "source1", "level": -1e9},
        {"type": "change", "changes": {"slices": {"shown": True, "volume": "nothing"}}},
        {"type": "sample", "volume": "nothing", "index": [1, 2, 3]},
        {"type": "sample", "volume": "source1", "index": [1, 2]},
        {"type": "sample", "volume": "source1", "index": [1, 2, 10**400]},
        {"type": "sample", "volume": ["source1"], "index": [1, 2, 3]},
        {"type": "remove_measurement", "id": -1},
        {"type": "remove_measurement"},
    ],
    ids=str,
)
def test_an_invalid_message_is_an_error_and_the_viewer_continues(viewer, message):
    client = Client(viewer)
    client.receive("frame")
    client.socket.send(json.dumps(message).replace("Infinity", "1e400"))
    assert client.receive("error")[0]["text"]
    client.send(type="change_object", id=0, changes={"level": 321.0}, input=77)
    while client.receive("frame")[0]["input"] != 77:
        pass
    assert viewer.state.objects[0].level == 321.0 and viewer.state.clip.kind == "none"
    client.socket.close()


@pytest.mark.parametrize("rule", [["color"], {}, 3])
def test_a_colour_of_a_wrong_type_is_named(viewer, rule):
    client = Client(viewer)
    client.send(type="change_object", id=0, changes={"color_by": rule})
    assert client.receive("error")[0]["text"] == f"color_by: expected text, got {rule!r}"
    client.socket.close()


def test_values_are_told_of_volumes_alone(viewer):
    client = Client(viewer)
    client.send(type="sample", volume="source1", index=[4.25, 9.5, 11])
    volume = viewer.document["source1"].item
    assert client.receive("sampled")[0]["value"] == pytest.approx(float(volume.sample((4.25, 9.5, 11.0))))
    viewer.add(isospline.Mesh(3 * np.eye(3), [(0, 1, 2)]))
    client.send(type="sample", volume="source2", index=[1, 2, 3])
    assert "expected a volume, got source2" in client.receive("error")[0]["text"]
    client.socket.close()


def test_windows_come_and_go_while_pictures_are_drawn(viewer):
    for number in range(12):
        client = Client(viewer)
        client.send(type="change", changes={"light": "path-trace" if number % 2 else "phong"}, input=1)
        if number % 3:
            client.receive("frame")
        client.socket.close() if number % 2 else client.socket.socket.close()
    last = Client(viewer)
    last.receive("frame")
    end = time.monotonic() + 20
    while len(viewer.windows()) > 1:
        assert time.monotonic() < end
        time.sleep(0.05)
    last.socket.close()


def test_closing_twice_and_in_the_middle_of_a_picture(ball):
    viewer = isospline.view(ball, browser=False)
    client = Client(viewer)
    client.send(type="change", changes={"light": "path-trace"}, input=1)
    client.receive("frame")
    begin = time.monotonic()
    viewer.close()
    viewer.close()
    assert time.monotonic() - begin < 10
    with pytest.raises(websockets.exceptions.ConnectionClosed):
        for _ in range(1000):
            client.socket.recv(timeout=10)


@pytest.mark.slow
def test_ctrl_c_ends_the_command_without_a_traceback(ball):
    command = [sys.executable, "-m", "isospline", "view", str(ball), "--no-browser"]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8", preexec_fn=obey_signals
    )
    try:
        process.url = process.stdout.readline().strip()
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/\?token=[\w-]{32}", process.url)
        Client(process).receive("frame")
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)
    finally:
        process.kill()
    assert process.returncode == 0
    assert errors == "isospline: Ctrl-C ends the viewer\n"


DROPPED = """
import signal, sys, weakref
import isospline.cli.main
import isospline.viewer.viewer

class Thing:
    pass

def interrupt_a_callback(viewer, path, **options):
    thing = Thing()
    reference = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))
    del thing

isospline.viewer.viewer.Viewer.open = interrupt_a_callback
sys.exit(isospline.cli.main.main(["view", sys.argv[1], "--no-browser"]))
"""


def test_ctrl_c_ends_the_command_where_python_drops_the_exception(ball):
    command = [sys.executable, "-c", DROPPED, str(ball)]
    done = subprocess.run(
        command, capture_output=True, encoding="utf-8", check=False, timeout=60, preexec_fn=obey_signals
    )
    assert done.returncode == 0
    assert done.stderr == "isospline: Ctrl-C ends the viewer\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nothing.npy"], "nothing.npy: No such file or directory"),
        (["--port", "70000"], "port: expected 0 to 65535, got 70000"),
        (["--session", "nothing.json"], "nothing.json: No such file or directory"),
        (["--host", "no.such.host.invalid"], "port: expected a free port at no.such.host.invalid, got 0"),
    ],
)
def test_wrong_arguments_are_one_line(arguments, message, capsys):
    assert main(["view", "--no-browser", *arguments]) == 2
    errors = capsys.readouterr().err
    assert message in errors and errors.count("\n") == 1


def test_without_websockets_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "websockets", None)
    monkeypatch.setitem(sys.modules, "websockets.asyncio.server", None)
    with pytest.raises(ImportError, match=r"pip install isospline\[view\]"):
        isospline.view(browser=False)


def test_arguments_of_view(ball):
    data = np.load(ball).astype(float)
    volume = isospline.Volume(data)
    surface = isospline.Isosurface(volume, 100.0)
    mesh = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    with isospline.view(volume, surface, mesh, data, ball, levels=[50.0, 150.0], browser=False) as viewer:
        levels = [each.level for each in viewer.state.objects]
    assert levels == [50.0, 150.0, 100.0, None, 50.0, 150.0, 50.0, 150.0]
    with isospline.Scene([surface, mesh]).show(browser=False) as viewer:
        assert [each.level for each in viewer.state.objects] == [100.0, None]
    with surface.show(browser=False) as viewer, volume.show(browser=False) as other:
        assert len(viewer.state.objects) == len(other.state.objects) == 1
    mirrored = np.array([(-2, 0, 0, 5), (0, 1, 0, 6), (0, 0, 3, 7), (0, 0, 0, 1)], float)
    placed = isospline.Scene([(isospline.Mesh(mesh.vertices, mesh.faces, normals=[(0, 0, 1)] * 3), mirrored)])
    with placed.show(browser=False) as viewer:
        (source,) = viewer.document
        shown = isospline.Scene(source.item)
        np.testing.assert_allclose(shown.bounds, placed.bounds)
        ray = [(4.5, 6.25, 20, 0, 0, -1)]
        for name, values in placed.cast_rays(ray, outputs=("t_hit", "primitive_ids", "primitive_normals")).items():
            np.testing.assert_allclose(shown.cast_rays(ray)[name], values)
        np.testing.assert_allclose(source.item.normals, [(0, 0, 1)] * 3)
    with pytest.raises(OSError, match="nothing"):
        isospline.view("nothing.npy", browser=False)


@pytest.mark.parametrize("mirrored", [False, True])
def test_isosurfaces_of_scenes_are_shown_where_transforms_put_them(mirrored):
    field = isospline.volumes.torus()
    volume = field.volume(24)
    clip = isospline.HalfSpace((0.1, 0, 0), (1, 0.5, 0))
    surface = isospline.Isosurface(volume, field.level, clip=clip, capped=True)
    matrix = np.eye(4)
    matrix[:3, :3] = [[0.5, -1, 0], [1, 0.5, 0.2], [0, 0, -2 if mirrored else 2]]
    matrix[:3, 3] = 3, 2, 1
    scene = isospline.Scene([(surface, matrix), (isospline.Isosurface(volume, 0.01), matrix), surface])
    with isospline.view(scene, browser=False) as viewer:
        first, second, third = viewer.document
        assert first.item is second.item and third.item is volume
        shown = isospline.Scene([first.template])
        rng = np.random.default_rng(2)
        points = matrix[:3, 3] + rng.uniform(-2, 2, (2000, 3))
        rays = np.concatenate([points + (5, 4, 3), -np.broadcast_to((5.0, 4, 3), points.shape)], axis=1)
        expected = isospline.Scene([(surface, matrix)]).cast_rays(rays)
        got = shown.cast_rays(rays)
        assert 50 < np.isfinite(expected.t_hit).sum() < 1950
        np.testing.assert_allclose(got.t_hit, expected.t_hit, atol=1e-9)
        np.testing.assert_array_equal(got.primitive_ids, expected.primitive_ids)
        np.testing.assert_allclose(got.primitive_normals, expected.primitive_normals, atol=1e-9)


@pytest.mark.sweep(1)
@pytest.mark.slow
@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("work", ["picks", "cameras of a turntable", "pictures of a turntable"])
def test_queued_work_does_not_delay_the_end(ball, work, ending):
    """The work takes minutes. The end takes tenths of a second, and more on a busy machine."""
    command = [sys.executable, "-m", "isospline", "view", str(ball), "--no-browser"]
    running = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8", preexec_fn=obey_signals
    )
    try:
        running.url = running.stdout.readline().strip()
        client = Client(running)
        client.receive("frame")
        if work == "picks":
            for _ in range(10_000):
                client.send(type="pick", x=32, y=24)
            client.receive("measured")
        else:
            options = {"pictures": 100_000} if work.startswith("cameras") else {"pictures": 50, "samples": 2000}
            client.send(type="save", what="turntable", options=options)
            if work.startswith("pictures"):
                client.receive("progress")
        running.send_signal(ending)
        _, errors = running.communicate(timeout=20)
    finally:
        running.kill()
    assert running.returncode == 0 and errors == "isospline: Ctrl-C ends the viewer\n"
    client.close()
