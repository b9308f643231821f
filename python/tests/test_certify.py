"""Certificates as objects."""

from __future__ import annotations

import numpy as np
import pytest
import xarray

import stickslip


@pytest.fixture(scope="module")
def certificate(paper):
    return stickslip.certify(paper)


def test_cli_paper_certificate(certificate, paper):
    events = certificate.events
    assert certificate.converged
    assert len(events) == len(paper.events)
    assert np.array_equal(events["time"], paper.events["time"])
    assert certificate.digits == events["digits"].min() >= 9
    assert np.all(events["uncertainty"] < 1e-9)


def test_results_certified_run(certificate, tmp_path):
    uncertainty = certificate.run.events["time_uncertainty"]
    assert np.array_equal(uncertainty, certificate.events["uncertainty"])
    path = certificate.save(tmp_path / "certified.h5")
    opened = stickslip.open(path)
    assert np.array_equal(opened.events["time_uncertainty"], uncertainty)
    assert {"certificate", "sensitivity"} <= {name.split("/")[0] for name in opened.tables}
    # An earlier result is replaced, another file is not.
    assert certificate.save(path) == path
    other = tmp_path / "notes.txt"
    other.write_text("mine")
    with pytest.raises(stickslip.FileError, match="is not a result"):
        certificate.save(other)
    assert other.read_text() == "mine" and len(list(tmp_path.iterdir())) == 2
    for group in ("certificate", "sensitivity"):
        dataset = opened.to_xarray(group)
        with xarray.open_dataset(path, group=group, engine="h5netcdf") as file:
            for name, variable in dataset.variables.items():
                assert variable.dims == file.variables[name].dims, name
                assert np.array_equal(variable.values, file.variables[name].values, equal_nan=True), name


def test_regression_overrides_of_a_run_are_refused(paper):
    with pytest.raises(stickslip.InputError, match="certified as it is"):
        stickslip.certify(paper, {"friction.decay": 4.0})


def test_regression_a_file_that_was_replaced_is_not_the_run(belt, tmp_path, monkeypatch):
    path = belt.save(tmp_path / "a.h5")
    opened = stickslip.open(path)
    stickslip.run("belt-leine", {"output.end_time": 5}).save(path, replace=True)
    for use in (lambda: stickslip.certify(opened), lambda: stickslip.compare(opened, belt)):
        with pytest.raises(stickslip.FileError, match="open it again"):
            use()
    # By another folder's name it is the same file.
    monkeypatch.chdir(tmp_path)
    again = stickslip.open("a.h5")
    (tmp_path / "other").mkdir()
    monkeypatch.chdir(tmp_path / "other")
    assert stickslip.compare(again, again).document["missing"] == 0


def test_cli_certificate_text(certificate):
    text = str(certificate)
    assert "converged: every event within" in text
    assert "certified.h5" not in text
    assert "converged" in repr(certificate)
    assert certificate.sensitivities[0]["parameter"]


def test_cli_certificate_falls_short(belt):
    certificate = stickslip.certify(belt, digits=16)
    assert certificate.shortfall is not None and "16 digits" in certificate.shortfall


def test_property_certify_a_case():
    certificate = stickslip.certify("belt-leine", {"output.end_time": 10})
    assert certificate.converged
    assert "true_error" in certificate.events.dtype.names


def test_property_in_a_notebook(certificate, paper):
    shown = certificate._repr_html_()
    assert "<table>" in shown and f"{len(certificate.events) - 20} more" in shown and "<pre>" in shown
    comparison = stickslip.compare(paper, paper)._repr_html_()
    assert "the event sequences agree" in comparison and "<pre>" in comparison
