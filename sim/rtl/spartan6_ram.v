// Block RAM of Spartan-6, RAMB16BWER and RAMB8BWER, by Xilinx UG383 (Block RAM resources).
//
// A port of 36, 18 or 9 bits has 4, 2 or 1 parity bits; one of 4, 2 or 1 bits has none. Addresses
// count bits: a port of D data bits leaves out the last log2 D. DATA and PARITY are INIT_00... and
// INITP_00... side by side, which the netlist's writer does. What a port reads that the other
// one writes at the same edge is defined with READ_FIRST alone; otherwise it is random here.
// Both ports have one clock.
// Output registers (DOx_REG) and resets other than SYNC are not there: using one is fatal.

module spartan6_ram #(
    parameter WORDS = 512,
    parameter [32*WORDS-1:0] DATA = 0,
    parameter [4*WORDS-1:0] PARITY = 0,
    parameter WIDTH_A = 0, WIDTH_B = 0,  // of a port, with parity; 0: not used
    parameter MODE_A = "WRITE_FIRST", MODE_B = "WRITE_FIRST",
    parameter SYNC = 0,
    parameter [35:0] SRVAL_A = 0, SRVAL_B = 0
) (
    input clk_a, clk_b, en_a, en_b, rst_a, rst_b,
    input [$clog2(WORDS)+4:0] addr_a, addr_b,
    input [3:0] we_a, we_b,
    input [35:0] di_a, di_b,  // parity above data
    output reg [35:0] do_a, do_b
);
    reg [31:0] data [0:WORDS-1];
    reg [3:0] parity [0:WORDS-1];

    function [31:0] bits(input integer width);  // data bits of a port
        bits = width < 8 ? width : width - width / 9;
    endfunction

    // The bits of a word that a port has, at bit 0.
    function [31:0] mask(input integer width);
        mask = 32'hffffffff >> (32 - bits(width));
    endfunction
    function [4:0] at(input [4:0] low, input integer width);
        at = low & ~(bits(width) - 1);
    endfunction

    // What a port writes: the bits of the word that change, data and parity.
    function [35:0] written(input [3:0] we, input [4:0] low, input integer width);
        reg [31:0] lanes;
        begin
            lanes = width < 8 ? {32{we[0]}} : {{8{we[3]}}, {8{we[2]}}, {8{we[1]}}, {8{we[0]}}};
            written[31:0] = (lanes & mask(width)) << at(low, width);
            written[35:32] = width < 9 ? 4'd0 : (we & mask(width / 9)) << (at(low, width) >> 3);
        end
    endfunction
    function [35:0] placed(input [35:0] word, input [4:0] low, input integer width);
        placed = {word[35:32] << (at(low, width) >> 3), word[31:0] << at(low, width)};
    endfunction
    function [35:0] read(input [35:0] word, input [4:0] low, input integer width);
        read = {width < 9 ? 4'd0 : word[35:32] >> (at(low, width) >> 3) & mask(width / 9),
                word[31:0] >> at(low, width) & mask(width)};
    endfunction

    wire [$clog2(WORDS)-1:0] word_a = addr_a[$clog2(WORDS)+4:5], word_b = addr_b[$clog2(WORDS)+4:5];
    wire [35:0] change_a = en_a && WIDTH_A != 0 ? written(we_a, addr_a[4:0], WIDTH_A) : 36'd0;
    wire [35:0] change_b = en_b && WIDTH_B != 0 ? written(we_b, addr_b[4:0], WIDTH_B) : 36'd0;
    wire [35:0] old_a = {parity[word_a], data[word_a]}, old_b = {parity[word_b], data[word_b]};
    wire [35:0] new_a = old_a & ~change_a | placed(di_a, addr_a[4:0], WIDTH_A) & change_a;
    wire [35:0] new_b = old_b & ~change_b | placed(di_b, addr_b[4:0], WIDTH_B) & change_b;
    // What the other port writes at this edge, to other bits of the word, stays as well.
    wire same = word_a == word_b;
    wire [35:0] next_a = same ? new_a & ~change_b | new_b & change_b : new_a;
    wire [35:0] next_b = same ? new_b & ~change_a | new_a & change_a : new_b;
    wire [35:0] unknown_a = same && MODE_B != "READ_FIRST" ? change_b : 36'd0;
    wire [35:0] unknown_b = same && MODE_A != "READ_FIRST" ? change_a : 36'd0;

    integer k;
    initial begin
        for (k = 0; k < WORDS; k = k + 1) begin
            data[k] = DATA[32*k +: 32];
            parity[k] = PARITY[4*k +: 4];
        end
        do_a = 0;
        do_b = 0;
    end
    always @(posedge clk_a) if (en_a && WIDTH_A != 0) begin
        if (|change_a) {parity[word_a], data[word_a]} <= next_a;
        if (rst_a && SYNC == 0) $fatal(1, "an asynchronous reset of a block RAM is not simulated");
        if (rst_a) do_a <= SRVAL_A;
        else if (~|change_a || MODE_A != "NO_CHANGE")
            do_a <= read((MODE_A == "WRITE_FIRST" ? new_a : old_a)
                         ^ unknown_a & {$random, $random}, addr_a[4:0], WIDTH_A);
    end
    always @(posedge clk_b) if (en_b && WIDTH_B != 0) begin
        if (|change_b) {parity[word_b], data[word_b]} <= next_b;
        if (rst_b && SYNC == 0) $fatal(1, "an asynchronous reset of a block RAM is not simulated");
        if (rst_b) do_b <= SRVAL_B;
        else if (~|change_b || MODE_B != "NO_CHANGE")
            do_b <= read((MODE_B == "WRITE_FIRST" ? new_b : old_b)
                         ^ unknown_b & {$random, $random}, addr_b[4:0], WIDTH_B);
    end
