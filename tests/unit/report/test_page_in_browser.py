"""The page in Chromium, from disk; left out where there is none."""

import pytest

pytest.importorskip("websockets")

from polychirp.report.html import page
from tests.support.browser import CHROMIUM, opened

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium"),
]

DRAWN = """Array.from(document.querySelectorAll("canvas")).map((canvas) => {
  const { width, height } = canvas;
  const data = canvas.getContext("2d").getImageData(0, 0, width, height).data;
  return new Set(new Uint32Array(data.buffer)).size;
})"""
"""Number of different colours of every canvas."""

CONTRASTS = """(() => {
  const numbers = (colour) => colour.match(/[\\d.]+/g).map(Number);
  const light = (colour) => numbers(colour).slice(0, 3).map((part) => part / 255)
    .map((part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4))
    .reduce((sum, part, n) => sum + part * [0.2126, 0.7152, 0.0722][n], 0);
  const behind = (element) => {
    const colour = getComputedStyle(element).backgroundColor;
    return numbers(colour)[3] === 0 ? behind(element.parentElement) : colour;
  };
  const texts = "p, li, h1, h2, h3, td, th, dt, dd, a, span, figcaption, output, button, legend";
  const shown = Array.from(document.querySelectorAll(texts))
    .filter((one) => one.checkVisibility() && one.innerText && !one.closest(":disabled, .tip"));
  return shown.map((one) => {
    const [a, b] = [light(getComputedStyle(one).color), light(behind(one))].sort((x, y) => y - x);
    return [(a + 0.05) / (b + 0.05), one.innerText.slice(0, 40)];
  }).filter(([ratio]) => ratio < 4.5);
})()"""
"""Texts whose contrast is below 4.5, which WCAG 2.1 asks of normal text (level AA)."""


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with opened(tmp_path_factory.mktemp("browser")) as empty:
        yield empty


@pytest.fixture
def report(results, tmp_path):
    file = tmp_path / "report.html"
    file.write_text(page(results, {}), encoding="utf-8")
    return file


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_the_page_works_from_disk_on_every_screen(browser, report, width, scheme):
    browser.show(report.as_uri(), width=width, height=900, scheme=scheme)
    assert browser.errors == []
    assert [url for url in browser.requests if not url.startswith(("file:", "data:"))] == []
    assert browser.value("document.documentElement.scrollWidth") <= width
    assert all(colours > 8 for colours in browser.value(DRAWN))
    assert browser.value(CONTRASTS) == []


def test_the_controls_choose_a_case_and_the_keys_name_its_ghost(browser, report):
    browser.show(report.as_uri(), width=1280, height=900, scheme="light")
    says = browser.value("document.querySelector('output').textContent")
    assert "Strongest ghost of interference: 6.60 m" in says
    key = "canvas.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowRight' }))"
    tip = browser.value(
        f"(() => {{ const canvas = document.querySelectorAll('.plot canvas')[1]; {key};"
        " return document.querySelectorAll('.tip')[1].innerText; })()"
    )
    assert tip.split("\n") == [
        "ghost: direct interference",
        "6.60 m",
        "closing 2.00 m/s (7 km/h)",
        "−8.5 dBm",
    ]
    browser.value("document.querySelector('[value=diverse]').click()")
    says = browser.value("document.querySelector('output').textContent")
    assert "No ghost of interference." in says
    assert browser.errors == []


def test_the_arrow_keys_turn_the_street(browser, report):
    browser.show(report.as_uri(), width=1280, height=900, scheme="light")
    before, after = browser.value(
        "(() => { const canvas = document.querySelector('#street canvas');"
        " const before = canvas.toDataURL();"
        " canvas.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowLeft' }));"
        " return [before, canvas.toDataURL()]; })()"
    )
    assert before != after


def test_the_button_changes_between_a_light_and_a_dark_page(browser, report):
    browser.show(report.as_uri(), width=1280, height=900, scheme="light")
    colour = "getComputedStyle(document.body).backgroundColor"
    light = browser.value(colour)
    browser.value("document.getElementById('theme').click()")
    assert browser.value(colour) != light
    assert browser.value(CONTRASTS) == []
    browser.value("document.getElementById('theme').click()")
    assert browser.value(colour) == light
