"""Label maps: files, names, colours, tables and comparisons."""

import numpy as np
import pytest
from labels import label_maps as maps

import isospline
from isospline import Labels

# A direction that is no permutation of axes, and a place.
TURN = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]])
PLACE = {"spacing": (0.7, 0.8, 2.0), "origin": (-10.0, 20.0, 5.0), "direction": TURN}


def two_halves(radius=9, size=24):
    ball = maps.sphere(radius, size=size)[0]
    return np.where(ball, 1 + 4 * (maps.grid(size, size, size)[0] >= size / 2), 0).astype(np.int16)


def header_of_slicer(segments, **more):
    """Fields of a header that 3D Slicer would write."""
    header = {
        "space": "left-posterior-superior",
        "space directions": (TURN * PLACE["spacing"]).T,
        "space origin": PLACE["origin"],
        "Segmentation_ConversionParameters": "Decimation factor|0.0|" * 100,  # longer than Teem's buffer
        **more,
    }
    for place, (name, color, value, layer) in enumerate(segments):
        header |= {
            f"Segment{place}_ID": f"Segment_{place}",
            f"Segment{place}_Name": name,
            f"Segment{place}_Color": color,
            f"Segment{place}_LabelValue": str(value),
            f"Segment{place}_Layer": str(layer),
            f"Segment{place}_Extent": "0 23 0 23 0 23",
        }
    return header


def check_place(labels):
    place = labels.frame
    np.testing.assert_allclose(place["spacing"], PLACE["spacing"])
    np.testing.assert_allclose(place["origin"], PLACE["origin"], atol=1e-5)
    np.testing.assert_allclose(place["direction"], TURN, atol=1e-6)


def test_an_array():
    data = two_halves()
    labels = Labels(data, names={1: "left", 5: "right", 7: "nowhere"}, colors={"left": "red", 5: (0, 0.5, 0)}, **PLACE)
    assert labels.numbers == (1, 5) and labels.names == ("left", "right") and len(labels) == 2
    np.testing.assert_allclose(labels.colors, [(1, 0, 0), (0, 0.5, 0)], atol=1e-6)
    check_place(labels)
    table = labels.table()
    np.testing.assert_array_equal(table.voxel_counts, [(data == 1).sum(), (data == 5).sum()])
    np.testing.assert_array_equal(labels.mask("right"), data == 5)
    assert list(table.names) == ["left", "right"]
    assert repr(labels) == "Labels(shape=(24, 24, 24), 2 labels: 1 left, 5 right)"
    assert Labels(data, names={"background": 0, "liver": 1}).names == ("liver", "label 5")  # nnU-Net's dataset.json
    assert Labels(data.astype(float), background=1).numbers == (0, 5)


@pytest.mark.parametrize("kind", [np.uint8, bool, float])
def test_labels_stay_when_the_array_changes(kind):
    data = (two_halves() > 0).astype(kind)
    labels, count = Labels(data), np.count_nonzero(data)
    data[:] = 0
    assert labels.mask(1).sum() == labels.table().voxel_counts[0] == labels.measure().voxel_counts[0] == count
    with pytest.raises(ValueError, match="read-only"):
        labels.data[:] = 0
    data.flags.writeable = False
    assert np.shares_memory(Labels(data).data, data) == (kind is not float)


def test_surfaces_have_the_place_the_name_and_the_colour():
    data = two_halves()
    labels = Labels(data, names={5: "right"}, colors={5: "teal"}, **PLACE)
    surface = labels.surface("right", opacity=0.5)
    assert surface.name == "right" and surface.opacity == 0.5
    np.testing.assert_allclose(surface.color, (0, 128 / 255, 128 / 255), atol=1e-6)
    voxels = np.argwhere(data == 5)[:, ::-1]
    inside = (voxels * PLACE["spacing"]) @ TURN.T + PLACE["origin"]
    assert surface.contains(inside).all()
    assert not labels.surface(1).contains(inside).any()
    assert surface.enclosed_volume().value == pytest.approx(len(voxels) * 0.7 * 0.8 * 2, rel=0.005)


