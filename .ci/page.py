#!/usr/bin/env python3
"""Use the interactive page of a run in a real browser, and hold what it shows against the result file.

    python .ci/page.py paper.h5 paper.html [long.html]

paper.h5 is a run of the built-in case, paper.html its page; long.html is the page of a run that does not fit as a
whole. Needs .ci/requirements.txt, Chromium and its driver. Exits with 1 if a check fails.
"""

import math
import pathlib
import re
import shutil
import sys
import time

import h5py
import numpy as np
from selenium import webdriver
from selenium.webdriver import Keys
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.actions.wheel_input import ScrollOrigin
from selenium.webdriver.chrome.service import Service

PREFIXES = {"G": 1e9, "M": 1e6, "k": 1e3, "m": 1e-3, "µ": 1e-6, "n": 1e-9, "p": 1e-12, "f": 1e-15}
# Channel by panel and name in its legend; the limit is not a column of the file.
LEGENDS = {
    ("Speed", "rotor"): "theta_dot",
    ("Speed", "rotor surface"): "phi2_dot",
    ("Speed", "stator surface"): "phi1_dot",
    ("Relative velocity", "φ₂′ − φ₁′"): "relative_velocity",
    ("Twist", "rotor, θ − φ₂"): "rotor_twist",
    ("Twist", "stator, φ₁"): "phi1",
    ("Torque", "through the interface"): "friction_torque",
    ("Torque", "Tf = (Tr + Ts)/2"): "transmitted_torque",
    ("Energy", "kinetic"): "energy_kinetic",
    ("Energy", "elastic"): "energy_elastic",
    ("Energy", "lost to friction"): "dissipated_friction",
    ("Energy", "lost to damping"): "dissipated_damping",
    ("Energy", "work of F"): "work_applied",
}
STICK, SLIP = [250, 246, 191], [228, 243, 251]
# Sizes of windows, CSS pixels: a desktop, an old laptop, a phone.
SIZES = [(1200, 900), (1100, 800), (420, 900)]

# 60 frames of a drag to and fro, each with a move of the pointer; milliseconds for each frame.
PAN = """
const done = arguments[0], canvas = document.querySelectorAll('#chart canvas')[2], box = canvas.getBoundingClientRect();
const send = (kind, x) => canvas.dispatchEvent(new PointerEvent(kind, {bubbles: true, pointerId: 1, button: 0,
  clientX: box.left + x, clientY: box.top + 50}));
canvas.setPointerCapture = () => {};
const times = [];
send('pointerdown', 400);
const frame = now => {
  times.push(now);
  if (times.length > 60) {
    send('pointerup', 400);
    done(times.slice(1).map((t, i) => t - times[i]));
    return;
  }
  send('pointermove', 400 + 150 * Math.sin(times.length / 8));
  requestAnimationFrame(frame);
};
requestAnimationFrame(frame);
"""

# Milliseconds from the start of the navigation until the first frame is drawn.
DRAWN = """
const done = arguments[0];
const look = () => (document.getElementById('view').textContent ? done(performance.now()) : setTimeout(look, 2));
look();
"""

# Texts that do not fit their box, and sections that overlap.
LAYOUT = """
const bad = [];
for (const e of document.querySelectorAll('button, h1, h2, p, summary, label, option, output, .legend, .key, #headline, #provenance, #events .row, #event-detail, #event-detail td')) {
  if (e.closest('[hidden]') || !e.getClientRects().length) continue;
  if (e.tagName !== 'SUMMARY' && e.closest('details:not([open])')) continue;
  if (e.clientWidth && e.scrollWidth > e.clientWidth + 1) bad.push('clipped: ' + (e.id || e.className || e.tagName) + ' ' + e.textContent.slice(0, 40));
  const box = e.getBoundingClientRect();
  if (box.right > innerWidth + 1 || box.left < -1) bad.push('outside: ' + e.textContent.slice(0, 40));
}
const sections = [...document.querySelectorAll('section:not([hidden])')].map(e => e.getBoundingClientRect());
sections.forEach((a, i) => sections.slice(i + 1).forEach(b => {
  if (a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1) bad.push('sections overlap');
}));
if (document.documentElement.scrollWidth > innerWidth) bad.push('the page is wider than the window');
return bad;
"""

# Colours of the body, and whether the page is wider than the window; what is read on it.
SEEN = """
const body = getComputedStyle(document.body);
return [getComputedStyle(document.documentElement).backgroundColor, body.backgroundColor, body.color,
  document.documentElement.scrollWidth > innerWidth, document.body.innerText];
"""

