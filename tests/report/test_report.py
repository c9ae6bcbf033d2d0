"""A report is one page that holds everything, says what was found, and is readable anywhere."""

from __future__ import annotations

import io
import json
import re
import shutil
import subprocess
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest

mpl.use("Agg")

import matplotlib.pyplot as plt

import amb_design as ad
from amb_design.report.parts import Bullets, Fold, Page, Section, Text
from amb_design.report.picture import inline, picture
from amb_design.report.provenance import fingerprint
from amb_design.report.render import html, is_wide
from amb_design.report.save import page_of
from amb_design.spec.templates import template
from amb_design.words.parts import table
from cli.test_cli import FAST
from report.pages import read

MACHINE = ad.loads(template("steel").replace('"my rotor"', '"rotor <b>&amp; more"'))
PASSIVE = ad.loads(FAST)


@pytest.fixture(scope="module")
def analysis() -> ad.Analysis:
    return ad.analyse(MACHINE)


@pytest.fixture(scope="module")
def page(analysis, tmp_path_factory) -> str:
    path = tmp_path_factory.mktemp("report") / "report.html"
    ad.save_report(analysis, path, date="2031-05-17")
    return path.read_text(encoding="utf-8")


def test_page_is_well_formed_self_contained_and_accessible(page):
    reader = read(page)
    names = [tag for tag, _ in reader.tags]
    assert names.count("svg") == 10
    assert names.count("table") >= 9
    assert len(page) < 1_000_000


def test_page_says_what_the_analysis_found(analysis, page):
    text = " ".join(read(page).text)
    limit = ad.stability_limit(MACHINE)
    assert f"Stability limit: {limit.speed_rpm:.0f} rpm, certified at every speed below." in text
    assert f"Set by: {limit.mode.describe()}." in text
    for c in ad.critical_speeds(MACHINE):
        assert f"{c.speed_rpm:.1f}" in text
    strongest = max(ad.stability_gradient(MACHINE, limit.mode).items(), key=lambda g: abs(g[1] * _number(g[0])))
    first = re.search(r"What moves the stability limit most.*?<tbody>\s*<tr><td[^>]*>([^<]*)", page, re.DOTALL)
    assert first
    assert first[1] == strongest[0]
    assert "ISO 14839-3" in text
    assert "API 617" in text


def _number(path: str) -> float:
    from amb_design.spec.paths import value

    return float(value(MACHINE, path))


def test_warnings_come_first_then_the_answer(analysis, page):
    assert analysis.findings == ()
    assert 'id="warnings"' not in page
    warned = html(
        Page("t", "", "answer", None, (), ("beware <of> this",), (Section("s", (Text("x"),)),), (("Seed", "1"),))
    )
    read(warned)
    places = [warned.index(x) for x in ("beware &lt;of&gt; this", ">answer<", '<section aria-labelledby="s1"')]
    assert places == sorted(places)


def test_provenance_is_complete(page):
    text = " ".join(read(page).text)
    assert fingerprint(ad.dumps(MACHINE)) in text
    for part in ("2031-05-17", f"amb_design {ad.__version__}", f"numpy {np.__version__}", "casadi 3.", "Python 3."):
        assert part in text
    folded = re.search(r"<pre>(.*?)</pre>", page, re.DOTALL)
    assert folded
    from html import unescape

    assert ad.loads(unescape(folded[1])) == MACHINE


def test_texts_of_the_user_are_escaped(page):
    assert "rotor <b>" not in page
    assert "<h1>rotor &lt;b&gt;&amp;amp; more</h1>" in page


def test_several_machines_share_a_page():
    stiff = ad.replace(PASSIVE, {"bearings.stiffness": 5e6})
    text = html(page_of({"base": PASSIVE, "stiff": stiff}))
    reader = read(text)
    assert reader.headings.count(2) == 5  # warnings, both variants, the table of them, where it comes from
    assert "2 variants, side by side" in text
    for machine in (PASSIVE, stiff):
        assert f"{ad.stability_limit(machine).speed_rpm:.0f} rpm" in text
    assert "Calculated" not in text  # no date was given


@pytest.mark.parametrize("wrong", [3.0, {}, {"one": "two"}, None])
def test_what_is_no_result_is_refused(wrong, tmp_path):
    path = tmp_path / "report.html"
    with pytest.raises(ad.SpecError, match="result"):
        ad.save_report(wrong, path)
    assert not path.exists()


def test_pieces_serve_any_result():
    """What a page of another kind needs: tables, drawings, sentences."""
    ax = plt.figure(figsize=(4.0, 3.0)).add_subplot()
    ax.plot([0.0, 1.0], [1.0, 0.0])
    drawn = picture("curve", "A curve.", "A curve that falls from one to zero.", ax)
    rows = [["stability limit", "1000 rpm", "1200 rpm"], ["ISO 14839-3", "passes", "fails"]]
    sides = Section("Side by side", (table("Designs", "lrr", ("", "PID", "LQG"), rows, "A note."), drawn))
    inner = Section("More", (Bullets(("one", "two")), Fold("file", "a = 1\n")))
    page = html(Page("PID against LQG", "Which?", "LQG spins faster.", True, (), (), (sides, inner), ()))
    reader = read(page)
    assert 'class="r fails" data-label="LQG">fails</td>' in page
    assert reader.headings == [1, 2, 2, 2]


