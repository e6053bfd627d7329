"""``filter.h``; test_image.py and tests/firmware/test_sanitizers.py compile it."""

import re

import pytest

from boresight.firmware.attitude.filter import filter_header


def defined(text: str) -> dict[str, str]:
    return dict(re.findall(r"(?m)^#define (\w+)(?: (\w+).*)?$", text))


@pytest.mark.parametrize(("single", "kind"), [(False, "1"), (True, "2")])
def test_one_name_for_every_estimator(single: bool, kind: str) -> None:
    text = filter_header("mekf", single=single, number=3)
    assert defined(text) == {
        "FILTER_H": "",
        "FILTER_KIND": kind,
        "FILTER_NUMBER": "3u",
        "FILTER_INPUTS": "MEKF_INPUTS",
        "FILTER_OUTPUTS": "MEKF_OUTPUTS",
        **{f"filter_{verb}": f"mekf_{verb}" for verb in ("init", "reset", "update")},
    }
    assert '#include "mekf.h"\n' in text
    assert re.findall(r"typedef (\w+) (\w+);", text) == [
        (f"mekf{part}_t", f"filter{part}_t") for part in ("", "_in", "_out")
    ]


def test_an_image_without_estimator() -> None:
    text = filter_header(None)
    assert defined(text) == {"FILTER_H": "", "FILTER_KIND": "0"}
    assert "#include" not in text and "typedef" not in text
