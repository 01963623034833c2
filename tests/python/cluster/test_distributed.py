"""Pictures from Dask clusters: the same as those of one process, bit for bit, even if workers are killed."""

import os
import random
import re
import shutil
import signal
from pathlib import Path

import numpy as np
import pytest
from spheres import mesh_sphere

import isospline

distributed = pytest.importorskip("distributed")
pytest.importorskip("zarr")

from isospline.distributed import cluster as clusters
from isospline.distributed import picture, tasks, windows

SIZE = (90, 70)
LIMIT = 1_000_000_000
LAYERS = ("depth", "position", "normal", "albedo", "gradient_magnitude", "curvature", "geometry_ids", "primitive_ids")


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    field = isospline.volumes.gyroid()
    out = tmp_path_factory.mktemp("stores") / "gyroid.zarr"
    grid = field.grid(72)
    return isospline.convert(field.values(72), out, chunk=16, **grid)


@pytest.fixture(scope="module")
def scene(store):
    return tasks.open_scene(store, 0.1, LIMIT)


@pytest.fixture(scope="module")
def camera(scene):
    return isospline.camera_for(scene, view=(2, -3, 1), size=SIZE)


# All that one worker does, two do as well.
@pytest.fixture(scope="module", params=[pytest.param(1, marks=pytest.mark.long), 2])
def client(request):
    with clusters.local_cluster(request.param, LIMIT) as cluster, distributed.Client(cluster) as client:
        yield client


@pytest.fixture
def shuffled(monkeypatch):
    """Windows are requested in a different order each time."""
    split = windows.split
    monkeypatch.setattr(picture, "split", lambda *given: random.sample(found := split(*given), len(found)))


LOOKS = {
    "layers": dict(light=isospline.Phong(), layers=LAYERS),
    "samples": dict(light=isospline.Outline(2), samples=4, background=(0.2, 0.4, 0.6, 0.5), layers=("depth", "mask")),
    "srgb8": dict(light="phong", samples=3, encoding="srgb8", background="white"),
}
OF_TILES = {
    "occlusion": dict(light=isospline.AmbientOcclusion(4), layers=("ambient_occlusion",)),
    "translucent": dict(light=isospline.Phong(opacity=0.5, shadows=True), samples=2),
    "path tracer": dict(light=isospline.PathTracer(max_bounces=2), samples=2, layers=("variance", "depth")),
    "environment": dict(environment=(0.2, 0.5, 1.0), samples=2),
    "path tracer in an environment": dict(light=isospline.PathTracer(lights=[]), environment=0.5, samples=2),
    "studio": dict(light=isospline.Studio(), background="white", annotate="scale_bar", unit="mm"),
    "default": dict(layers=("mask",)),
}


@pytest.mark.sweep(6)
@pytest.mark.slow
@pytest.mark.parametrize("look", [*LOOKS, *OF_TILES])
def test_tiles_make_the_picture_of_one_process(client, scene, camera, store, look, shuffled):
    options = dict(size=SIZE, **(LOOKS | OF_TILES)[look])
    given = dict(scene=scene) if look == "layers" else dict(scene=store, level=0.1, memory_limit=LIMIT)
    shown = dict(scene=scene) if look == "layers" else dict(scene=store, level=0.1)
    expected = isospline.render(**shown, camera=camera, **options)
    got = isospline.distributed.render(**given, camera=camera, client=client, tile_size=(37, 23), **options)
    assert got == expected


@pytest.mark.sweep(3)
@pytest.mark.parametrize("look", LOOKS)
@pytest.mark.parametrize("count", [1, 5])
def test_parts_make_the_picture_of_one_process(client, scene, camera, look, count, shuffled):
    options = dict(size=SIZE, **LOOKS[look])
    expected = isospline.render(scene, camera, **options)
    got = isospline.distributed.render(
        scene, camera, client=client, by="parts", parts=count, tile_size=(64, 64), **options
    )
    assert got == expected


def test_a_crop_and_volumes_in_memory_travel_too(client, camera):
    field = isospline.volumes.torus()
    volume = field.volume(24)
    rule = isospline.ColorByVolume(volume, cmap=[(0, 0, 1), (1, 0, 0)], limits=(0, 1))
    options = dict(size=SIZE, crop=(11, 7, 50, 41), light=isospline.Phong(color=rule))
    surface = isospline.Isosurface(volume, field.level)
    expected = isospline.render(surface, camera, **options)
    assert isospline.distributed.render(surface, camera, client=client, tile_size=(20, 20), **options) == expected


