"""`model.errors`: one line, whatever went in."""

import pytest

from boresight.model.errors import InputError, require, require_choice

pytestmark = pytest.mark.pythons


def test_is_a_value_error() -> None:
    with pytest.raises(ValueError, match=r"^no good$"):
        raise InputError("no good")


def test_message_is_one_line() -> None:
    assert str(InputError("two\n  lines\tand a tab ")) == "two lines and a tab"


def test_at_names_place_wish_finding_and_remedy() -> None:
    error = InputError.at("a.csv, line 3", wanted="a number", found="'x'", fix="correct it")
    assert isinstance(error, InputError)
    assert str(error) == "a.csv, line 3: wanted a number, found 'x'; correct it"


def test_require() -> None:
    require(True, "a", "nothing", 1)
    with pytest.raises(InputError, match=r"^a: wanted 2 or more, found '1'; correct it$"):
        require(False, "a", "2 or more", "1")
    with pytest.raises(InputError, match=r"found 1; write 2$"):
        require(False, "a", "2", 1, "write 2")


def test_choices() -> None:
    require_choice("on", "c", ("fixed", "c"))
    with pytest.raises(InputError, match="^on: wanted one of fixed, c, found 'C'; choose one of"):
        require_choice("on", "C", iter(("fixed", "c")))


def test_an_unknown_place_is_left_out() -> None:
    assert str(InputError.at("", wanted="a", found="b", fix="c")) == "wanted a, found b; c"
