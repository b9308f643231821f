"""Certificates as objects."""

from __future__ import annotations

import numpy as np
import pytest

import stickslip


@pytest.fixture(scope="module")
def certificate(paper):
    return stickslip.certify(paper)


def test_multiprecision_paper_certificate(certificate, paper):
    # 30-digit events of data/truth: the first stick of the built-in case.
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
    with pytest.raises(stickslip.FileError):
        certificate.save(path)


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
