// Cells of ECP5 that yosys' library lacks: DP16KD as Lattice FPGA-TN-02204 (ECP5 memory usage guide)
// and Lattice's simulation library for DP16KC, the same cell of ECP3, describe it; MULT18X18D as its
// simulation library does.
//
// Pins with numbers are vectors here, and CONTENTS is INITVAL_00... side by side; the netlist's
// writer does both. What is not there is fatal to use: asynchronous resets, ports of 1 or 2 bits that
// are written (their data enter by other pins), 18 bits written through, registers by other clocks,
// enables and resets than those with the number 0, sources other than A and B.

module DP16KD #(
    parameter [64*320-1:0] CONTENTS = 0,  // rows of 18 bits, each in 20
    parameter DATA_WIDTH_A = 18, DATA_WIDTH_B = 18, REGMODE_A = "NOREG", REGMODE_B = "NOREG",
    parameter RESETMODE = "SYNC", ASYNC_RESET_RELEASE = "SYNC", GSR = "ENABLED",
    parameter CSDECODE_A = "0b000", CSDECODE_B = "0b000", CLKAMUX = "CLKA", CLKBMUX = "CLKB",
    parameter WRITEMODE_A = "NORMAL", WRITEMODE_B = "NORMAL"
) (
    input CLKA, CLKB, CEA, CEB, OCEA, OCEB, WEA, WEB, RSTA, RSTB,
    input [2:0] CSA, CSB,
    input [13:0] ADA, ADB,
    input [17:0] DIA, DIB,
    output [17:0] DOA, DOB
);
    localparam WIDE_IN = DATA_WIDTH_A == 36, WIDE_OUT = DATA_WIDTH_B == 36;  // by both ports' pins
    initial if (CLKAMUX != "CLKA" || CLKBMUX != "CLKB"
                || CSDECODE_A != "0b000" || CSDECODE_B != "0b000"
                || WRITEMODE_A == "WRITETHROUGH" && DATA_WIDTH_A > 9
                || WRITEMODE_B == "WRITETHROUGH" && DATA_WIDTH_B > 9)
        $fatal(1, "a mode of DP16KD is not simulated");
    always @(posedge CLKA) begin
        if (RESETMODE != "SYNC" && (RSTA || RSTB))
            $fatal(1, "an asynchronous reset of DP16KD is not simulated");
        if (CEA && WEA && DATA_WIDTH_A < 4 || CEB && WEB && DATA_WIDTH_B < 4)
            $fatal(1, "a port of DP16KD of 1 or 2 bits that is written is not simulated");
    end

    function [8*40-1:0] mode(input [8*40-1:0] name);
        mode = name == "WRITETHROUGH" ? "WRITE_FIRST"
             : name == "READBEFOREWRITE" ? "READ_FIRST" : "NO_CHANGE";
    endfunction

    // A port of 18 bits or more has its byte enables at the low bits of its address.
    wire go_a = CEA && CSA == 0 && !RSTA, go_b = CEB && CSB == 0 && !RSTB;
    wire [3:0] we_a = !(go_a && WEA) ? 4'd0 : WIDE_IN ? ADA[3:0]
                    : DATA_WIDTH_A == 18 ? {2'd0, ADA[1:0]} : 4'd1;
    wire [3:0] we_b = !(go_b && WEB && !WIDE_OUT) ? 4'd0
                    : DATA_WIDTH_B == 18 ? {2'd0, ADB[1:0]} : 4'd1;
    wire [35:0] word_a, word_b;
    nine_bit_ram #(
        .CONTENTS(CONTENTS), .WIDTH_A(DATA_WIDTH_A), .WIDTH_B(DATA_WIDTH_B),
        .MODE_A(mode(WRITEMODE_A)), .MODE_B(mode(WRITEMODE_B))
    ) ram (
        .clk_a(CLKA), .clk_b(CLKB), .en_a(go_a || RSTA), .en_b(go_b || RSTB),
        .rst_a(RSTA), .rst_b(RSTB), .addr_a(ADA), .addr_b(ADB), .we_a(we_a), .we_b(we_b),
        .writes_a(WEA), .writes_b(WEB && !WIDE_OUT),
        .di_a({WIDE_IN ? DIB : 18'd0, DIA}), .di_b({18'd0, DIB}), .do_a(word_a), .do_b(word_b)
    );
    wire [17:0] now_a = WIDE_OUT ? word_b[17:0] : word_a[17:0];
    wire [17:0] now_b = WIDE_OUT ? word_b[35:18] : word_b[17:0];
    reg [17:0] later_a = 0, later_b = 0, later_low = 0;
    always @(posedge CLKA) if (OCEA) later_a <= RSTA ? 18'd0 : now_a;
    always @(posedge CLKB) if (OCEB) {later_b, later_low} <= RSTB ? 36'd0 : {now_b, now_a};
    assign DOA = REGMODE_A != "OUTREG" ? now_a : WIDE_OUT ? later_low : later_a;
    assign DOB = REGMODE_B == "OUTREG" ? later_b : now_b;
endmodule

// With CLK0_DIV enabled, the default, a register takes both edges of half the clock: one of each
// period of the clock itself.
module MULT18X18D #(
    parameter REG_INPUTA_CLK = "NONE", REG_INPUTA_CE = "CE0", REG_INPUTA_RST = "RST0",
    parameter REG_INPUTB_CLK = "NONE", REG_INPUTB_CE = "CE0", REG_INPUTB_RST = "RST0",
    parameter REG_PIPELINE_CLK = "NONE", REG_PIPELINE_CE = "CE0", REG_PIPELINE_RST = "RST0",
    parameter REG_OUTPUT_CLK = "NONE", REG_OUTPUT_CE = "CE0", REG_OUTPUT_RST = "RST0",
    parameter CLK0_DIV = "ENABLED", MULT_BYPASS = "DISABLED", SOURCEB_MODE = "B_SHIFT",
    parameter RESETMODE = "SYNC", GSR = "ENABLED"
) (
    input [3:0] CLK, CE, RST,
    input [17:0] A, B, C,
    input SIGNEDA, SIGNEDB, SOURCEA, SOURCEB,
    output [35:0] P
);
    localparam HELD_A = REG_INPUTA_CLK != "NONE", HELD_B = REG_INPUTB_CLK != "NONE";
    localparam HELD_M = REG_PIPELINE_CLK != "NONE", HELD_P = REG_OUTPUT_CLK != "NONE";
    initial if (HELD_A && {REG_INPUTA_CLK, REG_INPUTA_CE, REG_INPUTA_RST} != "CLK0CE0RST0"
                || HELD_B && {REG_INPUTB_CLK, REG_INPUTB_CE, REG_INPUTB_RST} != "CLK0CE0RST0"
                || HELD_M && {REG_PIPELINE_CLK, REG_PIPELINE_CE, REG_PIPELINE_RST} != "CLK0CE0RST0"
                || HELD_P && {REG_OUTPUT_CLK, REG_OUTPUT_CE, REG_OUTPUT_RST} != "CLK0CE0RST0"
                || CLK0_DIV != "ENABLED" || MULT_BYPASS != "DISABLED" || SOURCEB_MODE != "B_SHIFT"
                || RESETMODE != "SYNC")
        $fatal(1, "a mode of MULT18X18D is not simulated");
    reg [18:0] a = 0, b = 0;  // signed or not, and the number
    reg [35:0] m = 0, p = 0;
    wire [18:0] left = HELD_A ? a : {SIGNEDA, A}, right = HELD_B ? b : {SIGNEDB, B};
    wire [35:0] product = {{18{left[18] & left[17]}}, left[17:0]}
                        * {{18{right[18] & right[17]}}, right[17:0]};
    wire [35:0] sum = HELD_M ? m : product;
    always @(posedge CLK[0]) begin
        if (SOURCEA || SOURCEB) $fatal(1, "a source of MULT18X18D is not simulated");
        if (RST[0]) {a, b, m, p} <= 0;
        else if (CE[0]) {a, b, m, p} <= {SIGNEDA, A, SIGNEDB, B, product, sum};
    end
    assign P = HELD_P ? p : sum;
endmodule
