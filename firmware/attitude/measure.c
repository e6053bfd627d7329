/**
 * @file measure.c
 * @brief One estimator in software, driven and observed by a bench in the device slot.
 *
 * The bench raises the interrupt when a record is there. Its registers, by word:
 *   0      write: the record is done, the results are in; read: records left
 *   1      write: cycles of this update by the processor's counter
 *   2      write: end of the measurement
 *   3..7   write: figures (see MEASURE_FIGURE_)
 *   16..   read: words of the record; write: words of the result
 */

//------------------------------------------------------------------------------
// Includes

#include "filter.h"
#include "soc.h"

#include <string.h>

//------------------------------------------------------------------------------
// Definitions

#define MEASURE_DONE 0
#define MEASURE_CYCLES 1
#define MEASURE_END 2
#define MEASURE_FIGURE_STACK 3
#define MEASURE_FIGURE_STACK_SIZE 4
#define MEASURE_FIGURE_CRASHES 5
#define MEASURE_FIGURE_OVERHEAD 6
#define MEASURE_WORDS 16

//------------------------------------------------------------------------------
// Variables

static filter_t filter;
static filter_in_t in;
static volatile bool waiting;

//------------------------------------------------------------------------------
// Functions

// The record is read at once; more wait until it is done.
void soc_interrupt(const uint32_t pending) {
    if ((pending & SOC_INTERRUPT_DEVICE) != 0u) {
        SOC_CONTROL[SOC_STATUS_ADDR] = SOC_STATUS_DEVICE;
        uint32_t words[FILTER_INPUTS];
        for (uint32_t k = 0u; k < FILTER_INPUTS; k++) {
            words[k] = SOC_SLOT[MEASURE_WORDS + k];
        }
        memcpy(&in, words, sizeof words);
        waiting = true;
    }
}

static void put_results(const filter_out_t *const out) {
    uint32_t words[FILTER_OUTPUTS];
    memcpy(words, out, sizeof words);
    for (uint32_t k = 0u; k < FILTER_OUTPUTS; k++) {
        SOC_SLOT[MEASURE_WORDS + k] = words[k];
    }
}

int main(void) {
    filter_out_t out;
    filter_init(&filter);
    const uint32_t first = soc_cycles();
    SOC_SLOT[MEASURE_FIGURE_OVERHEAD] = soc_cycles() - first;
    uint32_t left = SOC_SLOT[MEASURE_DONE];
    soc_enable(SOC_INTERRUPT_DEVICE);
    for (; left != 0u; left--) {
        while (!waiting) {
        }
        waiting = false;
        soc_kick();
        const uint32_t begin = soc_cycles();
        filter_update(&filter, &in, &out);
        const uint32_t cycles = soc_cycles() - begin;
        put_results(&out);
        SOC_SLOT[MEASURE_DONE] = 1u;
        SOC_SLOT[MEASURE_CYCLES] = cycles;
    }
    SOC_SLOT[MEASURE_FIGURE_STACK] = soc_stack_used();
    SOC_SLOT[MEASURE_FIGURE_STACK_SIZE] = soc_stack_size();
    SOC_SLOT[MEASURE_FIGURE_CRASHES] = soc_crash().count;
    SOC_SLOT[MEASURE_END] = 1u;
    for (;;) {
        soc_kick();
    }
}

//------------------------------------------------------------------------------
// End of file
