"""Errors of the command line: one line, an exit code, and no file; and Ctrl-C."""

import contextlib
import errno
import io
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import time

import numpy as np
import pytest
from command_line import fails, leftovers, run
from interrupts import obey_signals

import isospline
from isospline.cli.main import main

LENS = ("--level", "0", "--aperture", "1")
TRACED = ("--level", "0", "--light", "path-trace")


@pytest.mark.parametrize(
    ("message", "arguments"),
    [
        ("invalid choice: 'paint'", ["paint"]),
        ("required: -o/--output", ["render", "ball.npy"]),
        ("--capped: expected --clip or --clip-box", ["mesh", "ball.npy", "-o", "a.stl", "--capped"]),
        ("--no-capped: expected --clip or --clip-box with it", ["render", "ball.npy", "-o", "a.png", "--no-capped"]),
        ("--level: expected one level for a mesh, got 2", ["mesh", "ball.npy", "-o", "a.stl", "-l", "0", "-l", "1"]),
        ("nowhere: No such file or directory", ["render", "nowhere", "--frames", "-o", "pictures"]),
        ("'': No such file or directory", ["info", ""]),
        ("--memory-limit: expected bytes, or a text such as", ["info", "ball.npy", "--memory-limit", "1XB"]),
        (
            "--memory-limit: expected bytes, or a text such as",
            ["mesh", "ball.npy", "-o", "a.ply", "--memory-limit", "1XB"],
        ),
        ("'': No such file or directory", ["render", "", "--frames", "-o", "pictures"]),
        ("a.mp4: expected the name of a folder, or of pictures", ["render", "volumes", "--frames", "-o", "a.mp4"]),
    ],
)
def test_bad_commands_are_told(ball, monkeypatch, capsys, message, arguments):
    monkeypatch.chdir(ball.parent)
    (ball.parent / "volumes").mkdir()
    shutil.copy(ball, ball.parent / "volumes")
    fails(capsys, 2, message, *arguments)
    assert leftovers(ball.parent) == ["volumes"]


@pytest.mark.parametrize(
    ("message", "options"),
    [
        ("--level: invalid float value: 'high'", ["--level", "high"]),
        ("--size: expected a width and a height such as 640x480, got '640'", ["--size", "640"]),
        ("--spacing: expected 3 numbers separated by commas, got '1,2'", ["--spacing", "1,2"]),
        ("--shape: expected three counts", ["--shape", "1,2"]),
        ("--dtype: expected a type such as uint8", ["--dtype", "integer"]),
        ("--big-endian: expected --dtype with it, got none", ["--big-endian"]),
        (
            "--big-endian: expected a --dtype that is not little-endian with it, got <u2",
            ["--dtype", "<u2", "--big-endian"],
        ),
        ("unrecognized arguments: --colour", ["--colour", "1,1,1"]),
        ("spacing: expected positive numbers", ["--spacing", "1,-1,1"]),
        ("level: expected", ["--level", "nan"]),
        ("--clip: expected 6 numbers separated by commas, got '1,2,3'", ["--clip", "1,2,3"]),
        ("--clip: normal: expected three finite numbers, not all of them zero", ["--clip", "1,2,3,0,0,0"]),
        ("--clip-box: maximum: expected numbers above", ["--clip-box", "0,0,0,-1,1,1"]),
        (r"no\.stl: No such file", ["--mesh", "no.stl"]),
    ],
)
def test_bad_surfaces_are_told(ball, monkeypatch, capsys, message, options):
    refuses(ball, monkeypatch, capsys, message, options)


@pytest.mark.parametrize(
    ("message", "options"),
    [
        ("--background: expected the name of a colour, such as white", ["--background", "muave"]),
        ("--annotate: expected scale-bar, colorbar, scale-bar,colorbar or none", ["--annotate", "ruler"]),
        ("annotate: expected a colour rule", ["-l", "0", "--annotate", "colorbar"]),
        ("annotate: expected a colour rule", ["-l", "0", "--annotate", "scale-bar,colorbar"]),
        ("view: expected one of", ["--level", "0", "--view", "within"]),
        ("--focus: expected --aperture with it, got none", ["--level", "0", "--focus", "3"]),
        ("--aperture: expected --projection perspective", [*LENS, "--projection", "orthographic"]),
        ("focus_distance: expected", [*LENS, "--focus", "-1"]),
        ("--layers: expected the name of a picture that has layers", ["--layers", "curvature"]),
    ],
)
def test_bad_pictures_are_told(ball, monkeypatch, capsys, message, options):
    refuses(ball, monkeypatch, capsys, message, options)


