"""Measure another revision and the working tree in turns; see bench/README.md, "Against another revision".

Each has a process of its own, in which its package answers the same calls with the same rays. The answers are
compared. The result is a table of new and old for each volume, view and operation, and how many times better the new
one is.
"""

import argparse
import json
import statistics
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from suite import machine, subjects
from suite.clock import measure_outliers_again, spread
from suite.levels import shared_ray, two_levels
from suite.revision import Process, package_of
from suite.tables import Number, cell, markdown_table, with_spread
from suite.views import CAMERAS, from_the_surface, in_tiles, unit

import isospline

AMBIENT = 4  # rays of ambient occlusion from a point
DIFFERENT = 1e-3  # share of answers that may differ: rays that touch a surface


@dataclass
class Operation:
    """What is measured: a method of the worker, its arguments, and how results are shown."""

    name: str  # of the row
    method: str
    arguments: dict
    threads: int  # 0 for all
    rays: str = ""  # the file of rays that the rate counts
    settled: bool = True  # whether the settled index makes a row of its own


def operations(size):
    """All rows, by name; each has one operation for each view, or one for a volume."""
    table = {}
    for view in CAMERAS:

        def add(name, method, rays="", threads=1, settled=True, view=view, **arguments):
            if rays:
                arguments["rays"] = rays = f"{view}-{rays}"
            table.setdefault(name, {})[view] = Operation(name, method, arguments, threads, rays, settled)

        add("packets", "cast", "primary", coherent=True)
        add("single", "cast", "primary", coherent=False)
        add("default", "cast", "primary", coherent=None)
        add("bounce", "cast", "bounce", coherent=None)
        add("ambient", "occlusions", "ambient", coherent=None)
        add("shadow", "occlusions", "shadow", coherent=True)
        add("render", "picture", threads=0, camera=view, size=size, shadows=False)
        add("render_shadows", "picture", threads=0, camera=view, size=size, shadows=True)
    table["level"] = {"-": Operation("level", "level", {}, 0, settled=False)}
    picture = {"camera": "whole", "size": size}
    table["level_picture"] = {"-": Operation("level_picture", "level_and_picture", picture, 0, settled=False)}
    table["memory"] = {"-": Operation("memory", "memory", {"rays": "whole-primary"}, 0, settled=False)}
    table["prefilter"] = {"-": Operation("prefilter", "prefilter", {}, 0, settled=False)}
    return table


