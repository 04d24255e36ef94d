"""Tests the report in a headless browser: clicks and types every mode, and expects no network requests.

report_browser_test.py SUBSTEP SOURCE_FOLDER
"""

import pathlib
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent))
from headless_browser import browser, expect, expect_no_network  # noqa: E402
from selenium.webdriver.common.by import By  # noqa: E402

SUITE = """
[defaults]
frames = 40
images = [20, 40]
size = [320, 180]
[[case]]
scene = "../scenes/bouncing_balls.gltf"
algorithms = ["a3", "a4"]
"""


def failing_report(substep, source, folder):
    """Makes goldens of a scene, changes its light and restitution, checks, and returns the report."""
    (folder / "golden").mkdir()
    (folder / "scenes").mkdir()
    (folder / "golden/suite.toml").write_text(SUITE)
    scene = folder / "scenes/bouncing_balls.gltf"
    shutil.copy(source / "scenes/bouncing_balls.gltf", scene)

    def run(*arguments):
        return subprocess.run([substep, *arguments], cwd=folder, capture_output=True, text=True).returncode

    expect(run("check", "--suite", "golden") == 1, "a new case did not fail")
    shutil.copy(folder / "out/check/report.html", folder / "new.html")
    expect(run("approve", "--suite", "golden", "--failed", "--reason", "first") == 0, "cannot approve")
    text = scene.read_text().replace('"intensity":3.0', '"intensity":2.5').replace('"restitution":0.5', '"restitution":0.4')
    scene.write_text(text)
    # So that the two differ by other steps, too.
    (folder / "golden/suite.toml").write_text(SUITE + "settings = { a4 = { substeps = 6 } }\n")
    expect(run("check", "--suite", "golden") == 1, "a changed case did not fail")
    return folder / "out/check/report.html"


class Page:
    def __init__(self, page, report):
        self.page = page
        page.get(report.as_uri())
        self.body = page.find_element(By.TAG_NAME, "body")

    def script(self, text, *arguments):
        return self.page.execute_script(text, *arguments)

    def key(self, keys):
        self.body.send_keys(keys)

    def pair(self):
        return self.page.find_element(By.CSS_SELECTOR, "section.current .pair")

    def shows(self):
        images = self.pair().find_elements(By.CSS_SELECTOR, "img")
        return [image.get_attribute("data-what") for image in images if image.is_displayed()]


def drive(page):
    page.key("j")
    expected = {"side": ["expected", "actual"], "flicker": None, "flip": ["flip"]}
    buttons = page.pair().find_elements(By.CSS_SELECTOR, ".viewer-bar button")
    for by in ["key", "click"]:
        for number, mode in enumerate(expected):
            if by == "key":
                page.key(str(number + 1))
            else:
                buttons[number].click()
            expect(buttons[number].get_attribute("aria-pressed") == "true", f"{by}: {mode} is not pressed")
            if expected[mode]:
                expect(page.shows() == expected[mode], f"{by}: {mode} shows {page.shows()}")
            box = page.pair().find_element(By.CSS_SELECTOR, ".pictures").rect
            top = page.script("return scrollY")
            if by == "key":
                expect(box["y"] >= top and box["y"] + box["height"] <= top + page.script("return innerHeight"),
                       f"{mode} is not in sight after its key")
    page.key("2")
    page.key(" ")
    first = page.shows()
    page.key(" ")
    expect(first != page.shows(), "space flickers by hand")


def moves(page):
    pairs = page.script("return document.querySelector('section.case').querySelectorAll('.pair').length")
    for keys, case in [("n" * pairs, 0), ("n", 1), ("j", 1), ("p", 0), ("j", 1), ("k", 0)]:
        page.key(keys)
        current = page.script("return [...document.querySelectorAll('section.case')].map(c => c.matches('.current'))")
        expect(current == [case == 0, case == 1], f"{keys}: is current {current}")


def keeps_only_picture(page):
    page.key("j  ")
    expect(page.shows() == ["actual"], f"a case without golden shows {page.shows()}")


def dark(page):
    page.page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": "dark"}]})
    color = page.script("return getComputedStyle(document.body).backgroundColor")
    expect(sum(int(c) for c in color[4:-1].split(",")) < 200, f"dark mode is dark: {color}")


def fits_narrow_windows(page):
    page.page.set_window_size(500, 900)
    wide = page.script("return document.documentElement.scrollWidth")
    expect(wide <= page.script("return innerWidth"), f"the page is {wide} pixels wide")


def without_scripts(page, report):
    page.page.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    page.page.get(report.as_uri())
    pictures = page.page.find_elements(By.CSS_SELECTOR, ".pictures img")
    expect(len(pictures) > 10 and pictures[0].is_displayed(), "without scripts the pictures are there")


def main():
    substep, source = sys.argv[1:3]
    with tempfile.TemporaryDirectory() as folder:
        report = failing_report(substep, pathlib.Path(source), pathlib.Path(folder))
        chrome = browser("1300,1050", ["--disable-gpu"])
        try:
            moves(Page(chrome, report))
            drive(Page(chrome, report))
            keeps_only_picture(Page(chrome, report.parents[2] / "new.html"))
            page = Page(chrome, report)
            dark(page)
            fits_narrow_windows(page)
            expect_no_network(page.page)
            without_scripts(page, report)
        finally:
            chrome.quit()


main()
