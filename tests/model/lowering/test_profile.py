"""Profiles: what file and record they come from, and when they are refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from boresight.model.errors import InputError
from boresight.model.lowering.profile import Profile, read_profile, record_digest
from boresight.model.resolve import estimator_of, profile_place
from boresight.model.settings import using
from tests.support.track import Track

SOURCE = """
from boresight import Estimator, Input, Output, State


class Sum(Estimator):
    inputs = (Input("u", -1.0, 1.0),)
    states = (State("x", -8.0, 8.0),)
    outputs = (Output("x"), Output("power"))

    def step(self, x, u, p):
        power = u.u * u.u
        new = x.x + 0.25 * power
        return {"x": new}, {"x": new, "power": power}
"""


def written(path: Path, profile: Profile) -> Path:
    rows = [{"number": n, "chosen": r} for n, r in profile.ranges.items()]
    data = {
        "estimator": profile.estimator,
        "record": profile.record,
        "made_from": [{"log": name} for name in profile.logs],
        "values": rows,
        "limits": [],
    }
    path.write_text(json.dumps(data))
    return path


@pytest.fixture
def track() -> Profile:
    return Profile(
        "track", record_digest(Track().trace(), Track.inputs), ("log",), {9: (-1.0, 2.0)}
    )


def test_what_is_read_is_what_was_written(track: Profile, tmp_path: Path) -> None:
    file = written(tmp_path / "track.fit.json", track)
    assert read_profile(file) == replace(track, logs=["log"], place=str(file))
    assert track.source == "observed in log"


@pytest.mark.parametrize(
    "text",
    [
        "no JSON",
        "[]",
        '{"estimator": "track"}',
        '{"estimator": "e", "record": "", "made_from": [], "limits": [], '
        '"values": [{"number": 1, "chosen": [2.0, 1.0]}]}',
        '{"estimator": "e", "record": "", "made_from": [], "limits": [], '
        '"values": [{"number": 1, "chosen": [0.0, Infinity]}]}',
        '{"estimator": "e", "record": "", "made_from": [], "limits": [], '
        f'"values": [{{"number": 1, "chosen": [-1{"0" * 400}, 1]}}]}}',
        '{"estimator": "e", "estimator": "f", "record": "", "made_from": [], "limits": [], '
        '"values": []}',
    ],
)
def test_another_file_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "f.json").write_text(text)
    with pytest.raises(InputError, match=r"f\.json: wanted a profile, found another"):
        read_profile(tmp_path / "f.json")


def test_no_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="wanted a profile, found no such file"):
        read_profile(tmp_path / "none.json")


def changed(**attributes: Any) -> Track:
    other = Track()
    for name, value in attributes.items():
        setattr(other, name, value)
    return other


@pytest.mark.parametrize(
    "other",
    [
        changed(states=(replace(Track.states[0], high=256.0), Track.states[1])),
        changed(states=(replace(Track.states[0], initial=4.0), Track.states[1])),
        changed(params=(replace(Track.params[0], default=0.3),)),
        changed(inputs=(replace(Track.inputs[0], high=0.2), *Track.inputs[1:])),
        changed(
            step=lambda x, u, p: ({"pos": u.z, "vel": u.w}, {n.name: 1.0 for n in Track.outputs})
        ),
    ],
)
def test_of_other_declarations_or_another_step_it_is_stale(track: Profile, other: Track) -> None:
    other.profile = track
    with pytest.raises(InputError, match="wanted a profile of track as it is now"):
        other.compile()


def test_of_another_estimator_it_is_refused(track: Profile) -> None:
    with pytest.raises(
        InputError, match="wanted a profile of other as it is now, found one of track"
    ):
        track.check(Track().trace(), "other", Track.inputs)


@pytest.mark.parametrize(
    "what, name, place",
    [
        ("a/sum.py", "sum", "a/sum.fit.json"),
        ("sum.py:Sum(n=2)", "sum", "sum.fit.json"),
        ("b.py:Sum", "sum", "b.sum.fit.json"),
    ],
)
def test_it_stands_beside_the_file(what: str, name: str, place: str) -> None:
    assert profile_place(what, name) == Path(place)


@pytest.mark.parametrize("what", ["mekf", Track, Track()])
def test_what_has_no_file_of_its_own_has_no_such_place(what: Any) -> None:
    assert profile_place(what, "mekf") is None


def test_it_is_found_there_chosen_or_left_out(tmp_path: Path) -> None:
    file = tmp_path / "sum.py"
    file.write_text(SOURCE)
    plain = estimator_of(str(file))
    assert plain.profile is None
    mul = next(e.number for e in plain.trace().needed if e.kind == "mul")
    own = Profile("sum", record_digest(plain.trace(), plain.inputs), ("log",), {mul: (0.0, 0.01)})
    beside = written(tmp_path / "sum.fit.json", own)
    other = written(tmp_path / "other.json", replace(own, logs=("other",)))
    assert getattr(estimator_of(str(file)).profile, "place", None) == str(beside)
    with using(profiles=(str(other),)):
        assert getattr(estimator_of(str(file)).profile, "place", None) == str(other)
        with using(profiles=()):
            assert estimator_of(str(file)).profile is None
        with pytest.raises(InputError, match="wanted a profile of mekf, found 'sum'"):
            estimator_of("mekf")
    assert estimator_of(str(file)).compile().digest != plain.compile().digest