def test_a_material_replaces_the_colour_and_keeps_the_name():
    labels, material = Labels(two_halves(), names={5: "right"}), isospline.Material(color="red", roughness=0.2)
    surface = labels.surface(5, material=material)
    assert surface.material == material.replace(name="right") and surface.name == "right"
    assert labels.surface(5, material=material.replace(name="copper")).name == "copper"
    assert labels.surface(5, material=None).material == labels.surface(5).material
    with pytest.raises(TypeError, match="color: cannot be combined with material"):
        labels.surface(5, material=material, color="blue")


def test_colours_are_unlike():
    data = np.zeros((4, 4, 8), np.uint8)
    data.ravel()[:121] = np.arange(121)
    colors = Labels(data).colors
    assert colors.shape == (120, 3)
    assert (colors >= 0).all() and (colors <= 1).all()
    apart = np.linalg.norm(colors[:, None] - colors, axis=2)[~np.eye(120, dtype=bool)]
    assert apart.min() > 0.01
    assert np.linalg.norm(np.diff(colors, axis=0), axis=1).min() > 0.15


def test_a_scene_has_all_labels_with_their_names():
    labels = Labels(two_halves(), names={1: "left", 5: "right"})
    fractions = []
    scene = labels.scene(progress=fractions.append)
    assert [item.name for _, item, *_ in scene._placed_objects()] == ["left", "right"]
    assert fractions == sorted(fractions) and fractions[-1] == 1
    assert len(labels.scene(["right"]).ids) == 1
    picture = isospline.render(scene, size=(60, 40), samples=1, legend=True, light="phong")
    assert picture.size == (60, 40)


def test_measures():
    data = two_halves()
    labels = Labels(data, **PLACE)
    found = labels.measure()
    voxel = 0.7 * 0.8 * 2
    np.testing.assert_allclose(found.enclosed_volumes, found.voxel_counts * voxel, rtol=0.005)
    for place, number in enumerate(labels.numbers):
        index = np.argwhere(data == number).mean(axis=0)[::-1]
        np.testing.assert_allclose(found.centroids[place], TURN @ (index * PLACE["spacing"]) + PLACE["origin"])
    ball = Labels(maps.sphere(16)[0]).measure()
    assert ball.areas[0] == pytest.approx(4 * np.pi * 16**2, rel=0.01)


def test_tables_become_data_frames():
    pytest.importorskip("pandas")
    labels = Labels(two_halves(), names={1: "left", 5: "right"}, **PLACE)
    assert list(labels.table().to_frame().names) == ["left", "right"]
    found = labels.measure().to_frame()
    assert set(found.columns) >= {"names", "enclosed_volumes", "areas", "voxel_counts", "centroids_x"}


@pytest.mark.slow
def test_comparison_of_shifted_balls():
    x, y, z = maps.grid(24, 24, 24)
    balls = [((x - 10 - shift) ** 2 + (y - 12) ** 2 + (z - 12) ** 2 < 8**2).astype(np.uint8) for shift in (0, 3)]
    balls[1][2, 2, 2:6] = 4
    first, second = (Labels(each, spacing=(2, 2, 2)) for each in balls)
    found = first.compare(second)
    np.testing.assert_array_equal(found.numbers, [1, 4])
    masks = [each == 1 for each in balls]
    assert found.dice[0] == pytest.approx(2 * (masks[0] & masks[1]).sum() / (masks[0].sum() + masks[1].sum()))
    # The largest distance is the shift; the mean one is half of it, as the mean of the absolute cosine is a half.
    assert found.hausdorff_lower[0] == pytest.approx(6, rel=0.02) and found.hausdorff_upper[0] < 6.8
    assert found.mean_distances[0] == pytest.approx(3, rel=0.02)
    assert found.dice[1] == 0 and np.isnan(found.mean_distances[1])