passed = failed = 0


def check(what, holds, detail=""):
    """Count a check, and name it if it fails."""
    global passed, failed
    if holds:
        passed += 1
    else:
        failed += 1
        print(f"FAILED: {what} {detail}")


def close(a, b, tolerance):
    return abs(a - b) <= tolerance


def check_anywhere(browser, path, name):
    """What holds for every kind of page: light and dark, wide and narrow, without an empty value in its words."""
    light = lambda colour: sum(map(float, re.findall(r"[\d.]+", colour)[:3])) / 3
    window = browser.get_window_size()
    for width, height in SIZES:
        # A window of Chromium has a least width.
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        for scheme in ("light", "dark"):
            browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]})
            browser.get("about:blank")
            browser.get(path.resolve().as_uri())
            time.sleep(0.3)
            root, body, ink, is_wide, words = browser.execute_script(SEEN)
            ground = root if body in ("rgba(0, 0, 0, 0)", "transparent") else body
            where = f"{name}, {scheme} at {width} pixels"
            check(f"{where}: no wider than the window", not is_wide)
            check(f"{where}: the ground is {scheme}", (light(ground) > 128) == (scheme == "light"), ground)
            check(f"{where}: the words stand out", abs(light(ground) - light(ink)) > 128, f"({ink} on {ground})")
            found = re.search(r"\b(null|undefined|NaN|\[object)", words)
            check(f"{where}: no value is missing in its words", not found, found and words[max(found.start() - 60, 0):found.end() + 20])
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
    browser.set_window_size(window["width"], window["height"])


class Page:
    """A page in the browser, through what a reader sees of it."""

    def __init__(self, browser, path):
        self.browser = browser
        browser.get(path.resolve().as_uri())
        browser.set_script_timeout(30)
        self.opened = browser.execute_async_script(DRAWN)
        self.chart = browser.find_element(By.ID, "chart")

    def find(self, selector):
        return self.browser.find_element(By.CSS_SELECTOR, selector)

    def all(self, selector):
        return self.browser.find_elements(By.CSS_SELECTOR, selector)

    def settle(self):
        """Until the frame that was asked for is drawn."""
        self.browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(() => arguments[0]()))")

    def view(self):
        self.settle()
        return float(self.chart.get_attribute("data-from")), float(self.chart.get_attribute("data-to"))

    def click(self, selector):
        self.find(selector).click()
        return self.view()

    def panel(self, number=1):
        """The canvas of a panel; 0 is the strip of events."""
        return self.all("#chart canvas")[number]

    def geometry(self):
        """Left edge and width of the plots within their canvas, CSS pixels."""
        left, right = 66, 10
        return left, self.panel().size["width"] - left - right

    def pixel_of(self, at):
        """The x of a time in the canvas."""
        left, width = self.geometry()
        start, end = self.view()
        return left + (at - start) / (end - start) * width

    def move_to(self, canvas, x, y=None):
        """An action that begins with the pointer at x of a canvas."""
        middle = canvas.size["width"] / 2
        dy = 0 if y is None else y - canvas.size["height"] / 2
        return ActionChains(self.browser, duration=20).move_to_element_with_offset(canvas, round(x - middle), round(dy))

    def wheel(self, x, amount, key=Keys.CONTROL):
        """Turns the wheel over the figure, with a key held down or `None`."""
        canvas = self.panel()
        origin = ScrollOrigin.from_element(canvas, round(x - canvas.size["width"] / 2), 0)
        if key:
            ActionChains(self.browser, duration=0).key_down(key).perform()
        ActionChains(self.browser, duration=0).scroll_from_origin(origin, 0, amount).perform()
        if key:
            ActionChains(self.browser, duration=0).key_up(key).perform()
        return self.view()

    def scrolled(self):
        """How far the page is scrolled, CSS pixels."""
        self.settle()
        return self.browser.execute_script("return scrollY")

    def readings(self):
        """(panel, legend, text) of every reading of the panels that are shown."""
        for panel in self.all("#chart > .panel"):
            if not panel.is_displayed():
                continue
            title = panel.find_element(By.CSS_SELECTOR, "b").get_attribute("textContent")
            for button in panel.find_elements(By.CSS_SELECTOR, "button"):
                for output in button.find_elements(By.CSS_SELECTOR, "output"):
                    text = output.text
                    if text:
                        yield title, button.text.removesuffix(text).strip(), text

    def at_cursors(self):
        """The table of the cursors: by its first column, the others."""
        self.settle()
        rows = [[cell.text for cell in row.find_elements(By.TAG_NAME, "td")] for row in self.all("#measure tbody tr")]
        return {row[0]: row[1:] for row in rows}

    def keys(self, *keys):
        ActionChains(self.browser).send_keys(*keys).perform()
        return self.view()

    def colour(self, number, at, y):
        """The colour of a panel at a time, `y` pixels below its top."""
        # By way of a canvas of its own: reading from the page's would change how the browser draws it.
        script = """
            const [canvas, x, y] = arguments, r = devicePixelRatio;
            const copy = new OffscreenCanvas(1, 1).getContext('2d', {willReadFrequently: true});
            copy.drawImage(canvas, -Math.round(x * r), -Math.round(y * r));
            return [...copy.getImageData(0, 0, 1, 1).data];
        """
        return self.browser.execute_script(script, self.panel(number), self.pixel_of(at), y)[:3]

    def event_row(self, index):
        """The row of an event in the list, brought into sight."""
        self.browser.execute_script("arguments[0].scrollTop = 25 * arguments[1]", self.find("#events"), index)
        self.settle()
        return self.find(f"#event-{index}")

    def frames(self):
        """Milliseconds of the frames of a drag."""
        return np.array(self.browser.execute_async_script(PAN))

    def console(self):
        """What was said on the console since it was last asked for."""
        return [entry["message"] for entry in self.browser.get_log("browser")]