def parse(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("revision", metavar="REV", help="a commit, or the folder of a built tree")
    names = operations((64, 64))
    parser.add_argument("rows", nargs="*", metavar="ROW", help=f"of {', '.join(names)} (default: all)")
    parser.add_argument("--volumes", default="", metavar="TEXT", help="only volumes whose name contains this")
    parser.add_argument("--quick", action="store_true", help="small procedural volumes and few rays: about a minute")
    parser.add_argument("--size", type=int, default=512, help="of the square images, a multiple of 4 (default: 512)")
    parser.add_argument("--repetitions", type=int, default=5, help="(default: 5)")
    parser.add_argument("--degree", type=int, choices=(1, 2, 3), default=2, help="(default: 2)")
    parser.add_argument("--output", type=Path, default=Path("out/bench"), help="folder of against.json, against.md")
    options = parser.parse_args(arguments)
    if unknown := [name for name in options.rows if name not in names]:
        parser.error(f"ROW: expected some of {', '.join(names)}, got {', '.join(unknown)}")
    if options.quick:
        options.size, options.repetitions = min(options.size, 128), min(options.repetitions, 3)
    if options.size < 4 or options.size % 4:
        parser.error(f"--size: expected a multiple of 4, got {options.size}")
    if options.repetitions < 1:
        parser.error(f"--repetitions: expected 1 or more, got {options.repetitions}")
    options.rows = options.rows or list(names)
    return options


def all_subjects(options):
    """Procedural volumes, smooth, thin and noisy, and the real ones of 128^3 cells or more."""
    size = 64 if options.quick else 256
    for name, make in {
        "gyroid": lambda: next(subjects.procedural(("gyroid",), (size,))),
        "heart": lambda: next(subjects.procedural(("heart",), (size,))),
        "noisy": lambda: subjects.noisy(size),
    }.items():
        if options.volumes.lower() in f"{name} {size}":
            yield make()
    if not options.quick:
        yield from (subject for subject in subjects.real(options.volumes) if subject.data.size >= 128**3)


def write(subject, folder, size, degree):
    """A subject, its cameras and its rays, as the workers read them."""
    volume = isospline.Volume(subject.data, degree=degree, **subject.grid)
    surface = isospline.Isosurface(volume, subject.level)
    scene = isospline.Scene([surface])
    cameras = {view: make(scene, (size, size)) for view, make in CAMERAS.items()}
    levels = two_levels(subject)
    generator = np.random.default_rng(0)
    offset = 0.01 * float(np.min(volume.spacing))
    for view, camera in cameras.items():
        rays = in_tiles(camera.rays((size, size)))
        hits = scene.cast_rays(rays, coherent=True)
        count = int(np.isfinite(hits["t_hit"]).sum())
        bounce = from_the_surface(rays, hits, count, generator, offset)
        ambient = from_the_surface(rays, hits, AMBIENT * count, generator, offset)
        to_light = np.asarray(camera.eye) + np.linalg.norm(np.diff(volume.bounds, axis=0)) * light_side(camera)
        shadow = np.concatenate([bounce[:, :3], to_light - bounce[:, :3]], axis=1)
        ambient[:, 3:] *= 0.1 * np.linalg.norm(np.diff(volume.bounds, axis=0))  # up to t = 1
        for name, of_view in {"primary": rays, "bounce": bounce, "ambient": ambient, "shadow": shadow}.items():
            np.save(folder / f"{view}-{name}.npy", of_view)
    np.save(folder / "middle.npy", shared_ray(surface, scene, levels, cameras["whole"]))
    np.save(folder / "samples.npy", subject.data)
    description = {
        "grid": {name: np.asarray(value).tolist() for name, value in subject.grid.items()},
        "level": subject.level,
        "step": levels[0] - levels[1],
        "cameras": {
            view: {
                "eye": camera.eye.tolist(),
                "target": camera.target.tolist(),
                "up": camera.up.tolist(),
                "field_of_view": camera.field_of_view,
            }
            for view, camera in cameras.items()
        },
    }
    (folder / "subject.json").write_text(json.dumps(description), encoding="utf-8")


def light_side(camera):
    """A direction to the upper left of the camera."""
    right = unit(np.cross(camera.target - camera.eye, camera.up)[None])[0]
    return 0.5 * (np.asarray(camera.up) - right)


def compare(operation, processes, folder, repetitions):
    """A result for each way but the old one."""
    for process in processes.values():
        process.renew(threads=operation.threads, settled=process.settled and operation.settled)
    if operation.method == "memory":
        values = {way: [process.memory(**operation.arguments) / 1e6] for way, process in processes.items()}
        return "MB", values, {}
    answers = {}
    for way, process in processes.items():
        path = folder / f"answer-{way}.npy"
        process.run(operation=operation.method, save=str(path), **operation.arguments)
        answers[way] = np.load(path)
    different = {way: share_of_different(answer, answers["old"]) for way, answer in answers.items()}
    seconds = {way: [] for way in processes}
    for repetition in range(repetitions):
        for way in list(processes) if repetition % 2 == 0 else reversed(list(processes)):
            seconds[way].append(processes[way].time())
    measure_outliers_again(seconds, lambda ways: {way: processes[way].time() for way in ways})
    if not operation.rays:
        return "ms", {way: [1e3 * time for time in times] for way, times in seconds.items()}, different
    rays = len(np.load(folder / f"{operation.rays}.npy", mmap_mode="r"))
    return "Mray/s", {way: [rays / time / 1e6 for time in times] for way, times in seconds.items()}, different


def share_of_different(answer, expected):
    """The share of numbers that differ by more than 1e-5 of the largest, or of truth values that differ."""
    answer, expected = (np.asarray(values, np.float64) for values in (answer, expected))
    largest = np.abs(expected[np.isfinite(expected)]).max(initial=0)
    return float((~np.isclose(answer, expected, rtol=0, atol=1e-5 * largest)).mean())


def results(options, processes):
    """One result for each volume, operation and view, and for each way to answer but the old one."""
    table = operations((options.size, options.size))
    for subject in all_subjects(options):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            write(subject, folder, options.size, options.degree)
            for process in processes.values():
                process.load(folder=name, degree=options.degree)
            for row in options.rows:
                for view, operation in table[row].items():
                    unit, values, different = compare(operation, processes, folder, options.repetitions)
                    for way in values:
                        if way == "old" or (way == "settled" and not operation.settled):
                            continue
                        yield {
                            "row": row if way == "new" else f"{row}, {way}",
                            "subject": subject.name,
                            "view": view,
                            "unit": unit,
                            "new": spread(values[way]),
                            "old": spread(values["old"]),
                            "ratio": spread(ratios(unit, values[way], values["old"])),
                            "different": different.get(way, 0.0),
                        }


def ratios(unit, new, old):
    """How many times better the new one is, for each pair of measurements that were made after each other."""
    return [a / b if unit == "Mray/s" else b / a for a, b in zip(new, old)]


HEADER = ("operation", "volume", "view", "unit", "new", "old", "new : old", "answers differ")


def line_of(result):
    different = Number(f"{result['different']:.1e}" if result["different"] else "0")
    numbers = (with_spread(result[name]) for name in ("new", "old", "ratio"))
    return (result["row"], result["subject"], result["view"], result["unit"], *numbers, different)


def summary_of(found):
    """The median and the worst ratio of each row."""
    lines = []
    for row in dict.fromkeys(result["row"] for result in found):
        of_row = {f"{r['subject']}, {r['view']}": r["ratio"]["median"] for r in found if r["row"] == row}
        worst = min(of_row, key=of_row.get)
        lines.append((row, float(statistics.median(of_row.values())), of_row[worst], worst))
    return markdown_table(("operation", "median", "worst", "where"), lines)


def main(arguments=None):
    options = parse(arguments)
    processes = {"new": Process(), "old": Process(package_of(options.revision))}
    if processes["new"].module()["settled"]:
        processes["settled"] = Process(settled=True)
    print(" | ".join(HEADER), flush=True)
    found = []
    for result in results(options, processes):
        found.append(result)
        print(" | ".join(map(cell, line_of(result))), flush=True)
    for process in processes.values():
        process.close()
    if not found:
        raise SystemExit(f"--volumes: expected a part of the name of a volume, got {options.volumes}")
    summary = {"revision": options.revision, "machine": machine.describe(), "results": found}
    options.output.mkdir(parents=True, exist_ok=True)
    (options.output / "against.json").write_text(json.dumps(summary, indent=1), encoding="utf-8")
    text = f"{summary_of(found)}\n\n{markdown_table(HEADER, map(line_of, found))}\n"
    (options.output / "against.md").write_text(text, encoding="utf-8")
    print(f"\n{summary_of(found)}\n{options.output / 'against.md'}", flush=True)
    if wrong := sorted({result["row"] for result in found if result["different"] > DIFFERENT}):
        raise SystemExit(f"more than {DIFFERENT:g} of the answers differ in: {', '.join(wrong)}")


if __name__ == "__main__":
    main()
