/**
 * @file software.c
 * @brief The estimator in software, on words of the register map.
 */

//------------------------------------------------------------------------------
// Includes

#include "software.h"

#include "registers.h"

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
    memcpy(&in, attitude->inputs, sizeof attitude->inputs);
    filter_update(&filter, &in, &out);
    memcpy(attitude->outputs, &out, sizeof attitude->outputs);
}

#else

#include <math.h>

// Fraction bits of the words of the register map.
static const int8_t in_frac[ATTITUDE_INPUTS] = {
    CORE_INPUT_DT_FRAC, CORE_INPUT_GX_FRAC, CORE_INPUT_GY_FRAC, CORE_INPUT_GZ_FRAC,
    CORE_INPUT_MX_FRAC, CORE_INPUT_MY_FRAC, CORE_INPUT_MZ_FRAC, CORE_INPUT_AX_FRAC,
    CORE_INPUT_AY_FRAC, CORE_INPUT_AZ_FRAC,
};
static const int8_t out_frac[ATTITUDE_OUTPUTS] = {
    CORE_RESULT_PITCH_FRAC, CORE_RESULT_ROLL_FRAC, CORE_RESULT_HEADING_FRAC, CORE_RESULT_QW_FRAC,
    CORE_RESULT_QX_FRAC, CORE_RESULT_QY_FRAC, CORE_RESULT_QZ_FRAC, CORE_RESULT_STATUS_FRAC,
};

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
    float values[ATTITUDE_INPUTS];
    float results[ATTITUDE_OUTPUTS];
    filter_in_t in;
    filter_out_t out;
    for (uint32_t k = 0u; k < ATTITUDE_INPUTS; k++) {
        values[k] = ldexpf((float) attitude->inputs[k], -in_frac[k]);
    }
    memcpy(&in, values, sizeof values);
    filter_update(&filter, &in, &out);
    memcpy(results, &out, sizeof results);
    if (out.qw != out.qw) { // no number: it would stay so for ever
        filter_reset(&filter);
    }
    for (uint32_t k = 0u; k < ATTITUDE_OUTPUTS; k++) {
        attitude->outputs[k] = to_word(results[k], out_frac[k]);
    }
}

#endif
#endif

//------------------------------------------------------------------------------
// End of file
