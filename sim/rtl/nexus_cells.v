// Block RAM of Nexus, which yosys' library has no behaviour for: of a write and a read port, with one
// clock or two, as Lattice FPGA-TN-02094 (Nexus memory user guide) and yosys' rules for their use
// describe it. With one clock what is read while it is written is the word before.
//
// CONTENTS is INITVAL_00... side by side; the netlist's writer does that. What is not there is fatal
// to use: asynchronous resets and the output register.

module PDP16K #(
    parameter [64*320-1:0] CONTENTS = 0,
    parameter DATA_WIDTH_W = "X36", DATA_WIDTH_R = "X36", OUTREG = "BYPASSED",
    parameter RESETMODE = "SYNC", ASYNC_RST_RELEASE = "SYNC", GSR = "ENABLED", ECC = "DISABLED",
    parameter CSDECODE_W = "111", CSDECODE_R = "111", SHARED = 0
) (
    input CLKW, CLKR, CEW, CER, RST,
    input [2:0] CSW, CSR,
    input [13:0] ADW, ADR,
    input [35:0] DI,
    output [35:0] DO
);
    function integer width(input [23:0] name);
        width = name == "X36" ? 36 : name == "X18" ? 18 : name == "X9" ? 9
              : name == "X4" ? 4 : name == "X2" ? 2 : 1;
    endfunction
    initial if (OUTREG != "BYPASSED" || ECC != "DISABLED"
                || CSDECODE_W != "111" || CSDECODE_R != "111")
        $fatal(1, "a mode of PDP16K is not simulated");
    always @(posedge CLKR) if (RESETMODE != "SYNC" && RST)
        $fatal(1, "an asynchronous reset of PDP16K is not simulated");

    // A port of 18 bits or more has its byte enables at the low bits of its address.
    localparam WIDE = width(DATA_WIDTH_W);
    wire [3:0] we = !(CEW && &CSW) ? 4'd0 : WIDE == 36 ? ADW[3:0] : WIDE == 18 ? ADW[1:0] : 4'd1;
    nine_bit_ram #(
        .CONTENTS(CONTENTS), .UPPER(10), .WIDTH_A(WIDE), .WIDTH_B(width(DATA_WIDTH_R)),
        .MODE_A("READ_FIRST"), .SHARED(SHARED)
    ) ram (
        .clk_a(CLKW), .en_a(1'b1), .rst_a(1'b0), .writes_a(1'b1), .addr_a(ADW), .we_a(we),
        .di_a(DI), .clk_b(CLKR), .en_b(CER && &CSR), .rst_b(RST), .writes_b(1'b0), .addr_b(ADR),
        .we_b(4'd0), .di_b(36'd0), .do_a(), .do_b(DO)
    );
endmodule

module PDPSC16K #(
    parameter [64*320-1:0] CONTENTS = 0,
    parameter DATA_WIDTH_W = "X36", DATA_WIDTH_R = "X36", OUTREG = "BYPASSED",
    parameter RESETMODE = "SYNC", ASYNC_RST_RELEASE = "SYNC", GSR = "ENABLED", ECC = "DISABLED",
    parameter CSDECODE_W = "111", CSDECODE_R = "111"
) (
    input CLK, CEW, CER, RST,
    input [2:0] CSW, CSR,
    input [13:0] ADW, ADR,
    input [35:0] DI,
    output [35:0] DO
);
    PDP16K #(
        .CONTENTS(CONTENTS), .DATA_WIDTH_W(DATA_WIDTH_W), .DATA_WIDTH_R(DATA_WIDTH_R),
        .OUTREG(OUTREG), .RESETMODE(RESETMODE), .ECC(ECC), .CSDECODE_W(CSDECODE_W),
        .CSDECODE_R(CSDECODE_R), .SHARED(1)
    ) ram (
        .CLKW(CLK), .CLKR(CLK), .CEW(CEW), .CER(CER), .RST(RST), .CSW(CSW), .CSR(CSR),
        .ADW(ADW), .ADR(ADR), .DI(DI), .DO(DO)
    );
endmodule