TWO_LEVELS = ("-l", "0", "-l", "1")


@pytest.mark.parametrize(
    ("message", "options"),
    [
        ("--color: expected the name of a colour, .* got 'muave'", ["--color", "muave"]),
        (
            'color: expected numbers from 0 to 1 for red, .* got .*did you mean "#ff8000"',
            ["-l", "0", "--color", "255,128,0"],
        ),
        (
            "--color: expected 1, or 3 for all levels and meshes, got 2",
            ["--color", "1,1,1", "--color", "1,1,1", *TWO_LEVELS, "--mesh", "a.stl"],
        ),
        ("--opacity: expected 1, or 2 for all levels and meshes, got 3", [*TWO_LEVELS, *["--opacity", "0.5"] * 3]),
        ("opacity: expected", ["--opacity", "2"]),
        ("--color cannot be combined with --color-by", ["--color", "1,1,1", "--color-by", "normal"]),
        ("--limits: expected --color-by", ["--limits", "0,1"]),
        ("--cmap: expected --color-by", ["--color-by", "normal", "--cmap", "magma"]),
        ("--limits: expected two curvatures", ["--color-by", "mean-curvature"]),
        ("cmap: expected the name of a colour map", ["--color-by", "depth", "--cmap", "magna"]),
        ("gradient: No such file", ["--color-by", "gradient"]),
    ],
)
def test_bad_colors_are_told(ball, monkeypatch, capsys, message, options):
    refuses(ball, monkeypatch, capsys, message, options)


@pytest.mark.parametrize(
    ("message", "options"),
    [
        ("--fast: expected --light studio with it, got phong", ["--fast", "--shadows"]),
        (
            "--lamp: expected 3 or 4 numbers separated by commas or one of .*front, .* got 'above'",
            ["--lamp", "above"],
        ),
        ("--lamp: expected a direction, which is not 0,0,0", ["--lamp", "0,0,0"]),
        ("intensity: expected", ["--lamp", "0,0,1,-1"]),
        (
            "--lamp: expected --light phong or path-trace with it, got outline",
            ["--lamp", "top", "--light", "outline"],
        ),
        ("--shadows: expected --light phong with it, got path-trace", [*TRACED, "--shadows"]),
        ("--environment: expected --light path-trace with it, got studio", ["--environment", "1"]),
        ("--denoise: expected --light path-trace with it, got phong", ["--light", "phong", "--denoise"]),
        (
            "--environment: expected 1 or 3 numbers separated by commas or a file: .exr or .hdr, got 'blue'",
            [*TRACED, "--environment", "blue"],
        ),
        (r"no\.exr: No such file", [*TRACED, "--environment", "no.exr"]),
        ("radiance: expected", [*TRACED, "--environment", "-1"]),
        ("color: expected numbers from 0 to 1", [*TRACED, "--color", "2,1,1"]),
        (
            "--opacity: expected --light studio, .* or ambient-occlusion with it, got path-trace",
            [*TRACED, "--opacity", "0.5"],
        ),
    ],
)
def test_bad_light_is_told(ball, monkeypatch, capsys, message, options):
    refuses(ball, monkeypatch, capsys, message, options)


@pytest.mark.parametrize(
    ("message", "layers"),
    [
        ("--layers: expected names among depth, .*, certified, mask, got 'z'", ["depth,z"]),
        ("--layers: expected direct with --light path-trace only, got studio", ["direct"]),
        (
            "ambient_occlusion_samples: expected rays a hit",
            ["ambient_occlusion", "--ambient-occlusion-samples", "0"],
        ),
    ],
)
def test_bad_layers_are_told(ball, monkeypatch, capsys, message, layers):
    refuses(ball, monkeypatch, capsys, message, ["--level", "0", "--layers", *layers], output="a.exr")


def refuses(ball, monkeypatch, capsys, message, options, output="a.png"):
    """Rendering fails with a message, and writes nothing."""
    monkeypatch.chdir(ball.parent)
    fails(capsys, 2, message, "render", "ball.npy", "-o", output, *options)
    assert not leftovers(ball.parent)


