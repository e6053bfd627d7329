"""Delay tables: every record has a source, guesses are marked, order is physical."""

import pytest

from boresight.gateware.synthesis.delays import GRADES, NET_MODELS, Delay, delay_table, fanout_key

CORNERS = [(g, n) for g in GRADES for n in NET_MODELS]


@pytest.mark.parametrize(("grade", "nets"), CORNERS)
def test_every_record_is_complete(grade, nets):
    table = delay_table(grade=grade, nets=nets)
    assert len(table) > 70
    for name, delay in table.items():
        assert 0 <= delay.ns < 5, name
        assert len(delay.source) > 20, name
        assert delay.guessed == ("guess" in delay.source), name


def test_same_names_in_all_tables():
    assert len({tuple(delay_table(grade=g, nets=n)) for g, n in CORNERS}) == 1


def test_all_dsp_delays_of_grade_2_are_guesses():
    table = delay_table(grade=2, nets="median")
    assert all(table[name].guessed for name in table if name.startswith("dsp_"))


def test_what_is_not_guessed_of_the_dsp_of_grade_3():
    table = delay_table(grade=3, nets="median")
    seen = {name for name in table if name.startswith("dsp_") and not table[name].guessed}
    assert seen == {"dsp_su_b0", "dsp_su_c", "dsp_ab_p", "dsp_pcin_p"}


@pytest.mark.parametrize(
    ("grade", "name", "guessed"),
    [
        (2, "ramb_clk_do", False),
        (3, "ramb_clk_do", True),
        (2, "carry_s0_o0", True),
        (2, "carry_s0_co", False),
        (3, "carry_s3_co", True),
        (2, "clock_uncertainty", True),
        (2, "ff_clk_q", False),
        (2, "lut", False),
        (3, "bufg_period", True),
    ],
)
def test_guess_marks(grade, name, guessed):
    assert delay_table(grade=grade, nets="median")[name].guessed is guessed


def test_observed_sums_come_out():
    """Differences of observed constants add up to them again: LUT to carry-out, LUT to D."""
    for grade, topcy, tas in (
        (2, (0.495, 0.483, 0.351, 0.343), 0.373),
        (3, (0.395, 0.375, 0.295), 0.341),
    ):
        table = delay_table(grade=grade, nets="median")
        for k, observed in enumerate(topcy):
            assert table.total(("lut", f"carry_s{k}_co")) == pytest.approx(observed, abs=1e-9)
        assert table.total(("lut", "ff_d_lut")) == pytest.approx(tas, abs=1e-9)


def test_grade_3_is_faster_in_nets_and_blocks():
    two, three = (delay_table(grade=g, nets="p75") for g in GRADES)
    for name in two:
        if name.startswith(("net_", "dsp_", "ramb_", "bufg")):
            assert three[name].ns <= two[name].ns, name


@pytest.mark.parametrize("nets", NET_MODELS)
def test_more_loads_never_make_a_net_faster(nets):
    table = delay_table(grade=2, nets=nets)
    times = [table[fanout_key(n)].ns for n in range(1, 40)]
    assert times == sorted(times)


def test_p75_is_slower_than_median():
    median, p75 = (delay_table(grade=2, nets=n) for n in NET_MODELS)
    assert all(median[fanout_key(n)].ns < p75[fanout_key(n)].ns for n in range(1, 40))


@pytest.mark.parametrize(
    ("fanout", "key"),
    [
        (1, "net_1"),
        (2, "net_2_3"),
        (3, "net_2_3"),
        (4, "net_4_8"),
        (8, "net_4_8"),
        (9, "net_9_20"),
        (20, "net_9_20"),
        (21, "net_21_up"),
        (5000, "net_21_up"),
    ],
)
def test_fanout_classes(fanout, key):
    assert fanout_key(fanout) == key


def test_net_statistics():
    table = delay_table(grade=2, nets="median")
    keys = ("net_1", "net_2_3", "net_4_8", "net_9_20", "net_21_up")
    assert [table[k].ns for k in keys] == [0.553, 0.855, 0.897, 1.10, 1.42]
    assert delay_table(grade=3, nets="median")["net_1"].ns == pytest.approx(0.553 * 0.88, abs=1e-3)


def test_replaced():
    table = delay_table(grade=2, nets="median")
    other = table.replaced(lut=Delay(1.0, "what if"))
    assert (other["lut"].ns, table["lut"].ns, other.grade, other.nets) == (1.0, 0.259, 2, "median")
    with pytest.raises(ValueError, match=r"^delay name must be one of the table's, not 'lutt'$"):
        table.replaced(lutt=Delay(1.0, "typo"))


def test_messages():
    with pytest.raises(ValueError, match=r"^grade must be 2 or 3, not 4$"):
        delay_table(grade=4, nets="median")
    with pytest.raises(ValueError, match=r"^nets must be 'median' or 'p75', not 'p90'$"):
        delay_table(grade=2, nets="p90")
    with pytest.raises(ValueError, match=r"^fanout must be at least 1, not 0$"):
        fanout_key(0)
