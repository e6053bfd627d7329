"""The declaration of the system: one map, the places of the hardware, and every written form."""

import json
import re
import subprocess

import pytest

from boresight.gateware.attitude.system.attitude_frame import OUTPUTS, Attitude
from boresight.gateware.attitude.system.interface import (
    FRAME_FLAGS,
    HEADER,
    IDENTIFICATION,
    Place,
    system_map,
    system_registers,
)
from boresight.gateware.attitude.system.programs import system_core
from boresight.gateware.attitude.system.system_bus import COUNTERS, CSR, RESULTS
from boresight.gateware.core import Core
from boresight.gateware.description import Description
from boresight.gateware.registers.model import Access
from boresight.gateware.texts.core import c_header

FILTERS = ("complementary", "ekf_quaternion")
EVENTS = ("sample", "restart")


@pytest.fixture(scope="module")
def core() -> Core:
    return system_core(FILTERS)


@pytest.fixture(scope="module")
def whole(core: Core) -> Description:
    registers = system_registers(
        filters=FILTERS,
        clock_hz=100e6,
        build=0xFEDC_BA98_7654_3210,
        inertial_flags={"running": "it runs", "alarm": "it has an alarm"},
        compass_flags={"stale": "old"},
    )
    return system_map(core, registers=registers, events=EVENTS)


def test_places_are_those_of_the_hardware(whole: Description) -> None:
    assert whole.find("result_header").address == RESULTS + Place.HEADER
    assert whole.find("result_stamp").address == RESULTS + Place.STAMP
    assert [whole.find(f"result_{n}").address for n in OUTPUTS] == [
        RESULTS + Place.OUTPUTS + k for k in range(8)
    ]
    assert whole.find("input_dt").address == RESULTS + Place.INPUTS
    assert [whole.find(f"count_{n}").address for n in (*EVENTS, "bad_address")] == [
        COUNTERS,
        COUNTERS + 1,
        COUNTERS + 2,
    ]


def test_bits_of_the_header() -> None:
    """Those of the results, those that a frame has besides; none twice."""
    bits = {field.name: (field.bit, field.width) for field in (*HEADER, *FRAME_FLAGS)}
    assert bits == {
        **{"number": (0, 16), "filter": (16, 3), "field_used": (19, 1), "field_counts": (20, 1)},
        **{"restart": (21, 1), "saturated": (22, 1), "inertial_fault": (24, 1)},
        **{"inertial_alarm": (25, 1), "over_range": (26, 1), "overrun": (27, 1)},
        **{"compass_stale": (28, 1), "compass_fault": (29, 1)},
    }
    flags = Attitude(number=1, flags=0xFFFD, heading=0, pitch=0, roll=0, status=None, stamp=0)
    assert flags.filter == 5
    assert flags.flag_names == tuple(name for name in bits if name not in ("number", "filter"))


def test_no_address_and_no_name_twice(whole: Description) -> None:
    for key in ("address", "name"):
        values = [getattr(r, key) for r in whole.registers]
        assert len(values) == len(set(values)), key
    assert len(whole.identifiers) == len(whole.registers)


def test_formats_and_constants(whole: Description) -> None:
    assert whole.find("result_pitch").frac == 31
    assert whole.find("result_qw").frac is None  # not the same in both
    assert "29 (complementary), 31 (ekf_quaternion)" in whole.find("result_qw").meaning
    assert whole.find("input_gx").frac == 25
    assert (whole.find("result_status").unit, whole.find("result_pitch").unit) == ("bits", "ht")
    assert whole.find("identification").reset == IDENTIFICATION
    assert IDENTIFICATION.to_bytes(4, "big") == b"BORE"
    assert (whole.find("system_build_low").reset, whole.find("system_build_high").reset) == (
        0x7654_3210,
        0xFEDC_BA98,
    )
    assert whole.find("filter").names == FILTERS and whole.find("filter").width == 1
    assert whole.find("program").access is Access.READ_ONLY


#: Settings after power-up, by register.
SETTINGS = {
    "inertial_msc_ctrl": 0x0006,
    "inertial_smpl_prd": 0x0001,
    "inertial_sens_avg": 0x0402,
    "magnetic_source": 2,
    "compass_mode": 1,
    "output_mode": 1,
    "output_divider": 8,
}