def test_bad_files_are_told(tmp_path, picture, capsys):
    pytest.importorskip("SimpleITK")
    (tmp_path / "a.npy").write_bytes(b"nonsense")
    (tmp_path / "a.raw").write_bytes(b"12345678")
    raw = ("--shape", "3,3,3", "--dtype", "uint8")
    expected = r"expected 27 bytes, 3 x 3 x 3 samples \(x, y, z\) of uint8, got 8 bytes \(shape="
    fails(capsys, 2, r"missing\.nrrd: No such file", "info", tmp_path / "missing.nrrd")
    fails(capsys, 2, "a folder with a DICOM series or TIFF slices, got one without images", "info", tmp_path)
    fails(capsys, 2, r"a\.npy: cannot be read as NPY", "render", tmp_path / "a.npy", "-o", picture)
    fails(capsys, 2, expected, "info", tmp_path / "a.raw", *raw)
    assert not picture.exists()


def test_samples_without_a_surface_are_told(tmp_path, picture, capsys):
    np.save(tmp_path / "nan.npy", np.full((3, 3, 3), np.nan))
    np.save(tmp_path / "flat.npy", np.ones((3, 3, 3)))
    fails(capsys, 2, "finite", "render", tmp_path / "nan.npy", "--level", "0", "-o", picture)
    fails(capsys, 2, r"flat\.npy: expected samples that differ", "render", tmp_path / "flat.npy", "-o", picture)
    assert not picture.exists()


def test_bad_files_beside_the_volume_are_told(ball, picture, capsys):
    (ball.parent / "a.exr").write_bytes(b"nonsense")
    (ball.parent / "a.off").write_text("nonsense", encoding="utf-8")
    render = ("render", ball, "-o", picture)
    sky, mesh = ball.parent / "a.exr", ball.parent / "a.off"
    fails(capsys, 2, r"a\.exr: cannot be read as an environment", *render, *TRACED, "--environment", sky)
    fails(capsys, 2, r"a\.off: cannot be read as a mesh", *render, "--level", "0", "--mesh", mesh)
    assert not picture.exists()


def test_bad_output_is_told_before_anything_is_read(tmp_path, capsys):
    missing = tmp_path / "missing.npy"
    fails(capsys, 2, r"a\.jpg: expected the name of a picture", "render", missing, "-o", tmp_path / "a.jpg")
    fails(capsys, 2, "expected a folder that exists", "render", missing, "-o", tmp_path / "no" / "a.png")
    (tmp_path / "b.png").mkdir()
    fails(capsys, 2, "got that of a folder", "render", missing, "-o", tmp_path / "b.png")
    if os.geteuid() != 0:
        (tmp_path / "locked").mkdir(mode=0o500)
        fails(capsys, 2, "can be written to", "render", missing, "-o", tmp_path / "locked" / "a.png")


