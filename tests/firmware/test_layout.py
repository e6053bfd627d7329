"""`firmware.layout`: the frame of a file."""

from boresight.firmware.layout import banner, block, head, join


def test_block_indents_but_leaves_blank_lines_empty() -> None:
    assert block("void f(void)", ["a;", "", "b;"]) == "void f(void) {\n    a;\n\n    b;\n}"


def test_join_drops_empty_parts() -> None:
    assert join("a", "", "b") == "a\n\nb\n"


def test_banner_is_eighty_columns() -> None:
    rule, title = banner("Functions").split("\n")
    assert (len(rule), title) == (80, "// Functions")


def test_head() -> None:
    text = head("odd.c", "What it is.", "Made from x,", "and y.")
    assert text.startswith(
        "/**\n * @file odd.c\n * @brief What it is.\n *\n * Made from x,\n * and "
    )
    assert text.count("*/") == 1
