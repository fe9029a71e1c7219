"""Links and names in the documents exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from palmares.gym.ids import names

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings."""
    heads = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target, anchor in re.findall(r"\]\((?!https?:)([^)#\s]*)#?([^)\s]*)\)", page.read_text()):
        led_to = page.parent / target if target else page
        assert led_to.exists(), target
        if anchor and led_to.suffix == ".md":
            assert anchor in anchors(led_to), f"{target}#{anchor}"


def test_the_guide_names_every_id_of_gymnasium() -> None:
    text = (ROOT / "docs/python.md").read_text()
    (tasks, hands), *_ = re.findall(r"`palmares/\{(.*?)\}-\{(.*?)\}-v1`", text)
    listed = {f"palmares/{task}-{hand}-v1" for task in tasks.split(",") for hand in hands.split(",")}
    assert listed == set(names())


def test_no_document_runs_an_example_by_a_path_of_the_sources() -> None:
    for page in PAGES:
        assert "python client-py/src" not in page.read_text(), page
