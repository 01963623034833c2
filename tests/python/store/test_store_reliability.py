"""Failures of stores: interruptions, full disks, damage, other stores, links, several processes, memory."""

import itertools
import json
import os
import shutil
import signal
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest
from interrupts import obey_signals

import isospline

zarr = pytest.importorskip("zarr")

from isospline.store import layout, read_metadata, read_ranges
from isospline.store.sources.opening import open_source

#: Shards of 16^3, so that a small volume has many.
SMALL = {"chunk": 16, "shard": 16, "workers": 1}


SHAPE = (24, 40, 70)


@pytest.fixture(scope="module")
def data():
    return np.random.default_rng(0).integers(0, 255, SHAPE).astype(np.uint8)


@pytest.fixture(scope="module")
def few(data):
    """Samples of 6 shards, for tests that convert several times."""
    return data[:14, :20, :35].copy()


@pytest.fixture(scope="module")
def made(data, tmp_path_factory):
    return isospline.convert(data, tmp_path_factory.mktemp("made") / "a.zarr", **SMALL)


@pytest.fixture
def store(made, tmp_path):
    """A store to damage."""
    return shutil.copytree(made, tmp_path / "a.zarr")


def contents(path):
    """All files of a store except its description, which also has the source."""
    return {
        file.relative_to(path): file.read_bytes() for file in path.rglob("*") if file.is_file() and file.parent != path
    }


def stopped(data, path, after=1, **options):
    """Begin a conversion, and cancel it when `progress` is called for the time after `after`."""
    count = itertools.count()
    with pytest.raises(isospline.Cancelled):
        isospline.convert(data, path, **options, progress=lambda _: next(count) < after)


@pytest.mark.sweep(1)
@pytest.mark.slow
@pytest.mark.parametrize("after, files", [(1, 0), (38, 16), (64, 64), (100, 100)])
def test_a_conversion_continues_after_an_interruption(data, made, tmp_path, after, files):
    path = tmp_path / "b.zarr"
    stopped(data, path, after, **SMALL)
    with pytest.raises(ValueError, match=r"b\.zarr: expected a complete store"):
        read_metadata(path)
    if files:  # one that a killed process was writing
        (path / "coefficients" / "0" / "c.0123456789abcdef.partial").write_bytes(b"half")
    times = {file: file.stat().st_mtime_ns for file in path.rglob("*") if "c" in file.parts and file.is_file()}
    isospline.convert(data, path, **SMALL)
    assert contents(path) == contents(made)
    assert all(file.stat().st_mtime_ns == changed for file, changed in times.items() if file.suffix != ".partial")
    assert len(times) >= files


@pytest.mark.slow
def test_options_that_differ_are_refused(few, tmp_path):
    path = tmp_path / "a.zarr"
    stopped(few, path, 9, **SMALL)
    for options, name in (
        ({"degree": 3}, "degree"),
        ({"boundary": "periodic"}, "boundary"),
        ({"filter": "none"}, "filter"),
        ({"spacing": 2}, "spacing"),
        ({"origin": (0, 0, 1)}, "origin"),
        ({"chunk": 8}, "chunk"),
    ):
        with pytest.raises(ValueError, match=rf"a\.zarr: expected {name} as in the conversion that was begun"):
            isospline.convert(few, path, **SMALL | options)
    with pytest.raises(ValueError, match="expected source as in the conversion that was begun"):
        isospline.convert(few[:-1], path, **SMALL)
    with pytest.raises(
        ValueError, match="source: expected the samples .*got others: their maximum is 255.0, not 254.0"
    ):
        isospline.convert(np.where(few == 254, 255, few).astype(np.uint8), path, **SMALL)
    with pytest.raises(ValueError, match="source: expected the samples .*got others: their digest is"):
        isospline.convert(few[:, :, ::-1], path, **SMALL)
    isospline.convert(few, path, **SMALL)
    with pytest.raises(FileExistsError, match=r"a\.zarr: expected no store, or an incomplete one"):
        isospline.convert(few, path, **SMALL)
    isospline.convert(few, path, **SMALL, degree=3, overwrite=True)
    assert read_metadata(path).degree == 3


@pytest.mark.parametrize("shard", [0, 8, 24, 144, 33])
def test_bad_shards(data, tmp_path, shard):
    with pytest.raises(ValueError, match="^shard: expected a multiple of the chunk, 16 to 128"):
        isospline.convert(data, tmp_path / "a.zarr", chunk=16, shard=shard)


