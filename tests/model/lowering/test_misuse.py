"""What a recorded value refuses: each method, with the line and a cure."""

from __future__ import annotations

from typing import Any

import pytest

from boresight.model.errors import InputError
from boresight.model.lowering.trace import NO_CONDITION, NO_NUMBER, Condition, Scalar, Tracer

pytestmark = pytest.mark.pythons


@pytest.mark.parametrize("kind, table", [(Scalar, NO_NUMBER), (Condition, NO_CONDITION)])
def test_every_method_of_a_table_is_refused(kind: Any, table: Any) -> None:
    x = Tracer("unit").leaf("input", "x", 0.0, 1.0)
    value = x if kind is Scalar else x < 0.5
    assert type(value) is kind
    for methods, (entry, cure) in table.items():
        for method in methods.split():
            with pytest.raises(InputError) as raised:
                getattr(kind, f"__{method}__")(value, *([1.0] if method != "bool" else []))
            said = str(raised.value)
            assert said.startswith("test_misuse.py, line ")
            assert said.endswith(f"; {cure}") and entry.split()[-1] in said
