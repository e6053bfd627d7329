/**
 * @file text.c
 * @brief Numbers and lines of text to the console.
 */

//------------------------------------------------------------------------------
// Includes

#include "text.h"

#include "soc.h"

//------------------------------------------------------------------------------
// Functions

void text_put(const char *text) {
    while (*text != '\0') {
        soc_put((uint8_t) *text++);
    }
}

void text_unsigned(const uint32_t value) {
    uint8_t digits[10];
    uint32_t count = 0u;
    uint32_t rest = value;
    do {
        digits[count++] = (uint8_t) (rest % 10u + (uint32_t) '0');
        rest /= 10u;
    } while (rest != 0u);
    while (count > 0u) {
        soc_put(digits[--count]);
    }
}

void text_hundredths(const int32_t value) {
    uint32_t size = (uint32_t) value;
    if (value < 0) {
        soc_put((uint8_t) '-');
        size = 0u - size;
    }
    text_unsigned(size / 100u);
    soc_put((uint8_t) '.');
    soc_put((uint8_t) (size / 10u % 10u + (uint32_t) '0'));
    soc_put((uint8_t) (size % 10u + (uint32_t) '0'));
}

void text_end(void) {
    text_put("\r\n");
}

// scaled / 2^frac, rounded, halves away from zero.
static int64_t rounded(const int64_t scaled, const uint32_t frac) {
    const int64_t half = frac == 0u ? 0 : (int64_t) 1 << (frac - 1u);
    const int64_t size = ((scaled < 0 ? -scaled : scaled) + half) >> frac;
    return scaled < 0 ? -size : size;
}

int32_t text_hundredths_of_half_turns(const int32_t word, const uint32_t frac) {
    // |word| < 2^31, so the product stays below 2^46.
    return (int32_t) rounded((int64_t) word * 18000, frac);
}

int32_t text_hundredths_of(const int32_t word, const int32_t frac) {
    if (frac < -24 && word != 0) {
        return word > 0 ? INT32_MAX : -INT32_MAX;
    }
    // The product stays below 2^38, and below 2^62 with its whole bits.
    const int64_t scaled = (int64_t) word * 100;
    const uint32_t up = frac < 0 && word != 0 ? (uint32_t) -frac : 0u;
    const uint32_t down = frac > 61 ? 61u : frac > 0 ? (uint32_t) frac : 0u;
    const int64_t value = rounded(scaled * ((int64_t) 1 << up), down);
    return value > INT32_MAX ? INT32_MAX : value < -INT32_MAX ? -INT32_MAX : (int32_t) value;
}

//------------------------------------------------------------------------------
// End of file
