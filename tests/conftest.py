"""Options of the test suite."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest

from tests import long_tests


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden",
        action="store_true",
        help="write the golden files in generated/ anew and compare with them",
    )
    parser.addoption(
        "--times",
        metavar="FILE",
        help="append the processor seconds of each test to FILE (tests/long_tests.py)",
    )


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark what `long_tests.txt` names as slow, before pytest deselects by marks."""
    listed = long_tests.listed()
    for item in items:
        if item.nodeid in listed:
            item.add_marker(pytest.mark.slow)
    if not any("::" in argument for argument in config.args):
        files = {item.nodeid.partition("::")[0] for item in items}
        tests = {item.nodeid.partition("[")[0] for item in items}
        lost = sorted(
            name
            for name in listed
            if name.partition("::")[0] in files and name.partition("[")[0] not in tests
        )
        if lost:
            raise pytest.UsageError(
                f"tests/long_tests.txt names {lost[0]}, which is no test: rename or delete its line there"
            )


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[bool]:
    start = long_tests.processor_time()
    done = yield
    if path := item.config.getoption("--times"):
        long_tests.note(path, item.nodeid, long_tests.processor_time() - start)
    return done


def pytest_configure(config: pytest.Config) -> None:
    # A shell starts its background jobs with Ctrl-C ignored, and what they start inherits that; tests send it.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
