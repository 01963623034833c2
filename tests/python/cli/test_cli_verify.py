"""`isospline verify`: the certificate of a ray against its volume."""

import json

import numpy as np
import pytest
from command_line import fails

import isospline
from isospline.cli.main import main


@pytest.fixture
def scene(ball):
    return isospline.Scene(isospline.Isosurface(isospline.Volume(np.load(ball)), 0))


def written(path, certificate):
    path.write_text(json.dumps(certificate), encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(
    ("level", "limits", "sentence"),
    [
        (0, {}, "proven: the ray first meets f = 0 between t = "),
        (0, {"t_far": 1.5}, "proven: the ray does not meet f = 0 from t = 0 to 1.5 ("),
    ],
)
def test_what_is_proven(ball, tmp_path, capsys, level, limits, sentence):
    volume = isospline.Volume(np.load(ball), degree=3, boundary="periodic")
    scene = isospline.Scene(isospline.Isosurface(volume, level))
    center = (np.array(volume.shape[::-1]) - 1) / 2
    certificate = scene.certificate([*center - (0, 0, 40), 0, 0, 1], **limits)
    path = written(tmp_path / "c.json", certificate)
    coefficients = tmp_path / "coefficients.f32"
    assert main(["verify", path, str(ball), "--coefficients", str(coefficients)]) == 0
    assert capsys.readouterr().out.startswith(sentence)
    stored = np.fromfile(coefficients, "<f4").reshape(volume.shape)
    np.testing.assert_allclose(stored.astype(float) + volume._offset, volume.coefficients, rtol=1e-12)


def test_a_store_is_verified(ball, scene, tmp_path, capsys):
    pytest.importorskip("zarr")
    store = isospline.convert(np.load(ball), tmp_path / "a.zarr")
    path = written(tmp_path / "c.json", scene.certificate((0, 0, -9, 0, 0, 1)))
    assert main(["verify", path, str(store)]) == 0
    assert capsys.readouterr().out.startswith("proven: ")


def test_an_undecided_ray(tmp_path, capsys):
    np.save(tmp_path / "steps.npy", np.repeat([0.0, 0.0, 1.0, 1.0], 16).reshape(4, 4, 4))
    volume = isospline.Volume(np.load(tmp_path / "steps.npy"), degree=1)
    scene = isospline.Scene(isospline.Isosurface(volume, 1.0))
    certificate = scene.certificate((1.5, 1.5, 0, 0, 0, 1))
    assert certificate["statement"] == "undecided"
    assert main(["verify", written(tmp_path / "c.json", certificate), str(tmp_path / "steps.npy")]) == 0
    assert "before it is at most" in capsys.readouterr().out


def test_what_is_wrong(ball, scene, tmp_path, capsys):
    certificate = scene.certificate((0, 0, -9, 0, 0, 1))
    path = tmp_path / "c.json"
    changed = {**certificate, "statement": "hit"}
    fails(capsys, 2, "but the content is not that of the digest", "verify", written(path, changed), ball)
    np.save(tmp_path / "other.npy", np.load(ball) + 1)
    fails(capsys, 2, "but the offset is not", "verify", written(path, certificate), tmp_path / "other.npy")
    fails(capsys, 2, "expected one of version 1", "verify", written(path, {"model": {"degree": 2}}), ball)
    fails(capsys, 2, "expected one of version 1", "verify", written(path, [1]), ball)
    path.write_bytes(b"\xff\xfe{")
    fails(capsys, 2, "expected a certificate in JSON", "verify", path, ball)
    path.write_bytes(b"[" * 100_000)
    fails(capsys, 2, r"c\.json: expected a certificate in JSON, got maximum recursion depth", "verify", path, ball)
    fails(capsys, 2, "No such file", "verify", tmp_path / "none.json", ball)
