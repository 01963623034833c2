"""Records of pictures: what each was made of, so that a repeated command makes only what is missing."""

from __future__ import annotations

import hashlib
import json
import os

import isospline

from ..base.system import whole_file
from ..io.files import files_of
from ..picture.sequences import PICTURES, is_video
from ..scene.mesh_references import referenced_files

#: Options that do not change a picture.
_WITHOUT_EFFECT = ["run", "file", "output", "frames", "cameras", "quiet", "resume"]
_WITHOUT_EFFECT += ["threads", "workers", "scheduler", "memory_limit"]


class Record:
    """A file with a digest of what each picture was made of, so that pictures of anything else are replaced.

    A picture is removed from it before it is rendered, so an interrupted one is rendered again.
    """

    def __init__(self, path):
        self._path = path
        try:
            with open(path, encoding="utf-8") as file:
                held = json.load(file)["pictures"]
        except (OSError, ValueError, KeyError, TypeError):  # none yet, or no longer whole
            held = {}
        self._pictures = held if isinstance(held, dict) else {}

    def has(self, output, made_of):
        """Whether a picture was made of this."""
        return self._pictures.get(os.path.basename(output)) == _digest(made_of)

    def add(self, output, made_of):
        """Record what a picture was made of."""
        self._pictures[os.path.basename(output)] = _digest(made_of)
        self._write()

    def forget(self, output):
        """Remove a picture from the record."""
        if self._pictures.pop(os.path.basename(output), None) is not None:
            self._write()

    def _write(self):
        with whole_file(self._path) as temporary, open(temporary, "w", encoding="utf-8") as file:
            json.dump({"isospline": isospline.__version__, "pictures": self._pictures}, file, indent=1)


def made_of(arguments):
    """What the numbered pictures of a turntable are made of; None for other pictures, which are not recorded."""
    if not arguments.turntable or is_video(arguments.output):
        return None
    return {**options_of(arguments), "volume": identity(arguments.file, arguments.shape)}


def options_of(arguments):
    """Everything that changes a picture: the version, the options, and the files that they name."""
    options = {name: value for name, value in vars(arguments).items() if name not in _WITHOUT_EFFECT}
    texts = [text for value in options.values() for text in (value if isinstance(value, list) else [value])]
    parts = {part for text in texts if isinstance(text, str) for part in (text, *text.split("@"))}
    files = {part: identity(part) for part in parts if os.path.isfile(part)}
    if arguments.color_by and os.path.isdir(arguments.color_by):
        files[arguments.color_by] = identity(arguments.color_by)
    return {"isospline": isospline.__version__, **options, "files": files}


def identity(path, shape=None):
    """Names, sizes and times of the files that a volume or a mesh is read from, or of any other file."""
    paths = [*files_of(path, shape), *referenced_files(path)]
    files = [(os.path.basename(file), os.stat(file)) for file in paths]
    return [{"name": name, "bytes": status.st_size, "changed": status.st_mtime_ns} for name, status in files]


def record_path(output):
    """The path of the record: frame-####.json for frame-####.png, and frames.json in a folder of pictures."""
    stem, suffix = os.path.splitext(output)
    return f"{stem}.json" if suffix.lower() in PICTURES else os.path.join(output, "frames.json")


def _digest(made_of):
    return hashlib.sha256(json.dumps(made_of, sort_keys=True, default=str).encode()).hexdigest()