def colored(store, rule):
    """An isosurface of a store and a mesh with values, in front of each other, in the colours of a rule."""
    volume = isospline.open_volume(store, memory_limit=LIMIT)
    surface = isospline.Isosurface(volume, 0.1, name="gyroid", color=rule)
    ball = mesh_sphere(1.0, 16)
    lower, upper = surface.bounds
    vertices = ball.vertices * (upper - lower) / 3 + (lower + upper) / 2 - (upper - lower) * (0, 0.5, 0)
    mesh = isospline.Mesh(vertices, ball.faces, values=vertices[:, 2], values_name="height in mm", name="ball")
    return isospline.Scene([surface, mesh])


def rules(store):
    ball = mesh_sphere(1.0, 8)
    return {
        "distance from a mesh": isospline.ColorByDistance(isospline.Mesh(ball.vertices, ball.faces)),
        "distance from a surface": isospline.ColorByDistance(colored(store, None).object(0), signed=False),
        "thickness": isospline.ColorByThickness(),
        "value": isospline.ColorByValue(),
    }


MARKS = {"annotate": True, "legend": True, "unit": "mm", "background": "white"}


@pytest.mark.sweep(4)
@pytest.mark.parametrize(
    ("rule", "options"),
    [
        ("distance from a mesh", dict(light=isospline.Studio(light_samples=1, fast=True))),
        ("distance from a mesh", dict(by="parts", parts=3)),
        ("distance from a surface", dict(light="unlit", **MARKS)),
        ("distance from a surface", dict(by="parts", samples=2)),
        ("thickness", dict(light="phong", **MARKS)),
        ("thickness", dict(by="parts", parts=3, layers=("albedo",))),
        ("value", dict(light=isospline.AmbientOcclusion(2), **MARKS)),
        ("value", dict(by="parts", encoding="srgb8")),
    ],
)
def test_colors_by_other_things_are_those_of_one_process(client, store, rule, options, shuffled):
    shown = colored(store, rules(store)[rule])
    options = dict(size=SIZE, **options)
    of_cluster = {name: options.pop(name) for name in ("by", "parts") if name in options}
    expected = isospline.render(shown, **({"light": "phong"} if of_cluster else {}), **options)
    got = isospline.distributed.render(shown, client=client, tile_size=(37, 23), **of_cluster, **options)
    assert got == expected
    assert len(np.unique(expected.to_srgb().reshape(-1, 4), axis=0)) > 100


def test_the_color_of_a_store_is_that_of_one_process(client, store):
    options = dict(level=0.1, size=SIZE, color=isospline.ColorByThickness(label="wall"), annotate=True)
    got = isospline.distributed.render(store, client=client, memory_limit=LIMIT, **options)
    assert got == isospline.render(store, **options)


@pytest.mark.parametrize("by", ["tiles", "parts"])
@pytest.mark.parametrize("size", [(24, 18), (160, 120)])
def test_the_scale_and_the_closed_border_of_a_store_are_those_of_one_process(client, store, by, size):
    options = dict(level=0.1, size=size, light="phong", layers=("primitive_ids",))
    got = isospline.distributed.render(store, client=client, by=by, memory_limit=LIMIT, **options)
    assert got == isospline.render(store, **options)


@pytest.mark.parametrize("by", ["tiles", "parts"])
@pytest.mark.parametrize("annotate", [None, "colorbar"])
def test_rules_and_bars_of_a_store_measure_the_scale_that_is_shown(client, store, by, annotate):
    """Here the scale is a coarser one than the overview, whose walls have other thicknesses."""
    wall = isospline.ColorByThickness(label="wall")
    camera = isospline.OrthographicCamera((0, -9, 0), (0, 0, 0), (0, 0, 1), height=4.0)
    options = dict(level=0.1, size=(48, 36), light="phong", color=wall, annotate=annotate)
    got = isospline.distributed.render(store, camera, client=client, by=by, memory_limit=LIMIT, **options)
    assert got == isospline.render(store, camera, **options)


