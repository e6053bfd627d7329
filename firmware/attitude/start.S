/* From reset to main. RV32IM, ilp32. */

    .section .init, "ax"
    .globl _start
_start:
    .option push
    .option norelax
    la gp, __global_pointer$
    .option pop
    la tp, _tls_begin
    la sp, _stack_top
    la t0, _bss_begin
    la t1, _bss_end
    j 2f
1:  sw zero, 0(t0)
    addi t0, t0, 4
2:  bltu t0, t1, 1b
    call main
3:  j 3b
