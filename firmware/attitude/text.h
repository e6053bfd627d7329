/**
 * @file text.h
 * @brief Numbers and lines of text to the console.
 */

#ifndef TEXT_H
#define TEXT_H

//------------------------------------------------------------------------------
// Includes

#include <stdint.h>

//------------------------------------------------------------------------------
// Function declarations

// Text up to its null character.
void text_put(const char *text);

// An unsigned number in decimal.
void text_unsigned(uint32_t value);

// A signed number with two decimals: 100 times the value is given.
void text_hundredths(int32_t value);

// Carriage return, line feed.
void text_end(void);

// 100 times the value, rounded, of a word with this many fraction bits; clamped.
int32_t text_hundredths_of(int32_t word, int32_t frac);

// 100 times the angle in degrees, rounded, of a word with this many bits below one half turn.
int32_t text_hundredths_of_half_turns(int32_t word, uint32_t frac);

#endif

//------------------------------------------------------------------------------
// End of file
