"""The report of a diagnosis in a real browser: wide and narrow, on paper, without a network."""

from __future__ import annotations

import base64
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from diagnosis.report.write import write_report
from tests.unit.diagnosis.diagnosis_example import EXAMPLES

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
DRIVER = shutil.which("chromedriver")
WIDE, PHONE = (1280, 900), (420, 844)
LEAST_PX = 10.0  # of letters


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("diagnosis")
    for name, example in EXAMPLES.items():
        write_report(example(), path / f"{name}.html")
    return path


@pytest.fixture(scope="module", params=[WIDE, PHONE], ids=["wide", "phone"])
def browser(request: pytest.FixtureRequest) -> Iterator[Any]:
    if CHROMIUM is None or DRIVER is None:
        pytest.skip("no chromium with chromedriver here; 'apt-get install chromium chromium-driver' brings them")
    webdriver = pytest.importorskip("selenium.webdriver", reason="needs selenium, which the extra 'dev' brings")
    width, height = request.param
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for argument in (
        "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-background-networking",
        "--host-resolver-rules=MAP * ~NOTFOUND",
    ):  # fmt: skip
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(DRIVER))
    try:
        screen = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width == PHONE[0]}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
        yield driver
    finally:
        driver.quit()


def opened(browser: Any, folder: Path, name: str) -> Any:
    browser.get((folder / f"{name}.html").as_uri())
    browser.execute_script("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    return browser


@pytest.mark.parametrize("name", EXAMPLES)
def test_opens_without_an_error_and_fits_the_screen(browser: Any, folder: Path, name: str) -> None:
    opened(browser, folder, name)
    assert [entry["message"] for entry in browser.get_log("browser") if entry["level"] != "INFO"] == []
    page, screen = browser.execute_script("return [document.documentElement.scrollWidth, window.innerWidth]")
    assert page <= screen
    outside = browser.execute_script(
        "return [...document.querySelectorAll('header *, main *')]"
        ".filter((e) => !e.closest('.scroll, .js-plotly-plot') &&"
        " e.getBoundingClientRect().right > window.innerWidth + 1).map((e) => e.outerHTML.slice(0, 80))"
    )
    assert outside == []


def test_every_chart_is_drawn_as_wide_as_the_page(browser: Any, folder: Path) -> None:
    opened(browser, folder, "missing_physics")
    charts = browser.execute_script(
        "return [...document.querySelectorAll('figure.chart')].map((f) => [f.id, f.clientWidth,"
        " f.querySelector('.main-svg').getBoundingClientRect().width, f.querySelectorAll('.xy, .point').length])"
    )
    assert [name for name, *_ in charts] == [
        "chart-names",
        "chart-heat",
        "chart-network",
        "chart-errors",
        "chart-courses",
    ]
    for name, page, drawn, parts in charts:
        assert abs(page - drawn) < 2, name
        assert parts > 0, name


def test_letters_are_large_enough_everywhere(browser: Any, folder: Path) -> None:
    opened(browser, folder, "missing_physics")
    sizes = browser.execute_script(
        "return [...document.querySelectorAll('header *, main *')]"
        ".filter((e) => !e.closest('.js-plotly-plot, math') &&"
        " [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim()))"
        ".map((e) => parseFloat(getComputedStyle(e).fontSize))"
    )
    assert min(sizes) >= LEAST_PX


def test_it_can_be_printed_whole(browser: Any, folder: Path) -> None:
    browser.get((folder / "insufficient_data.html").as_uri())
    folded = browser.execute_script("return document.querySelectorAll('details:not([open])').length")
    assert folded > 0
    printed = base64.b64decode(browser.execute_cdp_cmd("Page.printToPDF", {"printBackground": True})["data"])
    assert printed.startswith(b"%PDF")
    assert browser.execute_script("return document.querySelectorAll('details:not([open])').length") == 0