def test_nothing_but_a_store_is_overwritten(data, tmp_path):
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "thesis.tex").write_text("dear", encoding="utf-8")
    with pytest.raises(FileExistsError, match="folder: expected a new folder, or the folder of a store"):
        isospline.convert(data, folder, overwrite=True)
    with pytest.raises(FileExistsError, match="got a file"):
        isospline.convert(data, folder / "thesis.tex", overwrite=True)
    assert (folder / "thesis.tex").read_text(encoding="utf-8") == "dear"
    with pytest.raises(FileNotFoundError, match="expected a folder that exists"):
        isospline.convert(data, tmp_path / "no" / "a.zarr")


@pytest.mark.parametrize("given", ["a path", "an array", "a link"])
def test_a_store_is_not_replaced_by_itself(store, tmp_path, given):
    (tmp_path / "link").symlink_to(store)
    source = zarr.open_array(store, path="0") if given == "an array" else store
    with pytest.raises(ValueError, match="^out: expected another folder than that of the source, got .*zarr"):
        isospline.convert(source, tmp_path / "link" if given == "a link" else store, degree=3, overwrite=True)
    assert read_metadata(store).degree == 2


@pytest.mark.parametrize("view", [lambda array: array, lambda array: array.T, lambda array: array[::-1, 1:]])
@pytest.mark.parametrize("mode", ["r", "c"])
def test_a_file_of_mapped_samples_in_the_store_is_not_removed(store, few, view, mode):
    np.save(store / "samples.npy", few)
    samples = view(np.load(store / "samples.npy", mmap_mode=mode))
    with pytest.raises(ValueError, match="^out: expected another folder than that of the source, got .*zarr"):
        isospline.convert(samples, store, overwrite=True)
    np.testing.assert_array_equal(np.load(store / "samples.npy"), few)


def test_compressed_samples_leave_no_copy_of_theirs(few, tmp_path):
    tifffile = pytest.importorskip("tifffile")
    tifffile.imwrite(tmp_path / "a.tif", few, compression="zlib")
    path = isospline.convert(tmp_path / "a.tif", tmp_path / "a.zarr", spacing=1, **SMALL)
    assert not (path / "staged").exists()
    tifffile.imwrite(tmp_path / "nan.tif", np.where(few == 254, np.nan, few).astype(np.float32), compression="zlib")
    with pytest.raises(ValueError, match="expected finite numbers, got nan"):
        isospline.convert(tmp_path / "nan.tif", path, overwrite=True, spacing=1, **SMALL)
    assert not (path / "staged").exists() and read_metadata(path).scales[0].maximum == few.max()


def test_overwriting_forgets_the_samples_of_another_source(few, tmp_path):
    tifffile = pytest.importorskip("tifffile")
    for name, samples in (("a", few), ("b", few[::-1])):
        tifffile.imwrite(tmp_path / f"{name}.tif", samples, compression="zlib")
    path = tmp_path / "c.zarr"
    stopped(tmp_path / "a.tif", path, 4, spacing=1, **SMALL)
    assert (path / "staged").exists()
    isospline.convert(tmp_path / "b.tif", path, overwrite=True, spacing=1, **SMALL)
    np.testing.assert_array_equal(zarr.open_array(path, path="0")[:], few[::-1])


def test_a_store_is_kept_where_a_new_one_cannot_be_made(data, store):
    with pytest.raises(ValueError, match=r"memory_limit: expected at least \d+MB for blocks of"):
        isospline.convert(data, store, overwrite=True, memory_limit="1MB")
    read_metadata(store)


def test_samples_that_are_not_finite_are_named(tmp_path):
    data = np.zeros((20, 30, 40), np.float32)
    data[7, 21, 39] = np.nan
    with pytest.raises(ValueError, match=r"source: expected finite numbers"):
        isospline.convert(data, tmp_path / "a.zarr")
    data[7, 21, 39] = 1e35
    with pytest.raises(ValueError, match="source: expected a range of 1e-30 to 1e34"):
        isospline.convert(data, tmp_path / "b.zarr")


