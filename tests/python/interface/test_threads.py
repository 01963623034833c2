"""Calls from many threads: none waits for long, Ctrl-C stops all, and processes can fork and end meanwhile."""

import os
import pickle
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from interrupts import obey_signals
from layered import render
from spheres import mesh_sphere, moved, sphere

import isospline

needs_fork = pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")


def long_ones(*names):
    """Values of a parameter that `make test` leaves out: they stand for code that the others run as well."""
    return [pytest.param(name, marks=pytest.mark.long) for name in names]


def python(code, folder, *, arguments=(), timeout=120):
    """The output of a separate process, which must end by itself and without an error."""
    finished = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code, *arguments],
        cwd=folder,
        timeout=timeout,
        capture_output=True,
        encoding="utf-8",
        preexec_fn=obey_signals,
    )
    assert finished.returncode == 0, (finished.returncode, finished.stdout, finished.stderr)
    return finished.stdout


@pytest.fixture
def folder(repository):
    return repository / "tests" / "python"


# Waiting


@pytest.mark.slow
def test_each_call_gets_its_turn(tmp_path):
    """Eight threads, each with a different kind of call to the same scene, surface, hopper and renderer."""
    surface, mesh = sphere(), mesh_sphere(6.0, 32)
    scene = isospline.Scene([surface])
    camera = isospline.PerspectiveCamera((60, -40, 30), (11.5, 11.5, 11.5))
    rays = camera.rays((100, 80))
    hopper = isospline.research.VoxelHopper(surface)
    renderer = isospline.ProgressiveRenderer(scene, camera, size=(32, 24))
    image = render(scene, camera, size=(64, 48))
    end = time.monotonic() + 1
    longest, errors = {}, []

    def change_level(i):
        surface.level = 36.0 + i % 13

    def change_objects(i):
        added = scene.add(mesh, moved(i % 7, 0, 0))
        scene.set_transform(added, moved(0, i % 5, 0))
        scene.set_visibility(added, visible=i % 2 == 0)
        scene.remove(added)

    def query(i):
        hits = scene.cast_rays(rays, coherent=i % 2 == 0)
        scene.test_occlusions(rays)
        scene.list_intersections(rays[::10])
        assert np.isfinite(hits["t_hit"]).any()

    def look(i):
        assert scene.bounds.shape == (2, 3) and scene.memory > 0 and scene.build_count > 0 and len(scene) > 0
        assert len(pickle.loads(pickle.dumps(scene))) > 0

    def draw(i):
        render(scene, camera, size=(64, 48), light=isospline.Phong(shadows=True))

    def trace(i):
        try:
            renderer.step()
        except RuntimeError as error:
            assert "scene has changed" in str(error)
            renderer.reset()

    def measure(i):
        surface.closest_points(rays[:2, :2, :3])
        surface.contains(rays[..., :3])
        assert len(surface.shell.cells) > 0
        hopper.cast_rays(rays[:10])

    def write(i):
        image.write(tmp_path / f"image.{['png', 'exr'][i % 2]}")

    def again(call):
        i = 0
        try:
            while time.monotonic() < end or i < 10:
                begin = time.monotonic()
                call(i)
                longest[call.__name__] = max(longest.get(call.__name__, 0), time.monotonic() - begin)
                i += 1
        except BaseException as error:
            errors.append(error)

    calls = [change_level, change_objects, query, look, draw, trace, measure, write]
    threads = [threading.Thread(target=again, args=(call,)) for call in calls]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
    # Each of these is a few calls: they take a tenth of a second on an idle machine, and many times as long on a busy
    # one. A call that starves waits for a minute.
    assert max(longest.values()) < 15, longest


def test_changes_do_not_wait_for_a_picture():
    surface, mesh = sphere(), mesh_sphere(6.0, 32)
    scene = isospline.Scene([surface])
    camera = isospline.camera_for(scene)
    cancelled, started = threading.Event(), threading.Event()
    seen = []

    def progress(fraction):
        started.set()
        return not cancelled.is_set()

    def draw():
        try:
            render(scene, camera, size=(4000, 4000), light=isospline.AmbientOcclusion(1000), progress=progress)
        except isospline.Cancelled:
            seen.append("cancelled")

    thread = threading.Thread(target=draw)
    thread.start()
    started.wait()
    surface.level = 49.0
    scene.remove(scene.add(mesh))
    assert scene.cast_rays([(-20, 11.5, 11.5, 1, 0, 0)])["t_hit"][0] == pytest.approx(31.5 - 7)
    assert thread.is_alive()
    cancelled.set()
    thread.join()
    assert seen == ["cancelled"]