def test_maps_of_two_units_are_not_compared():
    data = two_halves()
    first, second, other = (
        Labels(isospline.VolumeData(each, unit=unit))
        for each, unit in ((data, "mm"), (np.where(data == data.max(), 9, 0), "µm"), (data, "millimeter"))
    )
    # Without a label in common, no distance of surfaces would tell.
    with pytest.raises(ValueError, match="other: expected a map in mm, got one in µm"):
        first.compare(second)
    assert (first.compare(other).dice == 1).all()
    assert (first.compare(Labels(data)).dice == 1).all()


def test_rows_of_a_comparison_are_the_wanted_labels():
    labels = Labels(two_halves(2, 8), names={1: "left"})
    found = labels.compare(labels, [5, "left", 1])
    assert list(found.numbers) == [5, 1, 1] == list(labels.measure([5, "left", 1]).numbers)
    assert (found.dice == 1).all() and (found.mean_distances < 1e-6).all()


def test_a_comparison_by_name_needs_one_label_of_a_name():
    data = np.zeros((6, 6, 10), np.uint8)
    data[2:4, 2:4, 1:3], data[2:4, 2:4, 7:9] = 1, 5
    one, two = (Labels(data, names=names) for names in ({1: "a", 5: "b"}, {1: "a", 5: "a"}))
    assert one.compare(two, ["b"], by="name").dice[0] == 0
    assert two.compare(one, [5], by="name").dice[0] == 0
    for first, second, labels in ((one, two, ["a"]), (one, two, None), (two, one, [1, 5]), (two, one, None)):
        with pytest.raises(ValueError, match="by: expected names that one label of a map has, got 'a' of 1 and 5"):
            first.compare(second, labels, by="name")


def test_nifti(tmp_path):
    nibabel = pytest.importorskip("nibabel")
    data = two_halves()
    affine = np.eye(4)
    affine[:3, :3] = np.diag([-1, -1, 1]) @ TURN @ np.diag(PLACE["spacing"])  # RAS
    affine[:3, 3] = np.array(PLACE["origin"]) * (-1, -1, 1)
    image = nibabel.Nifti1Image(data.T, affine)
    table = '<?xml version="1.0"?><CaretExtension><VolumeInformation Index="0"><LabelTable>'
    table += '<Label Key="5" Red="1" Green="0.5" Blue="0" Alpha="1"><![CDATA[left kidney]]></Label>'
    table += '<Label Key="9" Red="1" Green="0" Blue="0">none</Label></LabelTable></VolumeInformation></CaretExtension>'
    image.header.extensions.append(nibabel.nifti1.Nifti1Extension(0, table.encode()))
    newer = nibabel.Nifti2Image(data.T, affine)
    newer.header.extensions.extend(image.header.extensions)
    for name, saved in (("seg.nii", image), ("seg.nii.gz", image), ("newer.nii.gz", newer)):
        nibabel.save(saved, tmp_path / name)
        labels = Labels.read(tmp_path / name)
        np.testing.assert_array_equal(labels.data, data)
        check_place(labels)
        assert labels.names == ("label 1", "left kidney")
        np.testing.assert_allclose(labels.colors[1], [1, 0.5, 0])


def test_segmentation_of_slicer(tmp_path):
    nrrd = pytest.importorskip("nrrd")
    data = two_halves()
    segments = [("Leber rechts GROESSER", "0.5 0.25 1", 5, 0), ("Milz", "1 0 0", 1, 0), ("empty", "0 1 0", 3, 0)]
    nrrd.write(str(tmp_path / "a.seg.nrrd"), data.T, header_of_slicer(segments))
    content = (tmp_path / "a.seg.nrrd").read_bytes()
    (tmp_path / "a.seg.nrrd").write_bytes(content.replace(b"GROESSER", "größer".encode(), 1))  # pynrrd writes ASCII
    labels = Labels.read(tmp_path / "a.seg.nrrd")
    np.testing.assert_array_equal(labels.data, data)
    check_place(labels)
    assert dict(zip(labels.numbers, labels.names)) == {1: "Milz", 5: "Leber rechts größer"}
    np.testing.assert_allclose(labels.colors[1], [0.5, 0.25, 1])
    assert Labels.read(tmp_path / "a.seg.nrrd", names={1: "spleen"}, spacing=(1, 1, 1)).names[0] == "spleen"
    assert labels.numbers[1:] == Labels.read(tmp_path / "a.seg.nrrd", background=labels.numbers[0]).numbers
    # As a volume, it has the same samples: long values in the header are skipped.
    np.testing.assert_array_equal(isospline.read_volume(tmp_path / "a.seg.nrrd").data, data)