def test_batches_tell_the_progress_of_their_pictures(client, scene, camera):
    told = []
    pictures = [{"camera": camera, "progress": told.append}, {"camera": camera}]
    assert len(list(isospline.distributed.render_batch(scene, pictures, client=client, size=(40, 30)))) == 2
    assert told[0] == 0.0 and told[-1] == 1.0 and told == sorted(told)


@pytest.mark.slow
def test_batches_are_made_in_order(client, store, scene):
    cameras = isospline.turntable_cameras(scene, 4, size=(40, 30))
    own = [{"camera": each, "level": level} for each in cameras for level in (0.0, 0.2)]
    own.append({"camera": cameras[0], "scene": scene})  # another time step
    expected = [
        isospline.render(store, each["camera"], level=each["level"], size=(40, 30), light="phong") for each in own[:-1]
    ]
    own[-1]["level"] = None
    expected.append(isospline.render(scene, cameras[0], size=(40, 30), light="phong"))
    got = isospline.distributed.render_batch(
        store, iter(own), client=client, size=(40, 30), tile_size=(16, 16), memory_limit=LIMIT, light="phong"
    )
    assert list(got) == expected


def test_workers_stay_under_their_limit(client, store, camera):
    isospline.distributed.render(store, camera, level=0.1, client=client, size=SIZE, memory_limit=LIMIT)
    # The peak of getrusage includes the memory of the process that started the worker.
    peaks = client.run(lambda: re.search(r"VmHWM:\s*(\d+)", Path("/proc/self/status").read_text(encoding="ascii"))[1])
    peaks = {worker: 1024 * int(kilobytes) for worker, kilobytes in peaks.items()}
    assert max(peaks.values()) < LIMIT, peaks


@pytest.mark.parametrize(
    ("given", "kind", "message"),
    [
        (dict(by="rows"), ValueError, "^by: expected 'tiles' or 'parts', got 'rows'"),
        (dict(parts=3), ValueError, "^parts: cannot be combined with by='tiles'"),
        (dict(by="parts", parts=0), ValueError, "^parts: expected a whole number of at least 1"),
        (
            dict(by="parts", light=isospline.PathTracer()),
            ValueError,
            "^light: a PathTracer cannot be combined with by='parts'",
        ),
        (dict(by="parts", light=isospline.Phong(shadows=True)), ValueError, "^shading: expected opaque surfaces"),
        (dict(by="parts", light=isospline.Phong(opacity=0.5)), ValueError, "^shading: expected opaque surfaces"),
        (dict(by="parts", layers=("ambient_occlusion",)), ValueError, "^shading: expected opaque surfaces"),
        (
            dict(by="parts", light=isospline.Phong(color=isospline.ColorByDepth(cmap=[(0, 0, 0), (1, 1, 1)]))),
            ValueError,
            "^shading: expected limits of ColorByDepth",
        ),
        (dict(level=0.1), ValueError, "^level: cannot be combined with a Scene"),
        (dict(workers=2), ValueError, "^workers: cannot be combined with a client"),
        (dict(tile_size=(0, 4)), ValueError, "^tile_size: expected at least 1 x 1 pixels, got 0 x 4"),
        (dict(tile_size=16), TypeError, "^tile_size: expected 2 whole numbers, got"),
        (dict(size=(0, 4)), ValueError, "^size: expected at least 1 x 1 pixels"),
        (dict(crop=(0, 0, 91, 4)), ValueError, "^crop: expected columns and rows within 90 x 70 pixels"),
        (dict(crop=(0, 0, 4, 4), annotate="scale_bar"), ValueError, "^annotate: cannot be combined with a crop"),
        (dict(crop=(0, 0, 4, 4), legend=True), ValueError, "^legend: cannot be combined with a crop"),
        (dict(light="studio", environment=1.0), ValueError, "^environment: expected light=.* got 'studio'"),
        (dict(by="parts", environment=1.0), ValueError, "^light: a PathTracer cannot be combined with by='parts'"),
        (dict(samples=0), ValueError, "^samples: expected"),
        (dict(colour=1), TypeError, "colour"),
        (dict(scene=7), TypeError, "^scene: expected a Scene, an Isosurface, a Mesh, .* an array or a file, got"),
        (dict(scene="no.zarr"), TypeError, "^level: expected a number for the folder of a store, got None"),
        (dict(scene="no.zarr", level=1.0), OSError, "no.zarr"),
        (dict(memory_limit="much"), ValueError, "^memory_limit: expected bytes"),
    ],
    ids=str,
)
def test_bad_input_is_refused(client, scene, camera, given, kind, message):
    given = dict(scene=scene, client=client, size=SIZE) | given
    with pytest.raises(kind, match=message):
        isospline.distributed.render(given.pop("scene"), camera, **given)