POWERS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻−", "0123456789--")


def number(text):
    """A number as a page writes it, such as 0.6, −2.7·10⁻¹² or 10⁻⁴."""
    digits, power, exponent = re.fullmatch(r"([+−\d.]*?)·?(10)?([⁰¹²³⁴⁵⁶⁷⁸⁹⁻]*)", text).groups()
    if not exponent:
        return float((digits + (power or "")).translate(POWERS))
    sign = "-" if digits.startswith("−") else ""
    return float(f"{sign}{digits.lstrip('−') or 1}e{exponent.translate(POWERS)}")


def quantity(text):
    """The number in a text such as `12.3456 µrad/s`, and half of its last digit."""
    shown, _, unit = text.partition(" ")
    factor = PREFIXES[unit[0]] if len(unit) > 1 and unit[0] in PREFIXES and unit not in ("m", "m/s") else 1.0
    mantissa = shown.split("·")[0]
    scale = number(shown) / number(mantissa) if "·" in shown else 1.0
    last = 10.0 ** -len(mantissa.partition(".")[2])
    return number(shown) * factor, 0.51 * last * scale * factor


def opened(browser, path):
    # The best of three, as with the frames.
    for _ in range(3):
        page = Page(browser, path)
        if page.opened < 1000:
            break
    return page


def check_opening(page, name):
    check(f"{name} opens in under a second", page.opened < 1000, f"({page.opened:.0f} ms)")
    check(f"{name} loads nothing else", page.browser.execute_script("return performance.getEntriesByType('resource').length") == 0)
    print(f"{name}: drawn {page.opened:.0f} ms after the start of loading")


def check_silence(page, name):
    said = page.console()
    check(f"{name}: nothing is said on the console", not said, str(said[:3]))


def check_frames(page, name, view):
    rate = 0
    # The best of three: other programs may have the processor for a moment.
    for _ in range(3):
        frames = page.frames()
        if 1000 / frames.mean() > rate:
            rate, slowest = 1000 / frames.mean(), np.sort(frames)[-3]
        if rate >= 30:
            break
    check(f"{name}: pans {view} at 30 frames a second", rate >= 30, f"({rate:.1f})")
    print(f"{name}: {rate:.0f} frames a second in a drag over {view}, third slowest {slowest:.0f} ms")


