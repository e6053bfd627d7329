/**
 * @file software.c
 * @brief The estimator in software, on words of the register map.
 */

//------------------------------------------------------------------------------
// Includes

#include "software.h"

#include <string.h>

//------------------------------------------------------------------------------
// Functions

#if FILTER_KIND == 0

void software_begin(void) {
}

void software_update(attitude_t *const attitude) {
    (void) attitude;
}

#else

static filter_t filter;

void software_begin(void) {
    filter_init(&filter);
}

#if FILTER_KIND == 1

void software_update(attitude_t *const attitude) {
    filter_in_t in;
    filter_out_t out;
    memcpy(&in, attitude->inputs, FILTER_INPUTS * sizeof attitude->inputs[0]);
    filter_update(&filter, &in, &out);
    memcpy(attitude->outputs, &out, FILTER_OUTPUTS * sizeof attitude->outputs[0]);
}

#else

#include <math.h>

// A value as a word, clamped; what is no number becomes 0.
static int32_t to_word(const float value, const int frac) {
    const float scaled = ldexpf(value, frac);
    if (scaled >= 2147483648.0f) {
        return INT32_MAX;
    }
    if (scaled < -2147483648.0f) {
        return INT32_MIN;
    }
    return scaled == scaled ? (int32_t) scaled : 0;
}

void software_update(attitude_t *const attitude) {
    float values[FILTER_INPUTS];
    float results[FILTER_OUTPUTS];
    filter_in_t in;
    filter_out_t out;
    for (uint32_t k = 0u; k < FILTER_INPUTS; k++) {
        values[k] = ldexpf((float) attitude->inputs[k], -record_in_frac[FILTER_NUMBER][k]);
    }
    memcpy(&in, values, sizeof values);
    filter_update(&filter, &in, &out);
    memcpy(results, &out, sizeof results);
    for (uint32_t k = 0u; k < FILTER_OUTPUTS; k++) {
        if (results[k] != results[k]) { // no number: it would stay so for ever
            filter_reset(&filter);
        }
        attitude->outputs[k] = to_word(results[k], record_out_frac[FILTER_NUMBER][k]);
    }
}

#endif
#endif

//------------------------------------------------------------------------------
// End of file
