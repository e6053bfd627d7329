"""Shared by the tests of `model`."""

from __future__ import annotations

import pytest

from tests.support.traced import Traced


@pytest.fixture(scope="session")
def trace() -> type[Traced]:
    """The class `Traced`."""
    return Traced
