#!/usr/bin/env python3
"""Use three further pages in a real browser: of a certified run, of a run with few samples, and of two runs.

    python .ci/page_cases.py certified.h5 sparse.h5 first.h5 second.h5 pair.html

certified.html and sparse.html beside their files are their pages; pair.html is that of first.h5 and second.h5. All are runs of a
brake. Needs what page.py needs. Exits with 1 if a check fails.
"""

import pathlib
import re
import sys
import time

import h5py
import numpy as np

import page as common
from page import Page, check, close, quantity


def check_certified(page, file):
    times, uncertainties = file["events/time"][:], file["events/time_uncertainty"][:]
    verdicts = file["certificate/verdict"]
    names = verdicts.attrs["flag_meanings"].split()
    for index in (0, len(times) // 2, len(times) - 1):
        text = page.event_row(index).text
        shown = re.search(r"(\d+\.\d+)(?: ± (\S+))? s", text)
        check(f"event {index} has its time", close(float(shown[1]), times[index], max(uncertainties[index], 1e-12)), text)
        if np.isfinite(uncertainties[index]):
            # A double knows a time to half of its last digit.
            known = max(uncertainties[index], times[index] * 2.0**-53)
            check(f"event {index} has its uncertainty", close(common.number(shown[2]), known, 0.06 * known), text)
    rows = [row.text for row in page.all("#certified-events tbody tr")]
    check("every certified event is in the table", len(rows) == min(len(times), 1000), f"({len(rows)})")
    for index in (0, len(rows) - 1):
        verdict = names[list(verdicts.attrs["flag_values"]).index(verdicts[index])].replace("-", " ")
        check(f"event {index} has its verdict", rows[index].endswith(verdict) and "±" in rows[index], rows[index])
    fold = page.find("#raw-columns")
    check("the columns of the file are behind a fold", not fold.find_elements(common.By.CSS_SELECTOR, "td"))
    page.click("#raw-columns summary")
    time.sleep(0.2)
    columns = [name for name, column in file["certificate"].items() if column.ndim == 1 and not column.dtype.kind == "O"]
    heads = sum(len(row.find_elements(common.By.TAG_NAME, "th")) - 1 for row in fold.find_elements(common.By.CSS_SELECTOR, "thead tr"))
    check("and all of them are there", heads == len(columns), f"({heads} of {len(columns)})")
    names = [cell.text for cell in page.all("#certificate > table td.name")]
    check("its numbers have readable names", names and not any("_" in name for name in names), str(names))
    words = page.find("#certificate-card").text + page.find("#provenance").text
    check("whole numbers have no decimal point", not re.search(r"(digits|max_events|max events)\s+\d+\.0\b", words))


def check_sparse(page, file):
    page.click("#stick-slip")
    page.settle()
    text = page.find("#undersampled").text
    check("a page of few samples says that lines are dotted, and what to do", text.startswith("Dotted") and "stickslip run" in text and "output.window" in text, text)
    button = page.find("#undersampled button")
    button.click()
    time.sleep(0.2)
    said = page.find("#undersampled [role=status]").text
    check("its button copies or marks the command", button.text == "Copy the command" and said.startswith(("copied", "marked")), said)
    times, force = file["events/time"][:], file["events/internal_force"][:]
    # The torque that the interface carries when it lets go is in no sample, but in the view.
    kinds = file["events/kind"][:]
    slip = int(np.flatnonzero(kinds == 1)[10])
    page.event_row(slip).click()
    page.move_to(page.panel(0), page.pixel_of(times[slip])).perform()
    page.browser.execute_script("arguments[0].focus()", page.chart)
    page.keys("1")
    table = page.at_cursors()
    radius = page.browser.execute_script("return JSON.parse(document.getElementById('page-data').textContent).breakaway_arms[0]") / 0.6
    torque = quantity(table["Torque, Tf = (Tr + Ts)/2"][0])[0]
    check("the torque at breakaway is exact", close(torque, force[slip] * radius, 2e-6 * abs(torque)), f"({torque} for {force[slip] * radius})")
    page.click("#whole")
    check("where nothing is dotted there is no word of it, and the same room", page.find("#undersampled").size["height"] > 20)


def check_pair(page, first, second):
    name = "two runs"
    check(f"{name}: two lines of events", page.panel(0).size["height"] == 44)
    titles = [panel.find_element(common.By.CSS_SELECTOR, "b").text for panel in page.all("#chart > .panel") if panel.is_displayed()]
    check(f"{name}: differences are shown", sum(title.startswith("Difference") for title in titles) >= 3, str(titles))
    sticks = [file["events/time"][:][file["events/kind"][:] == 0] for file in (first, second)]
    rows = [[cell.text for cell in row.find_elements(common.By.TAG_NAME, "td")] for row in page.all("#pair tbody tr")]
    own = [row for row in rows if row[0] == "stick" and row[1] != "–"]
    other = [row for row in rows if row[0] == "stick" and row[2] != "–"]
    check(f"{name}: every stick of both is listed", [len(own), len(other)] == [len(times) for times in sticks], f"({len(own)}, {len(other)})")
    check(f"{name}: the first stick of the first", close(float(own[0][1]), sticks[0][0], 1e-12))
    both = [row for row in own if row[2] != "–"]
    check(f"{name}: events have partners", len(both) > 5, f"({len(both)})")
    for row in both[:5]:
        value, digit = quantity(row[3])
        check(f"{name}: the difference of two events", close(value, float(row[2]) - float(row[1]), digit + 2e-12), str(row))
    words = page.find("h1").text
    check(f"{name}: the title names both", all(pathlib.Path(file.filename).name in words for file in (first, second)), words)
    legends = page.browser.execute_script("return [...document.querySelectorAll('.panel')].map(e => [...e.querySelectorAll('.legend button')].filter(b => b.querySelector('output')).map(b => [b.textContent[0], b.querySelector('i').style.borderTopColor, b.querySelector('i').style.borderTopStyle]))")
    colours = [[colour for _, colour, _ in legend] for legend in legends]
    check(f"{name}: no two curves of a panel have one colour", all(len(set(one)) == len(one) for one in colours), str(colours))
    runs = [[{colour for legend in legends for number, colour, _ in legend if number == run}, {style for legend in legends for number, _, style in legend if number == run}] for run in "12"]
    check(f"{name}: no colour is of both runs", runs[0][0] and runs[1][0] and not runs[0][0] & runs[1][0], str(runs))
    check(f"{name}: the first is full, the second dashed", [styles for _, styles in runs] == [{"solid"}, {"dashed"}], str(runs))
    told = page.find("#runs").text
    check(f"{name}: the legend names the file of each run", all(f"run {k + 1}: {pathlib.Path(file.filename).name}" in told for k, file in enumerate((first, second))), told)
    sticks_all = np.concatenate([file["events/time"][:][file["events/kind"][:] == 0] for file in (first, second)])
    page.find("#stick-slip").click()
    start, stop = page.view()
    check(f"{name}: the view of stick-slip has that of both", start < sticks_all.min() and sticks_all.max() < stop and stop - start < 0.1)
    page.click("#whole")
    # The reading of a difference at a sample that both have.
    times = [file["trajectory/time"][:] for file in (first, second)]
    common_times, rows_first, rows_second = np.intersect1d(*times, return_indices=True)
    at = len(common_times) // 3
    row = common.row_at(page, times[0], common_times[at])
    check(f"{name}: the pointer is at a common sample", times[0][row] in common_times)
    k = int(np.searchsorted(common_times, times[0][row]))
    for title, legend, text in page.readings():
        if title.startswith("Difference, relative velocity"):
            value, digit = quantity(text)
            expected = first["trajectory/relative_velocity"][rows_first[k]] - second["trajectory/relative_velocity"][rows_second[k]]
            value += common.offset_of(title)
            check(f"{name}: the difference is the files'", close(value, expected, digit + 1e-6 * abs(expected)), f"({text} for {expected})")


def main():
    if len(sys.argv) != 6:
        sys.exit(__doc__)
    certified, sparse, first, second, pair = map(pathlib.Path, sys.argv[1:])
    with common.chromium() as browser:
        for path, use in ((certified, check_certified), (sparse, check_sparse)):
            with h5py.File(path) as file:
                common.check_anywhere(browser, path.with_suffix(".html"), path.name)
                page = Page(browser, path.with_suffix(".html"))
                use(page, file)
                common.check_layout(page, path.name)
                common.check_readout(page)
                common.check_silence(page, path.name)
        with h5py.File(first) as one, h5py.File(second) as other:
            common.check_anywhere(browser, pair, pair.name)
            page = Page(browser, pair)
            check_pair(page, one, other)
            common.check_layout(page, pair.name)
            common.check_readout(page)
            common.check_silence(page, pair.name)
    common.end()


if __name__ == "__main__":
    main()
