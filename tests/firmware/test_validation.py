"""The proof of emitted C accepts what the emitter writes and refuses what computes other words."""

import random
import re
from dataclasses import replace

import pytest

from boresight.firmware.emit import emit_c
from boresight.firmware.validation import validate_c
from boresight.model.attitude.front import FRONT
from boresight.model.words.program import Program
from boresight.model.words.terms import Refuted
from tests.support.estimators import ALL
from tests.support.random_program import random_program, with_ranges


@pytest.mark.parametrize("name", {**ALL, **FRONT})
def test_shipped_programs(name: str) -> None:
    program = {**ALL, **FRONT}[name]().compile()
    assert validate_c(program, emit_c(program)) == len(program.ops)


@pytest.mark.parametrize("word", [18, 23, 32])
@pytest.mark.parametrize("seed", range(8))
def test_random_programs(seed: int, word: int) -> None:
    program = random_program(seed, word=word, n_ops=30)
    assert validate_c(program, emit_c(program))


def test_a_table_that_is_named_and_not_read() -> None:
    """No text has it: an operation without a coefficient reads none (found by a long campaign)."""
    program = random_program(3, n_ops=1)
    (op,) = program.ops
    terms = tuple(replace(t, b=t.a, coefficient=None) for t in op.terms)
    program = replace(program, ops=(replace(op, terms=terms, table=1, index=op.terms[0].a),))
    texts = emit_c(program)
    assert "TABLE" not in texts[f"{program.name}.c"]
    assert validate_c(program, texts) == len(program.ops)


# Seeded faults: one token of the text, outside comments.

NUMBER = re.compile(r"(?<![\w.])\d+(?=u?\b)")
LOCAL = re.compile(r"\bv\d+_\w+")
PLACES = {"+=": "-=", "-=": "+=", "& flag": "& ~flag", "& ~flag": "& flag", "n >> 1": "n & ~1u"}
HELPERS = {"sign_mask(": "sign_mask_quarter(", "segment_index(": "segment_index_quarter("}
RESULTS = {
    "saturate(acc, &saturated)": "clip(acc)",
    "overflow(acc, &beyond)": "wrap(acc)",
    "clip(acc)": "wrap(acc)",
    "wrap(acc)": "clip(acc)",
}


def faulty(text: str, rng: random.Random) -> str:
    """The text with one number, operator, variable, function or line changed."""
    lines = text.split("\n")
    first = next(k for k, line in enumerate(lines) if "_init(" in line and line.endswith("{"))
    while True:
        k = rng.choice([*range(first, len(lines)), *range(first)])
        code, slashes, note = lines[k].partition(" //")
        for change in rng.sample((number, exchanged, variable, dropped), 4):
            changed = change(code, text, rng)
            if changed != code:
                return "\n".join([*lines[:k], changed + slashes + note, *lines[k + 1 :]])


def number(code: str, text: str, rng: random.Random) -> str:
    numbers = list(NUMBER.finditer(code))
    if not numbers or code.startswith(("#", "/", " *")):
        return code
    match = rng.choice(numbers)
    return f"{code[: match.start()]}{int(match[0]) ^ 1 << rng.randrange(4)}{code[match.end() :]}"


def exchanged(code: str, text: str, rng: random.Random) -> str:
    for before, after in rng.sample(
        [*(PLACES | HELPERS | RESULTS).items()], len(PLACES | HELPERS | RESULTS)
    ):
        if before in code:
            return code.replace(before, after, 1)
    return code


def variable(code: str, text: str, rng: random.Random) -> str:
    """Another variable that is defined before the line."""
    match = next(iter(LOCAL.finditer(code.partition(" = ")[2])), None)
    names = sorted(set(LOCAL.findall(text.partition(code)[0]))) if match else []
    return code.replace(match[0], rng.choice(names), 1) if match and names else code


def dropped(code: str, text: str, rng: random.Random) -> str:
    return "" if re.match(r"    (acc|out|self)\W.*=", code) else code


def named(program: Program) -> Program:
    return replace(program, name="filter")


def test_faults(seeds: int = 60) -> None:
    for seed in range(seeds):
        rng = random.Random(seed)
        program = named(with_ranges(random_program(seed % 10, n_ops=20, n_states=3), seed))
        texts = emit_c(program)
        text = faulty(texts["filter.c"], rng)
        with pytest.raises(Refuted):
            validate_c(program, texts | {"filter.c": text})


def test_a_segment_that_no_word_selects() -> None:
    program = named(random_program(0))
    texts = emit_c(program)
    text = re.sub(r"segment_index\w*\(\w+\)", "3u", texts["filter.c"], count=1)
    with pytest.raises(Refuted, match=r"^filter\.c cannot be read back: 3$"):
        validate_c(program, texts | {"filter.c": text})


def test_members_in_another_order() -> None:
    program = named(random_program(4, n_inputs=3))
    texts = emit_c(program)
    lines = texts["filter.h"].split("\n")
    k = next(k for k, line in enumerate(lines) if "Inputs of one update" in line) + 2
    lines[k], lines[k + 1] = lines[k + 1], lines[k]
    with pytest.raises(Refuted, match=r"^filter\.c: "):
        validate_c(program, texts | {"filter.h": "\n".join(lines)})


def test_types_and_numbers_of_macros() -> None:
    """Each declaration with another type, and each macro with another number, is refused."""
    program = named(random_program(1, n_ops=12, n_states=2))
    texts, tried = emit_c(program), 0
    for file, text in texts.items():
        lines = text.split("\n")
        update = next((k for k, x in enumerate(lines) if x.startswith("void filter_init")), 0)
        for k, line in enumerate(lines):
            wrong = re.sub(r"^(    )(const )?(u?int\d+_t|bool)\b", r"\1\2int64_t", line)
            if file == "filter.h" or not line.startswith("    "):
                wrong = re.sub(r"^(#define \w+ \(?-?)(\d+)", r"\g<1>1\2", wrong)
            if wrong == line or (update > k and line.startswith("    ")):
                continue
            tried += 1
            with pytest.raises(Refuted):
                changed = "\n".join([*lines[:k], wrong, *lines[k + 1 :]])
                validate_c(program, texts | {file: changed})
    assert tried > 40
