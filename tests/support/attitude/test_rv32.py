"""The words of the assembler, against a table of known encodings."""

import pytest

from tests.support.attitude.rv32 import assemble


@pytest.mark.parametrize(
    ("text", "words"),
    [
        # As riscv64-unknown-elf-as 2.40 encodes them.
        ("li x5 0x12345FFF", [0x123462B7, 0xFFF28293]),
        ("lw x2 8(x1)", [0x0080A103]),
        ("lbu x2 -1(x1)", [0xFFF0C103]),
        ("sw x2 -4(x1)", [0xFE20AE23]),
        ("sh x2 64(x31)", [0x042F9023]),
        ("addi x2 x2 -1", [0xFFF10113]),
        ("andi x4 x4 8", [0x00827213]),
        ("sub x3 x3 x1", [0x401181B3]),
        ("csrw 0x305 x1", [0x30509073]),
        ("csrs 0x300 x2", [0x30012073]),
        ("csrr x3 0x342", [0x342021F3]),
        ("mret", [0x30200073]),
        ("jr x1", [0x00008067]),
        ("back:\naddi x0 x0 0\nbne x2 x0 back", [0x13, 0xFE011EE3]),
        ("beq x1 x0 on\nj on\non:", [0x00008463, 0x0040006F]),
        ("back:\nj back", [0x0000006F]),
        ("back:\naddi x0 x0 0\nj back", [0x13, 0xFFDFF06F]),
    ],
)
def test_known_encodings(text: str, words: list[int]) -> None:
    assert assemble(text) == words


def test_unknown_instructions_are_refused() -> None:
    with pytest.raises(ValueError, match=r"^no such instruction: fadd x1 x2 x3$"):
        assemble("fadd x1 x2 x3")