@pytest.mark.parametrize("name", SETTINGS)
def test_a_setting_is_its_registers_word_after_power_up(whole: Description, name: str) -> None:
    assert whole.find(name).reset == SETTINGS[name]


def test_json(whole: Description) -> None:
    data = json.loads(whole.to_json())
    assert data["title"] == "attitude system"
    by_name = {r["name"]: r for r in data["registers"]}
    assert by_name["temperature"]["signed"] and by_name["temperature"]["width"] == 16
    assert by_name["inertial_flags"]["fields"][1] == {
        "name": "alarm",
        "bit": 1,
        "meaning": "it has an alarm",
        "clear": False,
        "width": 1,
    }
    assert [p["program"] for p in data["programs"]][:2] == list(FILTERS)


PROGRAM = r"""
#include <stdio.h>
#include "registers.h"
int main(void)
{
    uint32_t base[2048] = {0};
    base[NAME_TEMPERATURE_ADDR] = 0xfffb;
    base[NAME_RESULT_HEADER_ADDR] = 0x00050007;
    base[NAME_RESULT_PITCH_ADDR] = 0x80000000;
    printf("%ld %lu %lu %ld %ld %ld %ld %d\n",
        (long)name_reg_field_signed(name_reg_read(base, NAME_TEMPERATURE_ADDR), 0,
                                    NAME_TEMPERATURE_WIDTH),
        (unsigned long)name_reg_field(base[NAME_RESULT_HEADER_ADDR], NAME_RESULT_HEADER_FILTER_LSB,
                                      NAME_RESULT_HEADER_FILTER_WIDTH),
        (unsigned long)(base[NAME_RESULT_HEADER_ADDR] & NAME_RESULT_HEADER_NUMBER),
        (long)name_reg_read_signed(base, NAME_RESULT_PITCH_ADDR),
        (long)name_reg_field_signed(0x80000000, 0, 32), (long)name_reg_field_signed(0x7fff, 0, 16),
        (long)name_reg_field_signed(0x8000, 0, 16), NAME_RESULT_PITCH_FRAC);
    return 0;
}
"""


def test_header(whole: Description, tmp_path) -> None:
    text = c_header(whole)
    name = re.search(r"#ifndef (\w+)_REGISTERS_H", text)[1]
    (tmp_path / "registers.h").write_text(text)
    (tmp_path / "main.c").write_text(
        PROGRAM.replace("NAME", name).replace("name_", f"{name.lower()}_")
    )
    subprocess.run(
        [
            "gcc",
            "-std=c99",
            "-Wall",
            "-Wextra",
            "-Wconversion",
            "-pedantic",
            "-Werror",
            "-fsanitize=undefined",
            "-fno-sanitize-recover",
            "main.c",
            "-o",
            "main",
        ],
        cwd=tmp_path,
        check=True,
    )
    out = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True).stdout
    assert out.split() == ["-5", "5", "7", "-2147483648", "-2147483648", "32767", "-32768", "31"]
    assert f"#define {name}_IDENTIFICATION_DEFAULT UINT32_C(0x424f5245) // after power-up" in text


def declared(**more):
    options = {"clock_hz": 1e8, "build": 0, "inertial_flags": {}, "compass_flags": {}, **more}
    return {r.name: r for r in system_registers(**{"filters": ("one", "two"), **options})}


@pytest.mark.parametrize("count", [0, 9])
def test_filters_are_checked(count: int) -> None:
    with pytest.raises(ValueError, match=rf"^filters must be 1 to 8, not {count}$"):
        declared(filters=("x",) * count)


def test_what_a_system_has_not_is_not_there() -> None:
    usual, other = declared(), declared(feed=True)
    orders = [f.name for f in usual["order"].fields]
    assert orders == ["restart_filter", "restart_inertial", "clear_counters"]
    assert [f.name for f in other["order"].fields] == [*orders, "take_feed"]
    assert (usual["order"].width, other["order"].width) == (3, 4)
    assert {n: r.address for n, r in usual.items()} == {n: r.address for n, r in other.items()}
    assert usual["identification"].address == CSR
