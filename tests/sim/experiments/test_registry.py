"""Experiments by name, by class, and in a file of one's own."""

import pytest

from boresight.model.errors import InputError
from boresight.sim.experiments.ma2014.experiment import Ma2014
from boresight.sim.experiments.registry import experiment_of
from boresight.systems.array.experiment import Array
from boresight.systems.mls.experiment import Mls
from boresight.systems.radar.experiment import Radar
from boresight.systems.satcom.experiment import Satcom


def test_ours_by_name_class_and_object():
    for kind in (Array, Ma2014, Mls, Radar, Satcom):
        assert type(experiment_of(kind.name)) is kind
    one = experiment_of("ma2014")
    assert isinstance(one, Ma2014) and experiment_of(one) is one
    assert isinstance(experiment_of(Ma2014), Ma2014)


def test_in_a_file(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(
        "from boresight import Experiment\n\n\nclass Mine(Experiment):\n"
        "    def __init__(self, sites=1):\n        self.sites = sites\n"
    )
    found = experiment_of(f"{path}:Mine(sites=3)")
    assert (found.name, found.sites) == ("mine", 3)


def test_unknown():
    with pytest.raises(
        InputError,
        match="^experiment: wanted one of array, ma2014, mls, radar, satcom, or file.py:Class",
    ):
        experiment_of("ma2015")
