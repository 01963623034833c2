"""One round: eight threads work on shared scenes, and each answer is compared with that of a quiet process."""

import argparse
import collections
import contextlib
import faulthandler
import os
import pickle
import random
import resource
import signal
import sys
import tempfile
import threading
import time
import traceback
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np
import OpenEXR
import PIL.Image

import isospline
from isospline import read_mesh

from . import world

THREADS = 8
#: Seconds without an end of any operation of a thread, after which the round counts as a deadlock.
PATIENCE = 240
FORKED = "this process was forked while another thread was at work"


class Mine(NamedTuple):
    """What an operation gets from its thread."""

    rng: random.Random
    folder: Path
    tight: bool


class Wrong(Exception):
    """An answer is not that of a quiet process."""


class Round:
    """The threads of a round, and what they count."""

    def __init__(self, subjects, folder, *, seed, tight):
        self.subjects, self.folder, self.seed, self.tight = subjects, folder, seed, tight
        self.counts, self.longest = collections.Counter(), collections.Counter()
        self.failures, self.last_end, self.sizes = [], {}, []
        self.begin, self.end = threading.Event(), None
        self._lock = threading.Lock()

    def run(self, seconds, spare):
        """Work until the time is over or something fails; the main thread is the one that signals interrupt.

        `spare` is the memory in bytes that threads may use beyond that of the start, or None.
        """
        for (
            operation,
            _,
        ) in OPERATIONS:  # modules are imported before memory is short: CPython does not survive that always
            operation(self.subjects[0], Mine(random.Random(0), self.folder / "0", False))
        self.end = time.monotonic() + seconds
        threads = [threading.Thread(target=self._work, args=(i, OPERATIONS)) for i in range(1, THREADS)]
        for thread in threads:
            thread.start()
        threading.Thread(target=self._watch, daemon=True).start()
        if spare is not None:
            limit = memory("VmData") + spare
            resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
        self.begin.set()
        self._work(0, INTERRUPTED)
        for thread in threads:
            thread.join()

    def is_over(self):
        """Whether threads end."""
        return bool(self.failures) or time.monotonic() > self.end

    def _work(self, index, operations):
        self.begin.wait()
        rng = random.Random(self.seed * THREADS + index)
        mine = Mine(rng, self.folder / str(index), self.tight)
        names, weights = zip(*((operation, weight) for operation, weight in operations))
        while not self.is_over():
            self.last_end[index] = time.monotonic()
            operation = rng.choices(names, weights)[0]
            subject = rng.choice(self.subjects)
            begin = time.monotonic()
            try:
                operation(subject, mine)
                outcome = "done"
            except MemoryError as error:
                outcome = "out of memory" if self.tight else f"FAILED {error!r}"
            except KeyboardInterrupt:
                outcome = "interrupted"
            except BaseException as error:
                refused = self.tight and isinstance(error, (RuntimeError, OSError)) and _says_memory(error)
                outcome = "out of memory" if refused else f"FAILED {error!r}\n{traceback.format_exc()}"
            with self._lock:
                name = operation.__name__
                self.counts[f"{name} {outcome.split()[0] if outcome.startswith('FAILED') else outcome}"] += 1
                self.longest[name] = max(self.longest[name], time.monotonic() - begin)
                if outcome.startswith("FAILED"):
                    self.failures.append(f"{name} of {subject.name}: {outcome}")
        self.last_end.pop(index, None)

    def _watch(self):
        while True:
            self.sizes.append(memory())
            time.sleep(0.5)
            for index, last in list(self.last_end.items()):
                if time.monotonic() - last > PATIENCE:
                    print(f"FAILED deadlock: thread {index} has been in one operation for {PATIENCE} s", flush=True)
                    faulthandler.dump_traceback()
                    os._exit(3)


def _says_memory(error):
    text = str(error).lower()
    return "memory" in text or "can't start new thread" in text or getattr(error, "errno", None) == 12


def check(subject, query, found):
    """Raise `Wrong` unless an answer is right in a state that the shared scene may have had."""
    if not subject.has_answer(query, found):
        raise Wrong(f"{query}: no state of {subject.name} has this answer")


# What threads do


def ask(subject, mine):
    """A query of the shared scene."""
    query = mine.rng.choice(list(world.QUERIES))
    check(subject, query, world.QUERIES[query](subject.shared))


def change_level(subject, mine):
    """Another level of the shared surface."""
    subject.shared.surface.level = mine.rng.choice(subject.levels)


def change_objects(subject, mine):
    """The mesh of the shared scene is moved, hidden, or removed and added."""
    with subject.changing:
        subject.shared.set_place(mine.rng.choice(world.PLACES), anew=mine.rng.random() < 0.5)


def build_anew(subject, mine):
    """A scene of a thread's own has exactly the answer of its state."""
    level, place = mine.rng.choice(subject.levels), mine.rng.choice(world.PLACES)
    built = subject.build(level, place)
    if mine.rng.random() < 0.5:
        built.scene.settle()
    for query in mine.rng.sample(list(world.QUERIES), 3):
        if world.QUERIES[query](built) != subject.answer(query, level, place):
            raise Wrong(f"{query} of a new scene: {subject.name}, level {level}, mesh at {place}")


def send(subject, mine):
    """A pickled scene arrives in a state that the shared one had."""
    scene = pickle.loads(pickle.dumps(subject.shared.scene))
    rays = world.RAYS
    check(subject, "cast_rays", world.digest_of_hits(scene.cast_rays(rays)))


def settle(subject, mine):
    """The settled index of the shared scene."""
    subject.shared.scene.settle()