@pytest.mark.slow
def test_a_full_disk_is_an_error_that_names_the_file(tmp_path):
    """The system's limit for the size of files simulates the full disk."""
    script = f"""
        import numpy as np, isospline, resource, signal
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
        try:
            isospline.convert(np.zeros((40, 40, 40), np.uint8), {str(tmp_path / "a.zarr")!r})
        except OSError as error:
            print(type(error).__name__, error.errno, error)
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], capture_output=True, encoding="utf-8")
    assert (
        "File too large; the store is incomplete" in done.stdout and "a.zarr/coefficients/0/c/0/0/0" in done.stdout
    ), done
    with pytest.raises(ValueError, match="expected a complete store"):
        read_metadata(tmp_path / "a.zarr")
    isospline.convert(np.zeros((40, 40, 40), np.uint8), tmp_path / "a.zarr")
    assert not list(tmp_path.rglob("*.partial"))


def test_a_full_disk_while_samples_are_staged_names_their_file(tmp_path, rng):
    resource, tifffile = pytest.importorskip("resource"), pytest.importorskip("tifffile")
    (tmp_path / "slices").mkdir()
    for number in range(3):
        tifffile.imwrite(tmp_path / "slices" / f"{number}.tif", rng.random((30, 30)))  # less than a buffer
    source = open_source(tmp_path / "slices", "zyx", dict(shape=None, dtype=None, offset=0, name=None))
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, before[1]))
    try:
        with pytest.raises(OSError, match=r"the store is incomplete; run the same conversion again .*staged"):
            source.stage(tmp_path / "staged", lambda fraction: None)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    staged = source.stage(tmp_path / "staged", lambda fraction: None)
    np.testing.assert_array_equal(
        staged.read([(0, 3), (0, 30), (0, 30)])[2], tifffile.imread(tmp_path / "slices" / "2.tif")
    )


@pytest.mark.parametrize("damage", ["flipped", "truncated", "deleted", "index"])
@pytest.mark.parametrize("key", ["coefficients/0", "ranges/0"])
def test_damaged_chunks_are_named(store, damage, key):
    chunk = store / key / "c" / "1" / "2" / "3"
    if key.startswith("ranges"):
        chunk = chunk / "0" / "0"
    content = bytearray(chunk.read_bytes())
    if damage == "flipped":
        content[len(content) // 2] ^= 4
    elif damage == "index":
        content[-6 if key == "coefficients/0" else -1] ^= 4
    chunk.write_bytes(content[:-100] if damage == "truncated" else content)
    if damage == "deleted":
        chunk.unlink()
    name = chunk.relative_to(store)
    metadata = read_metadata(store)
    with pytest.raises(ValueError, match=rf"a\.zarr: chunk {name} cannot be read: "):
        if key == "coefficients/0":
            layout.read_box(store, "coefficients/0", tuple((0, size) for size in SHAPE))
        else:
            read_ranges(metadata, metadata.scales[0])


def set_level(store, **fields):
    """Change the metadata of a store's finest level."""
    description = json.loads((store / "zarr.json").read_text(encoding="utf-8"))
    description["attributes"]["isospline"]["levels"][0].update(fields)
    (store / "zarr.json").write_text(json.dumps(description), encoding="utf-8")


@pytest.mark.parametrize("key", ["../other", "/etc", "0/../../other", "..", "", ".", "a\0b", 7, "0\\..\\1"])
@pytest.mark.parametrize("field", ["path", "ranges"])
def test_keys_never_leave_a_store(store, tmp_path, field, key):
    shutil.copytree(store / "coefficients" / "0", tmp_path / "other")
    set_level(store, **{field: key})
    with pytest.raises(ValueError, match=rf"a\.zarr: levels\[0\]: {field}: expected"):
        read_metadata(store)


@pytest.mark.parametrize(
    "linked",
    [
        "coefficients/0",
        "coefficients/0/zarr.json",
        "coefficients/0/c/0",
        "coefficients/0/c/1/1/1",
        "0",
        "ranges",
        "ranges/0/c/0/0/0/0/0",
    ],
)
def test_links_never_leave_a_store(store, tmp_path, linked):
    shutil.move(store / linked, tmp_path / "other")
    (store / linked).symlink_to(tmp_path / "other")
    with pytest.raises(
        ValueError, match=r"a\.zarr: .*expected (no link that leaves the store|a file within the store)"
    ):
        read_metadata(store)


def test_a_link_to_a_store_is_one(store, tmp_path):
    (tmp_path / "link.zarr").symlink_to(store)
    assert read_metadata(tmp_path / "link.zarr").path == store


