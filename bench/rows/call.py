"""What a call from Python costs a ray, and what its outputs cost."""

import numpy as np
from suite.clock import spread, take_turns
from suite.goal import at_most
from suite.tables import markdown_table, with_spread
from suite.views import in_tiles, whole_camera

import isospline


class Tensor:
    """A tensor of another library, which can be read item by item or as a whole."""

    def __init__(self, array):
        self._array = array

    def __len__(self):
        return len(self._array)

    def __getitem__(self, index):
        return self._array[index]

    def numpy(self):
        return self._array


TITLE = "The call from Python"
ABOUT = """Rays of the whole view, reversed, so that they miss the scene's box: this is what `Scene.cast_rays` costs
before any work, in packets on one thread. *float32, t alone* has float32 rays and `outputs=("t_hit",)`; *tensor* has
the same in a tensor of another library. *float64, all* has float64 rays and all default outputs."""
SETTINGS = ("size", "repetitions")
GOALS = [("the call from Python, rays that miss, float32 in, t out", "at most 8 ns a ray")]


def measure(settings):
    isospline.set_thread_count(1)
    for subject in settings.subjects():
        volume = isospline.Volume(subject.data, **subject.grid)
        scene = isospline.Scene([isospline.Isosurface(volume, subject.level)])
        away = in_tiles(whole_camera(scene, settings.size).rays(settings.size)) * [1, 1, 1, -1, -1, -1]
        single = away.astype(np.float32)
        tensor = Tensor(single)
        seconds, answers = take_turns(
            {
                "float32, t alone": lambda s=scene, r=single: s.cast_rays(r, coherent=True, outputs=("t_hit",)),
                "tensor": lambda s=scene, r=tensor: s.cast_rays(r, coherent=True, outputs=("t_hit",)),
                "float64, all": lambda s=scene, r=away: s.cast_rays(r, coherent=True),
            },
            settings.repetitions,
        )
        assert all(np.isinf(hits["t_hit"]).all() for hits in answers.values()), "expected rays that miss"
        yield {
            "subject": subject.name,
            "rays": len(away),
            "ns": {name: spread(1e9 / len(away) * np.array(times)) for name, times in seconds.items()},
        }


def goals(results):
    called = {result["subject"]: result["ns"]["float32, t alone"]["median"] for result in results}
    return [at_most(GOALS[0][0], 8, called, "ns a ray")]


def table(results):
    rows = [(result["subject"], *(with_spread(ns) for ns in result["ns"].values())) for result in results]
    return markdown_table(("volume", *(f"{name}, ns a ray" for name in results[0]["ns"])), rows)
