/**
 * @file golden_observe.c
 * @brief Every word of an update, for a host.
 *
 * Generated from the program "golden"; do not edit.
 * Program digest: 918cdc3a116fb29c2f07a3c201dc4d4be291d953296d7ced4c9cd3af9964e51d
 */

//------------------------------------------------------------------------------
// Includes

#include "golden.h"

#include <stddef.h>

//------------------------------------------------------------------------------
// as in golden.c

void golden_observe(golden_t *self, size_t n_updates, const int32_t *inputs,
    int32_t *low, int32_t *high, int64_t *low_at, int64_t *high_at,
    int64_t *saturations);

// Runs updates: inputs[n_updates][1]; for each of the 7 values: narrows low and high to
// its least and largest word (of states: before the update), with the update that first had it,
// and counts its saturations.
void golden_observe(golden_t *const self, const size_t n_updates, const int32_t *const inputs,
    int32_t *const low, int32_t *const high, int64_t *const low_at, int64_t *const high_at,
    int64_t *const saturations) {
    (void) self;
    (void) inputs;
    (void) low;
    (void) high;
    (void) low_at;
    (void) high_at;
    (void) saturations;
    int32_t words[7];
    (void) words;
    golden_in_t row = {0};
    golden_in_t *const in = &row;
    (void) in;
    for (size_t k = 0u; k < n_updates; k++) {
        row.rate = inputs[k * 1u + 0u];
        const int32_t v0_rate = in->rate; // fixed<32,5>, rad/s, [-16, 16]
        const int32_t v2_gain = self->params.gain; // fixed<32,1>, [0, 1]
        const int32_t v3_angle_ht = self->state.angle_ht; // fixed<32,1>, half turns, [-1, 1]
        bool saturated = false;
        bool beyond = false;
        uint64_t acc; // accumulator, modulo 2^64
        uint64_t flag; // all ones where the sign bit of the flag is set
        uint32_t n; // normalisation count
        const int32_t *segment; // coefficients of one segment of a table

        // turned_ht: fixed<32,1>, half turns, [-1, 1], WRAP
        acc = ROUND;
        acc += mul_shift(v3_angle_ht, 687194767, 29u); // dt
        acc += mul_shift(v0_rate, 687194767, 26u); // dt
        const int32_t v4_turned_ht = wrap(acc);

        // sine: fixed<32,2>, [-1, 1], SAT
        flag = sign_mask_quarter(v4_turned_ht);
        segment = &TABLE[0u + 4u * segment_index_quarter(v4_turned_ht)];
        acc = ROUND;
        acc += mul_shift(fraction(v4_turned_ht), segment[1], 24u);
        acc += negate_where(mul_shift(687194767, segment[0], 30u), flag); // dt
        const int32_t v5_sine = saturate(acc, &saturated);
        saturations[5] += saturated ? 1 : 0;
        saturated = false;

        // smooth: fixed<32,5>, rad/s, [-16, 16], CLIP
        flag = sign_mask(v0_rate);
        n = sign_count(v0_rate);
        acc = ROUND;
        acc += mul_shift(v0_rate, v2_gain, 23u);
        acc += mul_shift(v0_rate, v5_sine, shift_less(25u, n)) & ~flag;
        const int32_t v6_smooth = clip(acc);

        words[0] = v0_rate; // rate: fixed<32,5>, rad/s, [-16, 16]
        words[1] = 687194767; // dt: fixed<32,-5>, s, [0.005, 0.005]
        words[2] = v2_gain; // gain: fixed<32,1>, [0, 1]
        words[3] = v3_angle_ht; // angle_ht: fixed<32,1>, half turns, [-1, 1]
        words[4] = v4_turned_ht; // turned_ht: fixed<32,1>, half turns, [-1, 1]
        words[5] = v5_sine; // sine: fixed<32,2>, [-1, 1]
        words[6] = v6_smooth; // smooth: fixed<32,5>, rad/s, [-16, 16]
        (void) saturated;
        (void) beyond;
        self->state.angle_ht = v4_turned_ht;
        for (size_t v = 0u; v < 7u; v++) {
            if (words[v] < low[v]) {
                low[v] = words[v];
                low_at[v] = (int64_t) k;
            }
            if (words[v] > high[v]) {
                high[v] = words[v];
                high_at[v] = (int64_t) k;
            }
        }
    }
}

//------------------------------------------------------------------------------
// End of file
