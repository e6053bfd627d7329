"""A module with a seeded fault."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType


def faulty_module(module: ModuleType, old: str, new: str) -> ModuleType:
    """Return the module with one place of its text changed."""
    assert module.__file__
    text = Path(module.__file__).read_text()
    assert text.count(old) == 1, f"{old!r} is there {text.count(old)} times"
    name = f"{module.__name__}_faulty"
    spec = importlib.util.spec_from_loader(name, loader=None, origin=module.__file__)
    assert spec
    faulty = importlib.util.module_from_spec(spec)
    sys.modules[name] = faulty
    exec(compile(text.replace(old, new), module.__file__, "exec"), faulty.__dict__)
    return faulty
