/**
 * @file offload.c
 * @brief Reads every update of the attitude system over the bus, and gives its words out.
 *
 * Words of an update: header, age of the sample in cycles, outputs, inputs.
 */

#include "records.h"
#include "registers.h"
#include "soc.h"

int main(void) {
    uint32_t words[2 + RECORD_OUTPUTS + RECORD_INPUTS];
    for (;;) {
        while (SOC_UPDATED == 0u) {
        }
        SOC_UPDATED = 0u;
        uint32_t *word = words;
        *word++ = SOC_SLOT[CORE_RESULT_HEADER_ADDR];
        const uint32_t stamp = SOC_SLOT[CORE_RESULT_STAMP_ADDR];
        *word++ = SOC_SLOT[CORE_TIME_ADDR] - stamp;
        for (uint32_t k = 0u; k < RECORD_OUTPUTS; k++) {
            *word++ = SOC_SLOT[RECORD_OUTPUT_ADDR + k];
        }
        for (uint32_t k = 0u; k < RECORD_INPUTS; k++) {
            *word++ = SOC_SLOT[RECORD_INPUT_ADDR + k];
        }
        for (const uint32_t *done = words; done != word; done++) {
            SOC_WORD = *done;
        }
    }
}
