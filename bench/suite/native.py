"""The C++ benchmarks: the subjects that they read, and their times."""

import json
import os
import re
import subprocess
import tempfile
from pathlib import Path

import isospline

from . import polygons
from .clock import measure_outliers_again
from .peers import Skipped
from .views import close_camera, whole_camera

PROGRAM = Path(__file__).resolve().parents[2] / "build" / "release" / "bench" / "isospline_bench"
SECONDS = {False: 0.2, True: 0.01}  # the least time of a repetition, by whether the run is quick


def measure(subject, settings, names, whole=None):
    """What the named benchmarks of bench/cpp measure with a subject: a dict of name to a dict with
    `seconds` of all repetitions and the counters. `whole` is the camera of the whole view, by default that of the
    scene."""
    with tempfile.TemporaryDirectory() as folder:
        write(subject, Path(folder), settings, whole)
        least = SECONDS[settings.quick]
        found = run(folder, names, settings.repetitions, least)

        def again(some):
            return {name: result["seconds"][0] for name, result in run(folder, some, 1, least).items()}

        measure_outliers_again({name: result["seconds"] for name, result in found.items()}, again)
    return found


def write(subject, folder, settings, whole=None):
    """A subject with its mesh and its two views, as bench/cpp/subjects.h reads it."""
    volume = isospline.Volume(subject.data, **subject.grid)
    scene = isospline.Scene([isospline.Isosurface(volume, subject.level)])
    vertices, faces = polygons.marching_cubes(subject, volume.affine)
    lines = {
        "name": [subject.name],
        "type": [subject.data.dtype.name],
        "shape": subject.data.shape[::-1],
        "spacing": volume.spacing,
        "origin": volume.origin,
        "level": [subject.level],
        "size": settings.size,
        "ambient_count": [settings.incoherent_rays],
        "whole": numbers(whole or whole_camera(scene, settings.size)),
        "close": numbers(close_camera(scene, settings.size)),
    } | {f"axis{axis}": volume.direction[:, axis] for axis in range(3)}
    text = "".join(f"{name} {' '.join(map(str, values))}\n" for name, values in lines.items())
    (folder / "subject.txt").write_text(text, encoding="utf-8")
    subject.data.astype(subject.data.dtype.newbyteorder("="), copy=False).tofile(folder / "samples")
    vertices.astype("float32").tofile(folder / "vertices.float32")
    faces.astype("uint32").tofile(folder / "faces.uint32")


def numbers(camera):
    return [*camera.eye, *camera.target, *camera.up, camera.field_of_view]


def run(folder, names, repetitions, seconds):
    """Like `measure`, with a subject that has been written. The repetitions of all benchmarks run in a random order."""
    if not PROGRAM.exists():
        raise Skipped(f"there is no {PROGRAM.name}: cmake --build --preset release makes it")
    path = Path(folder) / "times.json"
    command = [
        PROGRAM,
        f"--benchmark_filter=^({'|'.join(map(re.escape, names))})/",
        f"--benchmark_out={path}",
        f"--benchmark_repetitions={repetitions}",
        "--benchmark_enable_random_interleaving=true",
        f"--benchmark_min_time={seconds}",
    ]
    environment = os.environ | {"ISOSPLINE_BENCH_SUBJECT": str(folder)}
    done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False, env=environment)
    if done.returncode != 0:
        raise RuntimeError(f"{PROGRAM.name} ended with status {done.returncode}: {done.stderr.strip()[-300:]}")
    found = {}
    for result in json.loads(path.read_text(encoding="utf-8"))["benchmarks"]:
        if result["run_type"] != "iteration":
            continue
        name = result["name"].removesuffix("/real_time")
        counters = {key: result[key] for key in ("hit", "rays", "memory") if key in result}
        entry = found.setdefault(name, {"seconds": []} | counters)
        entry["seconds"].append(1e-3 * result["real_time"])
    if missing := set(names) - set(found):
        raise RuntimeError(f"{PROGRAM.name} has no {', '.join(sorted(missing))}")
    return found
