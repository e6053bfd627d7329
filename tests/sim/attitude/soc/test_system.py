"""The computer as a whole: what programs may do wrong, and what becomes of it."""

NO_INTERRUPT = "void soc_interrupt(const uint32_t pending) { (void) pending; }\n"


def words(lines: list[str], kind: str = "O") -> list[int]:
    return [int(line.split()[-1], 16 if kind == "O" else 10) for line in lines if line[0] == kind]


def test_bytes_halves_words_in_memory(run) -> None:
    lines = run(
        NO_INTERRUPT
        + """
    static volatile uint32_t place[3] = {0x11223344u, 0x55667788u, 0u};
    int main(void) {
        volatile uint8_t *const bytes = (volatile uint8_t *) place;
        volatile uint16_t *const halves = (volatile uint16_t *) place;
        bytes[1] = 0xAAu;
        halves[3] = 0xBBCCu;
        bytes[8] = 1u; bytes[11] = 4u;
        for (uint32_t k = 0u; k < 3u; k++) { SAY(16, place[k]); }
        SAY(16, bytes[3]); SAY(16, halves[2]);
        END
    }"""
    )
    assert words(lines) == [0x1122AA44, 0xBBCC7788, 0x04000001, 0x11, 0x7788]


def test_memory_larger_than_the_caches(run) -> None:
    lines = run(
        NO_INTERRUPT
        + """
    static uint32_t big[2600];
    int main(void) {
        uint32_t wrong = 0u;
        for (uint32_t k = 0u; k < 2600u; k++) { big[k] = k * 2654435761u; }
        for (uint32_t k = 2600u; k-- > 0u;) { wrong += big[k] != k * 2654435761u; }
        SAY(16, wrong);
        END
    }"""
    )
    assert words(lines) == [0]


def test_an_address_without_a_part(run) -> None:
    """Reads 0, is flagged, goes on."""
    lines = run(
        NO_INTERRUPT
        + """
    int main(void) {
        SAY(16, STATUS & SOC_STATUS_BUS_ERROR);
        SAY(16, *(volatile uint32_t *) 0x80001000u);
        SAY(16, STATUS & SOC_STATUS_BUS_ERROR);
        STATUS = SOC_STATUS_BUS_ERROR;
        *(volatile uint32_t *) 0xFFFFFFF0u = 1u;
        SAY(16, STATUS & SOC_STATUS_BUS_ERROR);
        STATUS = SOC_STATUS_BUS_ERROR;
        SAY(16, *(volatile uint32_t *) 0x00100000u);
        SAY(16, STATUS & SOC_STATUS_BUS_ERROR);
        STATUS = SOC_STATUS_BUS_ERROR;
        SAY(16, STATUS & SOC_STATUS_BUS_ERROR);
        END
    }"""
    )
    assert words(lines) == [0, 0, 8, 8, 0, 8, 0]


def test_device_that_never_answers(run) -> None:
    lines = run(
        NO_INTERRUPT
        + """
    int main(void) {
        const uint32_t begin = soc_cycles();
        const uint32_t word = SOC_SLOT[7];
        const uint32_t took = soc_cycles() - begin;
        SAY(16, word); SAY(16, took > 4096u && took < 4200u); SAY(16, STATUS);
        SOC_SLOT[2056] = 1u;
        for (;;) { }
    }""",
        deaf=16,
        limit=60_000,
    )
    assert words(lines) == [0, 1, 9, 1]


def test_code_cannot_be_written(run) -> None:
    lines = run(
        NO_INTERRUPT
        + """
    int main(void) {
        volatile uint32_t *volatile place = (volatile uint32_t *) (uintptr_t) 0x40u;
        volatile uint32_t *const code = place;
        const uint32_t before = *code;
        *code = 0u;
        SAY(16, STATUS & SOC_STATUS_BUS_ERROR);
        __asm__ volatile(".word 0x500F"); // what the data cache remembers is forgotten
        SAY(16, *code == before);
        SOC_CONTROL[SOC_FENCE_ADDR] = 0u;
        *code = 0u;
        __asm__ volatile(".word 0x500F");
        SAY(16, *code == before);
        END
    }"""
    )
    assert words(lines) == [8, 1, 1]