# Ctrl-C

INTERRUPT = """
import os, signal, sys, threading, time
import numpy as np
import isospline
from spheres import mesh_sphere, sphere

surface = sphere()
scene = isospline.Scene([surface])
camera = isospline.camera_for(scene)
renderer = isospline.ProgressiveRenderer(scene, camera, size=(2000, 2000))
rays = np.tile(camera.rays((1000, 1000)), (10, 1, 1))
sky = isospline.AmbientOcclusion(1000)
noise = np.random.default_rng(0).random((100, 100, 100)).astype("f4")

def again(call):
    while True:
        call()

def large_image():
    image = isospline.render(scene, camera, size=(1000, 1000), light="phong", layers=("position", "normal", "albedo"))
    image.color[...] = np.random.default_rng(0).random(image.color.shape)
    for array in (image.position, image.normal, image.albedo):
        array[...] = np.random.default_rng(1).random(array.shape)
    return image

def step():
    threading.Thread(target=lambda: renderer.step(10000), daemon=True).start()
    time.sleep(0.3)
    renderer.step(1)  # waits for the other

calls = {
    "render": lambda: isospline.render(scene, camera, size=(4000, 4000), light=sky),
    "step": step,
    "cast_rays": lambda: again(lambda: scene.cast_rays(rays)),
    "add": lambda: again(lambda: scene.add(surface)),
    "level": lambda: again(lambda: setattr(surface, "level", 49.0)),
    "volume": lambda: again(lambda: isospline.Volume(noise, degree=3)),
    "closest_points": lambda: surface.closest_points(np.random.default_rng(0).random((10**6, 3)) * 24),
    "exr": lambda image: again(lambda: image.write("image.exr")),
    "png": lambda image: again(lambda: image.write("image.png")),
}
call = calls[sys.argv[1]]
arguments = [large_image()] if sys.argv[1] in ("exr", "png") else []
os.chdir(sys.argv[2])
sent = []

def interrupt():
    sent.append(time.monotonic())
    os.kill(os.getpid(), signal.SIGINT)

threading.Timer(0.4, interrupt).start()
try:
    call(*arguments)
except KeyboardInterrupt:
    print(time.monotonic() - sent[0], os.listdir("."))
sys.stdout.flush()
os._exit(0)
"""


@pytest.mark.sweep(1)
@pytest.mark.slow
@pytest.mark.parametrize(
    "call", ["render", "step", "exr", *long_ones("cast_rays", "add", "level", "volume", "closest_points", "png")]
)
def test_every_call_hears_an_interrupt(call, folder, tmp_path):
    seconds, files = python(INTERRUPT, folder, arguments=[call, str(tmp_path)]).split(" ", 1)
    # Some tenths of a second on an idle machine, and several times as long on a busy one. Without the interrupt, a call
    # runs for minutes.
    assert float(seconds) < 10
    assert all(name in ("image.exr", "image.png") for name in eval(files))  # complete files of earlier calls


# Processes that end, and that fork

END = """
import sys, threading, time
import isospline
from spheres import sphere

scene = isospline.Scene([sphere()])
camera = isospline.camera_for(scene)
calls = {
    "render": lambda: isospline.render(scene, camera, size=(400, 300), light=isospline.AmbientOcclusion(64)),
    "short": lambda: scene.cast_rays([(-20, 11, 11, 1, 0, 0)]),
    "add": lambda: scene.remove(scene.add(sphere())),
}

def work():
    while True:
        calls[sys.argv[1]]()

for _ in range(3):
    threading.Thread(target=work, daemon=True).start()
time.sleep(0.3)
"""


@pytest.mark.slow
@pytest.mark.parametrize("call", ["render", *long_ones("short", "add")])
def test_the_interpreter_ends_while_daemon_threads_work(call, folder):
    for _ in range(2):
        assert python(END, folder, arguments=[call]) == ""


