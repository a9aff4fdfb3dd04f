"""The report on the paper: complete, self-contained, and good in a real browser, wide and narrow."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from matplotlib.image import imread

from builder.reproduce.report import FIGURES, NUMBERS, PAGE, SUMMARY, Report
from builder.reproduce.reproduce import reproduce
from builder.reproduce.study import Settings
from models.errors import InputError

# Fewer points, runs and rows than the command takes.
QUICK = Settings(
    jobs=1, samples=400, judged=100, runs=1, longest_s=1.0, step_s=600.0, fine_step_s=300.0, trajectories=2
)
ITEMS = [
    "Fig. 1",
    "Fig. 2",
    "Table 1",
    "Table 2",
    "Eqs. (6), (10)",
    "Fig. 3",
    "Fig. 4",
    "Table 3",
    "Table 4",
    "Fig. 5",
    "Figs. 6-8",
    "Cold-start corner",
    "Fig. 9",
    "Table 5",
    "Fig. 10",
    "Fig. 11",
    "Fig. 12",
    "Speed",
    "Table 6",
    "Fig. 13",
    "Boundary conditions",
    "Sensitivity",
    "Published numbers",
    "Loss map",
]
KEPT = "notes of mine.txt"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("paper")
    (path / KEPT).write_text("keep me")
    return path


@pytest.fixture(scope="module")
def report(folder: Path) -> Report:
    return reproduce(folder, settings=QUICK)


def test_no_item_of_the_paper_is_missing(report: Report, folder: Path) -> None:
    assert [item.key for item in report.items] == ITEMS
    written = json.loads((folder / NUMBERS).read_text(encoding="utf-8"))
    assert [item["key"] for item in written["items"]] == ITEMS
    page = (folder / PAGE).read_text(encoding="utf-8")
    for item in report.items:
        assert f'<section id="{item.anchor}">' in page
    assert len({item.anchor for item in report.items}) == len(ITEMS)
    for key in ITEMS:
        assert f"| {key} |" in (folder / SUMMARY).read_text(encoding="utf-8")


def test_verdicts_that_do_not_depend_on_how_much_is_computed(report: Report) -> None:
    verdicts = {item.key: item.verdict.value for item in report.items}
    for key in ("Table 1", "Table 2", "Table 4", "Table 5", "Fig. 3", "Fig. 4", "Published numbers"):
        assert verdicts[key] == "reproduced", key
    for key in ("Eqs. (6), (10)", "Table 3", "Table 6", "Fig. 13", "Speed"):
        assert verdicts[key] == "differs", key
    assert {verdicts[key] for key in ("Fig. 1", "Fig. 2", "Fig. 5", "Fig. 9")} == {"scheme"}
    assert verdicts["Fig. 10"] == "cannot be compared"


def test_the_readme_tells_every_item_and_these_verdicts(report: Report) -> None:
    readme = (Path(__file__).parents[2] / "docs" / "paper.md").read_text(encoding="utf-8")
    verdict = "(reproduced|differs|scheme|cannot be compared|not in the paper)"
    told = dict(re.findall(rf"^\| ([^|]+) \| [^|]+ \| {verdict} \|$", readme, flags=re.MULTILINE))
    assert list(told) == ITEMS
    verdicts = {item.key: item.verdict.value for item in report.items}
    # With the few points and runs of a test these come out otherwise.
    of_size = {"Figs. 6-8", "Cold-start corner", "Fig. 11", "Fig. 12", "Boundary conditions"}
    assert {k: v for k, v in verdicts.items() if k not in of_size} == {
        k: v for k, v in told.items() if k not in of_size
    }


def test_every_check_tells_what_it_found(report: Report) -> None:
    for item in report.items:
        for check in item.checks:
            assert check.statement, check.name
            assert check.found or check.why, check.name
            assert (check.verdict.value in ("reproduced", "target met")) == (not check.why), check.name
            assert all(abs(value) < float("inf") for value in check.numbers.values()), check.name


def test_every_figure_is_there_as_png_and_csv(report: Report, folder: Path) -> None:
    names = [figure.name for item in report.items for figure in item.figures]
    assert sorted(path.name for path in (folder / FIGURES).iterdir()) == sorted(
        name + ending for name in names for ending in (".csv", ".png")
    )
    for name in names:
        height, width, _ = imread(folder / FIGURES / f"{name}.png").shape
        assert width > 800, name
        assert height > 400, name
        assert len(pd.read_csv(folder / FIGURES / f"{name}.csv")) > 5, name


def test_nothing_is_fetched_from_elsewhere(report: Report, folder: Path) -> None:
    page = (folder / PAGE).read_text(encoding="utf-8")
    without_library = re.sub(r"<script>.*?</script>", "", page, flags=re.DOTALL)
    assert not re.findall(r"""(?:src|href)\s*=\s*["']?(?:https?:)?//""", without_library)
    assert "@import" not in without_library
    for link in re.findall(r'href="([^"#]+)"', without_library):
        assert link.startswith("data:") or (folder / link).is_file(), link