def svg_of(figure) -> str:
    out = io.StringIO()
    figure.savefig(out, format="svg")
    plt.close(figure)
    return out.getvalue()


def test_inlined_drawings_keep_their_shapes_and_share_no_names():
    figure, ax = plt.subplots()
    ax.plot(np.linspace(0.0, 1.0, 7), np.linspace(0.0, 1.0, 7) ** 2, "o-", gid="curve")
    ax.plot([0.0, 1.0], [0.5, 0.5], gid="curve")
    text = svg_of(figure)
    first, second = inline(text, "a"), inline(text, "b")
    ids = {name: set(re.findall(r'\bid="([^"]*)"', svg)) for name, svg in (("a", first), ("b", second))}
    assert ids["a"]
    assert not ids["a"] & ids["b"]
    used = set(re.findall(r'href="#([^"]*)"|url\(#([^)]*)\)', first))
    assert {x or y for x, y in used} == ids["a"]
    numbers = [np.array(re.findall(r"-?\d+\.?\d*", d), float) for d in re.findall(r'\sd="([^"]*)"', first)]
    exact = [np.array(re.findall(r"-?\d+\.?\d*", d), float) for d in re.findall(r'\sd="([^"]*)"', text)]
    assert len(numbers) == len(exact)
    assert max(np.abs(a - b).max() for a, b in zip(numbers, exact, strict=True)) <= 0.005 + 1e-9
    assert len(first) < 0.9 * len(text)
    assert inline(text, "a") == first


def test_wide_tables_become_cards_on_a_phone():
    narrow = table("t", "lr", ("mode", "f [Hz]"), [["first", "10"]])
    assert not is_wide(narrow)
    assert is_wide(table("t", "l" * 8, ["column"] * 8, [["entry"] * 8]))


CHROMIUM = next((p for n in ("chromium", "chromium-browser", "google-chrome") if (p := shutil.which(n))), None)

PROBE = """<!doctype html><body><script>
const page = PAGE, out = [];
async function look(width) {
  const frame = document.createElement("iframe");
  frame.style.cssText = `border: 0; width: ${width}px; height: 800px`;
  const loaded = new Promise(done => frame.onload = done);
  frame.srcdoc = page;
  document.body.append(frame);
  await loaded;
  const doc = frame.contentDocument, root = doc.documentElement;
  const outside = [...doc.querySelectorAll("h1,h2,h3,p,li,figure,svg,dl,.scroll,.verdict")]
    .filter(e => e.getBoundingClientRect().right > width + 0.5 || e.getBoundingClientRect().left < -0.5).length;
  const scrolling = [...doc.querySelectorAll(".scroll")].filter(e => e.scrollWidth > e.clientWidth + 1)
    .map(e => e.getAttribute("aria-label"));
  const empty = [...doc.querySelectorAll("svg use")].filter(e => {
    const shape = doc.getElementById(e.getAttribute("href").slice(1)), box = e.getBBox();
    return shape.getAttribute("d") && box.width + box.height == 0;  // blanks are glyphs without a shape
  }).length;
  const style = frame.contentWindow.getComputedStyle(doc.body);
  out.push({width, overflow: root.scrollWidth - root.clientWidth, outside, scrolling, empty, height: root.scrollHeight,
    colour: style.color, background: style.backgroundColor,
    fetched: frame.contentWindow.performance.getEntriesByType("resource").length});
  frame.remove();
}
(async () => { await look(380); await look(1200); document.body.textContent = JSON.stringify(out); })();
</script>"""


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine (Debian: apt-get install chromium)")
def test_page_fits_a_phone_and_a_screen(page, tmp_path):
    probe = tmp_path / "probe.html"
    literal = json.dumps(page).replace("</", "<\\/")
    probe.write_text(PROBE.replace("PAGE", literal), encoding="utf-8")
    done = browse("--virtual-time-budget=20000", "--dump-dom", probe.as_uri(), profile=tmp_path / "profile")
    found = re.search(r"\[\{.*\}\]", done)
    assert found, done[-500:]
    phone, screen = json.loads(found[0])
    for seen in (phone, screen):
        assert seen["overflow"] <= 0, seen
        assert seen["outside"] == 0
        assert seen["empty"] == 0
        assert seen["fetched"] == 0
        assert seen["background"] == "rgb(255, 255, 255)"
        assert max(map(int, re.findall(r"\d+", seen["colour"]))) < 64
    assert (phone["width"], screen["width"]) == (380, 1200)
    assert phone["scrolling"] == []  # tables too wide for it have become cards
    assert phone["height"] > screen["height"]


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine (Debian: apt-get install chromium)")
def test_page_prints(page, tmp_path):
    source, printed = tmp_path / "report.html", tmp_path / "report.pdf"
    source.write_text(page, encoding="utf-8")
    browse("--no-pdf-header-footer", f"--print-to-pdf={printed}", source.as_uri(), profile=tmp_path / "profile")
    pages = re.findall(rb"/Type\s*/Page\b", printed.read_bytes())
    assert 4 <= len(pages) <= 12


def browse(*arguments: str, profile: Path) -> str:
    """Run Chromium without a window, and without a way out."""
    options = ["--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", f"--user-data-dir={profile}"]
    command = [str(CHROMIUM), *options, "--host-resolver-rules=MAP * ~NOTFOUND", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=240).stdout
