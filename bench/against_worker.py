"""One revision in a run of against.py: reads a command a line, as JSON, from stdin and answers with lines of JSON.

It must run with older revisions, so it uses only NumPy and what all of them offer, and asks before it uses more."""

import ctypes
import inspect
import json
import os
import sys
import time
import traceback
from pathlib import Path

import numpy as np

import isospline

LEAST_SECONDS = 0.05  # of a timed run; shorter calls are repeated
HELD = 96 << 20  # bytes of surfaces to hold when memory is measured, so many that the allocator's pages do not matter


class Worker:
    """A volume, its surface and a scene, and the calls that are measured with them."""

    def module(self):
        return {"path": isospline.__file__, "settled": hasattr(isospline.Scene, "settle")}

    def load(self, folder, degree):
        self.folder = Path(folder)
        self.options = json.loads((self.folder / "subject.json").read_text(encoding="utf-8"))
        self.data = np.load(self.folder / "samples.npy")
        self.degree = degree
        self.volume = self.make_volume()

    def make_volume(self):
        return isospline.Volume(self.data, degree=self.degree, **self.options["grid"])

    def make_scene(self):
        surface = isospline.Isosurface(self.volume, self.options["level"])
        return surface, isospline.Scene([surface])

    def renew(self, threads=0, settled=False):
        """A new scene, of which nothing has been traced."""
        isospline.set_thread_count(threads)
        # With one thread, other processes then hardly disturb the result.
        self.clock = time.process_time if threads == 1 else time.perf_counter
        self.steps = 0
        self.surface, self.scene = self.make_scene()
        if settled:
            self.scene.settle()

    def rays(self, name):
        return np.load(self.folder / f"{name}.npy")

    def run(self, operation, save, **arguments):
        """Prepares a call, makes it once, and saves its answer to a file."""
        self.call = getattr(self, operation)(**arguments)
        answer = self.call()
        if isinstance(answer, isospline.Volume):
            answer = answer.coefficients.astype(np.float32)
        np.save(save, answer)

    def time(self):
        """Seconds of one of the calls that `run` prepared."""
        count, start = 0, self.clock()
        while True:
            self.call()
            count += 1
            seconds = self.clock() - start
            if seconds >= LEAST_SECONDS:
                return seconds / count

    def cast(self, rays, coherent):
        rays, options = self.rays(rays), {} if coherent is None else {"coherent": coherent}
        return lambda: self.scene.cast_rays(rays, **options)["t_hit"]

    def occlusions(self, rays, coherent):
        rays, options = self.rays(rays), {"t_far": 1.0}
        if coherent and takes(isospline.Scene.test_occlusions, "coherent"):
            options["coherent"] = True
        return lambda: self.scene.test_occlusions(rays, **options)

    def picture(self, camera, size, shadows):
        camera = isospline.PerspectiveCamera(**self.options["cameras"][camera])
        shading = isospline.Phong(shadows=shadows)
        return lambda: isospline.render(self.scene, camera, size=size, light=shading).color

    def next_level(self):
        """A level that has not been used yet, within a hundredth of the data's range."""
        self.steps += 1
        self.surface.level = self.options["level"] + self.options["step"] * (0.6180339887498949 * self.steps % 1)

    def level(self):
        ray = self.rays("middle")

        def change():
            self.next_level()
            return self.scene.cast_rays(ray)["t_hit"]

        return change

    def level_and_picture(self, camera, size):
        render = self.picture(camera, size, False)

        def change():
            self.next_level()
            return render()

        return change

    def prefilter(self):
        return self.make_volume

    def memory(self, rays):
        """Resident bytes of each of several equal surfaces and scenes that are alive together, after rays were cast."""
        rays = self.rays(rays)

        def held():
            surface, scene = self.make_scene()
            scene.cast_rays(rays, coherent=True)
            return surface, scene

        alive = [held()]
        copies = int(np.clip(HELD / alive[0][1].memory, 2, 400))
        before = resident()
        alive += [held() for _ in range(copies)]
        return (resident() - before) / copies


def takes(function, parameter):
    """Whether a function of the compiled module, or of Python, has a parameter."""
    try:
        return parameter in inspect.signature(function).parameters
    except ValueError:
        return f"{parameter}:" in (function.__doc__ or "")


def resident():
    """Resident bytes of the process, without free pages of the C library's allocator."""
    ctypes.CDLL(None).malloc_trim(0)
    return int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[1]) * os.sysconf("SC_PAGE_SIZE")


def main():
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as replies:
        os.dup2(2, 1)  # what the package prints is no reply
        worker = Worker()
        for line in sys.stdin:
            name, arguments = json.loads(line)
            try:
                reply = {"result": getattr(worker, name)(**arguments)}
            except Exception:
                reply = {"error": traceback.format_exc()}
            print(json.dumps(reply), file=replies, flush=True)


if __name__ == "__main__":
    main()
