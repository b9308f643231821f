#!/usr/bin/env python3
"""Use the interactive page of a study in a real browser: what the pointer reads is in the file, and the command that a click
shows runs the point.

    python .ci/study_page.py PROGRAM NAME.h5...

NAME.html beside each file is its page, made by `stickslip plot NAME.h5 --html NAME.html`. Needs what page.py needs. Exits
with 1 if a check fails.
"""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import h5py
import numpy as np
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select

import page as common
from page import check

def place(values, point, cells, logarithmic):
    """Where a point is along an axis, as a share: in the middle of its cell, or between the ends with some room."""
    measured = np.log(values) if logarithmic else np.asarray(values, float)
    levels = np.unique(measured)
    if not cells:
        room = 0.04 * (levels[-1] - levels[0])
        return (measured[point] - levels[0] + room) / (levels[-1] - levels[0] + 2 * room)
    middles = (levels[1:] + levels[:-1]) / 2
    edges = np.concatenate([[2 * levels[0] - middles[0]], middles, [2 * levels[-1] - middles[-1]]])
    k = int(np.searchsorted(levels, measured[point]))
    return ((edges[k] + edges[k + 1]) / 2 - edges[0]) / (edges[-1] - edges[0])


def words(name):
    return name.replace("_", " ")


def axes_of(file):
    """Names of the axes with a value for every point, and the codes' words."""
    names = [name for name, item in file.items() if isinstance(item, h5py.Dataset) and "keys" in item.attrs]
    grid = "point" not in file
    columns = {}
    levels = [file[name][:] for name in names]
    if grid:
        for name, column in zip(names, np.meshgrid(*levels, indexing="ij")):
            columns[name] = column.ravel()
    else:
        columns = dict(zip(names, levels))
    return grid, columns


def text_of(attribute):
    return attribute.decode() if isinstance(attribute, bytes) else str(attribute)


def check_study(browser, program, path):
    name = path.name
    file = h5py.File(path)
    grid, axes = axes_of(file)
    counts = file["stick_count"][...].ravel()
    common.check_anywhere(browser, path.with_suffix(".html"), name)
    browser.get(path.with_suffix(".html").resolve().as_uri())
    browser.find_element(By.ID, "map")
    check(f"{name}: the title", browser.find_element(By.ID, "title").text == text_of(file.attrs["title"]))
    select = Select(browser.find_element(By.ID, "colour"))
    check(f"{name}: every quantity can be chosen", len(select.options) >= 20, f"({len(select.options)})")
    select.select_by_visible_text(next(o.text for o in select.options if o.text.startswith("stick count")))
    shown = int(browser.find_element(By.ID, "map").get_attribute("data-points"))
    beside = [axis for axis in axes if len(set(axes[axis])) > 1][2:] if grid else []
    held = {axis: sorted(set(axes[axis]))[len(set(axes[axis])) // 2] for axis in beside}
    inside = np.all([axes[axis] == value for axis, value in held.items()] or [np.full(len(counts), True)], axis=0)
    check(f"{name}: the points of the plane are there", shown == inside.sum(), f"({shown}, {inside.sum()})")
    rng = np.random.default_rng(1)
    document = json.loads(browser.find_element(By.ID, "page-data").get_attribute("textContent"))
    logarithmic = {axis["name"]: axis["logarithmic"] for axis in document["columns"] if axis["role"] == "axis"}
    varying = [axis for axis in axes if len(set(axes[axis])) > 1][:2]
    canvas = browser.find_element(By.ID, "map")
    failures = [point for point in np.flatnonzero(inside & (file["status"][...].ravel() == 1))][:1]
    points = rng.choice(np.flatnonzero(inside & (file["status"][...].ravel() == 0)), 3, replace=False)
    for point in [*points, *failures]:
        shown = [axes[axis][inside] for axis in varying]
        index = int(np.flatnonzero(np.flatnonzero(inside) == point)[0])
        share = [place(shown[k], index, grid, logarithmic[axis]) for k, axis in enumerate(varying)]
        size, frame = canvas.size, json.loads(canvas.get_attribute("data-frame"))
        x = frame["left"] + share[0] * (frame["right"] - frame["left"])
        y = frame["bottom"] - share[1] * (frame["bottom"] - frame["top"])
        move = ActionChains(browser).move_to_element_with_offset(
            canvas, round(x - size["width"] / 2), round(y - size["height"] / 2)
        )
        move.perform()
        readout = browser.find_element(By.ID, "readout").text
        if point in failures:
            check(f"{name}: the pointer reads that point {point} failed", "the run failed" in readout, readout)
            move.click().perform()
            check(f"{name}: a click says why", "breakaway" in browser.find_element(By.ID, "failure").text)
            continue
        numbers = [axes[axis][point] for axis in varying]
        read = [common.number(text) for text in re.findall(r"= ([^\s;]+)", readout)]
        near = lambda number: any(np.isclose(number, one, rtol=1e-8, atol=0) for one in read)
        check(f"{name}: the pointer reads the place of point {point}", all(map(near, numbers)), readout)
        check(f"{name}: and its sticks", readout.endswith(f"stick count: {counts[point]}"), readout)
        move.click().perform()
        command = browser.find_element(By.ID, "command").text
        chosen = int(browser.find_element(By.ID, "point").text.split()[1])
        check(f"{name}: a click chooses the point", chosen == point, f"({chosen}, {point})")
        with tempfile.TemporaryDirectory() as folder:
            where = os.pathsep.join([str(pathlib.Path(program).resolve().parent), os.environ["PATH"]])
            run = subprocess.run(f"{command} --quiet --no-witness", shell=True, cwd=folder, env={**os.environ, "PATH": where})
            check(f"{name}: the command runs", run.returncode == 0, command)
            made = list(pathlib.Path(folder).glob("*.h5"))
            if run.returncode == 0 and made:
                with h5py.File(made[0]) as result:
                    table = result["stick_slip"].attrs
                    check(f"{name}: its sticks are those of the point", table["stick_count"] == counts[chosen])
                    onset = file["onset_time"][...].ravel()[chosen]
                    own = table.get("onset_time", np.nan)
                    check(f"{name}: its onset, too", np.isclose(own, onset, rtol=0, atol=1e-13, equal_nan=True), f"({own}, {onset})")
    # Another quantity and other axes, and arrows from point to point.
    select.select_by_index(2)
    canvas = browser.find_element(By.ID, "map")
    browser.execute_script("arguments[0].focus()", canvas)
    before = browser.find_element(By.ID, "point").text
    for key in (common.Keys.ARROW_LEFT, common.Keys.ARROW_RIGHT, common.Keys.ARROW_UP, common.Keys.ARROW_DOWN):
        canvas.send_keys(key)
    check(f"{name}: arrows move the choice", browser.find_element(By.ID, "point").text.startswith("Point"), before)
    errors = [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]
    check(f"{name}: no errors of the script", not errors, str(errors))
    for width in (1400, 420):
        browser.set_window_size(width, 1000)
        bad = browser.execute_script("return document.documentElement.scrollWidth > innerWidth")
        check(f"{name} at {width} pixels: the page is no wider than the window", not bad)
    browser.set_window_size(1400, 1000)


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    with common.chromium() as browser:
        for path in map(pathlib.Path, sys.argv[2:]):
            check_study(browser, sys.argv[1], path)
    common.end()


if __name__ == "__main__":
    main()
