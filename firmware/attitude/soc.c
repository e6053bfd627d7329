/**
 * @file soc.c
 * @brief Devices of the soft core.
 */

//------------------------------------------------------------------------------
// Includes

#include "soc.h"

#include <stddef.h>
#include <string.h>

//------------------------------------------------------------------------------
// Definitions

#define STACK_PATTERN (UINT32_C(0x5ADDC0DE))
#define CRASH_MARK (UINT32_C(0xC4A54ED0))
#define CAUSE_INTERRUPT (UINT32_C(0x80000000))
// A byte takes 10 bits; what the console needs longer than this it does not get.
#define PUT_PATIENCE (UINT32_C(200000))

//------------------------------------------------------------------------------
// Variables

extern uint32_t _stack_bottom[];
extern uint32_t _stack_top[];
extern const uint8_t _fence_page[]; // its address is the number

static uint32_t crash_mark __attribute__((section(".noinit")));
static soc_crash_t crash __attribute__((section(".noinit")));

//------------------------------------------------------------------------------
// Function declarations: start.S has these, for C knows no control registers

void soc_write_mask(uint32_t mask);
uint32_t soc_read_mask(void);
uint32_t soc_read_pending(void);
void soc_interrupts_on(void);

//------------------------------------------------------------------------------
// Functions

// The C library's copies bytes one by one. Structures of words are what is copied here.
void *memcpy(void *const restrict to, const void *const restrict from, const size_t size) {
    uint8_t *t = to;
    const uint8_t *f = from;
    const uint8_t *const end = f + size;
    if ((((uintptr_t) t | (uintptr_t) f) & 3u) == 0u) {
        while (end - f >= 4) {
            *(uint32_t *) (void *) t = *(const uint32_t *) (const void *) f;
            t += 4;
            f += 4;
        }
    }
    while (f != end) {
        *t++ = *f++;
    }
    return to;
}

void soc_begin(void) {
    soc_kick();
    SOC_CONTROL[SOC_FENCE_ADDR] = (uint32_t) (uintptr_t) _fence_page;
    if (crash_mark != CRASH_MARK) {
        crash_mark = CRASH_MARK;
        crash = (soc_crash_t) {0};
    }
}

void soc_trap(const uint32_t cause, const uint32_t pc) {
    if ((cause & CAUSE_INTERRUPT) != 0u) {
        soc_interrupt(soc_read_pending());
        return;
    }
    crash.count++;
    crash.cause = cause;
    crash.pc = pc;
    for (;;) { // the watchdog ends this
    }
}

soc_crash_t soc_crash(void) {
    return crash;
}

void soc_enable(const uint32_t mask) {
    soc_write_mask(soc_read_mask() | mask);
    soc_interrupts_on();
}

uint32_t soc_mask(void) {
    const uint32_t mask = soc_read_mask();
    soc_write_mask(0u);
    return mask;
}

void soc_unmask(const uint32_t mask) {
    soc_write_mask(mask);
}

uint32_t soc_stack_size(void) {
    return (uint32_t) ((uintptr_t) _stack_top - (uintptr_t) _stack_bottom);
}

uint32_t soc_stack_used(void) {
    const uint32_t *word = _stack_bottom;
    while (word < _stack_top && *word == STACK_PATTERN) {
        word++;
    }
    return (uint32_t) ((uintptr_t) _stack_top - (uintptr_t) word);
}

bool soc_stack_whole(void) {
    return *_stack_bottom == STACK_PATTERN;
}

void soc_put(const uint8_t byte) {
    const uint32_t begin = soc_cycles();
    while ((SOC_CONTROL[SOC_STATUS_ADDR] & SOC_STATUS_CONSOLE_FREE) == 0u) {
        if (soc_cycles() - begin > PUT_PATIENCE) {
            return;
        }
    }
    SOC_CONTROL[SOC_CONSOLE_ADDR] = byte;
}

int soc_get(void) {
    if ((SOC_CONTROL[SOC_STATUS_ADDR] & SOC_STATUS_CONSOLE_FULL) == 0u) {
        return -1;
    }
    return (int) (SOC_CONTROL[SOC_CONSOLE_ADDR] & 0xFFu);
}

//------------------------------------------------------------------------------
// End of file