@contextlib.contextmanager
def small_files():
    """Files have at most 200 bytes meanwhile. So has pytest's output, if it is a file: it is written afterwards."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (200, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


COMPARED = ("compare", "ball.npy", "ball.npy", "-l", "0", "--other-level", "0", "--samples", "20")


@pytest.mark.parametrize(
    "arguments",
    [
        ("render", "ball.npy", "-l", "0", "--size", "48x32", "--fast", "-o", "a.png"),
        ("render", "ball.npy", "-l", "0", "--size", "48x32", "--fast", "-o", "a.exr"),
        ("mesh", "ball.npy", "-l", "0", "-o", "a.ply"),
        (*COMPARED, "--size", "48x32", "-o", "a.png"),
        (*COMPARED, "--table", "a.csv"),
        ("demo", "-o", "."),
        ("convert", "ball.npy", "a.zarr"),
    ],
    ids=" ".join,
)
def test_a_file_that_cannot_be_written_to_its_end_is_a_failure(ball, monkeypatch, capsys, arguments):
    if arguments[0] == "convert":
        pytest.importorskip("zarr")
    monkeypatch.chdir(ball.parent)
    with small_files():
        fails(capsys, 1, "File too large|requested and .* written", *arguments, "--quiet")
    assert leftovers(ball.parent) == (["a.zarr"] if arguments[0] == "convert" else [])


class Full(io.TextIOBase):
    """Standard output on a full disk."""

    encoding = "utf-8"

    def write(self, text):
        return len(text)

    def flush(self):
        raise OSError(errno.ENOSPC, "No space left on device")

    def close(self):
        """Nothing: Python closes the object at the end, and would tell that it cannot be flushed."""


@pytest.mark.parametrize(
    "arguments", [("info", "ball.npy"), ("measure", "ball.npy", "-l", "0", "--order", "2"), COMPARED], ids=" ".join
)
def test_an_output_that_is_full_is_a_failure(ball, monkeypatch, capsys, arguments):
    monkeypatch.chdir(ball.parent)
    monkeypatch.setattr(sys, "stdout", Full())
    quiet = () if arguments[0] == "info" else ("--quiet",)
    fails(capsys, 1, "No space left on device", *arguments, *quiet)


def test_missing_libraries_are_told(tmp_path, monkeypatch):
    # The reader's process looks for packages in the same folders.
    (tmp_path / "nibabel.py").write_text("raise ModuleNotFoundError(name='nibabel')", encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    (tmp_path / "a.nii").write_bytes(bytes(400))
    result = run("info", tmp_path / "a.nii")
    assert result.returncode == 1
    assert re.fullmatch(
        r"isospline: error: .*reading NIfTI needs the package nibabel: pip install isospline\[io\].*\n", result.stderr
    )


@pytest.mark.slow
def test_the_exit_code_is_that_of_main(tmp_path, capsys):
    result = run("info", tmp_path / "missing.nrrd")
    assert (result.returncode, result.stdout) == (2, "") and "Traceback" not in result.stderr
    result = run("--version")
    assert (result.returncode, result.stdout) == (0, f"isospline {isospline.__version__}\n")
    result = run()
    assert result.returncode == 0 and result.stdout.startswith("usage: isospline")
    for arguments in (["--help"], ["info", "--help"], ["render", "--help"]):
        with pytest.raises(SystemExit) as ended:
            main(arguments)
        assert ended.value.code == 0 and capsys.readouterr().out.startswith("usage: isospline")


def test_progress_is_shown_on_a_terminal_only(ball, picture):
    pty, fcntl, termios = (pytest.importorskip(name) for name in ("pty", "fcntl", "termios"))
    try:
        ours, terminal = pty.openpty()
    except OSError as error:
        pytest.skip(f"no pseudo-terminals here: {error}")
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    command = [sys.executable, "-m", "isospline", "render", ball, "--level", "0", "--size", "64x64", "-o", picture]
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=terminal, check=False)
    shown = os.read(ours, 100_000)
    os.close(terminal)
    os.close(ours)
    assert result.returncode == 0
    for stage in (b"filtering", b"finding cells", b"rendering"):
        assert stage in shown


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_interrupting_leaves_no_file(tmp_path, ball):
    picture = tmp_path / "picture.png"
    command = [
        sys.executable,
        "-m",
        "isospline",
        "render",
        str(ball),
        "--size",
        "4096x4096",
        "--samples",
        "4096",
        "-o",
        str(picture),
    ]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, encoding="utf-8", preexec_fn=obey_signals)
    assert process.stderr.readline().startswith("isospline: level")
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=60)
    assert process.returncode == 130
    assert error.endswith("isospline: interrupted\n")
    assert leftovers(tmp_path) == []


@pytest.mark.parametrize("command", [["info"], ["measure", "-l", "0.5"], ["render", "--fast", "--size", "16x12"]])
def test_samples_that_are_nan_are_told_and_replaced(tmp_path, capsys, command):
    data = np.zeros((8, 8, 8), np.float32)
    data[3:5, 3:5, 3:5] = 1
    data[0, 1:] = np.nan
    np.save(tmp_path / "map.npy", data)
    output = ["-o", str(tmp_path / "a.png")] if command[0] == "render" else []
    name, *options = command
    given = [name, str(tmp_path / "map.npy"), *options, *output]
    told = r"map\.npy: expected finite samples, got 56 of 512 that are NaN or infinite, the first one at \[0, 1, 0\]"
    fails(capsys, 2, f"{told}; --nan VALUE replaces", *given)
    assert main([*given, "--nan", "0"]) == 0
    capsys.readouterr()
    fails(capsys, 2, "nan: expected a finite number in place of NaN, got inf", *given, "--nan", "inf")
    np.save(tmp_path / "map.npy", np.where(np.isnan(data), np.float32(np.inf), data))
    for options in ([], ["--nan", "0"]):  # which would not help
        fails(capsys, 2, rf"{told}\n$", *given, *options)


@pytest.fixture
def nan_files(tmp_path):
    """A file with NaN, and a store of the same samples with zeros in their place."""
    pytest.importorskip("zarr")
    data = np.random.default_rng(0).random((12, 12, 12)).astype(np.float32)
    data[3, 4:6] = np.nan
    np.save(tmp_path / "map.npy", data)
    return data, tmp_path / "map.npy", isospline.convert(np.nan_to_num(data), tmp_path / "a.zarr")


def test_nan_in_the_volume_of_a_color_is_told(nan_files, tmp_path, ball, capsys):
    told = r"map\.npy: expected finite samples, got .* NaN or infinite, the first one at \[3, 4, 0\]\n$"
    fails(capsys, 2, told, "render", ball, "--color-by", nan_files[1], "-o", tmp_path / "a.png")


@pytest.mark.parametrize(
    "command", [["info"], ["measure"], ["mesh", "-o", "a.ply"], ["render", "-o", "a.png"], ["view"]]
)
def test_a_number_in_place_of_nan_is_refused_with_a_store(nan_files, tmp_path, capsys, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    name, *options = command
    told = r"--nan: expected none with the store .*a\.zarr, whose samples isospline convert has read, got 0"
    told = r"--nan: expected a file of samples with it, got .*a\.zarr" if name == "view" else told
    fails(capsys, 2, told, name, nan_files[2], *options, "--nan", "0")


@pytest.mark.parametrize(
    "option",
    [
        ("--nan", "0"),
        ("--background", "red"),
        ("--light", "path-trace"),
        ("--aperture", "2"),
        ("--degree", "1"),
        ("--spacing", "1,1,9"),
        ("-l", "3"),
        ("--clip", "0,0,0,0,0,1"),
        ("--denoise",),
        ("--exact",),
        ("--turntable", "3"),
        ("--workers", "1"),
    ],
)
def test_options_without_effect_are_refused_with_a_session(option, tmp_path, capsys):
    name = "--level" if option[0] == "-l" else option[0]
    given = ["render", "--session", tmp_path / "a.json", "-o", tmp_path / "a.png"]
    fails(capsys, 2, f"{name} cannot be combined with --session", *given, *option)


@pytest.mark.parametrize("suffix", [".npy", ".nii", ".nii.gz"])
def test_stores_are_written_with_a_number_in_place_of_nan(nan_files, tmp_path, capsys, suffix):
    data, path, _ = nan_files
    if suffix != ".npy":
        nibabel = pytest.importorskip("nibabel")
        path = tmp_path / f"map{suffix}"
        nibabel.save(nibabel.Nifti1Image(data.T, np.diag([-1.0, -1, 1, 1])), path)
    out = tmp_path / "b.zarr"
    told = (
        r"source: expected finite numbers, got nan at \[3, 4, 0\]; nan=VALUE, --nan on the command line, replaces NaN"
    )
    fails(capsys, 2, told, "convert", path, out)
    fails(capsys, 2, "nan: expected a finite number in place of NaN, got inf", "convert", path, out, "--nan", "inf")
    assert main(["convert", str(path), str(out), "--overwrite", "--nan", "-2.5"]) == 0
    fails(capsys, 2, r"or overwrite=True, --overwrite on the command line\n$", "convert", path, out, "--nan", "-2.5")
    expected = isospline.Volume(np.where(np.isnan(data), np.float32(-2.5), data))
    np.testing.assert_allclose(isospline.open_volume(out).coefficients, expected.coefficients, atol=1e-6)


def test_the_viewer_reads_files_with_a_number_in_place_of_nan(nan_files, monkeypatch, capsys):
    from isospline.viewer.session import Session, session_of
    from isospline.viewer.viewer import Viewer

    data, path, _ = nan_files
    seen = []

    def end(viewer):
        (source,) = viewer.document
        seen.extend([source.item.coefficients, session_of(viewer.document, viewer.state).to_text()])
        raise KeyboardInterrupt

    monkeypatch.setattr(Viewer, "wait", end)
    assert main(["view", str(path), "--no-browser", "--level", "0.5", "--nan", "0"]) == 0
    coefficients, session = seen
    np.testing.assert_array_equal(coefficients, isospline.Volume(np.nan_to_num(data)).coefficients)
    assert Session.from_text(session).sources[0].read_options == {"nan": 0.0}