def check_zoom(page, file):
    end = file["trajectory/time"][-1]
    sticks = file["events/time"][:][file["events/kind"][:] == 0]
    start, stop = page.view()
    check("the page begins with the stick-slip", start < sticks[0] and sticks[-1] < stop and stop - start < 0.1)
    check("the time axis is in sight", page.find("#chart canvas.axis").rect["y"] + 40 <= page.browser.execute_script("return innerHeight + scrollY"))
    for width, height in SIZES:
        page.browser.set_window_size(width, height)
        time.sleep(0.3)
        axis, overview = (page.browser.execute_script("return arguments[0].getBoundingClientRect().toJSON()", page.find(one)) for one in ("#chart canvas.axis", "#overview"))
        inside = page.browser.execute_script("return innerHeight")
        check(f"at {width} x {height} the time axis and the overview are in sight", axis["bottom"] <= inside + 1 and 0 <= overview["top"] < overview["bottom"] < axis["top"], f"({overview}, {axis})")
    page.browser.set_window_size(1400, 1000)
    time.sleep(0.3)
    check_overview(page, end)
    page.browser.execute_script("arguments[0].focus()", page.chart)
    check("the whole run is one key away", page.keys(Keys.HOME) == (0.0, end))
    left, width = page.geometry()
    x, under = left + 0.25 * width, 0.25 * end
    start, stop = page.wheel(x, -400)
    check("the wheel zooms in", 0.2 * end < stop - start < 0.8 * end)
    # The pointer stands on a whole pixel.
    check("what is under the pointer stays", close(start + 0.25 * (stop - start), under, 1.5 / width * end))
    page.wheel(x, 400)
    check("the wheel zooms out", page.view() == (0.0, end))

    page.click("#stick-slip")
    start, stop = page.view()
    check("the view of stick-slip has the first and the last stick", start < sticks[0] and sticks[-1] < stop and stop - start < 0.1)
    page.move_to(page.panel(), 500).click_and_hold().move_by_offset(-120, 0).release().perform()
    moved = page.view()
    check("a drag pans by what it covers", close(moved[0] - start, 120 / width * (stop - start), 2 / width * (stop - start)))
    check("and keeps the zoom", close(moved[1] - moved[0], stop - start, 1e-12))
    page.move_to(page.panel(), 400).double_click().perform()
    check("a double click resets", page.view() == (0.0, end))

    page.move_to(page.panel(), left + 0.1 * width).click().perform()
    check("a click alone moves nothing", page.view() == (0.0, end))
    start, stop = page.keys(Keys.ARROW_UP, "+", "+")
    check("keys zoom", close(stop - start, 0.2 * end, 1e-9))
    moved = page.keys(Keys.ARROW_RIGHT)
    check("keys pan", close(moved[0] - start, 0.02 * end, 1e-9))
    check("Home resets", page.keys(Keys.HOME) == (0.0, end))
    ActionChains(page.browser).key_down(Keys.SHIFT).perform()
    page.move_to(page.panel(), left + 0.5 * width).click_and_hold().move_by_offset(round(0.2 * width), 0).release().perform()
    ActionChains(page.browser).key_up(Keys.SHIFT).perform()
    start, stop = page.view()
    check("Shift and a drag zoom to a stretch", close(start, 0.5 * end, 0.01 * end) and close(stop, 0.7 * end, 0.01 * end))
    page.click("#whole")


def check_overview(page, end):
    """The overview has the whole run: a click brings the view there, a drag moves it, and with the whole run in view chooses a part."""
    start, stop = page.view()
    canvas = page.find("#overview")
    left, width = page.geometry()
    place = lambda at: left + at / end * width
    page.move_to(canvas, place(0.3 * end), 15).click().perform()
    moved = page.view()
    check("a click on the overview brings the view there", close(sum(moved) / 2, 0.3 * end, 1.5 / width * end), str(moved))
    check("and keeps the zoom", close(moved[1] - moved[0], stop - start, 1e-9))
    page.move_to(canvas, place(0.3 * end), 15).click_and_hold().move_by_offset(100, 0).release().perform()
    check("the mark is dragged", close(sum(page.view()) / 2, 0.3 * end + 100 / width * end, 1.5 / width * end), str(page.view()))
    page.click("#whole")
    page.move_to(canvas, place(0.2 * end), 15).click_and_hold().move_by_offset(round(0.4 * width), 0).release().perform()
    view = page.view()
    check("with the whole run in view a drag chooses a part", close(view[0], 0.2 * end, 2 / width * end) and close(view[1], 0.6 * end, 2 / width * end), str(view))


def check_legend(page):
    """One name for the ground of a mode and the event that begins it."""
    names = [entry.text for entry in page.all("#key > span")]
    check("each name is once in the legend", len(set(names)) == len(names) and {"stick", "slip"} <= set(names), str(names))
    check("the ground of a mode has the mark of its event", len(page.all("#key i svg")) == 2)
    torque = next(panel for panel in page.all("#chart > .panel") if panel.text.startswith("Torque"))
    check("indices are indices", "T_f" not in torque.text and "F_n" not in torque.text and len(torque.find_elements(By.CSS_SELECTOR, "sub")) >= 4, torque.text)