def test_labels_without_a_segment_in_the_file_raise_a_warning(tmp_path):
    nrrd = pytest.importorskip("nrrd")
    data = two_halves()
    nrrd.write(str(tmp_path / "a.seg.nrrd"), data.T, header_of_slicer([("Milz", "1 0 0", 1, 0)]))
    count = np.count_nonzero(data == 5)
    told = f"^the file describes no segment with the number 5: {count} voxels are left out$"
    with pytest.warns(UserWarning, match=told):
        assert Labels.read(tmp_path / "a.seg.nrrd").numbers == (1,)
    assert Labels.read(tmp_path / "a.seg.nrrd", background=5).numbers == (1,)


def test_overlapping_segments_of_slicer(tmp_path):
    nrrd = pytest.importorskip("nrrd")
    layers = np.zeros((2, 24, 24, 24), np.uint8)
    layers[0, 3:12, 3:12, 3:12], layers[0, 12:20, 3:12, 3:12], layers[1, 6:15, 6:15, 6:15] = 1, 2, 1
    directions = np.vstack([np.full(3, np.nan), (TURN * PLACE["spacing"]).T])
    kinds = ["list", "domain", "domain", "domain"]
    segments = [("a", "1 0 0", 1, 0), ("b", "0 1 0", 2, 0), ("over both", "0 0 1", 1, 1)]
    header = header_of_slicer(segments, **{"space directions": directions, "kinds": kinds})
    nrrd.write(str(tmp_path / "b.seg.nrrd"), layers.transpose(0, 3, 2, 1), header)
    labels = Labels.read(tmp_path / "b.seg.nrrd")
    assert labels.names == ("a", "b", "over both") and labels.numbers == (1, 2, 3)
    check_place(labels)
    np.testing.assert_array_equal(labels.data, layers)
    np.testing.assert_array_equal(labels.mask("over both"), layers[1] == 1)
    np.testing.assert_array_equal(labels.table().voxel_counts, [729, 648, 729])
    with pytest.raises(ValueError, match="within"):
        Labels.read(tmp_path / "b.seg.nrrd", within=tmp_path / "elsewhere")
    assert Labels.read(tmp_path / "b.seg.nrrd", spacing=2).frame["spacing"] == (2, 2, 2)
    with pytest.raises(ValueError, match=r"name: expected none for .*b\.seg\.nrrd, which has one array, got 'x'"):
        Labels.read(tmp_path / "b.seg.nrrd", name="x")
    assert labels.surface(3).enclosed_volume().value == pytest.approx(729 * 0.7 * 0.8 * 2, rel=0.005)


