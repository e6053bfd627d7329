/**
 * @file attitude.c
 * @brief Attitude of the newest sample: by the hardware core, or by software from the same record.
 */

//------------------------------------------------------------------------------
// Includes

#include "attitude.h"

#include "registers.h"
#include "soc.h"

//------------------------------------------------------------------------------
// Definitions

#define ATTEMPTS 3u

//------------------------------------------------------------------------------
// Variables

// One is the newest, one is being copied, one is free to be written: no copy makes another wait.
static attitude_t updates[3];
static uint32_t newest;
static uint32_t taken;
static uint32_t spare = 1u;
static volatile bool fresh;
static uint32_t missed;

//------------------------------------------------------------------------------
// Functions

// Reads one whole update, the attitude first: the header is the same before and after.
static bool read_update(attitude_t *const to) {
    for (uint32_t attempt = 0u; attempt < ATTEMPTS; attempt++) {
        to->header = SOC_SLOT[CORE_RESULT_HEADER_ADDR];
        for (uint32_t k = 0u; k < RECORD_OUTPUTS; k++) {
            to->outputs[k] = core_reg_signed(SOC_SLOT[RECORD_OUTPUT_ADDR + k]);
        }
        to->stamp = SOC_SLOT[CORE_RESULT_STAMP_ADDR];
        to->age = SOC_SLOT[CORE_TIME_ADDR] - to->stamp;
        for (uint32_t k = 0u; k < RECORD_INPUTS; k++) {
            to->inputs[k] = core_reg_signed(SOC_SLOT[RECORD_INPUT_ADDR + k]);
        }
        if (SOC_SLOT[CORE_RESULT_HEADER_ADDR] == to->header) {
            return true;
        }
    }
    return false;
}

// The one that is neither the newest nor being copied.
static void choose_spare(void) {
    spare = newest == taken ? (newest + 1u) % 3u : 3u - newest - taken;
}

uint32_t attitude_filter(const attitude_t *const attitude) {
    return core_reg_field(attitude->header, CORE_RESULT_HEADER_FILTER_LSB,
                          CORE_RESULT_HEADER_FILTER_WIDTH);
}

// The time step of two updates together; a restart of the first one stays one.
static int32_t both(const int32_t step, const int32_t before) {
    const int64_t sum = (int64_t) step + before;
    return before < 0 ? before : sum > INT32_MAX ? INT32_MAX : (int32_t) sum;
}

// Time and field of an update that was not taken go to the next one; a restart starts afresh, and
// so does another estimator.
static void merge(attitude_t *const to, const attitude_t *const before) {
    const uint32_t filter = attitude_filter(to);
    const int32_t step = record_step[filter];
    if (filter != attitude_filter(before) || (step >= 0 && to->inputs[step] < 0)) {
        return;
    }
    if (step >= 0) {
        to->inputs[step] = both(to->inputs[step], before->inputs[step]);
    }
    if ((to->header & CORE_RESULT_HEADER_FIELD_USED) == 0u) {
        for (uint32_t k = 0u; k < RECORD_INPUTS; k++) {
            if ((record_field[filter] >> k & 1u) != 0u) {
                to->inputs[k] = before->inputs[k];
            }
        }
    }
}

void attitude_interrupt(void) {
    attitude_t *const to = &updates[spare];
    const bool whole = read_update(to);
    SOC_CONTROL[SOC_STATUS_ADDR] = SOC_STATUS_DEVICE;
    if (!whole) {
        missed++;
        return;
    }
    if (fresh) {
        missed++;
        merge(to, &updates[newest]);
    }
    newest = spare;
    fresh = true;
    choose_spare();
}

bool attitude_take(attitude_t *const attitude) {
    if (!fresh) {
        return false;
    }
    const uint32_t mask = soc_mask();
    taken = newest;
    fresh = false;
    choose_spare();
    soc_unmask(mask);
    *attitude = updates[taken];
    return true;
}

uint32_t attitude_missed(void) {
    return missed;
}

//------------------------------------------------------------------------------
// End of file