def check_events(page, file):
    times, kinds = file["events/time"][:], file["events/kind"][:]
    check("the list has every event", page.find("#event-filter option").get_attribute("textContent") == f"all {len(times)}")
    for index in (0, 2, 20, len(times) - 1):
        row = page.event_row(index)
        check(f"event {index} has its time", f"{times[index]:.12f} s" in row.text)
        row.click()
        start, stop = page.view()
        check(f"a click on event {index} moves the view there", close((start + stop) / 2, times[index], 1e-9))
        check(f"event {index} is marked", page.find(f"#event-{index}").get_attribute("aria-selected") == "true")
    page.event_row(20).click()
    start, stop = page.view()
    check("an event is seen within a few natural periods", stop - start < 1.1e-3)
    check("N goes to the next event", close(sum(page.click("#next")) / 2, times[21], 1e-9))
    check("P goes to the one before", close(sum(page.click("#previous")) / 2, times[20], 1e-9))
    page.move_to(page.panel(0), page.pixel_of(times[22])).click().perform()
    check("a click on a mark goes to its event", close(sum(page.view()) / 2, times[22], 1e-9))
    sticks = times[kinds == 0]
    canvas = page.find("#durations canvas")
    cycles, width = len(sticks) - 1, canvas.size["width"]
    page.move_to(canvas, 62 + (30 + 0.5) / cycles * (width - 70)).click().perform()
    check("a click on a cycle goes to its stick", close(sum(page.view()) / 2, sticks[30], 1e-9))
    # Ten microseconds around an event: the label has to have the digits for it.
    while page.view()[1] - page.view()[0] > 1e-5:
        page.wheel(page.pixel_of(sticks[30]), -600)
    start, stop = page.view()
    check("the wheel goes to ten microseconds and stays on the event", start < sticks[30] < stop)
    shown = re.match(r"([\d.]+) to ([\d.]+) s", page.find("#view").text)
    check("the view is named to a nanosecond or better", close(float(shown[1]), start, 1e-9) and close(float(shown[2]), stop, 1e-9))


def offset_of(title):
    """What the readings of a panel count from, as its title has it."""
    found = re.search(r", from ([−\d.]+)", title)
    return float(found[1].replace("−", "-")) if found else 0.0


def row_at(page, time, place):
    """The row of the file that the pointer at a time reads."""
    page.move_to(page.panel(), page.pixel_of(place)).perform()
    page.settle()
    shown = float(re.search(r"sample at ([\d.]+) s", page.find("#sample-time").text)[1])
    row = int(np.argmin(abs(time - shown)))
    check("the pointer reads a sample of the file", close(time[row], shown, 1e-12))
    return row


def check_values(page, file):
    """What the legends say at a sample is what the file has there."""
    columns = {name: file["trajectory"][name][:] for name in set(LEGENDS.values())}
    time = file["trajectory/time"][:]
    sticks = file["events/time"][:][file["events/kind"][:] == 0]
    for view, place in (("whole run", 3.0), ("cycle", sticks[10] + 1e-4), ("cycle", sticks[25] + 2e-5)):
        page.click("#whole")
        if view == "cycle":
            index = int(np.searchsorted(file["events/time"][:], place))
            page.event_row(index).click()
        # Energies in a short view count from its left edge: of those, the difference of two readings.
        other = row_at(page, time, place + (3e-5 if view == "cycle" else 1.0))
        before = {(title, legend): quantity(text) for title, legend, text in page.readings()}
        row = row_at(page, time, place)
        count = 0
        for title, legend, text in page.readings():
            name = LEGENDS.get((title.split(",")[0].replace(" since the left edge", ""), legend))
            if name is None:
                continue
            value, digit = quantity(text)
            near = columns[name][max(row - 128, 0):row + 128]
            tolerance = digit + 1.2e-7 * (near.max() - near.min())
            if "since the left edge" in title:
                value, digit = value - before[title, legend][0], 2 * digit
                stored, tolerance = columns[name][row] - columns[name][other], 2 * tolerance
                unit = re.search(r", ([kmµn]?)J", title)[1]
                check(f"{view}: {name} is read in the unit of its axis", text.endswith(f" {unit}J"), f"({text}, {title})")
            else:
                value, stored = value + offset_of(title), columns[name][row]
            check(f"{view}: {name} is the file's", close(value, stored, tolerance), f"({text} in {title} for {stored})")
            count += 1
        check(f"{view}: every channel is read", count == len(LEGENDS), f"({count})")


