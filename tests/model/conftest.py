"""Shared by the tests of `model`."""

import pytest

from tests.support.traced import Traced


@pytest.fixture(scope="session")
def trace() -> type[Traced]:
    """The class `Traced`."""
    return Traced