def test_a_folder_that_is_there_is_not_emptied(report: Report, folder: Path) -> None:
    assert (folder / KEPT).read_text() == "keep me"
    assert not list(folder.glob(".unfinished-*"))


def test_an_output_that_cannot_be_made_is_refused_at_once(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    told: list[str] = []
    with pytest.raises(InputError, match="cannot be written"):
        reproduce(file / "inside", settings=QUICK, progress=told.append)
    assert told == [], "nothing is computed before"


# ------------------------------------------------------------------ in a browser

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
DRIVER = shutil.which("chromedriver")
WIDE, PHONE = (1440, 900), (390, 844)


@pytest.fixture(scope="module", params=[WIDE, PHONE], ids=["wide", "phone"])
def browser(request: pytest.FixtureRequest, report: Report, folder: Path) -> Iterator[Any]:
    """The report, opened without a network and fully drawn."""
    if CHROMIUM is None or DRIVER is None:
        pytest.skip("no chromium with chromedriver here; 'apt-get install chromium chromium-driver' brings them")
    webdriver = pytest.importorskip("selenium.webdriver", reason="needs selenium, which the extra 'dev' brings")
    width, height = request.param
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--host-resolver-rules=MAP * ~NOTFOUND"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(DRIVER))
    try:
        screen = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width == PHONE[0]}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
        driver.set_script_timeout(60)
        driver.get((folder / PAGE).as_uri())
        driver.execute_async_script(
            "const done = arguments[0];"
            "const wait = () => document.body.dataset.drawn ? done() : setTimeout(wait, 100); wait();"
        )
        yield driver
    finally:
        driver.quit()


def test_opens_without_a_console_error(browser: Any) -> None:
    assert [entry["message"] for entry in browser.get_log("browser") if entry["level"] != "INFO"] == []


def test_every_panel_is_drawn(browser: Any, report: Report) -> None:
    panels = sum(len(figure.panels) for item in report.items for figure in item.figures)
    drawn = browser.execute_script(
        "return [...document.querySelectorAll('.panel')].map((p) => ["
        "p.dataset.figure, p.querySelectorAll('svg.main-svg path, svg.main-svg .point').length,"
        "p.getBoundingClientRect().width, p.getBoundingClientRect().height])"
    )
    assert len(drawn) == panels
    for name, marks, width, height in drawn:
        assert marks > 2, name
        assert width > 250, name
        assert height > 250, name


def test_fits_the_screen(browser: Any) -> None:
    page, screen = browser.execute_script("return [document.documentElement.scrollWidth, window.innerWidth]")
    assert page <= screen
    outside = browser.execute_script(
        "return [...document.querySelectorAll('main *')].filter((e) => !e.closest('.scroll') && !e.closest('.panel') &&"
        " e.getBoundingClientRect().right > window.innerWidth + 1).map((e) => e.outerHTML.slice(0, 80))"
    )
    assert outside == []


def test_hovering_tells_values_and_a_legend_entry_hides_its_curves(browser: Any) -> None:
    assert browser.execute_script(
        "const p = document.querySelector('.panel[data-figure=fig_03]');"
        "Plotly.Fx.hover(p, [{curveNumber: 2, pointNumber: 5}]);"
        "return [...p.querySelectorAll('.hovertext')].map((e) => e.textContent).join(' ');"
    ).count("Total power loss in W")
    visible = "return [...document.querySelectorAll('.panel[data-figure=fig_03]')].flatMap((p) => p.data).filter((t) => t.name === 'Mauz').map((t) => t.visible !== false)"  # noqa: E501
    assert browser.execute_script(visible) == [True] * 3
    browser.execute_script("document.querySelector('button[data-figure=fig_03][data-label=Mauz]').click()")
    assert browser.execute_script(visible) == [False] * 3