@pytest.mark.parametrize(
    "fields",
    [
        {"shape": [24, 40, 71]},
        {"shape": [24, 40]},
        {"shape": [24, 40, -1]},
        {"minimum": "a"},
        {"offset": None},
        {"minimum": 300},
        {"spacing": [1, 1, 0]},
        {"origin": [1, 2]},
        {"direction": [[1, 0], [0, 1]]},
        {"direction": "x"},
    ],
)
def test_descriptions_that_are_wrong_are_refused(store, fields):
    set_level(store, **fields)
    with pytest.raises(ValueError, match=rf"a\.zarr: levels\[0\]: .*{next(iter(fields))}"):
        read_metadata(store)


def test_folders_that_are_no_stores_are_refused(store, tmp_path):
    with pytest.raises(FileNotFoundError, match=r"missing\.zarr'$"):
        read_metadata(tmp_path / "missing.zarr")
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(ValueError, match="file: expected the folder of a store"):
        read_metadata(tmp_path / "file")
    zarr.create_group(tmp_path / "group.zarr")
    with pytest.raises(ValueError, match=r"group\.zarr: expected a store that isospline\.convert has written"):
        read_metadata(tmp_path / "group.zarr")
    description = store / "zarr.json"
    text = description.read_text(encoding="utf-8")
    for content, expected in (
        (text[:100], "expected JSON"),
        ("[]", "expected an object"),
        ("[" * 100_000, "expected JSON"),
        (
            text.replace('"version": 2', '"version": 1'),
            "expected a store of version 2, got version 1: convert its source",
        ),
        (text.replace('"degree": 2', '"degree": 6'), "degree: expected one of 0, 1, 2, 3, 4, 5, got 6"),
        (text.replace('"zarr_format": 3', '"zarr_format": 2'), "expected a Zarr 3 group"),
    ):
        description.write_text(content, encoding="utf-8")
        with pytest.raises(ValueError, match=rf"a\.zarr: .*{expected}"):
            read_metadata(store)
    description.write_text(text, encoding="utf-8")
    array = store / "coefficients" / "0" / "zarr.json"
    text = array.read_text(encoding="utf-8")
    for old, new in (("float32", "float64"), ("crc32c", "gzip"), ("sharding_indexed", "bytes"), ('"end"', '"start"')):
        assert old in text
        array.write_text(text.replace(old, new), encoding="utf-8")
        with pytest.raises(ValueError, match=r"a\.zarr: levels\[0\]: coefficients/0: expected"):
            read_metadata(store)


def test_one_process_at_a_time_writes_a_store(data, tmp_path):
    def begin_again(_):
        isospline.convert(data, tmp_path / "a.zarr")

    with pytest.raises(ValueError, match="expected a store that no other process is writing"):
        isospline.convert(data, tmp_path / "a.zarr", progress=begin_again)


@pytest.mark.slow
def test_two_processes_read_one_store(store):
    script = f"""
        from isospline.store import layout, read_metadata, read_ranges
        for _ in range(5):
            store = read_metadata({str(store)!r})
            total = float(layout.read_box(store.path, "coefficients/0", [(0, size) for size in {SHAPE}]).sum())
            total += float(read_ranges(store, store.scales[0])[0, 0, 0].sum())
        print(total)
    """
    command = [sys.executable, "-c", textwrap.dedent(script)]
    running = [subprocess.Popen(command, stdout=subprocess.PIPE, encoding="utf-8") for _ in range(2)]
    told = [each.communicate()[0] for each in running]
    assert told[0] == told[1] != "" and all(each.returncode == 0 for each in running)


@pytest.mark.long
def test_memory_stays_under_the_limit(tmp_path):
    """The coefficients alone are larger than the limit, and the limit includes Python and its packages."""
    limit, size = 230, 400
    with open(tmp_path / "a.raw", "wb") as file:
        noise = np.random.default_rng(0).integers(0, 255, (size, size), np.uint8)
        for z in range(size):
            file.write(np.roll(noise, z, axis=1).tobytes())
    script = f"""
        import isospline, pathlib
        options = dict(shape=({size},) * 3, dtype="u1", memory_limit="{limit}MB")
        isospline.convert({str(tmp_path / "a.raw")!r}, {str(tmp_path / "a.zarr")!r}, **options)
        lines = pathlib.Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        print(next(1024 * int(line.split()[1]) for line in lines if line.startswith("VmHWM")))
    """
    told = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)], capture_output=True, encoding="utf-8", check=True
    )
    assert 4 * size**3 > limit * 1e6 > int(told.stdout)


