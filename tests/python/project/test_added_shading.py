"""A shading is added by two files, as CONTRIBUTING.md says, its struct and its dataclass; three lists have its name."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ADDED = Path(__file__).with_name("added_shading")
# The files in which the name of the shading is written, and how.
NAMES = {
    "core/isospline/shade/shading.h": [
        ("shade/ambient_occlusion.h", 'shade/ambient_occlusion.h"\n#include "isospline/shade/hemisphere.h'),
        ("Outline, AmbientOcclusion>", "Outline, AmbientOcclusion, Hemisphere>"),
    ],
    "python/isospline/looks/__init__.py": [
        ("from .materials", "from .hemisphere import Hemisphere\nfrom .materials"),
        ('"AmbientOcclusion"', '"AmbientOcclusion", "Hemisphere"'),
    ],
    "python/isospline/__init__.py": [
        ("import AmbientOcclusion, ", "import AmbientOcclusion, Hemisphere, "),
        ('    "AmbientOcclusion",\n', '    "AmbientOcclusion",\n    "Hemisphere",\n'),
    ],
}
USE = """
import pickle
import numpy as np
import isospline

field = isospline.volumes.torus()
torus = isospline.Isosurface(field.volume(32), field.level, color=isospline.colors.linear((0.2, 0.5, 1.0)))
shading = isospline.Hemisphere(up=(0, 1, 2))
assert pickle.loads(pickle.dumps(shading)) == shading == shading.replace(up=(0, 1, 2)) != isospline.Hemisphere()
image = isospline.render(torus, size=(48, 36), light=shading, layers=("normal", "depth"), background=0)
hit = np.isfinite(image.depth)
expected = (0.5 + 0.5 * image.normal[hit] @ (0, 1, 2) / np.sqrt(5))[:, None] * (0.2, 0.5, 1.0)
assert hit.sum() > 200
np.testing.assert_allclose(image.color[hit][:, :3], expected, atol=1e-6)
try:
    isospline.Hemisphere(up=(0, 0, 0))
except ValueError as error:
    assert str(error).startswith("up: expected ")
try:
    isospline.render(torus, light=3)
except TypeError as error:
    assert "a Hemisphere" in str(error)
print("shaded", hit.sum())
"""


@pytest.mark.long  # it compiles the package
def test_a_shading_is_added_by_two_files(repository, tmp_path):
    tracked = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"],
        cwd=repository,
        capture_output=True,
        encoding="utf-8",
        check=True,
    )
    copy = tmp_path / "copy"
    for name in tracked.stdout.splitlines():
        if (repository / name).is_file():
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(repository / name, copy / name)
    shutil.copy(ADDED / "hemisphere.h", copy / "core" / "isospline" / "shade")
    shutil.copy(ADDED / "hemisphere.py", copy / "python" / "isospline" / "looks")
    for path, changes in NAMES.items():
        text = (copy / path).read_text(encoding="utf-8")
        for before, after in changes:
            assert text.count(before) == 1, (path, before)
            text = text.replace(before, after)
        (copy / path).write_text(text, encoding="utf-8")
    installed = tmp_path / "installed"
    options = ["--no-deps", "--no-build-isolation", "--no-compile", "--disable-pip-version-check", "--quiet"]
    options += ["--config-settings=cmake.build-type=Debug", "--target", installed]
    quick = os.environ | {"CXXFLAGS": "-O0 -g0 -DHWY_COMPILE_ONLY_STATIC"}
    subprocess.run([sys.executable, "-m", "pip", "install", *options, copy], env=quick, check=True)
    # Ahead of an editable installation of this package, whose finder comes first otherwise.
    others = "[each for each in sys.meta_path if 'ScikitBuild' not in type(each).__name__]"
    use = f"import sys\nsys.meta_path[:] = {others}\n{USE}"
    environment = os.environ | {"PYTHONPATH": str(installed)}
    done = subprocess.run(
        [sys.executable, "-c", use], cwd=tmp_path, env=environment, capture_output=True, encoding="utf-8", check=False
    )
    assert done.stdout.startswith("shaded"), done.stderr