def test_parts_are_of_stores(client, camera):
    field = isospline.volumes.torus()
    surface = isospline.Isosurface(field.volume(16), field.level)
    with pytest.raises(ValueError, match="^by: expected 'tiles' for a scene with a volume in memory"):
        isospline.distributed.render(surface, camera, client=client, by="parts")


def test_a_broken_chunk_is_named(client, store, camera, tmp_path):
    broken = tmp_path / "broken.zarr"
    shutil.copytree(store, broken)
    for shard in (broken / "coefficients" / "0" / "c").rglob("*"):
        if shard.is_file():
            damaged = bytearray(shard.read_bytes())
            damaged[::1000] = bytes(255 - byte for byte in damaged[::1000])
            shard.write_bytes(damaged)
    with pytest.raises(OSError, match=r"broken\.zarr"):
        isospline.distributed.render(broken, camera, level=0.1, client=client, size=SIZE)


def test_progress_cancels(client, scene, camera):
    seen = []
    with pytest.raises(isospline.Cancelled):
        isospline.distributed.render(
            scene,
            camera,
            client=client,
            size=SIZE,
            tile_size=(10, 10),
            progress=lambda part: seen.append(part) or part < 0.3,
        )
    assert seen[0] == 0 and 0.3 <= seen[-1] < 1


#: Arguments of the command line, but for the output.
RENDERED = ["--level", "0.1", "--size", "64x48", "--quiet", "--fast"]


# docs/distributed.md has this command, and a scheduler's pictures are compared in test_cli_cluster.py.
@pytest.mark.long
def test_the_command_line_renders_on_workers(store, tmp_path):
    from isospline.cli.main import main

    given = ["render", str(store), *RENDERED]
    assert main([*given, "-o", str(tmp_path / "one.exr")]) == 0
    assert main([*given, "-o", str(tmp_path / "two.exr"), "--workers", "2"]) == 0
    one, two = (pixels_of(tmp_path / name) for name in ("one.exr", "two.exr"))
    assert (one == two).all()


def test_options_of_workers_that_cannot_be_combined_are_refused(store, tmp_path, capsys):
    from isospline.cli.main import main

    given = ["render", str(store), *RENDERED]
    for more, message in (
        (["--workers", "0"], "at least 1"),
        (["--workers", "2", "--scheduler", "tcp://127.0.0.1:1"], "--workers cannot be combined with --scheduler"),
        (["--workers", "2", "--threads", "2"], "--threads"),
        (["--workers", "2", "--light", "path-trace", "--noise", "0.1"], "--noise"),
        (["--scheduler", "nonsense"], "--scheduler: expected the address of a Dask scheduler"),
    ):
        try:
            status = main([*given, "-o", str(tmp_path / "three.exr"), *more])
        except SystemExit as ended:
            status = ended.code
        assert status == 2 and message in capsys.readouterr().err, more


def pixels_of(path):
    OpenEXR = pytest.importorskip("OpenEXR")
    with OpenEXR.File(str(path)) as file:
        return file.channels()["RGBA"].pixels


@pytest.mark.slow
def test_a_killed_worker_costs_no_pixels(client, scene, camera):
    options = dict(size=SIZE, light=isospline.AmbientOcclusion(8), samples=4, layers=LAYERS)
    expected = isospline.render(scene, camera, **options)
    before = client.run(os.getpid)
    killed = []

    def progress(fraction):
        if fraction > 0.2 and not killed:
            killed.append(next(iter(before.values())))
            os.kill(killed[0], signal.SIGKILL)

    got = isospline.distributed.render(scene, camera, client=client, tile_size=(10, 10), progress=progress, **options)
    assert got == expected and killed
    client.wait_for_workers(len(before), timeout=30)
    assert killed[0] not in client.run(os.getpid).values()
