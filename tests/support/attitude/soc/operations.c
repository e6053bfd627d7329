/**
 * @file operations.c
 * @brief Cycles of single-precision operations, one after another, for a bench in the device slot.
 *
 * Each is done REPEAT times on operands as filters have them, caches warm; its cycles without the
 * loop's go to the bench in the order of operations.py. Registers of the bench: measure.c.
 */

//------------------------------------------------------------------------------
// Includes

#include "soc.h"

#include <math.h>

//------------------------------------------------------------------------------
// Definitions

#define REPEAT 16u
#define MEASURE_END 2
#define MEASURE_WORDS 16

// Times an expression of x, y and z twice, the second time with everything in the caches.
#define TIME(expression)                                  \
    do {                                                  \
        uint32_t cycles = 0u;                             \
        for (uint32_t pass = 0u; pass < 2u; pass++) {     \
            const uint32_t begin = soc_cycles();          \
            for (uint32_t k = 0u; k < REPEAT; k++) {      \
                const float x = operands[k];              \
                const float y = operands[(k + 5u) & 15u]; \
                const float z = operands[(k + 9u) & 15u]; \
                (void) y;                                 \
                (void) z;                                 \
                result = (expression);                    \
            }                                             \
            cycles = soc_cycles() - begin;                \
        }                                                 \
        SOC_SLOT[MEASURE_WORDS] = cycles;                 \
    } while (0)

//------------------------------------------------------------------------------
// Variables

static volatile float result;
static volatile float operands[REPEAT] = {
    0.9f, 0.31f, 0.0127f, 0.55f, 0.73f, 0.002f, 0.118f, 0.64f,
    0.05f, 0.99f, 0.27f, 0.41f, 0.0009f, 0.83f, 0.16f, 0.37f,
};

//------------------------------------------------------------------------------
// Functions

void soc_interrupt(const uint32_t pending) {
    (void) pending;
}

int main(void) {
    TIME(x); // the loop itself
    TIME(x + y);
    TIME(x - y);
    TIME(x * y);
    TIME(x / y);
    TIME(x < y ? x : y);
    TIME(sqrtf(x));
    TIME(sinf(x));
    TIME(cosf(x));
    TIME(asinf(x));
    TIME(atan2f(x, y - z));
    SOC_SLOT[MEASURE_END] = 1u;
    for (;;) {
        soc_kick();
    }
}

//------------------------------------------------------------------------------
// End of file