@pytest.mark.slow
def test_progress_grows_to_one_and_cancels(data, tmp_path):
    told = []
    isospline.convert(data, tmp_path / "a.zarr", **SMALL, progress=told.append)
    assert told == sorted(told) and told[0] == 0 and told[-1] == pytest.approx(1) and len(told) > 50
    with pytest.raises(isospline.Cancelled):
        isospline.convert(data, tmp_path / "b.zarr", **SMALL, progress=lambda fraction: fraction < 0.3)
    isospline.convert(data, tmp_path / "b.zarr", **SMALL)
    assert contents(tmp_path / "a.zarr") == contents(tmp_path / "b.zarr")


@pytest.mark.slow
def test_dask_and_a_cluster_write_the_same(few, tmp_path):
    distributed = pytest.importorskip("distributed")
    expected = contents(isospline.convert(few, tmp_path / "one.zarr", **SMALL))
    assert contents(isospline.convert(few, tmp_path / "threads.zarr", **SMALL | {"workers": 3})) == expected
    np.save(tmp_path / "a.npy", few)
    with distributed.Client(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0") as client:
        path = isospline.convert(tmp_path / "a.npy", tmp_path / "cluster.zarr", chunk=16, shard=16, client=client)
        with pytest.raises(ValueError, match="expected finite numbers"):
            isospline.convert(np.full((9, 9, 9), np.inf), tmp_path / "bad.zarr", client=client)
        with pytest.raises(ValueError, match="workers: cannot be combined with a client, which has its own"):
            isospline.convert(tmp_path / "a.npy", tmp_path / "bad.zarr", client=client, workers=2)
    assert contents(path) == expected


@pytest.mark.slow
def test_the_command_continues_after_ctrl_c(data, tmp_path):
    np.save(tmp_path / "a.npy", data)
    store = tmp_path / "a.zarr"
    # The memory of a process of its own: that of the tests counts what others have left.
    command = [sys.executable, "-m", "isospline", "convert", str(tmp_path / "a.npy"), str(store), "--chunk", "8"]
    command += ["--memory-limit", "300MB", "--spacing", "1,2,3", "--degree", "3"]
    running = subprocess.Popen(command, stderr=subprocess.PIPE, encoding="utf-8", preexec_fn=obey_signals)
    deadline = time.monotonic() + 100
    while not list(store.glob("0/c/*/*/*")) and time.monotonic() < deadline:
        time.sleep(0.01)
    running.send_signal(signal.SIGINT)
    told = running.communicate()[1]
    assert running.returncode == 130 and "a.zarr is incomplete; run the same command again to continue" in told, told
    done = subprocess.run(command, capture_output=True, encoding="utf-8")
    assert done.returncode == 0 and "scales of " in done.stdout, done
    assert read_metadata(store).scales[0].spacing == (1, 2, 3)
    again = subprocess.run(command, capture_output=True, encoding="utf-8")
    assert again.returncode == 2 and "expected no store, or an incomplete one" in again.stderr
    assert os.listdir(tmp_path) and not list(store.rglob("*.partial"))


def test_a_conversion_that_found_nan_begins_again_with_other_options(data, made, tmp_path):
    path = tmp_path / "b.zarr"
    holed = np.where(data == 254, np.nan, data).astype(np.float32)
    with pytest.raises(ValueError, match="expected finite numbers, got nan"):
        isospline.convert(holed, path, **SMALL)
    isospline.convert(holed, path, **SMALL, nan=7, degree=3)
    expected = isospline.Volume(np.where(data == 254, 7, data).astype(np.float32), degree=3)
    found = isospline.open_volume(path)
    points = np.random.default_rng(1).uniform(0, 20, (50, 3))
    np.testing.assert_allclose(found.sample(points), expected.sample(points), rtol=1e-4, atol=1e-3)


def test_samples_that_were_staged_of_another_source_are_not_used(data, made, tmp_path):
    tifffile = pytest.importorskip("tifffile")
    for name, samples in (("a", 254 - data), ("b", data)):
        tifffile.imwrite(tmp_path / f"{name}.tif", samples, compression="zlib", photometric="minisblack")
    path = tmp_path / "c.zarr"
    with pytest.raises(isospline.Cancelled):
        isospline.convert(tmp_path / "a.tif", path, **SMALL, progress=lambda _: not (path / "staged").exists())
    with pytest.raises(isospline.Cancelled):  # the same source with another option goes on
        isospline.convert(tmp_path / "a.tif", path, **SMALL, degree=3, progress=lambda fraction: fraction < 0.2)
    isospline.convert(tmp_path / "b.tif", path, **SMALL)
    assert contents(path) == contents(made)
