/* From reset to main, and the way in and out of traps. RV32IM, ilp32. */

    .section .init, "ax"
    .globl _start
_start:
    .option push
    .option norelax
    la gp, __global_pointer$
    .option pop
    la tp, _tls_begin
    la sp, _stack_top
    la t0, trap_entry
    csrw mtvec, t0
    csrw mie, zero
    csrw 0xBC0, zero

    /* What lies below the stack pointer gets a pattern, so that its depth can be seen. */
    la t0, _stack_bottom
    li t1, 0x5ADDC0DE
1:  sw t1, 0(t0)
    addi t0, t0, 4
    bltu t0, sp, 1b

    /* Data comes from the protected part, so that a restart finds it as new. */
    la t0, _data_begin
    la t1, _data_end
    la t2, _data_image
    j 3f
2:  lw t3, 0(t2)
    sw t3, 0(t0)
    addi t0, t0, 4
    addi t2, t2, 4
3:  bltu t0, t1, 2b

    la t0, _bss_begin
    la t1, _bss_end
    j 5f
4:  sw zero, 0(t0)
    addi t0, t0, 4
5:  bltu t0, t1, 4b

    call soc_begin
    call main
    /* main does not return; if it does, the watchdog restarts it. */
6:  j 6b

    .section .text.trap_entry, "ax"
    .align 2
trap_entry:
    addi sp, sp, -64
    sw ra, 0(sp)
    sw t0, 4(sp)
    sw t1, 8(sp)
    sw t2, 12(sp)
    sw a0, 16(sp)
    sw a1, 20(sp)
    sw a2, 24(sp)
    sw a3, 28(sp)
    sw a4, 32(sp)
    sw a5, 36(sp)
    sw a6, 40(sp)
    sw a7, 44(sp)
    sw t3, 48(sp)
    sw t4, 52(sp)
    sw t5, 56(sp)
    sw t6, 60(sp)
    csrr a0, mcause
    csrr a1, mepc
    call soc_trap
    lw ra, 0(sp)
    lw t0, 4(sp)
    lw t1, 8(sp)
    lw t2, 12(sp)
    lw a0, 16(sp)
    lw a1, 20(sp)
    lw a2, 24(sp)
    lw a3, 28(sp)
    lw a4, 32(sp)
    lw a5, 36(sp)
    lw a6, 40(sp)
    lw a7, 44(sp)
    lw t3, 48(sp)
    lw t4, 52(sp)
    lw t5, 56(sp)
    lw t6, 60(sp)
    addi sp, sp, 64
    mret

    /* Mask and pending bits of the interrupt array; interrupts on. */
    .section .text.soc_write_mask, "ax"
    .globl soc_write_mask
soc_write_mask:
    csrw 0xBC0, a0
    ret

    .section .text.soc_read_mask, "ax"
    .globl soc_read_mask
soc_read_mask:
    csrr a0, 0xBC0
    ret

    .section .text.soc_read_pending, "ax"
    .globl soc_read_pending
soc_read_pending:
    csrr a0, 0xFC0
    ret

    .section .text.soc_interrupts_on, "ax"
    .globl soc_interrupts_on
soc_interrupts_on:
    li t0, 0x800
    csrs mie, t0
    csrsi mstatus, 8
    ret
