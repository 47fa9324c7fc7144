"""What every test shares: reproducible property tests, and the record of validating ones."""

from pathlib import Path

import pytest
from hypothesis import settings

from tools.pages.validation import Comparison, read_comparisons, write_comparisons

settings.register_profile("reproducible", derandomize=True, deadline=None, database=None)
settings.load_profile("reproducible")

COMPARED = pytest.StashKey[list[Comparison]]()


def pytest_addoption(parser):
    parser.addoption(
        "--record", type=Path, metavar="FILE", help="write all that tests compare to a JSON file"
    )


def pytest_configure(config):
    config.stash[COMPARED] = []


def pytest_collection_modifyitems(config, items):
    """Recording needs only the tests that compare."""
    if config.option.record:
        others = [item for item in items if "compare" not in getattr(item, "fixturenames", ())]
        config.hook.pytest_deselected(items=others)
        items[:] = [item for item in items if "compare" in getattr(item, "fixturenames", ())]


def pytest_sessionfinish(session):
    """Pages whose tests cannot run here, such as those of an engine, keep what they have."""
    record = session.config.option.record
    if record:
        rows = session.config.stash[COMPARED]
        pages = {row.page for row in rows}
        stored = read_comparisons(record) if record.exists() else ()
        write_comparisons([*rows, *(row for row in stored if row.page not in pages)], record)


@pytest.fixture
def compare(request):
    """Assert that a measured value is what it should be, and keep both for docs/validation."""

    def comparing(**row):
        numbers = {name: float(row.pop(name)) for name in ("expected", "measured", "tolerance")}
        comparison = Comparison(**row, **numbers)
        request.config.stash[COMPARED].append(comparison)
        assert comparison.is_met, str(comparison)

    return comparing
