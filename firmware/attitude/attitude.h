/**
 * @file attitude.h
 * @brief Attitude of the newest sample: by the hardware core, or by software from the same record.
 */

#ifndef ATTITUDE_H
#define ATTITUDE_H

//------------------------------------------------------------------------------
// Includes

#include "records.h"

#include <stdbool.h>
#include <stdint.h>

//------------------------------------------------------------------------------
// Definitions

// One update. The words are those of the register map; records.h says which they are.
typedef struct {
    uint32_t header;                 // RESULT_HEADER
    uint32_t stamp;                  // RESULT_STAMP: time of the sample's data-ready edge
    uint32_t age;                    // cycles from the sample's data-ready edge until now
    int32_t outputs[RECORD_OUTPUTS]; // what the hardware core has computed
    int32_t inputs[RECORD_INPUTS];   // what it has computed it from
} attitude_t;

//------------------------------------------------------------------------------
// Function declarations

// Number of the estimator that made the update.
uint32_t attitude_filter(const attitude_t *attitude);

// To be called from soc_interrupt when SOC_INTERRUPT_DEVICE is pending: reads the update.
void attitude_interrupt(void);

// The newest update, once; false if there is none since the last call. If some were missed in
// between, their time steps are in this one's, and a magnetic field that came with one of them.
bool attitude_take(attitude_t *attitude);

// Updates that were missed, since reset.
uint32_t attitude_missed(void);

#endif

//------------------------------------------------------------------------------
// End of file
