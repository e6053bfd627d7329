"""`boresight bench`: what is compared, and with what."""

from __future__ import annotations

import importlib
import json

import numpy as np
import pytest

from boresight.cli import main

#: The function has the module's name.
module = importlib.import_module("boresight.verbs.figures.bench")


def test_bench_compares(capsys):
    data = module.bench(updates=4000, runs=400)
    assert data.updates_compared == 4000 and data.mismatches == 0
    capsys.readouterr()


def test_a_clock_that_ticks_slowly_ends_no_measurement(monkeypatch) -> None:
    monkeypatch.setattr(module.time, "process_time", lambda: 3.0)
    assert module.bench("complementary", updates=40, runs=4).mismatches == 0


@pytest.mark.parametrize("word", [18, 32])
def test_random_words_are_small_extreme_and_all_else(word: int) -> None:
    words = module.random_inputs(4000, 3, word, np.random.default_rng(1))
    limit = 1 << (word - 1)
    assert words.shape == (4000, 3) and words.min() == -limit and words.max() == limit - 1
    extreme = np.isin(words, (-limit, limit - 1)).mean()
    small = (np.abs(words) < limit >> 6).mean()
    assert 0.2 < extreme < 0.3 and 0.1 < small < 0.3


@pytest.mark.parametrize(("mismatches", "code"), [(0, 0), (1, 1)])
def test_one_update_that_differs_is_no_success(mismatches, code, monkeypatch, capsys) -> None:
    asked = []

    def bench(name: str, *, updates: int = 0, progress: object) -> module.BenchResult:
        asked.append((name, updates))
        return module.BenchResult(name, 1234567, mismatches, 1, 1, 1.0, 1.0, "made up")

    monkeypatch.setattr(module, "bench", bench)
    assert main(["bench", "--updates", "7", "-q"]) == code
    assert asked == [(name, 7) for name in module.FILTERS]
    assert "updates_compared             1,234,567\n" in capsys.readouterr().out
    assert main(["bench", "mekf", "--json"]) == code
    data = json.loads(capsys.readouterr().out)
    assert [row["estimator"] for row in data["results"]] == ["mekf"]
