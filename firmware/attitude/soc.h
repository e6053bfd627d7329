/**
 * @file soc.h
 * @brief Devices of the soft core.
 */

#ifndef SOC_H
#define SOC_H

//------------------------------------------------------------------------------
// Includes

#include "soc_registers.h"

#include <stdbool.h>
#include <stdint.h>

//------------------------------------------------------------------------------
// Definitions

#define SOC_CONTROL ((volatile uint32_t *) SOC_CONTROL_BASE)
#define SOC_SLOT ((volatile uint32_t *) SOC_SLOT_BASE)

// Why the processor was last stopped by a trap that is no interrupt; survives a restart.
typedef struct {
    uint32_t count; // how often since power was switched on
    uint32_t cause; // mcause
    uint32_t pc;    // mepc
} soc_crash_t;

//------------------------------------------------------------------------------
// Function declarations

// Called before main: fences the code off, kicks the watchdog.
void soc_begin(void);

// Called for every trap. An interrupt goes to soc_interrupt, anything else restarts the processor.
void soc_trap(uint32_t cause, uint32_t pc);

// To be written by the program: an interrupt of the array; pending: SOC_INTERRUPT_ bits.
void soc_interrupt(uint32_t pending);

// What the crashes were.
soc_crash_t soc_crash(void);

// Lets the interrupts of the mask through.
void soc_enable(uint32_t mask);

// Masks them all; returns what to give to soc_unmask.
uint32_t soc_mask(void);
void soc_unmask(uint32_t mask);

// Bytes of stack that have been in use at most.
uint32_t soc_stack_used(void);

// Bytes of stack there are.
uint32_t soc_stack_size(void);

// Whether the last word of the stack still is as it was.
bool soc_stack_whole(void);

// Sends a byte, waits for its turn, for one byte's time at most.
void soc_put(uint8_t byte);

// A byte, or -1 if none has come.
int soc_get(void);

//------------------------------------------------------------------------------
// Functions

// Clock cycles, modulo 2^32.
static inline uint32_t soc_cycles(void) {
    return SOC_CONTROL[SOC_CYCLES_ADDR];
}

// To be called more often than the watchdog's time.
static inline void soc_kick(void) {
    SOC_CONTROL[SOC_WATCHDOG_ADDR] = SOC_WATCHDOG_KICK;
}

#endif

//------------------------------------------------------------------------------
// End of file