def check_shades(page, file):
    times, kinds = file["events/time"][:], file["events/kind"][:]
    index = np.flatnonzero(kinds == 0)[20]
    page.event_row(int(index)).click()
    stick, slip, again = times[index:index + 3]
    page.move_to(page.panel(), 2).perform()
    # Near the top edge, where no curve of the relative velocity is in stick.
    check("stick is shaded", page.colour(2, (stick + slip) / 2 + 3e-6, 6) == STICK)
    check("slip is not", page.colour(2, slip + 0.1 * (again - slip), 6) == SLIP)


def check_layout(page, name):
    for width in (1400, 800, 390):
        page.browser.set_window_size(width, 1000)
        time.sleep(0.3)
        page.event_row(20).click()
        page.settle()
        bad = page.browser.execute_script(LAYOUT)
        check(f"{name} at {width} pixels: nothing overlaps or is clipped", not bad, str(bad[:5]))
        page.find("#panel-choice summary").click()
        bad = page.browser.execute_script(LAYOUT)
        check(f"{name} at {width} pixels: nor with the list of panels", not bad, str(bad[:5]))
        page.find("#panel-choice summary").click()
    page.browser.set_window_size(1400, 1000)
    time.sleep(0.3)
    page.click("#whole")


def check_wheel(page):
    """The wheel is the page's until the figure has the focus."""
    page.browser.execute_script("document.activeElement.blur(); scrollTo(0, 0)")
    whole = page.view()
    check("the wheel alone leaves the view", page.wheel(500, 300, None) == whole)
    time.sleep(0.3)
    check("and scrolls the page", page.scrolled() > 50, f"({page.scrolled()})")
    page.browser.execute_script("scrollTo(0, 0)")
    page.move_to(page.panel(), 400).click().perform()
    start, stop = page.wheel(500, -300, None)
    check("in a figure with the focus the wheel zooms", stop - start < 0.9 * (whole[1] - whole[0]))
    check("and does not scroll", page.scrolled() == 0)
    page.keys(Keys.ESCAPE)
    check("Esc gives the wheel back", page.wheel(500, 300, None) == (start, stop))
    page.browser.execute_script("scrollTo(0, 0)")
    page.click("#whole")


def check_readout(page):
    """The pointer moves nothing but its own line."""
    for width in (1400, 390):
        page.browser.set_window_size(width, 1000)
        time.sleep(0.3)
        page.click("#whole")
        boxes = "return [document.documentElement.scrollHeight, ...[...document.querySelectorAll('#chart canvas:not(.axis)')].map(e => e.offsetTop)].join()"
        seen = set()
        for view in ("#whole", "#stick-slip"):
            page.click(view)
            for share in (0.2, 0.45, 0.7, 0.95):
                left, plot = page.geometry()
                page.move_to(page.panel(0), left + share * plot).perform()
                page.settle()
                seen.add(page.browser.execute_script(boxes))
            page.move_to(page.panel(0), 2).perform()
            page.settle()
            seen.add(page.browser.execute_script(boxes))
        check(f"at {width} pixels no reading moves the layout", len(seen) == 1, str(seen))
    page.browser.set_window_size(1400, 1000)
    time.sleep(0.3)
    page.click("#whole")


