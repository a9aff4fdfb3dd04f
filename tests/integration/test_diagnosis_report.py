"""The report of a diagnosis in a real browser: wide and narrow, light and dark, on paper, without a network."""

from __future__ import annotations

import base64
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from diagnosis.report import write_report
from tests.unit.diagnosis.diagnosis_example import EXAMPLES

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
DRIVER = shutil.which("chromedriver")
WIDE, PHONE = (1440, 900), (390, 844)
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
        "return [...document.querySelectorAll('header *, main *')].filter((e) => !e.closest('.scroll, svg, .x') &&"
        " e.getBoundingClientRect().right > window.innerWidth + 1).map((e) => e.outerHTML.slice(0, 80))"
    )
    assert outside == []


def test_letters_are_large_enough_everywhere(browser: Any, folder: Path) -> None:
    opened(browser, folder, "missing_physics")
    sizes = browser.execute_script(
        "return [...document.querySelectorAll('header *, main *')].filter((e) => !e.closest('svg') &&"
        " [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim()))"
        ".map((e) => parseFloat(getComputedStyle(e).fontSize))"
    )
    assert min(sizes) >= LEAST_PX


@pytest.mark.parametrize("name", ["missing_physics", "two_effects"])
def test_names_in_the_network_do_not_cover_each_other(browser: Any, folder: Path, name: str) -> None:
    opened(browser, folder, name)
    boxes = browser.execute_script(
        "return [...document.querySelectorAll('.node')].map((n) => { const b = n.getBoundingClientRect();"
        " return [n.textContent, b.left, b.right, b.top, b.bottom, n.scrollWidth - n.clientWidth]; })"
    )
    assert len(boxes) >= 14
    for index, (one, left, right, top, bottom, cut) in enumerate(boxes):
        assert cut <= 0, one
        for other, left_2, right_2, top_2, bottom_2, _ in boxes[index + 1 :]:
            assert right <= left_2 or right_2 <= left or bottom <= top_2 or bottom_2 <= top, (one, other)


def test_pointing_at_a_chart_tells_its_values(browser: Any, folder: Path) -> None:
    opened(browser, folder, "missing_physics")
    shown = browser.execute_script(
        "const s = document.querySelector('.sensors svg[data-hover]'), b = s.getBoundingClientRect();"
        "s.dispatchEvent(new PointerEvent('pointermove',"
        " { clientX: b.left + 0.3 * b.width, clientY: b.top + 9, bubbles: true }));"
        "const t = s.parentElement.querySelector('.tip'); const text = t.innerText;"
        "s.parentElement.dispatchEvent(new PointerEvent('pointerleave'));"
        "return [text, document.querySelectorAll('.tip').length];"
    )
    text, left = shown
    assert left == 0
    assert text.startswith("Time in min: ")
    values = {line.rpartition(": ")[0]: float(line.rpartition(": ")[2]) for line in text.splitlines()}
    assert set(values) == {"Time in min", "measured", "as delivered", "calibrated", "with the findings"}
    example = next(c for c in EXAMPLES["missing_physics"]().courses if c.recording == "hold_1")
    row = int(abs(example.time - 60.0 * values["Time in min"]).argmin())
    assert values["with the findings"] == pytest.approx(example.after["oil"][row], abs=0.5)
    assert values["as delivered"] == pytest.approx(example.before["oil"][row], abs=0.5)


def test_light_and_dark_follow_the_reader(browser: Any, folder: Path) -> None:
    grounds = []
    for scheme in ("light", "dark"):
        browser.execute_cdp_cmd(
            "Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
        )
        opened(browser, folder, "missing_physics")
        grounds.append(browser.execute_script("return getComputedStyle(document.body).backgroundColor"))
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
    assert grounds == ["rgb(255, 255, 255)", "rgb(22, 25, 29)"]


def test_it_can_be_printed_whole(browser: Any, folder: Path) -> None:
    browser.get((folder / "insufficient_data.html").as_uri())
    folded = browser.execute_script("return document.querySelectorAll('details:not([open])').length")
    assert folded > 0
    printed = base64.b64decode(browser.execute_cdp_cmd("Page.printToPDF", {"printBackground": True})["data"])
    assert printed.startswith(b"%PDF")
    assert browser.execute_script("return document.querySelectorAll('details:not([open])').length") == 0