def test_images_of_itk(tmp_path):
    sitk = pytest.importorskip("SimpleITK")
    data = two_halves()
    image = sitk.GetImageFromArray(data)
    image.SetSpacing(PLACE["spacing"])
    image.SetOrigin(PLACE["origin"])
    image.SetDirection(TURN.ravel().tolist())
    for name in ("seg.mha", "seg.nrrd"):
        sitk.WriteImage(image, str(tmp_path / name))
        labels = Labels.read(tmp_path / name)
        np.testing.assert_array_equal(labels.data, data)
        check_place(labels)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: Labels(np.full((3, 3, 3), 0.5)), ValueError, "data: expected whole numbers, the labels .*, got 0.5"),
        (lambda: Labels(np.full((3, 3, 3), np.nan)), ValueError, "data: expected whole numbers, .*, got nan"),
        (lambda: Labels(np.zeros((3, 3))), ValueError, r"data: expected a three-dimensional array .*\(3, 3\)"),
        (lambda: Labels(np.zeros((3, 3, 3, 2), int)), ValueError, r"a three-dimensional array .*\(3, 3, 3, 2\)"),
        (
            lambda: Labels(np.full((3, 3, 3), 3e9)),
            ValueError,
            "data: expected labels of 32 bits .* float64, got 3000000000",
        ),
        (lambda: Labels("a.nrrd"), TypeError, r"data: .* labels, got 'a.nrrd'; did you mean read_volume\(path\)"),
        (lambda: Labels(np.full((3, 3, 3), 1j)), TypeError, "data: expected whole numbers, got complex128"),
        (lambda: Labels(np.full((3, 3, 3), 2**63, "u8")), ValueError, r"data: expected labels below 2\*\*63, got 9"),
        (lambda: Labels(two_halves(), spacing=(1, -1, 1)), ValueError, "spacing: expected positive"),
        (lambda: Labels(two_halves(), names=["a"]), TypeError, "names: expected a dict"),
        (lambda: Labels(two_halves(), names={1: 2}), TypeError, "names: expected numbers and names"),
        (lambda: Labels(two_halves(), names={"a": 1, "b": 1}), ValueError, "names: expected one name of a label"),
        (lambda: Labels(two_halves(), colors={"x": "red"}), ValueError, "colors: expected numbers or names .* 'x'"),
        (lambda: Labels(two_halves(), background="no"), TypeError, "background: expected a whole number"),
        (lambda: Labels(two_halves(), names={1: "liver"}).surface("Livr"), ValueError, "did you mean 'liver'"),
        (lambda: Labels(two_halves()).surface(2), ValueError, "label: expected one of the numbers 1, 5, got 2"),
        (lambda: Labels(two_halves()).surface(1.5), TypeError, "label: expected the name or the number"),
        (lambda: Labels(two_halves(), names={1: "a", 5: "a"}).mask("a"), ValueError, "label: .* of 1 and 5"),
        (lambda: Labels(two_halves()).surface(1, smoothing="x"), TypeError, "smoothing: expected a number of voxels"),
        (lambda: Labels(two_halves()).scene("left"), TypeError, "labels: expected a sequence"),
        (lambda: Labels(two_halves()).measure(np.int64(1)), TypeError, "labels: expected a sequence .*, got .*int64"),
        (lambda: Labels(two_halves()).measure(1.5), TypeError, "labels: expected a sequence .*, got 1.5"),
        (lambda: Labels(two_halves() * 0).scene(), ValueError, "labels: expected at least one label, got none"),
        (lambda: Labels(two_halves()).compare(Labels(two_halves()), []), ValueError, "labels: expected at least one"),
        (lambda: Labels(two_halves() * 0).compare(Labels(two_halves() * 0)), ValueError, "labels: expected at least"),
        (lambda: Labels(two_halves()).compare(two_halves()), TypeError, "other: expected Labels"),
        (lambda: Labels(two_halves()).compare(Labels(two_halves()[1:])), ValueError, "other: expected 24 x 24 x 24"),
        (lambda: Labels(two_halves()).compare(Labels(two_halves(), origin=(1, 0, 0))), ValueError, "in the same place"),
        (lambda: Labels(two_halves()).compare(Labels(two_halves()), by="x"), ValueError, 'by: expected "number"'),
    ],
)
def test_wrong_arguments(call, error, message):
    with pytest.raises(error, match=message):
        call()


def test_wrong_values_in_the_header_of_slicer(tmp_path):
    nrrd = pytest.importorskip("nrrd")
    header = header_of_slicer([("a", "red", 1, 0)])
    header["Segment0_LabelValue"] = "many"
    nrrd.write(str(tmp_path / "c.seg.nrrd"), two_halves().T, header)
    with pytest.raises(ValueError, match=r"c.seg.nrrd: .*Segment0_LabelValue to be a whole number, got many"):
        Labels.read(tmp_path / "c.seg.nrrd")


def test_labels_stay_if_a_read_only_view_of_an_array_is_given():
    data = two_halves()
    view = data.view()
    view.flags.writeable = False
    labels = Labels(view)
    data[:] = 0
    assert labels.mask(5).sum() == labels.table().voxel_counts[1] > 0