def write_picture(subject, mine):
    """A file of a picture is complete and is replaced at once."""
    image = isospline.render(subject.shared.scene, world.CAMERA, size=(20, 16), light=isospline.Phong(shadows=True))
    check(subject, "picture", world.digest(image.color))
    mine.folder.mkdir(exist_ok=True)
    path = mine.folder / f"picture.{mine.rng.choice(['exr', 'exr' if mine.tight else 'png'])}"
    image.write(path)
    if mine.tight:  # other libraries, Pillow among them, do not always say that memory is short
        return
    if path.suffix == ".png":
        with PIL.Image.open(path) as file:
            file.load()
        return
    with OpenEXR.File(str(path)) as file:
        if world.digest(file.channels()["RGBA"].pixels) != world.digest(image.color):
            raise Wrong("an EXR file holds another picture")


def write_mesh(subject, mine):
    """A file of a mesh holds the mesh."""
    mesh = subject.shared.surface.to_mesh()
    check(subject, "to_mesh", world.digest_of_mesh(mesh))
    mine.folder.mkdir(exist_ok=True)
    mesh.write(mine.folder / "mesh.ply")
    if mine.tight:
        return
    found = read_mesh(mine.folder / "mesh.ply")
    same = found.vertices.shape == mesh.vertices.shape and np.allclose(found.vertices, mesh.vertices, rtol=1e-6)
    if not same or not np.array_equal(found.faces, mesh.faces):
        raise Wrong("a PLY file holds another mesh")


def cancel(subject, mine):
    """A picture is cancelled by its progress callback."""
    with contextlib.suppress(isospline.Cancelled):
        image = isospline.render(
            subject.shared.scene,
            world.CAMERA,
            size=(20, 16),
            light=isospline.Phong(shadows=True),
            progress=lambda fraction: fraction < 0.5,
        )
        check(subject, "picture", world.digest(image.color))


def fork(subject, mine):
    """A child of a busy process answers as its parent, or says that it was forked while another thread was at work."""
    query = mine.rng.choice(["cast_rays", "count_intersections", "contains", "picture"])
    child = os.fork()
    if child == 0:
        code = 1
        try:
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
            signal.alarm(PATIENCE // 2)
            code = 0 if subject.has_answer(query, world.QUERIES[query](subject.shared)) else 2
        except MemoryError:
            code = 0
        except RuntimeError as error:
            code = 0 if FORKED in str(error) else 1
        finally:
            os._exit(code)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code != 0:
        raise Wrong(f"{query} in a forked child of {subject.name}: exit code {code}")


def interrupt(subject, mine):
    """Ctrl-C in a query that takes a while."""
    calls = {
        "render": lambda: isospline.render(
            subject.shared.scene, world.CAMERA, size=(800, 600), light=isospline.AmbientOcclusion(16)
        ),
        "cast_rays": lambda: subject.shared.scene.cast_rays(np.tile(world.RAYS, (200, 1))),
        "closest_points": lambda: subject.shared.scene.closest_points(np.tile(world.POINTS, (200, 1))),
        "area": lambda: subject.shared.surface.area(),
        "level": lambda: [setattr(subject.shared.surface, "level", level) for level in subject.levels * 20],
    }
    signal.setitimer(signal.ITIMER_REAL, mine.rng.uniform(0.001, 0.2))  # a thread could not be started without memory
    try:
        calls[mine.rng.choice(list(calls))]()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)


OPERATIONS = (
    (ask, 60),
    (change_level, 10),
    (change_objects, 10),
    (build_anew, 3),
    (send, 3),
    (settle, 1),
    (write_picture, 4),
    (write_mesh, 3),
    (cancel, 3),
    (fork, 1),
)
INTERRUPTED = ((interrupt, 1), (ask, 1))


def memory(kind="VmRSS"):
    """Memory of this process in bytes: resident (VmRSS) or writable (VmData)."""
    with open("/proc/self/status", encoding="utf-8") as file:
        return 1024 * next(int(line.split()[1]) for line in file if line.startswith(f"{kind}:"))


def growth(sizes):
    """The growth of the peak of memory from the second to the last third of a round, in bytes."""
    third = len(sizes) // 3
    return max(sizes[2 * third :]) - max(sizes[third : 2 * third], default=sizes[0])


def main():
    """Run a round, print its counts, and exit with 1 if something failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--spare", type=int, help="MiB of memory that the threads may use beyond that of the start")
    arguments = parser.parse_args()
    faulthandler.enable()
    warnings.simplefilter("ignore")
    signal.signal(signal.SIGALRM, signal.default_int_handler)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        soak = Round(world.subjects(folder), folder, seed=arguments.seed, tight=arguments.spare is not None)
        soak.run(arguments.seconds, None if arguments.spare is None else arguments.spare << 20)
        left = [
            str(path.relative_to(folder)) for path in folder.rglob("*") if "tmp" in path.name or "part" in path.name
        ]
    for name, count in sorted(soak.counts.items()):
        print(f"{count:8d} {name}")
    slowest = ", ".join(f"{name} {seconds:.1f} s" for name, seconds in soak.longest.most_common(3))
    print(f"slowest: {slowest}; memory {soak.sizes[-1] >> 20} MiB, growth {growth(soak.sizes) / (1 << 20):.0f} MiB")
    failures = soak.failures + [f"file left behind: {name}" for name in left]
    if arguments.seconds >= 100 and growth(soak.sizes) > 64 << 20:
        failures.append(f"memory grows: {growth(soak.sizes) >> 20} MiB from the second to the last third of the round")
    for failure in failures:
        print("FAILED", failure)
    sys.stdout.flush()
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
