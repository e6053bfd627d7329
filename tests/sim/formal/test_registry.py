"""All proofs by name; a part for all of its proofs."""

import pytest

from boresight.model.errors import InputError
from boresight.sim.formal import registry
from boresight.sim.formal.blocks import crc
from boresight.sim.formal.registry import all_proofs, find_proofs


def test_registry() -> None:
    proofs = all_proofs()
    assert len({p.name for p in proofs}) == len(proofs) > 10
    assert {p.name.partition(".")[0] for p in proofs} >= {
        "uart",
        "registers",
        "sequencer",
        "crc",
        "bus",
        "results",
    }
    assert all(p.claim and "." in p.name for p in proofs)
    assert {p.name for p in find_proofs(["crc"])} == {"crc.frames"}
    assert all(p.short for p in find_proofs([], short=True))
    assert {p.name for p in find_proofs(["uart", "crc.frames"])} == {
        p.name for p in proofs if p.name.startswith("uart.")
    } | {"crc.frames"}
    assert [p.name for p in proofs] == sorted(p.name for p in proofs)
    with pytest.raises(
        InputError,
        match=r"^NAME: wanted a proof or the part before its dot, "
        r"found nothing; see python -m boresight.sim\.formal --list$",
    ):
        find_proofs(["nothing"])


def test_a_name_belongs_to_one_proof(monkeypatch) -> None:
    monkeypatch.setattr(crc, "PROOFS", 2 * crc.PROOFS)
    with pytest.raises(ValueError, match="^names of proofs must differ, not crc.frames twice$"):
        registry.all_proofs()


def test_the_beginning_of_a_name_is_not_its_part() -> None:
    with pytest.raises(InputError, match="found cr; "):
        find_proofs(["cr"])
