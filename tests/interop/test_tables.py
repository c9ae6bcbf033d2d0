"""Results in xarray, pandas and MATLAB files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

import amb_design as ad
from amb_design.errors import ModelError, SpecError
from amb_design.interop.results import save_mat, to_pandas, to_xarray


@pytest.fixture(scope="module")
def response() -> ad.UnbalanceResponse:
    machine = ad.replace(ad.load("thesis-tuned"), {"rotor.shaft.elements": 4})
    return ad.unbalance_response(machine, [100.0, 200.0, 300.0])


def test_xarray(response: ad.UnbalanceResponse) -> None:
    pytest.importorskip("xarray", reason="xarray is not installed")
    table = to_xarray(response)
    assert table["displacements"].dims == ("speeds", "positions", "displacements_2")
    assert table["currents"].sel(speeds=200.0).shape == (2, 2)
    np.testing.assert_array_equal(table["currents"].values, response.currents)
    assert table.attrs["machine"] == "thesis-tuned"


def test_pandas(response: ad.UnbalanceResponse) -> None:
    pytest.importorskip("pandas", reason="pandas is not installed")
    table = to_pandas(response)
    assert table.index.name == "speeds"
    assert table.loc[200.0, "currents[1,0]"] == response.currents[1, 1, 0]
    with pytest.raises(ModelError, match="is no result of this package"):
        to_pandas(3)


@pytest.mark.parametrize("kind", ["campbell", "sensitivity", "simulation"])
def test_every_kind_of_result(kind: str, tmp_path: Path) -> None:
    xarray, machine = pytest.importorskip("xarray"), ad.replace(ad.load("thesis-tuned"), {"rotor.shaft.elements": 4})
    result, axis, along = {
        "campbell": lambda: (ad.campbell(machine, [0.0, 100.0, 200.0]), "speeds", "eigenvalues"),
        "sensitivity": lambda: (ad.sensitivity(machine, 100.0, [10.0, 20.0]), "frequencies", "sensitivity"),
        "simulation": lambda: (ad.simulate(machine, 0.01, speed=100.0, modes=4), "times", "currents"),
    }[kind]()
    table, rows = to_xarray(result), to_pandas(result)
    assert isinstance(table, xarray.Dataset)
    np.testing.assert_array_equal(table[axis].values, getattr(result, axis))
    np.testing.assert_array_equal(rows.index.to_numpy(), getattr(result, axis))
    save_mat(result, tmp_path / "result.mat")
    assert along in table
    np.testing.assert_array_equal(loadmat(tmp_path / "result.mat")[along], table[along].values)


def test_matlab(response: ad.UnbalanceResponse, tmp_path: Path) -> None:
    save_mat(response, tmp_path / "response.mat")
    found = loadmat(tmp_path / "response.mat")
    np.testing.assert_array_equal(found["currents"], response.currents)
    np.testing.assert_array_equal(found["speeds"][:, 0], response.speeds)
    with pytest.raises(SpecError, match=r"is no \.mat file"):
        save_mat(response, tmp_path / "response.txt")
