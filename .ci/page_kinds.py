#!/usr/bin/env python3
"""Use the pages of a continuation and of a calibration, and the report of a comparison, in a real browser.

    python .ci/page_kinds.py branches.html calibration.html report.html

branches.html is the page of `stickslip continue`, calibration.html that of a calibration with two parameters, report.html the
report of `stickslip compare`. Needs what page.py needs. Exits with 1 if a check fails.
"""

import json
import pathlib
import sys
import time

import page as common
from page import check

# The pixels of a colour in the figure.
PIXELS = """
const canvas = document.getElementById('map'), copy = new OffscreenCanvas(canvas.width, canvas.height).getContext('2d');
copy.drawImage(canvas, 0, 0);
const {data} = copy.getImageData(0, 0, canvas.width, canvas.height), probe = document.body.appendChild(document.createElement('i'));
probe.style.color = `var(--${arguments[0]})`;
const [r, g, b] = getComputedStyle(probe).color.match(/\\d+/g).map(Number);
probe.remove();
let count = 0;
for (let i = 0; i < data.length; i += 4) count += data[i] === r && data[i + 1] === g && data[i + 2] === b;
return count;
"""


def opened(browser, path):
    common.check_anywhere(browser, path, path.name)
    browser.get(path.resolve().as_uri())
    time.sleep(0.5)


def text(browser, name):
    return browser.find_element(common.By.ID, name).text


def check_branches(browser, path):
    opened(browser, path)
    key = text(browser, "key")
    check("the legend tells stable branches from unstable ones", "steady sliding, stable" in key and "steady sliding, unstable" in key, key)
    # Where the least and the largest value of steady sliding coincide, two dashed lines would fill each other's gaps.
    lines = json.loads(browser.find_element(common.By.ID, "page-data").get_attribute("textContent"))["lines"]
    check("steady sliding is drawn once", all(line["once"] == line["label"].startswith("steady") for line in lines), str([line["label"] for line in lines]))
    check("and its line is there", browser.execute_script(PIXELS, "black") > 200)
    browser.execute_script("document.getElementById('map').focus()")
    browser.find_element(common.By.ID, "map").send_keys(common.Keys.ARROW_RIGHT)
    check("an arrow chooses a point", text(browser, "point").startswith("Branch") and not browser.find_element(common.By.ID, "unchosen").is_displayed())
    values = text(browser, "values")
    check("units have real exponents", "s-1" not in values and "s⁻¹" in values, values)
    check("no value has more than 15 digits", not common.re.search(r"\d{16}|\.\d{15}", values), values)


def check_calibration(browser, path):
    opened(browser, path)
    frame = lambda: json.loads(browser.find_element(common.By.ID, "map").get_attribute("data-frame"))
    key = text(browser, "key")
    check("the page of a calibration shows its region", all(word in key for word in ("optimum", "least and largest", "all held targets hold")), key)
    held, frames = browser.execute_script(PIXELS, "blue"), frame()
    check("it opens on the region: its held points are seen", held > 50, f"({held} pixels)")
    browser.find_element(common.By.ID, "everything").click()
    everything = browser.execute_script(PIXELS, "blue")
    check("everything is one click away", everything < held, f"({held}, {everything})")
    browser.find_element(common.By.ID, "region").click()
    check("and so is the region", browser.execute_script(PIXELS, "blue") == held and frame() == frames)


def check_report(browser, path):
    opened(browser, path)
    verdict = browser.find_elements(common.By.CSS_SELECTOR, ".verdict")
    weights = [line.value_of_css_property("font-weight") for line in verdict]
    check("the verdict begins in bold, and only its first line is", weights[:1] == ["700"] and all(weight == "400" for weight in weights[1:]), str(weights))


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    with common.chromium() as browser:
        for use, path in zip((check_branches, check_calibration, check_report), map(pathlib.Path, sys.argv[1:])):
            use(browser, path)
        errors = [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]
        check("no errors of the scripts", not errors, str(errors))
    common.end()


if __name__ == "__main__":
    main()
