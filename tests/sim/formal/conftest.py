"""Shared by the tests of the proofs: broken copies of components."""

import inspect
import sys
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest


@pytest.fixture(scope="session")
def mutant() -> Callable[..., Any]:
    """``mutant(module, old, new)``: the module with one place of its text changed."""

    def make(module: ModuleType, old: str, new: str) -> SimpleNamespace:
        text = inspect.getsource(module)
        assert text.count(old) == 1, f"{module.__name__} has {text.count(old)} of {old!r}"
        # Registered by its own name, as dataclasses and annotations want it.
        name = f"{module.__name__}_mutant"
        copy = ModuleType(name)
        sys.modules[name] = copy
        exec(compile(text.replace(old, new), f"{module.__file__}", "exec"), vars(copy))
        return SimpleNamespace(**vars(copy))

    return make
