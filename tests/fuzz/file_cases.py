"""One case: reads a file of some format, changed by a random generator that is seeded with the case's number."""

import random
import shutil
import tempfile
from pathlib import Path

import numpy as np

from . import seeds
from .mutators import mutate
from .outcomes import SANE, Failed, peak_memory

# Memory that a reader may use besides the returned samples. Libraries load parts at the first use.
MEMORY_LIMIT = 400 << 20


class FileCases:
    """The valid files, and their contents."""

    def __init__(self):
        self._base = tempfile.TemporaryDirectory()
        self._folder = Path(self._base.name)
        self._seeds = seeds.write_all(self._folder)
        self._contents = [(self._folder / seed.changed).read_bytes() for seed in self._seeds]
        self._expected = [
            None if seed.checked_from is None else np.array(seed.read(self._folder / seed.name, **seed.options).data)
            for seed in self._seeds
        ]

    def prepare(self, number, folder):
        """Write the changed file of a case; returns its seed's row, and its path."""
        rng = random.Random(number)
        row = rng.randrange(len(self._seeds))
        seed, other = self._seeds[row], rng.choice(self._contents)
        changed = mutate(rng, self._contents[row], other, seed.checked_from or 0)
        path = folder / seed.name
        shutil.copytree(
            self._folder / Path(seed.name).parent,
            path.parent,
            dirs_exist_ok=True,
            ignore=lambda _, names: [n for n in names if not _beside(seed, n)],
        )
        if (self._folder / seed.name).is_dir():
            shutil.copytree(self._folder / seed.name, path, dirs_exist_ok=True)
        (folder / seed.changed).parent.mkdir(exist_ok=True)
        (folder / seed.changed).write_bytes(changed)
        return row, path

    def run(self, number):
        """Read the file of a case: "read" or "refused"; raises `Failed` if it is neither."""
        with tempfile.TemporaryDirectory() as folder:
            row, path = self.prepare(number, Path(folder))
            seed, kept = self._seeds[row], 0
            with peak_memory() as peak:
                try:
                    result = seed.read(path, **seed.options)
                    data = getattr(result, "data", None)
                    if data is not None:
                        kept = data.nbytes
                        data.max()
                    outcome = "read"
                except MemoryError:
                    return "refused"
                except SANE as error:
                    if str(path.name) not in str(error) and str(path.parent.name) not in str(error):
                        raise Failed(f"an error that does not name the file: {error!r}") from error
                    outcome = "refused"
            # meshio makes a table as long as the largest node tag, see the documentation.
            limited = not seed.name.startswith("gmsh")
            if limited and peak() > MEMORY_LIMIT + 2 * kept:
                raise Failed(f"{peak() >> 20} MiB of memory for {kept >> 20} MiB of samples")
            is_checked = outcome == "read" and seed.checked_from is not None
            if is_checked and not np.array_equal(data, self._expected[row]):
                raise Failed("damaged samples are taken for good")
            return outcome

    def describe(self, number):
        """Name of the file that a case changes."""
        return self._seeds[random.Random(number).randrange(len(self._seeds))].changed


def _beside(seed, name):
    """Whether a file is a part of the seed's."""
    return name in (seed.name, seed.changed)
