"""Records in pieces: the same inputs as of one record, held and flagged over the borders."""

from typing import Any

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.levels.stream import fed
from boresight.sim.records.feed import feed
from boresight.sim.records.record import Column, Record

NAN = float("nan")


class Held(Estimator):
    """Sums, forgetting half."""

    inputs = (
        Input("a", -4.0, 4.0, "m", missing="hold"),
        Input("b", -4.0, 4.0, "m", clamp=True),
        Input("new", 0.0, 1.0, "", valid_of="a"),
        Input("c", -4.0, 4.0, "m", missing=0.5),
    )
    states = (State("sum", -64.0, 64.0),)
    outputs = (Output("total", "m"),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        total = 0.5 * x.sum + u.new * u.a + u.b + u.c
        return {"sum": total}, {"total": total}


COLUMNS = {
    "a": np.array([1.0, NAN, 2.0, NAN, NAN, NAN, 3.0, NAN]),
    "b": np.array([0.1, 0.2, 9.0, 0.4, 0.5, 0.6, 0.7, 0.8]),
    "c": np.array([NAN, 0.0, 0.0, NAN, NAN, 1.0, 2.0, 3.0]),
    "total_true": np.arange(8.0),
}


def pieces(*borders: int) -> list[dict[str, np.ndarray]]:
    cuts = zip((0, *borders), (*borders, 8), strict=True)
    return [{n: v[a:b] for n, v in COLUMNS.items()} for a, b in cuts]


@pytest.mark.parametrize("borders", [(), (1,), (3, 4), (1, 2, 3, 4, 5, 6, 7)])
def test_pieces_are_as_one_record(borders: tuple[int, ...]) -> None:
    whole = feed(Held(), Record("whole", {n: Column(v) for n, v in COLUMNS.items()})).inputs
    found = list(fed(Held(), pieces(*borders)))
    assert [len(f) for f in found] == [len(p["a"]) for p in pieces(*borders)]
    np.testing.assert_array_equal(np.concatenate(found), whole)
    for name in ("c", "float"):
        level = make_level(name, Build(Held()))
        parts = [level.run(f).outputs["total"] for f in found]
        again = level.run_anew(whole).outputs["total"]
        np.testing.assert_array_equal(np.concatenate(parts), again)


def test_a_wrong_piece_is_named() -> None:
    wrong = pieces(3)
    wrong[1]["c"] = np.array([0.0, 5.0, 0.0, 0.0, 0.0])
    with pytest.raises(InputError, match=r"^stream, piece 1, c\[1\]: wanted -4 to 4 m, the decl"):
        list(fed(Held(), wrong))
    with pytest.raises(InputError, match=r"^log, piece 0, a\[0\]: wanted a number in the first"):
        list(fed(Held(), pieces(1)[1:], "log"))
    with pytest.raises(InputError, match="wanted a column c"):
        list(fed(Held(), [{n: v for n, v in COLUMNS.items() if n != "c"}]))
