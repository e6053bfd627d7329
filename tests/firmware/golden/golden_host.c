/**
 * @file golden_host.c
 * @brief Entry points for a host: many updates, many estimators.
 *
 * Generated from the program "golden"; do not edit.
 * Program digest: 918cdc3a116fb29c2f07a3c201dc4d4be291d953296d7ced4c9cd3af9964e51d
 */

//------------------------------------------------------------------------------
// Includes

#include "golden.c"

#include <stddef.h>

//------------------------------------------------------------------------------
// Function declarations

size_t golden_size(void);
void golden_set_param(golden_t *self, size_t number, int32_t word);
void golden_run(golden_t *self, size_t n_updates, const int32_t *inputs,
    int32_t *outputs, uint8_t *flags, int32_t *states);
void golden_each(golden_t *all, size_t n, const int32_t *inputs, int32_t *outputs,
    uint8_t *flags);

//------------------------------------------------------------------------------
// Functions

// Bytes of an estimator.
size_t golden_size(void) {
    return sizeof(golden_t);
}

// Sets the parameter with this value number.
void golden_set_param(golden_t *const self, const size_t number, const int32_t word) {
    (void) self;
    (void) word;
    switch (number) {
        case 2u: self->params.gain = word; break;
        default: break;
    }
}

// Runs updates: inputs[n_updates][1] -> outputs[n_updates][2], flags[n_updates],
// and, unless it is NULL, states[n_updates][1]: the words after each update.
void golden_run(golden_t *const self, const size_t n_updates, const int32_t *const inputs,
    int32_t *const outputs, uint8_t *const flags, int32_t *const states) {
    (void) inputs;
    (void) outputs;
    golden_in_t in = {0};
    golden_out_t out;
    for (size_t k = 0u; k < n_updates; k++) {
        in.rate = inputs[k * 1u + 0u];
        golden_update(self, &in, &out);
        outputs[k * 2u + 0u] = out.angle_ht;
        outputs[k * 2u + 1u] = out.smooth;
        flags[k] = (uint8_t) ((out.saturated ? 1u : 0u) | (out.beyond ? 2u : 0u));
        if (states != NULL) {
            states[k * 1u + 0u] = self->state.angle_ht;
        }
    }
}

// Runs one update of each of n estimators: inputs[n][1] -> outputs[n][2], flags[n].
void golden_each(golden_t *const all, const size_t n, const int32_t *const inputs,
    int32_t *const outputs, uint8_t *const flags) {
    for (size_t k = 0u; k < n; k++) {
        golden_run(&all[k], 1u, inputs + k * 1u, outputs + k * 2u, flags + k, NULL);
    }
}

//------------------------------------------------------------------------------
// End of file
