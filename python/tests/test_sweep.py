"""Studies as datasets."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import xarray

import stickslip

AXES = {"friction.decay": [3.0, 5.0, 8.0], "torsion.damping": {"from": 15, "to": 30, "count": 2}}


def test_property_grid(tmp_path):
    file = tmp_path / "map.h5"
    dataset = stickslip.sweep(AXES, "paper", {"solver.method": "series"}, output=file)
    assert dict(dataset.sizes) == {"friction_decay": 3, "torsion_damping": 2}
    assert dataset["friction_decay"].values.tolist() == [3.0, 5.0, 8.0]
    assert dataset["torsion_damping"].attrs["units"] == "N m s/rad"
    again = stickslip.open(file)
    assert isinstance(again, xarray.Dataset)
    xarray.testing.assert_identical(dataset.drop_attrs(deep=False), again.drop_attrs(deep=False))
    # One of its points by itself, at the tolerance of a study.
    run = stickslip.run("paper", {"friction.decay": 5.0, "torsion.damping": 30}, method="series", rtol=1e-8)
    point = dataset.sel(friction_decay=5.0, torsion_damping=30.0)
    assert int(point["stick_count"]) == run.summary["stick_count"]
    assert float(point["onset_time"]) == run.summary["onset_time"]


def test_results_grid_is_as_the_file_opens(tmp_path):
    file = tmp_path / "map.h5"
    dataset = stickslip.sweep(AXES, "paper", method="series", output=file)
    with xarray.open_dataset(file, engine="h5netcdf") as opened:
        assert dict(opened.sizes) == dict(dataset.sizes)
        for name in dataset.variables:
            np.testing.assert_array_equal(dataset[name].values, opened[name].values)


def test_property_sample_and_words():
    sample = stickslip.sweep(
        {"friction.decay": {"from": 3, "to": 8}}, sample={"method": "sobol", "count": 4, "seed": 1}, method="series"
    )
    assert dict(sample.sizes) == {"point": 4}
    words = stickslip.sweep({"solver.method": ["series", "arkode"]}, "paper", {"output.end_time": 0.01})
    assert words["solver_method"].values.tolist() == ["series", "arkode"]


def test_property_study_text():
    text = "case = 'paper'\n[set]\noutput.end_time = 0.01\n[[axis]]\nkey = 'torsion.damping'\nvalues = [10, 20]\n"
    assert stickslip.sweep(text).sizes == {"torsion_damping": 2}


def test_property_wrong_studies(tmp_path):
    with pytest.raises(stickslip.InputError):
        stickslip.sweep({"friction.deacy": [1, 2]})
    with pytest.raises(stickslip.InputError):
        stickslip.sweep("no-such-study")
    with pytest.raises(stickslip.InputError):
        stickslip.sweep("critical-curve", "paper")


def test_regression_an_interrupted_sweep_goes_on(tmp_path):
    file = tmp_path / "map.h5"
    axes = {"torsion.damping": {"from": 15, "to": 30, "count": 300}}
    options = {"method": "series", "jobs": 1, "output": file}
    told: list[tuple[int, int]] = []

    class Enough(Exception):
        """Of the user, while the sweep runs."""

    def stop_after_some(done: int, total: int) -> None:
        told.append((done, total))
        if done >= 3:
            raise Enough

    with pytest.raises(Enough):
        stickslip.sweep(axes, "paper", progress=stop_after_some, **options)
    kept = told[-1][0]
    assert 3 <= kept < 300 and told[-1][1] == 300
    # It says how to go on, in the words of this function.
    with pytest.raises(stickslip.InputError, match="resume=True goes on with it, replace=True"):
        stickslip.sweep(axes, "paper", **options)
    told.clear()
    dataset = stickslip.sweep(axes, "paper", resume=True, progress=lambda done, total: told.append((done, total)), **options)
    assert told[0][0] >= kept and told[-1] == (300, 300)
    whole = stickslip.sweep(axes, "paper", method="series")
    xarray.testing.assert_identical(dataset.drop_attrs(deep=False), whole.drop_attrs(deep=False))


def test_property_resume_and_progress(capsys, monkeypatch, tmp_path):
    axes, short = {"torsion.damping": [10, 20]}, {"output.end_time": 0.01}
    with pytest.raises(stickslip.InputError, match="name it with output="):
        stickslip.sweep(axes, "paper", short, resume=True)
    with pytest.raises(stickslip.InputError, match="leave one of them out"):
        stickslip.sweep(axes, "paper", short, output=tmp_path / "a.h5", resume=True, replace=True)
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    stickslip.sweep(axes, "paper", short, output=tmp_path / "a.h5", resume=True, progress=True)
    assert capsys.readouterr().err.endswith("2 of 2 points\n")


def test_property_progress_is_a_bar_of_tqdm(capsys):
    pytest.importorskip("tqdm")
    stickslip.sweep({"torsion.damping": [10, 20]}, "paper", {"output.end_time": 0.01}, progress=True)
    said = capsys.readouterr().err
    assert "100%" in said and "2/2" in said


def test_property_samples_have_one_dimension():
    sample = {"method": "sobol", "count": 8, "seed": 1}
    axes = {"friction.decay": {"from": 3, "to": 8}, "torsion.damping": {"from": 15, "to": 30}}
    dataset = stickslip.sweep(axes, "paper", {"output.end_time": 0.01}, sample=sample)
    assert dict(dataset.sizes) == {"point": 8}
    assert {"friction_decay", "torsion_damping"} <= set(dataset.coords)
    for name, variable in dataset.variables.items():
        if name != "point":
            assert variable.attrs["units"] or "flag_meanings" in variable.attrs, name
            assert variable.attrs["long_name"], name


def test_property_messages_name_the_arguments(paper, tmp_path):
    with pytest.raises(stickslip.InputError, match='overrides\\["friction.deacy"\\]'):
        stickslip.modes("paper", {"friction.deacy": 4})
    foreign = tmp_path / "mine.h5"
    foreign.write_text("mine")
    with pytest.raises(stickslip.InputError, match="choose another name with output, or replace it with replace=True"):
        stickslip.sweep({"torsion.damping": [10, 20]}, "paper", {"output.end_time": 0.01}, output=foreign)
    with pytest.raises(stickslip.InputError, match='units={"relative_velocity": "furlong"}'):
        stickslip.compare(paper, time=[1.0, 2.0], relative_velocity=[1.0, 2.0], units={"relative_velocity": "furlong"})
    with pytest.raises(stickslip.InputError, match="^require "):
        stickslip.compare(paper, paper, require=["onset"])
    with pytest.raises(stickslip.InputError, match="^digits=99"):
        stickslip.certify(paper, digits=99)