def test_illegal_instruction_restarts(run) -> None:
    lines = run(
        NO_INTERRUPT
        + """
    static uint32_t data = 5u;
    int main(void) {
        const soc_crash_t crash = soc_crash();
        SAY(16, data); SAY(16, crash.count); SAY(16, crash.cause);
        SAY(16, STATUS & SOC_STATUS_WATCHDOG_FIRED);
        data = 6u;
        if (crash.count < 2u) { __asm__ volatile(".word 0"); }
        END
    }"""
    )
    assert words(lines) == [5, 0, 0, 0, 5, 1, 2, 16, 5, 2, 2, 16]
    assert len([line for line in lines if line[0] == "W"]) == 2


def test_jump_out_of_memory_restarts(run) -> None:
    for where in ("0x7FFFFFF0u", "0x80000000u", "0x00100000u"):
        lines = run(
            NO_INTERRUPT
            + """
        int main(void) {
            SAY(16, soc_crash().count);
            if (soc_crash().count == 0u) { ((void (*)(void)) (uintptr_t) WHERE)(); }
            SAY(16, soc_crash().pc);
            END
        }""".replace("WHERE", where)
        )
        assert words(lines) == [0, 1, int(where[:-1], 16)]


def test_endless_loop_restarts(run) -> None:
    lines = run(
        NO_INTERRUPT
        + """
    int main(void) {
        SAY(16, STATUS & SOC_STATUS_WATCHDOG_FIRED);
        if ((STATUS & SOC_STATUS_WATCHDOG_FIRED) == 0u) { for (;;) { } }
        END
    }"""
    )
    assert words(lines) == [0, 16]


def test_stack_is_seen(run) -> None:
    lines = run(
        NO_INTERRUPT
        + """
    uint32_t deep(uint32_t n, volatile uint32_t *above);
    __attribute__((noipa)) uint32_t deep(uint32_t n, volatile uint32_t *above) {
        volatile uint32_t room[16];
        room[0] = n;
        const uint32_t below = n == 0u ? *above : deep(n - 1u, room);
        return room[0] + below;
    }
    int main(void) {
        volatile uint32_t place = 0u;
        SAY(16, soc_stack_used()); SAY(16, soc_stack_whole());
        (void) deep(20u, &place);
        SAY(16, soc_stack_used()); SAY(16, soc_stack_whole());
        SAY(16, soc_stack_size());
        *(volatile uint32_t *) (uintptr_t) (16384u - soc_stack_size()) = 1u;
        SAY(16, soc_stack_whole()); SAY(16, soc_stack_used() == soc_stack_size());
        END
    }"""
    )
    first, whole, then, still, size, broken, full = words(lines)
    assert whole and still and not broken and full
    assert first < 200
    assert 20 * 64 < then < 20 * 150 < size


def test_interrupt_once_for_each_request(run) -> None:
    lines = run(
        """
    static volatile uint32_t count;
    void soc_interrupt(const uint32_t pending) {
        STATUS = SOC_STATUS_DEVICE;
        count++;
        SAY(16, pending);
        SOC_SLOT[0] = 1u;
    }
    int main(void) {
        soc_enable(SOC_INTERRUPT_DEVICE);
        while (count < 1u) { }
        SAY(16, count);
        END
    }""",
        records=1,
        words=1,
    )
    assert words(lines) == [1, 1]
    rises, done = (int(next(x for x in lines if x[0] == kind).split()[1]) for kind in "ID")
    assert done > rises


def test_masked_interrupt_waits(run) -> None:
    lines = run(
        """
    static volatile uint32_t count;
    void soc_interrupt(const uint32_t pending) {
        (void) pending;
        STATUS = SOC_STATUS_DEVICE;
        count++;
    }
    int main(void) {
        soc_enable(SOC_INTERRUPT_DEVICE);
        const uint32_t mask = soc_mask();
        while ((STATUS & SOC_STATUS_DEVICE) == 0u) { }
        for (volatile uint32_t k = 0u; k < 100u; k++) { }
        SAY(16, count);
        soc_unmask(mask);
        for (volatile uint32_t k = 0u; k < 10u; k++) { }
        SAY(16, count);
        END
    }""",
        records=1,
        words=1,
        gap=60_000,
    )
    assert words(lines) == [0, 1]


def test_console_echo(run) -> None:
    lines = run(
        NO_INTERRUPT
        + """
    int main(void) {
        for (uint32_t n = 0u; n < 3u;) {
            const int key = soc_get();
            if (key >= 0) { soc_put((uint8_t) (key + 1)); n++; }
        }
        for (uint32_t k = 0u; k < 200u; k++) { soc_kick(); }
        END
    }""",
        keys="434241",
        keys_at=40_000,
    )
    assert bytes(words(lines, "T")) == b"BCD"
