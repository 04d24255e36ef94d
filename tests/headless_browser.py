"""Chromium without a window, for the tests of pages."""

import json
import shutil
import sys

NEEDS = "needs Chromium, its driver and selenium: on Debian, apt-get install chromium-driver python3-selenium"

try:
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.common import utils
except ImportError:
    sys.exit(f"{sys.argv[0]}: {NEEDS}")


def expect(condition, what):
    if not condition:
        sys.exit(f"{sys.argv[0]}: {what}")


class DriverService(Service):
    """A service that is reached at 127.0.0.1, since a bare system may not know the name localhost."""

    @property
    def service_url(self):
        return f"http://127.0.0.1:{self.port}"

    def is_connectable(self):
        return utils.is_connectable(self.port, "127.0.0.1")


def browser(size, arguments):
    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    expect(chromium and driver, NEEDS)
    options = Options()
    options.binary_location = chromium
    for argument in ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", f"--window-size={size}", "--hide-scrollbars",
                     "--remote-debugging-pipe", *arguments]:
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"performance": "ALL", "browser": "ALL"})
    return webdriver.Chrome(service=DriverService(driver), options=options)


def expect_no_network(chrome):
    """Ends the test where the page requested an address of the network, or logged an error."""
    for entry in chrome.get_log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] != "Network.requestWillBeSent":
            continue
        url = message["params"]["request"]["url"]
        expect(url.startswith(("file:", "data:", "blob:")), f"asked for {url[:100]}")
    errors = [e for e in chrome.get_log("browser") if e["level"] == "SEVERE"]
    expect(not errors, f"the page has errors: {errors}")
