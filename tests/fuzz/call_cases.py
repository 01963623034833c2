"""One case: a public callable with one or two invalid arguments."""

import contextlib
import random
import shutil
import tempfile
from pathlib import Path

from . import call_table
from .hostile_values import VALUES, OwnError
from .outcomes import INSANE, SANE, Failed, peak_memory

MEMORY_LIMIT = 1 << 30


class CallCases:
    """The callables, their arguments, and the objects in the arguments."""

    def __init__(self):
        self._objects = call_table.objects()
        self._files = tempfile.TemporaryDirectory()
        call_table.write_files(Path(self._files.name))

    def run(self, number):
        """Make the call of a case: "returned" or "refused"; raises `Failed` if it is neither."""
        rng = random.Random(number)
        with (
            tempfile.TemporaryDirectory() as folder,
            contextlib.chdir(folder) if hasattr(contextlib, "chdir") else contextlib.nullcontext(),
        ):
            shutil.copytree(self._files.name, folder, dirs_exist_ok=True)
            name, function, arguments = self._changed(rng, Path(folder))
            with peak_memory() as peak:
                try:
                    function(**arguments)
                    outcome = "returned"
                except INSANE as error:
                    raise Failed(f"{name}: {error!r}") from error
                except (*SANE, OwnError):
                    outcome = "refused"
            if peak() > MEMORY_LIMIT:
                raise Failed(f"{name}: {peak() >> 20} MiB of memory")
            return outcome

    def _changed(self, rng, folder):
        name, function, arguments = rng.choice(call_table.calls(self._objects, folder))
        arguments = dict(arguments)
        for parameter in rng.sample(sorted(arguments), min(len(arguments), rng.choice((1, 1, 1, 2)))):
            arguments[parameter] = rng.choice(VALUES)(rng)
        return name, function, arguments

    def describe(self, number):
        """Name and arguments of a call."""
        with tempfile.TemporaryDirectory() as folder:
            name, _, arguments = self._changed(random.Random(number), Path(folder))
        parts = []
        for parameter, value in arguments.items():
            with contextlib.suppress(Exception):
                parts.append(f"{parameter}={value!r}"[:70])
        return f"{name}({', '.join(parts)})"
