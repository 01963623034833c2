"""Time series in stores, and many pictures at once."""

import os
import re

import numpy as np
import pytest
from PIL import Image

import isospline
from isospline.cli.main import main
from isospline.cli.record import identity

zarr = pytest.importorskip("zarr")

from isospline.store import read_metadata, time_steps


@pytest.fixture(scope="module")
def steps():
    """A ball that moves along x."""
    z, y, x = np.mgrid[0:24, 0:24, 0:40].astype(np.float32)
    return np.stack([8 - np.sqrt((x - at) ** 2 + (y - 12) ** 2 + (z - 12) ** 2) for at in (10, 20, 30)])


def coefficients(path):
    return zarr.open_array(path, path="coefficients/0")[:]


def check(path, steps):
    """Check that a series has the same contents as stores of its steps."""
    found = time_steps(path)
    assert [step.relative_to(path).as_posix() for step in found] == ["t/0", "t/1", "t/2"]
    for step, data in zip(found, steps):
        expected = isospline.Volume(data).coefficients
        assert np.allclose(coefficients(step) + read_metadata(step).scales[0].offset, expected, atol=1e-5)


@pytest.mark.parametrize("kind", ["array", "list", "files", "zarr", "ome"])
def test_series_of_any_source(steps, tmp_path, kind):
    source = steps
    if kind == "list":
        source = list(steps)
    elif kind == "files":
        source = [tmp_path / f"{number}.npy" for number in range(3)]
        for file, data in zip(source, steps):
            np.save(file, data)
    elif kind == "zarr":
        source = zarr.create_array(tmp_path / "a.zarr", data=steps)
    elif kind == "ome":
        group = zarr.create_group(tmp_path / "a.zarr")
        group.create_array("0", data=steps, chunks=(1, 10, 10, 10))
        axes = [{"name": "t", "type": "time"}, *({"name": axis, "type": "space"} for axis in "zyx")]
        datasets = [{"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [1, 1, 1, 1]}]}]
        group.attrs["ome"] = {"version": "0.5", "multiscales": [{"axes": axes, "datasets": datasets}]}
        source = tmp_path / "a.zarr"
    told = []
    check(isospline.convert(source, tmp_path / "series.zarr", progress=told.append), steps)
    assert told == sorted(told) and told[-1] == pytest.approx(1)


def test_a_series_continues_after_an_interruption(steps, tmp_path):
    path = tmp_path / "series.zarr"
    with pytest.raises(isospline.Cancelled):
        isospline.convert(steps, path, progress=lambda fraction: fraction < 0.5)
    with pytest.raises(ValueError, match=r"series\.zarr: expected a complete store"):
        time_steps(path)
    done = (path / "t" / "0" / "zarr.json").stat().st_mtime_ns
    with pytest.raises(ValueError, match=r"expected time_steps as in the conversion that was begun, 3, got 2"):
        isospline.convert(steps[:2], path)
    with pytest.raises(ValueError, match=r"expected degree as in the conversion that was begun, 2, got 3"):
        isospline.convert(steps, path, degree=3)
    check(isospline.convert(steps, path), steps)
    assert (path / "t" / "0" / "zarr.json").stat().st_mtime_ns == done
    with pytest.raises(FileExistsError, match="expected no store"):
        isospline.convert(steps, path)
    check(isospline.convert(steps, path, overwrite=True), steps)
    with pytest.raises(ValueError, match=r"expected one volume, got a time series of 3: open .*series\.zarr/t/0"):
        isospline.open_volume(path)
    with pytest.raises(ValueError, match=r"series\.zarr: .*got the store of a time series: give a list of its steps"):
        isospline.convert(path, tmp_path / "copy.zarr")
    check(isospline.convert(time_steps(path), tmp_path / "copy.zarr"), steps)
    text = (path / "zarr.json").read_text(encoding="utf-8")
    (path / "zarr.json").write_text(text.replace("t/1", "../a"), encoding="utf-8")
    with pytest.raises(ValueError, match=r"series\.zarr: time_steps: expected t/0, t/1"):
        time_steps(path)
    (path / "zarr.json").write_text(text, encoding="utf-8")
    (path / "t" / "1").rename(tmp_path / "other")
    (path / "t" / "1").symlink_to(tmp_path / "other")
    with pytest.raises(ValueError, match=r"series\.zarr: t/1: expected a folder within the store"):
        time_steps(path)


def test_steps_that_are_done_are_of_the_same_samples(steps, tmp_path):
    with pytest.raises(isospline.Cancelled):
        isospline.convert(steps, tmp_path / "a.zarr", progress=lambda fraction: fraction < 0.5)
    with pytest.raises(ValueError, match="got others: their digest is"):
        isospline.convert(steps[:, :, ::-1, ::-1], tmp_path / "a.zarr")
    files = [tmp_path / f"{number}.npy" for number in range(3)]
    for file, data in zip(files, steps):
        np.save(file, data)
    with pytest.raises(isospline.Cancelled):
        isospline.convert(files, tmp_path / "b.zarr", progress=lambda fraction: fraction < 0.5)
    np.save(files[0], steps[1][:, ::-1])
    with pytest.raises(ValueError, match="0: expected source as in the conversion that was begun"):
        isospline.convert(files, tmp_path / "b.zarr")


def test_a_series_is_kept_where_a_source_is_missing_or_in_it(steps, tmp_path):
    path = isospline.convert(steps, tmp_path / "a.zarr")
    np.save(tmp_path / "0.npy", steps[0])
    with pytest.raises(FileNotFoundError):
        isospline.convert([tmp_path / "0.npy", tmp_path / "1.npy"], path, overwrite=True)
    with pytest.raises(ValueError, match="^out: expected another folder than that of the source"):
        isospline.convert(time_steps(path), path, overwrite=True)
    check(path, steps)


OPTIONS = ["--fast", "--size", "40x30", "--quiet", "--level", "0"]


def size(path):
    with Image.open(path) as picture:
        return picture.size


def middle(path):
    """The position along x of the dark part of a picture with a light background."""
    dark = 255.0 - np.asarray(Image.open(path).convert("L"), float)
    dark = np.where(dark > 60, dark, 0)
    return float((dark.sum(axis=0) * np.arange(40)).sum() / dark.sum())


def test_frames_of_a_series_have_one_camera(steps, tmp_path, capsys):
    series = str(isospline.convert(steps, tmp_path / "series.zarr"))
    pattern = str(tmp_path / "frame-##.png")
    assert main(["render", series, "--frames", "-o", pattern, "--view", "front", *OPTIONS]) == 0
    places = [middle(tmp_path / f"frame-{number:02d}.png") for number in range(3)]
    assert len({round(place) for place in places}) == 3 and places == sorted(places, reverse=places[0] > places[-1])

    # The same pictures again; some exist already.
    made = {number: (tmp_path / f"frame-{number:02d}.png").read_bytes() for number in range(3)}
    (tmp_path / "frame-02.png").unlink()
    changed = (tmp_path / "frame-01.png").stat().st_mtime_ns
    assert main(["render", series, "--frames", "-o", pattern, "--view", "front", *OPTIONS]) == 0
    assert "frame-01.png exists already" in capsys.readouterr().err
    assert (tmp_path / "frame-02.png").read_bytes() == made[2]
    assert (tmp_path / "frame-01.png").stat().st_mtime_ns == changed


@pytest.mark.slow
def test_frames_are_made_again_where_they_would_differ(steps, tmp_path, capsys):
    folder, pictures = tmp_path / "volumes", tmp_path / "pictures"
    folder.mkdir()
    for name, data in (("a.npy", steps[0]), ("b.npy", steps[1])):
        np.save(folder / name, data)

    def made(*options):
        """The names of the rendered pictures."""
        before = {path.name: path.stat().st_mtime_ns for path in pictures.glob("*.png")}
        assert main(["render", str(folder), "--frames", "-o", str(pictures), *OPTIONS, *options]) == 0
        kept = [line for line in capsys.readouterr().err.splitlines() if line.endswith("exists already")]
        after = {path.name: path.stat().st_mtime_ns for path in pictures.glob("*.png")}
        changed = [name for name, time in sorted(after.items()) if time != before.get(name)]
        assert len(kept) == len(after) - len(changed)
        return changed

    assert made() == ["a.png", "b.png"] and made() == []
    # The same pictures, and others.
    assert made("--threads", "1") == []
    assert made("--size", "50x40") == ["a.png", "b.png"] and size(pictures / "a.png") == (50, 40)
    assert made("--view", "front") == ["a.png", "b.png"] and made("--view", "front") == []
    # Volumes and files beside them have changed.
    np.save(folder / "b.npy", steps[2].astype(np.float64))
    assert made("--view", "front") == ["b.png"]
    isospline.Isosurface(isospline.Volume(steps[0]), 4).to_mesh().write(tmp_path / "m.stl")
    mesh = ["--mesh", f"{tmp_path}/m.stl@1,2,3"]
    assert made(*mesh) == ["a.png", "b.png"] and made(*mesh) == []
    isospline.Isosurface(isospline.Volume(steps[1]), 6).to_mesh().write(tmp_path / "m.stl")
    assert made(*mesh) == ["a.png", "b.png"]
    # One picture is gone, one was made by other means, and a record is damaged.
    (pictures / "a.png").unlink()
    assert made(*mesh) == ["a.png"]
    record = pictures / "frames.json"
    record.write_text(record.read_text(encoding="utf-8").replace('"a.png"', '"other.png"'), encoding="utf-8")
    assert made(*mesh) == ["a.png"]
    record.write_text("{", encoding="utf-8")
    assert made(*mesh) == ["a.png", "b.png"] and made(*mesh) == []


def test_a_frame_that_was_interrupted_is_made_again(steps, tmp_path, monkeypatch, capsys):
    series = str(isospline.convert(steps, tmp_path / "series.zarr"))
    given = ["render", series, "--frames", "-o", str(tmp_path / "frame-#.png"), *OPTIONS]
    assert main(given) == 0
    write = isospline.picture.image.Image.write

    def interrupted(image, path, **options):
        write(image, path, **options)
        if path.endswith("frame-1.png"):
            raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(isospline.picture.image.Image, "write", interrupted)
        assert main([*given, "--size", "50x40"]) == 130
    capsys.readouterr()
    assert main(given) == 0
    kept = [line for line in capsys.readouterr().err.splitlines() if line.endswith("exists already")]
    assert len(kept) == 1 and "frame-2.png" in kept[0]
    assert {size(path) for path in tmp_path.glob("*.png")} == {(40, 30)}


def test_a_folder_of_volumes_makes_a_folder_of_pictures(steps, tmp_path):
    folder, pictures = tmp_path / "volumes", tmp_path / "pictures"
    folder.mkdir()
    np.save(folder / "ball10.npy", steps[0])
    np.save(folder / "ball9.npy", steps[1])
    isospline.convert(steps[2], folder / "last.zarr")
    (folder / "notes.txt").write_text("none", encoding="utf-8")
    assert main(["render", str(folder), "--frames", "-o", str(pictures), *OPTIONS]) == 0
    assert sorted(each.name for each in pictures.iterdir()) == [
        "ball10.png",
        "ball9.png",
        "frames.json",
        "last.png",
    ]
    assert main(["render", str(folder), "--frames", "-o", str(tmp_path / "a-#.png"), *OPTIONS]) == 0
    assert (tmp_path / "a-0.png").read_bytes() == (pictures / "ball9.png").read_bytes()


def test_frames_may_have_names_with_digits_that_are_no_numbers(steps, tmp_path):
    folder, pictures = tmp_path / "volumes", tmp_path / "pictures"
    folder.mkdir()
    np.save(folder / "a1²3.npy", steps[0])
    assert main(["render", str(folder), "--frames", "-o", str(pictures), *OPTIONS]) == 0
    assert (pictures / "a1²3.png").exists()


@pytest.mark.parametrize("suffix", [".mhd", ".nhdr"])
def test_detached_samples_are_no_frames_and_part_of_one(steps, tmp_path, suffix):
    sitk = pytest.importorskip("SimpleITK")
    folder, pictures = tmp_path / "volumes", tmp_path / "pictures"
    folder.mkdir()
    given = ["render", str(folder), "--frames", "-o", str(pictures), *OPTIONS]
    for step in steps[:2]:
        sitk.WriteImage(sitk.GetImageFromArray(step), folder / f"a{suffix}")
        os.utime(folder / f"a{suffix}", (0, 0))
        assert main(given) == 0
    assert sorted(each.name for each in pictures.iterdir()) == ["a.png", "frames.json"]
    other = tmp_path / "other"
    assert main(["render", str(folder / f"a{suffix}"), "-o", f"{other}.png", *OPTIONS]) == 0
    assert (pictures / "a.png").read_bytes() == other.with_suffix(".png").read_bytes()


def write_ome(folder, samples):
    """Two files of one image of OME, each with half of its slices, which name each other."""
    tifffile = pytest.importorskip("tifffile")
    half = len(samples) // 2
    planes = "".join(
        f'<TiffData IFD="{z % half}" FirstZ="{z}" PlaneCount="1">'
        f'<UUID FileName="{"ab"[z // half]}.tif">urn:uuid:{z // half}</UUID></TiffData>'
        for z in range(len(samples))
    )
    for number, part in enumerate(np.split(samples, 2)):
        text = (
            f'<OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06" UUID="urn:uuid:{number}">'
            f'<Image ID="Image:0"><Pixels DimensionOrder="XYZCT" Type="float" SizeX="{samples.shape[2]}" '
            f'SizeY="{samples.shape[1]}" SizeZ="{len(samples)}" SizeC="1" SizeT="1">{planes}</Pixels></Image></OME>'
        )
        tifffile.imwrite(folder / f"{'ab'[number]}.tif", part.astype(np.float32), description=text, metadata=None)


def test_files_of_one_image_of_ome_are_one_frame_and_one_source(steps, tmp_path, capsys):
    folder, pictures = tmp_path / "volumes", tmp_path / "pictures"
    folder.mkdir()
    data = steps[0].astype(np.float32)
    write_ome(folder, data)
    for name in ("a.tif", "b.tif"):
        np.testing.assert_array_equal(isospline.read_volume(folder / name).data, data)
    given = ["render", str(folder), "--frames", "-o", str(pictures), *OPTIONS]
    for is_kept in (False, True, False):
        assert main(given) == 0
        assert ("exists already" in capsys.readouterr().err) == is_kept
        assert sorted(each.name for each in pictures.iterdir()) == ["a.png", "frames.json"]
        if is_kept:  # the other file changes
            first, time = (folder / "a.tif").read_bytes(), (folder / "a.tif").stat().st_mtime_ns
            with pytest.raises(isospline.Cancelled):
                isospline.convert(folder / "a.tif", tmp_path / "a.zarr", progress=lambda fraction: fraction < 0.5)
            write_ome(folder, data[:, ::-1])
            os.utime(folder / "b.tif", (2e9, 2e9))
            (folder / "a.tif").write_bytes(first)
            os.utime(folder / "a.tif", ns=(time, time))
    with pytest.raises(ValueError, match="expected source as in the conversion that was begun"):
        isospline.convert(folder / "a.tif", tmp_path / "a.zarr")


def test_pictures_are_made_of_all_files_of_a_mesh(tmp_path):
    meshio = pytest.importorskip("meshio")
    points, cells = np.eye(4, 3), [("tetra", [[0, 1, 2, 3]])]
    for name, options, files in (
        ("a.xdmf", {}, ["a.xdmf", "a.h5"]),
        ("b.xdmf", {"data_format": "XML"}, ["b.xdmf"]),
        ("c.ele", {}, ["c.ele", "c.node"]),
    ):
        meshio.write(tmp_path / name, meshio.Mesh(points, cells), **options)
        assert [each["name"] for each in identity(tmp_path / name)] == files
        assert len(isospline.read_mesh(tmp_path / name).faces) == 4
    text = (tmp_path / "b.xdmf").read_text(encoding="utf-8")
    points.tofile(tmp_path / "points.bin")
    kind, numbers = re.search(r'Format="XML"([^>]*Precision="8"[^>]*>)([^<]*)', text).groups()
    text = text.replace(f'Format="XML"{kind}{numbers}', f'Format="Binary"{kind}{tmp_path}/points.bin')
    (tmp_path / "b.xdmf").write_text(text, encoding="utf-8")
    assert [each["name"] for each in identity(tmp_path / "b.xdmf")] == ["b.xdmf", "points.bin"]


def test_frames_that_make_no_sense_are_refused(steps, tmp_path, capsys):
    np.save(tmp_path / "a.npy", steps[0])
    store = isospline.convert(steps[0], tmp_path / "a.zarr")
    (tmp_path / "empty").mkdir()
    out = ["--frames", "-o", str(tmp_path / "out")]
    for arguments, expected in (
        ([str(tmp_path / "a.npy"), *out], "expected a store of a time series or a folder of volumes"),
        ([str(store), *out], "got a store of one volume"),
        ([str(tmp_path / "empty"), *out], "expected a folder of volumes, got none in it"),
        ([str(tmp_path), "--frames", "-o", str(tmp_path / "a.png")], "with #### in place of the number"),
        ([str(tmp_path), *out], "expected volumes of different names, got several of a"),
        ([str(tmp_path), *out, "--turntable", "3"], "--turntable cannot be combined with --frames"),
    ):
        assert main(["render", *arguments]) == 2
        assert expected in capsys.readouterr().err
