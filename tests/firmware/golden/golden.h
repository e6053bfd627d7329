/**
 * @file golden.h
 * @brief Fixed-point estimator: a word w stands for w * 2^-FRAC, x for floor(x * 2^FRAC + 0.5).
 *
 * Generated from the program "golden"; do not edit.
 * Program digest: 918cdc3a116fb29c2f07a3c201dc4d4be291d953296d7ced4c9cd3af9964e51d
 */

#ifndef GOLDEN_H
#define GOLDEN_H

//------------------------------------------------------------------------------
// Includes

#include <stdbool.h>
#include <stdint.h>

//------------------------------------------------------------------------------
// Definitions

#define GOLDEN_DIGEST "918cdc3a116fb29c2f07a3c201dc4d4be291d953296d7ced4c9cd3af9964e51d"
#define GOLDEN_WORD 32 // bits of a word
#define GOLDEN_INPUTS 1
#define GOLDEN_OUTPUTS 2

// Inputs: fraction bits
#define GOLDEN_IN_RATE_FRAC 27 // fixed<32,5>, rad/s, [-16, 16]
// Parameters: fraction bits
#define GOLDEN_GAIN_FRAC 31 // fixed<32,1>, [0, 1]
// Outputs: fraction bits
#define GOLDEN_OUT_ANGLE_HT_FRAC 31 // fixed<32,1>, half turns, [-1, 1]
#define GOLDEN_OUT_SMOOTH_FRAC 27 // fixed<32,5>, rad/s, [-16, 16]

// Parameters: may be changed between updates.
typedef struct {
    int32_t gain; // fixed<32,1>, [0, 1]
} golden_params_t;

// States: all members private.
typedef struct {
    int32_t angle_ht; // fixed<32,1>, half turns, [-1, 1]
} golden_state_t;

// Estimator.
typedef struct {
    golden_params_t params;
    golden_state_t state;
} golden_t;

// Inputs of one update: words of 32 bits, sign-extended.
typedef struct {
    int32_t rate; // fixed<32,5>, rad/s, [-16, 16]
} golden_in_t;

// Outputs of one update.
typedef struct {
    int32_t angle_ht; // fixed<32,1>, half turns, [-1, 1]
    int32_t smooth; // fixed<32,5>, rad/s, [-16, 16]
    bool saturated; // a result of this update was clamped
    bool beyond; // an input of this update was beyond its declared range
} golden_out_t;

//------------------------------------------------------------------------------
// Function declarations

#ifdef __cplusplus
extern "C" {
#endif

// Sets the parameters to their defaults and the states to their reset words.
void golden_init(golden_t *self);

// Sets the states to their reset words.
void golden_reset(golden_t *self);

// Runs one update.
void golden_update(golden_t *self, const golden_in_t *in, golden_out_t *out);

#ifdef __cplusplus
}
#endif

#endif
