/**
 * @file software.h
 * @brief The estimator in software, on words of the register map.
 */

#ifndef SOFTWARE_H
#define SOFTWARE_H

//------------------------------------------------------------------------------
// Includes

#include "attitude.h"
#include "filter.h"

//------------------------------------------------------------------------------
// Function declarations

// Sets the estimator to its start.
void software_begin(void);

// Computes the outputs of the update from its inputs.
void software_update(attitude_t *attitude);

#endif

//------------------------------------------------------------------------------
// End of file
