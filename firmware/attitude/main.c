/**
 * @file main.c
 * @brief Attitude as text: computed by the hardware core, or by software from the same samples.
 *
 * Keys of the console: h hardware, s software (if the image has an estimator), 1 to 9 lines for
 * every 2nd to 512th update, ? what has gone wrong so far. A line says way, update, the estimator's
 * words (of an attitude heading, pitch, roll [deg] and status), cycles from the sample's data-ready
 * edge to the attitude in memory.
 */

//------------------------------------------------------------------------------
// Includes

#include "registers.h"
#include "soc.h"
#include "software.h"
#include "text.h"

//------------------------------------------------------------------------------
// Definitions

//------------------------------------------------------------------------------
// Variables

static bool by_software = FILTER_KIND != 0;
static uint32_t line_mask = 127u;
static attitude_t shown;

//------------------------------------------------------------------------------
// Functions

void soc_interrupt(const uint32_t pending) {
    if ((pending & SOC_INTERRUPT_DEVICE) != 0u) {
        attitude_interrupt();
    }
}

static void put_word(const int32_t word, const int32_t frac, const uint32_t kind) {
    text_put(" ");
    if (kind == RECORD_ANGLE) {
        text_hundredths(text_hundredths_of_half_turns(word, (uint32_t) frac));
    } else if (kind == RECORD_BITS) {
        text_unsigned((uint32_t) word >> (uint32_t) frac);
    } else {
        text_hundredths(text_hundredths_of(word, frac));
    }
}

static void put_line(const attitude_t *const attitude) {
    text_put(by_software ? "s " : "h ");
    text_unsigned(attitude->header & CORE_RESULT_HEADER_NUMBER);
    const uint32_t filter = attitude_filter(attitude);
    for (uint32_t k = 0u; k < record_said[filter]; k++) {
        const uint32_t place = record_place[filter][k];
        put_word(attitude->outputs[place], record_out_frac[filter][place], record_kind[filter][k]);
    }
    text_put(" ");
    text_unsigned(attitude->age);
    text_end();
}

static void put_troubles(void) {
    const soc_crash_t crash = soc_crash();
    text_put("missed ");
    text_unsigned(attitude_missed());
    text_put(" crashes ");
    text_unsigned(crash.count);
    text_put(" cause ");
    text_unsigned(crash.cause);
    text_put(" pc ");
    text_unsigned(crash.pc);
    text_put(" status ");
    text_unsigned(SOC_CONTROL[SOC_STATUS_ADDR]);
    text_put(" stack ");
    text_unsigned(soc_stack_used());
    text_put(" of ");
    text_unsigned(soc_stack_size());
    text_end();
}

static void obey(const int key) {
    if (key == 'h') {
        by_software = false;
    } else if (key == 's' && FILTER_KIND != 0) {
        by_software = true;
        software_begin();
    } else if (key >= '1' && key <= '9') {
        line_mask = (UINT32_C(1) << (uint32_t) (key - '0')) - 1u;
    } else if (key == '?') {
        put_troubles();
    } else {
        // no key of ours
    }
}

int main(void) {
    text_put("boresight ");
    text_unsigned(SOC_SLOT[CORE_MAP_VERSION_ADDR]);
    text_end();
    software_begin();
    soc_enable(SOC_INTERRUPT_DEVICE);
    while (soc_stack_whole()) { // else the watchdog restarts it
        soc_kick();
        obey(soc_get());
        if (attitude_take(&shown)) {
            if (by_software) {
                software_update(&shown);
                shown.age = SOC_SLOT[CORE_TIME_ADDR] - shown.stamp;
            }
            if ((shown.header & line_mask) == 0u) {
                put_line(&shown);
            }
        }
    }
    return 0;
}

//------------------------------------------------------------------------------
// End of file
