"""Periodic motions and their branches."""

from __future__ import annotations

import numpy as np
import pytest
import xarray

import stickslip

HOPF = 0.46051701859880914
"""m/s: the belt speed at which steady sliding of belt-exponential has no damping, ln(10)/5."""


def test_analytic_stick_slip_of_the_belt(tmp_path):
    cycle = stickslip.cycle("belt-exponential")
    # One stick and one slip: what a mass without a second degree of freedom is multiplied by is exactly 0.
    assert cycle.stability == "stable"
    assert cycle.multipliers.dtype == np.complex128
    assert cycle.multipliers.tolist() == [1.0, 0.0]
    assert cycle.multiplier_kinds == ["along", "stick"]
    assert sorted(cycle.events["kind"]) == ["slip", "stick"]
    # Of the file of the case: sticks of 0.136334 s and slips of 0.522520 s.
    assert cycle.period == pytest.approx(0.136334 + 0.522520, abs=2e-6)
    # The run is that of one period: it ends where it began.
    first, last = (cycle.run.at([time], "phi1")[0] for time in (0.0, cycle.period))
    assert last == pytest.approx(first, abs=1e-11)
    positions = cycle.run.trajectory["phi1"]
    assert cycle.amplitude == pytest.approx(np.ptp(positions) / 2, rel=1e-3)
    assert "period" in str(cycle) and "stable" in repr(cycle) and str(tmp_path) not in str(cycle)
    assert cycle.path is None


def test_property_a_certified_cycle_has_its_events():
    certificate = stickslip.certify(stickslip.cycle("belt-leine").run, digits=25)
    assert certificate.converged and certificate.digits >= 15
    assert certificate.events["kind"].tolist() == ["stick", "slip"]
    assert np.all(certificate.events["uncertainty"] < 1e-20)
    assert certificate.document["period"]["decimal"].startswith("12.0010312948305786469047")
    assert "converged" in repr(certificate)


def test_property_an_output_is_kept(tmp_path):
    file = tmp_path / "one.h5"
    cycle = stickslip.cycle("belt-exponential", {"rotor.speed": 0.25}, period=0.75, output=file)
    assert cycle.path == file and file.exists()
    opened = stickslip.open(file)
    assert isinstance(opened, stickslip.Run)
    assert np.array_equal(opened.time, cycle.run.time)


def test_property_wrong_searches():
    with pytest.raises(stickslip.InputError, match='start="middle"'):
        stickslip.cycle("belt-exponential", start="middle")
    with pytest.raises(stickslip.InputError, match="give both"):
        stickslip.cycle("belt-exponential", branch=1)
    with pytest.raises(stickslip.RunError, match='start="initial"'):
        # Steady sliding is stable there, and attracts the motion of a light start.
        stickslip.cycle("belt-exponential", {"rotor.speed": 3.0})


@pytest.fixture(scope="module")
def branches(tmp_path_factory):
    file = tmp_path_factory.mktemp("branches") / "belt.h5"
    study = {"rotor.speed": {"from": 0.25, "to": 0.7}}
    dataset = stickslip.continue_(study, "belt-exponential", of=("steady", "cycle"), points=40, follow=(), output=file)
    return dataset, file


def test_analytic_the_hopf_point_of_the_belt(branches):
    dataset, _ = branches
    special = dict(zip(dataset["special"].attrs["flag_meanings"].split(), dataset["special"].attrs["flag_values"]))
    hopf = dataset.isel(point=dataset["special"] == special["hopf"])
    assert hopf["rotor_speed"].values == pytest.approx([HOPF], abs=1e-9)
    # Its eigenvalues are those of the mass on its spring.
    assert np.abs(hopf["multiplier_imaginary"].values) == pytest.approx(10.0, rel=1e-3)


def test_property_the_dataset_has_units_and_opens_again(branches):
    dataset, file = branches
    assert dataset["rotor_speed"].attrs["units"] == "m/s"
    assert set(dataset["rotor_speed"].dims) == set(dataset["branch"].dims) == {"point"}
    assert dataset["amplitude"].attrs["units"] == "m"
    assert dataset["state"].dims == ("point", "component")
    assert dataset["branch_what"].attrs["flag_meanings"] == "steady cycle"
    assert int(dataset["branch_points"].sum()) == dataset.sizes["point"]
    again = stickslip.open(file)
    assert isinstance(again, xarray.Dataset)
    xarray.testing.assert_identical(dataset.drop_attrs(deep=False), again.drop_attrs(deep=False))


def test_property_a_point_of_a_branch_is_a_cycle(branches):
    dataset, file = branches
    cycles = dataset["branch_what"].values[dataset["branch"].values] == 1
    number = int(np.flatnonzero(cycles)[3])
    branch = int(dataset["branch"][number])
    point = number - int(dataset["branch_first_point"][branch])
    cycle = stickslip.cycle(file, branch=branch, point=point)
    assert cycle.period == pytest.approx(float(dataset["period"][number]), rel=1e-9)
    assert cycle.amplitude == pytest.approx(float(dataset["amplitude"][number]), rel=1e-6)


def test_property_wrong_studies(tmp_path):
    study = {"rotor.speed": {"from": 0.25, "to": 0.7}}
    with pytest.raises(stickslip.InputError, match="name it"):
        stickslip.continue_(study)
    with pytest.raises(stickslip.InputError, match="a study says them itself"):
        stickslip.continue_("belt-branches", "belt-exponential")
    with pytest.raises(stickslip.InputError, match="name it with output="):
        stickslip.continue_(study, "belt-exponential", resume=True)
    with pytest.raises(stickslip.InputError, match="branch.direction"):
        stickslip.continue_(study, "belt-exponential", direction="left")
