/**
 * @file core.h
 * @brief The estimator's core at the processor's bus, with the functions of an estimator in C.
 *
 * Word k of its registers, then its records: gateware/attitude/soc.py has the same map. A transfer
 * of a record's word ends when the core takes or gives it. ``record.h`` has the record's sizes.
 */

#ifndef CORE_H
#define CORE_H

#include "record.h"
#include "soc.h"

#define CORE_WORD UINT32_C(0x400) // write: the next input word; read: the next output word
#define CORE_LAST UINT32_C(0x401) // write: the last input word

typedef volatile uint32_t *core_t;
typedef struct {
    uint32_t words[CORE_INPUTS];
} core_in_t;
typedef struct {
    uint32_t words[CORE_OUTPUTS];
} core_out_t;

// Begins from the initial states.
static inline void core_init(core_t *core) {
    *core = SOC_SLOT + 2048;
    (*core)[CORE_RESTART] = 1u;
    while (((*core)[CORE_STATUS] & CORE_IDLE) == 0u) {
    }
}

static inline void core_update(const core_t *core, const core_in_t *in, core_out_t *out) {
    for (uint32_t k = 0u; k < CORE_INPUTS; k++) {
        (*core)[k < CORE_INPUTS - 1u ? CORE_WORD : CORE_LAST] = in->words[k];
    }
    for (uint32_t k = 0u; k < CORE_OUTPUTS; k++) {
        out->words[k] = (*core)[CORE_WORD];
    }
}

#endif