def check_cursors(page, file):
    """Two cursors, put at two events, and dragged."""
    times = file["events/time"][:]
    page.event_row(20).click()
    page.click("#whole")
    page.event_row(20).click()
    page.move_to(page.panel(), 300).click().perform()
    page.move_to(page.panel(0), page.pixel_of(times[20])).perform()
    page.keys("1")
    page.move_to(page.panel(0), page.pixel_of(times[22])).perform()
    page.keys("2")
    table = page.at_cursors()
    between = times[22] - times[20]
    check("a cursor near an event is at it", table["time"][:2] == [f"{times[20]:.12f} s", f"{times[22]:.12f} s"], str(table["time"]))
    check("the time between two cursors", close(quantity(table["time"][2])[0], between, 1e-9 * between + 1e-15), str(table["time"]))
    check("and its inverse", close(quantity(table["1/Δt"][2])[0], 1 / between, 1e-6 / between), str(table["1/Δt"]))
    before = file["events/phi1_before"]
    shown = [quantity(text)[0] for text in table["Twist, stator, φ₁"]]
    expected = [before[20], before[22], before[22] - before[20]]
    check("the values at the cursors", all(close(a, b, 1e-6 * abs(expected[0])) for a, b in zip(shown, expected)), f"({shown} for {expected})")
    at = page.pixel_of(times[22])
    page.move_to(page.panel(), at).click_and_hold().move_by_offset(-60, 0).release().perform()
    moved = float(page.at_cursors()["time"][1].removesuffix(" s"))
    start, stop = page.view()
    check("a cursor is dragged", close(moved, times[22] - 60 / page.geometry()[1] * (stop - start), 7 / page.geometry()[1] * (stop - start)))
    check("and the view stays", start < times[20] < stop)


def check_address(page):
    """The address restores window, panels, curves and cursors."""
    page.find("#panel-choice summary").click()
    page.all("#panel-choice input")[4].click()
    page.find("#panel-choice summary").click()
    page.all("#chart > .panel button")[1].click()
    view, table = page.view(), page.at_cursors()
    time.sleep(0.5)
    address = page.browser.current_url
    check("the address has the view", "#t=" in address and "cursors=" in address and "off=" in address, address)
    state = "return [...document.querySelectorAll('.panel')].map(e => e.hidden + [...e.querySelectorAll('button')].map(b => b.getAttribute('aria-pressed'))).join()"
    before = page.browser.execute_script(state)
    page.browser.get("about:blank")
    page.browser.get(address)
    page.browser.execute_async_script(DRAWN)
    page.chart = page.find("#chart")
    check("and restores it exactly", page.view() == view, f"({page.view()} for {view})")
    check("with panels and curves", page.browser.execute_script(state) == before)
    check("and cursors", page.at_cursors() == table, str(page.at_cursors()))
    page.browser.get(address.split("#")[0])
    page.browser.refresh()
    page.browser.execute_async_script(DRAWN)
    page.chart = page.find("#chart")


# Texts and curves that do not stand out from what is behind them, [contrast, what], with the least that they need.
CONTRAST = """
const channels = text => (text.match(/[\\d.]+/g) || []).map(Number);
const luminance = ([r, g, b]) => [r, g, b].map(v => v / 255).map(v => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
  .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
const ratio = (a, b) => { const [x, y] = [luminance(a), luminance(b)].sort((p, q) => q - p); return (x + 0.05) / (y + 0.05); };
const behind = e => { for (; e; e = e.parentElement) { const c = channels(getComputedStyle(e).backgroundColor); if (c.length === 3) return c; } return [255, 255, 255]; };
const bad = [];
for (const e of document.querySelectorAll('h1, h2, p, b, button, summary, td, th, li, pre, label, span, output, option')) {
  if (!e.getClientRects().length || !e.textContent.trim() || e.getAttribute('aria-pressed') === 'false') continue;
  const found = ratio(channels(getComputedStyle(e).color), behind(e));
  if (found < 4.5) bad.push(`${found.toFixed(2)} ${e.tagName} ${e.textContent.slice(0, 30)}`);
}
const probe = document.body.appendChild(document.createElement('i'));
const named = name => { probe.style.color = `var(--${name})`; return channels(getComputedStyle(probe).color); };
for (const curve of ['blue', 'vermillion', 'green', 'purple', 'orange', 'black', 'axis']) {
  const least = arguments[0] || !['orange', 'purple'].includes(curve) ? 3 : 2;
  const found = ratio(named(curve), named('ground'));
  if (found < least) bad.push(`${found.toFixed(2)} ${curve}`);
}
probe.remove();
return bad;
"""


def check_colours(page):
    """The system's colours, a switch, and contrast in both."""
    page.click("#whole")
    ground = lambda: sum(page.colour(2, 0.3 * page.view()[1], 6))
    for scheme in ("light", "dark"):
        page.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]})
        page.settle()
        is_dark = ground() < 200
        check(f"a {scheme} system has a {scheme} page", is_dark == (scheme == "dark"))
        bad = page.browser.execute_script(CONTRAST, scheme == "dark")
        check(f"texts and curves stand out on the {scheme} page", not bad, str(bad[:6]))
    page.click("#theme")
    page.settle()
    check("the switch makes a dark page light", ground() > 600)
    page.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": "light"}]})
    check("and it stays so", ground() > 600)