endmodule

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
    spartan6_ram #(
        .WORDS(512), .DATA(DATA), .PARITY(PARITY), .WIDTH_A(DATA_WIDTH_A), .WIDTH_B(DATA_WIDTH_B),
        .MODE_A(WRITE_MODE_A), .MODE_B(WRITE_MODE_B), .SYNC(RSTTYPE == "SYNC"),
        .SRVAL_A(SRVAL_A), .SRVAL_B(SRVAL_B)
    ) ram (
        .clk_a(CLKA), .clk_b(CLKB), .en_a(ENA), .en_b(ENB), .rst_a(RSTA), .rst_b(RSTB),
        .addr_a(ADDRA), .addr_b(ADDRB), .we_a(WEA), .we_b(WEB),
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
    wire [35:0] do_a, do_b;
    assign {DOPBDOP, DOBDO} = SDP ? {do_b[35:34], do_b[31:16]} : {do_b[33:32], do_b[15:0]};
    assign {DOPADOP, DOADO} = SDP ? {do_b[33:32], do_b[15:0]} : {do_a[33:32], do_a[15:0]};
    spartan6_ram #(
        .WORDS(256), .DATA(DATA), .PARITY(PARITY), .WIDTH_A(DATA_WIDTH_A), .WIDTH_B(DATA_WIDTH_B),
        .MODE_A(WRITE_MODE_A), .MODE_B(WRITE_MODE_B), .SYNC(RSTTYPE == "SYNC"),
        .SRVAL_A({2'd0, SRVAL_A[17:16], 16'd0, SRVAL_A[15:0]}),
        .SRVAL_B(SDP ? {SRVAL_B[17:16], SRVAL_A[17:16], SRVAL_B[15:0], SRVAL_A[15:0]}
                     : {2'd0, SRVAL_B[17:16], 16'd0, SRVAL_B[15:0]})
    ) ram (
        .clk_a(CLKAWRCLK), .clk_b(CLKBRDCLK), .en_a(ENAWREN), .en_b(ENBRDEN),
        .rst_a(!SDP && RSTA), .rst_b(RSTBRST), .addr_a(ADDRAWRADDR), .addr_b(ADDRBRDADDR),
        .we_a(SDP ? {WEBWEU, WEAWEL} : {2'd0, WEAWEL}), .we_b(SDP ? 4'd0 : {2'd0, WEBWEU}),
        .di_a({SDP ? DIPBDIP : 2'd0, DIPADIP, SDP ? DIBDI : 16'd0, DIADI}),
        .di_b({2'd0, DIPBDIP, 16'd0, DIBDI}), .do_a(do_a), .do_b(do_b)
    );
endmodule
