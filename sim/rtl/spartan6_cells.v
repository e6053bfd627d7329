// Block RAM of Spartan-6, RAMB16BWER and RAMB8BWER, by Xilinx UG383 (Block RAM resources).
//
// DATA and PARITY are INIT_00... and INITP_00... side by side, which the netlist's writer does.
// What a port reads that the other one writes at the same edge is defined with READ_FIRST alone.
// Output registers (DOx_REG) and resets other than SYNC are not there: using one is fatal.

module RAMB16BWER #(
    parameter [16383:0] DATA = 0,
    parameter [2047:0] PARITY = 0,
    parameter DATA_WIDTH_A = 0, DATA_WIDTH_B = 0, DOA_REG = 0, DOB_REG = 0,
    parameter WRITE_MODE_A = "WRITE_FIRST", WRITE_MODE_B = "WRITE_FIRST", RSTTYPE = "SYNC",
    parameter RST_PRIORITY_A = "CE", RST_PRIORITY_B = "CE",
    parameter EN_RSTRAM_A = "TRUE", EN_RSTRAM_B = "TRUE",
    parameter [35:0] SRVAL_A = 0, SRVAL_B = 0
) (
    input CLKA, CLKB, ENA, ENB, REGCEA, REGCEB, RSTA, RSTB,
    input [13:0] ADDRA, ADDRB,
    input [3:0] WEA, WEB, DIPA, DIPB,
    input [31:0] DIA, DIB,
    output [31:0] DOA, DOB,
    output [3:0] DOPA, DOPB
);
    initial if (DOA_REG || DOB_REG) $fatal(1, "DOx_REG of RAMB16BWER is not simulated");
    always @(posedge CLKA) if (RSTTYPE != "SYNC" && (RSTA || RSTB))
        $fatal(1, "an asynchronous reset of a block RAM is not simulated");
    block_ram #(
        .WORDS(512), .DATA(DATA), .PARITY(PARITY), .WIDTH_A(DATA_WIDTH_A), .WIDTH_B(DATA_WIDTH_B),
        .MODE_A(WRITE_MODE_A), .MODE_B(WRITE_MODE_B),
        .SRVAL_A(SRVAL_A), .SRVAL_B(SRVAL_B)
    ) ram (
        .clk_a(CLKA), .clk_b(CLKB), .en_a(ENA), .en_b(ENB), .rst_a(RSTA), .rst_b(RSTB),
        .addr_a(ADDRA), .addr_b(ADDRB), .we_a(WEA), .we_b(WEB), .writes_a(|WEA), .writes_b(|WEB),
        .di_a({DIPA, DIA}), .di_b({DIPB, DIB}), .do_a({DOPA, DOA}), .do_b({DOPB, DOB})
    );
endmodule

// In SDP mode of 36 bits port A writes and port B reads: each has both halves.
module RAMB8BWER #(
    parameter [8191:0] DATA = 0,
    parameter [1023:0] PARITY = 0,
    parameter RAM_MODE = "TDP",
    parameter DATA_WIDTH_A = 0, DATA_WIDTH_B = 0, DOA_REG = 0, DOB_REG = 0,
    parameter WRITE_MODE_A = "WRITE_FIRST", WRITE_MODE_B = "WRITE_FIRST", RSTTYPE = "SYNC",
    parameter RST_PRIORITY_A = "CE", RST_PRIORITY_B = "CE",
    parameter EN_RSTRAM_A = "TRUE", EN_RSTRAM_B = "TRUE",
    parameter [17:0] SRVAL_A = 0, SRVAL_B = 0
) (
    input CLKAWRCLK, CLKBRDCLK, ENAWREN, ENBRDEN, REGCEA, REGCEBREGCE, RSTA, RSTBRST,
    input [12:0] ADDRAWRADDR, ADDRBRDADDR,
    input [1:0] WEAWEL, WEBWEU, DIPADIP, DIPBDIP,
    input [15:0] DIADI, DIBDI,
    output [15:0] DOADO, DOBDO,
    output [1:0] DOPADOP, DOPBDOP
);
    localparam SDP = RAM_MODE == "SDP";
    initial if (DOA_REG || DOB_REG) $fatal(1, "DOx_REG of RAMB8BWER is not simulated");
    always @(posedge CLKAWRCLK) if (RSTTYPE != "SYNC" && (!SDP && RSTA || RSTBRST))
        $fatal(1, "an asynchronous reset of a block RAM is not simulated");
    wire [35:0] do_a, do_b;
    assign {DOPBDOP, DOBDO} = SDP ? {do_b[35:34], do_b[31:16]} : {do_b[33:32], do_b[15:0]};
    assign {DOPADOP, DOADO} = SDP ? {do_b[33:32], do_b[15:0]} : {do_a[33:32], do_a[15:0]};
    block_ram #(
        .WORDS(256), .DATA(DATA), .PARITY(PARITY), .WIDTH_A(DATA_WIDTH_A), .WIDTH_B(DATA_WIDTH_B),
        .MODE_A(WRITE_MODE_A), .MODE_B(WRITE_MODE_B),
        .SRVAL_A({2'd0, SRVAL_A[17:16], 16'd0, SRVAL_A[15:0]}),
        .SRVAL_B(SDP ? {SRVAL_B[17:16], SRVAL_A[17:16], SRVAL_B[15:0], SRVAL_A[15:0]}
                     : {2'd0, SRVAL_B[17:16], 16'd0, SRVAL_B[15:0]})
    ) ram (
        .clk_a(CLKAWRCLK), .clk_b(CLKBRDCLK), .en_a(ENAWREN), .en_b(ENBRDEN),
        .rst_a(!SDP && RSTA), .rst_b(RSTBRST), .addr_a(ADDRAWRADDR), .addr_b(ADDRBRDADDR),
        .we_a(SDP ? {WEBWEU, WEAWEL} : {2'd0, WEAWEL}), .we_b(SDP ? 4'd0 : {2'd0, WEBWEU}),
        .writes_a(|WEAWEL || SDP && |WEBWEU), .writes_b(!SDP && |WEBWEU),
        .di_a({SDP ? DIPBDIP : 2'd0, DIPADIP, SDP ? DIBDI : 16'd0, DIADI}),
        .di_b({2'd0, DIPBDIP, 16'd0, DIBDI}), .do_a(do_a), .do_b(do_b)
    );
endmodule
