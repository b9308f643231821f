#!/usr/bin/env python3
"""Use the interactive pages of two trains in a real browser, and hold what they show against the result files.

    python .ci/train_page.py NAME.h5...

NAME.html beside each file is its page, made by `stickslip plot NAME.h5 --html NAME.html`. Needs what page.py needs. Exits
with 1 if a check fails.
"""

import pathlib
import re
import sys

import h5py
import numpy as np

import page as common
from page import Page, check, close, quantity

# The axes of the pages; a page keeps its functions to itself.
AXIS = (pathlib.Path(__file__).parent.parent / "data/page/axis.js").read_text()
# A legend that is no column of the file.
LIMIT = "limit μ₀"


def check_panels(page, file, name):
    """Every panel can be shown; what its legends say at a sample is a column of the file there."""
    page.click("#whole")
    page.find("#panel-choice summary").click()
    for box in page.all("#panel-choice input"):
        if not box.is_selected():
            box.click()
    page.find("#panel-choice summary").click()
    page.settle()
    check(f"{name}: every panel is there", all(panel.is_displayed() for panel in page.all("#chart > .panel")))
    columns = {key: column[:] for key, column in file["trajectory"].items() if column.dtype == float}
    time = columns["time"]
    translation = file["meta"].attrs["motion"] == "translation"
    page.move_to(page.panel(), page.pixel_of(0.37 * time[-1])).perform()
    page.settle()
    shown = float(re.search(r"sample at ([\d.]+) s", page.find("#sample-time").text)[1])
    row = int(np.argmin(abs(time - shown)))
    check(f"{name}: the pointer reads a sample of the file", close(time[row], shown, 1e-12))
    count = 0
    for title, legend, text in page.readings():
        if legend.startswith(LIMIT):
            continue
        panel = title.split(",")[0]
        value, digit = quantity(text)
        value += common.offset_of(title)
        near = slice(max(row - 128, 0), row + 128)
        held = [
            key for key, column in columns.items()
            if close(value, column[row], digit + 1.2e-7 * (column[near].max() - column[near].min()))
        ]
        check(f"{name}: {panel}, {legend} is a column of the file", held, text)
        check(f"{name}: {panel}, {legend} has the unit of its motion", not (translation and ("rad" in text or "N m" in text)), text)
        count += 1
    check(f"{name}: as many curves as columns", count >= len(columns) - 10, f"({count} of {len(columns)})")


def check_events(page, file, name):
    times, further = file["events/time"][:], [key for key in file["events"] if key.startswith(("rotor_speed", "stator_speed", "bristle"))]
    index = len(times) // 2
    row = page.event_row(index)
    shown = float(re.search(r"\d+\.\d+", row.text)[0])
    # Of a certified file to the second digit of the uncertainty.
    digit = 1e-12 if "time_uncertainty" not in file["events"] else max(file["events/time_uncertainty"][index], 1e-12)
    check(f"{name}: event {index} has its time", close(shown, times[index], digit), row.text)
    row.click()
    start, stop = page.view()
    check(f"{name}: a click on event {index} moves the view there", close((start + stop) / 2, times[index], 1e-6))
    detail = page.find("#event-detail").text
    for key in further:
        channel = key.removesuffix("_before").removesuffix("_after").replace("_", " ")
        check(f"{name}: the states at an event have {channel}", channel in detail)
    page.click("#whole")


def check_texts(page, file, name):
    attributes = file["stick_slip"].attrs
    summary = page.find("#headline").text
    period = attributes["attractor_period"]
    if period == period:
        shown = float(re.search(r"^period ([\d.]+) s$", summary, re.M)[1])
        # All digits that are shown are known.
        check(f"{name}: the period is the file's", close(shown, period, max(2 * period * attributes["attractor_distance"], 1e-12)))
        page.click("#last-period")
        start, stop = page.view()
        check(f"{name}: the last period is in view", close(stop - start, period, 1e-9 * period))
        page.click("#whole")
    check(f"{name}: the table of cycles", len(page.all("#cycles tbody tr")) == min(len(file["stick_slip/cycle"]), 1000))
    drawn = page.browser.execute_script("""
        const canvas = document.querySelector('#portrait-orbit canvas'), copy = new OffscreenCanvas(canvas.width, canvas.height);
        const context = copy.getContext('2d');
        context.drawImage(canvas, 0, 0);
        const data = context.getImageData(0, 0, canvas.width, canvas.height).data;
        let coloured = 0;
        for (let i = 0; i < data.length; i += 4) if (data[i + 3] > 0 && Math.abs(data[i] - data[i + 2]) > 60) coloured++;
        return coloured;
    """)
    check(f"{name}: the portrait is drawn", drawn > 100, f"({drawn} pixels)")
    words = page.find("body").text
    check(f"{name}: no words of the brake", not re.search(r"growth exponent|axial displacement, static|paper", summary + page.find("#chart").text))
    check(f"{name}: where the case is from", file.attrs["references"] in words)
    check(f"{name}: a certificate where there is one", page.find("#certificate-card").is_displayed() == ("certificate" in file))


def check_layout(page, name):
    for width in (1400, 800, 390):
        page.browser.set_window_size(width, 1000)
        page.settle()
        page.event_row(0).click()
        page.settle()
        bad = page.browser.execute_script(common.LAYOUT)
        check(f"{name} at {width} pixels: nothing overlaps or is clipped", not bad, str(bad[:5]))
    page.browser.set_window_size(1400, 1000)
    page.click("#whole")


def check_cycles(page, name):
    """A number of cycles has marks at whole numbers, without a prefix, also where there is one cycle."""
    for count in (1, 2, 5000):
        ticks = page.browser.execute_script(f"{AXIS}; const a = axisOf(-0.5, {count} - 0.5, 200, 75, true); return [a.prefix, ...a.ticks.map(t => t.text)]")
        check(f"{name}: whole marks of {count} cycles", ticks[0] == "" and all(text.isdigit() for text in ticks[1:]), str(ticks))


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    with common.chromium() as browser:
        for path in map(pathlib.Path, sys.argv[1:]):
            name = path.stem
            with h5py.File(path) as file:
                common.check_anywhere(browser, path.with_suffix(".html"), name)
                page = Page(browser, path.with_suffix(".html"))
                check_texts(page, file, name)
                check_events(page, file, name)
                check_layout(page, name)
                check_cycles(page, name)
                check_panels(page, file, name)
                common.check_silence(page, name)
    common.end()


if __name__ == "__main__":
    main()
