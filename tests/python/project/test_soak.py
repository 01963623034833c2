"""A short part of `make soak`: threads, forks, signals and little memory, with the answers of a quiet process."""

import sys

import pytest

for package in ("OpenEXR", "meshio", "zarr"):
    pytest.importorskip(package)


@pytest.mark.long
@pytest.mark.parametrize("spare", [None, 150])
def test_a_round(spare, repository, monkeypatch):
    monkeypatch.syspath_prepend(str(repository / "tests"))
    if not sys.platform.startswith("linux"):
        pytest.skip("memory is read from /proc")
    from soak.runner import run

    output, failed = run(8, seed=1, spare=spare)
    assert not failed, output
