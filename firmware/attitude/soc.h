/**
 * @file soc.h
 * @brief Memory map of the soft core; gateware/attitude/soc.py has the same.
 */

#ifndef SOC_H
#define SOC_H

#include <stdint.h>

#define SOC_CYCLES (*(volatile uint32_t *) UINT32_C(0x80000000))  // clock cycles, modulo 2^32
#define SOC_WORD (*(volatile uint32_t *) UINT32_C(0x80000008))    // a written word goes to the bench
#define SOC_SLOT ((volatile uint32_t *) UINT32_C(0x80004000))     // words of the device

#endif