def check_pinch(page):
    """Two fingers zoom, and the times under them stay there."""
    page.click("#whole")
    page.browser.execute_script("scrollTo(0, 0)")
    box = page.browser.execute_script("const b = document.querySelectorAll('#chart canvas')[1].getBoundingClientRect(); return [b.left, b.top]")
    left, width = page.geometry()
    start, stop = page.view()

    def touch(kind, *xs):
        points = [{"x": box[0] + x, "y": box[1] + 60, "id": k} for k, x in enumerate(xs)]
        page.browser.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    at = lambda x, view: view[0] + (x - left) / width * (view[1] - view[0])
    first, second = left + 0.45 * width, left + 0.55 * width
    touch("touchStart", first)
    touch("touchStart", first, second)
    for k in range(1, 6):
        touch("touchMove", first - 30 * k, second + 30 * k)
    touch("touchEnd")
    view = page.view()
    check("two fingers that part zoom in", view[1] - view[0] < 0.6 * (stop - start), str(view))
    for before, after in ((first, first - 150), (second, second + 150)):
        check("what is under a finger stays", close(at(after, view), at(before, (start, stop)), 3 / width * (stop - start)))
    touch("touchStart", 500)
    for k in range(1, 6):
        touch("touchMove", 500 - 20 * k)
    touch("touchEnd")
    check("one finger moves", page.view()[0] > view[0])
    page.click("#whole")


def check_texts(page, file):
    check("the title is the case's", page.find("h1").text == file.attrs["title"] == page.browser.title)
    summary = page.find("#headline").text
    check("the summary has the onset beside the paper's", f"{file['stick_slip'].attrs['onset_time']:.9f} s 6.975 s" in summary)
    check("the provenance has the commit", file["meta"].attrs["program_commit"] in page.find("#provenance").text)
    text = page.find("#case").get_attribute("textContent")
    check("the case is there as given", text == file["input/case"][()].decode())
    check("a complete run has no notice", not page.find("#notice").is_displayed())
    check("and no certificate unless the file has one", page.find("#certificate-card").is_displayed() == ("certificate" in file))


def chromium():
    """The browser."""
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or sys.exit("chromium is not installed")
    # Chromium has no sandbox for root, nor much shared memory in a container; both leave the page as it is.
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", "--window-size=1400,1000"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = shutil.which("chromedriver") or sys.exit("chromedriver is not installed")
    return webdriver.Chrome(options=options, service=Service(driver))


def end():
    """The sum of all checks, as the exit status."""
    print(f"{passed} passed, {failed} failed")
    sys.exit(1 if failed else 0)


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    with h5py.File(sys.argv[1]) as file, chromium() as browser:
        path = pathlib.Path(sys.argv[2])
        page = opened(browser, path)
        check_opening(page, path.name)
        check_anywhere(browser, path, path.name)
        page = opened(browser, path)
        check_texts(page, file)
        check_legend(page)
        check_zoom(page, file)
        check_events(page, file)
        check_values(page, file)
        check_shades(page, file)
        check_layout(page, path.name)
        check_wheel(page)
        check_readout(page)
        check_cursors(page, file)
        check_address(page)
        check_pinch(page)
        check_colours(page)
        check_frames(page, path.name, "the whole run")
        page.click("#stick-slip")
        check_frames(page, path.name, "the stick-slip")
        page.click("#zoom-in")
        page.click("#zoom-in")
        check_frames(page, path.name, "a quarter of the stick-slip")
        page.event_row(20).click()
        check_frames(page, path.name, "four cycles")
        check_silence(page, path.name)
        if len(sys.argv) == 4:
            path = pathlib.Path(sys.argv[3])
            page = opened(browser, path)
            check_opening(page, path.name)
            page.click("#whole")
            check("the page of a long run has bands", "bands in view" in page.find("#in-view").text)
            check("and says so", "drawn as a band" in page.find("#notes").text)
            check(f"{path.name} is below 5 MB", path.stat().st_size < 5_000_000)
            page.click("#stick-slip")
            check("the stick-slip of a long run is all samples", "bands" not in page.find("#in-view").text)
            check_frames(page, path.name, "the stick-slip")
            page.click("#whole")
            check_frames(page, path.name, "the whole run")
            check_silence(page, path.name)
    end()


if __name__ == "__main__":
    main()