FORK = """
import os, signal, sys, threading, time
import numpy as np
import isospline
from spheres import mesh_sphere, sphere

surface = sphere()
scene = isospline.Scene([surface])
camera = isospline.camera_for(scene)
rays = np.tile([-20.0, 11.4, 11.3, 1.0, 0.0, 0.0], (5000, 1))
expected = scene.cast_rays(rays)["t_hit"]
changed = isospline.Scene([isospline.Isosurface(surface.volume, 49.0, inside="below")]).cast_rays(rays)["t_hit"]

def work():
    while True:
        isospline.render(scene, camera, size=(600, 400), light=isospline.AmbientOcclusion(64))

def build():
    while True:
        isospline.Scene([mesh_sphere(6.0, 64)]).bounds

scene.settle()
if sys.argv[1] != "idle":
    threading.Thread(target=work, daemon=True).start()
if sys.argv[1] == "building":
    threading.Thread(target=build, daemon=True).start()
time.sleep(0.2)

def live():
    # What was not in use.
    assert (scene.cast_rays(rays)["t_hit"] == expected).all()
    isospline.render(scene, camera, size=(40, 30), light="phong")
    surface.level = 49.0
    scene.add(mesh_sphere(1.0, 8))
    scene.remove(1)
    assert isospline.Isosurface(isospline.Volume(np.random.default_rng(0).random((20, 20, 20))), 0.5).shell.count > 0
    assert isospline.thread_count() == 1
    isospline.set_thread_count(2)
    try:
        assert (scene.cast_rays(rays)["t_hit"] == changed).all()
        return 10
    except RuntimeError as error:
        assert "this process was forked while another thread was at work" in str(error)
        return 11

for _ in range(int(sys.argv[2])):
    child = os.fork()
    if child == 0:
        signal.alarm(60)
        code = 1
        try:
            code = live()
        finally:
            os._exit(code)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    print(code)
sys.stdout.flush()
os._exit(0)
"""


@pytest.mark.slow
@needs_fork
@pytest.mark.parametrize("parent, codes", [("idle", {"10"}), ("rendering", {"10"}), ("building", {"10", "11"})])
def test_a_forked_child_works_or_raises(parent, codes, folder):
    """The child can do everything, with one thread. If a thread was building, it cannot build new objects."""
    assert set(python(FORK, folder, arguments=[parent, "5"], timeout=300).split()) <= codes


FORK_STORE = """
import os, signal, sys, threading, time
import numpy as np
import isospline

isospline.convert(np.random.default_rng(0).random((128, 128, 128), np.float32), "volume.zarr")
volume = isospline.open_volume("volume.zarr", memory_limit="34MB")
scene = isospline.Scene(isospline.Isosurface(volume, 0.6))
rays = isospline.camera_for(scene).rays((24, 24)).reshape(-1, 6)
expected = scene.count_intersections(rays)
assert volume.paging["bricks_dropped"] > 0

def work():
    while True:
        scene.count_intersections(rays)

for _ in range(3):
    threading.Thread(target=work, daemon=True).start()
for _ in range(2):
    time.sleep(0.02)
    child = os.fork()
    if child == 0:
        signal.alarm(60)
        same = np.array_equal(scene.count_intersections(rays), expected)
        os._exit(10 if same else 11)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
os._exit(0)
"""


@pytest.mark.slow
@needs_fork
def test_a_forked_child_reads_the_store_that_its_parent_reads(tmp_path):
    pytest.importorskip("zarr")
    assert set(python(FORK_STORE, tmp_path, timeout=600).split()) == {"10"}


@pytest.mark.slow
@pytest.mark.parametrize("make", ["mesh", "mask"])
def test_others_run_while_arrays_are_copied(make):
    vertices, faces = np.random.default_rng(0).random((1_000_000, 3)), np.arange(3_000_000).reshape(-1, 3) % 1_000_000
    volume = isospline.Volume(np.random.default_rng(0).random((160, 160, 160), np.float32))
    mask = np.ones((160, 160, 160), bool, order="F")
    calls = {
        "mesh": lambda: isospline.Mesh(vertices, faces, vertices, vertices),
        "mask": lambda: isospline.Isosurface(volume, 0.5, mask=mask),
    }
    thread = threading.Thread(target=calls[make])
    ticks = 0
    thread.start()
    while thread.is_alive():
        ticks += 1
        time.sleep(1e-3)
    assert ticks >= 5


@pytest.mark.long
def test_many_scenes_live():
    """There are more scenes than Embree allows devices."""
    mesh = isospline.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    scenes = [isospline.Scene([mesh]) for _ in range(100000)]
    ray = [(0.2, 0.2, -1, 0, 0, 1)]
    for scene in scenes[:3000]:
        assert scene.cast_rays(ray)["t_hit"][0] == 1
