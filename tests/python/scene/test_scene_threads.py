"""Several threads change a scene while others query it: each answer belongs to one state of the scene."""

import itertools
import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from spheres import mesh_sphere, moved, sphere

import isospline


def run(*calls):
    """Runs calls in separate threads, and raises their exceptions."""
    errors = []

    def guarded(call):
        try:
            call()
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=guarded, args=(call,)) for call in calls]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    if errors:
        raise errors[0]


def test_threads_see_one_state_of_a_scene():
    """Levels, transforms and visibility change in two threads; every answer belongs to one state of the scene."""
    surface, mesh = sphere(), mesh_sphere(6.0, 64)
    scene = isospline.Scene([surface])
    scene.add(mesh)
    rays = np.tile([(11.4, 11.3, 60.0, 0.0, 0.0, -1.0)], (2000, 1))
    camera = isospline.PerspectiveCamera((60, -40, 30), (11.5, 11.5, 15))
    levels, places = [36.0, 49.0, 64.0], [moved(11.5, 11.5, z) for z in (0.0, 10.0, 30.0)]

    def answer():
        return scene.cast_rays(rays[:1])["t_hit"][0], isospline.render(
            scene, camera, size=(16, 12), light="phong"
        ).color.tobytes()

    states = set()
    for level in levels:
        surface.level = level
        for place in places:
            scene.set_transform(1, place)
            for seen in (True, False):
                scene.set_visibility(1, visible=seen)
                states.add(answer())
    distances, pictures = ({state[part] for state in states} for part in (0, 1))
    # The place of a mesh may change the last bit of a hit elsewhere, as coordinates are relative to the scene's middle.
    assert len(set(np.round(list(distances), 9))) == 4 and len(pictures) > 6
    stop, found, seen = threading.Event(), set(), set()

    def change_level():
        end = time.monotonic() + 60
        for i in itertools.count():
            surface.level = levels[i % 3]
            if (i >= 60 and len(found) > 2 and len(seen) > 2) or time.monotonic() > end:
                break
        stop.set()

    def change_place():
        while not stop.is_set():
            for place in places:
                scene.set_visibility(1, visible=True)
                scene.set_transform(1, place)
                scene.set_visibility(1, visible=False)

    def query():
        while not stop.is_set():
            t = np.unique(scene.cast_rays(rays, coherent=True)["t_hit"])
            assert len(t) == 1
            found.add(t[0])

    def draw():
        while not stop.is_set():
            seen.add(isospline.render(scene, camera, size=(16, 12), light="phong").color.tobytes())

    run(change_level, change_place, query, draw)
    assert found <= distances and seen <= pictures
    assert len(found) > 2 and len(seen) > 2


def test_threads_read_the_cells_of_one_level():
    surface, levels = sphere(), [4.0, 100.0]
    expected = set()
    for level in levels:
        surface.level = level
        expected.add(surface.shell.cells.tobytes())
    assert len(expected) == 2
    stop, found = threading.Event(), set()

    def change():
        end = time.monotonic() + 60
        for i in itertools.count():
            surface.level = levels[i % 2]
            if (i >= 200 and len(found) >= 2) or time.monotonic() > end:
                break
        stop.set()

    def read():
        while not stop.is_set():
            found.add(surface.shell.cells.tobytes())
            assert surface.shell.mask.sum() in [len(cells) // 12 for cells in expected]

    run(change, read, read)
    assert found == expected


def test_threads_ask_for_all_that_a_changing_scene_tells():
    """Eight threads, three of which change levels and places: each answer belongs to one state of the scene."""
    surface, other, mesh = sphere(), sphere(), mesh_sphere(6.0, 32)
    scene = isospline.Scene([surface])
    scene.add(other, transform=moved(40.0, 0.0, 0.0))
    scene.add(mesh)
    levels, places = [16.0, 64.0], [moved(0.0, 0.0, -60.0), moved(0.0, 0.0, 90.0)]
    rays = np.array([(11.4, 11.3, 60.0, 0.0, 0.0, -1.0), (51.4, 11.3, 60.0, 0.0, 0.0, -1.0)])
    camera = isospline.PerspectiveCamera((60, -40, 30), (11.5, 11.5, 15))
    boxes, spots = set(), set()
    for level, other_level, place in itertools.product(levels, levels, places):
        surface.level, other.level = level, other_level
        scene.set_transform(2, place)
        boxes.add(scene.bounds.tobytes())
        spots.add(scene.cast_rays(rays)["t_hit"].tobytes())
    hits = scene.cast_rays(rays)
    positions = rays[:, :3] + hits["t_hit"][:, None] * rays[:, 3:]
    assert len(boxes) >= 4 and len(spots) >= 4
    stop, asked = threading.Event(), [0] * 5

    def change_level(changed):
        for i in itertools.count():
            if stop.is_set():
                break
            changed.level = levels[i % 2]

    def change_place():
        end = time.monotonic() + 60
        for i in itertools.count():
            scene.set_transform(2, places[i % 2])
            extra = scene.add(mesh, transform=places[i % 2], visible=False)
            scene.remove(extra)
            if (min(asked) > 20 and i > 100) or time.monotonic() > end:
                break
        stop.set()

    def until_stopped(thread, ask):
        def loop():
            try:
                while not stop.is_set():
                    ask()
                    asked[thread] += 1
            finally:
                stop.set()

        return loop

    def bounds():
        box = scene.bounds
        assert box.tobytes() in boxes, box

    built = [0]

    def counts():
        count = scene.build_count
        assert count >= built[0] and scene.memory > 10_000 and len(scene) in (3, 4)
        built[0] = count

    def leave():
        """Hits of another level are valid, too: their cells exist at every level."""
        leaving = scene.secondary_rays(rays, hits, hits["primitive_normals"])
        np.testing.assert_allclose(leaving[:, :3], positions, atol=0.3)

    def cast():
        assert scene.cast_rays(rays)["t_hit"].tobytes() in spots
        assert scene.count_intersections(rays).tolist() == [2, 2]

    def draw():
        image = isospline.render(scene, camera, size=(16, 12), layers=("geometry_ids",), light="phong")
        assert set(np.unique(image.geometry_ids)) <= {0, 1, 2, isospline.INVALID_ID}

    run(
        lambda: change_level(surface),
        lambda: change_level(other),
        change_place,
        *(until_stopped(i, ask) for i, ask in enumerate((bounds, counts, leave, cast, draw))),
    )
    assert min(asked) > 20


FORK = """
import itertools
import os
import signal
import numpy as np
import isospline
from spheres import sphere

scene = isospline.Scene([sphere()])
rays = np.tile([-20.0, 11.4, 11.3, 1.0, 0.0, 0.0], (5000, 1))
before = scene.cast_rays(rays)["t_hit"]
child = os.fork()
signal.alarm(60)
same = np.array_equal(scene.cast_rays(rays)["t_hit"], before)
if child == 0:
    os._exit(0 if same else 1)
assert same
assert os.waitpid(child, 0)[1] == 0
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
def test_forked_processes_have_threads_of_their_own(repository):
    """The threads of earlier calls do not exist in a child process. Python itself warns of forks with threads."""
    command = [sys.executable, "-W", "ignore", "-c", FORK]
    done = subprocess.run(command, cwd=repository / "tests" / "python", check=False, timeout=120)
    assert done.returncode == 0
