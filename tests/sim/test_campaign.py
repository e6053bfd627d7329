"""The journal: what was added is there, half a line is not, another's file is left alone."""

import pytest

from boresight.model.errors import InputError
from boresight.sim.campaign import Journal


def test_goes_on(tmp_path) -> None:
    path = tmp_path / "new" / "j"
    Journal(path, {"a": 1})
    assert not path.parent.exists(), "nothing before the first draw"
    Journal(path, {"a": 1}).add([{"seed": 3, "x": 0.1}, {"seed": 4, "x": 1 / 3}])
    again = Journal(path, {"a": 1})
    assert again.done == {3: {"seed": 3, "x": 0.1}, 4: {"seed": 4, "x": 1 / 3}}
    path.write_text(path.read_text() + '{"seed": 5')
    assert set(Journal(path, {"a": 1}).done) == {3, 4}
    assert path.read_text().endswith("}\n")


@pytest.mark.parametrize("text", ["something\n", "no end", '{"boresight montecarlo": {"a": 2}}\n'])
def test_of_another(tmp_path, text) -> None:
    path = tmp_path / "j"
    path.write_text(text)
    with pytest.raises(InputError, match="wanted the journal of this campaign"):
        Journal(path, {"a": 1})
    assert path.read_text() == text


def test_cannot_be_read(tmp_path) -> None:
    with pytest.raises(InputError, match="wanted a journal that can be read and written"):
        Journal(tmp_path, {"a": 1})
    path = tmp_path / "j"
    Journal(path, {"a": 1}).add([])
    path.write_text(path.read_text() + "broken\n")
    with pytest.raises(InputError, match="wanted a journal that can be read and written"):
        Journal(path, {"a": 1})
