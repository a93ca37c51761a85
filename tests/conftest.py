"""What the tests of several folders share."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
from hypothesis import settings

from tests.service.chromium import Page, browsing, find_chromium

# The first example of a test may compile kernels; and a run that fails must fail again.
settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """A browser."""
    chromium = find_chromium()
    if chromium is None and os.environ.get("GAZETRACE_REQUIRE_BROWSER") != "1":
        pytest.skip("no Chromium here")
    assert chromium is not None, "GAZETRACE_REQUIRE_BROWSER is set, and there is no Chromium"
    with browsing(chromium, tmp_path_factory.mktemp("profile")) as page:
        yield page


@pytest.fixture
def page(browser: Page) -> Iterator[Page]:
    """A browser with nothing open, and nothing kept from before."""
    yield browser
    browser.leave()
