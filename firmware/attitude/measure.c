/**
 * @file measure.c
 * @brief One estimator in software, on records that a bench holds in the device slot.
 *
 * The bench's words: 0, read: number of records, write: end; 1, write: the record that is shown;
 * 16 and more, read: words of that record. For each record the program gives out its cycles by the
 * processor's counter, then the words of the result.
 */

#include "filter.h"
#include "soc.h"

#include <string.h>

#define BENCH_RECORDS 0
#define BENCH_SHOWN 1
#define BENCH_RECORD 16

static FILTER(t) filter;

int main(void) {
    FILTER(in_t) in;
    FILTER(out_t) out;
    uint32_t inputs[INPUTS];
    uint32_t outputs[OUTPUTS];
    FILTER(init)(&filter);
    const uint32_t first = SOC_CYCLES;
    const uint32_t overhead = SOC_CYCLES - first;
    const uint32_t records = SOC_SLOT[BENCH_RECORDS];
    for (uint32_t n = 0u; n < records; n++) {
        SOC_SLOT[BENCH_SHOWN] = n;
        for (uint32_t k = 0u; k < INPUTS; k++) {
            inputs[k] = SOC_SLOT[BENCH_RECORD + k];
        }
        memcpy(&in, inputs, sizeof inputs);
        const uint32_t begin = SOC_CYCLES;
        FILTER(update)(&filter, &in, &out);
        const uint32_t end = SOC_CYCLES;
        memcpy(outputs, &out, sizeof outputs);
        SOC_WORD = end - begin - overhead;
        for (uint32_t k = 0u; k < OUTPUTS; k++) {
            SOC_WORD = outputs[k];
        }
    }
    SOC_SLOT[BENCH_RECORDS] = 0u;
    return 0;
}
